//! The bound of energy that pictures are held to: right where it is known without a renderer, and none where there is none.

use glam::Vec3;
use macula::scene::Scene;
use serde_json::json;

use crate::energy_bound::radiance_bound_w_m2_sr;
use crate::maker::{Stage, glowing, lambert};
use crate::stages::{
    ALBEDO, FURNACE, LAMP_M, above, coated, floor, furnace, furnace_seen_from, glass, metal,
};

/// The bound at a time for the scene's own eye.
fn bound_at(scene: &Scene, time_s: f64) -> Option<f64> {
    let eye = scene.pose_at(time_s).cameras[0].view(1, 1).pose.position_m;
    radiance_bound_w_m2_sr(scene, time_s, Some(eye))
}

fn bound(stage: &Stage) -> Option<f64> {
    bound_at(&stage.load(), 0.0)
}

/// Whether a bound is there and is the given one, but for the rounding of f32.
fn is_about(bound: Option<f64>, exact: f64) -> bool {
    bound.is_some_and(|bound| (bound / exact - 1.0).abs() < 1e-5)
}

fn with_cube(material: serde_json::Value) -> Stage {
    furnace().cuboid(Vec3::ZERO, Vec3::splat(0.4), material)
}

#[test]
fn what_loses_no_light_leaves_the_bound_of_a_furnace_as_it_is() {
    assert!(is_about(bound(&furnace()), FURNACE[0]));
    for material in [metal(0.0), metal(0.5), glass(1.5), lambert([0.9; 3])] {
        assert!(is_about(bound(&with_cube(material)), FURNACE[0]));
    }
    // What glows more is the bound, over what it reflects.
    let mut lamp = lambert([0.2; 3]);
    lamp["emissiveFactor"] = json!([1.0, 1.0, 1.0]);
    lamp["extensions"]["KHR_materials_emissive_strength"] = json!({"emissiveStrength": 8.0});
    assert!(is_about(bound(&with_cube(lamp)), 10.0));
}

#[test]
fn inside_a_solid_the_bound_is_the_square_of_its_index_times_as_high() {
    let seen_from = |eye: Vec3| {
        let stage = furnace_seen_from(eye, Vec3::ZERO);
        bound(&stage.cuboid(Vec3::ZERO, Vec3::splat(0.5), glass(1.5)))
    };
    assert!(is_about(seen_from(0.3 * Vec3::Z), 2.25 * FURNACE[0]));
    assert!(is_about(seen_from(0.8 * Vec3::Z), FURNACE[0]));
    let anywhere = with_cube(glass(1.5)).load();
    let anywhere = radiance_bound_w_m2_sr(&anywhere, 0.0, None);
    assert!(is_about(anywhere, 2.25 * FURNACE[0]));
}

#[test]
fn a_lamp_bounds_what_a_floor_reflects_by_their_distance() {
    let lit = floor(above()).point_light(LAMP_M, 3.0);
    let nearest = f64::from(ALBEDO[0]) / std::f64::consts::PI * 3.0
        / f64::from(LAMP_M.y).powi(2)
        / (1.0 - f64::from(ALBEDO[0]));
    assert!(is_about(bound(&lit), nearest));
    // At the time asked for: a floor that rises comes nearer.
    let mut rising = floor(above()).point_light(LAMP_M, 3.0);
    let node = rising.glb.json["nodes"].as_array().unwrap().len() - 2;
    let places = [[0.0f32; 3], [0.0, 0.5, 0.0]];
    let times = [0.0, 1.0];
    rising
        .glb
        .animate(node, "translation", "LINEAR", &times, &places);
    let rising = rising.load();
    let ratio = f64::from(LAMP_M.y) / f64::from(LAMP_M.y - 0.25);
    assert!(is_about(bound_at(&rising, 0.0), nearest));
    assert!(is_about(bound_at(&rising, 0.5), nearest * ratio * ratio));
}

#[test]
fn no_bound_is_given_where_there_is_none() {
    let lit = |material| {
        let stage = floor(above()).cuboid(Vec3::Y, Vec3::splat(0.1), material);
        bound(&stage.point_light(LAMP_M, 3.0))
    };
    let mut sheen = coated(0.8);
    sheen["extensions"] = json!({"KHR_materials_specular": {"specularFactor": 0.4}});
    assert!(lit(lambert([0.5; 3])).is_some() && lit(sheen).is_some());
    // Mirrors, glass and sharp coats focus; a rough metal adds the lamp's light and need not lose any.
    for material in [metal(0.0), glass(1.5), coated(0.0), metal(0.8)] {
        assert_eq!(lit(material), None);
    }
    // Base and coat together.
    assert_eq!(bound(&with_cube(coated(0.0))), None);
    // A solid that is open, and one that is turned inside out.
    let pane = |stage: Stage| stage.quad(Vec3::ZERO, Vec3::X, Vec3::Y, glass(1.5));
    assert_eq!(bound(&pane(furnace())), None);
    let inverted = furnace().cuboid(Vec3::ZERO, Vec3::splat(-0.4), glass(1.5));
    assert_eq!(bound(&inverted), None);
    // What glows and loses nothing.
    let mut white = glowing([1.0; 3]);
    white["pbrMetallicRoughness"]["baseColorFactor"] = json!([1.0, 1.0, 1.0, 1.0]);
    assert_eq!(bound(&with_cube(white)), None);
}
