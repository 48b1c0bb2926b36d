//! What limits a technique: whether more paths still pay, and if not, whether blur is left or noise.

use super::point::{Point, grouped};
use super::sentences::number;
use super::setting::Setting;

/// How fast error must fall with paths, as a power, for more of them to pay; noise alone falls with power 1.
const PAYS: f64 = 0.5;
/// The bias share from which blur, not noise, is most of an error.
const MOSTLY: f64 = 0.5;

/// From where more paths hardly lower a technique's error, and what limits it then: along the series of points that holds its least error
/// and differs in paths alone.
pub fn sentence(technique: &str, points: &[Point]) -> Option<String> {
    let own = || points.iter().filter(|point| point.technique == technique);
    let best = own().min_by(|a, b| a.relmse().total_cmp(&b.relmse()))?;
    let series = series_of(best)?;
    let mut along: Vec<&Point> = own()
        .filter(|point| series_of(point).as_ref() == Some(&series))
        .collect();
    along.sort_by_key(|point| point.effort);
    let last = along.last()?;
    let paths = match last.photons {
        Some(_) => "photons",
        None => "paths a pixel",
    };
    let pays = |pair: &[&Point]| {
        let gain = (pair[0].relmse() / pair[1].relmse()).ln();
        gain / (f64::from(pair[1].effort) / f64::from(pair[0].effort)).ln() >= PAYS
    };
    let steps: Vec<bool> = along.windows(2).map(pays).collect();
    let from = steps.iter().rposition(|pays| *pays).map_or(0, |at| at + 1);
    let before = along.get(along.len().checked_sub(2)?)?;
    let last_step = format!(
        "from {} to {} {paths} the foveal error goes from {} to {}",
        grouped(before.effort),
        grouped(last.effort),
        number(before.relmse()),
        number(last.relmse())
    );
    if from + 1 >= along.len() {
        return Some(format!("{technique}: more {paths} still pay; {last_step}."));
    }
    let bias = last.error.fovea.map_or(0.0, |fovea| fovea.bias_share());
    let percent = number((100.0 * bias.max(1.0 - bias)).round());
    let limiting = match (bias >= MOSTLY, last.radius_m) {
        (true, Some(_)) => format!(
            "The radius, not the {paths}, limits: {percent} % of what is left is bias, light blurred over the radius."
        ),
        (true, None) => {
            format!("The picture, not the {paths}, limits: {percent} % of what is left is bias.")
        }
        (false, Some(_)) => format!(
            "The photons in one estimate, not all that are emitted, limit: {percent} % of what is left is noise, and a wider radius \
             (gather.photons_per_estimate) or more passes would lower it."
        ),
        (false, None) => format!("{percent} % of what is left is noise."),
    };
    Some(format!(
        "{technique}: beyond {} {paths} more of them hardly pay; {last_step}. {limiting}",
        grouped(along[from].effort)
    ))
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
    use super::super::point::tests::point;
    use super::*;

    #[test]
    fn more_paths_hardly_pay_from_where_blur_or_the_estimates_noise_is_left() {
        // Milliseconds, error, and the share of it that is bias.
        type Made = (f64, f64, f64);
        let made = [
            (10.0, 0.1, 0.1),
            (20.0, 0.05, 0.2),
            (40.0, 0.025, 0.4),
            (80.0, 0.022, 0.9),
        ];
        let points = |made: &[Made]| -> Vec<Point> {
            let made = made.iter();
            made.map(|&(ms, error, bias)| point("pm", ms, error, bias))
                .collect()
        };
        let said = sentence("pm", &points(&made)).unwrap();
        assert!(
            said.contains("beyond 4\u{202f}000 photons more of them hardly pay"),
            "{said}"
        );
        assert!(
            said.contains("The radius") && said.contains("90 %"),
            "{said}"
        );
        let said = sentence("pm", &points(&made[..3])).unwrap();
        assert!(said.contains("more photons still pay"), "{said}");
        let noisy = [made[0], made[1], (40.0, 0.045, 0.1)];
        let said = sentence("pm", &points(&noisy)).unwrap();
        assert!(said.contains("The photons in one estimate"), "{said}");
    }
}
