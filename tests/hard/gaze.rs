//! Gaze that is no number, outside the view, behind the head, lost, blinking, late, or from the future.

use glam::Vec3;
use macula::gaze::{
    EyeSample, GazeRay, GazeSample,
    GazeState::{self, Fallback, Held, Tracked},
};

use crate::frames::{FrameCase, calm, hold, looking};

fn with_gaze(name: &'static str, gaze: &[Option<Vec3>], states: &[GazeState]) -> FrameCase {
    let frames = gaze.len() as u32;
    FrameCase::new(name, frames, |input| {
        let dir = gaze[input.index as usize];
        input.gaze = dir.map(|dir| looking(input.display_time_ns, dir));
    })
    .states(states.to_vec())
}

/// Eyes that look ahead, and whose lids shut from the third frame to the fifth.
fn blinking() -> FrameCase {
    FrameCase::new("a blink", 8, |input| {
        let is_shut = (2..5).contains(&input.index);
        let openness = Some(if is_shut { 0.0 } else { 1.0 });
        let eye = EyeSample {
            openness,
            ..EyeSample::default()
        };
        let seen = looking(input.display_time_ns, Vec3::NEG_Z);
        input.gaze = Some(GazeSample {
            eyes: [eye; 2],
            combined: seen.combined.filter(|_| !is_shut),
            ..seen
        });
    })
}

pub fn cases() -> Vec<FrameCase> {
    let ahead = Some(Vec3::NEG_Z);
    let nan = Some(Vec3::NAN);
    vec![
        with_gaze("a gaze that is no number", &[nan; 2], &[Fallback; 2]),
        with_gaze(
            "a gaze that is no number after one that is",
            &[ahead, nan, nan],
            &[Tracked, Held, Held],
        ),
        with_gaze("a gaze of no direction", &[Some(Vec3::ZERO)], &[Fallback]),
        with_gaze("an infinite gaze", &[Some(Vec3::INFINITY)], &[Fallback]),
        with_gaze(
            "a gaze as long as f32 reaches",
            &[Some(Vec3::new(0.0, 0.0, -3e38))],
            &[Tracked],
        ),
        with_gaze(
            "a gaze as short as f32 reaches",
            &[Some(Vec3::new(0.0, 0.0, -2e-38))],
            &[Tracked],
        ),
        with_gaze(
            "a gaze outside the view",
            &[Some(Vec3::new(5.0, 0.0, -1.0))],
            &[Tracked],
        ),
        with_gaze(
            "a gaze across the view",
            &[Some(Vec3::new(1.0, 0.0, -1e-7))],
            &[Tracked],
        ),
        with_gaze("a gaze sideways", &[Some(Vec3::X)], &[Fallback]),
        with_gaze(
            "a gaze behind the head",
            &[ahead, Some(Vec3::Z)],
            &[Tracked, Held],
        ),
        with_gaze("a gaze that is lost at once", &[None; 2], &[Fallback; 2]),
        with_gaze(
            "a gaze that is lost",
            &[ahead, None, None],
            &[Tracked, Held, Held],
        ),
        blinking().states(vec![Tracked, Tracked, Held, Held, Held, Held, Held, Held]),
        FrameCase::new("a gaze from a point a kilometre away", 1, |input| {
            let ray = GazeRay::new(1000.0 * Vec3::Y, Vec3::NEG_Z);
            input.gaze = Some(GazeSample::combined(input.display_time_ns, ray));
        }),
        FrameCase::new("a sample an hour old", 1, |input| {
            let then_ns = input.display_time_ns - 3_600_000_000_000;
            input.gaze = Some(looking(then_ns, Vec3::NEG_Z));
        })
        .states(vec![Fallback]),
        FrameCase::new("a sample from the future", 1, |input| {
            let then_ns = input.display_time_ns + 3_600_000_000_000;
            input.gaze = Some(looking(then_ns, Vec3::NEG_Z));
        })
        .states(vec![Fallback]),
        FrameCase::new("samples whose times run backwards", 3, |input| {
            let then_ns = calm(4 - input.index).display_time_ns;
            input.gaze = Some(looking(then_ns, Vec3::NEG_Z));
        }),
    ]
}

#[test]
fn gaze_may_be_nonsense_lost_or_late() {
    hold("gaze", cases());
}
