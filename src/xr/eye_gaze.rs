//! Where the person looks (`XR_EXT_eye_gaze_interaction`), located at the frame's display time, with its flags and sample time.

use glam::Vec3;

use super::views::{LocationFlags, Viewer, pose_from_xr};
use super::{XrError, failed, interop};
use crate::view::Pose;

/// A ray: the runtime's combined gaze starts between the eyes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GazeRay {
    /// Where it starts, metres.
    pub origin_m: Vec3,
    /// Unit direction.
    pub dir: Vec3,
}

/// What the eye tracker says for one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GazeReading {
    /// The runtime delivers gaze: it has a tracker, the permission and the focus.
    pub active: bool,
    /// Which parts of the gaze in VIEW hold; below-nominal gaze (a blink) clears the tracked bits.
    pub flags: LocationFlags,
    /// The gaze in the head's space (VIEW), looking along -Z; `None` unless valid.
    pub view_from_gaze: Option<Pose>,
    /// The gaze in LOCAL; `None` unless gaze and head are valid.
    pub local_from_gaze: Option<Pose>,
    /// When the eyes were sampled, on the clock of the display times, nanoseconds; `None` where the runtime does not tell.
    pub sample_time_ns: Option<i64>,
}

impl GazeReading {
    /// No gaze.
    pub const INACTIVE: Self = Self {
        active: false,
        flags: LocationFlags(0),
        view_from_gaze: None,
        local_from_gaze: None,
        sample_time_ns: None,
    };

    /// Whether the tracker sees the eyes now.
    pub fn is_tracked(&self) -> bool {
        self.flags.is_valid() && self.flags.is_tracked()
    }

    /// The gaze ray in the head's space (VIEW).
    pub fn ray_in_view(&self) -> Option<GazeRay> {
        self.view_from_gaze.map(ray)
    }

    /// The gaze ray in LOCAL.
    pub fn ray_in_local(&self) -> Option<GazeRay> {
        self.local_from_gaze.map(ray)
    }
}

fn ray(pose: Pose) -> GazeRay {
    GazeRay {
        origin_m: pose.position_m,
        dir: pose.orientation * Vec3::NEG_Z,
    }
}

/// Focused time without any gaze after which a system that claims to track eyes is found silent, nanoseconds.
const SILENCE_LIMIT_NS: i64 = 2_000_000_000;

/// The gaze pose action and its space.
pub(super) struct EyeGaze {
    action: openxr::Action<openxr::Posef>,
    space: openxr::Space,
    silence: Silence,
}

impl EyeGaze {
    /// The interaction profile of the eyes.
    pub const PROFILE: &str = "/interaction_profiles/ext/eye_gaze_interaction";
    /// The one binding of that profile.
    pub const BINDING: &str = "/user/eyes_ext/input/gaze_ext/pose";

    /// Makes the space of `action`. Only after the action sets are attached: one runtime rejects the reverse.
    pub fn new(
        session: &openxr::Session<openxr::Vulkan>,
        action: openxr::Action<openxr::Posef>,
    ) -> Result<Self, XrError> {
        let space = action
            .create_space(session, openxr::Path::NULL, openxr::Posef::IDENTITY)
            .map_err(failed("xrCreateActionSpace"))?;
        Ok(Self {
            action,
            space,
            silence: Silence::default(),
        })
    }

    /// Reads the gaze at the display time `time`, after the actions were synchronised; `focused` is what that said.
    pub fn read(
        &mut self,
        session: &openxr::Session<openxr::Vulkan>,
        viewer: &Viewer,
        time: openxr::Time,
        focused: bool,
    ) -> Result<GazeReading, XrError> {
        let active = self
            .action
            .is_active(session, openxr::Path::NULL)
            .map_err(failed("xrGetActionStatePose"))?;
        if self.silence.is_remarkable(focused, active, time.as_nanos()) {
            tracing::warn!(
                "the headset tracks eyes but delivers no gaze: give the runtime the permission for eye tracking and calibrate it; going on without gaze"
            );
        }
        if !active {
            return Ok(GazeReading::INACTIVE);
        }
        let (in_view, sample_time) = interop::locate_gaze(&self.space, &viewer.view, time)?;
        let (in_local, _) = interop::locate_gaze(&self.space, &viewer.local, time)?;
        Ok(GazeReading {
            active,
            flags: LocationFlags(in_view.location_flags.into_raw()),
            view_from_gaze: valid_pose(in_view),
            local_from_gaze: valid_pose(in_local),
            sample_time_ns: sample_time.map(openxr::Time::as_nanos),
        })
    }
}

fn valid_pose(location: openxr::SpaceLocation) -> Option<Pose> {
    LocationFlags(location.location_flags.into_raw())
        .is_valid()
        .then(|| pose_from_xr(location.pose))
        .filter(|pose| pose.orientation.is_normalized())
}

/// Notices, once, that no gaze ever comes.
#[derive(Default)]
struct Silence {
    first_focused_ns: Option<i64>,
    settled: bool,
}

impl Silence {
    fn is_remarkable(&mut self, focused: bool, active: bool, time_ns: i64) -> bool {
        if self.settled || !focused {
            return false;
        }
        let since_ns = *self.first_focused_ns.get_or_insert(time_ns);
        let too_long = time_ns.saturating_sub(since_ns) > SILENCE_LIMIT_NS;
        self.settled = active || too_long;
        too_long && !active
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Quat;

    #[test]
    fn gaze_looks_along_minus_z_of_its_pose() {
        let pose = Pose {
            orientation: Quat::from_rotation_y(std::f32::consts::FRAC_PI_2),
            position_m: Vec3::Y,
        };
        let reading = GazeReading {
            view_from_gaze: Some(pose),
            ..GazeReading::INACTIVE
        };
        let ray = reading.ray_in_view().expect("a pose gives a ray");
        assert!(ray.dir.abs_diff_eq(Vec3::NEG_X, 1e-6));
        assert_eq!(ray.origin_m, Vec3::Y);
        assert_eq!(reading.ray_in_local(), None);
    }

    #[test]
    fn missing_gaze_is_remarked_once_and_only_after_it_had_its_chance() {
        let mut silence = Silence::default();
        assert!(
            !silence.is_remarkable(false, false, 0),
            "not focused: nothing to expect"
        );
        assert!(!silence.is_remarkable(true, false, SILENCE_LIMIT_NS));
        assert!(!silence.is_remarkable(true, false, 2 * SILENCE_LIMIT_NS));
        assert!(silence.is_remarkable(true, false, 2 * SILENCE_LIMIT_NS + 1));
        assert!(!silence.is_remarkable(true, false, 9 * SILENCE_LIMIT_NS));
    }

    #[test]
    fn a_blink_later_on_is_not_missing_gaze() {
        let mut silence = Silence::default();
        assert!(!silence.is_remarkable(true, true, 0));
        assert!(!silence.is_remarkable(true, false, 9 * SILENCE_LIMIT_NS));
    }
}
