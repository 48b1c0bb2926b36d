//! Whether a setting keeps a frame budget on this machine. It is timed several times over, as one timing beside other work proves nothing.

use serde::Serialize;

use super::noise::TimeNoise;
use super::point::FrameTime;

/// How far beyond the budget a frame may be.
pub const TOLERANCE: f64 = 0.15;
/// How many times over the setting is timed.
pub const TIMINGS: usize = 3;

/// A budget beside the frames of a setting.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BudgetCheck {
    /// The budget, milliseconds.
    pub budget_ms: f64,
    /// Whether it holds, within [`TOLERANCE`]; `None` (`null` in JSON) where the machine's times scatter across that limit.
    pub is_met: Option<bool>,
    /// The timing of the median frame time.
    pub frame: FrameTime,
    /// How far the machine's times scatter, as a share of them.
    pub noise_share: f64,
}

impl BudgetCheck {
    /// Judges timings of one setting by the best and by the worst that their noise allows; `None` without timings.
    pub fn of(budget_ms: f64, mut timings: Vec<FrameTime>) -> Option<Self> {
        let noise = TimeNoise::of_times(&timings);
        timings.sort_unstable_by(|a, b| a.median_ms.total_cmp(&b.median_ms));
        let frame = timings.get(timings.len() / 2)?.clone();
        let limit_ms = (1.0 + TOLERANCE) * budget_ms;
        let scatter = 1.0 + noise.share;
        let is_met = match frame.median_ms {
            ms if ms * scatter <= limit_ms => Some(true),
            ms if ms / scatter > limit_ms => Some(false),
            _ => None,
        };
        Some(Self {
            budget_ms,
            is_met,
            frame,
            noise_share: noise.share,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Timings with these medians, without scatter of their own.
    fn timings(medians_ms: &[f64]) -> Vec<FrameTime> {
        let timing = |ms: &f64| FrameTime::of(&[vec![("all".into(), *ms)]]).unwrap();
        medians_ms.iter().map(timing).collect()
    }

    fn is_met(medians_ms: &[f64]) -> Option<bool> {
        BudgetCheck::of(50.0, timings(medians_ms)).unwrap().is_met
    }

    #[test]
    fn a_steady_machine_tells_whether_a_budget_holds_on_either_side_of_the_tolerance() {
        assert_eq!(is_met(&[56.0, 55.9, 56.1]), Some(true));
        assert_eq!(is_met(&[59.0, 58.9, 59.1]), Some(false));
    }

    #[test]
    fn an_unsteady_machine_can_t_tell_what_a_steady_one_can() {
        // The same medians as a steady machine's, and the same far from the limit: there no noise matters.
        assert_eq!(is_met(&[56.0, 50.0, 70.0]), None);
        assert_eq!(is_met(&[59.0, 50.0, 70.0]), None);
        assert_eq!(is_met(&[5.9, 5.0, 7.0]), Some(true));
        assert_eq!(is_met(&[590.0, 500.0, 700.0]), Some(false));
    }

    #[test]
    fn frames_that_scatter_within_each_timing_count_as_noise_too() {
        let mut timings = timings(&[56.0; 3]);
        for timing in &mut timings {
            (timing.q25_ms, timing.q75_ms) = (50.0, 70.0);
        }
        let check = BudgetCheck::of(50.0, timings).unwrap();
        assert_eq!(check.is_met, None, "{check:?}");
        assert_eq!(BudgetCheck::of(50.0, Vec::new()), None);
    }
}
