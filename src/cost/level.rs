//! Techniques at one level: the time that each needs for an error, the error that each reaches in a time. An error is approached here; a
//! time is a budget, for which [`super::search`] looks.

use serde::Serialize;

use super::CostError;
use super::fit;
use super::noise::error_scatter;
use super::point::Point;
use super::setting::Setting;

/// How near to the level a point must come.
const TOLERANCE: f64 = 0.05;
/// Settings that are tried for one technique and level.
const MAX_TRIALS: usize = 8;
/// Passes beyond which no frame is tried.
const MAX_PASSES: u32 = 64;

/// What the techniques are brought to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Goal {
    /// This relative mean squared error in the fovea.
    Relmse(f64),
    /// This time of a frame, milliseconds.
    FrameMs(f64),
}

/// One technique at a level.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Level {
    /// Name of the technique.
    pub technique: String,
    /// Key of its best point there or better; `None` where it does not reach the level.
    pub point: Option<String>,
    /// That point in words.
    pub label: String,
    /// Time of a frame at the level, milliseconds: straight between the technique's points on logarithmic axes, or that of the point where
    /// the level lies beyond them all.
    pub frame_ms: f64,
    /// Relative mean squared error in the fovea, likewise.
    pub relmse: f64,
    /// Two standard errors of the error, as a share of it.
    pub scatter: f64,
    /// How many times worse than the best technique: times longer, or times the error. `None` where the level is not reached.
    pub ratio: Option<f64>,
}

/// Measures a setting; `None` if it was interrupted.
pub type Measure<'m> = dyn FnMut(&Setting) -> Result<Option<Point>, CostError> + 'm;

impl Goal {
    /// What a point has of what the goal asks for.
    fn value(self, point: &Point) -> f64 {
        match self {
            Self::Relmse(_) => point.relmse(),
            Self::FrameMs(_) => point.frame_ms(),
        }
    }

    fn level(self) -> f64 {
        match self {
            Self::Relmse(level) | Self::FrameMs(level) => level,
        }
    }

    fn is_met(self, point: &Point) -> bool {
        self.value(point) <= self.level() * (1.0 + TOLERANCE)
    }

    /// Milliseconds and error where a front crosses the level; `None` beyond its ends.
    fn between(self, front: &[&Point]) -> Option<(f64, f64)> {
        match self {
            Self::Relmse(error) => fit::time_at(front, error).map(|ms| (ms, error)),
            Self::FrameMs(ms) => fit::error_at(front, ms).map(|error| (ms, error)),
        }
    }

    /// What is wanted small once the goal is met.
    fn rest(self, point: &Point) -> f64 {
        match self {
            Self::Relmse(_) => point.frame_ms(),
            Self::FrameMs(_) => point.relmse(),
        }
    }
}

/// The bias share from which passes are added in place of paths: each has a smaller radius, and blur is what is left.
const MOSTLY_BIAS: f64 = 0.5;

/// Measures until a technique is near an error: paths are added or taken away, and passes where most of the error is bias. `points` are known
/// already; the start is the one of them nearest to the error. `false` if it was interrupted.
///
/// # Errors
/// Those of `measure`.
pub fn approach(
    technique: &str,
    points: &[Point],
    relmse: f64,
    measure: &mut Measure<'_>,
) -> Result<bool, CostError> {
    let known = points.iter().filter(|point| point.technique == technique);
    let front = fit::front(known);
    let distance = |point: &Point| (point.relmse() / relmse).ln().abs();
    let nearest = front
        .into_iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)));
    let Some(nearest) = nearest else {
        return Ok(true);
    };
    let mut setting = Setting::of(nearest)?;
    let mut here = nearest.clone();
    for _ in 0..MAX_TRIALS {
        if distance(&here) < TOLERANCE {
            break;
        }
        let bias_share = here.error.fovea.map_or(0.0, |fovea| fovea.bias_share());
        let Some(next) = next_setting(&setting, here.relmse() / relmse, bias_share) else {
            break;
        };
        let Some(point) = measure(&next)? else {
            return Ok(false);
        };
        (setting, here) = (next, point);
    }
    Ok(true)
}

/// A step towards an error that is smaller by `factor`, by a factor of four at most.
fn next_setting(setting: &Setting, factor: f64, bias_share: f64) -> Option<Setting> {
    let mut next = setting.clone();
    if factor > 1.0 && bias_share >= MOSTLY_BIAS {
        next.passes = setting.passes.checked_mul(2)?;
        return (next.passes <= MAX_PASSES).then_some(next);
    }
    let effort = f64::from(setting.effort()) * factor.clamp(0.25, 4.0);
    let effort = effort.round().max(1.0);
    next.set(setting.effort_key(), &effort.to_string()).ok()?;
    (next != *setting).then_some(next)
}

/// Every technique at the level, by its front: exactly there, between two points that were measured, where it lies between two.
pub fn levels(points: &[Point], goal: Goal) -> Vec<Level> {
    let mut levels: Vec<Level> = fit::techniques(points)
        .into_iter()
        .filter_map(|technique| {
            let own = || points.iter().filter(|point| point.technique == technique);
            let met = own()
                .filter(|point| goal.is_met(point))
                .min_by(|a, b| goal.rest(a).total_cmp(&goal.rest(b)));
            let nearest = || own().min_by(|a, b| goal.value(a).total_cmp(&goal.value(b)));
            let point = met.or_else(nearest)?;
            let (frame_ms, relmse) = goal
                .between(&fit::front(own()))
                .unwrap_or((point.frame_ms(), point.relmse()));
            Some(Level {
                technique: technique.into(),
                point: met.map(|point| point.key.clone()),
                label: point.label(),
                frame_ms,
                relmse,
                scatter: error_scatter(point),
                ratio: met.map(|_| match goal {
                    Goal::Relmse(_) => frame_ms,
                    Goal::FrameMs(_) => relmse,
                }),
            })
        })
        .collect();
    let least = levels.iter().filter_map(|level| level.ratio);
    let least = least.fold(f64::INFINITY, f64::min);
    for level in &mut levels {
        level.ratio = level.ratio.map(|rest| rest / least);
    }
    levels
}

#[cfg(test)]
mod tests {
    use super::super::point::tests::point;
    use super::*;

    /// A technique whose error is noise over a floor that only passes lower.
    fn machine(technique: &str, speed: f64, floor: f64) -> impl Fn(&Setting) -> Point {
        move |setting: &Setting| {
            let passes = f64::from(setting.passes);
            let work = f64::from(setting.effort()) * passes;
            let (noise, blur) = (100.0 / work, floor / passes);
            let bias_share = blur / (noise + blur);
            let made = point(technique, 1.0 + work / speed, noise + blur, bias_share);
            Point {
                key: format!("{technique} {} {}", setting.effort(), setting.passes),
                effort: setting.effort(),
                passes: setting.passes,
                changed: setting.changed(),
                ..made
            }
        }
    }

    fn approached(machine: impl Fn(&Setting) -> Point, relmse: f64) -> Vec<Point> {
        let mut start = super::super::setting::tests::setting();
        start.set("technique", "pm").unwrap();
        start.set("photons", "1000").unwrap();
        let mut points = vec![machine(&start)];
        let known = points.clone();
        let mut measure = |setting: &Setting| {
            points.push(machine(setting));
            Ok(points.last().cloned())
        };
        assert!(approach("pm", &known, relmse, &mut measure).unwrap());
        points
    }

    #[test]
    fn a_technique_is_brought_to_an_error() {
        let points = approached(machine("pm", 1000.0, 0.0), 0.005);
        let [level] = &levels(&points, Goal::Relmse(0.005))[..] else {
            panic!("one technique")
        };
        assert!(level.point.is_some());
        assert!((level.frame_ms / 21.0).ln().abs() < 0.1, "{level:?}");
    }

    #[test]
    fn where_blur_is_left_passes_are_added_and_a_level_out_of_reach_is_told() {
        let reached = approached(machine("pm", 1000.0, 0.02), 0.01);
        assert!(reached.last().unwrap().passes > 1);
        // 4 passes of 8000 photons would take 33 ms.
        let level = &levels(&reached, Goal::Relmse(0.01))[0];
        assert!(level.point.is_some() && level.frame_ms < 66.0, "{level:?}");
        let out_of_reach = approached(machine("pm", 1000.0, 0.02), 1e-9);
        let levels = levels(&out_of_reach, Goal::Relmse(1e-9));
        assert_eq!((levels[0].point.as_ref(), levels[0].ratio), (None, None));
    }

    #[test]
    fn ratios_are_beside_the_best_technique() {
        let points = [
            point("pm", 40.0, 0.01, 0.5),
            point("path", 10.0, 0.01, 0.0),
            point("path", 5.0, 0.1, 0.0),
        ];
        let ratio = |goal| {
            levels(&points, goal)
                .iter()
                .map(|level| level.ratio.map(|ratio| (1e9 * ratio).round() / 1e9))
                .collect::<Vec<_>>()
        };
        assert_eq!(ratio(Goal::Relmse(0.01)), [Some(4.0), Some(1.0)]);
        assert_eq!(ratio(Goal::FrameMs(20.0)), [None, Some(1.0)]);
    }

    #[test]
    fn a_technique_is_told_at_the_level_and_not_where_it_happened_to_be_measured() {
        let points = [point("pm", 10.0, 0.1, 0.5), point("pm", 1000.0, 0.001, 0.5)];
        let at = |goal| levels(&points, goal).remove(0);
        let level = at(Goal::Relmse(0.01));
        assert!((level.frame_ms - 100.0).abs() < 1e-9 && level.relmse == 0.01);
        assert_eq!(level.point.as_deref(), Some("pm 1000 0.001"));
        let level = at(Goal::FrameMs(100.0));
        assert!((level.relmse - 0.01).abs() < 1e-12 && level.frame_ms == 100.0);
        assert_eq!(level.point.as_deref(), Some("pm 10 0.1"));
    }
}
