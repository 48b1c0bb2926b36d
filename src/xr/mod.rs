//! The application's side of OpenXR: poses and gaze in, pictures out. Knows no rendering, and never which runtime it has.
//!
//! One frame, in the order of the files: [`headset`] finds runtime and system, [`interop`] makes the Vulkan device through them,
//! [`session`] keeps the states and the frame loop, [`input`] and [`eye_gaze`] read what the person does, [`views`] says where the
//! eyes are, [`swapchain`] holds the pictures that go back.
//!
//! ```no_run
//! use macula::xr::{Runtime, Step, XrApp, XrOptions};
//! # fn main() -> Result<(), macula::xr::XrError> {
//! let mut app = XrApp::connect(Runtime::System.entry()?, &XrOptions::default())?;
//! loop {
//!     match app.next_frame()? {
//!         Step::Frame(frame) => {
//!             if let Some(targets) = frame.targets() {
//!                 // Draw frame.views[k] into targets[k] and submit to app.gpu().queue, ending with the targets.
//!             }
//!             app.submit(*frame)?;
//!         }
//!         Step::Idle => {}
//!         Step::Ended(_) => break,
//!     }
//! }
//! # Ok(())
//! # }
//! ```

pub mod eye_gaze;
pub mod headset;
pub mod input;
pub mod interop;
pub mod session;
pub mod swapchain;
pub mod views;

pub use eye_gaze::{GazeRay, GazeReading};
pub use headset::{Headset, HeadsetInfo};
pub use input::{Button, ButtonChange, Hand};
pub use interop::Runtime;
pub use session::{EndReason, Frame, Step, XrApp, XrOptions};
pub use views::{EyeView, LocationFlags, TrackedPose};

use crate::gpu::GpuError;

/// Why there is no session, or why it failed.
#[derive(Debug, thiserror::Error)]
pub enum XrError {
    /// The OpenXR loader is not installed.
    #[error(
        "no OpenXR loader was found: install it (Debian and Ubuntu: libopenxr-loader1, Fedora: openxr-libs, Arch: openxr, Windows: openxr_loader.dll of the OpenXR SDK beside macula.exe), or use the simulated runtime with `--runtime sim`"
    )]
    NoLoader(#[source] openxr::EntryError),
    /// There is no runtime, or it does not run.
    #[error(
        "no OpenXR runtime answers ({0}): start SteamVR, Monado or the headset's own runtime and make it the active one, or use the simulated runtime with `--runtime sim`"
    )]
    NoRuntime(openxr::sys::Result),
    /// The runtime has no headset now.
    #[error("the OpenXR runtime {runtime} has no headset ({result}): connect it and switch it on")]
    NoHeadset {
        /// Name of the runtime.
        runtime: String,
        /// What it answered.
        result: openxr::sys::Result,
    },
    /// The runtime lacks something that macula can't do without.
    #[error("the OpenXR runtime {runtime} cannot be used: {reason}")]
    Unsuitable {
        /// Name of the runtime.
        runtime: String,
        /// What it lacks.
        reason: String,
    },
    /// The eye images asked for are empty or larger than the runtime takes.
    #[error(
        "an image of {width}x{height} per eye was asked for, but it must be from 1x1 to {max_width}x{max_height} on this runtime"
    )]
    ImageSize {
        /// Width asked for, pixels.
        width: u32,
        /// Height asked for, pixels.
        height: u32,
        /// Largest width, pixels.
        max_width: u32,
        /// Largest height, pixels.
        max_height: u32,
    },
    /// A frame was handed in that is not the one in work.
    #[error(
        "frame {submitted} was submitted, but it is not the frame in work: submit each frame once, before the next one"
    )]
    StaleFrame {
        /// Index of the frame handed in.
        submitted: u64,
    },
    /// The Vulkan device failed.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// An OpenXR call failed.
    #[error("{call} failed in the OpenXR runtime: {result:?} ({result})")]
    Call {
        /// Name of the call.
        call: &'static str,
        /// What it returned.
        result: openxr::sys::Result,
    },
}

/// For `map_err`: the error of a failed `call`.
fn failed(call: &'static str) -> impl Fn(openxr::sys::Result) -> XrError {
    move |result| XrError::Call { call, result }
}
