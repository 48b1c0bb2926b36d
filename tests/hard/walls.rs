//! Walls in one place, walls a millimetre thin, walls with tilted normals: no light comes through.

use glam::Vec3;
use macula::scene::Scene;
use serde_json::{Value, json};

use crate::maker::{Stage, lambert};
use crate::runner::{Case, Control, Expected, hold};
use crate::shared::shared;

/// A floor with a wall of plaster across it at x = 0, a lamp on the wall's right, and an eye at `eye_x` that looks at the wall's foot.
fn lamp_behind_walls(eye_x: f32, walls: &[f32], is_double_sided: bool) -> Scene {
    let mut plaster = lambert([0.7; 3]);
    plaster["doubleSided"] = json!(is_double_sided);
    let mut stage = Stage::new(Vec3::new(eye_x, 0.6, 0.0), Vec3::ZERO)
        .quad(
            Vec3::new(-3.0, 0.0, 3.0),
            6.0 * Vec3::X,
            -6.0 * Vec3::Z,
            lambert([0.7; 3]),
        )
        .point_light(Vec3::new(0.8, 1.0, 0.0), 5.0);
    for x in walls {
        let corner = Vec3::new(*x, -0.5, -9.0);
        // Right of the middle the front is towards the lamp, left of it towards the dark.
        let (u, v) = (18.0 * Vec3::Z, 9.0 * Vec3::Y);
        let (u, v) = if *x > 0.0 { (v, u) } else { (u, v) };
        stage = stage.quad(corner, u, v, plaster.clone());
    }
    stage.load()
}

/// A wall between a lamp at the right and the eye, with normals that lean up, towards what the lamp lights.
fn tilted_normals(eye_x: f32) -> Scene {
    let (corner, u, v) = (Vec3::new(0.0, -9.0, -9.0), 18.0 * Vec3::Z, 18.0 * Vec3::Y);
    let mut stage = Stage::new(Vec3::new(eye_x, 0.0, 0.0), Vec3::ZERO)
        .quad(corner, u, v, lambert([0.5; 3]))
        .point_light(Vec3::new(1.0, 3.0, 0.0), 50.0);
    let leaning = Vec3::new(-0.2, 1.0, 0.0).normalize().to_array();
    let normals = stage.glb.floats(&[leaning; 4]);
    stage.glb.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normals);
    stage.load()
}

/// A floor under a lamp, with what hangs between them: a cut-out sheet, and a blocker that moves.
fn floor_under(has_sheet: bool, has_blocker: bool) -> Scene {
    let layer = |stage: Stage, height: f32, material: Value| {
        let corner = Vec3::new(-2.0, height, 2.0);
        stage.quad(corner, 4.0 * Vec3::X, -4.0 * Vec3::Z, material)
    };
    let mut stage = Stage::new(Vec3::new(0.0, 1.0, 2.0), Vec3::ZERO);
    stage = layer(stage, 0.0, lambert([0.5; 3])).point_light(3.0 * Vec3::Y, 10.0);
    if has_sheet {
        let mut cut_out = lambert([0.5; 3]);
        cut_out["alphaMode"] = json!("MASK");
        cut_out["pbrMetallicRoughness"]["baseColorFactor"] = json!([1.0, 1.0, 1.0, 0.1]);
        stage = layer(stage, 1.5, cut_out);
    }
    if has_blocker {
        stage = layer(stage, 2.0, lambert([0.5; 3]));
        let node = stage.glb.json["nodes"].as_array().unwrap().len() - 1;
        let places = [[0.0f32, 0.0, 0.0], [0.0, 0.1, 0.0]];
        let times = [0.0, 1.0];
        stage
            .glb
            .animate(node, "translation", "LINEAR", &times, &places);
    }
    stage.load()
}

/// Rooms a millimetre apart, where they lie beside the checkout: next to a dark room, and next to one a thousand times brighter.
fn shared_rooms() -> Vec<Case> {
    let room = |which: &str| {
        let path = shared(&format!("scenes/glb/g-thin-wall{which}.glb"))?;
        Some(Scene::load(&path).unwrap())
    };
    let (Some(dark), Some(dim), Some(bright)) = (room("-dark"), room("-dim"), room("")) else {
        return Vec::new();
    };
    let alone = Expected::Like(Box::new(dim.clone()));
    vec![
        Case::black("a dark room beside a lit one", dark, dim),
        Case::new(
            "a dim room beside one a thousand times brighter",
            bright,
            alone,
        )
        .set("photon.count", "30000")
        .set("path.samples", "16")
        .set("indirect.paths", "64")
        .control(Control::Brighter(1.5)),
    ]
}

pub fn cases() -> Vec<Case> {
    const DARK: f32 = -0.9;
    const LIT: f32 = 0.9;
    let behind = |name, walls: &[f32], is_double_sided| {
        let [dark, lit] = [DARK, LIT].map(|eye_x| lamp_behind_walls(eye_x, walls, is_double_sided));
        Case::black(name, dark, lit)
    };
    let open = floor_under(false, false);
    let mut cases = vec![
        behind("one wall that is a single sheet", &[0.0], true),
        behind("two walls in one place", &[0.0, 0.0], true),
        behind("a wall a millimetre thin", &[-5e-4, 5e-4], false),
        behind("a wall a micrometre thin", &[-5e-7, 5e-7], false),
        Case::black(
            "a wall with tilted normals",
            tilted_normals(-3.0),
            tilted_normals(3.0),
        ),
        Case::new(
            "a sheet that is cut out all over",
            floor_under(true, false),
            Expected::Like(Box::new(open.clone())),
        )
        .control(Control::Scene(Box::new(floor_under(false, true)))),
        Case::black("a moving object", floor_under(false, true), open.clone()),
        Case::black(
            "a moving object behind a cut-out sheet",
            floor_under(true, true),
            open,
        ),
    ];
    cases.extend(shared_rooms());
    cases
}

#[test]
fn no_light_comes_through_walls() {
    hold("walls", cases());
}
