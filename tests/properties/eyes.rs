//! Gaze, regions and views: whatever the samples, angles and poses, what comes out leads somewhere.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::{Quat, Vec2, Vec3};
use macula::fovea::{Acuity, Fixation, FixationParams, Regions, eccentricity_rad, region};
use macula::gaze::source::GazeParams;
use macula::gaze::{EyeSample, GazeRay, GazeSample, GazeSource};
use macula::view::{Fov, Pose};
use proptest::prelude::*;

use crate::runner::{hold, require};

/// Any number, and often one of those that break things.
fn any_float() -> impl Strategy<Value = f32> {
    let special = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        f32::NAN,
        f32::INFINITY,
        f32::MIN_POSITIVE,
        f32::MAX,
        1e-45,
    ];
    prop_oneof![2 => prop::num::f32::ANY, 3 => -2.0..2.0f32, 1 => prop::sample::select(special.to_vec())]
}

fn any_vector() -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(any_float()).prop_map(Vec3::from_array)
}

/// A unit vector.
fn direction() -> impl Strategy<Value = Vec3> {
    (-1.0..=1.0f32, -PI..PI).prop_map(|(z, angle)| {
        let (sin, cos) = angle.sin_cos();
        let r = (1.0 - z * z).sqrt();
        Vec3::new(r * cos, r * sin, z).normalize()
    })
}

fn rotation() -> impl Strategy<Value = Quat> {
    (direction(), -PI..PI).prop_map(|(axis, angle)| Quat::from_axis_angle(axis, angle))
}

/// A field of view that spans a picture.
fn fov() -> impl Strategy<Value = Fov> {
    let edges = || {
        let limit = 89.0f32.to_radians();
        (-limit..limit, -limit..limit).prop_filter("apart", |(a, b)| (a - b).abs() > 1e-2)
    };
    (edges(), edges()).prop_map(|((a, b), (c, d))| Fov {
        left_rad: a.min(b),
        right_rad: a.max(b),
        up_rad: c.max(d),
        down_rad: c.min(d),
    })
}

/// Time to the next sample and to the frame after it (ns), direction, openness, whether the tracker is silent.
type Moment = (i64, i64, Vec3, Option<f32>, bool);

fn moment() -> impl Strategy<Value = Moment> {
    let time = || prop_oneof![6 => -1_000_000..50_000_000i64, 1 => any::<i64>()];
    let dir = prop_oneof![3 => direction(), 1 => any_vector()];
    let openness = prop::option::of(any_float());
    (time(), time(), dir, openness, prop::bool::weighted(0.2))
}

#[test]
fn no_stream_of_samples_makes_a_gaze_that_leads_nowhere() {
    let params = (0..2_000_000_000i64, 0.0..3.0f32, 0.0..1.0f32);
    let inputs = (prop::collection::vec(moment(), 0..40), params);
    hold(
        "streams of samples",
        400,
        inputs,
        |(moments, (hold_ns, widening_rad_s, widening_max_rad))| {
            let params = GazeParams {
                hold_ns,
                widening_rad_s,
                widening_max_rad,
                ..GazeParams::default()
            };
            let mut sources = [GazeSource::live(params), GazeSource::live(params)];
            let mut seen_ns = 0i64;
            for (to_sample_ns, to_frame_ns, dir, openness, is_silent) in moments {
                seen_ns = seen_ns.wrapping_add(to_sample_ns);
                let shown_ns = seen_ns.wrapping_add(to_frame_ns);
                let eye = EyeSample {
                    openness,
                    ..EyeSample::default()
                };
                let sample = GazeSample {
                    eyes: [eye; 2],
                    ..GazeSample::combined(seen_ns, GazeRay::new(Vec3::ZERO, dir))
                };
                let sample = (!is_silent).then_some(&sample);
                let [reading, again] = sources
                    .each_mut()
                    .map(|source| source.update(shown_ns, sample));
                let dir = reading.ray.dir();
                require(
                    reading.ray.is_ahead() && dir.is_normalized(),
                    format!("{dir}"),
                )?;
                let widening_rad = reading.widening_rad;
                require(
                    (0.0..=widening_max_rad).contains(&widening_rad),
                    format!("{widening_rad}"),
                )?;
                require(
                    reading.ray == again.ray,
                    "the same samples give another gaze",
                )?;
            }
            Ok(())
        },
    );
}

#[test]
fn every_direction_is_in_one_region_and_weights_grow_outward() {
    let radii = (0.0..FRAC_PI_2, 0.0..FRAC_PI_2);
    hold(
        "regions",
        500,
        (direction(), direction(), radii),
        |(dir, gaze, (a, b))| {
            let regions = Regions {
                fovea_radius_rad: a.min(b),
                transition_radius_rad: a.max(b),
            };
            let angle_rad = eccentricity_rad(dir, gaze);
            require((0.0..=PI).contains(&angle_rad), format!("{angle_rad}"))?;
            let back_rad = eccentricity_rad(gaze, dir);
            require(
                (angle_rad - back_rad).abs() < 1e-5,
                "another angle the other way",
            )?;
            let [inside, here, outside] = [0.99, 1.0, 1.01].map(|by| regions.blend(by * angle_rad));
            require(
                inside <= here && here <= outside,
                "the weight falls outward",
            )?;
            require((0.0..=1.0).contains(&here), format!("{here}"))?;
            let acuity = Acuity::default().relative(angle_rad);
            require(acuity > 0.0 && acuity <= 1.0, format!("acuity {acuity}"))
        },
    );
}

#[test]
fn every_outline_stays_on_the_image_and_on_its_cone() {
    hold(
        "outlines",
        300,
        (fov(), direction(), 0.02..1.5f32),
        |(fov, gaze, radius_rad)| {
            for point in region::outline(&fov, gaze, radius_rad).iter().flatten() {
                let is_inside =
                    point.cmpge(Vec2::splat(-1e-3)).all() && point.cmple(Vec2::splat(1.001)).all();
                require(is_inside, format!("{point} is not on the image"))?;
                let angle_rad = eccentricity_rad(fov.dir_in_view(*point), gaze);
                require(
                    (angle_rad - radius_rad).abs() < 0.03,
                    format!("{angle_rad} off the gaze"),
                )?;
            }
            Ok(())
        },
    );
}

#[test]
fn no_outline_panics() {
    let any_fov =
        prop::array::uniform4(any_float()).prop_map(|[left_rad, right_rad, up_rad, down_rad]| {
            Fov {
                left_rad,
                right_rad,
                up_rad,
                down_rad,
            }
        });
    hold(
        "outlines of anything",
        300,
        (any_fov, any_vector(), any_float()),
        |(fov, gaze, radius_rad)| {
            let lines = region::outline(&fov, gaze, radius_rad);
            require(
                lines.iter().flatten().all(|point| point.is_finite()),
                "no point of an image",
            )
        },
    );
}

#[test]
fn what_a_view_shows_at_a_point_is_seen_at_that_point() {
    hold(
        "views",
        500,
        (fov(), 0.0..=1.0f32, 0.0..=1.0f32),
        |(fov, x, y)| {
            let point = Vec2::new(x, y);
            let dir = fov.dir_in_view(point);
            require(dir.is_normalized() && dir.z < 0.0, format!("{dir}"))?;
            let back = fov.project(dir).ok_or("it is not seen at all")?;
            require(back.distance(point) < 1e-2, format!("{back}"))
        },
    );
}

#[test]
fn a_pose_and_its_inverse_lead_back() {
    let pose = || (rotation(), prop::array::uniform3(-100.0..100.0f32));
    hold("poses", 400, (pose(), pose()), |(a, b)| {
        let [a, b] = [a, b].map(|(orientation, position)| Pose {
            orientation,
            position_m: Vec3::from_array(position),
        });
        let back = a.compose(b).compose(b.inverse());
        let moved_m = back.position_m.distance(a.position_m);
        require(moved_m < 2e-3, format!("{moved_m} m away"))?;
        let turned = (back.orientation.dot(a.orientation).abs() - 1.0).abs();
        require(turned < 1e-5, format!("turned by {turned}"))
    });
}

#[test]
fn every_eye_finds_the_point_that_is_looked_at() {
    let inputs = (
        direction(),
        prop::option::of(any_float()),
        rotation(),
        prop::array::uniform3(-0.1..0.1f32),
    );
    hold(
        "fixations",
        400,
        inputs,
        |(dir, hit_m, orientation, place)| {
            let params = FixationParams::default();
            let fixation = Fixation::of_ray(Vec3::ZERO, dir, hit_m, &params);
            require(
                fixation.distance_m.is_finite(),
                format!("{} m", fixation.distance_m),
            )?;
            require(
                fixation.distance_m >= params.min_distance_m,
                "nearer than an eye can look",
            )?;
            let eye = Pose {
                orientation,
                position_m: Vec3::from_array(place),
            };
            match fixation.gaze_dir_in_eye(eye) {
                Some(gaze) => require(gaze.is_normalized(), format!("{gaze}")),
                None => require(
                    fixation.point_m.distance(eye.position_m) < 1e-3,
                    "no direction",
                ),
            }
        },
    );
}
