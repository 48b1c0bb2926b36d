//! Quaternions that are not unit, zero or no numbers; heads far away; fields of view that are lopsided, narrow, wide or none.

use glam::{Quat, Vec3};
use macula::frame::FrameInput;
use macula::view::{Fov, Pose};

use crate::frames::{FrameCase, Seen, hold};

fn fov(left_deg: f32, right_deg: f32, up_deg: f32, down_deg: f32) -> Fov {
    Fov {
        left_rad: left_deg.to_radians(),
        right_rad: right_deg.to_radians(),
        up_rad: up_deg.to_radians(),
        down_rad: down_deg.to_radians(),
    }
}

fn with_fov(name: &'static str, fov: Fov) -> FrameCase {
    FrameCase::new(name, 1, move |input| {
        input
            .local_from_eye
            .iter_mut()
            .for_each(|eye| eye.fov = fov);
    })
}

fn with_orientation(name: &'static str, orientation: Quat) -> FrameCase {
    FrameCase::new(name, 1, move |input| {
        input.local_from_head.orientation = orientation;
        let eyes = &mut input.local_from_eye;
        eyes.iter_mut()
            .for_each(|eye| eye.pose.orientation = orientation);
    })
}

fn with_head(name: &'static str, change: impl Fn(&mut Pose)) -> FrameCase {
    FrameCase::new(name, 1, move |input: &mut FrameInput| {
        change(&mut input.local_from_head)
    })
}

pub fn cases() -> Vec<FrameCase> {
    let nothing = |case: FrameCase| case.seen(Seen::Black);
    vec![
        with_orientation("a turned head", Quat::from_rotation_y(2.0)),
        with_orientation(
            "quaternions a thousand times too long",
            Quat::from_rotation_y(0.5) * 1e3,
        ),
        with_orientation(
            "quaternions a thousandth of their length",
            Quat::from_rotation_y(0.5) * 1e-3,
        ),
        nothing(with_orientation(
            "zero quaternions",
            Quat::from_array([0.0; 4]),
        )),
        nothing(with_orientation(
            "quaternions that are no numbers",
            Quat::NAN,
        )),
        with_head("a head whose pose alone is nonsense", |head| {
            head.orientation = Quat::NAN;
            head.position_m = Vec3::NAN;
        }),
        nothing(FrameCase::new("eyes that are nowhere", 1, |input| {
            let eyes = &mut input.local_from_eye;
            eyes.iter_mut()
                .for_each(|eye| eye.pose.position_m = Vec3::NAN);
        })),
        nothing(FrameCase::new("eyes 10 000 km away", 1, |input| {
            let eyes = &mut input.local_from_eye;
            eyes.iter_mut()
                .for_each(|eye| eye.pose.position_m = Vec3::splat(1e7));
        })),
        with_fov("a lopsided field of view", fov(-50.0, 40.0, 30.0, -60.0)),
        with_fov(
            "a field of view aside of the axis",
            fov(10.0, 40.0, -5.0, -30.0),
        ),
        with_fov(
            "a field of view of 1e-3 degrees",
            fov(-5e-4, 5e-4, 5e-4, -5e-4),
        ),
        with_fov(
            "a field of view of 179 degrees",
            fov(-89.5, 89.5, 89.5, -89.5),
        ),
        nothing(with_fov(
            "a field of view without width",
            fov(10.0, 10.0, 20.0, -20.0),
        )),
        nothing(with_fov(
            "a field of view the wrong way round",
            fov(30.0, -30.0, -30.0, 30.0),
        )),
        nothing(with_fov(
            "a field of view of 180 degrees",
            fov(-90.0, 90.0, 90.0, -90.0),
        )),
        nothing(with_fov(
            "a field of view that is no number",
            fov(f32::NAN, 30.0, 30.0, -30.0),
        )),
    ]
}

#[test]
fn poses_and_views_may_be_nonsense() {
    hold("poses and views", cases());
}
