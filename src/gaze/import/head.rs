//! The head's track from pose samples that other programs wrote beside each gaze sample, and display frames from it.

use glam::{EulerRot, Quat, Vec3};

use crate::gaze::trace::{FrameRecord, head_flags, interpolate};
use crate::view::{Fov, Pose, View};

/// No head holds so still that its pose repeats to the last digit for this long, ns: a pose that does is not tracked.
pub(super) const FROZEN_NS: i64 = 250_000_000;

/// Poses of the head at the times of their updates.
///
/// A file that is written at the eye tracker's rate repeats a pose until the next display frame brings a new one, so the time
/// of an update is only known to lie between two lines. Updates come at the display's rate: each is placed one display period
/// after the one before, and moved into its bounds where it falls out of them.
pub(super) struct HeadTrack {
    period_ns: i64,
    updates: Vec<(i64, Pose)>,
    last_line_ns: Option<i64>,
}

impl HeadTrack {
    /// A track of a head whose pose is updated every `period_ns`.
    pub fn new(period_ns: i64) -> Self {
        Self {
            period_ns,
            updates: Vec::new(),
            last_line_ns: None,
        }
    }

    /// Takes the pose of the next line, written at `line_ns`.
    pub fn push(&mut self, line_ns: i64, pose: Pose) {
        match (self.updates.last(), self.last_line_ns) {
            (Some((_, last)), _) if *last == pose => {}
            (Some((updated_ns, _)), Some(before_ns)) if before_ns < line_ns => {
                let expected_ns = updated_ns + self.period_ns;
                self.updates
                    .push((expected_ns.clamp(before_ns + 1, line_ns), pose));
            }
            (None, _) => self.updates.push((line_ns, pose)),
            _ => return,
        }
        self.last_line_ns = Some(line_ns);
    }

    /// Number of distinct poses.
    pub fn updates(&self) -> usize {
        self.updates.len()
    }

    /// Moves the track into LOCAL space: the first head is at the origin and looks along -Z, up stays up.
    pub fn recentre(&mut self) {
        let Some((_, first)) = self.updates.first() else {
            return;
        };
        let (yaw, _, _) = first.orientation.to_euler(EulerRot::YXZ);
        let level = Pose {
            orientation: Quat::from_rotation_y(yaw),
            position_m: first.position_m,
        };
        for (_, pose) in &mut self.updates {
            *pose = level.inverse().compose(*pose);
        }
    }

    /// The head at a time, and whether it was tracked then.
    fn at(&self, time_ns: i64) -> (Pose, bool) {
        let later = self
            .updates
            .partition_point(|(updated_ns, _)| *updated_ns <= time_ns);
        let before = later.checked_sub(1).map(|index| self.updates[index]);
        match (before, self.updates.get(later)) {
            (Some((before_ns, from)), Some(&(after_ns, to))) => {
                let share = (time_ns - before_ns) as f32 / (after_ns - before_ns) as f32;
                (
                    interpolate(from, to, share),
                    after_ns - before_ns < FROZEN_NS,
                )
            }
            (Some((before_ns, pose)), None) => (pose, time_ns - before_ns < FROZEN_NS),
            (None, Some(&(after_ns, pose))) => (pose, after_ns - time_ns < FROZEN_NS),
            (None, None) => (Pose::IDENTITY, false),
        }
    }

    /// Display frames from `start_ns` to `end_ns`, one every display period.
    pub fn frames(
        &self,
        start_ns: i64,
        end_ns: i64,
        head_from_eyes: [View; 2],
    ) -> Vec<FrameRecord> {
        let count = ((end_ns - start_ns) / self.period_ns).max(0) as u64;
        let frame = |frame: u64| {
            let predicted_display_ns = start_ns + frame as i64 * self.period_ns;
            let (local_from_head, tracked) = self.at(predicted_display_ns);
            FrameRecord {
                frame,
                trial: None,
                predicted_display_ns,
                period_ns: Some(self.period_ns),
                local_from_head: Some(local_from_head),
                head_flags: if tracked {
                    head_flags::TRACKED
                } else {
                    head_flags::VALID
                },
                head_from_eyes,
                gaze: None,
                cpu_ms: None,
                gpu_ms: None,
                missed: None,
            }
        };
        (0..=count).map(frame).collect()
    }
}

/// A pose from Unity: left-handed (+X right, +Y up, +Z forward), Euler angles in degrees, applied about Z, then X, then Y
/// (Unity manual, `Transform.eulerAngles`). Turned into OpenXR axes by mirroring Z.
pub(super) fn pose_from_unity(position_m: Vec3, euler_deg: Vec3) -> Pose {
    let [x, y, z] = euler_deg.to_array().map(f32::to_radians);
    let unity = Quat::from_rotation_y(y) * Quat::from_rotation_x(x) * Quat::from_rotation_z(z);
    Pose {
        orientation: Quat::from_xyzw(-unity.x, -unity.y, unity.z, unity.w).normalize(),
        position_m: Vec3::new(position_m.x, position_m.y, -position_m.z),
    }
}

/// Both eyes, half of `ipd_m` to the left and right of the middle, looking straight ahead.
pub(crate) fn eyes(ipd_m: f32, fovs: [Fov; 2]) -> [View; 2] {
    let eye = |side: f32, fov: Fov| View {
        pose: Pose {
            position_m: Vec3::new(side * 0.5 * ipd_m, 0.0, 0.0),
            ..Pose::IDENTITY
        },
        fov,
    };
    [eye(-1.0, fovs[0]), eye(1.0, fovs[1])]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turned(deg: f32) -> Pose {
        pose_from_unity(Vec3::ZERO, Vec3::new(0.0, deg, 0.0))
    }

    #[test]
    fn unity_turns_right_looks_down_and_tilts_right_with_positive_angles() {
        let forward = |euler: Vec3| pose_from_unity(Vec3::ZERO, euler).orientation * Vec3::NEG_Z;
        assert!(
            forward(Vec3::new(0.0, 30.0, 0.0)).x > 0.49,
            "yaw to the right"
        );
        assert!(forward(Vec3::new(30.0, 0.0, 0.0)).y < -0.49, "pitch down");
        let up = pose_from_unity(Vec3::ZERO, Vec3::new(0.0, 0.0, 30.0)).orientation * Vec3::Y;
        assert!(
            up.x < -0.49,
            "Unity rolls to the left with a positive angle"
        );
        let both = forward(Vec3::new(30.0, 90.0, 0.0));
        assert!(
            both.x > 0.86 && both.y < -0.49,
            "pitch is about the head's own axis: {both}"
        );
    }

    #[test]
    fn updates_are_spread_evenly_over_repeated_poses() {
        const LINE_NS: i64 = 8_333_333;
        const PERIOD_NS: i64 = 11_111_111;
        let mut track = HeadTrack::new(PERIOD_NS);
        for line in 0..400 {
            // What the file holds: the pose of the newest display frame.
            let frame = line * LINE_NS / PERIOD_NS;
            track.push(line * LINE_NS, turned(frame as f32 * 0.5));
        }
        assert_eq!(track.updates(), 300);
        let steps: Vec<i64> = track
            .updates
            .windows(2)
            .map(|pair| pair[1].0 - pair[0].0)
            .collect();
        let uneven = |steps: &[i64]| {
            steps
                .iter()
                .map(|step| (step - PERIOD_NS).abs())
                .max()
                .unwrap()
        };
        assert!(uneven(&steps[4..]) < 100_000, "{} ns", uneven(&steps[4..]));
    }

    #[test]
    fn a_frozen_head_is_not_called_tracked() {
        let mut track = HeadTrack::new(11_111_111);
        for line in 0..10_i64 {
            track.push(line * 10_000_000, turned(line as f32));
        }
        for line in 10..100_i64 {
            track.push(line * 10_000_000, turned(10.0));
        }
        let frames = track.frames(0, 900_000_000, eyes(0.063, [Fov::symmetric(1.0, 1.0); 2]));
        assert_eq!(frames[4].head_flags, head_flags::TRACKED);
        assert_eq!(frames[60].head_flags, head_flags::VALID);
    }

    #[test]
    fn recentring_keeps_pitch_and_drops_yaw_and_place() {
        let mut track = HeadTrack::new(11_111_111);
        track.push(
            0,
            pose_from_unity(Vec3::new(1.0, 2.0, 3.0), Vec3::new(10.0, 140.0, 0.0)),
        );
        track.push(
            8_000_000,
            pose_from_unity(Vec3::new(1.0, 2.0, 3.0), Vec3::new(10.0, 150.0, 0.0)),
        );
        track.recentre();
        let [first, second] = [track.updates[0].1, track.updates[1].1];
        assert!(first.position_m.length() < 1e-6);
        let forward = first.orientation * Vec3::NEG_Z;
        assert!(
            forward.x.abs() < 1e-6 && (forward.y + 10_f32.to_radians().sin()).abs() < 1e-6,
            "{forward}"
        );
        assert!(
            (second.orientation * Vec3::NEG_Z).x > 0.1,
            "ten degrees to the right of the first"
        );
    }
}
