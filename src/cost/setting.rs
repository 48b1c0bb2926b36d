//! What can be varied: the technique, the size, the passes, and every parameter.

use std::collections::{BTreeMap, BTreeSet};

use super::CostError;
use super::point::Point;
use crate::image::ImageSize;
use crate::params::{self, Params};
use crate::technique::{self, TechniqueEntry};

/// Key of the picture's size.
pub const SIZE: &str = "size";

/// Short names of what is varied most, and what they stand for.
pub const SHORT_NAMES: &[(&str, &str)] = &[
    ("photons", "photon.count"),
    ("radius", "gather.radius_m"),
    ("depth", "photon.depth_max"),
    ("resolution", SIZE),
];

/// What is varied besides parameters.
const OTHERS: [&str; 3] = ["technique", SIZE, "passes"];

/// One way to make a frame: the picture of one eye, `passes` passes of a technique.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// Name of the technique.
    pub technique: &'static str,
    /// Pixels of the picture.
    pub size: ImageSize,
    /// Passes that a frame averages.
    pub passes: u32,
    /// Everything else.
    pub params: Params,
}

impl Setting {
    /// The setting that a point was measured with.
    ///
    /// # Errors
    /// [`CostError`]: the point is of a program that knew other keys.
    pub fn of(point: &Point) -> Result<Self, CostError> {
        let mut setting = Self {
            technique: "",
            size: point.size,
            passes: point.passes,
            params: Params::default(),
        };
        setting.set("technique", &point.technique)?;
        for (key, value) in &point.changed {
            setting.set(key, value)?;
        }
        Ok(setting)
    }

    /// Changes one thing, named by its key or its short name.
    ///
    /// # Errors
    /// [`CostError`]: no such key, or a value that it can't have.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), CostError> {
        let bad = |key, expected: String| CostError::BadValue {
            key,
            value: value.into(),
            expected,
        };
        match full_key(key) {
            "technique" => {
                let known = || technique::REGISTRY.iter().map(|entry| entry.name);
                let names = || known().collect::<Vec<_>>().join(", ");
                self.technique = known()
                    .find(|name| *name == value)
                    .ok_or_else(|| bad("technique", format!("there are {}", names())))?;
            }
            SIZE => self.size = value.parse().map_err(|expected| bad(SIZE, expected))?,
            "passes" => {
                let passes = value.parse().ok().filter(|passes| *passes > 0);
                self.passes = passes.ok_or_else(|| bad("passes", "1 or more are taken".into()))?;
            }
            key if Params::knobs().iter().any(|knob| knob.key == key) => {
                self.params.set(key, value)?;
            }
            _ => return Err(unknown(key)),
        }
        Ok(())
    }

    /// The value of a key, as text; `None` for an unknown one.
    pub fn get(&self, key: &str) -> Option<String> {
        match full_key(key) {
            "technique" => Some(self.technique.into()),
            SIZE => Some(self.size.to_string()),
            "passes" => Some(self.passes.to_string()),
            key => {
                let values = self.params.values();
                let found = values.into_iter().find(|(name, _)| *name == key);
                found.map(|(_, value)| value)
            }
        }
    }

    /// The same way to make a frame, with all parameters at their defaults that its technique does not read: settings that differ in
    /// nothing that matters become equal.
    pub fn normalised(mut self) -> Self {
        for knob in Params::knobs() {
            if !reads(self.technique, knob.key) {
                // A knob takes its own default.
                let _ = self.params.set(knob.key, &knob.default);
            }
        }
        self
    }

    /// The parameters that differ from their defaults.
    pub fn changed(&self) -> BTreeMap<String, String> {
        let defaults = Params::default().values();
        let values = self.params.values().into_iter().zip(defaults);
        values
            .filter(|((_, value), (_, default))| value != default)
            .map(|((key, value), _)| (key.to_owned(), value))
            .collect()
    }

    /// The setting in the few words that fit behind a bar.
    pub fn words(&self) -> String {
        let (technique, size, effort) = (self.technique, self.size, self.effort());
        format!("{technique} {size} {effort}")
    }

    /// The key that buys accuracy for time without a bend: how many paths a frame traces.
    pub fn effort_key(&self) -> &'static str {
        technique::find(self.technique).map_or("photon.count", |entry| entry.effort)
    }

    /// The value of [`Setting::effort_key`].
    pub fn effort(&self) -> u32 {
        match self.effort_key() {
            "path.samples" => self.params.path.samples,
            "indirect.paths" => self.params.indirect.paths,
            _ => self.params.photon.count,
        }
    }
}

/// The key that a name stands for.
pub fn full_key(key: &str) -> &str {
    let found = SHORT_NAMES.iter().find(|(short, _)| *short == key);
    found.map_or(key, |(_, full)| full)
}

/// The parameters that all points have in common that read them, of those that differ from their defaults.
pub fn shared(points: &[Point]) -> BTreeMap<String, String> {
    let values: BTreeSet<(&String, &String)> =
        points.iter().flat_map(|point| &point.changed).collect();
    let is_shared = |(key, value): &(&String, &String)| {
        let mut readers = points.iter().filter(|point| reads(&point.technique, key));
        readers.all(|point| point.changed.get(*key) == Some(*value))
    };
    let shared = values.into_iter().filter(is_shared);
    shared
        .map(|(key, value)| (key.clone(), value.clone()))
        .collect()
}

/// Whether a technique's frames depend on a key; those of an unknown one may depend on any.
pub fn reads(technique: &str, key: &str) -> bool {
    let room = key.split('.').next().unwrap_or(key);
    let is_read = |entry: &TechniqueEntry| entry.rooms.contains(&room);
    matches!(room, "technique" | SIZE | "passes" | "random")
        || technique::find(technique).is_none_or(is_read)
}

fn unknown(key: &str) -> CostError {
    let knobs = Params::knobs();
    let shorts = SHORT_NAMES.iter().map(|(short, _)| *short);
    let all = OTHERS.into_iter().chain(shorts);
    let all = all.chain(knobs.iter().map(|knob| knob.key));
    CostError::UnknownKey {
        key: key.into(),
        nearest: params::nearest(key, all).map(str::to_owned),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A setting that tests start from.
    pub(crate) fn setting() -> Setting {
        Setting {
            technique: "pm-direct",
            size: "64x64".parse().unwrap(),
            passes: 1,
            params: Params::default(),
        }
    }

    #[test]
    fn everything_is_set_by_its_key_or_its_short_name() {
        let mut setting = setting();
        for (key, full, value) in [
            ("technique", "technique", "pm"),
            ("resolution", "size", "32x16"),
            ("passes", "passes", "3"),
            ("photons", "photon.count", "1234"),
            ("radius", "gather.radius_m", "0.5"),
            ("direct.shadow_rays", "direct.shadow_rays", "7"),
        ] {
            setting.set(key, value).unwrap();
            assert_eq!(setting.get(full).as_deref(), Some(value), "{key}");
        }
        assert_eq!(setting.changed()["photon.count"], "1234");
        assert_eq!(setting.changed().len(), 3);
    }

    #[test]
    fn a_mistyped_key_is_refused_and_the_nearest_one_named() {
        for (key, meant) in [
            ("photon", "photons"),
            ("tecnique", "technique"),
            ("shadow_rays", "direct.shadow_rays"),
        ] {
            let error = setting().set(key, "1").unwrap_err().to_string();
            assert!(error.contains(&format!("`{meant}`")), "{error}");
        }
        for (key, value, mend) in [
            ("technique", "pmx", "pm-direct"),
            ("size", "64", "640x480"),
            ("passes", "0", "1 or more"),
            ("photons", "many", "a whole number"),
        ] {
            let error = setting().set(key, value).unwrap_err().to_string();
            assert!(error.contains(mend) && error.contains(value), "{error}");
        }
    }

    #[test]
    fn parameters_are_shared_that_every_point_has_that_reads_them() {
        let made = |technique: &str, changed: &[(&str, &str)]| {
            let changed = changed.iter().map(|(k, v)| ((*k).into(), (*v).into()));
            Point {
                changed: changed.collect(),
                ..super::super::point::tests::point(technique, 10.0, 0.1, 0.0)
            }
        };
        let rays = ("direct.shadow_rays", "3");
        let points = [
            made("pm", &[rays, ("photon.depth_max", "6")]),
            made("pm", &[rays, ("photon.depth_max", "3")]),
            made("pm", &[rays]),
            made("path", &[]),
        ];
        assert_eq!(
            shared(&points),
            BTreeMap::from([(rays.0.to_owned(), rays.1.to_owned())])
        );
        let without = [points[0].clone(), made("pm", &[])];
        assert!(shared(&without).is_empty(), "the second has its default");
    }

    #[test]
    fn settings_that_differ_in_nothing_that_their_technique_reads_are_equal() {
        let with = |technique: &str, photons: &str| {
            let mut setting = setting();
            setting.set("technique", technique).unwrap();
            setting.set("photons", photons).unwrap();
            setting.normalised()
        };
        assert_eq!(with("path", "100"), with("path", "200"));
        assert_ne!(with("pm", "100"), with("pm", "200"));
    }
}
