//! No photons, one photon, no lights, too many lights, lights that light nothing.

use glam::Vec3;
use serde_json::json;

use crate::maker::{Stage, lambert};
use crate::runner::{Case, Control, Expected, hold};
use crate::stages::{FURNACE, LAMP_M, above, floor, floor_mean, furnace, metal};
use macula::scene::Scene;

fn lit_floor() -> Scene {
    floor(above()).point_light(LAMP_M, 3.0).load()
}

/// A lamp in a box of plaster over the floor; `is_open` leaves its bottom away.
fn lamp_in_a_box(is_open: bool) -> Scene {
    let half = Vec3::splat(0.2);
    let stage = floor(above()).point_light(LAMP_M, 3.0);
    let mut stage = stage.cuboid(LAMP_M, half, lambert([0.5; 3]));
    if is_open {
        // The box is the last six meshes, its bottom the third of them.
        let nodes = stage.glb.json["scenes"][0]["nodes"].as_array_mut().unwrap();
        nodes.remove(nodes.len() - 4);
    }
    stage.load()
}

/// Three hundred lamps in a ring.
fn many_lamps() -> Vec<(Vec3, f32)> {
    let lamp = |i: u32| {
        let (sin, cos) = (i as f32 * std::f32::consts::TAU / 300.0).sin_cos();
        let place = Vec3::new(cos, 1.2 + 0.001 * i as f32, sin);
        (place, 0.001 * (1 + i % 7) as f32)
    };
    (0..300).map(lamp).collect()
}

fn with_lamps(lamps: &[(Vec3, f32)]) -> Scene {
    let stage = lamps
        .iter()
        .fold(floor(above()), |stage, (place, intensity)| {
            stage.point_light(*place, *intensity)
        });
    stage.load()
}

pub fn cases() -> Vec<Case> {
    let right = floor_mean(&lit_floor(), &[(LAMP_M, 3.0)]);
    let sum = floor_mean(&lit_floor(), &many_lamps());
    let mut colorless = Stage::new(2.0 * Vec3::Y, Vec3::ZERO);
    colorless = floor(colorless).light(
        json!({"type": "point", "intensity": 5.0, "color": [0.0, 0.0, 0.0]}),
        json!({"translation": LAMP_M.to_array()}),
    );
    let on_floor =
        |name, key, value| Case::new(name, lit_floor(), Expected::Mean(right)).set(key, value);
    let in_furnace =
        |name, scene, key, value| Case::new(name, scene, Expected::Mean(FURNACE)).set(key, value);
    let mirror = furnace().cuboid(Vec3::ZERO, Vec3::splat(0.4), metal(0.0));
    vec![
        Case::new("no photons", lit_floor(), Expected::WithoutPhotons(right))
            .set("photon.count", "0")
            .control(Control::Added(0.2)),
        Case::new("a floor and a lamp", lit_floor(), Expected::Mean(right)),
        Case::new(
            "three hundred lamps",
            with_lamps(&many_lamps()),
            Expected::Mean(sum),
        ),
        Case::black("nothing at all", above().load(), lit_floor()),
        Case::black("no lights", floor(above()).load(), lit_floor()),
        Case::black(
            "a lamp and nothing to light",
            above().point_light(LAMP_M, 3.0).load(),
            lit_floor(),
        ),
        Case::black(
            "a lamp of no intensity",
            with_lamps(&[(LAMP_M, 0.0)]),
            lit_floor(),
        ),
        Case::black("a lamp of no colour", colorless.load(), lit_floor()),
        Case::black(
            "all light behind plaster",
            lamp_in_a_box(false),
            lamp_in_a_box(true),
        ),
        // Nearly all of its light falls on a spot narrower than any pixel: what a picture of it sees is chance.
        Case::new(
            "a lamp a tenth of a millimetre above the floor",
            with_lamps(&[(Vec3::new(0.1, 1e-4, 0.1), 3.0)]),
            Expected::Lit,
        )
        .control(Control::Scene(Box::new(floor(above()).load()))),
        on_floor("one photon path a pass", "photon.count", "1")
            .set("gather.radius_m", "2")
            .passes(64)
            .control(Control::Brighter(4.0)),
        on_floor(
            "photons that end at the first surface",
            "photon.depth_max",
            "1",
        ),
        in_furnace(
            "a radius wider than the scene",
            furnace().load(),
            "gather.radius_m",
            "1000",
        )
        .warned("gather.radius_m")
        .photons_only("it has no radius"),
        // Not one of the photons falls into such a disc.
        Case::new(
            "a radius of a tenth of a micrometre",
            lit_floor(),
            Expected::WithoutPhotons(right),
        )
        .set("gather.radius_m", "1e-7")
        .control(Control::Added(0.2)),
        in_furnace(
            "eye paths by way of one mirror",
            mirror.load(),
            "eye.chain_max",
            "1",
        ),
        Case::new(
            "sixty-four candidates",
            with_lamps(&many_lamps()),
            Expected::Mean(sum),
        )
        .set("direct.candidates", "64"),
        on_floor("sixty-four samples a pixel", "fovea.samples", "64"),
        in_furnace(
            "discs as flat as a hundredth",
            furnace().load(),
            "gather.flatness",
            "0.01",
        ),
    ]
}

#[test]
fn photons_and_lights_may_be_none_one_or_many() {
    hold("photons and lights", cases());
}
