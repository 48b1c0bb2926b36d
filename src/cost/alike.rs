//! Settings that make the same picture: where the gather radius comes out the same, it does not matter what asked for it. A search needs no
//! trial of one whose like it knows.

use super::CostError;
use super::point::{Point, grouped};
use super::sentences::number;
use super::setting::Setting;
use crate::technique::radius::RadiusRule;

/// Whether two settings make the same picture by the same work.
pub fn make_one_picture(a: &Setting, b: &Setting, radius: &RadiusRule) -> bool {
    let [a, b] = [a, b].map(|setting| setting.clone().normalised());
    let but_for_the_radius = |setting: &Setting| {
        let mut setting = setting.clone();
        setting.params.gather.radius_m = 0.0;
        setting.params.gather.photons_per_estimate = 0.0;
        setting
    };
    radius.first_m(&a.params) == radius.first_m(&b.params)
        && but_for_the_radius(&a) == but_for_the_radius(&b)
}

/// The first of some points whose setting makes the same picture.
///
/// # Errors
/// [`CostError`]: a point is of a program that knew other keys.
pub fn find<'a>(
    points: &'a [Point],
    setting: &Setting,
    radius: &RadiusRule,
) -> Result<Option<&'a Point>, CostError> {
    for point in points {
        if make_one_picture(&Setting::of(point)?, setting, radius) {
            return Ok(Some(point));
        }
    }
    Ok(None)
}

/// The radius that a point's is held to, metres, where `gather.photons_per_estimate` asks for a wider one; `None` where it does not, and
/// for a technique that gathers nothing.
pub fn capped_m(point: &Point, radius: &RadiusRule) -> Option<f32> {
    let setting = Setting::of(point).ok()?;
    let is_capped = point.radius_m.is_some() && radius.is_capped(&setting.params);
    is_capped.then(|| radius.automatic_cap_m())
}

/// Which points are the same picture though their `gather.photons_per_estimate` differ, and why; `None` where none are.
pub fn sentence(points: &[Point], radius: &RadiusRule) -> Option<String> {
    let is_capped = |point: &&Point| capped_m(point, radius).is_some();
    let mut groups: Vec<(&Point, Setting, Vec<f32>)> = Vec::new();
    for point in points.iter().filter(is_capped) {
        let setting = Setting::of(point).ok()?;
        let per_estimate = setting.params.gather.photons_per_estimate;
        let known = groups
            .iter_mut()
            .find(|(_, known, _)| make_one_picture(known, &setting, radius));
        match known {
            Some((_, _, values)) => values.push(per_estimate),
            None => groups.push((point, setting, vec![per_estimate])),
        }
    }
    let mut said: Vec<String> = Vec::new();
    for (point, _, mut values) in groups.into_iter().filter(|(_, _, values)| values.len() > 1) {
        values.sort_unstable_by(f32::total_cmp);
        let values: Vec<String> = values.iter().map(f32::to_string).collect();
        let (technique, photons) = (&point.technique, grouped(point.effort));
        let text = format!(
            "{technique} with {photons} photons at {}",
            values.join(" and ")
        );
        // Groups that differ in something else say the same.
        if !said.contains(&text) {
            said.push(text);
        }
    }
    (!said.is_empty()).then(|| {
        format!(
            "Some settings that differ in gather.photons_per_estimate alone make the same picture, and their times differ by chance: for so few \
             photons it asks for a wider radius than the {} m (a twentieth of the scene's diagonal) to which the automatic one is held. They \
             are {}. A value small enough, or gather.radius_m, would change the picture.",
            number(f64::from(radius.automatic_cap_m())),
            said.join("; ")
        )
    })
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::point::tests::point;
    use super::super::setting::tests::setting;
    use super::*;

    /// A room of 2 m: 40 photons an estimate of 1000 ask for more than its cap, of 1 000 000 for less.
    pub(crate) const ROOM: RadiusRule = RadiusRule {
        area_m2: 24.0,
        diagonal_m: 3.5,
    };

    fn with(technique: &str, photons: &str, per_estimate: &str) -> Setting {
        let mut setting = setting();
        for (key, value) in [
            ("technique", technique),
            ("photons", photons),
            ("gather.photons_per_estimate", per_estimate),
        ] {
            setting.set(key, value).unwrap();
        }
        setting
    }

    fn made(setting: &Setting) -> Point {
        let changed = setting.changed();
        Point {
            key: format!("{changed:?}"),
            changed,
            effort: setting.effort(),
            radius_m: (setting.technique != "path").then_some(0.1),
            ..point(setting.technique, 10.0, 0.1, 0.0)
        }
    }

    #[test]
    fn settings_are_one_where_the_radius_is_capped_and_two_where_it_is_not() {
        let is_one = |technique: &str, photons: &str| {
            let [a, b] = ["40", "160"].map(|value| with(technique, photons, value));
            make_one_picture(&a, &b, &ROOM)
        };
        assert!(is_one("pm", "1000") && is_one("pm-direct", "1000"));
        assert!(!is_one("pm", "1000000"));
        assert!(is_one("path", "1000000"), "it gathers nothing");
        let [a, b] = ["1000", "1001"].map(|photons| with("pm", photons, "40"));
        assert!(!make_one_picture(&a, &b, &ROOM), "their photons differ");
        let [mut a, mut b] = ["40", "160"].map(|value| with("pm", "1000000", value));
        (a.params.gather.radius_m, b.params.gather.radius_m) = (0.3, 0.3);
        assert!(make_one_picture(&a, &b, &ROOM), "the radius is set");
        b.params.gather.radius_m = 0.2;
        assert!(!make_one_picture(&a, &b, &ROOM));
    }

    #[test]
    fn a_point_of_the_same_picture_is_found_among_others() {
        let points = [with("pm", "1000000", "40"), with("pm", "1000", "40")].map(|s| made(&s));
        let found = |setting: &Setting| find(&points, setting, &ROOM).unwrap().cloned();
        assert_eq!(found(&with("pm", "1000", "160")), Some(points[1].clone()));
        assert_eq!(found(&with("pm", "1000000", "160")), None);
    }

    #[test]
    fn points_of_the_same_picture_are_told_with_the_cap_and_others_are_not() {
        let said = |settings: &[Setting]| {
            let points: Vec<Point> = settings.iter().map(made).collect();
            sentence(&points, &ROOM)
        };
        let capped = [with("pm", "1000", "160"), with("pm", "1000", "40")];
        let text = said(&capped).unwrap();
        assert!(
            text.contains("0.175 m")
                && text.contains("pm with 1\u{202f}000 photons at 40 and 160."),
            "{text}"
        );
        assert_eq!(said(&capped[..1]), None, "one is no two");
        let free = [with("pm", "1000000", "160"), with("pm", "1000000", "40")];
        assert_eq!(said(&free), None);
    }
}
