//! Scenes whose picture is known without a renderer.

use std::f64::consts::PI;

use glam::{DVec3, Vec2, Vec3};
use macula::image::LinearImage;
use macula::scene::Scene;
use serde_json::{Value, json};

use crate::maker::{
    Recipe, Stage, bundled, glowing, lambert, largest_relative_difference, mean, means_agree,
    mirror, reduced,
};
use crate::shared::shared;

fn furnace_recipe(technique: &'static str) -> Recipe {
    Recipe::new(technique)
        .size(32, 32)
        .passes(4)
        .set("photon.count", "50000")
        .set("gather.radius_m", "0.01")
}

#[test]
fn the_bundled_furnace_glows_with_emission_over_one_minus_albedo() {
    for technique in ["pm-direct", "pm", "fpm", "path-filtered"] {
        let picture = furnace_recipe(technique).render(&bundled("furnace.glb"));
        let means = mean(&picture.image);
        means_agree(means, [2.0; 3], 0.005).unwrap_or_else(|e| panic!("{technique}: {e}"));
    }
}

#[test]
fn a_furnace_that_loses_its_last_bounces_is_noticed() {
    let short = furnace_recipe("pm-direct").set("photon.depth_max", "3");
    let means = mean(&short.render(&bundled("furnace.glb")).image);
    assert!(means_agree(means, [2.0; 3], 0.005).is_err(), "{means:?}");
}

#[test]
fn a_disc_wide_beside_the_furnaces_edges_counts_only_where_there_is_surface() {
    let wide = |rays: &str| {
        let recipe = furnace_recipe("pm-direct")
            .set("gather.radius_m", "0.12")
            .set("gather.coverage_rays", rays);
        mean(&recipe.render(&bundled("furnace.glb")).image)
    };
    let aware = wide("8");
    means_agree(aware, [2.0; 3], 0.005).unwrap();
    // Control: taken for whole, discs that reach beyond an edge come out too dark.
    let unaware = wide("0");
    assert!(means_agree(unaware, [2.0; 3], 0.02).is_err(), "{unaware:?}");
}

#[test]
fn the_shared_furnaces_keep_their_closed_forms() {
    for (name, exact) in [
        ("c-furnace-sphere", [1.25, 2.0, 5.0]),
        ("c-furnace-box", [2.0; 3]),
    ] {
        let Some(path) = shared(&format!("scenes/glb/{name}.glb")) else {
            return;
        };
        let picture = furnace_recipe("pm-direct").render(&path);
        means_agree(mean(&picture.image), exact, 0.005).unwrap_or_else(|e| panic!("{name}: {e}"));
    }
}

const LIGHT_M: DVec3 = DVec3::new(0.5, 1.5, -0.25);
const INTENSITY_W_SR: f32 = 3.0;
const ALBEDO: [f32; 3] = [0.8, 0.4, 0.1];

/// A point light over a large plane at y = 0.
fn lit_plane() -> Scene {
    Stage::new(Vec3::new(0.0, 2.0, 3.0), Vec3::Z)
        .quad(
            Vec3::new(-20.0, 0.0, 20.0),
            40.0 * Vec3::X,
            -40.0 * Vec3::Z,
            lambert(ALBEDO),
        )
        .point_light(LIGHT_M.as_vec3(), INTENSITY_W_SR)
        .load()
}

/// What [`lit_plane`] looks like: radiance albedo/pi · I cos / d².
fn lit_plane_exactly(scene: &Scene, side: u32) -> LinearImage {
    floor_exactly(scene, side, |place| {
        let to_light = LIGHT_M - place;
        f64::from(INTENSITY_W_SR) * to_light.y / to_light.length().powi(3)
    })
}

/// What a floor at y = 0 of [`ALBEDO`] looks like under the irradiance (W/m²) that is told for each place of it, averaged over 4x4
/// points of every pixel.
fn floor_exactly(scene: &Scene, side: u32, irradiance_at: impl Fn(DVec3) -> f64) -> LinearImage {
    const STRATA: u32 = 4;
    let camera = &scene.cameras[0];
    let view = camera.view(side, side);
    let file_from_scene_m = scene.file_from_scene_m;
    let eye = view.pose.position_m.as_dvec3() + file_from_scene_m;
    let irradiance = |uv: Vec2| {
        let dir = (view.pose.orientation * view.fov.dir_in_view(uv)).as_dvec3();
        assert!(dir.y < -0.15, "every ray meets the plane");
        irradiance_at(eye - dir * (eye.y / dir.y))
    };
    let pixel = |x: u32, y: u32| {
        let points = (0..STRATA * STRATA).map(|i| {
            let at = |pixel: u32, i: u32| {
                (pixel as f32 + (i as f32 + 0.5) / STRATA as f32) / side as f32
            };
            irradiance(Vec2::new(at(x, i % STRATA), at(y, i / STRATA)))
        });
        let mean = points.sum::<f64>() / f64::from(STRATA * STRATA);
        ALBEDO.map(|albedo| (f64::from(albedo) / PI * mean) as f32)
    };
    LinearImage {
        width: side,
        height: side,
        rgb: (0..side * side)
            .map(|i| pixel(i % side, i / side))
            .collect(),
    }
}

#[test]
fn a_point_light_over_a_plane_has_the_inverse_square_radiance_in_every_pixel() {
    let scene = lit_plane();
    let exact = lit_plane_exactly(&scene, 32);
    let recipe = Recipe::new("pm-direct").size(64, 64).passes(16);
    let image = recipe.set("photon.count", "0").render_scene(&scene).image;
    // Where samples fall in a pixel shows under the light; over two pixels it averages out.
    let mut image = reduced(&image, 2);
    let worst = largest_relative_difference(&image, &exact, 0.05);
    assert!(worst < 0.01, "{worst}");

    image.rgb[500] = image.rgb[500].map(|x| 0.98 * x);
    let worst = largest_relative_difference(&image, &exact, 0.05);
    assert!(worst > 0.01, "one pixel 2% off is noticed");
}

/// A floor that ends within the picture, with a black wall across it, under a point light; `pane` is a window above it.
fn floor_with_an_edge_and_a_wall(pane: Option<Value>) -> Scene {
    let mut black = lambert([0.0; 3]);
    black["pbrMetallicRoughness"]["roughnessFactor"] = json!(0.0);
    let stage = Stage::new(Vec3::new(0.0, 2.0, 2.5), Vec3::ZERO)
        .quad(
            Vec3::new(-1.0, 0.0, 1.0),
            2.0 * Vec3::X,
            -2.0 * Vec3::Z,
            lambert([0.8; 3]),
        )
        .quad(Vec3::new(-0.5, 0.0, -0.3), Vec3::X, 0.4 * Vec3::Y, black)
        .point_light(Vec3::new(0.0, 2.5, 0.4), 10.0);
    match pane {
        None => stage.load(),
        Some(pane) => stage
            .quad(
                Vec3::new(-3.0, 2.2, 3.0),
                6.0 * Vec3::X,
                -6.0 * Vec3::Z,
                pane,
            )
            .load(),
    }
}

#[test]
fn photons_through_a_window_light_a_floor_evenly_up_to_its_edges_and_walls() {
    // Glass of index 1 is nothing to light, yet what passes it counts as a caustic.
    let mut pane = lambert([1.0; 3]);
    pane["pbrMetallicRoughness"]["roughnessFactor"] = json!(0.0);
    pane["extensions"] = json!({
        "KHR_materials_transmission": {"transmissionFactor": 1.0},
        "KHR_materials_ior": {"ior": 1.0},
    });
    let recipe = Recipe::new("pm-direct").set("eye.chain_max", "4");
    let exact = recipe.clone().passes(8).set("photon.count", "0");
    let exact = exact
        .render_scene(&floor_with_an_edge_and_a_wall(None))
        .image;
    let behind_glass = floor_with_an_edge_and_a_wall(Some(pane));
    let verdict = |scale: &str, rays: &str| {
        let picture = recipe
            .clone()
            .passes(6)
            .set("photon.count", "200000")
            .set("gather.radius_m", "0.2")
            .set("gather.caustic_radius_scale", scale)
            .set("gather.coverage_rays", rays)
            .render_scene(&behind_glass)
            .image;
        means_agree(mean(&picture), mean(&exact), 0.01)?;
        let blocks = [&picture, &exact].map(|picture| reduced(picture, 4));
        let worst = largest_relative_difference(&blocks[0], &blocks[1], 0.2);
        (worst < 0.1)
            .then_some(())
            .ok_or_else(|| format!("a block is {worst} off"))
    };
    for scale in ["0.2", "0.4", "1"] {
        verdict(scale, "8").unwrap_or_else(|e| panic!("scale {scale}: {e}"));
    }
    // Control: discs taken for whole are too dark along the edges.
    assert!(verdict("1", "0").is_err());
}

#[test]
fn a_floor_beside_a_mirror_or_with_black_tiles_is_lit_evenly_up_to_them() {
    // In the middle of an evenly lit floor lies a square of another material, which shows no light of its own.
    let scene = |inset: Value| {
        let mut stage = Stage::new(Vec3::new(0.0, 3.0, 0.0), Vec3::ZERO);
        for (corner, u, v) in [
            (Vec3::new(-1.5, 0.0, 1.5), 3.0, 1.2),
            (Vec3::new(-1.5, 0.0, -0.3), 3.0, 1.2),
            (Vec3::new(-1.5, 0.0, 0.3), 1.2, 0.6),
            (Vec3::new(0.3, 0.0, 0.3), 1.2, 0.6),
        ] {
            stage = stage.quad(corner, u * Vec3::X, -v * Vec3::Z, lambert([0.8; 3]));
        }
        stage
            .quad(
                Vec3::new(-0.3, 0.0, 0.3),
                0.6 * Vec3::X,
                -0.6 * Vec3::Z,
                inset,
            )
            .point_light(Vec3::new(0.0, 5.0, 0.0), 10.0)
            .load()
    };
    let exact = Recipe::new("pm-direct").passes(8).set("photon.count", "0");
    let estimate = |rays: &str| {
        Recipe::new("pm")
            .passes(6)
            .set("photon.count", "1000000")
            .set("gather.radius_m", "0.2")
            .set("gather.coverage_rays", rays)
    };
    let verdict = |inset: Value, rays: &str| {
        let scene = scene(inset);
        let exact = exact.render_scene(&scene).image;
        let picture = estimate(rays).render_scene(&scene).image;
        let blocks = [&picture, &exact].map(|picture| reduced(picture, 4));
        let worst = largest_relative_difference(&blocks[0], &blocks[1], 0.3);
        (worst < 0.08)
            .then_some(())
            .ok_or_else(|| format!("a block is {worst} off"))
    };
    let mut glossless = lambert([0.0; 3]);
    glossless["pbrMetallicRoughness"]["roughnessFactor"] = json!(0.0);
    verdict(mirror(), "8").unwrap();
    verdict(glossless.clone(), "8").unwrap();
    assert!(verdict(glossless, "0").is_err());
}

/// Irradiance, W/m², that a polygon of radiance 1 brings to an upward-facing place under it (Lambert, 1760): half the sum over its edges
/// of the angle that the edge spans times the upward part of the normal of that angle's plane.
fn irradiance_of_polygon(place: DVec3, corners: &[DVec3]) -> f64 {
    let to = |corner: &DVec3| (*corner - place).normalize();
    let edges = corners.iter().zip(corners.iter().cycle().skip(1));
    let sum: f64 = edges
        .map(|(a, b)| {
            let (a, b) = (to(a), to(b));
            a.dot(b).clamp(-1.0, 1.0).acos() * a.cross(b).normalize().y
        })
        .sum();
    0.5 * sum.abs()
}

#[test]
fn lamps_of_rectangle_and_disc_light_a_floor_by_their_form_factors() {
    let rectangle: Vec<Vec3> = [(-0.5, -0.2), (0.3, -0.2), (0.3, 0.4), (-0.5, 0.4)]
        .map(|(x, z)| Vec3::new(x, 1.2, z))
        .to_vec();
    // A disc that leans, as a polygon whose form factor is exact too.
    let disc: Vec<Vec3> = (0..48)
        .map(|i| {
            let (sin, cos) = (i as f32 / 48.0 * 2.0 * std::f32::consts::PI).sin_cos();
            Vec3::new(0.4 * cos, 1.3 + 0.15 * cos, 0.4 * sin)
        })
        .collect();
    for (lamp, what) in [(rectangle, "rectangle"), (disc, "disc")] {
        let fan: Vec<u32> = (1..lamp.len() as u32 - 1)
            .flat_map(|i| [0, i, i + 1])
            .collect();
        let scene = Stage::new(Vec3::new(0.0, 1.0, 1.2), Vec3::ZERO)
            .quad(
                Vec3::new(-20.0, 0.0, 20.0),
                40.0 * Vec3::X,
                -40.0 * Vec3::Z,
                lambert(ALBEDO),
            )
            .triangles(&lamp, &fan, glowing([1.0; 3]))
            .load();
        let corners: Vec<DVec3> = lamp.iter().map(|corner| corner.as_dvec3()).collect();
        let exact = floor_exactly(&scene, 16, |place| irradiance_of_polygon(place, &corners));
        for (technique, samples) in [("path", "32"), ("pm-direct", "1")] {
            let recipe = Recipe::new(technique).size(16, 16).passes(16);
            let recipe = recipe.set("photon.count", "0").set("path.samples", samples);
            let image = recipe.render_scene(&scene).image;
            let verdict = |image: &LinearImage| {
                means_agree(mean(image), mean(&exact), 0.005)?;
                let [a, b] = [image, &exact].map(|picture| reduced(picture, 4));
                let worst = largest_relative_difference(&a, &b, 0.1);
                (worst < 0.02)
                    .then_some(())
                    .ok_or_else(|| format!("a block is {worst} off"))
            };
            verdict(&image).unwrap_or_else(|e| panic!("{what}, {technique}: {e}"));
            let mut brighter = image.clone();
            brighter
                .rgb
                .iter_mut()
                .for_each(|p| *p = p.map(|x| 1.01 * x));
            assert!(verdict(&brighter).is_err(), "1 % is noticed");
        }
    }
}

#[test]
fn a_pane_of_glass_lets_through_what_fresnel_leaves_after_all_its_reflections() {
    const IOR: f64 = 2.4;
    let mut pane = lambert([1.0; 3]);
    pane["pbrMetallicRoughness"]["roughnessFactor"] = json!(0.0);
    pane["doubleSided"] = json!(false);
    pane["extensions"] = json!({
        "KHR_materials_transmission": {"transmissionFactor": 1.0},
        "KHR_materials_volume": {"thicknessFactor": 0.1},
        "KHR_materials_ior": {"ior": IOR},
    });
    let scene = Stage::new(Vec3::new(0.0, 0.0, 1.0), Vec3::ZERO)
        .cuboid(Vec3::ZERO, Vec3::new(20.0, 20.0, 0.05), pane)
        .quad(
            Vec3::new(-40.0, -40.0, -1.0),
            80.0 * Vec3::X,
            80.0 * Vec3::Y,
            glowing([1.0; 3]),
        )
        .load();
    let view = scene.cameras[0].view(16, 16);
    // Reflectance of one face, by the cosines on both sides.
    let reflectance = |cos_i: f64| {
        let cos_t = (1.0 - (1.0 - cos_i * cos_i) / (IOR * IOR)).sqrt();
        let across = (cos_i - IOR * cos_t) / (cos_i + IOR * cos_t);
        let parallel = (IOR * cos_i - cos_t) / (IOR * cos_i + cos_t);
        0.5 * (across * across + parallel * parallel)
    };
    let mean_over_view = |through: &dyn Fn(f64) -> f64| {
        let points = (0..64 * 64).map(|i| {
            let uv = Vec2::new((i % 64) as f32 + 0.5, (i / 64) as f32 + 0.5) / 64.0;
            let cos = f64::from(-view.fov.dir_in_view(uv).normalize().z);
            through(reflectance(cos))
        });
        [points.sum::<f64>() / 4096.0; 3]
    };
    // (1 - R)² (1 + R² + R⁴ + ...)
    let all = mean_over_view(&|r| (1.0 - r) / (1.0 + r));
    let first = mean_over_view(&|r| (1.0 - r) * (1.0 - r));
    for technique in ["path", "pm-direct", "pm", "fpm", "path-filtered"] {
        let recipe = Recipe::new(technique).size(16, 16).passes(32);
        let recipe = recipe.set("photon.count", "0").set("eye.chain_max", "64");
        let image = recipe.set("path.samples", "16").render_scene(&scene).image;
        means_agree(mean(&image), all, 0.01).unwrap_or_else(|e| panic!("{technique}: {e}"));
        assert!(
            means_agree(mean(&image), first, 0.01).is_err(),
            "{technique}"
        );
    }
}
