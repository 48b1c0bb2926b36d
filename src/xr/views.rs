//! Where head and eyes are at a frame's display time, in the LOCAL space: gravity-aligned, origin near the first head pose.

use glam::{Quat, Vec3};

use super::{XrError, failed};
use crate::view::{Fov, Pose, View};

/// What is known of a pose: the bits of `XrSpaceLocationFlags` (`XrViewStateFlags` has the same).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LocationFlags(pub u64);

impl LocationFlags {
    /// The orientation holds.
    pub const ORIENTATION_VALID: u64 = 1;
    /// The position holds.
    pub const POSITION_VALID: u64 = 2;
    /// The orientation is being measured, not carried on.
    pub const ORIENTATION_TRACKED: u64 = 4;
    /// The position is being measured, not carried on.
    pub const POSITION_TRACKED: u64 = 8;

    /// Whether orientation and position both hold.
    pub fn is_valid(self) -> bool {
        self.has(Self::ORIENTATION_VALID | Self::POSITION_VALID)
    }

    /// Whether orientation and position are both being measured.
    pub fn is_tracked(self) -> bool {
        self.has(Self::ORIENTATION_TRACKED | Self::POSITION_TRACKED)
    }

    fn has(self, bits: u64) -> bool {
        self.0 & bits == bits
    }
}

/// A pose and what is known of it. The parts that are not valid are those last known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackedPose {
    /// Metres, in the space that the variable's name says.
    pub pose: Pose,
    /// Which parts hold.
    pub flags: LocationFlags,
}

/// One eye of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EyeView {
    /// Pose (`local_from_eye`, metres) and field of view. The parts that are not valid are those last known.
    pub view: View,
    /// Which parts of the pose hold.
    pub flags: LocationFlags,
}

impl EyeView {
    /// Whether there is something to render with: a pose that was known at least once, and a field of view that spans a picture.
    pub(super) fn is_renderable(&self) -> bool {
        self.view.is_drawable()
    }
}

/// Locates the head and both eyes, and keeps the last known poses for when tracking is lost.
pub(super) struct Viewer {
    /// LOCAL.
    pub local: openxr::Space,
    /// VIEW.
    pub view: openxr::Space,
    local_from_head: Pose,
    eyes: [View; 2],
}

/// Before anything was located: not a pose to render with.
const UNKNOWN: Pose = Pose {
    orientation: Quat::from_xyzw(0.0, 0.0, 0.0, 0.0),
    position_m: Vec3::ZERO,
};

impl Viewer {
    pub fn new(session: &openxr::Session<openxr::Vulkan>) -> Result<Self, XrError> {
        let space = |kind| {
            session
                .create_reference_space(kind, openxr::Posef::IDENTITY)
                .map_err(failed("xrCreateReferenceSpace"))
        };
        let no_fov = Fov {
            left_rad: 0.0,
            right_rad: 0.0,
            up_rad: 0.0,
            down_rad: 0.0,
        };
        Ok(Self {
            local: space(openxr::ReferenceSpaceType::LOCAL)?,
            view: space(openxr::ReferenceSpaceType::VIEW)?,
            local_from_head: Pose::IDENTITY,
            eyes: [View {
                pose: UNKNOWN,
                fov: no_fov,
            }; 2],
        })
    }

    /// The head at `time`.
    pub fn head(&mut self, time: openxr::Time) -> Result<TrackedPose, XrError> {
        let location = self
            .view
            .locate(&self.local, time)
            .map_err(failed("xrLocateSpace"))?;
        let flags = LocationFlags(location.location_flags.into_raw());
        self.local_from_head = known_parts(flags, location.pose, self.local_from_head);
        Ok(TrackedPose {
            pose: self.local_from_head,
            flags,
        })
    }

    /// The left and the right eye at `time`.
    pub fn eyes(
        &mut self,
        session: &openxr::Session<openxr::Vulkan>,
        time: openxr::Time,
    ) -> Result<[EyeView; 2], XrError> {
        let (state, views) = session
            .locate_views(
                openxr::ViewConfigurationType::PRIMARY_STEREO,
                time,
                &self.local,
            )
            .map_err(failed("xrLocateViews"))?;
        let flags = LocationFlags(state.into_raw());
        for (eye, located) in self.eyes.iter_mut().zip(&views) {
            eye.pose = known_parts(flags, located.pose, eye.pose);
            let fov = fov_from_xr(located.fov);
            if fov.is_valid() {
                eye.fov = fov;
            }
        }
        Ok(self.eyes.map(|view| EyeView { view, flags }))
    }
}

/// The valid parts of `located`, the others from `last`.
fn known_parts(flags: LocationFlags, located: openxr::Posef, last: Pose) -> Pose {
    let located = pose_from_xr(located);
    let orientation_holds =
        flags.has(LocationFlags::ORIENTATION_VALID) && located.orientation.is_normalized();
    let position_holds = flags.has(LocationFlags::POSITION_VALID) && located.position_m.is_finite();
    Pose {
        orientation: if orientation_holds {
            located.orientation
        } else {
            last.orientation
        },
        position_m: if position_holds {
            located.position_m
        } else {
            last.position_m
        },
    }
}

/// A valid pose as the runtime gives it, with the rounding taken out of its quaternion.
pub(super) fn pose_from_xr(pose: openxr::Posef) -> Pose {
    let (q, p) = (pose.orientation, pose.position);
    Pose {
        orientation: Quat::from_xyzw(q.x, q.y, q.z, q.w).normalize(),
        position_m: Vec3::new(p.x, p.y, p.z),
    }
}

/// The way back of [`pose_from_xr`].
pub(super) fn pose_to_xr(pose: Pose) -> openxr::Posef {
    let (q, p) = (pose.orientation, pose.position_m);
    openxr::Posef {
        orientation: openxr::Quaternionf {
            x: q.x,
            y: q.y,
            z: q.z,
            w: q.w,
        },
        position: openxr::Vector3f {
            x: p.x,
            y: p.y,
            z: p.z,
        },
    }
}

fn fov_from_xr(fov: openxr::Fovf) -> Fov {
    Fov {
        left_rad: fov.angle_left,
        right_rad: fov.angle_right,
        up_rad: fov.angle_up,
        down_rad: fov.angle_down,
    }
}

/// The way back of `fov_from_xr`.
pub(super) fn fov_to_xr(fov: Fov) -> openxr::Fovf {
    openxr::Fovf {
        angle_left: fov.left_rad,
        angle_right: fov.right_rad,
        angle_up: fov.up_rad,
        angle_down: fov.down_rad,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HERE: Pose = Pose {
        orientation: Quat::IDENTITY,
        position_m: Vec3::X,
    };

    fn located() -> openxr::Posef {
        pose_to_xr(Pose {
            orientation: Quat::from_rotation_y(1.0),
            position_m: Vec3::Y,
        })
    }

    #[test]
    fn a_lost_position_is_held_while_the_orientation_goes_on() {
        let flags = LocationFlags(LocationFlags::ORIENTATION_VALID);
        let pose = known_parts(flags, located(), HERE);
        assert_eq!(pose.position_m, Vec3::X);
        assert!(pose.orientation.angle_between(Quat::from_rotation_y(1.0)) < 1e-3);
    }

    #[test]
    fn a_lost_pose_is_held_whole_and_a_valid_one_taken_whole() {
        assert_eq!(
            known_parts(LocationFlags(0), openxr::Posef::default(), HERE),
            HERE
        );
        assert_eq!(
            known_parts(LocationFlags(3), located(), HERE),
            pose_from_xr(located())
        );
    }

    #[test]
    fn a_zero_quaternion_is_no_orientation_whatever_its_flags_say() {
        let pose = known_parts(LocationFlags(15), openxr::Posef::default(), HERE);
        assert_eq!(pose.orientation, Quat::IDENTITY);
        assert_eq!(pose.position_m, Vec3::ZERO);
    }

    #[test]
    fn valid_and_tracked_need_both_their_bits() {
        assert!(LocationFlags(3).is_valid() && !LocationFlags(3).is_tracked());
        assert!(LocationFlags(15).is_valid() && LocationFlags(15).is_tracked());
        assert!(!LocationFlags(1).is_valid() && !LocationFlags(4).is_tracked());
    }

    #[test]
    fn nothing_is_rendered_with_a_pose_that_was_never_known() {
        let fov = Fov::symmetric(1.0, 1.0);
        let flags = LocationFlags(0);
        assert!(
            !EyeView {
                view: View { pose: UNKNOWN, fov },
                flags
            }
            .is_renderable()
        );
        assert!(
            EyeView {
                view: View { pose: HERE, fov },
                flags
            }
            .is_renderable()
        );
    }
}
