//! SRanipal script CSV: what recording scripts for HTC's Vive Pro Eye write.
//!
//! Separated by `;`, one line an eye-tracker sample (120 Hz) with the newest head pose (90 Hz) beside it. Gaze is in SRanipal's
//! axes: +X to the wearer's left, +Y up, +Z forward, origins in millimetres. The head is a Unity transform.

use std::io::BufRead;

use glam::Vec3;

use super::clock::{CounterReading, fitted_times_ns};
use super::head::{HeadTrack, eyes, pose_from_unity};
use super::{Format, ImportReport, Imported};
use crate::gaze::summary::Summary;
use crate::gaze::trace::table::{Column, Row, Table};
use crate::gaze::trace::{MAX_GAZE_SAMPLES, Metadata, Session, TraceError};
use crate::gaze::{EyeSample, GazeRay, GazeSample};
use crate::view::{Fov, Pose};

/// Bits of the validity mask (SRanipal SDK, `SingleEyeDataValidity`); 31 is all of them.
mod validity {
    pub const ORIGIN: u8 = 1;
    pub const DIRECTION: u8 = 1 << 1;
    pub const PUPIL_DIAMETER: u8 = 1 << 2;
    pub const OPENNESS: u8 = 1 << 3;
}

/// XrTime given to the first line: one second, because 0 is no valid XrTime.
const START_NS: i64 = 1_000_000_000;
/// .NET ticks are 100 ns.
const TICK_NS: i64 = 100;
/// No recording lasts longer than a day; a time beyond is damage.
const MAX_SPAN_TICKS: i64 = 24 * 3600 * 10_000_000;
/// Display period of the Vive Pro Eye, 90 Hz.
const DISPLAY_PERIOD_NS: i64 = 11_111_111;
/// Distance between the eyes where the file tells no believable one, metres: the adult mean (Dodgson 2004).
const DEFAULT_IPD_M: f32 = 0.063;
/// Believable distances between the eyes, metres (Dodgson 2004: 52 to 78 mm for nearly all adults).
const IPD_RANGE_M: std::ops::RangeInclusive<f32> = 0.050..=0.080;
/// A recording in which fewer lines have both eyes valid holds no gaze worth replaying.
const MIN_BINOCULAR_SHARE: f64 = 0.1;
/// Below this share of valid samples the import warns.
const LOW_VALID_SHARE: f64 = 0.8;
/// How many damaged lines are named.
const DAMAGE_NAMED: usize = 10;

/// Tangents of the left, right, up and down angles of the HTC Vive Pro's left and right eye, as SteamVR's `GetProjectionRaw`
/// returned them (HMD Geometry Database by risa2000, `VivePro_Native_R90`, recorded 2025-05-03). The Vive Pro Eye has the same
/// panels and lenses.
const FOV_TANGENTS: [[f32; 4]; 2] = [
    [-1.354895, 1.209037, 1.427617, -1.423536],
    [-1.207865, 1.358202, 1.423707, -1.427286],
];

struct Line {
    line_ns: i64,
    counter: CounterReading,
    eyes: [EyeSample; 2],
    local_from_head: Option<Pose>,
}

struct Columns {
    ticks: Column,
    device_ms: Column,
    eyes: [EyeColumns; 2],
    position: [Column; 3],
    rotation: [Column; 3],
}

struct EyeColumns {
    valid: Column,
    openness: Column,
    pupil: Column,
    origin: [Column; 3],
    dir: [Column; 3],
}

/// Imports a recording line by line.
pub(super) fn import(file: &str, reader: impl BufRead) -> Result<Imported, TraceError> {
    let unusable = |reason: String| TraceError::Unusable {
        file: file.to_owned(),
        reason,
    };
    let empty = || {
        unusable(
            "it has no rows below its header; nothing was recorded, so record again".to_owned(),
        )
    };
    let mut table = Table::open(file, b';', reader)?.ok_or_else(empty)?;
    let parsed = read_lines(&mut table, file)?;
    let total = parsed.lines.len() + parsed.damaged;
    if total == 0 {
        return Err(empty());
    }
    if parsed.lines.len() < 2 {
        return Err(unusable(format!(
            "{} of its {total} rows are damaged; first: {}",
            parsed.damaged,
            parsed.damage.join("; ")
        )));
    }
    let moves = parsed
        .lines
        .windows(2)
        .any(|pair| pair[0].local_from_head != pair[1].local_from_head);
    let binocular = parsed
        .lines
        .iter()
        .filter(|line| line.eyes.iter().all(|eye| eye.ray.is_some()))
        .count();
    let binocular_share = binocular as f64 / parsed.lines.len() as f64;
    if binocular_share < MIN_BINOCULAR_SHARE {
        let head = if moves {
            ""
        } else {
            ", and the head pose never changes"
        };
        return Err(unusable(format!(
            "both eyes are valid in only {:.1}% of its {} rows{head}; record again after calibrating the eye tracker",
            100.0 * binocular_share,
            parsed.lines.len()
        )));
    }
    let mut warnings = Vec::new();
    let (session, repeated_lines) = assemble(&parsed.lines, &mut warnings);
    let summary = Summary::of(&session);
    warn(&summary, &parsed, &mut warnings);
    Ok(Imported {
        report: ImportReport {
            format: Format::Sranipal,
            lines: total,
            damaged_lines: parsed.damaged,
            damage: parsed.damage,
            repeated_lines,
            summary,
            warnings: warnings.clone(),
        },
        session: Session {
            warnings,
            ..session
        },
    })
}

struct Parsed {
    lines: Vec<Line>,
    damaged: usize,
    damage: Vec<String>,
}

/// Reads all lines; those that can't be read are counted, and the first are named.
fn read_lines(table: &mut Table<impl BufRead>, file: &str) -> Result<Parsed, TraceError> {
    let columns = Columns::find(table)?;
    let mut parsed = Parsed {
        lines: Vec::new(),
        damaged: 0,
        damage: Vec::new(),
    };
    let mut first_ticks = None;
    loop {
        let previous_ns = parsed.lines.last().map(|line: &Line| line.line_ns);
        let line = match table.next_row() {
            Ok(None) => break,
            Ok(Some(row)) => columns.line(&row, &mut first_ticks, previous_ns),
            Err(error @ (TraceError::CellCount { .. } | TraceError::NotText { .. })) => Err(error),
            Err(fatal) => return Err(fatal),
        };
        match line {
            Ok(_) if parsed.lines.len() == MAX_GAZE_SAMPLES => {
                return Err(TraceError::TooManyRows {
                    file: file.to_owned(),
                    limit: MAX_GAZE_SAMPLES,
                });
            }
            Ok(line) => parsed.lines.push(line),
            Err(error) => parsed.damaged(error.to_string()),
        }
    }
    if table.was_cut() {
        parsed.damaged(format!("{file}, line {}: cut off", table.line_number()));
    }
    Ok(parsed)
}

impl Parsed {
    fn damaged(&mut self, what: String) {
        self.damaged += 1;
        if self.damage.len() < DAMAGE_NAMED {
            self.damage.push(what);
        }
    }
}

impl Columns {
    fn find(table: &Table<impl BufRead>) -> Result<Self, TraceError> {
        let eye = |side: &str| -> Result<EyeColumns, TraceError> {
            let axes = |name: &str, unit: &str| -> Result<[Column; 3], TraceError> {
                let axis = |axis: &str| table.column(&format!("{name}_{side}.{axis}{unit}"));
                Ok([axis("x")?, axis("y")?, axis("z")?])
            };
            Ok(EyeColumns {
                valid: table.column(&format!("eye_valid_{side}"))?,
                openness: table.optional(&format!("openness_{side}")),
                pupil: table.optional(&format!("pupil_diameter_{side}(mm)")),
                origin: axes("gaze_origin", "(mm)")?,
                dir: axes("gaze_direct", "")?,
            })
        };
        let head = |part: &str| -> Result<[Column; 3], TraceError> {
            let axis = |axis: &str| table.column(&format!("helmet_{part}_{axis}"));
            Ok([axis("x")?, axis("y")?, axis("z")?])
        };
        Ok(Self {
            ticks: table.column("time(100ns)")?,
            device_ms: table.column("time_stamp(ms)")?,
            eyes: [eye("L")?, eye("R")?],
            position: head("pos")?,
            rotation: head("rot")?,
        })
    }

    fn line(
        &self,
        row: &Row<'_>,
        first_ticks: &mut Option<i64>,
        previous_ns: Option<i64>,
    ) -> Result<Line, TraceError> {
        let ticks: i64 = row.required(self.ticks, row.integer(self.ticks)?)?;
        let span_ticks = ticks.saturating_sub(first_ticks.unwrap_or(ticks));
        let line_ns = START_NS + span_ticks.clamp(-1, MAX_SPAN_TICKS) * TICK_NS;
        if span_ticks > MAX_SPAN_TICKS
            || previous_ns.is_some_and(|previous_ns| line_ns <= previous_ns)
        {
            return Err(row.problem(self.ticks, "does not follow the time of the line before"));
        }
        let line = Line {
            line_ns,
            counter: CounterReading {
                counter_ms: row.required(self.device_ms, row.integer(self.device_ms)?)?,
                line_ns,
            },
            eyes: [self.eyes[0].sample(row)?, self.eyes[1].sample(row)?],
            local_from_head: self.head(row)?,
        };
        first_ticks.get_or_insert(ticks);
        Ok(line)
    }

    /// The head; none where all six numbers are zero, which is what Unity shows before it has found the headset.
    fn head(&self, row: &Row<'_>) -> Result<Option<Pose>, TraceError> {
        let position_m = row.required(self.position[0], row.vector(self.position)?)?;
        let euler_deg = row.required(self.rotation[0], row.vector(self.rotation)?)?;
        let found = position_m != Vec3::ZERO || euler_deg != Vec3::ZERO;
        Ok(found.then(|| pose_from_unity(position_m, euler_deg)))
    }
}

impl EyeColumns {
    fn sample(&self, row: &Row<'_>) -> Result<EyeSample, TraceError> {
        let mask: u8 = row.required(self.valid, row.integer(self.valid)?)?;
        let origin_mm = row.required(self.origin[0], row.vector(self.origin)?)?;
        let dir = row.required(self.dir[0], row.vector(self.dir)?)?;
        let has = |bits: u8| mask & bits == bits;
        Ok(EyeSample {
            ray: match has(validity::ORIGIN | validity::DIRECTION) {
                // An invalid direction is all zero, whatever the mask says.
                true => GazeRay::new(
                    view_from_sranipal(origin_mm * 1e-3),
                    view_from_sranipal(dir),
                ),
                false => None,
            },
            openness: row
                .number(self.openness)?
                .filter(|_| has(validity::OPENNESS))
                .map(|open| open.clamp(0.0, 1.0)),
            // An invalid diameter is -1.
            pupil_mm: row
                .number(self.pupil)?
                .filter(|mm| has(validity::PUPIL_DIAMETER) && (0.0..=20.0).contains(mm)),
        })
    }
}

/// From SRanipal's axes (+X left, +Y up, +Z forward) to OpenXR's (+X right, +Y up, -Z forward).
fn view_from_sranipal(vector: Vec3) -> Vec3 {
    Vec3::new(-vector.x, vector.y, -vector.z)
}

/// The session that the lines make, and how many of them repeat a sample.
fn assemble(lines: &[Line], warnings: &mut Vec<String>) -> (Session, usize) {
    let counter: Vec<CounterReading> = lines.iter().map(|line| line.counter).collect();
    let times_ns = fitted_times_ns(&counter).unwrap_or_else(|| {
        warnings.push("time_stamp(ms) does not run with time(100ns); samples are given the times of their lines, which jitter by some milliseconds".to_owned());
        lines.iter().map(|line| line.line_ns).collect()
    });
    let mut track = HeadTrack::new(DISPLAY_PERIOD_NS);
    for line in lines {
        if let Some(pose) = line.local_from_head {
            track.push(line.line_ns, pose);
        }
    }
    if track.updates() < 2 {
        warnings.push("the head pose never changes: the head was not tracked, and a replay shows what eyes alone did".to_owned());
    }
    track.recentre();
    let centre = EyeCentre::of(lines);
    let ipd_m = match IPD_RANGE_M.contains(&centre.ipd_m) {
        true => centre.ipd_m,
        false => {
            warnings.push(format!(
                "the eyes' origins are {:.1} mm apart, which no head is; {:.0} mm is used",
                centre.ipd_m * 1e3,
                DEFAULT_IPD_M * 1e3
            ));
            DEFAULT_IPD_M
        }
    };
    let mut gaze: Vec<GazeSample> = Vec::with_capacity(lines.len());
    for (line, &time_ns) in lines.iter().zip(&times_ns) {
        if gaze.last().is_none_or(|last| time_ns > last.time_ns) {
            gaze.push(centre.sample(line, time_ns));
        }
    }
    let repeated = lines.len() - gaze.len();
    let fovs = FOV_TANGENTS.map(|tangents| {
        let [left_rad, right_rad, up_rad, down_rad] = tangents.map(f32::atan);
        Fov {
            left_rad,
            right_rad,
            up_rad,
            down_rad,
        }
    });
    let (start_ns, end_ns) = (START_NS, lines.last().map_or(START_NS, |line| line.line_ns));
    let session = Session {
        metadata: metadata(ipd_m),
        frames: track.frames(start_ns, end_ns, eyes(ipd_m, fovs)),
        gaze,
        ..Session::default()
    };
    (session, repeated)
}

fn metadata(ipd_m: f32) -> Metadata {
    let notes = [
        "frames.csv is made up at 90 Hz: the file holds no display frames. Head poses are interpolated between the poses that the file repeats.".to_owned(),
        "LOCAL space begins at the first head pose: its position and yaw are taken off.".to_owned(),
        "Sample times are the tracker's own milliseconds, fitted to the computer's clock; recv_ns is the time of the file's line. The tracker's latency is not in the file.".to_owned(),
        "VIEW begins in the middle between the eyes' mean origins, which SRanipal counts from the lenses.".to_owned(),
        format!("Eyes {:.1} mm apart. Fields of view are those of an HTC Vive Pro in SteamVR (HMD Geometry Database), not in the file.", ipd_m * 1e3),
    ];
    Metadata {
        source: Some("SRanipal script CSV".to_owned()),
        software: Some(concat!("macula ", env!("CARGO_PKG_VERSION")).to_owned()),
        device: Some("HTC Vive Pro Eye".to_owned()),
        notes: notes.into(),
        ..Metadata::default()
    }
}

/// Where the eyes are on average, in SRanipal's origin but OpenXR's axes.
struct EyeCentre {
    middle_m: Vec3,
    ipd_m: f32,
}

impl EyeCentre {
    fn of(lines: &[Line]) -> Self {
        let mean = |eye: usize| {
            let origins = lines.iter().filter_map(|line| line.eyes[eye].ray);
            let (sum, count) = origins.fold((glam::DVec3::ZERO, 0), |(sum, count), ray| {
                (sum + ray.origin_m().as_dvec3(), count + 1)
            });
            (sum / f64::from(count.max(1))).as_vec3()
        };
        let (left, right) = (mean(0), mean(1));
        Self {
            middle_m: left.midpoint(right),
            ipd_m: left.distance(right),
        }
    }

    /// The line's sample with rays in VIEW space. Both eyes together look from the middle between them along their mean
    /// direction; one alone stands for both.
    fn sample(&self, line: &Line, time_ns: i64) -> GazeSample {
        let eyes = line.eyes.map(|eye| EyeSample {
            ray: eye
                .ray
                .and_then(|ray| GazeRay::new(ray.origin_m() - self.middle_m, ray.dir())),
            ..eye
        });
        let combined = match (eyes[0].ray, eyes[1].ray) {
            (Some(left), Some(right)) => GazeRay::new(
                left.origin_m().midpoint(right.origin_m()),
                left.dir() + right.dir(),
            ),
            (one, other) => one.or(other),
        };
        GazeSample {
            time_ns,
            recv_ns: Some(line.line_ns),
            combined,
            confidence: None,
            eyes,
        }
    }
}

fn warn(summary: &Summary, parsed: &Parsed, warnings: &mut Vec<String>) {
    if parsed.damaged > 0 {
        warnings.push(format!(
            "{} damaged lines are left out; first: {}",
            parsed.damaged,
            parsed.damage.join("; ")
        ));
    }
    if summary.gaze_valid_share < LOW_VALID_SHARE {
        warnings.push(format!(
            "only {:.1}% of the samples are valid",
            100.0 * summary.gaze_valid_share
        ));
    }
    if summary.reflex.is_some_and(|reflex| reflex.contradicts()) {
        warnings.push("the eyes turn with the head instead of against it: left and right of the gaze or of the head are swapped in the file".to_owned());
    }
}
