//! What was found, in plain words: each sentence is drawn from figures that were measured, and says which.

use serde::Serialize;

use super::alike;
use super::campaign::Drift;
use super::fit::{self, PowerLaw};
use super::level::{Goal, Level};
use super::limit;
use super::noise::TimeNoise;
use super::point::Point;
use super::search::FILL_MIN;
use super::table::{Budget, Comparison};
use crate::technique::radius::RadiusRule;

/// The share of a fit's scatter below which no price is told.
const GOOD_FIT: f64 = 0.8;
/// The share of time by which a machine may drift before prices are no more than orders of magnitude.
const UNSTEADY: f64 = 0.5;
/// The reference's share of an error from which readers are warned.
const NOISY_REFERENCE: f64 = 0.5;

/// Sentences about one thing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Paragraph {
    /// What they are about.
    pub heading: String,
    /// The sentences.
    pub sentences: Vec<String>,
}

/// Everything that is said; `comparisons` are of techniques at one level each, `radius` tells which settings the scene makes one.
pub fn all(
    points: &[Point],
    budget: Option<&Budget>,
    comparisons: &[Comparison],
    drift: &Drift,
    radius: &RadiusRule,
) -> Vec<Paragraph> {
    let noise = TimeNoise::of(points, drift);
    let of_budget = budget.map_or(Vec::new(), |budget| {
        let chosen = points.iter().find(|point| point.key == budget.point);
        let mut said = of_budget(budget);
        said.extend(chosen.and_then(time_of));
        said
    });
    let mut of_price = prices(points);
    if !of_price.is_empty() && noise.share > UNSTEADY {
        of_price.push(format!(
            "The machine's times scattered by {} % meanwhile: take these prices for orders of magnitude, and measure again (--force) when it rests.",
            number((100.0 * noise.share).round())
        ));
    }
    of_price.extend(self::comparisons(points, noise));
    let of_level = |comparison: &Comparison| of_levels(comparison.goal, &comparison.levels, noise);
    of_price.extend(comparisons.iter().map(of_level));
    let of_limits = fit::techniques(points).into_iter();
    let of_limits =
        of_limits.filter_map(|technique| limit::sentence(technique, points, noise, radius));
    let of_limits = of_limits.chain(alike::sentence(points, radius));
    [
        ("The budget", of_budget),
        ("What accuracy costs", of_price),
        ("What limits it", of_limits.collect()),
        ("How sure this is", of_noise(points, drift)),
    ]
    .into_iter()
    .filter(|(_, sentences)| !sentences.is_empty())
    .map(|(heading, sentences)| Paragraph {
        heading: heading.into(),
        sentences,
    })
    .collect()
}

/// The one sentence that stands over all.
pub fn title(scene: &str, points: &[Point], budget: Option<&Budget>, drift: &Drift) -> String {
    let is_unsteady = TimeNoise::of(points, drift).share > UNSTEADY;
    if let Some(budget) = budget {
        let found = match budget.is_met {
            true => format!(
                "{} ms buy a foveal error of {} in {scene}",
                number(budget.budget_ms),
                number(budget.relmse)
            ),
            false => format!(
                "{} ms were not kept in {scene}: the fastest setting took {} ms when measured again",
                number(budget.budget_ms),
                number(budget.frame_ms)
            ),
        };
        return match is_unsteady {
            true => found + ", measured on an unsteady machine",
            false => found,
        };
    }
    if is_unsteady {
        return format!("What accuracy costs in {scene}, measured on an unsteady machine");
    }
    let front = fit::front(points);
    match PowerLaw::of_front(&front).filter(|law| law.r_squared >= GOOD_FIT) {
        Some(law) => format!(
            "Half the foveal error costs about {} times the time in {scene}",
            number((10.0 * law.price_of_half()).round() / 10.0)
        ),
        None => match front[..] {
            [first, .., last] => format!(
                "{} times the time buys a foveal error {} times smaller in {scene}",
                number(last.frame_ms() / first.frame_ms()),
                number(first.relmse() / last.relmse())
            ),
            _ => format!("What accuracy costs in {scene}"),
        },
    }
}

/// What a budget buys, and how sure that is.
fn of_budget(budget: &Budget) -> Vec<String> {
    let mut said = Vec::new();
    let (asked, took) = (number(budget.budget_ms), number(budget.frame_ms));
    let share = budget.frame_ms / budget.budget_ms;
    said.push(match budget.is_met {
        true => format!(
            "The best setting found for {asked} ms (the periphery is not weighed) is {}. Measured again after it was chosen: {took} ms of {asked} (half of its frames \
             between {} and {}), foveal error {}.",
            budget.label,
            number(budget.q25_ms),
            number(budget.q75_ms),
            number(budget.relmse)
        ),
        false => format!(
            "No setting kept to {asked} ms when it was measured again: the fastest, {}, took {took} ms. If other work kept the machine busy \
             (its drift is below), let it rest and run the command again with --force; else smaller pictures or a faster device are needed.",
            budget.label
        ),
    });
    if budget.is_met && share < FILL_MIN {
        said.push(format!(
            "It uses {} % of the budget: more paths, as far as they were measured, went beyond it or did not pay.",
            number(100.0 * share)
        ));
    }
    said
}

/// What time is spent on at a point.
fn time_of(point: &Point) -> Option<String> {
    let sum: f64 = point.time.pass_ms.iter().map(|(_, ms)| ms).sum();
    let mut stages: Vec<&(String, f64)> = point.time.pass_ms.iter().collect();
    stages.sort_by(|a, b| b.1.total_cmp(&a.1));
    let share = |ms: f64| number((100.0 * ms / sum.max(f64::MIN_POSITIVE)).round());
    match stages[..] {
        [(first, first_ms), (second, second_ms), ..] => Some(format!(
            "Of its time {} % goes to {first} and {} % to {second}.",
            share(*first_ms),
            share(*second_ms)
        )),
        _ => None,
    }
}

/// How noisy the machine and the reference were.
fn of_noise(points: &[Point], drift: &Drift) -> Vec<String> {
    let mut said = Vec::new();
    let mut spreads: Vec<f64> = points.iter().map(|point| point.time.spread()).collect();
    spreads.sort_unstable_by(f64::total_cmp);
    if let Some(spread) = spreads.get(spreads.len() / 2) {
        let mut text = format!(
            "Frames of one setting scatter: the middle half of them spans {} % of the median (at the median point).",
            number((100.0 * spread).round())
        );
        if let Some(range) = drift.range() {
            text += &format!(
                " One setting, timed {} times through the run, took from {} to {} ms: the machine itself drifted by {} %, and times that \
                 differ by less are equal.",
                drift.anchor_ms.len(),
                number(
                    drift
                        .anchor_ms
                        .iter()
                        .copied()
                        .fold(f64::INFINITY, f64::min)
                ),
                number(drift.anchor_ms.iter().copied().fold(0.0, f64::max)),
                number((100.0 * range).round())
            );
        }
        said.push(text);
    }
    let noise = points.iter().filter_map(|point| {
        let fovea = point.error.fovea?;
        Some((fovea.relative_reference_variance, point.relmse()))
    });
    if let Some((noise, least)) = noise.min_by(|a, b| a.1.total_cmp(&b.1)) {
        said.push(if noise <= 0.0 {
            "The reference came without its own noise: whatever it has is counted as error.".into()
        } else if noise > NOISY_REFERENCE * least {
            format!(
                "The reference's own noise ({}) is taken off every error, but it is not small beside the least one ({}): trust the points \
                 of least error less, or give the reference more time (--reference-seconds).",
                number(noise),
                number(least)
            )
        } else {
            format!(
                "The reference's own noise is taken off every error; it was {}, the least error is {}.",
                number(noise),
                number(least)
            )
        });
    }
    said
}

/// Techniques at a level.
fn of_levels(goal: Goal, levels: &[Level], noise: TimeNoise) -> String {
    let (head, worse) = match goal {
        Goal::Relmse(error) => (
            format!("A foveal error of {} takes", number(error)),
            "times as long",
        ),
        Goal::FrameMs(ms) => (
            format!("{} ms buy a foveal error of", number(ms)),
            "times as much",
        ),
    };
    let best = levels.iter().find(|level| level.ratio == Some(1.0));
    let best_scatter = best.map_or(0.0, |level| level.scatter);
    let of = |level: &Level| {
        let (name, ms, error) = (
            &level.technique,
            number(level.frame_ms),
            number(level.relmse),
        );
        let reached = match (goal, level.ratio) {
            (Goal::Relmse(_), Some(_)) => format!("{ms} ms with {name}"),
            (Goal::FrameMs(_), Some(_)) => format!("{error} with {name}"),
            (Goal::Relmse(_), None) => format!("{name} did not reach it (least error {error})"),
            (Goal::FrameMs(_), None) => format!("{name} was never as fast ({ms} ms at least)"),
        };
        let is_told = |ratio: &f64| match goal {
            Goal::Relmse(_) => *ratio > 1.0 && noise.is_beyond(*ratio),
            Goal::FrameMs(_) => *ratio > 1.0 + level.scatter.hypot(best_scatter),
        };
        match level.ratio {
            Some(ratio) if is_told(&ratio) => format!("{reached} ({} {worse})", number(ratio)),
            Some(ratio) if ratio > 1.0 => format!("{reached} (as good as equal)"),
            _ => reached,
        }
    };
    let levels: Vec<String> = levels.iter().map(of).collect();
    format!("{head}: {}.", levels.join("; "))
}

/// How sure a price is.
fn within(law: &PowerLaw) -> String {
    /// Beyond so many times the least, the most says nothing: three points or so leave it open.
    const MOST_TOLD: f64 = 100.0;
    let [least, most] = law.price_range;
    match most < MOST_TOLD * least {
        true => format!(" (between {} and {})", number(least), number(most)),
        false => format!(" (at least {})", number(least)),
    }
}

/// What half the error costs: along the points that nothing beats, and along each technique's own.
fn prices(points: &[Point]) -> Vec<String> {
    let mut said = Vec::new();
    let all = PowerLaw::of_front(&fit::front(points));
    let fitting = |law: &PowerLaw| number((100.0 * law.r_squared).round());
    let range =
        |law: &PowerLaw| format!("from {} to {} ms", number(law.from_ms), number(law.to_ms));
    said.extend(all.map(|law| match law.r_squared >= GOOD_FIT {
        true => format!(
            "Half the foveal error costs {} times the time{}: a power law through the {} points that nothing beats, {}, explains {} % of \
             their scatter.",
            number(law.price_of_half()),
            within(&law),
            law.points,
            range(&law),
            fitting(&law)
        ),
        false => format!(
            "No one price of accuracy holds: a power law through the {} points that nothing beats, {}, \
             explains only {} % of their scatter.",
            law.points,
            range(&law),
            fitting(&law)
        ),
    }));
    let names = fit::techniques(points);
    if names.len() < 2 {
        return said;
    }
    for technique in names {
        let own = points.iter().filter(|point| point.technique == technique);
        let law = PowerLaw::of_front(&fit::front(own)).filter(|law| law.r_squared >= GOOD_FIT);
        said.extend(law.map(|law| {
            format!(
                "With {technique} alone half the foveal error costs {} times the time{} ({} points, {}, {} % explained).",
                number(law.price_of_half()),
                within(&law),
                law.points,
                range(&law),
                fitting(&law)
            )
        }));
    }
    said
}

/// The technique that holds most of the front beside each other one, at an error in the middle of what both reached.
fn comparisons(points: &[Point], noise: TimeNoise) -> Vec<String> {
    let of = |technique: &str| fit::front(points.iter().filter(|p| p.technique == technique));
    let range = |front: &[&Point]| {
        let errors = || front.iter().map(|point| point.relmse());
        let least = errors().fold(f64::INFINITY, f64::min);
        (least, errors().fold(0.0, f64::max))
    };
    let all = fit::front(points);
    let held = |technique: &&str| all.iter().filter(|p| p.technique == *technique).count();
    let names = fit::techniques(points);
    let Some(&best) = names.iter().max_by_key(|name| held(name)) else {
        return Vec::new();
    };
    let own = of(best);
    let beside = |other: &&str| {
        let theirs = of(other);
        let ((own_least, own_most), (their_least, their_most)) = (range(&own), range(&theirs));
        let error = (own_least.max(their_least) * own_most.min(their_most)).sqrt();
        let own_ms = fit::time_at(&own, error)?;
        let their_ms = fit::time_at(&theirs, error)?;
        let ratio = their_ms / own_ms;
        let compared = match noise.is_beyond(ratio) {
            true => format!("{} times as long", number(ratio)),
            false => format!(
                "which is equal on this machine: times within {} % can't be told apart",
                number((100.0 * noise.share).round())
            ),
        };
        Some(format!(
            "For a foveal error of {}, {best} takes {} ms and {other} {} ms, {compared}.",
            number(error),
            number(own_ms),
            number(their_ms)
        ))
    };
    let others = names.iter().filter(|name| **name != best);
    others.filter_map(beside).collect()
}

/// Three digits that count.
pub fn number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let power = value.abs().log10().floor() as i32;
    match power {
        -3..=5 => {
            let digits = (2 - power).max(0) as usize;
            let text = format!("{value:.digits$}");
            match text.contains('.') {
                true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
                false => text,
            }
        }
        _ => format!("{value:.2e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::super::alike::tests::ROOM;
    use super::super::point::tests::point;
    use super::*;

    #[test]
    fn the_price_of_half_the_error_is_told_with_what_it_is_drawn_from() {
        let law = |ms: f64| ms.powf(-0.65);
        let points: Vec<Point> = [10.0, 40.0, 160.0, 640.0]
            .map(|ms| point("pm", ms, law(ms), 0.1))
            .to_vec();
        let steady = Drift::default();
        let said = prices(&points).join("\n");
        assert!(said.contains("costs 2.9 times the time"), "{said}");
        assert!(
            said.contains("4 points") && said.contains("from 10 to 640 ms"),
            "{said}"
        );
        assert!(title("a room", &points, None, &steady).contains("2.9 times"));
        let scattered = [(10.0, 1.0), (20.0, 0.99), (30.0, 0.98), (31.0, 1e-3)];
        let scattered = scattered.map(|(ms, e)| point("pm", ms, e, 0.1)).to_vec();
        assert!(prices(&scattered)[0].starts_with("No one price"));
        let unsteady = Drift {
            anchor_ms: vec![10.0, 24.3],
        };
        assert!(title("a room", &points, None, &unsteady).contains("unsteady"));
        let warned = &all(&points, None, &[], &unsteady, &ROOM)[0].sentences;
        assert!(warned.last().unwrap().contains("143 %"), "{warned:?}");
        assert!(title("a room", &scattered, None, &steady).starts_with("3.1 times the time buys"));
    }

    #[test]
    fn techniques_are_compared_where_both_have_been() {
        let points = [
            point("pm", 100.0, 0.1, 0.0),
            point("pm", 1000.0, 0.01, 0.0),
            point("path", 20.0, 0.1, 0.0),
            point("path", 200.0, 0.01, 0.0),
        ];
        let steady = TimeNoise { share: 0.05 };
        let said = comparisons(&points, steady);
        assert_eq!(said.len(), 1);
        assert!(
            said[0].contains("path takes 63.2 ms and pm 316 ms, 5 times as long"),
            "{}",
            said[0]
        );
        let apart = [
            point("pm", 100.0, 0.1, 0.0),
            point("pm", 200.0, 0.05, 0.0),
            point("path", 20.0, 0.02, 0.0),
        ];
        assert_eq!(comparisons(&apart, steady), [""; 0]);
        let unsteady = comparisons(&points, TimeNoise { share: 5.0 });
        assert!(
            unsteady[0].contains("equal on this machine"),
            "{}",
            unsteady[0]
        );
    }

    #[test]
    fn a_level_is_told_for_every_technique_also_for_one_that_does_not_reach_it() {
        let points = [
            point("pm", 40.0, 0.01, 0.5),
            point("path", 10.0, 0.01, 0.0),
            point("ir", 5.0, 0.5, 0.0),
        ];
        let goal = Goal::Relmse(0.01);
        let levels = super::super::level::levels(&points, goal);
        let said = of_levels(goal, &levels, TimeNoise { share: 0.05 });
        assert_eq!(
            said,
            "A foveal error of 0.01 takes: 40 ms with pm (4 times as long); 10 ms with path; ir did not reach it (least error 0.5)."
        );
        let unsteady = of_levels(goal, &levels, TimeNoise { share: 4.0 });
        assert!(unsteady.contains("pm (as good as equal)"), "{unsteady}");
    }

    #[test]
    fn a_budget_is_told_with_what_was_measured_again_and_one_that_was_missed_too() {
        let met = Budget::new(50.0, &point("pm", 48.0, 0.02, 0.5));
        let said = of_budget(&met).join(" ");
        assert!(
            said.contains("48 ms of 50") && said.contains("0.02"),
            "{said}"
        );
        assert!(!said.contains("% of the budget"), "{said}");
        let cheap = Budget::new(50.0, &point("pm", 20.0, 0.02, 0.5));
        assert!(of_budget(&cheap)[1].contains("40 % of the budget"));
        let missed = Budget::new(50.0, &point("pm", 70.0, 0.02, 0.5));
        assert!(of_budget(&missed)[0].contains("took 70 ms"));
        assert!(title("a room", &[], Some(&missed), &Drift::default()).contains("not kept"));
    }

    #[test]
    fn numbers_have_three_digits_that_count() {
        let written = [0.001234, 0.5, 12.0, 48.71, 1234.5, 0.0, 1.5e-7].map(number);
        assert_eq!(
            written,
            ["0.00123", "0.5", "12", "48.7", "1234", "0", "1.50e-7"]
        );
    }
}
