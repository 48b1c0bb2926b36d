//! Techniques at one level: the time that each needs for an error, the error that each reaches in a time.

use serde::Serialize;

use super::CostError;
use super::fit;
use super::point::Point;
use super::setting::Setting;

/// How near to the level a point must come.
const TOLERANCE: f64 = 0.05;
/// Settings that are tried for one technique and level.
const MAX_TRIALS: usize = 6;
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
    /// Key of its best point there; `None` where it does not reach the level.
    pub point: Option<String>,
    /// That point in words.
    pub label: String,
    /// Time of its frame, milliseconds; where the level is not reached, of the nearest point.
    pub frame_ms: f64,
    /// Its relative mean squared error in the fovea, likewise.
    pub relmse: f64,
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

    fn is_near(self, point: &Point) -> bool {
        (self.value(point) / self.level()).ln().abs() < TOLERANCE
    }

    fn is_met(self, point: &Point) -> bool {
        self.value(point) <= self.level() * (1.0 + TOLERANCE)
    }

    /// What is wanted small once the goal is met.
    fn rest(self, point: &Point) -> f64 {
        match self {
            Self::Relmse(_) => point.frame_ms(),
            Self::FrameMs(_) => point.relmse(),
        }
    }

    /// Whether more paths bring a point nearer that lies above the level.
    fn falls_with_effort(self) -> bool {
        matches!(self, Self::Relmse(_))
    }
}

/// Measures until a technique is at the level: paths are added or taken away, and passes where more paths do not help. `points` are known
/// already; the start is the one of them nearest to the level. `false` if it was interrupted.
///
/// # Errors
/// Those of `measure`.
pub fn approach(
    technique: &str,
    points: &[Point],
    goal: Goal,
    measure: &mut Measure<'_>,
) -> Result<bool, CostError> {
    let known = points.iter().filter(|point| point.technique == technique);
    let front = fit::front(known);
    let distance = |point: &Point| (goal.value(point) / goal.level()).ln().abs();
    let nearest = front
        .into_iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)));
    let Some(nearest) = nearest else {
        return Ok(true);
    };
    let mut setting = Setting::of(nearest)?;
    let mut here = nearest.clone();
    let mut by_passes = false;
    for _ in 0..MAX_TRIALS {
        if goal.is_near(&here) {
            break;
        }
        let Some(next) = next_setting(&setting, &here, goal, by_passes) else {
            break;
        };
        let Some(point) = measure(&next)? else {
            return Ok(false);
        };
        let gained = (goal.value(&point) / goal.value(&here)).ln().abs();
        if gained < TOLERANCE && !goal.falls_with_effort() {
            // What is left of the time is not spent on paths.
            break;
        }
        // More paths no longer change the error: what is left is blur, and only passes, with smaller radii, take it away.
        by_passes |= !goal.is_met(&point) && gained < TOLERANCE;
        (setting, here) = (next, point);
    }
    Ok(true)
}

/// A step towards the goal, of a factor of four at most.
fn next_setting(setting: &Setting, here: &Point, goal: Goal, by_passes: bool) -> Option<Setting> {
    let wanted = match goal.falls_with_effort() {
        true => goal.value(here) / goal.level(),
        false => goal.level() / goal.value(here),
    };
    let mut next = setting.clone();
    if by_passes {
        next.passes = setting.passes.checked_mul(2)?;
        return (next.passes <= MAX_PASSES).then_some(next);
    }
    let factor = wanted.clamp(0.25, 4.0);
    let effort = (f64::from(setting.effort()) * factor).round().max(1.0);
    next.set(setting.effort_key(), &effort.to_string()).ok()?;
    (next != *setting).then_some(next)
}

/// Every technique at the level, by what was measured: of the points that meet it, the one with the least time or error.
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
            Some(Level {
                technique: technique.into(),
                point: met.map(|point| point.key.clone()),
                label: point.label(),
                frame_ms: point.frame_ms(),
                relmse: point.relmse(),
                ratio: met.map(|point| goal.rest(point)),
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
            let made = point(
                technique,
                1.0 + work / speed,
                100.0 / work + floor / passes,
                0.5,
            );
            Point {
                key: format!("{technique} {} {}", setting.effort(), setting.passes),
                effort: setting.effort(),
                passes: setting.passes,
                changed: setting.changed(),
                ..made
            }
        }
    }

    fn approached(machine: impl Fn(&Setting) -> Point, goal: Goal) -> Vec<Point> {
        let mut start = super::super::setting::tests::setting();
        start.set("technique", "pm").unwrap();
        start.set("photons", "1000").unwrap();
        let mut points = vec![machine(&start)];
        let known = points.clone();
        let mut measure = |setting: &Setting| {
            points.push(machine(setting));
            Ok(points.last().cloned())
        };
        assert!(approach("pm", &known, goal, &mut measure).unwrap());
        points
    }

    #[test]
    fn a_technique_is_brought_to_an_error_and_to_a_time() {
        for (goal, ms) in [(Goal::Relmse(0.005), 21.0), (Goal::FrameMs(80.0), 80.0)] {
            let points = approached(machine("pm", 1000.0, 0.0), goal);
            let [level] = &levels(&points, goal)[..] else {
                panic!("one technique")
            };
            assert!(level.point.is_some());
            assert!((level.frame_ms / ms).ln().abs() < 0.2, "{level:?}");
        }
    }

    #[test]
    fn where_blur_is_left_passes_are_added_and_a_level_out_of_reach_is_told() {
        let reached = approached(machine("pm", 1000.0, 0.02), Goal::Relmse(0.01));
        assert!(reached.last().unwrap().passes > 1);
        let goal = Goal::Relmse(1e-9);
        let levels = levels(&approached(machine("pm", 1000.0, 0.02), goal), goal);
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
                .map(|level| level.ratio)
                .collect::<Vec<_>>()
        };
        assert_eq!(ratio(Goal::Relmse(0.01)), [Some(4.0), Some(1.0)]);
        assert_eq!(ratio(Goal::FrameMs(20.0)), [None, Some(1.0)]);
    }
}
