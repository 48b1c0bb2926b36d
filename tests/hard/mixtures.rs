//! Materials that are several things at once, panes that are rough and thin, and lamps that are mirrored as they move.

use glam::Vec3;
use macula::scene::Scene;
use serde_json::{Value, json};

use crate::maker::{Stage, glowing, lambert};
use crate::runner::{Case, Control, Expected, hold};
use crate::stages::{LAMP_M, above, floor, floor_mean, furnace, glass};

/// A lamp beside the floor's middle, whose light meets a pane between them at a slant.
const SLANTED_LAMP_M: Vec3 = Vec3::new(1.8, 1.4, 0.0);

/// A pane between lamp and floor, and the eye under it.
fn floor_behind(pane: Value, lamp_m: Vec3) -> Scene {
    let corner = Vec3::new(-1.9, 1.0, 1.9);
    let eye = Stage::new(0.9 * Vec3::Y, Vec3::ZERO);
    floor(eye)
        .quad(corner, 3.8 * Vec3::X, -3.8 * Vec3::Z, pane)
        .point_light(lamp_m, 5.0)
        .load()
}

/// A thin wall that lets light through as it comes, but for a sixth that it reflects, so that a wall that reflects nothing is noticed.
fn thin_pane(roughness: f32) -> Value {
    let mut pane = lambert([1.0; 3]);
    pane["pbrMetallicRoughness"]["roughnessFactor"] = json!(roughness);
    pane["extensions"] = json!({
        "KHR_materials_transmission": {"transmissionFactor": 1.0},
        "KHR_materials_ior": {"ior": 2.4},
    });
    pane
}

/// A lamp that faces the floor beside a wall and turns to its mirror image, or its plain self, moving a little.
fn moving_lamp(is_mirrored: bool) -> Scene {
    let mut lamp = glowing([8.0; 3]);
    lamp["doubleSided"] = json!(false);
    let mut stage = floor(above()).quad(
        Vec3::new(-0.2, 1.2, -0.2),
        0.4 * Vec3::X,
        0.4 * Vec3::Z,
        lamp,
    );
    let node = stage.glb.json["nodes"].as_array().unwrap().len() - 1;
    stage.glb.json["nodes"][node]["scale"] = match is_mirrored {
        true => json!([-1.0, 1.0, 1.0]),
        false => json!([1.0, 1.0, 1.0]),
    };
    let places = [[0.0f32; 3], [0.0, 0.1, 0.0]];
    stage
        .glb
        .animate(node, "translation", "LINEAR", &[0.0, 1.0], &places);
    stage.load()
}

/// A solid pane between lamp and floor, rough but so thin in matter that it turns light by next to nothing, and the eye under it.
fn floor_behind_solid(ior: f32) -> Scene {
    let mut pane = glass(ior);
    pane["pbrMetallicRoughness"]["roughnessFactor"] = json!(0.5);
    floor(Stage::new(0.9 * Vec3::Y, Vec3::ZERO))
        .cuboid(Vec3::Y, Vec3::new(1.9, 0.02, 1.9), pane)
        .point_light(LAMP_M, 5.0)
        .load()
}

/// A block of a transmissive material on a floor beside a lamp.
fn block(transmission: f32, ior: f32, base_color: f32) -> Scene {
    let mut material = glass(ior);
    material["pbrMetallicRoughness"]["baseColorFactor"] =
        json!([base_color, base_color, base_color, 1.0]);
    material["extensions"]["KHR_materials_transmission"]["transmissionFactor"] =
        json!(transmission);
    floor(above())
        .cuboid(Vec3::new(-0.2, 0.3, 0.0), Vec3::splat(0.25), material)
        .point_light(LAMP_M, 5.0)
        .load()
}

/// A cube in the furnace of a transmissive material.
fn cube(metallic: f32, roughness: f32, transmission: f32, ior: f32) -> Scene {
    let material = json!({
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.8, 0.8, 0.8, 1.0], "metallicFactor": metallic, "roughnessFactor": roughness,
        },
        "extensions": {
            "KHR_materials_transmission": {"transmissionFactor": transmission},
            "KHR_materials_volume": {"thicknessFactor": 1.0},
            "KHR_materials_ior": {"ior": ior},
        },
    });
    furnace()
        .cuboid(Vec3::ZERO, Vec3::splat(0.4), material)
        .load()
}

pub fn cases() -> Vec<Case> {
    let case = |name, scene| {
        Case::new(name, scene, Expected::Oracle)
            .set("photon.count", "16000")
            .set("eye.chain_max", "64")
            .control(Control::Brighter(1.4))
    };
    // As if there were no pane.
    let plain = |name, scene: Scene| {
        let mean = floor_mean(&scene, &[(LAMP_M, 5.0)]);
        Case::new(name, scene, Expected::Mean(mean))
            .set("photon.count", "16000")
            .delta_caustic()
            .control(Control::Brighter(1.4))
    };
    let same_lamp = Box::new(moving_lamp(false));
    vec![
        case(
            "a lamp behind a smooth thin pane",
            floor_behind(thin_pane(0.0), LAMP_M),
        )
        .delta_caustic(),
        case(
            "a lamp behind a rough thin pane",
            floor_behind(thin_pane(1.0), LAMP_M),
        )
        .delta_caustic(),
        // A rough surface hides a fifth of itself from light that comes at such a slant.
        case(
            "a slanted lamp behind a rough thin pane",
            floor_behind(thin_pane(1.0), SLANTED_LAMP_M),
        )
        .delta_caustic(),
        plain(
            "a lamp behind a rough pane of index 1",
            floor_behind_solid(1.0),
        ),
        plain(
            "a lamp behind a rough pane of index 1.01",
            floor_behind_solid(1.01),
        ),
        // Light that is scattered inside meets its faces beyond the critical angle.
        case("milk glass beside a lamp", block(0.5, 1.5, 0.8)),
        case("black glass of index 1 beside a lamp", block(1.0, 1.0, 0.0)),
        Case::new(
            "a one-sided lamp that moves and is mirrored",
            moving_lamp(true),
            Expected::Like(same_lamp),
        )
        .set("photon.count", "16000")
        .control(Control::Brighter(1.3)),
        case(
            "a rough metal that would let light through",
            cube(1.0, 0.6, 0.5, 1.5),
        ),
        case(
            "a mirror that would let light through",
            cube(1.0, 0.0, 0.5, 1.5),
        ),
        case("milk glass", cube(0.0, 0.0, 0.5, 1.5)),
        case("frosted milk glass", cube(0.0, 0.5, 0.5, 1.5)),
        // Wide enough a lobe to be gathered, were it not an interface's, and strong enough for that to be noticed.
        case(
            "frosted milk glass of diamond's index",
            cube(0.0, 0.75, 0.5, 2.4),
        ),
    ]
}

#[test]
fn materials_may_be_several_things_at_once_and_lamps_may_be_mirrored() {
    hold("mixtures", cases());
}
