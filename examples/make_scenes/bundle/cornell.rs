//! A Cornell box with a viewer inside: a red and a green wall, a lamp in the ceiling, a glass ball with its caustic, a mirror, and
//! a block that slides to and fro.

use std::f64::consts::TAU;

use glam::{DQuat, DVec2, DVec3};
use serde_json::json;

use super::glb::{Glb, Motion};
use super::material;
use super::math::{rotation, sin_cos};
use super::mesh::{Mesh, joined};

/// The room: 2.2 m wide and high, from 0.9 m behind the viewer to 2.7 m XX
const ROOM_MIN: DVec3 = DVec3::new(-1.1, 0.0, -2.7);
const ROOM_MAX: DVec3 = DVec3::new(1.1, 2.2, 0.7);
/// Where a seated viewer's eyes are.
const VIEWER: DVec3 = DVec3::new(0.0, 1.2, -0.15);
/// The lamp, x and z from `ROOM_MIN`. Behind the ball, so that the caustic falls towards the viewer.
const LAMP: [f64; 4] = [0.7, 0.4, 1.5, 1.0];
/// The round table that carries the ball and the block.
const TABLE_CENTER: DVec3 = DVec3::new(0.0, 0.0, -1.5);
const TABLE_RADIUS_M: f64 = 0.56;
const TABLE_HEIGHT_M: f64 = 0.7;
const BALL_RADIUS_M: f64 = 0.19;
const BLOCK_SIZE_M: f64 = 0.13;

pub fn make() -> Vec<u8> {
    let mut glb = Glb::new("cornell");
    let white = glb.material("white", material::lambert([0.73, 0.73, 0.73]));
    let red = glb.material("red", material::lambert([0.63, 0.065, 0.05]));
    let green = glb.material("green", material::lambert([0.14, 0.45, 0.091]));
    let blue = glb.material("blue", material::lambert([0.1, 0.2, 0.6]));
    let lamp = glb.material("lamp", material::lamp([22.0, 17.6, 11.0]));
    let mirror = glb.material("mirror", material::metal([0.95; 3], 0.0));
    let glass = glb.material("glass", material::glass(1.5, 2.0 * BALL_RADIUS_M));

    room(&mut glb, white, red, green, lamp);

    let top = DVec2::new(TABLE_RADIUS_M, TABLE_HEIGHT_M);
    let profile = [DVec2::ZERO, top * DVec2::X, top, top * DVec2::Y];
    let table = Mesh::lathe(&profile, 96).moved(TABLE_CENTER);
    glb.place("table", &table.shaded(30.0), white);

    let half = DVec3::new(0.23, 0.75, 0.23);
    let mirror_block = Mesh::cuboid(-half, half)
        .turned(rotation(DVec3::Y, 35f64.to_radians()))
        .moved(DVec3::new(-0.62, half.y, -2.15));
    glb.place("mirror block", &mirror_block.shaded(30.0), mirror);

    let ball = Mesh::sphere(BALL_RADIUS_M, 4);
    let ball = glb.mesh("glass ball", &[(&ball, glass)]);
    let place = [0.24, TABLE_HEIGHT_M + BALL_RADIUS_M, -1.28];
    glb.node("glass ball", json!({ "mesh": ball, "translation": place }));

    let half = DVec3::splat(0.5 * BLOCK_SIZE_M);
    let block = Mesh::cuboid(-half, half).shaded(30.0);
    let block = glb.mesh("sliding block", &[(&block, blue)]);
    let motion = to_and_fro();
    let start = json!({
        "mesh": block,
        "translation": motion.translations[0].to_array(),
        "rotation": motion.rotations[0].to_array(),
    });
    let block = glb.node("sliding block", start);
    glb.animate("sliding", block, &motion);

    glb.camera("viewer", VIEWER, DQuat::IDENTITY, 60.0);
    glb.finish()
}

/// The six walls and the lamp, flush in the ceiling's hole.
fn room(glb: &mut Glb, white: usize, red: usize, green: usize, lamp: usize) {
    let size = ROOM_MAX - ROOM_MIN;
    let (x, y, z) = ((DVec3::X, size.x), (DVec3::Y, size.y), (DVec3::Z, size.z));
    let ceiling = ROOM_MIN.with_y(ROOM_MAX.y);
    let whites = joined([
        Mesh::wall(ROOM_MIN, z, x, &[]),
        Mesh::wall(ceiling, x, z, &[LAMP]),
        Mesh::wall(ROOM_MIN, x, y, &[]),
        Mesh::wall(ROOM_MIN.with_z(ROOM_MAX.z), y, x, &[]),
    ]);
    glb.place("floor, ceiling and ends", &whites.shaded(30.0), white);
    let left = Mesh::wall(ROOM_MIN, y, z, &[]);
    glb.place("left wall", &left.shaded(30.0), red);
    let right = Mesh::wall(ROOM_MIN.with_x(ROOM_MAX.x), z, y, &[]);
    glb.place("right wall", &right.shaded(30.0), green);
    let corner = ceiling + DVec3::new(LAMP[0], 0.0, LAMP[1]);
    let (width_m, depth_m) = (LAMP[2] - LAMP[0], LAMP[3] - LAMP[1]);
    let panel = Mesh::wall(corner, (DVec3::X, width_m), (DVec3::Z, depth_m), &[]);
    glb.place("lamp", &panel.shaded(30.0), lamp);
}

/// Ten seconds on an arc about the table's centre, from the front left round the back to the right and home again, slowing at both ends
/// as a pendulum does; the block keeps one face towards the centre.
fn to_and_fro() -> Motion {
    const PERIOD_S: f64 = 10.0;
    const KEYS: u32 = 20;
    const ARC_RADIUS_M: f64 = 0.41;
    let (middle_rad, swing_rad) = (117f64.to_radians(), 97f64.to_radians());
    let mut motion = Motion::default();
    for key in 0..=KEYS {
        let time_s = PERIOD_S * key as f64 / KEYS as f64;
        let (sin, cos) = sin_cos(TAU * time_s / PERIOD_S);
        let azimuth_rad = middle_rad + swing_rad * cos;
        let azimuth_rate = -swing_rad * sin * TAU / PERIOD_S;
        let (sin, cos) = sin_cos(azimuth_rad);
        let on_table = TABLE_CENTER.with_y(TABLE_HEIGHT_M + 0.5 * BLOCK_SIZE_M);
        let out = DVec3::new(cos, 0.0, -sin);
        let along = DVec3::new(-sin, 0.0, -cos);
        motion.times_s.push(time_s);
        motion.translations.push(on_table + out * ARC_RADIUS_M);
        motion.velocities.push(along * ARC_RADIUS_M * azimuth_rate);
        motion.rotations.push(rotation(DVec3::Y, azimuth_rad));
    }
    motion
}
