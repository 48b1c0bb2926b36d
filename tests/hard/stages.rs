//! The scenes that most cases vary, and their closed forms.

use std::f64::consts::PI;

use glam::{DVec3, Vec2, Vec3};
use macula::scene::Scene;
use serde_json::{Value, json};

use crate::maker::{Stage, lambert};

/// Albedo of [`floor`].
pub const ALBEDO: [f32; 3] = [0.8, 0.4, 0.1];
/// Where the lamp over the floor hangs, metres.
pub const LAMP_M: Vec3 = Vec3::new(0.3, 1.5, -0.2);
/// Half of the floor's side, metres.
pub const FLOOR_HALF_M: f32 = 2.0;

/// An eye 2 m above the origin that looks down.
pub fn above() -> Stage {
    Stage::new(2.0 * Vec3::Y, Vec3::ZERO)
}

/// A floor at y = 0, larger than what [`above`] sees.
pub fn floor(stage: Stage) -> Stage {
    let side = 2.0 * FLOOR_HALF_M;
    let corner = Vec3::new(-FLOOR_HALF_M, 0.0, FLOOR_HALF_M);
    stage.quad(corner, side * Vec3::X, -side * Vec3::Z, lambert(ALBEDO))
}

/// The mean radiance of a floor of [`ALBEDO`] at y = 0 that fills the picture, lit by point lights (metres, W/sr): albedo/pi · I cos / d²,
/// averaged over 64x64 points.
pub fn floor_mean(scene: &Scene, lamps: &[(Vec3, f32)]) -> [f64; 3] {
    const POINTS: u32 = 64;
    let view = scene.cameras[0].view(1, 1);
    let eye = view.pose.position_m.as_dvec3() + scene.file_from_scene_m;
    let irradiance = |i: u32| {
        let at = |i: u32| (i as f32 + 0.5) / POINTS as f32;
        let place = Vec2::new(at(i % POINTS), at(i / POINTS));
        let dir = (view.pose.orientation * view.fov.dir_in_view(place)).as_dvec3();
        let point = eye - dir * (eye.y / dir.y);
        let from = |(lamp, intensity): &(Vec3, f32)| {
            let to_lamp: DVec3 = lamp.as_dvec3() - point;
            f64::from(*intensity) * to_lamp.y / to_lamp.length().powi(3)
        };
        lamps.iter().map(from).sum::<f64>()
    };
    let sum: f64 = (0..POINTS * POINTS).map(irradiance).sum();
    let mean = sum / f64::from(POINTS * POINTS);
    ALBEDO.map(|albedo| f64::from(albedo) / PI * mean)
}

/// Emission and albedo of the walls of [`furnace`].
const GLOW: (f32, f32) = (1.0, 0.5);

/// What everything in [`furnace`] looks like that loses no light: emission / (1 - albedo).
pub const FURNACE: [f64; 3] = [2.0; 3];

/// A closed room of 2 m that glows all over, seen from inside.
pub fn furnace() -> Stage {
    furnace_seen_from(Vec3::new(0.3, 0.2, 0.85), Vec3::new(0.0, 0.0, 0.0))
}

/// [`furnace`] from an eye of one's own.
pub fn furnace_seen_from(eye: Vec3, target: Vec3) -> Stage {
    let (emission, albedo) = GLOW;
    let mut wall = lambert([albedo; 3]);
    wall["emissiveFactor"] = json!([emission, emission, emission]);
    wall["doubleSided"] = json!(false);
    Stage::new(eye, target).cuboid(Vec3::ZERO, -Vec3::ONE, wall)
}

/// Clear glass that bounds a solid.
pub fn glass(ior: f32) -> Value {
    let mut glass = lambert([1.0; 3]);
    glass["pbrMetallicRoughness"]["roughnessFactor"] = json!(0.0);
    glass["doubleSided"] = json!(false);
    glass["extensions"] = json!({
        "KHR_materials_transmission": {"transmissionFactor": 1.0},
        "KHR_materials_volume": {"thicknessFactor": 1.0},
        "KHR_materials_ior": {"ior": ior},
    });
    glass
}

/// A metal of white base colour.
pub fn metal(roughness: f32) -> Value {
    json!({
        "pbrMetallicRoughness": {"metallicFactor": 1.0, "roughnessFactor": roughness},
        "doubleSided": true,
    })
}

/// A half-white base under glTF's dielectric coat.
pub fn coated(roughness: f32) -> Value {
    json!({
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.5, 0.5, 0.5, 1.0], "metallicFactor": 0.0, "roughnessFactor": roughness,
        },
        "doubleSided": true,
    })
}
