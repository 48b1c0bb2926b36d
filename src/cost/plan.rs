//! Which settings a sweep tries: every combination of the values that are given.

use super::CostError;
use super::setting::{Setting, full_key};
use crate::technique;

/// Most settings of one sweep.
pub const MAX_POINTS: usize = 10_000;

/// Photons of the sweep that is made when none is asked for.
const DEFAULT_PHOTONS: &str = "1000..64000*4";
/// Photons an estimate in it: the default, and a soft gather.
const DEFAULT_PER_ESTIMATE: &str = "40,160";
/// Paths a pixel or sample in it.
const DEFAULT_PATHS: &str = "1..16*4";

/// One thing that is varied, and its values.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Key, as [`Setting::set`] takes it.
    pub key: String,
    /// Values, as text.
    pub values: Vec<String>,
}

impl Axis {
    /// Reads `KEY=V1,V2,..`; a value may be a range `FROM..TO*FACTOR`, which stands for FROM, FROM*FACTOR, .. up to TO.
    ///
    /// # Errors
    /// [`CostError::NotASweep`].
    pub fn parse(text: &str) -> Result<Self, CostError> {
        let not_a_sweep = || CostError::NotASweep(text.into());
        let (key, values) = text.split_once('=').ok_or_else(not_a_sweep)?;
        let mut axis = Self {
            key: full_key(key.trim()).to_owned(),
            values: Vec::new(),
        };
        for value in values.split(',').map(str::trim) {
            match value.split_once("..") {
                Some((from, rest)) => axis
                    .values
                    .extend(range(from, rest).ok_or_else(not_a_sweep)?),
                None if value.is_empty() => return Err(not_a_sweep()),
                None => axis.values.push(value.to_owned()),
            }
        }
        Ok(axis)
    }
}

/// The values of `FROM..TO*FACTOR`.
fn range(from: &str, rest: &str) -> Option<Vec<String>> {
    /// No range needs more.
    const MAX_STEPS: usize = 64;
    let (to, factor) = rest.split_once('*')?;
    let number = |text: &str| text.trim().replace('_', "").parse::<f64>().ok();
    let (from, to, factor) = (number(from)?, number(to)?, number(factor)?);
    if !(from > 0.0 && to >= from && to.is_finite() && factor > 1.0) {
        return None;
    }
    let values = std::iter::successors(Some(from), |value| Some(value * factor));
    let values = values.take_while(|value| *value <= to * (1.0 + 1e-9));
    let values: Vec<String> = values
        .take(MAX_STEPS + 1)
        .map(|value| value.to_string())
        .collect();
    (values.len() <= MAX_STEPS).then_some(values)
}

/// Every combination of the axes' values, upon `base`; combinations that differ in nothing that their technique reads are one.
///
/// # Errors
/// [`CostError`]: a key twice, unknown or with a value that it can't have; too many combinations.
pub fn factorial(base: &Setting, axes: &[Axis]) -> Result<Vec<Setting>, CostError> {
    let lengths = axes.iter().map(|axis| axis.values.len());
    let count = lengths.fold(1, usize::saturating_mul);
    if count > MAX_POINTS {
        return Err(CostError::TooManyPoints(count));
    }
    let mut settings = vec![base.clone()];
    for (place, axis) in axes.iter().enumerate() {
        if axes[..place].iter().any(|other| other.key == axis.key) {
            return Err(CostError::SweptTwice(axis.key.clone()));
        }
        let mut grown = Vec::with_capacity(settings.len() * axis.values.len());
        for setting in &settings {
            for value in &axis.values {
                let mut setting = setting.clone();
                setting.set(&axis.key, value)?;
                grown.push(setting);
            }
        }
        settings = grown;
    }
    let mut distinct: Vec<Setting> = Vec::new();
    for setting in settings {
        setting.params.clone().checked()?;
        let setting = setting.normalised();
        if !distinct.contains(&setting) {
            distinct.push(setting);
        }
    }
    Ok(distinct)
}

/// The sweep that is made when none is asked for: every technique, from few paths to many, and for those that gather photons a sharp and
/// a soft estimate. It shows where noise ends and blur begins, and what a technique is worth beside another.
///
/// # Errors
/// As for [`factorial`].
pub fn default_plan(base: &Setting) -> Result<Vec<Setting>, CostError> {
    let mut settings = Vec::new();
    for entry in technique::REGISTRY {
        let mut base = base.clone();
        base.technique = entry.name;
        let axes: &[&str] = match entry.has_photons {
            false => &[DEFAULT_PATHS],
            true => &[DEFAULT_PHOTONS, DEFAULT_PER_ESTIMATE],
        };
        let keys = [base.effort_key(), "gather.photons_per_estimate"];
        let axes: Vec<Axis> = keys
            .iter()
            .zip(axes)
            .map(|(key, values)| Axis::parse(&format!("{key}={values}")))
            .collect::<Result<_, _>>()?;
        settings.extend(factorial(&base, &axes)?);
    }
    Ok(settings)
}

#[cfg(test)]
mod tests {
    use super::super::setting::tests::setting;
    use super::*;

    fn axes(texts: &[&str]) -> Vec<Axis> {
        let parsed = texts.iter().map(|text| Axis::parse(text));
        parsed.collect::<Result<_, _>>().unwrap()
    }

    #[test]
    fn a_sweep_is_every_combination_of_its_values() {
        let plan = factorial(
            &setting(),
            &axes(&["photons=100,200,400", "size=8x8,16x16"]),
        );
        let plan = plan.unwrap();
        assert_eq!(plan.len(), 6);
        let pairs: Vec<_> = plan
            .iter()
            .map(|s| (s.params.photon.count, s.size.width))
            .collect();
        assert!(pairs.contains(&(400, 16)) && pairs[0] == (100, 8));
    }

    #[test]
    fn a_range_grows_by_its_factor_and_holds_both_ends() {
        assert_eq!(
            Axis::parse("photons=100..1600*4").unwrap().values,
            ["100", "400", "1600"]
        );
        assert_eq!(
            Axis::parse("radius=0.5, 1..3*2").unwrap().values,
            ["0.5", "1", "2"]
        );
        for bad in [
            "photons",
            "photons=",
            "photons=1,,2",
            "photons=1..9",
            "photons=9..1*2",
            "photons=1..9*1",
            "photons=1..64000000*1.1",
        ] {
            assert!(Axis::parse(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_key_is_swept_once_and_its_values_are_checked() {
        let refused = |texts: &[&str]| factorial(&setting(), &axes(texts)).unwrap_err().to_string();
        let twice = refused(&["photons=1,2", "photon.count=3"]);
        assert!(
            twice.contains("photon.count") && twice.contains("twice"),
            "{twice}"
        );
        assert!(refused(&["gather.coverage_rays=2"]).contains("coverage_rays"));
        let many = refused(&[
            "photons=1..16000000*1.3",
            "depth=1..128*1.1",
            "passes=1,2,3,4,5",
        ]);
        assert!(many.contains("10000"), "{many}");
    }

    #[test]
    fn what_a_technique_does_not_read_is_not_swept_for_it() {
        let axes = axes(&["technique=pm,path", "photons=100,200,400"]);
        assert_eq!(factorial(&setting(), &axes).unwrap().len(), 4);
        let plan = default_plan(&setting()).unwrap();
        let of = |name: &str| plan.iter().filter(|s| s.technique == name).count();
        assert_eq!(["pm", "pm-direct", "fpm"].map(of), [8; 3]);
        assert_eq!(["path", "path-filtered"].map(of), [3; 2]);
    }
}
