//! The best setting of a frame budget.
//!
//! A start that is too slow is first scaled down, all knobs together or all but the size: a picture half as wide gives back what it saves in
//! paths, and which of the two is worth more no step of one knob tells. From the better of both each knob is tried one step up and one step down its
//! ladder. Times and errors multiply nearly independently, so these trials are a model of all combinations of steps: the best one by the
//! model that meets the budget is measured, and the search goes on from there until nothing gets better. Last the setting is measured
//! afresh, and paths are added or taken until it fills the budget.

use std::cmp::Ordering;

use super::CostError;
use super::ladder::{Ladder, scaled_down};
use super::setting::{SIZE, Setting};

/// The least share of the budget that a chosen setting should use, if its knobs allow it.
pub const FILL_MIN: f64 = 0.85;
/// The share of the budget that is aimed at: times scatter.
pub const FILL_AIM: f64 = 0.93;
/// An error that is not smaller by this factor is not better: errors scatter too.
const BETTER: f64 = 0.98;
/// How far a start that is too slow is scaled down, one after the other until it meets the budget.
const SCALES: [f64; 5] = [0.8, 0.6, 0.4, 0.2, 0.0];
/// A cheaper setting is taken in place of one that fills the budget only if its error is smaller by this factor.
const NOT_WORSE: f64 = 0.9;
/// Rounds of the search, each from a better setting.
const MAX_ROUNDS: usize = 6;
/// Fresh measurements at the end.
const MAX_CONFIRMATIONS: usize = 8;
/// How far a setting is scaled down that turns out too slow whatever its paths.
const CONFIRMATION_SCALE: f64 = 0.85;

/// A setting that was tried.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// What was tried.
    pub setting: Setting,
    /// Median time of a frame, milliseconds.
    pub ms: f64,
    /// The error to make small.
    pub error: f64,
}

/// Tries a setting; `None` if it was interrupted.
pub type Try<'t> = dyn FnMut(&Setting) -> Result<Option<Trial>, CostError> + 't;

/// Whether a trial is the better one within a budget: the smaller error of those that meet it, else the faster.
pub fn is_better(candidate: &Trial, than: &Trial, limit_ms: f64) -> bool {
    match (candidate.ms <= limit_ms, than.ms <= limit_ms) {
        (true, true) => candidate.error < BETTER * than.error,
        (true, false) => true,
        (false, true) => false,
        (false, false) => candidate.ms < BETTER * than.ms,
    }
}

/// Orders trials within a budget: those that meet it by error, then the others by time.
pub fn compare(a: &Trial, b: &Trial, budget_ms: f64) -> Ordering {
    let rank = |trial: &Trial| match trial.ms <= budget_ms {
        true => (0_u8, trial.error),
        false => (1, trial.ms),
    };
    let ((a_class, a), (b_class, b)) = (rank(a), rank(b));
    a_class.cmp(&b_class).then(a.total_cmp(&b))
}

/// The error that a trial would have at the budget if error falls with time as noise does: what a technique promises.
pub fn promise(trial: &Trial, budget_ms: f64) -> f64 {
    trial.error * (trial.ms / budget_ms).max(1.0)
}

/// The best of some trials within a budget.
pub fn best(trials: impl IntoIterator<Item = Trial>, budget_ms: f64) -> Option<Trial> {
    let trials = trials.into_iter();
    trials.min_by(|a, b| compare(a, b, budget_ms))
}

/// The best of all that is known that seems to beat the chosen one with time to spare: a choice that was confirmed on a busy machine may
/// have lost paths for nothing.
pub fn challenger(
    chosen: &Trial,
    known: impl IntoIterator<Item = Trial>,
    budget_ms: f64,
) -> Option<Trial> {
    let limit_ms = FILL_AIM * budget_ms;
    let beats = |trial: &Trial| trial.ms <= limit_ms && is_better(trial, chosen, budget_ms);
    best(known.into_iter().filter(beats), limit_ms)
}

/// Goes from `start` to settings of less error within the budget until none is found or `is_over`. `None` if it was interrupted.
///
/// # Errors
/// Those of `try_it`.
pub fn descend(
    start: Trial,
    ladders: &[Ladder],
    budget_ms: f64,
    try_it: &mut Try<'_>,
    is_over: &dyn Fn() -> bool,
) -> Result<Option<Trial>, CostError> {
    let limit_ms = FILL_AIM * budget_ms;
    let Some(mut current) = bring_down(&start, ladders, limit_ms, try_it, is_over)? else {
        return Ok(None);
    };
    let but_the_size = ladders.iter().filter(|ladder| ladder.key() != SIZE);
    let but_the_size: Vec<Ladder> = but_the_size.cloned().collect();
    if but_the_size.len() < ladders.len() {
        let Some(as_large) = bring_down(&start, &but_the_size, limit_ms, try_it, is_over)? else {
            return Ok(None);
        };
        if is_better(&as_large, &current, limit_ms) {
            current = as_large;
        }
    }
    for _ in 0..MAX_ROUNDS {
        let mut found = current.clone();
        let mut model = Vec::with_capacity(ladders.len());
        for ladder in ladders {
            let mut steps = vec![Step::default()];
            for direction in [-1, 1] {
                // Far beyond the budget there is only one way.
                if is_over() || direction == 1 && current.ms > 2.0 * budget_ms {
                    continue;
                }
                let Some(setting) = ladder.step(&current.setting, direction) else {
                    continue;
                };
                let Some(trial) = try_it(&setting)? else {
                    return Ok(None);
                };
                steps.push(Step {
                    direction,
                    log_ms: (trial.ms / current.ms).ln(),
                    log_error: (trial.error / current.error).ln(),
                });
                if is_better(&trial, &found, limit_ms) {
                    found = trial;
                }
            }
            model.push(steps);
        }
        if let Some(setting) = combine(&current, ladders, &model, limit_ms)
            && !is_over()
        {
            let Some(trial) = try_it(&setting)? else {
                return Ok(None);
            };
            if is_better(&trial, &found, limit_ms) {
                found = trial;
            }
        }
        if found == current || is_over() {
            return Ok(Some(found));
        }
        current = found;
    }
    Ok(Some(current))
}

/// Scales a start down until it meets the limit: the first that does, or the fastest. `None` if it was interrupted.
fn bring_down(
    start: &Trial,
    ladders: &[Ladder],
    limit_ms: f64,
    try_it: &mut Try<'_>,
    is_over: &dyn Fn() -> bool,
) -> Result<Option<Trial>, CostError> {
    let mut current = start.clone();
    for share in SCALES {
        if current.ms <= limit_ms || is_over() {
            break;
        }
        let Some(trial) = try_it(&scaled_down(&start.setting, ladders, share))? else {
            return Ok(None);
        };
        if is_better(&trial, &current, limit_ms) {
            current = trial;
        }
    }
    Ok(Some(current))
}

/// What a step of one knob does, as far as the trials tell.
#[derive(Clone, Copy, Debug, Default)]
struct Step {
    direction: isize,
    log_ms: f64,
    log_error: f64,
}

/// The combination of steps with the least error of those that meet the limit by the model, or else the fastest; `None` if it is none.
fn combine(
    from: &Trial,
    ladders: &[Ladder],
    model: &[Vec<Step>],
    limit_ms: f64,
) -> Option<Setting> {
    let room = (limit_ms / from.ms).ln();
    let mut combinations: Vec<(Vec<isize>, f64, f64)> = vec![(Vec::new(), 0.0, 0.0)];
    for steps in model {
        combinations = combinations
            .iter()
            .flat_map(|(directions, log_ms, log_error)| {
                steps.iter().map(move |step| {
                    let mut directions = directions.clone();
                    directions.push(step.direction);
                    (directions, log_ms + step.log_ms, log_error + step.log_error)
                })
            })
            .collect();
    }
    let rank = |(_, log_ms, log_error): &(Vec<isize>, f64, f64)| match *log_ms <= room {
        true => (0, *log_error),
        false => (1, *log_ms),
    };
    let best = combinations.iter().min_by(|a, b| {
        let ((a_class, a), (b_class, b)): ((u8, f64), (u8, f64)) = (rank(a), rank(b));
        a_class.cmp(&b_class).then(a.total_cmp(&b))
    })?;
    let steps = || best.0.iter().zip(ladders);
    // One step alone was tried already.
    if steps().filter(|(direction, _)| **direction != 0).count() < 2 {
        return None;
    }
    let mut setting = from.setting.clone();
    for (direction, ladder) in steps().filter(|(direction, _)| **direction != 0) {
        setting = ladder.step(&setting, *direction)?;
    }
    Some(setting)
}

/// Measures a setting afresh and fills the budget with paths, or takes some away, until its median lies within the budget and uses
/// [`FILL_MIN`] of it; more paths are kept only if the error does not grow, and where fewer do not help, all knobs come down. Returns the
/// one to take, or `None` if it was interrupted.
///
/// # Errors
/// Those of `try_afresh`.
pub fn confirm(
    setting: &Setting,
    ladders: &[Ladder],
    budget_ms: f64,
    try_afresh: &mut Try<'_>,
) -> Result<Option<Trial>, CostError> {
    let mut setting = setting.clone();
    let mut trials: Vec<Trial> = Vec::new();
    for _ in 0..MAX_CONFIRMATIONS {
        let Some(trial) = try_afresh(&setting)? else {
            return Ok(None);
        };
        let is_filled = fills(&trial, budget_ms);
        let does_not_pay = trials.iter().any(|before| {
            before.ms < trial.ms && before.ms <= budget_ms && before.error < NOT_WORSE * trial.error
        });
        trials.push(trial);
        if is_filled || does_not_pay {
            break;
        }
        let slow = trials.iter().rev().take_while(|trial| trial.ms > budget_ms);
        let next = match (slow.count(), next_effort(&trials, budget_ms)) {
            (0 | 1, Some(effort)) => with_effort(&setting, effort),
            (0, None) => None,
            _ => Some(scaled_down(&setting, ladders, CONFIRMATION_SCALE)),
        };
        match next.filter(|next| *next != setting) {
            Some(next) => setting = next,
            None => break,
        }
    }
    let filling = trials.iter().filter(|trial| fills(trial, budget_ms));
    let filling = best(filling.cloned(), budget_ms);
    let least = best(trials, budget_ms);
    Ok(match (filling, least) {
        (Some(filling), Some(least)) if least.error >= NOT_WORSE * filling.error => Some(filling),
        (_, least) => least,
    })
}

fn fills(trial: &Trial, budget_ms: f64) -> bool {
    (FILL_MIN * budget_ms..=budget_ms).contains(&trial.ms)
}

/// The setting with so many paths; `None` beyond the knob's range.
fn with_effort(setting: &Setting, effort: u32) -> Option<Setting> {
    let mut setting = setting.clone();
    let set = setting.set(setting.effort_key(), &effort.to_string());
    set.is_ok().then_some(setting)
}

/// The paths that should take the time aimed at, from the last trial and how time grew with paths between the last two.
fn next_effort(trials: &[Trial], budget_ms: f64) -> Option<u32> {
    let last = trials.last()?;
    let paths = |trial: &Trial| f64::from(trial.setting.effort().max(1));
    let measured = match trials {
        [.., before, last] => (last.ms / before.ms).ln() / (paths(last) / paths(before)).ln(),
        _ => f64::NAN,
    };
    /// Time grows with paths at least and at most so; half where nothing is known.
    const EXPONENTS: (f64, f64, f64) = (0.25, 1.2, 0.5);
    let exponent = match measured.is_finite() {
        true => measured.clamp(EXPONENTS.0, EXPONENTS.1),
        false => EXPONENTS.2,
    };
    let factor = (FILL_AIM * budget_ms / last.ms).powf(1.0 / exponent);
    let effort = (paths(last) * factor.clamp(0.25, 4.0)).round().max(1.0) as u32;
    let was_tried = trials.iter().any(|trial| trial.setting.effort() == effort);
    (!was_tried).then_some(effort)
}

#[cfg(test)]
mod tests {
    use super::super::setting::tests::setting;
    use super::*;

    /// A machine of which everything is known: time is the sum of its parts, noise falls with photons and blur with the radius.
    fn machine(setting: &Setting) -> Trial {
        let photons = f64::from(setting.params.photon.count);
        let per_estimate = f64::from(setting.params.gather.photons_per_estimate);
        let rays = f64::from(setting.params.direct.shadow_rays);
        let pixels = f64::from(setting.size.width * setting.size.height) / 4096.0;
        Trial {
            setting: setting.clone(),
            ms: 1.0 + photons / 1000.0 + pixels * (4.0 * rays + 0.5 * per_estimate),
            error: 1.0 / per_estimate + 20.0 * per_estimate / photons + 0.05 / rays + 0.01 / pixels,
        }
    }

    fn ladders() -> Vec<Ladder> {
        Ladder::all("pm-direct", "64x64".parse().unwrap())
    }

    fn searched(budget_ms: f64) -> Trial {
        let mut try_it = |setting: &Setting| Ok(Some(machine(setting)));
        let start = machine(&setting());
        let found = descend(start, &ladders(), budget_ms, &mut try_it, &|| false);
        let found = found.unwrap().unwrap();
        confirm(&found.setting, &ladders(), budget_ms, &mut try_it)
            .unwrap()
            .unwrap()
    }

    #[test]
    fn the_chosen_setting_meets_its_budget_and_uses_it() {
        for budget_ms in [8.0, 20.0, 50.0, 200.0] {
            let found = searched(budget_ms);
            let share = found.ms / budget_ms;
            assert!((FILL_MIN..=1.0).contains(&share), "{budget_ms}: {found:?}");
        }
    }

    #[test]
    fn a_larger_budget_buys_less_error_and_the_choice_beats_its_start_scaled_down() {
        let errors = [8.0, 20.0, 50.0, 200.0].map(|budget_ms| searched(budget_ms).error);
        assert!(
            errors.windows(2).all(|pair| pair[1] < pair[0]),
            "{errors:?}"
        );
        // What taking photons away alone would give within 50 ms.
        let mut naive = setting();
        naive.params.photon.count = 17_000;
        let naive = machine(&naive);
        let found = searched(50.0);
        assert!(
            naive.ms < 50.0 && found.error < 0.95 * naive.error,
            "{found:?}"
        );
    }

    #[test]
    fn a_budget_that_nothing_meets_ends_with_the_fastest_setting() {
        let found = searched(0.5);
        assert!(found.ms > 0.5);
        assert!(found.ms < 0.1 * machine(&setting()).ms, "{found:?}");
    }

    #[test]
    fn a_choice_is_challenged_by_what_is_known_to_be_better_within_the_budget() {
        let trial = |ms: f64, error: f64| Trial {
            setting: setting(),
            ms,
            error,
        };
        let chosen = trial(48.0, 0.028);
        let challenged = |known: &[Trial]| {
            let found = challenger(&chosen, known.to_vec(), 50.0);
            found.map(|trial| trial.ms)
        };
        let known = [trial(24.0, 0.0205), trial(41.0, 0.0201), trial(49.0, 0.01)];
        assert_eq!(
            challenged(&known),
            Some(41.0),
            "49 ms leave no time to spare"
        );
        assert_eq!(challenged(&[trial(10.0, 0.0279), trial(90.0, 0.001)]), None);
    }

    #[test]
    fn paths_that_do_not_pay_are_not_added() {
        // Here more photons only cost.
        let mut tries = 0;
        let mut try_it = |setting: &Setting| {
            tries += 1;
            let photons = f64::from(setting.params.photon.count);
            Ok(Some(Trial {
                setting: setting.clone(),
                ms: 1.0 + photons / 1000.0,
                error: photons,
            }))
        };
        let mut start = setting();
        start.params.photon.count = 5000;
        let found = confirm(&start, &ladders(), 50.0, &mut try_it)
            .unwrap()
            .unwrap();
        assert_eq!(found.setting.params.photon.count, 5000);
        assert_eq!(tries, 2, "one look beyond is enough");
    }

    #[test]
    fn a_setting_that_fewer_paths_do_not_make_fast_enough_is_scaled_down() {
        // All time goes into pixels.
        let mut try_it = |setting: &Setting| {
            let pixels = f64::from(setting.size.width * setting.size.height);
            Ok(Some(Trial {
                setting: setting.clone(),
                ms: pixels / 50.0,
                error: 1.0 / pixels,
            }))
        };
        assert!(try_it(&setting()).unwrap().unwrap().ms > 80.0);
        let found = confirm(&setting(), &ladders(), 50.0, &mut try_it).unwrap();
        assert!(found.unwrap().ms <= 50.0);
    }

    #[test]
    fn a_start_far_beyond_the_budget_is_scaled_down_first() {
        let mut tried = Vec::new();
        let mut try_it = |setting: &Setting| {
            tried.push(machine(setting).ms);
            Ok(Some(machine(setting)))
        };
        let start = machine(&setting());
        assert!(start.ms > 200.0);
        let found = descend(start, &ladders(), 20.0, &mut try_it, &|| false).unwrap();
        assert!(found.unwrap().ms <= 20.0);
        let needed = tried.iter().position(|ms| *ms <= 20.0).unwrap();
        assert!(needed < SCALES.len(), "{tried:?}");
    }

    #[test]
    fn small_pictures_of_many_samples_give_way_to_whole_ones_of_few() {
        // Time goes into samples of pixels. Whatever is smaller than the reference costs much of the accuracy, as all of it is blurred.
        let mut try_it = |setting: &Setting| {
            let pixels = f64::from(setting.size.width * setting.size.height);
            let samples = pixels * f64::from(setting.params.fovea.samples);
            let blur = if setting.size.width < 64 { 0.5 } else { 0.0 };
            Ok(Some(Trial {
                setting: setting.clone(),
                ms: 1.0 + samples / 200.0,
                error: 0.1 + blur + 100.0 / samples,
            }))
        };
        let start = try_it(&setting()).unwrap().unwrap();
        assert!(start.ms > 50.0);
        let found = descend(start, &ladders(), 30.0, &mut try_it, &|| false).unwrap();
        let found = found.unwrap().setting;
        assert_eq!(
            (found.size.width, found.params.fovea.samples),
            (64, 1),
            "{found:?}"
        );
    }

    #[test]
    fn an_interrupted_search_chooses_nothing() {
        let mut left = 3;
        let mut try_it = |setting: &Setting| {
            left -= 1;
            Ok((left > 0).then(|| machine(setting)))
        };
        let start = machine(&setting());
        let found = descend(start, &ladders(), 50.0, &mut try_it, &|| false).unwrap();
        assert_eq!(found, None);
    }
}
