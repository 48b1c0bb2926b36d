//! Parameters: what is in range is kept as given, all else is refused and changes nothing.

use macula::params::{Knob, Params};
use proptest::prelude::*;

use crate::knobs::{any_knob, any_value, range};
use crate::runner::hold;

fn same(one: &Params, other: &Params) -> Result<(), String> {
    (one == other)
        .then_some(())
        .ok_or_else(|| format!("{one:?} is not {other:?}"))
}

#[test]
fn every_value_in_range_is_kept_and_reads_back_as_itself() {
    let inputs = any_knob().prop_flat_map(|knob| any_value(&knob).prop_map(move |v| (knob.key, v)));
    hold("values in range", 400, inputs, |(key, value)| {
        let mut params = Params::default();
        params.set(key, &value).map_err(|error| error.to_string())?;
        let mut again = Params::default();
        for (key, value) in params.values() {
            again.set(key, &value).map_err(|error| error.to_string())?;
        }
        same(&params, &again)?;
        (params.sha256() == again.sha256())
            .then_some(())
            .ok_or("another hash".into())
    });
}

#[test]
fn every_value_out_of_range_is_refused_and_changes_nothing() {
    let beyond = |knob: Knob| {
        let (min, max) = range(&knob);
        let above = (1e-3..1e3f64).prop_map(move |by| max + by * (1.0 + max.abs()));
        let below = (1e-3..1e3f64).prop_map(move |by| min - by * (1.0 + min.abs()));
        let value = prop_oneof![above, below, Just(f64::NAN), Just(f64::INFINITY)];
        value.prop_map(move |value| (knob.key, value.to_string()))
    };
    hold(
        "values out of range",
        300,
        any_knob().prop_flat_map(beyond),
        |(key, value)| {
            let mut params = Params::default();
            let error = params.set(key, &value).err().ok_or("it is accepted")?;
            if !error.to_string().contains(key) {
                return Err(format!("`{error}` does not name {key}"));
            }
            same(&params, &Params::default())
        },
    );
}

#[test]
fn no_text_makes_an_assignment_panic_or_change_what_it_does_not_name() {
    let keys = any_knob().prop_map(|knob| knob.key.to_owned());
    let key = prop_oneof![keys, ".{0,20}"];
    hold("assignments", 400, (key, ".{0,20}"), |(key, value)| {
        let mut params = Params::default();
        let result = params.set_assignment(&format!("{key}={value}"));
        let changed = params.values().into_iter().zip(Params::default().values());
        let changed: Vec<_> = changed.filter(|(new, old)| new != old).collect();
        match result {
            Ok(()) => (changed.len() <= 1)
                .then_some(())
                .ok_or("more than one is changed".into()),
            Err(error) if error.to_string().is_empty() => Err("an error without words".into()),
            Err(_) => changed
                .is_empty()
                .then_some(())
                .ok_or("refused, and changed".into()),
        }
    });
}

#[test]
fn a_file_sets_what_assignments_set() {
    let settings =
        any_knob().prop_flat_map(|knob| any_value(&knob).prop_map(move |v| (knob.key, v)));
    let settings = prop::collection::btree_map(any::<u16>(), settings, 0..8);
    hold("parameter files", 200, settings, |settings| {
        let (mut by_file, mut by_flag) = (Params::default(), Params::default());
        for (key, value) in settings.values() {
            let (room, name) = key.split_once('.').ok_or("a key without a room")?;
            let toml = format!("[{room}]\n{name} = {value}\n");
            by_file.set_toml(&toml).map_err(|error| error.to_string())?;
            by_flag.set(key, value).map_err(|error| error.to_string())?;
        }
        same(&by_file, &by_flag)
    });
}
