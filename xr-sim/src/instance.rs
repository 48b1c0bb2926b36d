//! An application's connection to the runtime, and the one system that it finds there.

use std::collections::HashMap;
use std::sync::Arc;

use openxr_sys as sys;

use crate::XrResult;
use crate::clock::Clock;
use crate::config::Setup;
use crate::event::EventQueue;
use crate::extension::{Extension, ExtensionSet};
use crate::handle::Object;
use crate::input::Suggestion;
use crate::pacing::Pacing;
use crate::path::PathTable;
use crate::vulkan::DriverChoice;

/// The one headset, there from the start.
const SYSTEM: u64 = 1;

pub(crate) struct Instance {
    pub api_version: sys::Version,
    pub extensions: ExtensionSet,
    pub setup: Arc<Setup>,
    pub clock: Clock,
    pub paths: PathTable,
    pub events: EventQueue,
    /// The suggested bindings, by interaction profile.
    pub suggestions: HashMap<&'static str, Vec<Suggestion>>,
    /// What the application asked of Vulkan, in the order in which it has to ask.
    pub driver: DriverChoice,
}

impl Object for Instance {
    type Handle = sys::Instance;
    const KIND: u8 = 1;
}

impl Instance {
    pub fn new(api_version: sys::Version, extensions: ExtensionSet, setup: Arc<Setup>) -> Self {
        let first_frame_ns = Pacing::new(setup.clone()).first_frame_ns();
        Self {
            api_version,
            extensions,
            clock: Clock::start(setup.config.clock, first_frame_ns),
            setup,
            paths: PathTable::default(),
            events: EventQueue::default(),
            suggestions: HashMap::new(),
            driver: DriverChoice::default(),
        }
    }

    /// The headset.
    pub fn system(&self) -> sys::SystemId {
        sys::SystemId::from_raw(SYSTEM)
    }

    /// `SYSTEM_INVALID` for anything but the headset.
    pub fn verify_system(&self, system: sys::SystemId) -> XrResult<()> {
        if system == self.system() {
            Ok(())
        } else {
            Err(sys::Result::ERROR_SYSTEM_INVALID)
        }
    }

    /// Whether this is an application of OpenXR 1.1 or later.
    pub fn is_1_1(&self) -> bool {
        self.api_version >= sys::Version::new(1, 1, 0)
    }

    /// Whether the headset tracks eyes, and the application may know.
    pub fn has_eye_gaze(&self) -> bool {
        self.extensions.contains(Extension::EyeGazeInteraction)
            && self.setup.config.eye_gaze
            && self.setup.script.has_gaze()
    }
}
