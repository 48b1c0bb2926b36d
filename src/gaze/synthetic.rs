//! A made-up recording of natural look: the one that is bundled with the project, and test data.
//!
//! A person looks around a small room: saccades on the main sequence, head turns that follow them while the
//! vestibulo-ocular reflex keeps the gaze in place, fixations with drift and tremor, one pursuit, two blinks, a stretch of lost
//! tracking. Nobody was recorded. All numbers come from the script below and a counter-free generator of pseudo-random
//! numbers, so that every run makes the same session.

use glam::{DQuat, DVec3, EulerRot, Quat, Vec3};

use super::import::head::eyes;
use super::trace::{FrameGaze, FrameRecord, Metadata, Session, head_flags};
use super::{EyeSample, GazeRay, GazeSample, GazeState};
use crate::view::{Fov, Pose};

/// XrTime of the first frame.
const START_NS: i64 = 1_000_000_000;
const FRAMES: u64 = 900;
const FRAME_PERIOD_NS: i64 = 11_111_111;
const SAMPLES: i64 = 2000;
/// How long before the first frame the tracker runs, so that the first frame has a gaze, ns.
const TRACKER_LEAD_NS: i64 = 25_000_000;
const SAMPLE_PERIOD_NS: i64 = 5_000_000;
/// How long before its display time a frame takes the newest gaze sample, ns.
const FRAME_LEAD_NS: i64 = 14_000_000;
const SEED: u64 = 1;
const IPD_M: f32 = 0.063;
const MEAN_PUPIL_MM: f64 = 3.6;

/// Where the person looks from a time on: seconds, degrees to the right, degrees up, metres.
const LOOKS: [(f64, f64, f64, f64); 20] = [
    (-1.0, 0.0, 0.0, 1.8),
    (0.45, -9.0, 4.0, 2.0),
    (0.85, -21.0, -3.0, 1.7),
    (1.30, -25.0, -12.0, 1.5),
    (1.62, -16.0, -8.0, 1.6),
    (2.05, 4.0, -6.0, 1.4),
    (3.00, 14.0, 3.0, 2.2),
    (3.35, 27.0, 6.0, 2.4),
    (3.75, 30.0, -5.0, 2.0),
    (4.10, 21.0, -12.0, 1.3),
    (4.95, 8.0, -10.0, 1.2),
    (5.30, -4.0, 1.0, 2.6),
    (5.60, -10.0, 3.0, 2.4),
    (PURSUIT_START_S, -16.0, -2.0, 1.7),
    (7.75, 20.0, 1.0, 2.0),
    (8.10, 12.0, -8.0, 1.5),
    (8.40, 3.0, -3.0, 1.8),
    (9.05, -7.0, 5.0, 2.3),
    (9.35, -14.0, -4.0, 1.6),
    (9.65, -2.0, 0.0, 1.8),
];
/// The look that begins here goes to a thing that moves to the right.
const PURSUIT_START_S: f64 = 5.90;
const PURSUIT_END_S: f64 = 7.75;
const PURSUIT_DEG_PER_S: f64 = 14.0;
/// When the lids begin to close, seconds.
const BLINKS_S: [f64; 2] = [2.60, 8.62];
/// When the tracker does not find the eyes though they are open, seconds.
const LOST_S: std::ops::Range<f64> = 4.35..4.75;
/// Below this openness the tracker does not see the pupil.
const SEEN_OPENNESS: f64 = 0.35;

/// The bundled session: 10 s, 900 frames at 90 Hz, 2000 samples at 200 Hz.
pub fn natural_look() -> Session {
    let mut eyes_now = Eyes::new();
    let gaze: Vec<GazeSample> = (0..SAMPLES).map(|index| eyes_now.sample(index)).collect();
    let frames = (0..FRAMES)
        .map(|frame| frame_record(frame, &gaze))
        .collect();
    Session {
        metadata: metadata(),
        gaze,
        frames,
        ..Session::default()
    }
}

fn metadata() -> Metadata {
    Metadata {
        name: Some("natural-look".to_owned()),
        source: Some("synthetic".to_owned()),
        software: Some("macula, examples/make_session.rs".to_owned()),
        seed: Some(SEED),
        notes: vec![
            "Made up by a program; nobody was recorded.".to_owned(),
            "10 s of a person looking around a small room: saccades, fixations, one pursuit (5.9 to 7.7 s), two blinks (2.6 and 8.6 s), lost tracking (4.35 to 4.75 s).".to_owned(),
        ],
        ..Metadata::default()
    }
}

fn seconds(time_ns: i64) -> f64 {
    (time_ns - START_NS) as f64 * 1e-9
}

/// From 0 to 1 with no jerk at either end (Flash and Hogan 1985): how eyes and heads turn.
fn minimum_jerk(share: f64) -> f64 {
    let s = share.clamp(0.0, 1.0);
    s * s * s * (10.0 + s * (6.0 * s - 15.0))
}

/// A direction in LOCAL space from angles in degrees.
fn direction(azimuth_deg: f64, elevation_deg: f64) -> DVec3 {
    let (sin_azimuth, cos_azimuth) = azimuth_deg.to_radians().sin_cos();
    let (sin_elevation, cos_elevation) = elevation_deg.to_radians().sin_cos();
    DVec3::new(
        sin_azimuth * cos_elevation,
        sin_elevation,
        -cos_azimuth * cos_elevation,
    )
}

/// The place in LOCAL space that a look goes to, metres.
fn target_m(look: usize, time_s: f64) -> DVec3 {
    let (start_s, azimuth_deg, elevation_deg, distance_m) = LOOKS[look];
    let moved_s = match start_s == PURSUIT_START_S {
        true => time_s.clamp(PURSUIT_START_S, PURSUIT_END_S) - PURSUIT_START_S,
        false => 0.0,
    };
    let elevation_deg = elevation_deg + 3.0 * (2.0 * moved_s).sin();
    direction(azimuth_deg + PURSUIT_DEG_PER_S * moved_s, elevation_deg) * distance_m
}

/// The place in LOCAL space that is looked at, metres: a target, or on the way from one to the next along the main sequence
/// (duration 21 ms + 2.2 ms a degree, Carpenter 1988).
fn fixation_m(time_s: f64, head_m: DVec3) -> DVec3 {
    let look = LOOKS.iter().rposition(|look| look.0 <= time_s).unwrap_or(0);
    let to = target_m(look, time_s) - head_m;
    let from = target_m(look.saturating_sub(1), time_s) - head_m;
    let duration_s = 0.021 + 0.0022 * from.angle_between(to).to_degrees();
    let share = minimum_jerk((time_s - LOOKS[look].0) / duration_s);
    let dir = DQuat::IDENTITY.slerp(
        DQuat::from_rotation_arc(from.normalize(), to.normalize()),
        share,
    ) * from.normalize();
    // Vergence, the inverse of the distance, is what the eyes change.
    let distance_m = 1.0 / (1.0 / from.length() * (1.0 - share) + 1.0 / to.length() * share);
    head_m + dir * distance_m
}

/// The head in LOCAL space: it takes up half of each look's turn, a little later and slower than the eyes, and sways.
fn local_from_head(time_s: f64) -> (DQuat, DVec3) {
    let (mut yaw_deg, mut pitch_deg) = (0.0, 0.0);
    let mut turn = |start_s: f64, duration_s: f64, right_deg: f64, up_deg: f64| {
        let share = minimum_jerk((time_s - start_s) / duration_s);
        yaw_deg -= 0.5 * right_deg * share;
        pitch_deg += 0.4 * up_deg * share;
    };
    for pair in LOOKS.windows(2) {
        let ((_, from_right, from_up, _), (start_s, right, up, _)) = (pair[0], pair[1]);
        let pursued_deg = match pair[0].0 == PURSUIT_START_S {
            true => PURSUIT_DEG_PER_S * (PURSUIT_END_S - PURSUIT_START_S),
            false => 0.0,
        };
        turn(
            PURSUIT_START_S,
            PURSUIT_END_S - PURSUIT_START_S,
            pursued_deg,
            0.0,
        );
        turn(
            start_s + 0.05,
            0.55,
            right - from_right - pursued_deg,
            up - from_up,
        );
    }
    let wave = |hertz: f64| (std::f64::consts::TAU * hertz * time_s).sin();
    let orientation = DQuat::from_euler(
        EulerRot::YXZ,
        (yaw_deg + 0.5 * wave(0.31)).to_radians(),
        (pitch_deg + 0.4 * wave(0.43)).to_radians(),
        (0.05 * yaw_deg + 0.6 * wave(0.19)).to_radians(),
    );
    let position_m = DVec3::new(
        0.018 * wave(0.23) + 0.004 * wave(0.71) - 0.0008 * yaw_deg,
        0.006 * wave(0.37) + 0.0005 * pitch_deg,
        0.014 * wave(0.17) + 0.005 * wave(0.53),
    );
    (orientation, position_m)
}

/// Openness of the lids, 0 to 1: shut in 70 ms, 50 ms shut, open again in 130 ms.
fn openness(time_s: f64) -> f64 {
    let shut = |start_s: f64| {
        minimum_jerk((time_s - start_s) / 0.07) - minimum_jerk((time_s - start_s - 0.12) / 0.13)
    };
    1.0 - BLINKS_S.iter().map(|&start_s| shut(start_s)).sum::<f64>()
}

/// What the eyes carry from sample to sample: drift, which wanders.
struct Eyes {
    noise: Noise,
    drift_rad: [f64; 2],
}

impl Eyes {
    fn new() -> Self {
        Self {
            noise: Noise::new(SEED),
            drift_rad: [0.0; 2],
        }
    }

    fn sample(&mut self, index: i64) -> GazeSample {
        let time_ns = START_NS - TRACKER_LEAD_NS + index * SAMPLE_PERIOD_NS;
        let time_s = seconds(time_ns);
        let openness = openness(time_s);
        let jitter_rad = self.jitter_rad(openness);
        let pupil_mm = MEAN_PUPIL_MM + 0.15 * (1.3 * time_s).sin() + 0.05 * (5.1 * time_s).sin();
        let latency_ns = 7_000_000 + (self.noise.uniform() * 3e6) as i64;
        let (orientation, head_m) = local_from_head(time_s);
        let point_m = orientation.inverse() * (fixation_m(time_s, head_m) - head_m);
        let seen = openness >= SEEN_OPENNESS && !LOST_S.contains(&time_s);
        let ray = |x_m: f64| {
            let origin_m = DVec3::new(x_m, 0.0, 0.0);
            let dir = jitter_rad * (point_m - origin_m).normalize();
            GazeRay::new(rounded_vector(origin_m), rounded_vector(dir)).filter(|_| seen)
        };
        let half_ipd_m = 0.5 * f64::from(IPD_M);
        let eye = |x_m: f64, wider_mm: f64| EyeSample {
            ray: ray(x_m),
            openness: Some(rounded(openness, 1e3)),
            pupil_mm: seen.then(|| rounded(pupil_mm + wider_mm, 1e3)),
        };
        GazeSample {
            time_ns,
            recv_ns: Some(time_ns + latency_ns),
            combined: ray(0.0),
            confidence: Some(if seen { 1.0 } else { 0.0 }),
            eyes: [eye(-half_ipd_m, 0.0), eye(half_ipd_m, -0.08)],
        }
    }

    /// Drift (a tenth of a degree, over a third of a second), tremor with the tracker's noise, and the pull of a closing lid.
    fn jitter_rad(&mut self, openness: f64) -> DQuat {
        let step_s = SAMPLE_PERIOD_NS as f64 * 1e-9;
        let [right_rad, up_rad] = &mut self.drift_rad;
        for drift_rad in [&mut *right_rad, &mut *up_rad] {
            let wander = 0.26_f64.to_radians() * step_s.sqrt() * self.noise.gaussian();
            *drift_rad += wander - *drift_rad * step_s / 0.3;
        }
        let mut tremor_rad = || 0.015_f64.to_radians() * self.noise.gaussian();
        let lid_rad = -(3.0_f64.to_radians()) * (1.0 - openness).powi(2);
        DQuat::from_euler(
            EulerRot::YXZ,
            *right_rad + tremor_rad(),
            *up_rad + tremor_rad() + lid_rad,
            0.0,
        )
    }
}

fn frame_record(frame: u64, gaze: &[GazeSample]) -> FrameRecord {
    let predicted_display_ns = START_NS + frame as i64 * FRAME_PERIOD_NS;
    let (orientation, position_m) = local_from_head(seconds(predicted_display_ns));
    let asked_ns = predicted_display_ns - FRAME_LEAD_NS;
    let received =
        gaze.partition_point(|sample| sample.recv_ns.is_some_and(|recv_ns| recv_ns <= asked_ns));
    let newest = gaze[..received].last();
    let newest_seen = gaze[..received]
        .iter()
        .rev()
        .find(|sample| sample.combined.is_some());
    let is_newest = newest
        .zip(newest_seen)
        .is_some_and(|(one, other)| one.time_ns == other.time_ns);
    let used = newest_seen.and_then(|sample| {
        Some(FrameGaze {
            sample_time_ns: Some(sample.time_ns),
            dir_in_view: sample.combined?.dir(),
            state: if is_newest {
                GazeState::Tracked
            } else {
                GazeState::Held
            },
        })
    });
    let fallback = FrameGaze {
        sample_time_ns: None,
        dir_in_view: GazeRay::FORWARD.dir(),
        state: GazeState::Fallback,
    };
    FrameRecord {
        frame,
        trial: None,
        predicted_display_ns,
        period_ns: Some(FRAME_PERIOD_NS),
        local_from_head: Some(Pose {
            orientation: Quat::from_array(orientation.to_array().map(|part| rounded(part, 1e6))),
            position_m: rounded_vector(position_m),
        }),
        head_flags: head_flags::TRACKED,
        head_from_eyes: eyes(IPD_M, fovs()),
        gaze: Some(used.unwrap_or(fallback)),
        cpu_ms: None,
        gpu_ms: None,
        missed: None,
    }
}

/// Wider outwards than towards the nose, wider down than up, as headsets are.
fn fovs() -> [Fov; 2] {
    let angle = |deg: f64| rounded(deg.to_radians(), 1e6);
    let left = Fov {
        left_rad: angle(-50.0),
        right_rad: angle(45.0),
        up_rad: angle(46.0),
        down_rad: angle(-49.0),
    };
    let right = Fov {
        left_rad: angle(-45.0),
        right_rad: angle(50.0),
        ..left
    };
    [left, right]
}

/// Rounded to a grid of 1 / `per_unit`: the file stays small, and libraries that compute a sine's last bit differently
/// make the same file.
fn rounded(value: f64, per_unit: f64) -> f32 {
    // Adding zero turns -0 into 0.
    ((value * per_unit).round() / per_unit) as f32 + 0.0
}

fn rounded_vector(vector: DVec3) -> Vec3 {
    Vec3::from_array(vector.to_array().map(|part| rounded(part, 1e6)))
}

/// Pseudo-random numbers (SplitMix64, Steele, Lea and Flood 2014).
pub(crate) struct Noise(u64);

impl Noise {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Evenly distributed between 0 and 1.
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        bits ^= bits >> 31;
        (bits >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Nearly normally distributed with standard deviation 1: twelve even numbers added, which needs no logarithm and so gives
    /// the same bits everywhere.
    pub(crate) fn gaussian(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}
