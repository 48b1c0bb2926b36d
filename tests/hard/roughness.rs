//! Lobes from a mirror's single direction to the widest there are, and on both sides of where one is taken for the other.

use glam::Vec3;
use serde_json::{Value, json};

use crate::runner::{Case, Control, Expected, hold};
use crate::stages::{FURNACE, coated, furnace, glass, metal};

pub fn cases() -> Vec<Case> {
    let cube = |material: Value| {
        furnace()
            .cuboid(Vec3::ZERO, Vec3::splat(0.4), material)
            .load()
    };
    let case = |name, material, expected| {
        Case::new(name, cube(material), expected)
            .set("photon.count", "16000")
            .control(Control::Brighter(1.25))
    };
    let frosted = |ior| {
        let mut frosted = glass(ior);
        frosted["pbrMetallicRoughness"]["roughnessFactor"] = json!(1.0);
        frosted
    };
    vec![
        case("a mirror", metal(0.0), Expected::Mean(FURNACE)),
        // GGX alpha is roughness squared: 9.6e-4 and 1.02e-3, where a lobe below 1e-3 counts as a mirror.
        case(
            "a metal just taken for a mirror",
            metal(0.031),
            Expected::Mean(FURNACE),
        ),
        case(
            "a metal just not taken for a mirror",
            metal(0.032),
            Expected::Mean(FURNACE),
        ),
        case("a metal of roughness 0.3", metal(0.3), Expected::Oracle),
        // Alpha 0.19 and 0.21: rays follow the one, photons are gathered for the other.
        case("a metal just traced", metal(0.44), Expected::Oracle),
        case("a metal just gathered", metal(0.46), Expected::Oracle),
        case("a metal of roughness 1", metal(1.0), Expected::Oracle),
        case("a smooth coat", coated(0.0), Expected::Oracle),
        case("a coat of roughness 1", coated(1.0), Expected::Oracle),
        case("glass of roughness 1", frosted(1.5), Expected::Oracle),
        case(
            "glass of roughness 1 and index 1",
            frosted(1.0),
            Expected::Oracle,
        ),
    ]
}

#[test]
fn roughness_may_be_anything_from_0_to_1() {
    hold("roughness", cases());
}
