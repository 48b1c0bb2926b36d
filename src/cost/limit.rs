//! What limits a technique: whether more paths still pay for their time, and if not, whether blur is left or noise.

use super::alike::capped_m;
use super::fit::price;
use super::noise::{TimeNoise, error_scatter, errors_differ};
use super::point::{Point, grouped};
use super::sentences::number;
use super::setting::Setting;
use crate::technique::radius::RadiusRule;

/// How many times the time half the error may cost where more paths pay: noise alone asks for twice the time.
const PAYS: f64 = 4.0;
/// The bias share from which blur, not noise, is most of an error.
const MOSTLY: f64 = 0.5;

/// From where more paths hardly pay for their time, and what limits a technique's error then: along the series of points that holds its
/// least error and differs in paths alone. It says of which size it is told where there are several.
pub fn sentence(
    technique: &str,
    points: &[Point],
    noise: TimeNoise,
    radius: &RadiusRule,
) -> Option<String> {
    let own = || points.iter().filter(|point| point.technique == technique);
    let best = own().min_by(|a, b| a.relmse().total_cmp(&b.relmse()))?;
    let series = series_of(best)?;
    let mut along: Vec<&Point> = own()
        .filter(|point| series_of(point).as_ref() == Some(&series))
        .collect();
    along.sort_by_key(|point| point.effort);
    let last = along.last()?;
    let subject = match own().all(|point| point.size == last.size) {
        true => technique.to_owned(),
        false => format!("{technique} at {}", last.size),
    };
    let paths = match last.photons {
        Some(_) => "photons",
        None => "paths a pixel",
    };
    let steps: Vec<Step> = along
        .windows(2)
        .map(|pair| step(pair[0], pair[1], noise))
        .collect();
    // Chance decides nothing: where paths pay ends before the last steps that surely do not.
    let is_no = |step: &Step| *step == Step::DoesNotPay;
    let from = steps.iter().rposition(|step| !is_no(step));
    let from = from.map_or(0, |at| at + 1);
    let before = along.get(along.len().checked_sub(2)?)?;
    let last_step = format!(
        "from {} to {} {paths} a frame takes {} instead of {} ms, and the foveal error goes from {} to {}{}",
        grouped(before.effort),
        grouped(last.effort),
        number(last.frame_ms()),
        number(before.frame_ms()),
        number(before.relmse()),
        number(last.relmse()),
        match errors_differ(before, last) {
            true => "",
            false => ", which may be chance",
        }
    );
    match steps.last() {
        Some(Step::Pays) => {
            return Some(format!("{subject}: more {paths} still pay; {last_step}."));
        }
        Some(Step::IsChance) => {
            // On a machine that takes the same time always, would it be told?
            let unsure = match step(before, last, TimeNoise { share: 0.0 }) {
                Step::IsChance => "the errors are not known well enough",
                _ => "the time that they take scatters too much",
            };
            return Some(format!(
                "{subject}: whether more {paths} pay for their time can't be told, as {unsure}; {last_step}. Points of more frames (--point-seconds, \
                 in a folder of their own) on a machine at rest would tell."
            ));
        }
        Some(Step::DoesNotPay) | None => {}
    }
    let bias = last.error.fovea.map_or(0.0, |fovea| fovea.bias_share());
    let percent = number((100.0 * bias.max(1.0 - bias)).round());
    let held = |cap_m: f32| {
        let cap_m = number(f64::from(cap_m));
        format!("the automatic one is held to {cap_m} m, whatever gather.photons_per_estimate says")
    };
    let (narrower, wider) = match capped_m(last, radius).map(held) {
        Some(held) => (
            format!(" A smaller gather.radius_m would narrow it; {held}."),
            format!("gather.radius_m; {held}"),
        ),
        None => (String::new(), "gather.photons_per_estimate".into()),
    };
    let limiting = match (bias >= MOSTLY, last.radius_m) {
        (true, Some(_)) => format!(
            "The radius, not the {paths}, limits: {percent} % of what is left is bias, light blurred over the radius.{narrower}"
        ),
        (true, None) => {
            format!("The picture, not the {paths}, limits: {percent} % of what is left is bias.")
        }
        (false, Some(_)) => format!(
            "The photons in one estimate, not all that are emitted, limit: {percent} % of what is left is noise, and a wider radius \
             ({wider}) or more passes would lower it."
        ),
        (false, None) => format!("{percent} % of what is left is noise."),
    };
    Some(format!(
        "{subject}: beyond {} {paths} more of them hardly pay for their time; {last_step}. {limiting}",
        grouped(along[from].effort)
    ))
}

/// What a step to more paths is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Step {
    /// Its error falls at a fair price.
    Pays,
    /// It does not.
    DoesNotPay,
    /// Times and errors scatter too much to tell.
    IsChance,
}

/// Weighs a step by the best and by the worst that its noise allows: two standard errors of the errors, and the machine's share of time.
fn step(from: &Point, to: &Point, noise: TimeNoise) -> Step {
    let time = to.frame_ms() / from.frame_ms();
    let gain = from.relmse() / to.relmse();
    let scatter = error_scatter(from).hypot(error_scatter(to));
    let pays =
        |gain: f64, time: f64| gain > 1.0 && (time <= 1.0 || price(gain.ln() / time.ln()) <= PAYS);
    let most_time = 1.0 + noise.share;
    match (
        pays(gain * (1.0 + scatter), time / most_time),
        pays(gain / (1.0 + scatter), time * most_time),
    ) {
        (_, true) => Step::Pays,
        (false, _) => Step::DoesNotPay,
        (true, false) => Step::IsChance,
    }
}

/// What the points of a series have in common: all but the paths.
fn series_of(point: &Point) -> Option<Setting> {
    let mut setting = Setting::of(point).ok()?;
    let key = setting.effort_key();
    setting.set(key, "1").ok()?;
    Some(setting)
}

#[cfg(test)]
mod tests {
    use super::super::alike::tests::ROOM;
    use super::super::point::tests::point;
    use super::*;

    /// A hall in which no radius is capped.
    const HALL: RadiusRule = RadiusRule {
        area_m2: 24.0,
        diagonal_m: 35.0,
    };

    /// Photons, milliseconds, error, and the share of it that is bias.
    type Made = (u32, f64, f64, f64);

    const MADE: [Made; 4] = [
        (1000, 10.0, 0.1, 0.1),
        (2000, 20.0, 0.05, 0.2),
        (4000, 40.0, 0.025, 0.4),
        (8000, 80.0, 0.022, 0.9),
    ];

    fn points(made: &[Made]) -> Vec<Point> {
        let of = |&(photons, ms, error, bias): &Made| {
            let made = point("pm", ms, error, bias);
            let changed = [("photon.count".to_owned(), photons.to_string())];
            Point {
                effort: photons,
                photons: Some(photons),
                changed: changed.into(),
                ..made
            }
        };
        made.iter().map(of).collect()
    }

    #[test]
    fn where_the_radius_is_capped_nobody_is_sent_to_a_knob_that_changes_nothing() {
        let steady = TimeNoise { share: 0.05 };
        let said = |made: &[Made], radius| sentence("pm", &points(made), steady, radius).unwrap();
        let noisy = [MADE[0], MADE[1], (4000, 40.0, 0.045, 0.1)];
        for made in [&MADE[..], &noisy] {
            let capped = said(made, &ROOM);
            assert!(
                capped.contains("gather.radius_m") && capped.contains("held to 0.175 m"),
                "{capped}"
            );
            let free = said(made, &HALL);
            assert!(
                !free.contains("held") && !free.contains("radius_m"),
                "{free}"
            );
        }
    }

    #[test]
    fn a_limit_is_told_for_its_size_where_there_are_several() {
        let steady = TimeNoise { share: 0.05 };
        let mut points = points(&MADE);
        let said = |points: &[Point]| sentence("pm", points, steady, &HALL).unwrap();
        assert!(said(&points).starts_with("pm: "), "{}", said(&points));
        let mut small = points[0].clone();
        small.size = "32x32".parse().unwrap();
        points.push(small);
        assert!(
            said(&points).starts_with("pm at 64x64: "),
            "{}",
            said(&points)
        );
    }

    #[test]
    fn more_paths_hardly_pay_from_where_blur_or_the_estimates_noise_is_left() {
        let steady = TimeNoise { share: 0.05 };
        let said = |made: &[Made], noise| sentence("pm", &points(made), noise, &HALL).unwrap();
        let blurred = said(&MADE, steady);
        assert!(
            blurred.contains("beyond 4\u{202f}000 photons more of them hardly pay"),
            "{blurred}"
        );
        assert!(
            blurred.contains("The radius") && blurred.contains("90 %"),
            "{blurred}"
        );
        let paying = said(&MADE[..3], steady);
        assert!(paying.contains("more photons still pay"), "{paying}");
        let noisy = said(&[MADE[0], MADE[1], (4000, 40.0, 0.045, 0.1)], steady);
        assert!(noisy.contains("The photons in one estimate"), "{noisy}");
        // The same gain pays where its time is next to nothing.
        let cheap = said(&[MADE[0], MADE[1], (4000, 20.5, 0.03, 0.1)], steady);
        assert!(cheap.contains("still pay"), "{cheap}");
        // An unsteady machine or few frames prove neither.
        let unsteady = TimeNoise { share: 1.5 };
        let drifting = said(&MADE[..3], unsteady);
        assert!(drifting.contains("scatters too much"), "{drifting}");
        let mut chance = points(&MADE[..3]);
        for point in &mut chance {
            let fovea = point.error.fovea.as_mut().unwrap();
            fovea.relmse_standard_error = 0.01;
        }
        let chance = sentence("pm", &chance, steady, &HALL).unwrap();
        assert!(
            chance.contains("errors are not known well enough")
                && chance.contains("which may be chance"),
            "{chance}"
        );
    }
}
