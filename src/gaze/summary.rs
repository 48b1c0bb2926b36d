//! What a recorded session holds, in numbers: for people who must decide whether to use it.

use glam::{EulerRot, Quat};
use serde::Serialize;

use super::events::{EventKind, EventParams, detect_events};
use super::trace::{Session, head_flags};
use crate::fovea::eccentricity_rad;

/// Rates, gaps, validity, events and head motion of a session. SI units; angles in radians.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// First to last frame, seconds.
    pub duration_s: f64,
    /// Eye-tracker samples.
    pub gaze_samples: usize,
    /// Their rate, Hz, gaps left out.
    pub gaze_rate_hz: f64,
    /// Intervals of more than 1.5 times the median one.
    pub gaze_gaps: usize,
    /// Longest interval between samples, seconds.
    pub gaze_longest_gap_s: f64,
    /// Share of samples with a combined gaze direction.
    pub gaze_valid_share: f64,
    /// Share of samples in which the left and the right eye each are valid.
    pub eye_valid_share: [f64; 2],
    /// Median time from taking to receiving a sample, seconds; `None` where the session tells no times of receipt.
    pub gaze_median_latency_s: Option<f64>,
    /// Display frames.
    pub frames: usize,
    /// Their rate, Hz, gaps left out.
    pub frame_rate_hz: f64,
    /// Share of frames in which the head was tracked.
    pub head_tracked_share: f64,
    /// Smallest and largest head yaw (positive to the left), pitch (up) and roll in LOCAL space, radians; yaw is followed
    /// over full turns.
    pub head_yaw_rad: [f64; 2],
    /// See `head_yaw_rad`.
    pub head_pitch_rad: [f64; 2],
    /// See `head_yaw_rad`.
    pub head_roll_rad: [f64; 2],
    /// Largest distance of the head from where it began, metres.
    pub head_reach_m: f64,
    /// Fastest turning of the head, rad/s.
    pub head_peak_speed_rad_s: f64,
    /// Distance between the eyes in the frames, metres; `None` without frames.
    pub ipd_m: Option<f64>,
    /// Number of fixations.
    pub fixations: usize,
    /// Number of smooth pursuits.
    pub pursuits: usize,
    /// Number of saccades.
    pub saccades: usize,
    /// Number of blinks.
    pub blinks: usize,
    /// Number of losses of tracking that are no blinks.
    pub losses: usize,
    /// Median amplitude of the saccades, radians; `None` without any.
    pub saccade_median_amplitude_rad: Option<f64>,
    /// The check of left and right by the vestibulo-ocular reflex; `None` where the head hardly turned.
    pub reflex: Option<Reflex>,
}

/// The vestibulo-ocular reflex: outside saccades the eyes turn against the head. If they turn with it, left and right of the
/// gaze or of the head are swapped.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Reflex {
    /// Correlation of head yaw speed (to the left) with gaze speed in the head (to the right); positive if all is right.
    pub correlation: f64,
    /// Slope of that relation: 1 for a perfect reflex.
    pub gain: f64,
    /// Sample intervals behind it.
    pub intervals: usize,
}

impl Reflex {
    /// Weakest correlation that says anything.
    pub const MEANINGFUL: f64 = 0.2;

    /// Whether the data contradict the handedness that the session claims.
    pub fn contradicts(&self) -> bool {
        self.correlation < -Self::MEANINGFUL
    }
}

/// Slowest head turn that counts for the reflex, rad/s: 3 degrees per second, above the noise of head tracking.
const REFLEX_MIN_HEAD_SPEED_RAD_S: f64 = 3.0 * std::f64::consts::PI / 180.0;
/// Fewest intervals that make a correlation: half a second at 120 Hz.
const REFLEX_MIN_INTERVALS: usize = 60;
/// Speeds are taken over this time, ns: longer than a display frame, so that a head pose that is repeated doesn't count twice.
const REFLEX_SPAN_NS: i64 = 25_000_000;

impl Summary {
    /// The numbers of a session.
    pub fn of(session: &Session) -> Self {
        let gaze_times: Vec<i64> = session.gaze.iter().map(|sample| sample.time_ns).collect();
        let frame_times: Vec<i64> = session
            .frames
            .iter()
            .map(|frame| frame.predicted_display_ns)
            .collect();
        let gaze = Rhythm::of(&gaze_times);
        let events = detect_events(session, EventParams::default());
        let count = |kind: EventKind| events.iter().filter(|event| event.kind == kind).count();
        let saccades = events
            .iter()
            .filter(|event| event.kind == EventKind::Saccade);
        let latencies = session
            .gaze
            .iter()
            .filter_map(|sample| Some((sample.recv_ns? - sample.time_ns) as f64 * 1e-9));
        let head = HeadMotion::of(session);
        Self {
            duration_s: session.duration_ns() as f64 * 1e-9,
            gaze_samples: session.gaze.len(),
            gaze_rate_hz: gaze.rate_hz,
            gaze_gaps: gaze.gaps,
            gaze_longest_gap_s: gaze.longest_s,
            gaze_valid_share: share(&session.gaze, |sample| sample.combined.is_some()),
            eye_valid_share: [0, 1]
                .map(|eye| share(&session.gaze, |sample| sample.eyes[eye].ray.is_some())),
            gaze_median_latency_s: median(latencies.collect()),
            frames: session.frames.len(),
            frame_rate_hz: Rhythm::of(&frame_times).rate_hz,
            head_tracked_share: share(&session.frames, |frame| {
                frame.head_flags & head_flags::TRACKED == head_flags::TRACKED
            }),
            head_yaw_rad: head.ranges[0],
            head_pitch_rad: head.ranges[1],
            head_roll_rad: head.ranges[2],
            head_reach_m: head.reach_m,
            head_peak_speed_rad_s: head.peak_speed_rad_s,
            ipd_m: session.frames.first().map(|frame| {
                let [left, right] = frame.head_from_eyes;
                f64::from(left.pose.position_m.distance(right.pose.position_m))
            }),
            fixations: count(EventKind::Fixation),
            pursuits: count(EventKind::Pursuit),
            saccades: count(EventKind::Saccade),
            blinks: count(EventKind::Blink),
            losses: count(EventKind::Loss),
            saccade_median_amplitude_rad: median(
                saccades
                    .map(|event| f64::from(event.amplitude_rad))
                    .collect(),
            ),
            reflex: reflex(session),
        }
    }
}

/// How evenly times follow each other.
struct Rhythm {
    rate_hz: f64,
    gaps: usize,
    longest_s: f64,
}

impl Rhythm {
    fn of(times_ns: &[i64]) -> Self {
        let steps_s: Vec<f64> = times_ns
            .windows(2)
            .map(|pair| (pair[1] - pair[0]) as f64 * 1e-9)
            .collect();
        let gap_s = 1.5 * median(steps_s.clone()).unwrap_or(0.0);
        let even: Vec<f64> = steps_s
            .iter()
            .copied()
            .filter(|&step_s| step_s <= gap_s)
            .collect();
        // The mean, because times in whole milliseconds have no median of their own.
        let even_s: f64 = even.iter().sum();
        Self {
            rate_hz: if even_s > 0.0 {
                even.len() as f64 / even_s
            } else {
                0.0
            },
            gaps: steps_s.len() - even.len(),
            longest_s: steps_s.into_iter().fold(0.0, f64::max),
        }
    }
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

fn share<T>(items: &[T], is_so: impl Fn(&T) -> bool) -> f64 {
    items.iter().filter(|item| is_so(item)).count() as f64 / items.len().max(1) as f64
}

/// Yaw (positive to the left), pitch (up) and roll of a rotation, radians.
fn yaw_pitch_roll(rotation: Quat) -> [f64; 3] {
    let (yaw, pitch, roll) = rotation.to_euler(EulerRot::YXZ);
    [yaw, pitch, roll].map(f64::from)
}

/// The angle equal to `angle_rad` up to full turns that is nearest to `near_rad`.
fn unwrap_rad(angle_rad: f64, near_rad: f64) -> f64 {
    let turns = ((near_rad - angle_rad) / std::f64::consts::TAU).round();
    angle_rad + turns * std::f64::consts::TAU
}

#[derive(Default)]
struct HeadMotion {
    ranges: [[f64; 2]; 3],
    reach_m: f64,
    peak_speed_rad_s: f64,
}

impl HeadMotion {
    fn of(session: &Session) -> Self {
        let mut poses = session
            .frames
            .iter()
            .filter_map(|frame| Some((frame.predicted_display_ns, frame.local_from_head?)));
        let Some(first) = poses.next() else {
            return Self::default();
        };
        let mut angles = yaw_pitch_roll(first.1.orientation);
        let mut motion = Self {
            ranges: angles.map(|angle| [angle, angle]),
            ..Self::default()
        };
        let mut last = first;
        for (time_ns, pose) in poses {
            let now = yaw_pitch_roll(pose.orientation);
            for axis in 0..3 {
                angles[axis] = unwrap_rad(now[axis], angles[axis]);
                let [low, high] = &mut motion.ranges[axis];
                (*low, *high) = (low.min(angles[axis]), high.max(angles[axis]));
            }
            motion.reach_m = motion
                .reach_m
                .max(pose.position_m.distance(first.1.position_m).into());
            let step_s = (time_ns - last.0) as f64 * 1e-9;
            let turn_rad = f64::from(last.1.orientation.angle_between(pose.orientation));
            motion.peak_speed_rad_s = motion.peak_speed_rad_s.max(turn_rad / step_s);
            last = (time_ns, pose);
        }
        motion
    }
}

/// Correlates head turning with eye turning over pairs of samples [`REFLEX_SPAN_NS`] apart, saccades and blinks left out.
fn reflex(session: &Session) -> Option<Reflex> {
    let params = EventParams::default();
    let mut sums = [0.0; 5];
    let mut intervals = 0;
    let mut from = 0;
    for (to, sample) in session.gaze.iter().enumerate() {
        while session.gaze[from].time_ns < sample.time_ns - REFLEX_SPAN_NS {
            from += 1;
        }
        let span = &session.gaze[from..=to];
        let step_s = (sample.time_ns - span[0].time_ns) as f64 * 1e-9;
        if span.len() < 2 || step_s < 0.5e-9 * REFLEX_SPAN_NS as f64 {
            continue;
        }
        // A blink, or a speed that may be a saccade, anywhere in the span spoils it.
        let slow = span
            .windows(2)
            .all(|pair| match (pair[0].combined, pair[1].combined) {
                (Some(before), Some(after)) => {
                    let between_s = (pair[1].time_ns - pair[0].time_ns) as f32 * 1e-9;
                    eccentricity_rad(before.dir(), after.dir())
                        < params.saccade_end_rad_s * between_s
                }
                _ => false,
            });
        let (Some(before), Some(after), true) = (span[0].combined, sample.combined, slow) else {
            continue;
        };
        let heads = session
            .local_from_head_at(span[0].time_ns)
            .zip(session.local_from_head_at(sample.time_ns));
        let Some((head_before, head_after)) = heads else {
            continue;
        };
        let azimuth = |dir: glam::Vec3| f64::from(dir.x.atan2(-dir.z));
        let eye_right = (azimuth(after.dir()) - azimuth(before.dir())) / step_s;
        let yaw_before = yaw_pitch_roll(head_before.orientation)[0];
        let head_left = (unwrap_rad(yaw_pitch_roll(head_after.orientation)[0], yaw_before)
            - yaw_before)
            / step_s;
        if head_left.abs() < REFLEX_MIN_HEAD_SPEED_RAD_S {
            continue;
        }
        intervals += 1;
        for (sum, term) in sums.iter_mut().zip([
            head_left,
            eye_right,
            head_left * head_left,
            eye_right * eye_right,
            head_left * eye_right,
        ]) {
            *sum += term;
        }
    }
    if intervals < REFLEX_MIN_INTERVALS {
        return None;
    }
    let [head, eye, head_head, eye_eye, head_eye] = sums.map(|sum| sum / intervals as f64);
    let covariance = head_eye - head * eye;
    let (head_variance, eye_variance) = (head_head - head * head, eye_eye - eye * eye);
    let spread = (head_variance * eye_variance).sqrt();
    (spread > 0.0).then(|| Reflex {
        correlation: covariance / spread,
        gain: covariance / head_variance,
        intervals,
    })
}
