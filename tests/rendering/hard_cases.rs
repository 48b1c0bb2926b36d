//! Scenes and settings at the border of what makes sense: finite pictures, no panic, no light where none can be.

use glam::Vec3;
use macula::scene::Scene;
use serde_json::json;

use crate::maker::{Picture, Recipe, Stage, bundled, gpu, lambert, mean, means_agree};
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
        assert!(mean(&picture.image)[0] > 0.0, "{key}={value} leaves light");
    }
    gpu().wait("what is left").unwrap();
}

#[test]
fn a_radius_wider_than_the_scene_is_told() {
    let warnings = |radius_m: &str| {
        let recipe = Recipe::new("pm").size(8, 8).set("photon.count", "100");
        let recipe = recipe.set("gather.radius_m", radius_m);
        recipe.render(&bundled("furnace.glb")).statistics.warnings
    };
    assert!(warnings("1000")[0].contains("gather.radius_m"));
    assert!(warnings("0.1").is_empty());
}

#[test]
fn no_light_comes_through_or_around_a_wall_a_millimetre_thin() {
    let [Some(dark), Some(dim), Some(bright)] =
        ["-dark", "-dim", ""].map(|which| shared(&format!("scenes/glb/g-thin-wall{which}.glb")))
    else {
        return;
    };
    for technique in ["pm-direct", "pm"] {
        let picture = Recipe::new(technique).render(&dark);
        assert_eq!(mean(&picture.image), [0.0; 3], "{technique}");
    }
    // The same room with a lamp of its own, beside a dark room and beside one that is lit a thousand times brighter.
    let recipe = Recipe::new("pm-direct")
        .passes(2)
        .set("photon.count", "100000");
    let alone = mean(&recipe.render(&dim).image);
    assert!(alone[0] > 0.0, "a lamp in the room is seen");
    let beside = mean(&recipe.render(&bright).image);
    means_agree(beside, alone, 0.05).unwrap();
}

#[test]
fn tilted_normals_carry_no_light_through_a_surface() {
    // A wall between a lamp at the right and the eye, with normals that lean up, towards what the lamp lights.
    let scene = |eye_x: f32| {
        let stage = Stage::new(Vec3::new(eye_x, 0.0, 0.0), Vec3::ZERO);
        let (corner, u, v) = (Vec3::new(0.0, -9.0, -9.0), 18.0 * Vec3::Z, 18.0 * Vec3::Y);
        let mut stage = stage
            .quad(corner, u, v, lambert([0.5; 3]))
            .point_light(Vec3::new(1.0, 3.0, 0.0), 50.0);
        let leaning = Vec3::new(-0.2, 1.0, 0.0).normalize().to_array();
        let normals = stage.glb.floats(&[leaning; 4]);
        stage.glb.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normals);
        stage.load()
    };
    for technique in ["pm-direct", "pm"] {
        let picture = |eye_x| mean(&Recipe::new(technique).render_scene(&scene(eye_x)).image);
        assert_eq!(picture(-3.0), [0.0; 3], "{technique}: behind the wall");
        // Control: the wall's other side is lit.
        assert!(picture(3.0)[0] > 0.01, "{technique}: before the wall");
    }
}

#[test]
fn a_moving_object_behind_a_cut_out_sheet_casts_its_shadow() {
    let lamp = Vec3::new(0.0, 3.0, 0.0);
    let floor = || plane(viewer()).point_light(lamp, 10.0);
    let ceiling = |stage: Stage, height: f32, material| {
        let corner = Vec3::new(-2.0, height, 2.0);
        stage.quad(corner, 4.0 * Vec3::X, -4.0 * Vec3::Z, material)
    };
    let with_sheet = |stage: Stage| {
        let mut cut_out = lambert([0.5; 3]);
        cut_out["alphaMode"] = json!("MASK");
        cut_out["pbrMetallicRoughness"]["baseColorFactor"] = json!([1.0, 1.0, 1.0, 0.1]);
        ceiling(stage, 1.5, cut_out)
    };
    let with_blocker = |stage: Stage| {
        let mut stage = ceiling(stage, 2.0, lambert([0.5; 3]));
        let node = stage.glb.json["nodes"].as_array().unwrap().len() - 1;
        let places = [[0.0f32, 0.0, 0.0], [0.0, 0.1, 0.0]];
        stage
            .glb
            .animate(node, "translation", "LINEAR", &[0.0, 1.0], &places);
        stage.load()
    };
    let recipe = Recipe::new("pm-direct").set("photon.count", "0");
    let light = |scene: &Scene| mean(&recipe.render_scene(scene).image)[0];
    let open = light(&floor().load());
    let through_sheet = light(&with_sheet(floor()).load());
    assert!(
        (through_sheet / open - 1.0).abs() < 1e-3,
        "{through_sheet} of {open}"
    );
    assert_eq!(light(&with_blocker(with_sheet(floor()))), 0.0);
    assert_eq!(light(&with_blocker(floor())), 0.0);
}
