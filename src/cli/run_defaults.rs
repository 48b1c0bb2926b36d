//! The table `[run]` of a parameter file.

use std::num::NonZeroU32;

use toml::{Table, Value};

use super::compare::GazeAngles;
use crate::image::ImageSize;
use crate::params::nearest;
use crate::technique;

/// Name of the table.
pub const RUN_TABLE: &str = "run";
/// What it may hold.
pub const RUN_KEYS: [&str; 4] = ["technique", "size", "passes", "gaze"];

/// The table `[run]` of a parameter file: what its frames are besides parameters. A flag of the command line wins over it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunDefaults {
    /// Name of the technique.
    pub technique: Option<String>,
    /// Pixels of a picture.
    pub size: Option<ImageSize>,
    /// Passes that a picture averages.
    pub passes: Option<NonZeroU32>,
    /// Where the eye looks, `AZ,EL` in degrees.
    pub gaze: Option<GazeAngles>,
}

impl RunDefaults {
    /// Reads the table.
    ///
    /// # Errors
    /// One line that names the key, what was found and what it takes.
    pub fn read(table: Value) -> Result<Self, String> {
        let Value::Table(table) = table else {
            return Err(format!(
                "`{RUN_TABLE} = {table}`: [{RUN_TABLE}] is a table, and takes {}",
                RUN_KEYS.join(", ")
            ));
        };
        if let Some(key) = table.keys().find(|key| !RUN_KEYS.contains(&key.as_str())) {
            let meant = nearest(key, RUN_KEYS)
                .map(|key| format!(" (did you mean `{key}`?)"))
                .unwrap_or_default();
            return Err(format!(
                "there is no `{key}` in [{RUN_TABLE}]{meant}; it takes {}",
                RUN_KEYS.join(", ")
            ));
        }
        Ok(Self {
            technique: entry(&table, "technique", |value| {
                let names = technique::REGISTRY.iter().map(|entry| entry.name);
                let expected =
                    || format!("there are {}, in quotes", Vec::from_iter(names).join(", "));
                let known = value.as_str().and_then(technique::find);
                known.map(|entry| entry.name.into()).ok_or_else(expected)
            })?,
            size: entry(&table, "size", parsed)?,
            passes: entry(&table, "passes", |value| {
                let passes = value.as_integer().and_then(|n| u32::try_from(n).ok());
                passes
                    .and_then(NonZeroU32::new)
                    .ok_or_else(|| format!("a whole number from 1 to {} is taken", u32::MAX))
            })?,
            gaze: entry(&table, "gaze", parsed)?,
        })
    }
}

/// The value of a key, if it is there.
fn entry<T>(
    table: &Table,
    key: &str,
    read: impl FnOnce(&Value) -> Result<T, String>,
) -> Result<Option<T>, String> {
    let Some(value) = table.get(key) else {
        return Ok(None);
    };
    read(value)
        .map(Some)
        .map_err(|expected| format!("`{key} = {value}` in [{RUN_TABLE}]: {expected}"))
}

/// What a text stands for, as the command line would take it.
fn parsed<T: std::str::FromStr<Err = String>>(value: &Value) -> Result<T, String> {
    let text = value.as_str().unwrap_or_default();
    text.parse()
        .map_err(|expected| format!("{expected}, in quotes"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(toml: &str) -> Result<RunDefaults, String> {
        RunDefaults::read(Value::Table(toml.parse().unwrap()))
    }

    #[test]
    fn a_whole_table_is_read_and_an_empty_one_says_nothing() {
        let toml = "technique = \"pm\"\nsize = \"64x32\"\npasses = 3\ngaze = \"5,-2.5\"";
        let run = read(toml).unwrap();
        assert_eq!(run.technique.as_deref(), Some("pm"));
        assert_eq!(run.size, "64x32".parse().ok());
        assert_eq!(run.passes, NonZeroU32::new(3));
        assert_eq!(run.gaze, "5,-2.5".parse().ok());
        assert_eq!(read(""), Ok(RunDefaults::default()));
    }

    #[test]
    fn nonsense_is_refused_with_the_key_what_was_found_and_what_is_expected() {
        for (toml, expected) in [
            ("size = 64", "640x480, in quotes"),
            ("size = \"64\"", "640x480"),
            ("gaze = \"5\"", "AZ,EL"),
            ("gaze = [5, 2]", "AZ,EL"),
            ("passes = 0", "from 1 to"),
            ("passes = -1", "from 1 to"),
            ("passes = 2.5", "from 1 to"),
            ("technique = \"pmm\"", "pm-direct, pm, fpm"),
            ("technique = 3", "pm-direct, pm, fpm"),
        ] {
            let fault = read(toml).unwrap_err();
            assert!(fault.starts_with(&format!("`{toml}`")), "{fault}");
            assert!(fault.contains(expected), "{fault}");
        }
        assert!(read("pases = 3").unwrap_err().contains("`passes`"));
        let no_table = RunDefaults::read(Value::Integer(5)).unwrap_err();
        assert!(no_table.contains("run = 5") && no_table.contains("table"));
    }
}
