//! What differences are told from chance: times scatter and machines drift, errors are means over a handful of frames.

use super::campaign::Drift;
use super::point::{FrameTime, Point};

/// Standard errors from which two errors count as different: chance alone brings them about in one case of twenty.
const STANDARD_ERRORS: f64 = 2.0;

/// How far times scatter, as far as a run can tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeNoise {
    /// Times whose ratio, less one, is smaller than this count as equal.
    pub share: f64,
}

impl TimeNoise {
    /// The machine's drift, or the scatter of the median point's frames, whichever is larger.
    pub fn of(points: &[Point], drift: &Drift) -> Self {
        Self::of_spreads(points.iter().map(|point| point.time.spread()), drift)
    }

    /// The same of one setting that was timed again and again.
    pub fn of_times(times: &[FrameTime]) -> Self {
        let drift = Drift {
            anchor_ms: times.iter().map(|time| time.median_ms).collect(),
        };
        Self::of_spreads(times.iter().map(FrameTime::spread), &drift)
    }

    fn of_spreads(spreads: impl Iterator<Item = f64>, drift: &Drift) -> Self {
        let mut spreads: Vec<f64> = spreads.collect();
        spreads.sort_unstable_by(f64::total_cmp);
        let spread = spreads.get(spreads.len() / 2).copied().unwrap_or(0.0);
        Self {
            share: drift.range().unwrap_or(0.0).max(spread),
        }
    }

    /// Whether a ratio of times is more than scatter.
    pub fn is_beyond(self, ratio: f64) -> bool {
        ratio.max(1.0 / ratio) > 1.0 + self.share
    }
}

/// Two standard errors of a point's foveal error, as a share of it.
pub fn error_scatter(point: &Point) -> f64 {
    let fovea = point.error.fovea.unwrap_or_default();
    STANDARD_ERRORS * fovea.relmse_standard_error / point.relmse()
}

/// Whether the foveal errors of two points differ by more than chance.
pub fn errors_differ(a: &Point, b: &Point) -> bool {
    let [a, b] = [a, b].map(|point| (point.relmse(), error_scatter(point) * point.relmse()));
    (a.0 - b.0).abs() > a.1.hypot(b.1)
}

#[cfg(test)]
mod tests {
    use super::super::point::tests::point;
    use super::*;

    #[test]
    fn times_within_the_drift_or_the_scatter_are_equal() {
        let steady = point("pm", 10.0, 0.1, 0.0);
        let mut scattered = steady.clone();
        (scattered.time.q25_ms, scattered.time.q75_ms) = (9.0, 12.0);
        let drift = |anchor_ms: &[f64]| Drift {
            anchor_ms: anchor_ms.to_vec(),
        };
        let noise = TimeNoise::of(&[scattered], &drift(&[10.0, 11.0]));
        assert!((noise.share - 0.3).abs() < 1e-12, "{noise:?}");
        assert!(!noise.is_beyond(1.29) && !noise.is_beyond(1.0 / 1.29) && noise.is_beyond(1.31));
        let noise = TimeNoise::of(&[steady], &drift(&[10.0, 15.0]));
        assert!((noise.share - 0.5).abs() < 1e-12, "{noise:?}");
    }

    #[test]
    fn errors_differ_by_two_standard_errors() {
        let with = |relmse: f64| {
            let mut point = point("pm", 10.0, relmse, 0.0);
            let fovea = point.error.fovea.as_mut().unwrap();
            fovea.relmse_standard_error = 0.001;
            point
        };
        assert!(!errors_differ(&with(0.1), &with(0.1025)));
        assert!(errors_differ(&with(0.1), &with(0.103)));
    }
}
