//! What was found, for machines: `cost.csv` with one row a point, `cost.json` with everything, `best.toml` with the chosen setting.

use std::fs;
use std::path::Path;

use serde::Serialize;

use super::campaign::Drift;
use super::fit::{self, PowerLaw};
use super::level::{Goal, Level};
use super::point::{Point, RegionError};
use super::reference::Origin;
use super::sentences::Paragraph;
use super::setting::Setting;
use super::store::Study;
use super::{CostError, store_error};
use crate::params::Params;

/// The columns of `cost.csv`. The first seventeen are a contract; what comes after may grow.
pub const COLUMNS: [&str; 29] = [
    "scene",
    "technique",
    "estimator",
    "photons",
    "foveated_share",
    "radius_m",
    "passes",
    "size",
    "frame_ms",
    "frame_ms_p95",
    "mse_fovea",
    "mse_transition",
    "mse_periphery",
    "relmse_fovea",
    "bias_fovea",
    "mse_temporal_fovea",
    "reuse_share",
    "paths_per_pixel",
    "frame_ms_q25",
    "frame_ms_q75",
    "frames",
    "variance_fovea",
    "relmse_fovea_se",
    "relmse_transition",
    "relmse_periphery",
    "mean_ratio_fovea",
    "on_front",
    "key",
    "changed",
];

/// Everything that a run found. Written as `cost.json`; the page shows the same.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    /// The answer in one sentence.
    pub title: String,
    /// What follows from the points, in words.
    pub sentences: Vec<Paragraph>,
    /// The scene's name.
    pub scene: String,
    /// What all points have in common.
    pub study: Study,
    /// Where the reference comes from.
    pub reference: Origin,
    /// Where the points were measured.
    pub machine: Machine,
    /// How steady it was.
    pub drift: Drift,
    /// Whether everything that was asked for was measured.
    pub complete: bool,
    /// Points that an earlier run had measured.
    pub reused: usize,
    /// Every point.
    pub points: Vec<Point>,
    /// Keys of the points that nothing beats, by rising time.
    pub front: Vec<String>,
    /// Error as a power of time: all points, then each technique.
    pub fits: Vec<Fit>,
    /// The setting chosen for a frame budget.
    pub budget: Option<Budget>,
    /// Techniques at equal errors and equal times.
    pub comparisons: Vec<Comparison>,
    /// What the techniques and the scene warned of.
    pub warnings: Vec<String>,
}

/// Where points were measured.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Machine {
    /// The Vulkan device's name.
    pub device: String,
    /// Its driver.
    pub driver: String,
    /// Whether the device is the processor itself.
    pub is_software: bool,
    /// The processor's name, where the system tells it.
    pub processor: Option<String>,
    /// Threads that it runs at once.
    pub threads: usize,
    /// Operating system and architecture.
    pub system: String,
}

/// A power law and what it is of.
#[derive(Clone, Debug, Serialize)]
pub struct Fit {
    /// Name of the technique; `None`: the front of all points.
    pub technique: Option<String>,
    /// The law.
    #[serde(flatten)]
    pub law: PowerLaw,
    /// How many times the time half the error costs.
    pub price_of_half: f64,
}

/// The setting chosen for a frame budget, as measured after it was chosen.
#[derive(Clone, Debug, Serialize)]
pub struct Budget {
    /// The budget, milliseconds.
    pub budget_ms: f64,
    /// Key of the chosen point.
    pub point: String,
    /// That point in words.
    pub label: String,
    /// Median time of its frames, milliseconds.
    pub frame_ms: f64,
    /// Their 25th percentile, milliseconds.
    pub q25_ms: f64,
    /// Their 75th percentile, milliseconds.
    pub q75_ms: f64,
    /// Its relative mean squared error in the fovea, which was made small.
    pub relmse: f64,
    /// Whether the median lies within the budget.
    pub is_met: bool,
}

impl Budget {
    /// A chosen point beside its budget.
    pub fn new(budget_ms: f64, point: &Point) -> Self {
        Self {
            budget_ms,
            point: point.key.clone(),
            label: point.label(),
            frame_ms: point.frame_ms(),
            q25_ms: point.time.q25_ms,
            q75_ms: point.time.q75_ms,
            relmse: point.relmse(),
            is_met: point.frame_ms() <= budget_ms,
        }
    }
}

/// Techniques at one level.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// The level.
    #[serde(flatten)]
    pub goal: Goal,
    /// Each technique there.
    pub levels: Vec<Level>,
}

/// The fits of some points: of the front of all, and of each technique's own.
pub fn fits(points: &[Point]) -> Vec<Fit> {
    let fit = |technique: Option<&str>| {
        let own = |point: &&Point| technique.is_none_or(|name| point.technique == name);
        let law = PowerLaw::of_front(&fit::front(points.iter().filter(own)))?;
        Some(Fit {
            technique: technique.map(str::to_owned),
            price_of_half: law.price_of_half(),
            law,
        })
    };
    let techniques = fit::techniques(points).into_iter().map(Some);
    std::iter::once(None)
        .chain(techniques)
        .filter_map(fit)
        .collect()
}

impl Outcome {
    /// The budget and its choice, where it was kept when it was measured again.
    pub fn kept_budget(&self) -> Option<&Budget> {
        self.budget.as_ref().filter(|budget| budget.is_met)
    }

    /// The cells of the points, in the order of [`COLUMNS`]; empty where a technique or a picture has no such thing.
    pub fn rows(&self) -> Vec<Vec<String>> {
        let row = |point: &Point| self.row(point);
        self.points.iter().map(row).collect()
    }

    fn row(&self, point: &Point) -> Vec<String> {
        let text = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
        let error = &point.error;
        let of = |region: &Option<RegionError>, pick: fn(&RegionError) -> f64| {
            text(region.as_ref().map(pick))
        };
        let photons = point.photons.map(|photons| photons.to_string());
        let paths = point.photons.is_none().then(|| point.effort.to_string());
        let changed = point.changed.iter();
        let changed: Vec<String> = changed
            .map(|(key, value)| format!("{key}={value}"))
            .collect();
        vec![
            self.scene.clone(),
            point.technique.clone(),
            String::new(),
            photons.unwrap_or_default(),
            String::new(),
            text(point.radius_m),
            point.passes.to_string(),
            point.size.to_string(),
            point.time.median_ms.to_string(),
            point.time.p95_ms.to_string(),
            of(&error.fovea, |region| region.mse),
            of(&error.transition, |region| region.mse),
            of(&error.periphery, |region| region.mse),
            of(&error.fovea, |region| region.relmse),
            of(&error.fovea, RegionError::bias),
            text(error.mse_temporal_fovea),
            String::new(),
            paths.unwrap_or_default(),
            point.time.q25_ms.to_string(),
            point.time.q75_ms.to_string(),
            point.time.frames.to_string(),
            of(&error.fovea, |region| region.variance),
            of(&error.fovea, |region| region.relmse_standard_error),
            of(&error.transition, |region| region.relmse),
            of(&error.periphery, |region| region.relmse),
            text(error.fovea.and_then(|region| region.mean_ratio)),
            u8::from(self.front.contains(&point.key)).to_string(),
            point.key.clone(),
            changed.join(" "),
        ]
    }

    /// Writes `cost.csv` and `cost.json` into a folder.
    ///
    /// # Errors
    /// [`CostError::Store`].
    pub fn write(&self, folder: &Path) -> Result<(), CostError> {
        let csv_path = folder.join("cost.csv");
        let mut writer = csv::Writer::from_writer(Vec::new());
        let rows = std::iter::once(COLUMNS.map(str::to_owned).to_vec()).chain(self.rows());
        let written = rows
            .into_iter()
            .try_for_each(|row| writer.write_record(row))
            .map_err(std::io::Error::from);
        written
            .and_then(|()| writer.into_inner().map_err(|error| error.into_error()))
            .and_then(|bytes| fs::write(&csv_path, bytes))
            .map_err(store_error("write", &csv_path))?;
        let json_path = folder.join("cost.json");
        serde_json::to_vec_pretty(self)
            .map_err(std::io::Error::from)
            .and_then(|json| fs::write(&json_path, json))
            .map_err(store_error("write", &json_path))
    }
}

/// A parameter file that makes a setting's frames: `[run]` holds what is no parameter, then come the parameters that differ from their
/// defaults. `notes` go above it as comments.
pub fn parameter_file(setting: &Setting, gaze_deg: [f64; 2], notes: &[String]) -> String {
    let mut text = String::new();
    for note in notes {
        text += &format!("# {}\n", note.replace(['\n', '\r'], " "));
    }
    text += &format!(
        "\n[run]\ntechnique = \"{}\"\nsize = \"{}\"\npasses = {}\ngaze = \"{},{}\"\n",
        setting.technique, setting.size, setting.passes, gaze_deg[0], gaze_deg[1]
    );
    let changed = setting.changed();
    let mut room = "";
    for knob in Params::knobs() {
        let Some(value) = changed.get(knob.key) else {
            continue;
        };
        let (this_room, name) = knob.key.split_once('.').unwrap_or((knob.key, ""));
        if this_room != room {
            text += &format!("\n[{this_room}]\n");
            room = this_room;
        }
        text += &format!("{name} = {value}\n");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::super::setting::tests::setting;
    use super::*;

    #[test]
    fn a_parameter_file_gives_its_setting_back() {
        let mut setting = setting();
        for (key, value) in [
            ("photons", "1234"),
            ("gather.photons_per_estimate", "12.5"),
            ("direct.shadow_rays", "1"),
        ] {
            setting.set(key, value).unwrap();
        }
        let text = parameter_file(&setting, [5.0, -2.5], &["one\ntwo".into()]);
        assert!(text.starts_with("# one two\n"), "{text}");
        let mut table: toml::Table = text.parse().unwrap();
        let run = table.remove("run").unwrap();
        assert_eq!(run["gaze"].as_str(), Some("5,-2.5"));
        assert_eq!(run["technique"].as_str(), Some("pm-direct"));
        let mut params = Params::default();
        params.set_table(table).unwrap();
        assert_eq!(params, setting.params);
    }
}
