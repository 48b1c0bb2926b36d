//! Scenes whose picture is known without a renderer.

use std::f64::consts::PI;

use glam::{DVec3, Vec2, Vec3};
use macula::image::LinearImage;
use macula::scene::Scene;

use crate::maker::{
    Recipe, Stage, bundled, lambert, largest_relative_difference, mean, means_agree, reduced,
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
    for technique in ["pm-direct", "pm"] {
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
    let aware = wide("12");
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

/// What [`lit_plane`] looks like: radiance albedo/pi · I cos / d², averaged over 4x4 points of every pixel.
fn lit_plane_exactly(scene: &Scene, side: u32) -> LinearImage {
    const STRATA: u32 = 4;
    let camera = &scene.cameras[0];
    let view = camera.view(side, side);
    let file_from_scene_m = scene.file_from_scene_m;
    let eye = view.pose.position_m.as_dvec3() + file_from_scene_m;
    let irradiance = |uv: Vec2| {
        let dir = (view.pose.orientation * view.fov.dir_in_view(uv)).as_dvec3();
        assert!(dir.y < -0.15, "every ray meets the plane");
        let to_light = LIGHT_M - (eye - dir * (eye.y / dir.y));
        f64::from(INTENSITY_W_SR) * to_light.y / to_light.length().powi(3)
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
