//! The 1-euro filter: steady while the eye rests, quick while it moves.
//!
//! Casiez, Roussel and Vogel, "1€ Filter: A Simple Speed-based Low-pass Filter for Noisy Input in Interactive Systems", CHI
//! 2012: a first-order low-pass filter whose cut-off frequency rises with the speed of the signal. Here the signal is a unit
//! direction and its speed is angular.

use std::f32::consts::TAU;

use glam::Vec3;

/// How much a fixation is steadied.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OneEuroParams {
    /// Cut-off frequency at rest, Hz; 0.1 to 100, less is steadier. Default 3: tracker noise of 0.1° in 90 Hz frames falls to a third.
    pub min_cutoff_hz: f32,
    /// How fast the cut-off rises with angular speed, Hz per rad/s; 0 to 1000, more follows pursuit more closely. Default
    /// 20: a pursuit at 15°/s lags by 0.3°.
    pub cutoff_per_speed_hz: f32,
    /// Cut-off frequency of the speed itself, Hz; 0.1 to 100. Default 1, as in the paper.
    pub speed_cutoff_hz: f32,
}

impl Default for OneEuroParams {
    fn default() -> Self {
        Self {
            min_cutoff_hz: 3.0,
            cutoff_per_speed_hz: 20.0,
            speed_cutoff_hz: 1.0,
        }
    }
}

/// The filter and what it remembers.
#[derive(Clone, Debug)]
pub struct OneEuro {
    params: OneEuroParams,
    last: Option<Last>,
}

#[derive(Clone, Copy, Debug)]
struct Last {
    time_ns: i64,
    raw: Vec3,
    filtered: Vec3,
    velocity_per_s: Vec3,
}

impl OneEuro {
    /// A filter that has seen nothing.
    pub fn new(params: OneEuroParams) -> Self {
        Self { params, last: None }
    }

    /// Forgets the past: the next direction passes unchanged. For saccades and gaps.
    pub fn reset(&mut self) {
        self.last = None;
    }

    /// The steadied direction for the unit vector `dir` at `time_ns`. The first one, and one that is older than the last,
    /// start the filter anew; the same time again gives the same answer again.
    pub fn filter(&mut self, time_ns: i64, dir: Vec3) -> Vec3 {
        let (filtered, velocity_per_s) = match self.last {
            Some(last) if time_ns == last.time_ns => return last.filtered,
            Some(last) if time_ns > last.time_ns => self.step(last, time_ns, dir),
            _ => (dir, Vec3::ZERO),
        };
        self.last = Some(Last {
            time_ns,
            raw: dir,
            filtered,
            velocity_per_s,
        });
        filtered
    }

    fn step(&self, last: Last, time_ns: i64, dir: Vec3) -> (Vec3, Vec3) {
        let step_s = time_ns.saturating_sub(last.time_ns) as f32 * 1e-9;
        let raw_velocity = (dir - last.raw) / step_s;
        let velocity_per_s = last
            .velocity_per_s
            .lerp(raw_velocity, gain(self.params.speed_cutoff_hz, step_s));
        let cutoff_hz =
            self.params.min_cutoff_hz + self.params.cutoff_per_speed_hz * velocity_per_s.length();
        let mixed = last.filtered.lerp(dir, gain(cutoff_hz, step_s));
        // Opposite directions can cancel out.
        (mixed.try_normalize().unwrap_or(dir), velocity_per_s)
    }
}

/// The share of the new value in a first-order low-pass filter (Casiez et al., Eq. 3 and 4).
fn gain(cutoff_hz: f32, step_s: f32) -> f32 {
    let rate = TAU * cutoff_hz * step_s;
    rate / (rate + 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gaze::GazeRay;
    use crate::gaze::synthetic::Noise;
    use proptest::prelude::*;

    const FRAME_NS: i64 = 11_111_111;

    fn direction(azimuth_rad: f32) -> Vec3 {
        GazeRay::from_angles(azimuth_rad, 0.0).unwrap().dir()
    }

    fn azimuth_rad(dir: Vec3) -> f32 {
        dir.x.atan2(-dir.z)
    }

    #[test]
    fn noise_during_a_fixation_falls_to_less_than_half() {
        let mut filter = OneEuro::new(OneEuroParams::default());
        let mut noise = Noise::new(7);
        let (mut raw, mut steady) = (0.0, 0.0);
        for frame in 0..900 {
            let azimuth = 0.1_f32.to_radians() * noise.gaussian() as f32;
            raw += azimuth.powi(2);
            steady += azimuth_rad(filter.filter(frame * FRAME_NS, direction(azimuth))).powi(2);
        }
        assert!(
            steady.sqrt() < 0.5 * raw.sqrt(),
            "{} of {}",
            steady.sqrt(),
            raw.sqrt()
        );
    }

    #[test]
    fn a_pursuit_lags_by_less_than_half_a_degree() {
        let mut filter = OneEuro::new(OneEuroParams::default());
        let mut slow = OneEuro::new(OneEuroParams {
            cutoff_per_speed_hz: 0.0,
            ..OneEuroParams::default()
        });
        let (mut lag, mut slow_lag) = (0.0, 0.0);
        for frame in 0..90 {
            let azimuth = 15_f32.to_radians() * frame as f32 / 90.0;
            let time_ns = frame * FRAME_NS;
            lag = azimuth - azimuth_rad(filter.filter(time_ns, direction(azimuth)));
            slow_lag = azimuth - azimuth_rad(slow.filter(time_ns, direction(azimuth)));
        }
        assert!(lag.to_degrees() < 0.5, "{}", lag.to_degrees());
        assert!(
            slow_lag.to_degrees() > 0.5,
            "without the speed term it must lag: {}",
            slow_lag.to_degrees()
        );
    }

    #[test]
    fn time_standing_still_or_running_backwards_gives_a_direction() {
        let mut filter = OneEuro::new(OneEuroParams::default());
        let first = filter.filter(5, direction(0.1));
        assert_eq!(filter.filter(5, direction(0.5)), first);
        assert_eq!(filter.filter(4, direction(0.5)), direction(0.5));
        // All the time there is, in one step.
        filter.filter(i64::MIN, direction(0.1));
        assert!(filter.filter(i64::MAX, direction(0.5)).is_normalized());
    }

    proptest! {
        #[test]
        fn every_answer_is_a_unit_vector(steps in prop::collection::vec((0_i64..1_000_000_000, -3.1_f32..3.1, -1.5_f32..1.5), 1..40)) {
            let mut filter = OneEuro::new(OneEuroParams::default());
            for (time_ns, azimuth, elevation) in steps {
                let dir = GazeRay::from_angles(azimuth, elevation).unwrap().dir();
                prop_assert!((filter.filter(time_ns, dir).length() - 1.0).abs() < 1e-4);
            }
        }
    }
}
