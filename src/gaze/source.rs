//! Where the wearer looks in this frame: one steady answer from samples that come late, twice, wrong or not at all.

use std::collections::VecDeque;

use serde::Serialize;

use super::events::{EventDetector, EventParams, Phase};
use super::filter::{OneEuro, OneEuroParams};
use super::{GazeRay, GazeSample};

/// How the gaze of a frame came about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum GazeState {
    /// From a live sample.
    Tracked,
    /// The last fixation, kept through a blink or a loss of tracking.
    Held,
    /// Ahead of the last sample, as the runtime predicts it.
    Predicted,
    /// Straight ahead or a chosen direction, because no eye was ever seen or gaze is not asked for.
    Fallback,
    /// From a sample of a recorded session.
    Replay,
}

impl GazeState {
    /// Every state.
    pub const ALL: [Self; 5] = [
        Self::Tracked,
        Self::Held,
        Self::Predicted,
        Self::Fallback,
        Self::Replay,
    ];
}

/// The gaze to draw a frame with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GazeReading {
    /// The gaze ray in VIEW space; always finite and ahead.
    pub ray: GazeRay,
    /// The sample behind it, raw; `None` for a fallback.
    pub sample: Option<GazeSample>,
    /// How it came about.
    pub state: GazeState,
    /// By how much the fovea is widened because the gaze is unsure, radians, 0 or more.
    pub widening_rad: f32,
}

impl GazeReading {
    /// When the eyes were seen, ns; `None` for a fallback.
    pub fn sample_time_ns(&self) -> Option<i64> {
        self.sample.map(|sample| sample.time_ns)
    }

    /// How old the sample is when the frame is shown, ns. 50 to 70 ms go unnoticed (Albert et al. 2017).
    pub fn age_ns(&self, display_time_ns: i64) -> Option<i64> {
        Some(display_time_ns.saturating_sub(self.sample_time_ns()?))
    }
}

/// What to do with samples and without.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GazeParams {
    /// Look here instead of where the tracker says (`--gaze`): azimuth to the right and elevation up, radians. Default: track.
    pub fixed_rad: Option<[f32; 2]>,
    /// How long the last fixation is held unchanged once the eyes are lost, ns. Default 0.5 s: longer than any blink.
    pub hold_ns: i64,
    /// How fast the fovea widens after that, rad/s; 0 to 3. Default 10°/s.
    pub widening_rad_s: f32,
    /// How far it widens at most, rad; 0 to 1. Default 20°.
    pub widening_max_rad: f32,
    /// A sample further than this from its frame's display time, before or after, counts as lost, ns. Default 150 ms.
    pub stale_ns: i64,
    /// Steadies fixations; `None` passes samples on as they are.
    pub filter: Option<OneEuroParams>,
    /// Tells saccades (which reset the filter) and blinks.
    pub events: EventParams,
}

impl Default for GazeParams {
    fn default() -> Self {
        Self {
            fixed_rad: None,
            hold_ns: 500_000_000,
            widening_rad_s: 10_f32.to_radians(),
            widening_max_rad: 20_f32.to_radians(),
            stale_ns: 150_000_000,
            filter: Some(OneEuroParams::default()),
            events: EventParams::default(),
        }
    }
}

/// Turns the newest sample of each frame into the gaze to draw it with. The same samples at the same times give the same
/// answers, bit for bit.
#[derive(Clone, Debug)]
pub struct GazeSource {
    params: GazeParams,
    /// What a good sample is called: [`GazeState::Tracked`] or [`GazeState::Replay`].
    seen_as: GazeState,
    detector: EventDetector,
    filter: Option<OneEuro>,
    display_time_ns: i64,
    /// Steady readings of the last [`EventParams::blink_padding_ns`], and the newest one before: a closing lid drags the
    /// gaze along, so a blink is bridged with what was seen before it began.
    recent: VecDeque<GazeReading>,
}

/// Most readings that are looked back on; more than a 1 kHz tracker gives in the padding of a blink.
const MAX_RECENT: usize = 128;

impl GazeSource {
    /// For samples of a live eye tracker.
    pub fn live(params: GazeParams) -> Self {
        Self::new(params, GazeState::Tracked)
    }

    /// For samples of a recorded session that is read without a runtime.
    pub fn replay(params: GazeParams) -> Self {
        Self::new(params, GazeState::Replay)
    }

    fn new(params: GazeParams, seen_as: GazeState) -> Self {
        Self {
            params,
            seen_as,
            detector: EventDetector::new(params.events),
            filter: params.filter.map(OneEuro::new),
            display_time_ns: i64::MIN,
            recent: VecDeque::new(),
        }
    }

    /// The gaze for the frame that is shown at `display_time_ns`, from the newest sample (`None`: the tracker is silent).
    /// A display time before the last one starts anew.
    pub fn update(&mut self, display_time_ns: i64, sample: Option<&GazeSample>) -> GazeReading {
        if display_time_ns < self.display_time_ns {
            *self = Self::new(self.params, self.seen_as);
        }
        self.display_time_ns = display_time_ns;
        if let Some([azimuth_rad, elevation_rad]) = self.params.fixed_rad {
            return fallback(GazeRay::from_angles(azimuth_rad, elevation_rad));
        }
        match sample.and_then(|sample| self.see(sample)) {
            Some(reading) => reading,
            None => self.hold(),
        }
    }

    /// A reading from a sample that can be trusted.
    fn see(&mut self, sample: &GazeSample) -> Option<GazeReading> {
        let ray = sample.combined.filter(GazeRay::is_ahead);
        let age_ns = self.display_time_ns.saturating_sub(sample.time_ns);
        if !(-self.params.stale_ns..=self.params.stale_ns).contains(&age_ns) {
            return None;
        }
        let ahead = GazeSample {
            combined: ray,
            ..*sample
        };
        let phase = self.detector.push(&ahead, None);
        // Only the phase is of interest here; finished events would pile up.
        while self.detector.take_finished().is_some() {}
        let ray = ray?;
        let mut reading = GazeReading {
            ray,
            sample: Some(*sample),
            state: self.seen_as,
            widening_rad: 0.0,
        };
        match phase {
            Phase::Lost => return None,
            Phase::Saccade => self.reset_filter(),
            Phase::Steady => {
                if let Some(filter) = &mut self.filter {
                    reading.ray = ray.with_dir(filter.filter(sample.time_ns, ray.dir()));
                }
                self.remember(reading);
            }
        }
        Some(reading)
    }

    fn remember(&mut self, reading: GazeReading) {
        let padding_ns = self.params.events.blink_padding_ns;
        let time_ns = reading.sample_time_ns();
        if self
            .recent
            .back()
            .is_some_and(|last| last.sample_time_ns() == time_ns)
        {
            self.recent.pop_back();
        }
        self.recent.push_back(reading);
        let settled = |reading: &GazeReading| {
            let age_ns = reading
                .sample_time_ns()
                .zip(time_ns)
                .map(|(then, now)| now.saturating_sub(then));
            age_ns.is_some_and(|age_ns| age_ns >= padding_ns)
        };
        // Of the readings older than the padding only the newest is kept.
        while self.recent.len() > MAX_RECENT || self.recent.get(1).is_some_and(settled) {
            self.recent.pop_front();
        }
    }

    fn hold(&mut self) -> GazeReading {
        self.reset_filter();
        let Some(settled) = self.recent.front().copied() else {
            return fallback(None);
        };
        let last_seen_ns = self.recent.back().and_then(GazeReading::sample_time_ns);
        let lost_ns = last_seen_ns.map_or(0, |then| self.display_time_ns.saturating_sub(then));
        let unsure_s = (lost_ns - self.params.hold_ns).max(0) as f32 * 1e-9;
        GazeReading {
            state: GazeState::Held,
            widening_rad: (unsure_s * self.params.widening_rad_s).min(self.params.widening_max_rad),
            ..settled
        }
    }

    fn reset_filter(&mut self) {
        if let Some(filter) = &mut self.filter {
            filter.reset();
        }
    }
}

fn fallback(ray: Option<GazeRay>) -> GazeReading {
    GazeReading {
        ray: ray.filter(GazeRay::is_ahead).unwrap_or(GazeRay::FORWARD),
        sample: None,
        state: GazeState::Fallback,
        widening_rad: 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use proptest::prelude::*;

    const FRAME_NS: i64 = 11_000_000;
    const LATENCY_NS: i64 = 20_000_000;

    fn sample(frame: i64, azimuth_deg: f32) -> GazeSample {
        let time_ns = 1_000_000_000 + frame * FRAME_NS - LATENCY_NS;
        GazeSample::combined(time_ns, GazeRay::from_angles(azimuth_deg.to_radians(), 0.0))
    }

    fn lost(frame: i64) -> GazeSample {
        GazeSample {
            combined: None,
            ..sample(frame, 0.0)
        }
    }

    fn display_ns(frame: i64) -> i64 {
        1_000_000_000 + frame * FRAME_NS
    }

    fn azimuth_deg(reading: &GazeReading) -> f32 {
        let dir = reading.ray.dir();
        dir.x.atan2(-dir.z).to_degrees()
    }

    #[test]
    fn a_blink_holds_the_fixation_before_the_lid_began_to_close() {
        let mut source = GazeSource::live(GazeParams::default());
        for frame in 0..30 {
            let reading = source.update(display_ns(frame), Some(&sample(frame, 5.0)));
            assert_eq!(reading.state, GazeState::Tracked);
            assert_eq!(reading.age_ns(display_ns(frame)), Some(LATENCY_NS));
        }
        // The closing lid drags the gaze, slowly enough to be no saccade.
        for frame in 30..33 {
            source.update(
                display_ns(frame),
                Some(&sample(frame, 5.0 - 0.5 * (frame - 29) as f32)),
            );
        }
        for frame in 33..45 {
            let reading = source.update(display_ns(frame), Some(&lost(frame)));
            assert_eq!(reading.state, GazeState::Held);
            assert!(
                (azimuth_deg(&reading) - 5.0).abs() < 0.05,
                "{}",
                azimuth_deg(&reading)
            );
            assert_eq!(reading.widening_rad, 0.0);
        }
    }

    #[test]
    fn after_the_hold_the_fovea_widens_steadily_to_its_limit() {
        let params = GazeParams::default();
        let mut source = GazeSource::live(params);
        source.update(display_ns(0), Some(&sample(0, 5.0)));
        let mut last = 0.0;
        for frame in 1..400 {
            let reading = source.update(display_ns(frame), Some(&lost(frame)));
            let lost_s = (frame * FRAME_NS + LATENCY_NS) as f32 * 1e-9;
            let expected = ((lost_s - 0.5).max(0.0) * 10.0).min(20.0);
            assert!((reading.widening_rad.to_degrees() - expected).abs() < 1e-3);
            assert!(reading.widening_rad >= last);
            last = reading.widening_rad;
        }
        assert_eq!(last, params.widening_max_rad);
        let reading = source.update(display_ns(400), Some(&sample(400, -5.0)));
        assert_eq!(
            reading.state,
            GazeState::Held,
            "just after a blink the eye is still in motion"
        );
        let reading = source.update(display_ns(410), Some(&sample(410, -5.0)));
        assert_eq!(
            (reading.state, reading.widening_rad),
            (GazeState::Tracked, 0.0)
        );
    }

    #[test]
    fn a_saccade_passes_the_filter_unchanged() {
        let mut source = GazeSource::live(GazeParams::default());
        for frame in 0..20 {
            source.update(display_ns(frame), Some(&sample(frame, 0.0)));
        }
        let landed = source.update(display_ns(20), Some(&sample(20, 10.0)));
        assert!((azimuth_deg(&landed) - 10.0).abs() < 1e-3);
    }

    #[test]
    fn gaze_behind_the_head_and_stale_samples_count_as_lost() {
        let mut source = GazeSource::live(GazeParams::default());
        source.update(display_ns(0), Some(&sample(0, 5.0)));
        let behind = GazeSample {
            combined: GazeRay::new(Vec3::ZERO, Vec3::Z),
            ..sample(1, 0.0)
        };
        assert_eq!(
            source.update(display_ns(1), Some(&behind)).state,
            GazeState::Held
        );
        let mut source = GazeSource::live(GazeParams::default());
        source.update(display_ns(0), Some(&sample(0, 5.0)));
        assert_eq!(
            source.update(display_ns(40), Some(&sample(0, 5.0))).state,
            GazeState::Held
        );
    }

    #[test]
    fn without_gaze_the_head_points_and_a_fixed_gaze_overrides() {
        let mut source = GazeSource::live(GazeParams::default());
        let reading = source.update(0, None);
        assert_eq!(
            (reading.ray, reading.state),
            (GazeRay::FORWARD, GazeState::Fallback)
        );
        assert_eq!(reading.age_ns(0), None);
        let mut source = GazeSource::live(GazeParams {
            fixed_rad: Some([0.1, 0.2]),
            ..GazeParams::default()
        });
        let reading = source.update(display_ns(0), Some(&sample(0, 20.0)));
        assert_eq!(Some(reading.ray), GazeRay::from_angles(0.1, 0.2));
        let mut source = GazeSource::live(GazeParams {
            fixed_rad: Some([f32::NAN, 0.0]),
            ..GazeParams::default()
        });
        assert_eq!(source.update(0, None).ray, GazeRay::FORWARD);
    }

    #[test]
    fn the_same_sample_twice_ages_and_stays() {
        let mut source = GazeSource::replay(GazeParams::default());
        let first = source.update(display_ns(0), Some(&sample(0, 5.0)));
        let second = source.update(display_ns(1), Some(&sample(0, 5.0)));
        assert_eq!(first, second);
        assert_eq!(second.state, GazeState::Replay);
        assert_eq!(second.age_ns(display_ns(1)), Some(LATENCY_NS + FRAME_NS));
    }

    proptest! {
        #[test]
        fn no_stream_makes_a_gaze_that_is_not_ahead(
            stream in prop::collection::vec((any::<i64>(), any::<i64>(), any::<[f32; 3]>(), any::<bool>()), 0..60),
        ) {
            let mut source = GazeSource::live(GazeParams::default());
            for (display_time_ns, time_ns, dir, silent) in stream {
                let sample = GazeSample::combined(time_ns, GazeRay::new(Vec3::ZERO, Vec3::from_array(dir)));
                let reading = source.update(display_time_ns, (!silent).then_some(&sample));
                prop_assert!(reading.ray.is_ahead() && reading.ray.dir().is_finite());
                prop_assert!(reading.widening_rad.is_finite() && reading.widening_rad >= 0.0);
            }
        }
    }
}
