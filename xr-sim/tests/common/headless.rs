//! A headless application with a gaze action and buttons, through the raw functions where openxr hides codes.

use openxr as xr;
use openxr::sys::{self, Handle as _};

/// A session without graphics, begun, with its action sets attached.
pub struct Headless {
    pub instance: xr::Instance,
    pub system: xr::SystemId,
    pub session: xr::Session<xr::Headless>,
    pub waiter: xr::FrameWaiter,
    pub stream: xr::FrameStream<xr::Headless>,
    pub set: xr::ActionSet,
    pub gaze: xr::Action<xr::Posef>,
    pub gaze_space: xr::Space,
    pub select: xr::Action<bool>,
    pub trigger: xr::Action<f32>,
    pub view: xr::Space,
    pub local: xr::Space,
}

/// What xrLocateSpace tells of the gaze.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gaze {
    pub flags: u64,
    pub position: [f32; 3],
    /// -Z of the pose.
    pub direction: [f32; 3],
    pub sample_time_ns: i64,
}

impl Headless {
    pub fn new(version: xr::Version) -> Self {
        let (instance, system) = super::instance(&super::entry(), version);
        // SAFETY: a session without graphics needs no handles
        let (session, waiter, stream) = unsafe {
            instance.create_session::<xr::Headless>(system, &xr::headless::SessionCreateInfo {})
        }
        .unwrap();
        let set = instance.create_action_set("main", "Main", 0).unwrap();
        let hands = ["/user/hand/left", "/user/hand/right"]
            .map(|hand| instance.string_to_path(hand).unwrap());
        let gaze = set.create_action("gaze", "Gaze", &[]).unwrap();
        let select = set.create_action("select", "Select", &hands).unwrap();
        let trigger = set.create_action("trigger", "Trigger", &hands).unwrap();
        let path = |path: &str| instance.string_to_path(path).unwrap();
        instance
            .suggest_interaction_profile_bindings(
                path("/interaction_profiles/ext/eye_gaze_interaction"),
                &[xr::Binding::new(
                    &gaze,
                    path("/user/eyes_ext/input/gaze_ext/pose"),
                )],
            )
            .unwrap();
        instance
            .suggest_interaction_profile_bindings(
                path("/interaction_profiles/oculus/touch_controller"),
                &[
                    xr::Binding::new(&select, path("/user/hand/left/input/trigger")),
                    xr::Binding::new(&select, path("/user/hand/right/input/trigger")),
                    xr::Binding::new(&trigger, path("/user/hand/left/input/trigger/value")),
                    xr::Binding::new(&trigger, path("/user/hand/right/input/trigger/value")),
                ],
            )
            .unwrap();
        session.attach_action_sets(&[&set]).unwrap();
        let identity = xr::Posef::IDENTITY;
        let gaze_space = gaze
            .create_space(&session, xr::Path::NULL, identity)
            .unwrap();
        let view = session
            .create_reference_space(xr::ReferenceSpaceType::VIEW, identity)
            .unwrap();
        let local = session
            .create_reference_space(xr::ReferenceSpaceType::LOCAL, identity)
            .unwrap();
        session
            .begin(xr::ViewConfigurationType::PRIMARY_STEREO)
            .unwrap();
        Self {
            instance,
            system,
            session,
            waiter,
            stream,
            set,
            gaze,
            gaze_space,
            select,
            trigger,
            view,
            local,
        }
    }

    /// Goes through one frame with its synchronisation; the predicted display time.
    pub fn frame(&mut self) -> xr::Time {
        let state = self.waiter.wait().unwrap();
        assert!(
            !state.should_render,
            "nothing is rendered without a display"
        );
        self.stream.begin().unwrap();
        self.session.sync_actions(&[(&self.set).into()]).unwrap();
        self.stream
            .end(
                state.predicted_display_time,
                xr::EnvironmentBlendMode::OPAQUE,
                &[],
            )
            .unwrap();
        state.predicted_display_time
    }

    /// Whether the gaze action is active.
    pub fn is_gaze_active(&self) -> bool {
        self.gaze.is_active(&self.session, xr::Path::NULL).unwrap()
    }

    /// Locates the gaze with its sample time, which openxr has no wrapper for.
    pub fn locate_gaze(&self, base: &xr::Space, time: xr::Time) -> Gaze {
        let mut sample = sys::EyeGazeSampleTimeEXT {
            ty: sys::EyeGazeSampleTimeEXT::TYPE,
            next: std::ptr::null_mut(),
            time: xr::Time::from_nanos(-1),
        };
        let mut location = sys::SpaceLocation::out((&raw mut sample).cast());
        // SAFETY: valid handles, structures of their types
        let location = unsafe {
            let locate = self.instance.fp().locate_space;
            let code = locate(
                self.gaze_space.as_raw(),
                base.as_raw(),
                time,
                location.as_mut_ptr(),
            );
            assert_eq!(code, sys::Result::SUCCESS);
            location.assume_init()
        };
        let xr::Quaternionf { x, y, z, w } = location.pose.orientation;
        let xr::Vector3f {
            x: px,
            y: py,
            z: pz,
        } = location.pose.position;
        Gaze {
            flags: location.location_flags.into_raw(),
            position: [px, py, pz],
            direction: [
                -2.0 * (x * z + w * y),
                -2.0 * (y * z - w * x),
                2.0 * (x * x + y * y) - 1.0,
            ],
            sample_time_ns: sample.time.as_nanos(),
        }
    }

    /// What the headset says of eye gaze.
    pub fn supports_eye_gaze(&self) -> bool {
        let mut gaze = sys::SystemEyeGazeInteractionPropertiesEXT {
            ty: sys::SystemEyeGazeInteractionPropertiesEXT::TYPE,
            next: std::ptr::null_mut(),
            supports_eye_gaze_interaction: sys::Bool32::from_raw(2),
        };
        let mut properties = sys::SystemProperties::out((&raw mut gaze).cast());
        // SAFETY: valid handles, structures of their types
        let code = unsafe {
            (self.instance.fp().get_system_properties)(
                self.instance.as_raw(),
                self.system,
                properties.as_mut_ptr(),
            )
        };
        assert_eq!(code, sys::Result::SUCCESS);
        assert!(
            gaze.supports_eye_gaze_interaction.into_raw() < 2,
            "it was told"
        );
        gaze.supports_eye_gaze_interaction.into()
    }

    /// The queue's events: profile changes, session states.
    pub fn events(&self) -> Vec<String> {
        let mut buffer = xr::EventDataBuffer::new();
        let mut events = Vec::new();
        while let Some(event) = self.instance.poll_event(&mut buffer).unwrap() {
            events.push(match event {
                xr::Event::SessionStateChanged(change) => format!("{:?}", change.state()),
                xr::Event::InteractionProfileChanged(_) => "profile".into(),
                _ => "other".into(),
            });
        }
        events
    }

    /// The name of the profile in use at a user path.
    pub fn profile(&self, user: &str) -> Option<String> {
        let user = self.instance.string_to_path(user).unwrap();
        let profile = self.session.current_interaction_profile(user).unwrap();
        (profile != xr::Path::NULL).then(|| self.instance.path_to_string(profile).unwrap())
    }

    /// The raw handle, for calls that openxr wouldn't make.
    pub fn raw(&self) -> u64 {
        self.session.as_raw().into_raw()
    }
}
