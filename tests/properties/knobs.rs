//! Random parameters within the ranges that the knobs themselves declare, so that a new knob joins by itself.

use macula::params::{Knob, Params};
use proptest::prelude::*;

/// Any knob.
pub fn any_knob() -> impl Strategy<Value = Knob> {
    prop::sample::select(Params::knobs())
}

/// A knob's smallest and largest value.
pub fn range(knob: &Knob) -> (f64, f64) {
    let (min, max) = knob.range.split_once("..").unwrap();
    (min.parse().unwrap(), max.parse().unwrap())
}

/// Any value in a knob's range, as text.
pub fn any_value(knob: &Knob) -> BoxedStrategy<String> {
    let (min, max) = range(knob);
    value_between(knob, min, max)
}

/// Any value from `min` to `max`: the ends, evenly between, or evenly in the logarithm.
fn value_between(knob: &Knob, min: f64, max: f64) -> BoxedStrategy<String> {
    let is_whole = knob.default.parse::<u32>().is_ok() && !is_real(knob);
    let even = (0.0..=1.0f64).prop_map(move |share| min + share * (max - min));
    let lowest = min.max(max * 1e-9).max(1e-9);
    let by_size = (0.0..=1.0f64).prop_map(move |share| lowest * (max / lowest).powf(share));
    let value = prop_oneof![1 => Just(min), 1 => Just(max), 3 => even, 3 => by_size];
    value
        .prop_map(move |value| match is_whole {
            true => format!("{}", value.clamp(min, max).round()),
            false => format!("{}", (value as f32).clamp(min as f32, max as f32)),
        })
        .boxed()
}

/// Whether a knob takes numbers between the whole ones.
fn is_real(knob: &Knob) -> bool {
    Params::default()
        .set(knob.key, &format!("{}.0", knob.default))
        .is_ok()
        || knob.default.contains('.')
}

/// Knobs that only cost time beyond a value: they are drawn up to there when pictures are made.
const COSTLY: &[(&str, f64)] = &[
    // A random map has its hard cases when it is small.
    ("photon.count", 3000.0),
    // Every surface of every batch is a submission of its own.
    ("photon.depth_max", 24.0),
    // More of the same rays.
    ("direct.shadow_rays", 4.0),
    ("direct.candidates", 8.0),
    ("path.samples", 2.0),
    ("fovea.samples", 2.0),
    ("fovea.transition_samples", 2.0),
    ("fovea.periphery_samples", 2.0),
];

/// Any parameters that do not contradict each other, for pictures that are made in a moment.
pub fn any_params() -> impl Strategy<Value = Params> {
    let value = |knob: Knob| {
        let (min, max) = range(&knob);
        let cost = COSTLY.iter().find(|(key, _)| *key == knob.key);
        let max = cost.map_or(max, |(_, cap)| max.min(*cap));
        let any = value_between(&knob, min, max);
        let key = knob.key;
        // Half of the knobs keep their default, so that odd values meet usual ones.
        let value = match knob.default.parse::<f64>() {
            Ok(usual) if usual <= max => prop_oneof![any, Just(knob.default)].boxed(),
            _ => any,
        };
        value.prop_map(move |value| (key, value))
    };
    let values: Vec<_> = Params::knobs().into_iter().map(value).collect();
    values.prop_map(|values| {
        let mut params = Params::default();
        for (key, value) in &values {
            params.set(key, value).unwrap();
        }
        without_contradictions(params)
    })
}

/// The parameters with each knob that contradicts another one back at the nearest value that does not.
fn without_contradictions(mut params: Params) -> Params {
    params.fovea.transition_deg = params.fovea.transition_deg.max(params.fovea.radius_deg);
    if matches!(params.gather.coverage_rays, 1 | 2) {
        params.gather.coverage_rays = 3;
    }
    params.checked().unwrap()
}
