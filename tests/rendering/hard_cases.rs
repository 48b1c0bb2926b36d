//! Scenes and settings at the border of what makes sense: finite pictures, no panic, no light where none can be.

use glam::{Vec2, Vec3};
use macula::scene::Scene;
use macula::scene::bvh::SceneCaster;

use crate::maker::{Picture, Recipe, Stage, bundled, gpu, lambert, mean};
use crate::shared::shared;

fn assert_sound(picture: &Picture, what: &str) {
    let values = picture.image.rgb.as_flattened();
    let is_sound = values.iter().all(|x| x.is_finite() && *x >= 0.0);
    assert!(is_sound, "{what} has values that no radiance has");
}

fn plane(stage: Stage) -> Stage {
    let (u, v) = (4.0 * Vec3::X, -4.0 * Vec3::Z);
    stage.quad(Vec3::new(-2.0, 0.0, 2.0), u, v, lambert([0.5; 3]))
}

fn viewer() -> Stage {
    Stage::new(Vec3::new(0.0, 1.0, 2.0), Vec3::ZERO)
}

#[test]
fn no_geometry_no_light_and_no_photons_make_black_or_direct_pictures() {
    let empty = viewer().load();
    let unlit = plane(viewer()).load();
    let only_a_light = viewer().point_light(Vec3::Y, 1.0).load();
    let lit = plane(viewer()).point_light(Vec3::Y, 1.0).load();
    for technique in ["pm-direct", "pm"] {
        let recipe = Recipe::new(technique).size(16, 16);
        for (scene, what) in [
            (&empty, "an empty scene"),
            (&unlit, "a scene without light"),
            (&only_a_light, "a light and nothing to light"),
        ] {
            let picture = recipe.render_scene(scene);
            assert_eq!(mean(&picture.image), [0.0; 3], "{technique}: {what}");
        }
        let without = recipe.clone().set("photon.count", "0").render_scene(&lit);
        assert_sound(&without, "a picture without photons");
        assert_eq!(without.count("photons_stored"), 0.0);
        assert_eq!(mean(&without.image)[0] > 0.0, technique == "pm-direct");
        let with = recipe.render_scene(&lit);
        assert!(mean(&with.image)[0] > 0.0, "{technique}: light is seen");
    }
}

#[test]
fn pictures_of_any_size_are_finite_and_lit() {
    let cornell = Scene::load(&bundled("cornell.glb")).unwrap();
    for (width, height) in [(1, 1), (1, 17), (33, 1), (31, 65)] {
        let recipe = Recipe::new("pm-direct").size(width, height);
        let picture = recipe.set("photon.count", "2000").render_scene(&cornell);
        let what = format!("{width}x{height}");
        assert_sound(&picture, &what);
        assert_eq!(picture.image.rgb.len(), (width * height) as usize);
        assert!(mean(&picture.image)[0] > 0.0, "{what}");
    }
}

#[test]
fn an_eye_inside_matter_or_on_a_surface_sees_something_finite() {
    let cornell = Scene::load(&bundled("cornell.glb")).unwrap();
    let mesh = &cornell.static_mesh;
    let glass = |triangle: usize| {
        let material = mesh.material_of_triangle[triangle] as usize;
        cornell.materials[material].transmission > 0.0
    };
    let corner = |triangle: usize| mesh.corners(triangle)[0];
    let on_glass: Vec<Vec3> = (0..mesh.triangles.len())
        .filter(|triangle| glass(*triangle))
        .map(corner)
        .collect();
    assert!(!on_glass.is_empty());
    let middle = on_glass.iter().sum::<Vec3>() / on_glass.len() as f32;
    for (place, what) in [
        (middle, "inside the glass ball"),
        (on_glass[0], "on the glass"),
        (cornell.bounds.max, "in a corner of the room"),
        (Vec3::splat(1e4), "far outside"),
    ] {
        let mut scene = cornell.clone();
        scene.cameras[0].pose.position_m = place;
        let recipe = Recipe::new("pm-direct").size(24, 24);
        assert_sound(&recipe.render_scene(&scene), what);
    }
}

#[test]
fn extreme_parameters_give_finite_pictures() {
    let cornell = Scene::load(&bundled("cornell.glb")).unwrap();
    let recipe = || Recipe::new("pm").size(16, 16).set("photon.count", "500");
    for (key, value) in [
        ("gather.radius_m", "1000000"),
        ("gather.radius_m", "0.0000001"),
        ("photon.count", "1"),
        ("photon.depth_max", "1"),
        ("photon.stored_per_path", "0.01"),
        ("eye.chain_max", "1"),
        ("direct.candidates", "64"),
        ("fovea.samples", "64"),
        ("gather.flatness", "0.01"),
    ] {
        let picture = recipe().set(key, value).render_scene(&cornell);
        assert_sound(&picture, &format!("{key}={value}"));
    }
    gpu().wait("what is left").unwrap();
}

/// Lit pixels of the room beside a bright one that see nothing within `reach_m` of the partition at x = 0. Pixels are judged by
/// what their middle and corners see.
fn lit_far_from_the_partition(scene: &Scene, picture: &Picture, reach_m: f32) -> usize {
    let (caster, pose) = (SceneCaster::new(scene), scene.pose_at(0.0));
    let (width, height) = (picture.image.width, picture.image.height);
    let view = scene.cameras[0].view(width, height);
    let partition_m = |at: Vec2| {
        let uv = at / Vec2::new(width as f32, height as f32);
        let dir = view.pose.orientation * view.fov.dir_in_view(uv);
        let origin = view.pose.position_m;
        let hit = caster.first_hit(origin, dir, f32::INFINITY, &pose);
        let distance_m = hit.expect("the room is closed").t;
        ((origin + dir * distance_m).as_dvec3() + scene.file_from_scene_m).x as f32
    };
    let is_far = |pixel: u32| {
        let corner = Vec2::new((pixel % width) as f32, (pixel / width) as f32);
        [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE, Vec2::splat(0.5)]
            .into_iter()
            .all(|within| partition_m(corner + within) > reach_m)
    };
    let is_lit = |pixel: &u32| picture.image.rgb[*pixel as usize] != [0.0; 3];
    let lit = (0..width * height).filter(is_lit);
    lit.filter(|pixel| is_far(*pixel)).count()
}

#[test]
fn behind_a_wall_a_millimetre_thin_it_is_dark_but_for_a_gather_radius_at_the_wall_s_edges() {
    let Some(dark) = shared("scenes/glb/g-thin-wall-dark.glb") else {
        return;
    };
    let scene = Scene::load(&dark).unwrap();
    for technique in ["pm-direct", "pm"] {
        let recipe = Recipe::new(technique);
        let coarse = recipe.render_scene(&scene);
        let reach_m = 1.001 * coarse.count("gather_radius_m") as f32;
        let lit = lit_far_from_the_partition(&scene, &coarse, reach_m);
        assert_eq!(lit, 0, "{technique}");
        // A disc narrower than the wall never reaches around its edge.
        let fine = recipe.set("gather.radius_m", "0.0009").render_scene(&scene);
        assert_eq!(mean(&fine.image), [0.0; 3], "{technique}");
    }
    let Some(dim) = shared("scenes/glb/g-thin-wall-dim.glb") else {
        return;
    };
    let scene = Scene::load(&dim).unwrap();
    let lit = Recipe::new("pm-direct").render_scene(&scene);
    let lit = lit_far_from_the_partition(&scene, &lit, 0.2);
    assert!(lit > 1000, "a lamp in the room is noticed: {lit}");
}
