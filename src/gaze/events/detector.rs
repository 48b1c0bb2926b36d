//! The state machine behind the events: one sample in, what the eye does now out.

use std::collections::VecDeque;

use glam::{Quat, Vec3};

use super::{EventKind, EventParams, GazeEvent, Phase};
use crate::fovea::eccentricity_rad;
use crate::gaze::GazeSample;
use crate::gaze::sample::unit;

/// Finds events in a stream of samples. Memory is bounded; an event is given out [`EventParams::blink_padding_ns`] after
/// its end, because a blink may still take it back.
#[derive(Clone, Debug)]
pub struct EventDetector {
    params: EventParams,
    open: Open,
    finished: VecDeque<GazeEvent>,
    now_ns: i64,
}

#[derive(Clone, Debug)]
enum Open {
    Nothing,
    Seen(Track),
    Lost(Lost),
}

/// Samples since the last saccade, blink or gap.
#[derive(Clone, Debug)]
struct Track {
    start: Sight,
    last: Sight,
    peak_speed_rad_s: f32,
    run: Option<Run>,
    window_start: Sight,
    moving_ns: i64,
}

/// Consecutive intervals that are faster than the end of a saccade.
#[derive(Clone, Copy, Debug)]
struct Run {
    start: Sight,
    intervals: u32,
    peak_speed_rad_s: f32,
    /// Peak of the slower of eye-in-head and gaze-in-world speed.
    peak_jump_rad_s: f32,
}

#[derive(Clone, Copy, Debug)]
struct Sight {
    time_ns: i64,
    dir_in_view: Vec3,
    dir_in_local: Option<Vec3>,
}

#[derive(Clone, Copy, Debug)]
struct Lost {
    first_ns: i64,
    last_ns: i64,
    lids_seen: bool,
    lids_shut: bool,
}

/// Over how long the speed of a pursuit is taken, ns: long against tracker noise, short against a change of direction.
const PURSUIT_WINDOW_NS: i64 = 100_000_000;

impl EventDetector {
    /// A detector that has seen nothing.
    pub fn new(params: EventParams) -> Self {
        Self {
            params,
            open: Open::Nothing,
            finished: VecDeque::new(),
            now_ns: i64::MIN,
        }
    }

    /// Takes the next sample and, where known, the head's orientation in LOCAL space at its time. A sample that is not newer
    /// than the last is passed over. Returns what the eye does now.
    pub fn push(&mut self, sample: &GazeSample, local_from_head: Option<Quat>) -> Phase {
        if sample.time_ns > self.now_ns {
            self.now_ns = sample.time_ns;
            let shut = sample
                .min_openness()
                .is_some_and(|openness| openness < self.params.blink_openness);
            match sample.combined {
                Some(ray) if !shut => self.see(Sight {
                    time_ns: sample.time_ns,
                    dir_in_view: ray.dir(),
                    dir_in_local: local_from_head.and_then(|rotation| unit(rotation * ray.dir())),
                }),
                _ => self.lose(sample.time_ns, sample.min_openness().is_some(), shut),
            }
        }
        self.phase()
    }

    /// The next event that nothing can change any more, in order of time.
    pub fn take_finished(&mut self) -> Option<GazeEvent> {
        let settled_ns = self.now_ns.saturating_sub(self.params.blink_padding_ns);
        match self.finished.front() {
            Some(event) if event.end_ns < settled_ns => self.finished.pop_front(),
            _ => None,
        }
    }

    /// Ends the recording: closes what is open and gives out the rest.
    pub fn finish(mut self) -> Vec<GazeEvent> {
        match std::mem::replace(&mut self.open, Open::Nothing) {
            Open::Nothing => {}
            Open::Seen(track) => self.close_track(&track, track.last),
            Open::Lost(lost) => self.close_lost(lost),
        }
        self.finished.into()
    }

    fn phase(&self) -> Phase {
        match &self.open {
            Open::Seen(track) if self.is_jump(track.run.as_ref()) => Phase::Saccade,
            Open::Seen(_) => Phase::Steady,
            _ => Phase::Lost,
        }
    }

    fn is_jump(&self, run: Option<&Run>) -> bool {
        run.is_some_and(|run| run.peak_jump_rad_s >= self.params.saccade_onset_rad_s)
    }

    fn see(&mut self, sight: Sight) {
        match std::mem::replace(&mut self.open, Open::Nothing) {
            Open::Nothing => self.open = Open::Seen(Track::new(sight)),
            Open::Lost(lost)
                if sight.time_ns.saturating_sub(lost.last_ns) <= self.params.blink_padding_ns =>
            {
                self.open = Open::Lost(lost);
            }
            Open::Lost(lost) => {
                self.close_lost(lost);
                self.open = Open::Seen(Track::new(sight));
            }
            Open::Seen(track)
                if sight.time_ns.saturating_sub(track.last.time_ns) > self.params.gap_ns =>
            {
                self.close_track(&track, track.last);
                self.open = Open::Seen(Track::new(sight));
            }
            Open::Seen(track) => self.follow(track, sight),
        }
    }

    fn follow(&mut self, mut track: Track, sight: Sight) {
        let step_s = sight.time_ns.saturating_sub(track.last.time_ns) as f32 * 1e-9;
        let speed_rad_s = eccentricity_rad(track.last.dir_in_view, sight.dir_in_view) / step_s;
        let jump_rad_s = match track.last.dir_in_local.zip(sight.dir_in_local) {
            Some((before, now)) => speed_rad_s.min(eccentricity_rad(before, now) / step_s),
            None => speed_rad_s,
        };
        if speed_rad_s >= self.params.saccade_end_rad_s {
            let run = track.run.get_or_insert(Run {
                start: track.last,
                intervals: 0,
                peak_speed_rad_s: 0.0,
                peak_jump_rad_s: 0.0,
            });
            run.intervals += 1;
            run.peak_speed_rad_s = run.peak_speed_rad_s.max(speed_rad_s);
            run.peak_jump_rad_s = run.peak_jump_rad_s.max(jump_rad_s);
        } else if let Some(run) = track.run.take()
            && self.is_jump(Some(&run))
            && run.intervals >= self.params.saccade_min_intervals
        {
            self.close_track(&track, run.start);
            self.finished.push_back(GazeEvent {
                kind: EventKind::Saccade,
                start_ns: run.start.time_ns,
                end_ns: track.last.time_ns,
                amplitude_rad: eccentricity_rad(run.start.dir_in_view, track.last.dir_in_view),
                peak_speed_rad_s: run.peak_speed_rad_s,
            });
            track = Track::new(track.last);
        }
        track.extend(sight, speed_rad_s, &self.params);
        self.open = Open::Seen(track);
    }

    fn lose(&mut self, time_ns: i64, lids_seen: bool, lids_shut: bool) {
        let mut lost = match std::mem::replace(&mut self.open, Open::Nothing) {
            Open::Lost(lost) => lost,
            open => {
                if let Open::Seen(track) = open {
                    self.close_track(&track, track.last);
                }
                self.take_back(time_ns.saturating_sub(self.params.blink_padding_ns));
                Lost {
                    first_ns: time_ns,
                    last_ns: time_ns,
                    lids_seen: false,
                    lids_shut: false,
                }
            }
        };
        lost.last_ns = time_ns;
        lost.lids_seen |= lids_seen;
        lost.lids_shut |= lids_shut;
        self.open = Open::Lost(lost);
    }

    /// Removes what lies after `time_ns`: the closing lid made it up. A fixation is cut short, a saccade goes.
    fn take_back(&mut self, time_ns: i64) {
        while let Some(event) = self.finished.back_mut() {
            if event.end_ns <= time_ns || matches!(event.kind, EventKind::Blink | EventKind::Loss) {
                return;
            }
            if event.kind != EventKind::Saccade
                && time_ns.saturating_sub(event.start_ns) >= self.params.fixation_min_ns
            {
                event.end_ns = time_ns;
                return;
            }
            self.finished.pop_back();
        }
    }

    fn close_lost(&mut self, lost: Lost) {
        let short = lost.last_ns.saturating_sub(lost.first_ns) <= self.params.blink_max_ns;
        let kind = match (lost.lids_seen, lost.lids_shut) {
            (true, true) => EventKind::Blink,
            (false, _) if short => EventKind::Blink,
            _ => EventKind::Loss,
        };
        let padding_ns = self.params.blink_padding_ns;
        self.finished.push_back(GazeEvent {
            kind,
            start_ns: lost.first_ns.saturating_sub(padding_ns),
            end_ns: lost.last_ns.saturating_add(padding_ns),
            amplitude_rad: 0.0,
            peak_speed_rad_s: 0.0,
        });
    }

    fn close_track(&mut self, track: &Track, end: Sight) {
        let duration_ns = end.time_ns.saturating_sub(track.start.time_ns);
        if duration_ns < self.params.fixation_min_ns {
            return;
        }
        let pursues =
            track.moving_ns >= self.params.pursuit_min_ns && 2 * track.moving_ns >= duration_ns;
        self.finished.push_back(GazeEvent {
            kind: if pursues {
                EventKind::Pursuit
            } else {
                EventKind::Fixation
            },
            start_ns: track.start.time_ns,
            end_ns: end.time_ns,
            amplitude_rad: eccentricity_rad(track.start.dir_in_view, end.dir_in_view),
            peak_speed_rad_s: track.peak_speed_rad_s,
        });
    }
}

impl Track {
    fn new(start: Sight) -> Self {
        Self {
            start,
            last: start,
            peak_speed_rad_s: 0.0,
            run: None,
            window_start: start,
            moving_ns: 0,
        }
    }

    fn extend(&mut self, sight: Sight, speed_rad_s: f32, params: &EventParams) {
        self.last = sight;
        if self.run.is_some() {
            return;
        }
        self.peak_speed_rad_s = self.peak_speed_rad_s.max(speed_rad_s);
        let window_ns = sight.time_ns.saturating_sub(self.window_start.time_ns);
        if window_ns < PURSUIT_WINDOW_NS {
            return;
        }
        if let Some((from, to)) = self.window_start.dir_in_local.zip(sight.dir_in_local)
            && eccentricity_rad(from, to) >= params.pursuit_min_rad_s * window_ns as f32 * 1e-9
        {
            self.moving_ns += window_ns;
        }
        self.window_start = sight;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gaze::GazeRay;

    const STEP_NS: i64 = 5_000_000;

    fn sample(index: i64, azimuth_deg: f32) -> GazeSample {
        let ray = GazeRay::from_angles(azimuth_deg.to_radians(), 0.0);
        GazeSample::combined(1 + index * STEP_NS, ray)
    }

    fn kinds(samples: impl IntoIterator<Item = (GazeSample, Option<Quat>)>) -> Vec<EventKind> {
        let mut detector = EventDetector::new(EventParams::default());
        for (sample, head) in samples {
            detector.push(&sample, head);
        }
        detector.finish().iter().map(|event| event.kind).collect()
    }

    fn unknown_head(azimuth_deg: impl Fn(i64) -> f32, count: i64) -> Vec<EventKind> {
        kinds((0..count).map(|index| (sample(index, azimuth_deg(index)), None)))
    }

    #[test]
    fn a_jump_parts_two_fixations() {
        use EventKind::{Fixation, Saccade};
        let jump = |index: i64| ((index - 40).clamp(0, 5) * 2) as f32;
        assert_eq!(unknown_head(jump, 100), [Fixation, Saccade, Fixation]);
    }

    #[test]
    fn a_spike_of_one_interval_and_a_slow_drift_are_no_saccades() {
        let step = |index: i64| if index < 40 { 0.0 } else { 2.0 };
        assert_eq!(unknown_head(step, 100), [EventKind::Fixation]);
        let drift = |index: i64| index as f32 * 0.2;
        assert_eq!(unknown_head(drift, 100), [EventKind::Fixation]);
    }

    #[test]
    fn the_reflex_to_a_fast_head_turn_is_no_saccade() {
        // The head turns left at 150 degrees per second, the eye right, and the gaze stays.
        let turning = |index: i64| {
            let head_deg = 0.75 * (index - 40).clamp(0, 30) as f32;
            (
                sample(index, head_deg),
                Quat::from_rotation_y(head_deg.to_radians()),
            )
        };
        let with_head = (0..100)
            .map(turning)
            .map(|(sample, head)| (sample, Some(head)));
        assert_eq!(kinds(with_head), [EventKind::Fixation]);
        let without = (0..100).map(turning).map(|(sample, _)| (sample, None));
        assert!(
            kinds(without).contains(&EventKind::Saccade),
            "it looks like one where the head is unknown"
        );
    }

    #[test]
    fn following_a_thing_is_a_pursuit_only_if_the_gaze_moves_in_the_world() {
        let following =
            (0..200).map(|index| (sample(index, index as f32 * 0.06), Some(Quat::IDENTITY)));
        assert_eq!(kinds(following), [EventKind::Pursuit]);
        let compensated = (0..200).map(|index| {
            let deg = index as f32 * 0.06;
            (
                sample(index, deg),
                Some(Quat::from_rotation_y(deg.to_radians())),
            )
        });
        assert_eq!(kinds(compensated), [EventKind::Fixation]);
    }

    #[test]
    fn lids_tell_a_blink_from_a_loss() {
        let gap = |openness: Option<f32>, length: i64| {
            kinds((0..300).map(move |index| {
                let mut sample = sample(index, 0.0);
                if (100..100 + length).contains(&index) {
                    sample.combined = None;
                    sample.eyes[0].openness = openness;
                }
                (sample, None)
            }))[1]
        };
        assert_eq!(gap(Some(0.0), 40), EventKind::Blink);
        assert_eq!(gap(Some(1.0), 40), EventKind::Loss);
        assert_eq!(gap(None, 40), EventKind::Blink, "short, and no lids known");
        assert_eq!(gap(None, 120), EventKind::Loss, "too long for a blink");
    }

    #[test]
    fn a_blink_is_widened_and_takes_the_jump_of_the_closing_lid_with_it() {
        let samples = (0..300).map(|index| {
            let mut sample = sample(index, 0.0);
            let dip = (index - 96).clamp(0, 4) as f32 * -2.0;
            sample.combined = GazeRay::from_angles(0.0, dip.to_radians());
            if (100..140).contains(&index) {
                sample.combined = None;
            } else if index >= 140 {
                sample.combined = GazeRay::from_angles(0.0, 0.0);
            }
            sample
        });
        let mut detector = EventDetector::new(EventParams::default());
        for sample in samples {
            detector.push(&sample, None);
        }
        let events = detector.finish();
        let kinds: Vec<_> = events.iter().map(|event| event.kind).collect();
        assert_eq!(
            kinds,
            [EventKind::Fixation, EventKind::Blink, EventKind::Fixation]
        );
        assert_eq!(events[1].start_ns, 1 + 100 * STEP_NS - 50_000_000);
        assert_eq!(events[1].end_ns, 1 + 139 * STEP_NS + 50_000_000);
        assert!(events[0].end_ns <= events[1].start_ns && events[2].start_ns >= events[1].end_ns);
    }

    #[test]
    fn time_running_backwards_is_passed_over() {
        let mut detector = EventDetector::new(EventParams::default());
        for time_ns in [i64::MAX, i64::MIN, 0, 7, 7] {
            detector.push(&GazeSample::combined(time_ns, Some(GazeRay::FORWARD)), None);
        }
        assert!(detector.finish().is_empty());
    }
}
