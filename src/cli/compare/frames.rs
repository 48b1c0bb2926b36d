//! The frames of a sequence: which files there are, for which eye, in which order, and where the eyes looked.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use crate::cli::CliError;
use crate::cli::eye_columns::{self, EYE_NAMES};
use crate::metrics::region::EyeView;

/// The table that a replay leaves beside its pictures.
const TABLE: &str = "frames.csv";
/// The folder of pictures in a replay's output.
const PICTURES: &str = "frames";

/// A folder of EXR frames.
pub struct FrameFolder {
    /// Where the frames lie.
    pub pictures: PathBuf,
    /// File names of the frames, without the standard errors among them.
    names: BTreeSet<String>,
    /// Where the eyes looked by number of the frame, left and right; empty where nothing tells it.
    views: BTreeMap<u64, [EyeView; 2]>,
}

/// One moment of a sequence.
#[derive(Debug, PartialEq, Eq)]
pub struct Moment {
    /// The file of the left eye and of the right; of frames that name no eye, the first.
    pub files: [Option<String>; 2],
    /// The number of the frame, where its name is one.
    number: Option<u64>,
}

impl FrameFolder {
    /// Looks into a folder of frames, or into a replay's output.
    ///
    /// # Errors
    /// The folder cannot be read or holds no EXR frame; its `frames.csv` is damaged.
    pub fn open(folder: &Path) -> Result<Self, CliError> {
        let inner = folder.join(PICTURES);
        let (pictures, table) = if inner.is_dir() {
            (inner, Some(folder.join(TABLE)))
        } else {
            let is_inner = folder.file_name().is_some_and(|name| name == PICTURES);
            let above = folder.parent().filter(|_| is_inner);
            (folder.to_owned(), above.map(|above| above.join(TABLE)))
        };
        let failed =
            |error| CliError::because(format!("cannot look into {}", pictures.display()), error);
        let mut names = BTreeSet::new();
        for entry in fs::read_dir(&pictures).map_err(failed)? {
            // A name that is not Unicode is no frame's.
            if let Ok(name) = entry.map_err(failed)?.file_name().into_string()
                && name.ends_with(".exr")
                && !name.ends_with(".se.exr")
            {
                names.insert(name);
            }
        }
        if names.is_empty() {
            return Err(CliError::new(format!(
                "{} holds no EXR frame; `macula replay --capture exr` writes them",
                pictures.display()
            )));
        }
        let views = match table.filter(|table| table.is_file()) {
            Some(table) => read_views(&table)?,
            None => BTreeMap::new(),
        };
        Ok(Self {
            pictures,
            names,
            views,
        })
    }

    /// That both folders hold frames of the same names.
    ///
    /// # Errors
    /// One that only one of them has.
    pub fn check_same_names(&self, other: &Self) -> Result<(), CliError> {
        for (has, lacks) in [(self, other), (other, self)] {
            if let Some(name) = has.names.difference(&lacks.names).next() {
                return Err(CliError::new(format!(
                    "{} is in {} but not in {}; give folders with frames of the same names",
                    name,
                    has.pictures.display(),
                    lacks.pictures.display()
                )));
            }
        }
        Ok(())
    }

    /// How many files the frames are.
    pub fn len(&self) -> usize {
        self.names.len()
    }

    /// The moments in their order: by name, shorter names first, so that 10 comes after 9. Frames are of two eyes if every name begins with
    /// `left_` or `right_`.
    pub fn moments(&self) -> Vec<Moment> {
        let split = |name: &str| -> Option<(usize, String)> {
            let eye = |eye: usize| name.strip_prefix(EYE_NAMES[eye])?.strip_prefix('_');
            let found = |at: usize| eye(at).map(|rest| (at, rest.to_owned()));
            found(0).or_else(|| found(1))
        };
        let of_two_eyes = self.names.iter().all(|name| split(name).is_some());
        let mut moments: BTreeMap<(usize, String), [Option<String>; 2]> = BTreeMap::new();
        for name in &self.names {
            let (eye, key) = split(name)
                .filter(|_| of_two_eyes)
                .unwrap_or((0, name.clone()));
            moments.entry((key.len(), key)).or_default()[eye] = Some(name.clone());
        }
        let number = |key: &str| key.strip_suffix(".exr")?.parse().ok();
        moments
            .into_iter()
            .map(|((_, key), files)| Moment {
                files,
                number: number(&key),
            })
            .collect()
    }

    /// Where this eye looked, if the folder's table tells it.
    pub fn view(&self, moment: &Moment, eye: usize) -> Option<EyeView> {
        Some(self.views.get(&moment.number?)?[eye])
    }

    /// Whether the table tells where the eyes looked.
    pub fn knows_views(&self) -> bool {
        !self.views.is_empty()
    }
}

/// The views of a replay's table, by number of the frame; none if it has no columns for them.
fn read_views(table: &Path) -> Result<BTreeMap<u64, [EyeView; 2]>, CliError> {
    let failed = |error| CliError::because(format!("cannot read {}", table.display()), error);
    let mut reader = csv::Reader::from_path(table).map_err(failed)?;
    let header = reader.headers().map_err(failed)?.clone();
    let column = |name: &str| header.iter().position(|column| column == name);
    let columns = |eye: usize| -> Option<Vec<usize>> {
        eye_columns::names(eye)
            .iter()
            .map(|name| column(name))
            .collect()
    };
    let (Some(frame), Some(left), Some(right)) = (column("frame"), columns(0), columns(1)) else {
        return Ok(BTreeMap::new());
    };
    let mut views = BTreeMap::new();
    for (row, record) in reader.records().enumerate() {
        let record = record.map_err(failed)?;
        let view = |columns: &[usize]| -> Option<EyeView> {
            let mut values = [0.0; 6];
            for (value, &column) in values.iter_mut().zip(columns) {
                *value = record.get(column)?.parse().ok()?;
            }
            eye_columns::view(values)
        };
        let number = record.get(frame).and_then(|cell| cell.parse().ok());
        let (Some(number), Some(left), Some(right)) = (number, view(&left), view(&right)) else {
            return Err(CliError::new(format!(
                "{}: row {} tells no gaze and field of view of both eyes; give the folder of pictures without it, or a whole replay",
                table.display(),
                row + 1
            )));
        };
        views.insert(number, [left, right]);
    }
    Ok(views)
}
