//! Grazing light and sight, total internal reflection, glass in glass, and glass that is none.
//!
//! In a furnace everything that loses no light looks like the walls, whichever way the light went; inside glass of index n radiance is n²
//! times that.

use glam::Vec3;
use serde_json::json;

use crate::maker::Stage;
use crate::runner::{Case, Control, Expected, hold};
use crate::stages::{ALBEDO, FURNACE, above, floor, furnace, furnace_seen_from, glass};

/// A prism of glass of 45 degrees: what enters through a short side is reflected by the long one.
fn prism(stage: Stage, ior: f32) -> Stage {
    let at = |x: f32, y: f32, z: f32| Vec3::new(x, y, z) * 0.5;
    let positions = [
        at(-1.0, -1.0, 1.0),
        at(1.0, -1.0, 1.0),
        at(-1.0, -1.0, -1.0),
        at(-1.0, 1.0, 1.0),
        at(1.0, 1.0, 1.0),
        at(-1.0, 1.0, -1.0),
    ];
    let corners = [
        [0, 1, 3],
        [1, 4, 3],
        [0, 3, 2],
        [3, 5, 2],
        [1, 2, 4],
        [2, 5, 4],
        [0, 2, 1],
        [3, 4, 5],
    ];
    stage.triangles(&positions, corners.as_flattened(), glass(ior))
}

fn sunlit_floor(elevation_deg: f32) -> Stage {
    // A light shines along its node's -Z.
    let tilt = glam::Quat::from_rotation_x(-elevation_deg.to_radians());
    floor(above()).light(
        json!({"type": "directional", "intensity": 100.0}),
        json!({"rotation": tilt.to_array()}),
    )
}

pub fn cases() -> Vec<Case> {
    let in_furnace = |name, stage: Stage| {
        Case::new(name, stage.load(), Expected::Mean(FURNACE)).set("eye.chain_max", "64")
    };
    let cube = |ior| furnace().cuboid(Vec3::ZERO, Vec3::splat(0.4), glass(ior));
    let sun = |elevation_deg: f32| {
        let cosine = f64::from(elevation_deg).to_radians().sin();
        ALBEDO.map(|albedo| f64::from(albedo) / std::f64::consts::PI * 100.0 * cosine)
    };
    let grazing = |name, elevation_deg, photons| {
        let expected = Expected::Mean(sun(elevation_deg));
        Case::new(name, sunlit_floor(elevation_deg).load(), expected)
            .set("photon.count", photons)
            .control(Control::Brighter(1.3))
    };
    let mut inside = furnace_seen_from(0.3 * Vec3::Z, Vec3::ZERO);
    inside = inside.cuboid(Vec3::ZERO, Vec3::splat(0.5), glass(1.5));
    inside.glb.json["cameras"][0]["perspective"]["yfov"] = json!(0.3);
    vec![
        in_furnace("an empty furnace", furnace()),
        in_furnace("glass of index 1", cube(1.0)),
        in_furnace("glass of index 1.5", cube(1.5)),
        in_furnace("glass of index 2.4", cube(2.4)),
        in_furnace(
            "glass in glass in glass",
            cube(1.5)
                .cuboid(Vec3::ZERO, Vec3::splat(0.3), glass(1.33))
                .cuboid(Vec3::ZERO, Vec3::splat(0.2), glass(2.0)),
        ),
        in_furnace(
            "total internal reflection in a prism",
            prism(furnace(), 1.5),
        ),
        Case::new(
            "an eye in glass of index 1.5",
            inside.load(),
            Expected::Mean(FURNACE.map(|x| 1.5 * 1.5 * x)),
        )
        .set("eye.chain_max", "64"),
        in_furnace(
            "an eye a millimetre above a wall that looks along it",
            furnace_seen_from(Vec3::new(0.0, -0.999, 0.9), Vec3::new(0.0, -0.999, 0.0)),
        ),
        grazing("the sun ten degrees high", 10.0, "20000"),
        grazing("the sun half a degree high", 0.5, "200000"),
    ]
}

#[test]
fn light_and_sight_may_graze_refract_and_be_wholly_reflected() {
    hold("angles", cases());
}
