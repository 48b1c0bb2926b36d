//! Triangles without area, twice in one place, thin as needles, tiny and huge; eyes in odd places. (What no scene can hold, vertices
//! that are no numbers, the loader refuses: tests/scene_hostile.)

use glam::Vec3;
use macula::scene::Scene;
use serde_json::{Value, json};

use crate::maker::{Stage, bundled, glowing, lambert};
use crate::runner::{Case, Control, Expected, hold};
use crate::stages::{
    ALBEDO, FLOOR_HALF_M, FURNACE, LAMP_M, above, floor, floor_mean, furnace, glass, metal,
};

const INTENSITY_W_SR: f32 = 3.0;

fn lit(stage: Stage) -> Scene {
    stage.point_light(LAMP_M, INTENSITY_W_SR).load()
}

/// The floor as a grid of `across` × `down` cells of two triangles each.
fn tiled(across: u32, down: u32) -> Stage {
    let at = |i: u32, count: u32| (2.0 * i as f32 / count as f32 - 1.0) * FLOOR_HALF_M;
    let columns = across + 1;
    let positions: Vec<Vec3> = (0..columns * (down + 1))
        .map(|i| Vec3::new(at(i % columns, across), 0.0, at(i / columns, down)))
        .collect();
    let corners: Vec<u32> = (0..across * down)
        .flat_map(|i| {
            let a = i / across * columns + i % across;
            let (b, c, d) = (a + 1, a + columns, a + columns + 1);
            [a, c, b, b, c, d]
        })
        .collect();
    above().triangles(&positions, &corners, lambert(ALBEDO))
}

/// The floor as a fan of needles from one corner of it, 4 m long and 2 cm wide at most.
fn needles() -> Stage {
    let h = FLOOR_HALF_M;
    let mut positions = vec![Vec3::new(-h, 0.0, h)];
    let steps = 200;
    let at = |i: u32| 2.0 * h * i as f32 / steps as f32;
    positions.extend((0..=steps).map(|i| Vec3::new(h, 0.0, h - at(i))));
    positions.extend((1..=steps).map(|i| Vec3::new(h - at(i), 0.0, -h)));
    let corners: Vec<u32> = (1..2 * steps + 1).flat_map(|i| [0, i, i + 1]).collect();
    above().triangles(&positions, &corners, lambert(ALBEDO))
}

/// Points and lines all over the floor, which are triangles in name only.
fn without_area() -> Stage {
    let mut positions = Vec::new();
    for i in 0..50 {
        let place = Vec3::new(-1.0 + 0.04 * i as f32, 0.5, 0.01 * i as f32);
        positions.extend([place, place, place]);
        positions.extend([place, place + 0.1 * Vec3::X, place + 0.3 * Vec3::X]);
    }
    let corners: Vec<u32> = (0..positions.len() as u32).collect();
    let stage = floor(above()).triangles(&positions, &corners, lambert([0.9; 3]));
    stage.triangles(&positions, &corners, glowing([5.0; 3]))
}

fn one_huge_triangle() -> Stage {
    let far = 1000.0;
    let positions = [
        Vec3::new(-far, 0.0, far),
        Vec3::new(far, 0.0, far),
        Vec3::new(0.0, 0.0, -far),
    ];
    above().triangles(&positions, &[0, 1, 2], lambert(ALBEDO))
}

/// A glowing room around a ball of few faces, `around` by half as many: sight meets interpolated normals that lean far from them.
fn coarse_ball(around: u32, material: Value) -> Scene {
    let columns = around + 1;
    let rows = around / 2 + 1;
    let normal = |i: u32| {
        let turn = |step: u32| std::f32::consts::TAU * step as f32 / around as f32;
        let (longitude, colatitude) = (turn(i % columns), turn(i / columns));
        let (sin, cos) = longitude.sin_cos();
        Vec3::new(sin, 0.0, cos) * colatitude.sin() + Vec3::Y * colatitude.cos()
    };
    let normals: Vec<Vec3> = (0..columns * rows).map(normal).collect();
    let corners: Vec<Vec3> = normals.iter().map(|normal| 0.6 * *normal).collect();
    let faces: Vec<u32> = (0..around * (rows - 1))
        .flat_map(|face| {
            let a = face / around * columns + face % around;
            let (b, c, d) = (a + 1, a + columns, a + columns + 1);
            [a, c, b, b, c, d]
        })
        .collect();
    let mut stage = furnace().triangles(&corners, &faces, material);
    let normals: Vec<[f32; 3]> = normals.iter().map(|normal| normal.to_array()).collect();
    let normals = stage.glb.floats(&normals);
    let ball = stage.glb.json["meshes"].as_array_mut().unwrap().last_mut();
    ball.unwrap()["primitives"][0]["attributes"]["NORMAL"] = json!(normals);
    stage.load()
}

/// How far the normals of [`leaning_floor`] lean, radians.
const LEAN_RAD: f32 = 0.7;
/// Irradiance on what faces the light over [`leaning_floor`], W/m².
const SUN_W_M2: f32 = 4.0;

/// A floor whose normals lean away from the eye, under a light straight from above; with a pane between them or without.
fn leaning_floor(pane: Option<Value>) -> Scene {
    let side = 12.0;
    let corner = |height: f32| Vec3::new(-0.5 * side, height, 0.5 * side);
    let eye = Vec3::new(0.0, 2.0, -0.73);
    let mut stage = Stage::new(eye, Vec3::ZERO);
    stage = stage.quad(
        corner(0.0),
        side * Vec3::X,
        -side * Vec3::Z,
        lambert(ALBEDO),
    );
    let leaning = Vec3::new(0.0, LEAN_RAD.cos(), LEAN_RAD.sin()).to_array();
    let normals = stage.glb.floats(&[leaning; 4]);
    stage.glb.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normals);
    if let Some(pane) = pane {
        stage = stage.quad(corner(3.0), side * Vec3::X, -side * Vec3::Z, pane);
    }
    let down = glam::Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2).to_array();
    let sun = json!({"type": "directional", "intensity": SUN_W_M2});
    stage.light(sun, json!({"rotation": down})).load()
}

/// The bundled Cornell box from an eye at `place`, which knows the glass ball's corners.
fn cornell_from(place: impl FnOnce(&Scene, &[Vec3]) -> Vec3) -> Scene {
    let mut scene = Scene::load(&bundled("cornell.glb")).unwrap();
    let mesh = &scene.static_mesh;
    let is_glass = |triangle: &usize| {
        let material = mesh.material_of_triangle[*triangle] as usize;
        scene.materials[material].transmission > 0.0
    };
    let of_glass = (0..mesh.triangles.len()).filter(is_glass);
    let on_glass: Vec<Vec3> = of_glass.map(|triangle| mesh.corners(triangle)[0]).collect();
    scene.cameras[0].pose.position_m = place(&scene, &on_glass);
    scene
}

pub fn cases() -> Vec<Case> {
    let right = floor_mean(&lit(floor(above())), &[(LAMP_M, INTENSITY_W_SR)]);
    let same = |name, stage| Case::new(name, lit(stage), Expected::Mean(right));
    let seen_from = |name, scene| {
        Case::new(name, scene, Expected::Oracle)
            .set("photon.count", "16000")
            .set("eye.chain_max", "64")
            .control(Control::Brighter(1.4))
    };
    // No light is lost.
    let whole = |name, scene| Case::new(name, scene, Expected::Mean(FURNACE));
    let sunlit = f64::from(SUN_W_M2 * LEAN_RAD.cos()) / std::f64::consts::PI;
    let sunlit = ALBEDO.map(|albedo| f64::from(albedo) * sunlit);
    let leaning = |name, scene| Case::new(name, scene, Expected::Mean(sunlit));
    let mut nothing = glass(1.0);
    nothing["extensions"]["KHR_materials_volume"]["thicknessFactor"] = json!(0.0);
    vec![
        leaning("normals that lean away from the eye", leaning_floor(None)),
        leaning(
            "and behind a pane that does nothing",
            leaning_floor(Some(nothing)),
        )
        .delta_caustic(),
        Case::new(
            "a coarse diffuse ball with smooth normals",
            coarse_ball(6, lambert([0.9; 3])),
            Expected::Oracle,
        )
        .passes(16)
        .set("photon.count", "30000"),
        same("triangles without area", without_area()),
        same("every triangle twice", floor(floor(above()))),
        same("needles", needles()),
        same("slivers a millimetre wide", tiled(1, 4000)),
        same("tiny triangles", tiled(150, 150)),
        same("one triangle of a square kilometre", one_huge_triangle())
            .set("gather.radius_m", "0.2"),
        whole(
            "a coarse mirror with smooth normals",
            coarse_ball(4, metal(0.0)),
        ),
        whole(
            "coarse glass with smooth normals",
            coarse_ball(6, glass(1.5)),
        )
        .known_shortfall(0.05)
        .control(Control::Brighter(1.4)),
        seen_from(
            "an eye inside glass",
            cornell_from(|_, glass| glass.iter().sum::<Vec3>() / glass.len() as f32),
        ),
        seen_from("an eye on glass", cornell_from(|_, glass| glass[0])),
        seen_from(
            "an eye in the room's corner",
            cornell_from(|scene, _| scene.bounds.max - 1e-3),
        ),
    ]
}

#[test]
fn triangles_may_be_flat_double_thin_tiny_or_huge() {
    hold("geometry", cases());
}
