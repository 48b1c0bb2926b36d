//! Other programs' recordings, turned into sessions. One file a format.

mod clock;
pub(crate) mod head;
mod sranipal;

use std::fmt;
use std::fs::File;
use std::io::{BufRead, BufReader, Seek};
use std::path::Path;
use std::str::FromStr;

use serde::Serialize;

use super::summary::Summary;
use super::trace::{Session, TraceError};

/// A format that can be imported.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// HTC SRanipal script CSV (Vive Pro Eye).
    Sranipal,
}

impl Format {
    /// Every format.
    pub const ALL: [Self; 1] = [Self::Sranipal];

    /// Its name, and what its header holds.
    fn described(self) -> String {
        format!("{self}, a CSV with the columns {}", self.marks().join(", "))
    }

    /// Columns that only this format has together.
    fn marks(self) -> &'static [&'static str] {
        match self {
            Self::Sranipal => &["time(100ns)", "eye_valid_L", "gaze_direct_L.x"],
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Sranipal => "sranipal",
        })
    }
}

impl FromStr for Format {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let known = Self::ALL.map(|format| format.to_string()).join(", ");
        Self::ALL
            .into_iter()
            .find(|format| format.to_string() == text)
            .ok_or_else(|| format!("`{text}` is no format that can be imported; known: {known}"))
    }
}

/// An imported recording.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The session, with its warnings; ready to be saved.
    pub session: Session,
    /// What the import found.
    pub report: ImportReport,
}

/// What an import found in its file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ImportReport {
    /// The file's format.
    pub format: Format,
    /// Data lines read, damaged ones included.
    pub lines: usize,
    /// Damaged lines that were left out.
    pub damaged_lines: usize,
    /// What is wrong with the first of them.
    pub damage: Vec<String>,
    /// Lines that repeat the sample before, left out.
    pub repeated_lines: usize,
    /// What the session holds.
    pub summary: Summary,
    /// What to know before using it.
    pub warnings: Vec<String>,
}

/// Imports a file; without a `format` its header tells.
///
/// # Errors
/// A file that can't be read, is of no known format, or holds nothing that could be replayed.
pub fn import(path: &Path, format: Option<Format>) -> Result<Imported, TraceError> {
    let file = path.display().to_string();
    let read_error = |source| TraceError::Read {
        file: file.clone(),
        source,
    };
    if path.is_dir() {
        return Err(TraceError::Unusable {
            file,
            reason: "it is a folder; give the recording's own file".into(),
        });
    }
    let mut reader = BufReader::new(File::open(path).map_err(read_error)?);
    let format = match format {
        Some(format) => format,
        None => {
            let format = detect(&mut reader).map_err(read_error)?;
            reader.rewind().map_err(read_error)?;
            format.ok_or_else(|| TraceError::Unusable {
                file: file.clone(),
                reason: format!(
                    "its first line is the header of no known format; known: {}",
                    Format::ALL.map(Format::described).join("; ")
                ),
            })?
        }
    };
    match format {
        Format::Sranipal => sranipal::import(&file, reader),
    }
}

/// The format that a file's first line belongs to.
fn detect(reader: impl BufRead) -> std::io::Result<Option<Format>> {
    let mut header = Vec::new();
    reader.take(1 << 16).read_until(b'\n', &mut header)?;
    let header = String::from_utf8_lossy(&header);
    let is = |format: &Format| format.marks().iter().all(|mark| header.contains(mark));
    Ok(Format::ALL.into_iter().find(is))
}
