//! Saccades, fixations, pursuits, blinks and losses of tracking, found sample by sample.
//!
//! A saccade is fast by eye-in-head velocity, with hysteresis (velocity threshold, Salvucci and Goldberg, ETRA 2000); where
//! the head is known its own turning must not explain the movement (the vestibulo-ocular reflex turns the eye fast while the
//! gaze stays). Between saccades the gaze in the world tells fixation from pursuit. Lids that close corrupt the samples
//! around a blink, so blinks and losses are widened on both sides.

mod detector;

use super::trace::Session;
pub use detector::EventDetector;

/// Thresholds of the detector. Angular speeds in rad/s, times in ns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EventParams {
    /// Speed at which a saccade is recognised, rad/s; 0.3 to 10. Default 100°/s.
    pub saccade_onset_rad_s: f32,
    /// Speed below which it has ended, rad/s; below the onset. Default 60°/s.
    pub saccade_end_rad_s: f32,
    /// Fewest intervals between samples that a saccade spans; 1 to 10. Default 2: one alone is a spike.
    pub saccade_min_intervals: u32,
    /// A lid less open than this blinks; 0 to 1. Default 0.5.
    pub blink_openness: f32,
    /// How far a blink or loss is widened before and after, ns. Default 50 ms.
    pub blink_padding_ns: i64,
    /// Without lid data, invalid samples for longer than this are a loss and no blink, ns. Default 500 ms.
    pub blink_max_ns: i64,
    /// Shortest fixation, ns. Default 60 ms.
    pub fixation_min_ns: i64,
    /// Slowest pursuit, by gaze in the world, rad/s. Default 5°/s.
    pub pursuit_min_rad_s: f32,
    /// Shortest pursuit, ns. Default 250 ms.
    pub pursuit_min_ns: i64,
    /// No speed is taken across a gap between samples longer than this, ns. Default 100 ms.
    pub gap_ns: i64,
}

impl Default for EventParams {
    fn default() -> Self {
        Self {
            saccade_onset_rad_s: 100_f32.to_radians(),
            saccade_end_rad_s: 60_f32.to_radians(),
            saccade_min_intervals: 2,
            blink_openness: 0.5,
            blink_padding_ns: 50_000_000,
            blink_max_ns: 500_000_000,
            fixation_min_ns: 60_000_000,
            pursuit_min_rad_s: 5_f32.to_radians(),
            pursuit_min_ns: 250_000_000,
            gap_ns: 100_000_000,
        }
    }
}

/// What an eye does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum EventKind {
    /// The gaze rests on a place in the world.
    Fixation,
    /// The gaze follows something that moves.
    Pursuit,
    /// The gaze jumps.
    Saccade,
    /// The lids shut.
    Blink,
    /// The tracker lost the eyes while the lids were open.
    Loss,
}

/// One finished event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GazeEvent {
    /// What happened.
    pub kind: EventKind,
    /// First moment, ns.
    pub start_ns: i64,
    /// Last moment, ns.
    pub end_ns: i64,
    /// Angle between the first and the last direction, eye in head, rad. 0 for blinks and losses.
    pub amplitude_rad: f32,
    /// Highest eye-in-head speed, rad/s. 0 for blinks and losses.
    pub peak_speed_rad_s: f32,
}

/// What the eye does at this very sample, as far as it can be known without waiting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Not seen, or the lids are shut, or were a moment ago.
    Lost,
    /// Jumping.
    Saccade,
    /// Resting or following.
    Steady,
}

/// All events of a recorded session, with the head's orientation from its frames.
pub fn detect_events(session: &Session, params: EventParams) -> Vec<GazeEvent> {
    let mut detector = EventDetector::new(params);
    let mut events = Vec::new();
    for sample in &session.gaze {
        let head = session.local_from_head_at(sample.time_ns);
        detector.push(sample, head.map(|pose| pose.orientation));
        events.extend(std::iter::from_fn(|| detector.take_finished()));
    }
    events.extend(detector.finish());
    events
}
