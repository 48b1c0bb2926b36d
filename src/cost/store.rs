//! Points on disk: one JSON file each, with a frame beside it, in a folder that says what they were judged by. A run that is started again
//! finds them there.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::point::Point;
use super::setting::Setting;
use super::{CostError, reference, store_error};
use crate::image::{ImageSize, LinearImage, exr};

/// Name of the file that says what a folder's points have in common.
const STUDY_FILE: &str = "study.json";
/// Name of the file of the setting that was chosen for a budget.
pub const BEST_FILE: &str = "best.toml";
/// Name of the file of the anchors' times: how fast the machine was through all runs in a folder.
const ANCHORS_FILE: &str = "anchors.json";
/// Name of the folder of points.
const POINTS_FOLDER: &str = "points";

/// What all points of one folder have in common: points of two different studies can't stand beside each other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Study {
    /// [`MEASUREMENT_VERSION`](super::measure::MEASUREMENT_VERSION) of the program that measured.
    #[serde(default)]
    pub measurement_version: u32,
    /// SHA-256 of the scene file.
    pub scene_sha256: String,
    /// Name of the camera.
    pub camera: String,
    /// Direction of gaze: right, up, degrees.
    pub gaze_deg: [f64; 2],
    /// Where fovea and transition end, degrees.
    pub regions_deg: [f64; 2],
    /// Size of the reference.
    pub reference_size: ImageSize,
    /// SHA-256 of the reference's file; `None`: the oracle makes it.
    pub reference_sha256: Option<String>,
}

impl Study {
    /// In what another study differs; `None` if in nothing.
    pub fn difference(&self, other: &Study) -> Option<&'static str> {
        [
            (
                "what the program measures",
                self.measurement_version == other.measurement_version,
            ),
            ("the scene", self.scene_sha256 == other.scene_sha256),
            ("the camera", self.camera == other.camera),
            ("the gaze", self.gaze_deg == other.gaze_deg),
            ("the regions", self.regions_deg == other.regions_deg),
            (
                "the reference's size",
                self.reference_size == other.reference_size,
            ),
            (
                "the reference",
                self.reference_sha256 == other.reference_sha256,
            ),
        ]
        .into_iter()
        .find_map(|(what, is_same)| (!is_same).then_some(what))
    }

    /// Reads what a folder is for; `None` if nothing was begun in it.
    ///
    /// # Errors
    /// [`CostError::Store`].
    pub fn read(folder: &Path) -> Result<Option<Self>, CostError> {
        read_json(&folder.join(STUDY_FILE))
    }

    /// Reads what a folder holds points of; `None` if it holds none.
    ///
    /// # Errors
    /// [`CostError::Store`].
    pub fn of_points(folder: &Path) -> Result<Option<Self>, CostError> {
        let points = fs::read_dir(folder.join(POINTS_FOLDER));
        let has_points = points.is_ok_and(|mut points| points.next().is_some());
        match has_points {
            true => Self::read(folder),
            false => Ok(None),
        }
    }
}

/// The points of one folder.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    study: Study,
    device: String,
    reference_sha256: String,
}

impl Store {
    /// Opens the store in a folder, for points measured on `device` and judged by the reference of that SHA-256.
    ///
    /// # Errors
    /// [`CostError::Store`].
    pub fn open(
        folder: &Path,
        study: Study,
        device: String,
        reference_sha256: String,
    ) -> Result<Self, CostError> {
        let points = folder.join(POINTS_FOLDER);
        fs::create_dir_all(&points).map_err(store_error("create the folder", &points))?;
        write_json(&folder.join(STUDY_FILE), &study)?;
        Ok(Self {
            folder: folder.into(),
            study,
            device,
            reference_sha256,
        })
    }

    /// What is carried over when a finished folder goes on: everything that [`Store::open`] and a reference need, and what was chosen.
    pub const CARRIED: [&str; 7] = [
        STUDY_FILE,
        ANCHORS_FILE,
        BEST_FILE,
        POINTS_FOLDER,
        reference::PICTURE_FILE,
        reference::STANDARD_ERROR_FILE,
        reference::ORIGIN_FILE,
    ];

    /// The key of a setting: a hash of all that its point depends on.
    pub fn key(&self, setting: &Setting) -> String {
        let mut hasher = Sha256::new();
        let study = serde_json::to_string(&self.study).unwrap_or_default();
        let setting = setting.clone().normalised();
        hasher.update(format!(
            "{study}\n{}\n{}\n{}\n{}\n{}\n{}",
            self.reference_sha256,
            self.device,
            setting.technique,
            setting.size,
            setting.passes,
            setting.params.sha256()
        ));
        let digest = hasher.finalize();
        digest[..8]
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect()
    }

    /// The point of that key, if it was measured before. A file that can't be understood is as good as none.
    ///
    /// # Errors
    /// [`CostError::Store`].
    pub fn find(&self, key: &str) -> Result<Option<Point>, CostError> {
        let point: Option<Point> = read_json(&self.path(key, "json"))?;
        Ok(point.filter(|point| point.key == key && self.path(key, "exr").is_file()))
    }

    /// Keeps a point and its frame.
    ///
    /// # Errors
    /// [`CostError`]: the place can't be written.
    pub fn keep(&self, point: &Point, frame: &LinearImage) -> Result<(), CostError> {
        // The frame first, and under another name until it is whole: so is a point that is there.
        let (path, partial) = (
            self.path(&point.key, "exr"),
            self.path(&point.key, "partial"),
        );
        exr::write(&partial, frame)?;
        fs::rename(&partial, &path).map_err(store_error("write", &path))?;
        write_json(&self.path(&point.key, "json"), point)
    }

    /// How long the frames of the setting of that key took, milliseconds, each time that it was timed as an anchor.
    ///
    /// # Errors
    /// [`CostError::Store`].
    pub fn anchor_ms(&self, key: &str) -> Result<Vec<f64>, CostError> {
        Ok(self.anchors()?.remove(key).unwrap_or_default())
    }

    /// Keeps all times of an anchor.
    ///
    /// # Errors
    /// [`CostError::Store`]: the place can't be written.
    pub fn keep_anchor_ms(&self, key: &str, ms: &[f64]) -> Result<(), CostError> {
        let mut anchors = self.anchors()?;
        anchors.insert(key.into(), ms.into());
        write_json(&self.folder.join(ANCHORS_FILE), &anchors)
    }

    /// Median times of every anchor's frames, milliseconds, in the order of time.
    fn anchors(&self) -> Result<BTreeMap<String, Vec<f64>>, CostError> {
        Ok(read_json(&self.folder.join(ANCHORS_FILE))?.unwrap_or_default())
    }

    /// The frame of a point.
    ///
    /// # Errors
    /// [`CostError::Picture`].
    pub fn frame(&self, key: &str) -> Result<LinearImage, CostError> {
        Ok(exr::read(&self.path(key, "exr"))?)
    }

    fn path(&self, key: &str, extension: &str) -> PathBuf {
        let name = format!("{key}.{extension}");
        self.folder.join(POINTS_FOLDER).join(name)
    }
}

/// Reads a file; `None` if it is not there or can't be understood.
pub(super) fn read_json<T: for<'a> Deserialize<'a>>(path: &Path) -> Result<Option<T>, CostError> {
    if !path.is_file() {
        return Ok(None);
    }
    let bytes = fs::read(path).map_err(store_error("read", path))?;
    Ok(serde_json::from_slice(&bytes).ok())
}

/// Writes a file, under another name first, so that what has its name is whole.
pub(super) fn write_json(path: &Path, value: &impl Serialize) -> Result<(), CostError> {
    let partial = path.with_extension("partial");
    serde_json::to_vec_pretty(value)
        .map_err(std::io::Error::from)
        .and_then(|json| fs::write(&partial, json))
        .and_then(|()| fs::rename(&partial, path))
        .map_err(store_error("write", path))
}

#[cfg(test)]
mod tests {
    use super::super::point::tests::point;
    use super::super::setting::tests::setting;
    use super::*;

    fn study() -> Study {
        Study {
            measurement_version: 0,
            scene_sha256: "abc".into(),
            camera: "viewer".into(),
            gaze_deg: [0.0, 0.0],
            regions_deg: [9.78, 14.78],
            reference_size: "64x64".parse().unwrap(),
            reference_sha256: None,
        }
    }

    fn frame() -> LinearImage {
        LinearImage {
            width: 1,
            height: 1,
            rgb: vec![[1.0, 2.0, 3.0]],
        }
    }

    #[test]
    fn a_point_is_found_again_and_a_torn_one_is_not() {
        let home = tempfile::tempdir().unwrap();
        let store = Store::open(home.path(), study(), "gpu".into(), "reference".into()).unwrap();
        let key = store.key(&setting());
        assert_eq!(store.find(&key).unwrap(), None);
        let kept = Point {
            key: key.clone(),
            ..point("pm", 10.0, 0.1, 0.5)
        };
        store.keep(&kept, &frame()).unwrap();
        assert_eq!(store.find(&key).unwrap(), Some(kept));
        assert_eq!(store.frame(&key).unwrap(), frame());
        fs::write(store.path(&key, "json"), "{\"key\":").unwrap();
        assert_eq!(store.find(&key).unwrap(), None);
    }

    #[test]
    fn a_key_changes_with_all_that_a_point_depends_on_and_with_nothing_else() {
        let home = tempfile::tempdir().unwrap();
        let open = |study, device: &str| {
            Store::open(home.path(), study, device.into(), "reference".into()).unwrap()
        };
        let first = open(study(), "gpu").key(&setting());
        assert_eq!(open(study(), "gpu").key(&setting()), first);
        assert_ne!(open(study(), "other").key(&setting()), first);
        let judged_by_another =
            Store::open(home.path(), study(), "gpu".into(), "another".into()).unwrap();
        assert_ne!(judged_by_another.key(&setting()), first);
        for (key, value) in [
            ("technique", "pm"),
            ("size", "8x8"),
            ("passes", "2"),
            ("photons", "9"),
        ] {
            let mut setting = setting();
            setting.set(key, value).unwrap();
            assert_ne!(open(study(), "gpu").key(&setting), first, "{key}");
        }
        let mut shown_brighter = setting();
        shown_brighter.set("display.exposure_ev", "3").unwrap();
        assert_eq!(open(study(), "gpu").key(&shown_brighter), first);
    }

    #[test]
    fn studies_of_two_scenes_are_told_apart() {
        let home = tempfile::tempdir().unwrap();
        assert_eq!(Study::read(home.path()).unwrap(), None);
        Store::open(home.path(), study(), "gpu".into(), "reference".into()).unwrap();
        let read = Study::read(home.path()).unwrap().unwrap();
        assert_eq!(read.difference(&study()), None);
        let other = Study {
            gaze_deg: [5.0, 0.0],
            ..study()
        };
        assert_eq!(read.difference(&other), Some("the gaze"));
    }
}
