//! Photons carry what the lights give off, no more and no less, and what does not fit is told.

use std::f64::consts::PI;

use macula::scene::Scene;

use crate::maker::{Recipe, bundled, mean, means_agree};
use crate::photon_flux::photon_fluxes_w;

const PATHS: u32 = 50_000;

/// The power, W, that photons bring to surfaces when paths end at surface `depth_max`.
fn power_on_surfaces_w(scene: &Scene, depth_max: u32) -> [f64; 3] {
    let fluxes_w = photon_fluxes_w(scene, PATHS, depth_max);
    [0, 1, 2].map(|c| fluxes_w.iter().map(|flux| flux[c]).sum::<f64>() / f64::from(PATHS))
}

/// Power of all glowing triangles, W: radiance · pi · area.
fn lamp_power_w(scene: &Scene, radiance_w_m2_sr: f64) -> f64 {
    let mesh = &scene.static_mesh;
    let area_m2 = |triangle: usize| {
        let [a, b, c] = mesh.corners(triangle).map(|corner| corner.as_dvec3());
        0.5 * (b - a).cross(c - a).length()
    };
    let area_m2: f64 = (0..mesh.triangles.len()).map(area_m2).sum();
    radiance_w_m2_sr * PI * area_m2
}

#[test]
fn photons_bring_the_lights_whole_power_to_a_closed_room_and_its_geometric_series_over_all_bounces()
{
    let furnace = Scene::load(&bundled("furnace.glb")).unwrap();
    let power_w = lamp_power_w(&furnace, 1.0);
    let first = power_on_surfaces_w(&furnace, 1);
    means_agree(first, [power_w; 3], 0.001).unwrap();
    // Albedo 0.5: 1 + 1/2 + 1/4 + ...
    let all = power_on_surfaces_w(&furnace, 64);
    means_agree(all, [2.0 * power_w; 3], 0.01).unwrap();
    let three = power_on_surfaces_w(&furnace, 3);
    means_agree(three, [1.75 * power_w; 3], 0.01).unwrap();
    assert!(means_agree(three, [2.0 * power_w; 3], 0.01).is_err());
}

#[test]
fn a_map_that_is_too_small_is_told_and_its_picture_stays_as_bright() {
    let cornell = bundled("cornell.glb");
    let recipe = Recipe::new("pm-direct")
        .passes(4)
        .set("photon.count", "60000")
        .set("photon.batch", "2000");
    let whole = recipe.render(&cornell);
    assert_eq!(whole.count("photons_emitted"), 60_000.0);
    assert_eq!(whole.count("photons_dropped"), 0.0);
    assert!(whole.statistics.warnings.is_empty());

    let small = recipe.set("photon.stored_per_path", "0.4").render(&cornell);
    let emitted = small.count("photons_emitted");
    assert!(emitted > 0.0 && emitted < 60_000.0, "{emitted}");
    assert!(small.count("photons_dropped") > 0.0);
    assert!(small.count("photons_stored") <= 24_000.0);
    let warnings = small.statistics.warnings.join("\n");
    assert!(warnings.contains("photon.stored_per_path"), "{warnings}");
    means_agree(mean(&small.image), mean(&whole.image), 0.02).unwrap();

    let dark = recipe_without_photons().render(&cornell);
    assert!(means_agree(mean(&dark.image), mean(&whole.image), 0.02).is_err());
}

/// What the picture would be if a full map lost its light.
fn recipe_without_photons() -> Recipe {
    Recipe::new("pm-direct").passes(4).set("photon.count", "0")
}
