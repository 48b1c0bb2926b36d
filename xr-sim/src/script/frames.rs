//! `frames.csv`: when each frame was shown, and where head and eyes were.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};
use std::path::Path;

use glam::{Quat, Vec3};

use super::table::{Column, Header, Row, ScriptError, Table};
use crate::pose::Pose;

/// Distance of the eyes where a recording tells none: the mean of adults, in metres.
const DEFAULT_IPD_M: f32 = 0.063;

/// The pace where a recording tells none: 90 Hz.
pub(crate) const DEFAULT_PERIOD_NS: i64 = 11_111_111;

/// Below this length a quaternion has no direction.
const MIN_QUATERNION_LENGTH: f32 = 1e-3;

/// `XrSpaceLocationFlags`: position and orientation, both valid and tracked.
pub(crate) const TRACKED: u64 = 0b1111;

/// An eye of the headset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Eye {
    pub head_from_eye: Pose,
    /// Angles of the left, right, upper and lower edge, in radians; left and down are negative.
    pub fov: [f32; 4],
}

impl Eye {
    /// Both eyes of a headset that tells nothing about them.
    pub const DEFAULT: [Self; 2] = [
        Self::default_at(-DEFAULT_IPD_M / 2.0),
        Self::default_at(DEFAULT_IPD_M / 2.0),
    ];

    const fn default_at(x: f32) -> Self {
        Self {
            head_from_eye: Pose::from_position(Vec3::new(x, 0.0, 0.0)),
            fov: [-FRAC_PI_4, FRAC_PI_4, FRAC_PI_4, -FRAC_PI_4],
        }
    }
}

/// The head in LOCAL space, with how far that is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct HeadPose {
    pub local_from_head: Pose,
    /// `XrSpaceLocationFlags`.
    pub flags: u64,
}

impl HeadPose {
    const AT_REST: Self = Self {
        local_from_head: Pose::IDENTITY,
        flags: TRACKED,
    };
}

/// A frame of the recording.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Frame {
    /// The predicted display time.
    pub display_time_ns: i64,
    /// To the next display time.
    pub period_ns: i64,
    pub head: HeadPose,
    pub eyes: [Eye; 2],
}

/// The latest frame not after that time; before the first, the first.
pub(super) fn latest(frames: &[Frame], time_ns: i64) -> Option<&Frame> {
    let after = frames.partition_point(|frame| frame.display_time_ns <= time_ns);
    frames.get(after.saturating_sub(1))
}

/// The head at that time, interpolated to the next frame; its flags are the latest frame's.
pub(super) fn head(frames: &[Frame], time_ns: i64) -> HeadPose {
    let after = frames.partition_point(|frame| frame.display_time_ns <= time_ns);
    let Some(earlier) = frames.get(after.saturating_sub(1)) else {
        return HeadPose::AT_REST;
    };
    let Some(later) = frames
        .get(after)
        .filter(|_| time_ns > earlier.display_time_ns)
    else {
        return earlier.head;
    };
    let span_ns = (later.display_time_ns - earlier.display_time_ns) as f64;
    let fraction = (time_ns - earlier.display_time_ns) as f64 / span_ns;
    HeadPose {
        local_from_head: earlier
            .head
            .local_from_head
            .interpolate(later.head.local_from_head, fraction as f32),
        flags: earlier.head.flags,
    }
}

/// Reads the file.
pub(super) fn read(path: &Path) -> Result<Vec<Frame>, ScriptError> {
    let mut last: Option<Frame> = None;
    let frames = Table::read(path)?.rows(Columns::of, |columns, row| {
        let frame = columns.frame(row, last.as_ref())?;
        last = Some(frame);
        Ok(frame)
    })?;
    if frames.is_empty() {
        return Err(ScriptError::Empty { path: path.into() });
    }
    Ok(frames)
}

struct Columns {
    display_time_ns: Column,
    period_ns: Column,
    head_position: [Column; 3],
    head_orientation: [Column; 4],
    head_flags: Column,
    eyes: [EyeColumns; 2],
}

struct EyeColumns {
    position: [Column; 3],
    orientation: [Column; 4],
    fov: [Column; 4],
}

impl Columns {
    fn of(header: &Header) -> Result<Self, ScriptError> {
        let group = |prefix: &str, [x, y, z]: [&str; 3]| {
            [x, y, z].map(|name| header.column(format!("{prefix}_{name}")))
        };
        let orientation = |prefix: &str| {
            ["qx", "qy", "qz", "qw"].map(|name| header.column(format!("{prefix}_{name}")))
        };
        let eye = |prefix: &str| EyeColumns {
            position: group(prefix, ["px", "py", "pz"]),
            orientation: orientation(prefix),
            fov: ["l", "r", "u", "d"].map(|side| header.column(format!("{prefix}_fov_{side}"))),
        };
        Ok(Self {
            display_time_ns: header.needed("predicted_display_ns")?,
            period_ns: header.column("period_ns"),
            head_position: group("head", ["px", "py", "pz"]),
            head_orientation: orientation("head"),
            head_flags: header.column("head_flags"),
            eyes: [eye("l"), eye("r")],
        })
    }

    fn frame(&self, row: &Row, last: Option<&Frame>) -> Result<Frame, ScriptError> {
        let display_time_ns = row.needed_integer(&self.display_time_ns)?;
        if display_time_ns <= last.map_or(0, |frame| frame.display_time_ns) {
            return Err(row.refuse(
                &self.display_time_ns,
                "must be positive and after the line before",
            ));
        }
        let period_ns = row.integer(&self.period_ns)?.unwrap_or(DEFAULT_PERIOD_NS);
        if period_ns <= 0 {
            return Err(row.refuse(&self.period_ns, "must be positive"));
        }
        let before = last.map_or(HeadPose::AT_REST, |frame| frame.head);
        let flags = row.integer(&self.head_flags)?;
        let head = match pose(row, &self.head_position, &self.head_orientation)? {
            Some(local_from_head) => HeadPose {
                local_from_head,
                flags: flags.map_or(TRACKED, |bits| bits as u64 & TRACKED),
            },
            // no pose: the head was lost, where it was seen last
            None => HeadPose { flags: 0, ..before },
        };
        let mut eyes = Eye::DEFAULT;
        for (eye, columns) in eyes.iter_mut().zip(&self.eyes) {
            if let Some(head_from_eye) = pose(row, &columns.position, &columns.orientation)? {
                eye.head_from_eye = head_from_eye;
            }
            if let Some(fov) = row.numbers(&columns.fov)? {
                let [left, right, up, down] = fov;
                if left >= right || down >= up || fov.iter().any(|angle| angle.abs() >= FRAC_PI_2) {
                    return Err(
                        row.refuse(&columns.fov[0], "begins no field of view below 180 degrees")
                    );
                }
                eye.fov = fov;
            }
        }
        Ok(Frame {
            display_time_ns,
            period_ns,
            head,
            eyes,
        })
    }
}

/// A pose; a missing orientation is the identity, a missing position means that there is no pose.
fn pose(
    row: &Row,
    position: &[Column; 3],
    orientation: &[Column; 4],
) -> Result<Option<Pose>, ScriptError> {
    let Some(position) = row.numbers(position)? else {
        return Ok(None);
    };
    let quaternion = row
        .numbers(orientation)?
        .map_or(Quat::IDENTITY, Quat::from_array);
    if quaternion.length() < MIN_QUATERNION_LENGTH {
        return Err(row.refuse(&orientation[0], "begins a quaternion of length 0"));
    }
    // one that is a unit already is left as it is, bit for bit
    let orientation = if quaternion.is_normalized() {
        quaternion
    } else {
        quaternion.normalize()
    };
    Ok(Some(Pose {
        position: Vec3::from_array(position),
        orientation,
    }))
}
