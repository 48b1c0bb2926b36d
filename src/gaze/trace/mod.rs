//! The native recording: one folder a session, plain CSV, append-only.
//!
//! `session.json` tells what was recorded; `gaze.csv`, `frames.csv` and `events.csv` hold one line an eye-tracker sample, a
//! display frame and an event. Each line is complete by itself, so a crash costs at most the last one. Columns are found by
//! name, unknown ones are ignored, an empty cell is a missing value.

mod read;
pub(crate) mod table;
mod write;

use std::fmt;
use std::io;
use std::path::PathBuf;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::gaze::{GazeSample, GazeState};
use crate::view::{Pose, View};
pub use read::{MAX_EVENTS, MAX_FRAMES, MAX_GAZE_SAMPLES};
pub use write::SessionWriter;

/// `format` of every `session.json`.
pub const FORMAT: &str = "macula-session";
/// The version of the folder's format that this program reads and writes.
pub const VERSION: u32 = 1;

/// File names in a session folder.
pub mod files {
    /// What was recorded, and with what.
    pub const METADATA: &str = "session.json";
    /// One line an eye-tracker sample.
    pub const GAZE: &str = "gaze.csv";
    /// One line a display frame.
    pub const FRAMES: &str = "frames.csv";
    /// One line an event.
    pub const EVENTS: &str = "events.csv";
}

/// Column name prefixes of the left and the right eye.
const EYE_PREFIXES: [&str; 2] = ["l", "r"];

/// Flag bits of `head_flags`, as `XrSpaceLocationFlagBits` (OpenXR 1.1, section 7.4).
pub mod head_flags {
    /// The orientation is a real one, measured or inferred.
    pub const ORIENTATION_VALID: u32 = 1;
    /// The position is a real one, measured or inferred.
    pub const POSITION_VALID: u32 = 2;
    /// The orientation was measured.
    pub const ORIENTATION_TRACKED: u32 = 4;
    /// The position was measured.
    pub const POSITION_TRACKED: u32 = 8;
    /// Orientation and position are valid.
    pub const VALID: u32 = ORIENTATION_VALID | POSITION_VALID;
    /// Orientation and position are valid and tracked.
    pub const TRACKED: u32 = VALID | ORIENTATION_TRACKED | POSITION_TRACKED;
}

/// A recorded session, whole in memory.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Session {
    /// What was recorded, and with what.
    pub metadata: Metadata,
    /// Eye-tracker samples, times strictly increasing.
    pub gaze: Vec<GazeSample>,
    /// Display frames, times strictly increasing.
    pub frames: Vec<FrameRecord>,
    /// Events, times not decreasing.
    pub events: Vec<EventRecord>,
    /// What the reader or importer dropped or doubts, one sentence each.
    pub warnings: Vec<String>,
}

/// `session.json`, without its format and version.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Metadata {
    /// Short name of the session.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Where the data come from: a headset, a synthesiser, another program's file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// Program and version that wrote the folder.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub software: Option<String>,
    /// Headset and eye tracker.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub device: Option<String>,
    /// OpenXR runtime and version.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub runtime: Option<String>,
    /// Pairs that tie `XrTime` to the calendar, at the start and the end.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub clock: Vec<ClockPair>,
    /// SHA-256 of the parameters, hexadecimal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub params_sha256: Option<String>,
    /// Seed of everything random in the session.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// Whether the wearer agreed to the recording; `None` where nobody is recorded or nobody knows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub consent: Option<bool>,
    /// What a reader of the data must know.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

/// One moment on both clocks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClockPair {
    /// Nanoseconds of `XrTime`.
    pub time_ns: i64,
    /// The same moment in UTC, RFC 3339.
    pub utc: String,
}

/// One line of `frames.csv`: what a frame was drawn for. Enough to replay it.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameRecord {
    /// Number of the frame in its session.
    pub frame: u64,
    /// Number of the study trial that the frame belongs to.
    pub trial: Option<u32>,
    /// When the frame is shown, nanoseconds of `XrTime`.
    pub predicted_display_ns: i64,
    /// Time to the next frame, nanoseconds.
    pub period_ns: Option<i64>,
    /// Pose of the head (VIEW) in LOCAL space at the display time; `None` while the runtime knows none.
    pub local_from_head: Option<Pose>,
    /// [`head_flags`] bits.
    pub head_flags: u32,
    /// Left and right eye; poses in VIEW space.
    pub head_from_eyes: [View; 2],
    /// Where the wearer looked, as the application used it.
    pub gaze: Option<FrameGaze>,
    /// Time that the processor took, milliseconds.
    pub cpu_ms: Option<f32>,
    /// Time that the graphics device took, milliseconds.
    pub gpu_ms: Option<f32>,
    /// Display periods that went by without a new picture before this frame.
    pub missed: Option<u32>,
}

/// The gaze that a frame was drawn with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameGaze {
    /// Time of the sample behind it, nanoseconds of `XrTime`; `None` for a fallback.
    pub sample_time_ns: Option<i64>,
    /// Unit direction in VIEW space.
    pub dir_in_view: glam::Vec3,
    /// How the direction came about.
    pub state: GazeState,
}

/// One line of `events.csv`.
#[derive(Clone, Debug, PartialEq)]
pub struct EventRecord {
    /// When it happened, nanoseconds of `XrTime`.
    pub time_ns: i64,
    /// What happened, e.g. `button`.
    pub event: String,
    /// Number of the study trial in which it happened.
    pub trial: Option<u32>,
    /// More about it, e.g. `select_right down`.
    pub value: String,
}

impl Session {
    /// Time from the first frame (or sample, without frames) to the last, nanoseconds.
    pub fn duration_ns(&self) -> i64 {
        let frames = self.frames.first().zip(self.frames.last());
        let samples = self.gaze.first().zip(self.gaze.last());
        let span = frames
            .map(|(first, last)| last.predicted_display_ns - first.predicted_display_ns)
            .or(samples.map(|(first, last)| last.time_ns - first.time_ns));
        span.unwrap_or(0)
    }

    /// The newest sample that was taken at or before `time_ns`.
    pub fn gaze_at(&self, time_ns: i64) -> Option<&GazeSample> {
        let newer = self
            .gaze
            .partition_point(|sample| sample.time_ns <= time_ns);
        self.gaze[..newer].last()
    }

    /// The head in LOCAL space at `time_ns`, interpolated between frames (rotation along the shortest arc) and held
    /// beyond the first and the last; `None` if no frame around that time knows a head pose.
    pub fn local_from_head_at(&self, time_ns: i64) -> Option<Pose> {
        let later = self
            .frames
            .partition_point(|frame| frame.predicted_display_ns <= time_ns);
        let (before, after) = match (later.checked_sub(1), self.frames.get(later)) {
            (None, None) => return None,
            (None, Some(only)) => return only.local_from_head,
            (Some(index), None) => return self.frames[index].local_from_head,
            (Some(index), Some(after)) => (&self.frames[index], after),
        };
        let (from, to) = (before.local_from_head?, after.local_from_head?);
        let span_ns = after.predicted_display_ns - before.predicted_display_ns;
        let share = (time_ns - before.predicted_display_ns) as f64 / span_ns as f64;
        Some(interpolate(from, to, share as f32))
    }
}

/// The pose a `share` (0 to 1) of the way from one pose to another.
pub(crate) fn interpolate(from: Pose, to: Pose, share: f32) -> Pose {
    Pose {
        orientation: from.orientation.slerp(to.orientation, share).normalize(),
        position_m: from.position_m.lerp(to.position_m, share),
    }
}

impl fmt::Display for GazeState {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Tracked => "tracked",
            Self::Held => "held",
            Self::Predicted => "predicted",
            Self::Fallback => "fallback",
            Self::Replay => "replay",
        })
    }
}

impl FromStr for GazeState {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        Self::ALL
            .into_iter()
            .find(|state| state.to_string() == text)
            .ok_or(())
    }
}

/// Why a session folder, or a file to import, can't be read or written.
#[derive(Debug, thiserror::Error)]
pub enum TraceError {
    /// The folder is missing, or is none.
    #[error(
        "{path} is no session folder: {reason}; the bundled assets/sessions/natural-look is one"
    )]
    NotASession {
        /// The folder.
        path: PathBuf,
        /// What is wrong with it, and the mend.
        reason: String,
    },
    /// `session.json` can't be understood.
    #[error("{file} is damaged: {reason}")]
    Metadata {
        /// The file.
        file: String,
        /// What is wrong with it.
        reason: String,
    },
    /// The system refused to read.
    #[error("can't read {file}: check that it exists and may be read")]
    Read {
        /// The file.
        file: String,
        /// What the system said.
        source: io::Error,
    },
    /// The system refused to write.
    #[error("can't write {file}")]
    Write {
        /// The file.
        file: String,
        /// What the system said.
        source: io::Error,
    },
    /// A table lacks a column.
    #[error("{file} has no column `{column}`; its first line must name the columns")]
    MissingColumn {
        /// The file.
        file: String,
        /// The column.
        column: String,
    },
    /// A row has more or fewer cells than the header.
    #[error(
        "{file}, line {line} has {found} cells where the first line names {expected} columns; mend or delete the line"
    )]
    CellCount {
        /// The file.
        file: String,
        /// Counted from 1.
        line: u64,
        /// Columns of the header.
        expected: usize,
        /// Cells of the row.
        found: usize,
    },
    /// A cell holds something else than its column should.
    #[error("{file}, line {line}, column {column}: `{text}` {problem}")]
    Cell {
        /// The file.
        file: String,
        /// Counted from 1.
        line: u64,
        /// The column.
        column: String,
        /// The cell's first 40 characters.
        text: String,
        /// What is wrong with it, and the mend.
        problem: String,
    },
    /// A line is not UTF-8.
    #[error("{file}, line {line} is no text (UTF-8); delete the line, or save the file as UTF-8")]
    NotText {
        /// The file.
        file: String,
        /// Counted from 1.
        line: u64,
    },
    /// A line is far longer than any row can be.
    #[error(
        "{file}, line {line} is longer than {limit_bytes} bytes; this is no table of this format"
    )]
    LineTooLong {
        /// The file.
        file: String,
        /// Counted from 1.
        line: u64,
        /// The limit.
        limit_bytes: u64,
    },
    /// A file has more rows than memory is set aside for.
    #[error("{file} has more than {limit} rows; split the recording")]
    TooManyRows {
        /// The file.
        file: String,
        /// The limit.
        limit: usize,
    },
    /// A file to import holds nothing that could be replayed.
    #[error("{file} can't be used: {reason}")]
    Unusable {
        /// The file.
        file: String,
        /// Why not, and the mend.
        reason: String,
    },
}
