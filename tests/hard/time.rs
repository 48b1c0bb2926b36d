//! Time that stands still, runs backwards, leaps, or is no number.

use macula::gaze::GazeState::Tracked;

use crate::frames::{FrameCase, calm, hold, looking};

pub fn cases() -> Vec<FrameCase> {
    let at = |name, times_ns: &[i64]| {
        let times_ns = times_ns.to_vec();
        FrameCase::new(name, times_ns.len() as u32, move |input| {
            let time_ns = times_ns[input.index as usize];
            input.display_time_ns = time_ns;
            input.scene_time_s = time_ns as f64 * 1e-9;
            input.gaze = Some(looking(time_ns, glam::Vec3::NEG_Z));
        })
    };
    let scene_time =
        |name, time_s: f64| FrameCase::new(name, 1, move |input| input.scene_time_s = time_s);
    let now_ns = calm(0).display_time_ns;
    vec![
        at("time that stands still", &[now_ns; 3]),
        at(
            "time that runs backwards",
            &[now_ns, now_ns - 11_111_111, now_ns - 22_222_222],
        ),
        at(
            "time that leaps a century",
            &[now_ns, now_ns + 3_155_760_000_000_000_000],
        ),
        at("time before all time", &[-now_ns, 0, now_ns]),
        at(
            "the first and the last moment that OpenXR knows",
            &[8_000_001, i64::MAX],
        ),
        scene_time("a scene's time that is no number", f64::NAN).states(vec![Tracked]),
        scene_time("a scene's time that is infinite", f64::INFINITY),
        scene_time("a scene's time before its start", -1e9),
    ]
}

#[test]
fn time_may_stand_still_run_backwards_or_leap() {
    hold("time", cases());
}
