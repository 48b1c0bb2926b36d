//! Reading a session folder: strict about what it says, lenient only about a last line that a crash cut off.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use serde::Deserialize;

use super::table::{Column, Row, Table};
use super::{
    EYE_PREFIXES, EventRecord, FORMAT, FrameGaze, FrameRecord, Metadata, Session, TraceError,
    VERSION, files, head_flags,
};
use crate::gaze::{EyeSample, GazeRay, GazeSample};
use crate::view::{Fov, Pose, View};

/// Most samples that `gaze.csv` may hold: 2 h 46 min at 200 Hz, 300 MB in memory.
pub const MAX_GAZE_SAMPLES: usize = 2_000_000;
/// Most frames that `frames.csv` may hold: 3 h at 90 Hz, 250 MB in memory.
pub const MAX_FRAMES: usize = 1_000_000;
/// Most events that `events.csv` may hold.
pub const MAX_EVENTS: usize = 200_000;

/// Largest `session.json` that is read.
const MAX_METADATA_BYTES: u64 = 1 << 20;

#[derive(Deserialize)]
struct Envelope {
    format: String,
    version: u32,
    #[serde(flatten)]
    metadata: Metadata,
}

impl Session {
    /// Reads a session folder. `events.csv` may be missing.
    ///
    /// # Errors
    /// A missing folder or file, and any line that says something impossible, with file, line, column and the mend.
    pub fn open(folder: &Path) -> Result<Self, TraceError> {
        if !folder.is_dir() {
            let reason = match folder.exists() {
                true => "it is a file; give the folder that holds session.json",
                false => "there is no such folder",
            };
            return Err(not_a_session(folder, reason));
        }
        let mut session = Session {
            metadata: read_metadata(folder)?,
            ..Self::default()
        };
        let warnings = &mut session.warnings;
        session.gaze = read_table(
            folder,
            files::GAZE,
            MAX_GAZE_SAMPLES,
            warnings,
            GazeColumns::find,
        )?;
        session.frames = read_table(
            folder,
            files::FRAMES,
            MAX_FRAMES,
            warnings,
            FrameColumns::find,
        )?;
        if folder.join(files::EVENTS).exists() {
            session.events = read_table(
                folder,
                files::EVENTS,
                MAX_EVENTS,
                warnings,
                EventColumns::find,
            )?;
        }
        if session.frames.is_empty() {
            session.warnings.push(format!(
                "{} holds no frame, so there is nothing to replay",
                files::FRAMES
            ));
        }
        if session.gaze.is_empty() {
            session
                .warnings
                .push(format!("{} holds no sample", files::GAZE));
        }
        Ok(session)
    }
}

fn not_a_session(folder: &Path, reason: impl Into<String>) -> TraceError {
    TraceError::NotASession {
        path: folder.to_owned(),
        reason: reason.into(),
    }
}

fn open_file(folder: &Path, name: &str) -> Result<File, TraceError> {
    let path = folder.join(name);
    File::open(&path).map_err(|source| match source.kind() {
        std::io::ErrorKind::NotFound => not_a_session(
            folder,
            format!(
                "{name} is missing; a session holds {}, {} and {}",
                files::METADATA,
                files::GAZE,
                files::FRAMES
            ),
        ),
        _ => TraceError::Read {
            file: path.display().to_string(),
            source,
        },
    })
}

fn read_metadata(folder: &Path) -> Result<Metadata, TraceError> {
    let file = folder.join(files::METADATA).display().to_string();
    let mut text = Vec::new();
    open_file(folder, files::METADATA)?
        .take(MAX_METADATA_BYTES + 1)
        .read_to_end(&mut text)
        .map_err(|source| TraceError::Read {
            file: file.clone(),
            source,
        })?;
    let damaged = |reason: String| TraceError::Metadata {
        file: file.clone(),
        reason,
    };
    if text.len() as u64 > MAX_METADATA_BYTES {
        return Err(damaged(format!(
            "it is larger than {MAX_METADATA_BYTES} bytes"
        )));
    }
    let envelope: Envelope =
        serde_json::from_slice(&text).map_err(|error| damaged(error.to_string()))?;
    if envelope.format != FORMAT {
        return Err(damaged(format!(
            "its format is `{}`, not `{FORMAT}`",
            envelope.format
        )));
    }
    if envelope.version != VERSION {
        return Err(damaged(format!(
            "its version is {}, and this program reads version {VERSION}; use the program that wrote it, or a newer one",
            envelope.version
        )));
    }
    Ok(envelope.metadata)
}

/// The columns of one kind of table, found once, and how a row becomes a record.
trait Columns {
    type Record;
    fn record(&self, row: &Row<'_>) -> Result<Self::Record, TraceError>;
    fn time_column(&self) -> Column;
    fn time_ns(record: &Self::Record) -> i64;
    /// Whether two records may have the same time.
    const SHARES_TIMES: bool = false;
}

fn read_table<C: Columns>(
    folder: &Path,
    name: &str,
    limit: usize,
    warnings: &mut Vec<String>,
    find: impl FnOnce(&Table<BufReader<File>>) -> Result<C, TraceError>,
) -> Result<Vec<C::Record>, TraceError> {
    let file = folder.join(name).display().to_string();
    let reader = BufReader::new(open_file(folder, name)?);
    let Some(mut table) = Table::open(file.clone(), b',', reader)? else {
        warnings.push(format!(
            "{name} ends before its first line is complete; it holds nothing"
        ));
        return Ok(Vec::new());
    };
    let columns = find(&table)?;
    let mut records: Vec<C::Record> = Vec::new();
    while let Some(row) = table.next_row()? {
        if records.len() == limit {
            return Err(TraceError::TooManyRows { file, limit });
        }
        let record = columns.record(&row)?;
        if let Some(previous) = records.last() {
            let step_ns = C::time_ns(&record) - C::time_ns(previous);
            if step_ns < 0 || (step_ns == 0 && !C::SHARES_TIMES) {
                return Err(row.problem(
                    columns.time_column(),
                    format!("is not later than {} in the row before; sort the rows by time, without repeats", C::time_ns(previous)),
                ));
            }
        }
        records.push(record);
    }
    if table.was_cut() {
        warnings.push(format!(
            "{name}, line {}: the last line was cut off and is dropped; the recording ended without closing the file",
            table.line_number()
        ));
    }
    Ok(records)
}

fn columns<R: std::io::BufRead, const N: usize>(
    table: &Table<R>,
    prefix: &str,
    names: [&str; N],
) -> Result<[Column; N], TraceError> {
    let mut found = [table.optional(""); N];
    for (column, name) in found.iter_mut().zip(names) {
        *column = table.column(&format!("{prefix}{name}"))?;
    }
    Ok(found)
}

struct GazeColumns {
    time: Column,
    recv: Column,
    valid: Column,
    origin: [Column; 3],
    dir: [Column; 3],
    confidence: Column,
    eyes: [EyeColumns; 2],
}

struct EyeColumns {
    valid: Column,
    origin: [Column; 3],
    dir: [Column; 3],
    openness: Column,
    pupil: Column,
}

impl GazeColumns {
    fn find<R: std::io::BufRead>(table: &Table<R>) -> Result<Self, TraceError> {
        let eye = |prefix: &str| {
            let optional = |name: &str| table.optional(&format!("{prefix}_{name}"));
            EyeColumns {
                valid: optional("valid"),
                origin: ["ox", "oy", "oz"].map(optional),
                dir: ["dx", "dy", "dz"].map(optional),
                openness: optional("openness"),
                pupil: optional("pupil_mm"),
            }
        };
        Ok(Self {
            time: table.column("time_ns")?,
            recv: table.optional("recv_ns"),
            valid: table.column("valid")?,
            origin: ["ox", "oy", "oz"].map(|name| table.optional(name)),
            dir: columns(table, "", ["dx", "dy", "dz"])?,
            confidence: table.optional("confidence"),
            eyes: EYE_PREFIXES.map(eye),
        })
    }
}

/// A valid flag, an origin (the middle between the eyes where the file tells none) and a direction.
fn read_ray(
    row: &Row<'_>,
    valid: Column,
    origin: [Column; 3],
    dir: [Column; 3],
) -> Result<Option<GazeRay>, TraceError> {
    if !row.flag(valid)? {
        return Ok(None);
    }
    let origin_m = row.vector(origin)?.unwrap_or_default();
    let direction = row.required(dir[0], row.direction(dir)?)?;
    Ok(GazeRay::new(origin_m, direction))
}

impl Columns for GazeColumns {
    type Record = GazeSample;

    fn record(&self, row: &Row<'_>) -> Result<GazeSample, TraceError> {
        let mut sample = GazeSample {
            time_ns: row.required(self.time, row.time_ns(self.time)?)?,
            recv_ns: row.time_ns(self.recv)?,
            combined: read_ray(row, self.valid, self.origin, self.dir)?,
            confidence: row.number_within(self.confidence, 0.0..=1.0)?,
            ..GazeSample::default()
        };
        for (eye, columns) in sample.eyes.iter_mut().zip(&self.eyes) {
            *eye = EyeSample {
                ray: read_ray(row, columns.valid, columns.origin, columns.dir)?,
                openness: row.number_within(columns.openness, 0.0..=1.0)?,
                pupil_mm: row.number_within(columns.pupil, 0.0..=20.0)?,
            };
        }
        Ok(sample)
    }

    fn time_column(&self) -> Column {
        self.time
    }

    fn time_ns(sample: &GazeSample) -> i64 {
        sample.time_ns
    }
}

struct FrameColumns {
    frame: Column,
    trial: Column,
    time: Column,
    period: Column,
    head: PoseColumns,
    head_flags: Column,
    eyes: [(PoseColumns, [Column; 4]); 2],
    gaze_time: Column,
    gaze_dir: [Column; 3],
    gaze_state: Column,
    cpu_ms: Column,
    gpu_ms: Column,
    missed: Column,
}

struct PoseColumns {
    position: [Column; 3],
    orientation: [Column; 4],
}

impl PoseColumns {
    fn find<R: std::io::BufRead>(table: &Table<R>, prefix: &str) -> Result<Self, TraceError> {
        Ok(Self {
            position: columns(table, prefix, ["_px", "_py", "_pz"])?,
            orientation: columns(table, prefix, ["_qx", "_qy", "_qz", "_qw"])?,
        })
    }

    fn pose(&self, row: &Row<'_>) -> Result<Option<Pose>, TraceError> {
        match (row.vector(self.position)?, row.rotation(self.orientation)?) {
            (None, None) => Ok(None),
            (position, orientation) => Ok(Some(Pose {
                position_m: row.required(self.position[0], position)?,
                orientation: row.required(self.orientation[0], orientation)?,
            })),
        }
    }
}

impl FrameColumns {
    fn find<R: std::io::BufRead>(table: &Table<R>) -> Result<Self, TraceError> {
        let eye = |prefix: &str| {
            let fov = columns(table, prefix, ["_fov_l", "_fov_r", "_fov_u", "_fov_d"])?;
            Ok((PoseColumns::find(table, prefix)?, fov))
        };
        let [left, right] = EYE_PREFIXES.map(eye);
        Ok(Self {
            frame: table.column("frame")?,
            trial: table.optional("trial"),
            time: table.column("predicted_display_ns")?,
            period: table.optional("period_ns"),
            head: PoseColumns::find(table, "head")?,
            head_flags: table.column("head_flags")?,
            eyes: [left?, right?],
            gaze_time: table.optional("gaze_time_ns"),
            gaze_dir: ["gaze_dx", "gaze_dy", "gaze_dz"].map(|name| table.optional(name)),
            gaze_state: table.optional("gaze_state"),
            cpu_ms: table.optional("cpu_ms"),
            gpu_ms: table.optional("gpu_ms"),
            missed: table.optional("missed"),
        })
    }

    fn eye(row: &Row<'_>, (pose, fov): &(PoseColumns, [Column; 4])) -> Result<View, TraceError> {
        let mut angles = [0.0; 4];
        for (angle, &column) in angles.iter_mut().zip(fov) {
            *angle = row.required(column, row.number(column)?)?;
        }
        let [left_rad, right_rad, up_rad, down_rad] = angles;
        let view = View {
            pose: row.required(pose.position[0], pose.pose(row)?)?,
            fov: Fov {
                left_rad,
                right_rad,
                up_rad,
                down_rad,
            },
        };
        if !view.fov.is_valid() {
            return Err(row.problem(fov[0], "begins a field of view without a picture; radians, left < right, down < up, within 89.9 degrees"));
        }
        Ok(view)
    }

    fn gaze(&self, row: &Row<'_>) -> Result<Option<FrameGaze>, TraceError> {
        let Some(dir_in_view) = row.direction(self.gaze_dir)? else {
            return Ok(None);
        };
        Ok(Some(FrameGaze {
            sample_time_ns: row.time_ns(self.gaze_time)?,
            dir_in_view,
            state: row.text(self.gaze_state).parse().map_err(|()| {
                row.problem(
                    self.gaze_state,
                    "is none of tracked, held, predicted, fallback, replay",
                )
            })?,
        }))
    }
}

impl Columns for FrameColumns {
    type Record = FrameRecord;

    fn record(&self, row: &Row<'_>) -> Result<FrameRecord, TraceError> {
        let local_from_head = self.head.pose(row)?;
        let flags = row.integer(self.head_flags)?.unwrap_or(0);
        if flags & head_flags::VALID != 0 && local_from_head.is_none() {
            return Err(row.problem(
                self.head_flags,
                "calls a head pose valid that the row does not hold; fill the pose in, or write 0",
            ));
        }
        let period_ns = row.time_ns(self.period)?;
        Ok(FrameRecord {
            frame: row.required(self.frame, row.integer(self.frame)?)?,
            trial: row.integer(self.trial)?,
            predicted_display_ns: row.required(self.time, row.time_ns(self.time)?)?,
            period_ns,
            local_from_head,
            head_flags: flags,
            head_from_eyes: [
                Self::eye(row, &self.eyes[0])?,
                Self::eye(row, &self.eyes[1])?,
            ],
            gaze: self.gaze(row)?,
            cpu_ms: row.number(self.cpu_ms)?,
            gpu_ms: row.number(self.gpu_ms)?,
            missed: row.integer(self.missed)?,
        })
    }

    fn time_column(&self) -> Column {
        self.time
    }

    fn time_ns(frame: &FrameRecord) -> i64 {
        frame.predicted_display_ns
    }
}

struct EventColumns {
    time: Column,
    event: Column,
    trial: Column,
    value: Column,
}

impl EventColumns {
    fn find<R: std::io::BufRead>(table: &Table<R>) -> Result<Self, TraceError> {
        Ok(Self {
            time: table.column("time_ns")?,
            event: table.column("event")?,
            trial: table.optional("trial"),
            value: table.optional("value"),
        })
    }
}

impl Columns for EventColumns {
    type Record = EventRecord;
    const SHARES_TIMES: bool = true;

    fn record(&self, row: &Row<'_>) -> Result<EventRecord, TraceError> {
        Ok(EventRecord {
            time_ns: row.required(self.time, row.time_ns(self.time)?)?,
            event: row.text(self.event).into_owned(),
            trial: row.integer(self.trial)?,
            value: row.text(self.value).into_owned(),
        })
    }

    fn time_column(&self) -> Column {
        self.time
    }

    fn time_ns(event: &EventRecord) -> i64 {
        event.time_ns
    }
}
