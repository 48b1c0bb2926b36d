//! Photons of random scenes: on the first surface none carries more than all lights give, and surface by surface all together bring no
//! more than that.

use std::f64::consts::{PI, TAU};

use macula::scene::{PunctualKind, Scene};

use crate::alone;
use crate::photon_flux::photon_fluxes_w;
use crate::runner::{hold, require};
use crate::scenes::any_scene;

/// Paths of a scene.
const PATHS: u32 = 200;
/// What f32 may add in a path.
const ROUNDING: f64 = 1e-3;
/// By how much chance may raise the power on later surfaces: which lobe a photon goes on in is drawn by luminance, so that one of a
/// saturated colour can carry several times what it brought.
const CHANCE: f64 = 4.0;

/// The power of all lights, W, all channels together.
fn power_w(scene: &Scene) -> f64 {
    let radius_m = f64::from(scene.bounds_over_time().diagonal_m()) / 2.0;
    let punctual = scene.lights.iter().map(|light| {
        let intensity = f64::from(light.intensity.element_sum());
        match light.kind {
            PunctualKind::Point => 2.0 * TAU * intensity,
            PunctualKind::Spot { outer_cone_rad, .. } => {
                TAU * (1.0 - f64::from(outer_cone_rad).cos()) * intensity
            }
            PunctualKind::Directional => PI * radius_m * radius_m * intensity,
        }
    });
    let mesh = &scene.static_mesh;
    let glowing = (0..mesh.triangles.len()).map(|triangle| {
        let material = &scene.materials[mesh.material_of_triangle[triangle] as usize];
        let [a, b, c] = mesh.corners(triangle).map(|corner| corner.as_dvec3());
        let area_m2 = 0.5 * (b - a).cross(c - a).length();
        let sides = if material.double_sided { 2.0 } else { 1.0 };
        PI * sides * area_m2 * f64::from(material.emission_w_per_m2_sr.element_sum())
    });
    punctual.chain(glowing).sum()
}

/// What photons break that lights of `power_w` sent on paths of `depth` surfaces, if anything.
fn balance(fluxes_w: &[[f64; 3]], depth: u32, power_w: f64) -> Result<(), String> {
    let most_w = power_w
        * if depth == 1 {
            1.0 + ROUNDING
        } else {
            f64::INFINITY
        };
    for flux_w in fluxes_w {
        let is_flux = flux_w
            .iter()
            .all(|x| x.is_finite() && (0.0..=most_w).contains(x));
        require(
            is_flux,
            format!("a photon carries {flux_w:?} W, the lights {power_w} W"),
        )?;
    }
    let most_w = f64::from(depth) * power_w * if depth == 1 { 1.0 + ROUNDING } else { CHANCE };
    for channel in 0..3 {
        let sum_w = fluxes_w.iter().map(|flux| flux[channel]).sum::<f64>() / f64::from(PATHS);
        require(
            sum_w <= most_w,
            format!("{sum_w} W arrive, the lights have {power_w} W"),
        )?;
    }
    Ok(())
}

#[test]
fn photons_bring_no_more_power_than_the_lights_give() {
    let _alone = alone();
    hold("photons", 60, (any_scene(), 1..5u32), |(scene, depth)| {
        let scene = scene.load();
        // Without light a technique asks for no photons.
        let power_w = power_w(&scene);
        if power_w == 0.0 {
            return Ok(());
        }
        balance(&photon_fluxes_w(&scene, PATHS, depth), depth, power_w)
    });
}

#[test]
fn photons_that_bring_too_much_are_noticed() {
    let photons = |count: u32, flux_w: f64| vec![[flux_w; 3]; count as usize];
    assert_eq!(balance(&photons(PATHS, 1.0), 1, 1.0), Ok(()));
    assert!(balance(&photons(1, 1.01), 1, 1.0).is_err());
    assert!(balance(&photons(PATHS + 1, 1.0), 1, 1.0).is_err());
    assert!(balance(&photons(20 * PATHS, 1.0), 4, 1.0).is_err());
    for depth in [1, 4] {
        assert!(balance(&photons(1, f64::NAN), depth, 1.0).is_err());
    }
}
