//! A lit floor a thousand times smaller and larger, and 10 km from the origin: with light to match, the same picture.

use glam::Vec3;
use macula::scene::Scene;
use serde_json::json;

use crate::maker::{Stage, lambert};
use crate::runner::{Case, Expected, hold};
use crate::stages::{ALBEDO, FLOOR_HALF_M, LAMP_M, above, floor, floor_mean};

const INTENSITY_W_SR: f32 = 3.0;

/// The lit floor, `scale` times as large, with light to match, at `place`; its numbers stand in the file as they are.
fn baked(scale: f32, place: Vec3) -> Scene {
    let h = FLOOR_HALF_M * scale;
    Stage::new(place + 2.0 * scale * Vec3::Y, place)
        .quad(
            place + Vec3::new(-h, 0.0, h),
            2.0 * h * Vec3::X,
            -2.0 * h * Vec3::Z,
            lambert(ALBEDO),
        )
        .point_light(place + scale * LAMP_M, INTENSITY_W_SR * scale * scale)
        .load()
}

/// The same under one node.
fn under_node(scale: f32, place: Vec3) -> Scene {
    let stage = floor(above()).point_light(LAMP_M, INTENSITY_W_SR * scale * scale);
    let node = json!({"translation": place.to_array(), "scale": [scale, scale, scale]});
    stage.under_node(node).load()
}

pub fn cases() -> Vec<Case> {
    let plain = floor(above()).load();
    let right = floor_mean(&plain, &[(LAMP_M, INTENSITY_W_SR)]);
    let same = |name, scene| Case::new(name, scene, Expected::Mean(right));
    let far = Vec3::new(10_000.0, -5_000.0, 8_000.0);
    vec![
        same("a thousandth", baked(1e-3, Vec3::ZERO)),
        same("a thousandth under a node", under_node(1e-3, Vec3::ZERO)),
        same("a thousand times", baked(1e3, Vec3::ZERO)),
        same("a thousand times under a node", under_node(1e3, Vec3::ZERO)),
        same("a millionth", baked(1e-6, Vec3::ZERO)),
        same("a million times", baked(1e6, Vec3::ZERO)).set("gather.radius_m", "150000"),
        // As f32 the camera and the floor stand on a grid of a millimetre there.
        same("10 km away", baked(1.0, far)),
        same("10 km away under a node", under_node(1.0, far)),
        same("a hundredth under a node 10 km away", under_node(1e-2, far)),
    ]
}

#[test]
fn scenes_may_be_tiny_huge_or_far_away() {
    hold("scale and place", cases());
}
