//! `gaze.csv`: the gaze in VIEW space, sample by sample.

use std::path::Path;

use glam::{Quat, Vec3};

use super::table::{ScriptError, Table};
use crate::pose::Pose;

/// A sample stands for the gaze no longer than this.
const MAX_AGE_NS: i64 = 50_000_000;

/// Below this length a direction is none.
const MIN_DIRECTION_LENGTH: f32 = 1e-3;

/// Where the eyes looked at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GazeSample {
    /// When the eyes were seen so.
    pub time_ns: i64,
    /// From the eyes along the gaze (-Z), +Y up. None: the eyes were lost or shut.
    pub view_from_gaze: Option<Pose>,
}

/// All of a recording's gaze.
#[derive(Debug)]
pub(super) enum Gaze {
    /// Nothing was recorded.
    None,
    /// Straight ahead at any time.
    Ahead,
    /// In ascending order of time.
    Recorded(Vec<GazeSample>),
}

impl Gaze {
    /// The latest sample not after that time, if it isn't too old.
    pub fn at(&self, time_ns: i64) -> Option<GazeSample> {
        match self {
            Self::None => None,
            Self::Ahead => Some(GazeSample {
                time_ns,
                view_from_gaze: Some(Pose::IDENTITY),
            }),
            Self::Recorded(samples) => {
                let after = samples.partition_point(|sample| sample.time_ns <= time_ns);
                let sample = *samples.get(after.checked_sub(1)?)?;
                (time_ns - sample.time_ns <= MAX_AGE_NS).then_some(sample)
            }
        }
    }
}

/// Reads the file; none where there is no file.
pub(super) fn read(path: &Path) -> Result<Gaze, ScriptError> {
    let Some(table) = Table::read_if_any(path)? else {
        return Ok(Gaze::None);
    };
    let mut samples = table.rows(
        |header| {
            let time_ns = header.needed("time_ns")?;
            let direction = [
                header.needed("dx")?,
                header.needed("dy")?,
                header.needed("dz")?,
            ];
            let origin = ["ox", "oy", "oz"].map(|name| header.column(name));
            Ok((time_ns, header.column("valid"), origin, direction))
        },
        |(time_ns, valid, origin, direction), row| {
            let is_valid = match row.text(valid) {
                None | Some("1") => true,
                Some("0") => false,
                Some(_) => return Err(row.refuse(valid, "is neither 0 nor 1")),
            };
            let origin = row.numbers(origin)?.map_or(Vec3::ZERO, Vec3::from_array);
            let gaze_dir_in_view = row.numbers(direction)?.map(Vec3::from_array);
            let view_from_gaze = match gaze_dir_in_view.filter(|_| is_valid) {
                Some(dir) if dir.length() < MIN_DIRECTION_LENGTH => {
                    return Err(row.refuse(&direction[0], "begins a direction of length 0"));
                }
                Some(dir) => Some(Pose {
                    position: origin,
                    orientation: looking_along(dir.normalize()),
                }),
                None => None,
            };
            Ok(GazeSample {
                time_ns: row.needed_integer(time_ns)?,
                view_from_gaze,
            })
        },
    )?;
    // recorders write in the order of arrival, which needn't be that of time
    samples.sort_by_key(|sample| sample.time_ns);
    Ok(Gaze::Recorded(samples))
}

/// The orientation that takes -Z to `dir` with as little roll as can be: +Y stays up.
fn looking_along(dir: Vec3) -> Quat {
    let yaw = f32::atan2(-dir.x, -dir.z);
    let pitch = f32::atan2(dir.y, dir.x.hypot(dir.z));
    Quat::from_rotation_y(yaw) * Quat::from_rotation_x(pitch)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gaze_pose_points_minus_z_along_the_gaze_and_keeps_y_up() {
        let directions = [
            [0.0, 0.0, -1.0],
            [0.3, 0.2, -0.9],
            [-0.7, -0.4, -0.5],
            [0.0, 1.0, 0.0],
            [0.1, 0.0, 1.0],
        ];
        for dir in directions.map(|dir| Vec3::from_array(dir).normalize()) {
            let orientation = looking_along(dir);
            assert!((orientation * Vec3::NEG_Z - dir).length() < 1e-6, "{dir}");
            assert!((orientation * Vec3::X).y.abs() < 1e-6, "{dir} rolls");
            assert!((orientation * Vec3::Y).y > -1e-6, "{dir} is upside down");
        }
    }
}
