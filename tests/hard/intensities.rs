//! Lights from a millionth of a watt to a million, alone and together.

use glam::Vec3;
use macula::scene::Scene;

use crate::runner::{Case, Expected, hold};
use crate::stages::{LAMP_M, above, floor, floor_mean};

fn lit_by(lamps: &[(Vec3, f32)]) -> Scene {
    let hang = |stage: crate::maker::Stage, lamp: &(Vec3, f32)| stage.point_light(lamp.0, lamp.1);
    lamps.iter().fold(floor(above()), hang).load()
}

pub fn cases() -> Vec<Case> {
    let case = |name, lamps: &[(Vec3, f32)]| {
        let scene = lit_by(lamps);
        let mean = floor_mean(&scene, lamps);
        Case::new(name, scene, Expected::Mean(mean))
    };
    let other = Vec3::new(-0.5, 1.2, 0.4);
    let third = Vec3::new(0.1, 1.8, 0.7);
    vec![
        case("a microwatt", &[(LAMP_M, 1e-6)]),
        case("a megawatt", &[(LAMP_M, 1e6)]),
        case("1e-20 W/sr", &[(LAMP_M, 1e-20)]),
        case("1e20 W/sr", &[(LAMP_M, 1e20)]),
        case(
            "a microwatt, a watt and a megawatt in one scene",
            &[(LAMP_M, 1e-6), (other, 1.0), (third, 1e6)],
        ),
    ]
}

#[test]
fn intensities_may_span_twelve_orders_of_magnitude() {
    hold("intensities", cases());
}
