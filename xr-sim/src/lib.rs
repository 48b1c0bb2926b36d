//! A simulated OpenXR runtime that replays recorded head and gaze sessions.
//!
//! To an application this is a runtime like any other: it negotiates with the standard loader, verifies
//! what it is given, hands out Vulkan images on the application's device and walks the session through
//! its states. Head, eyes, gaze and buttons come from a session folder ([`Config::session`]); the
//! submitted layers go nowhere, or to picture files ([`Config::capture`]).
//!
//! Two ways in:
//! * through the loader: `XR_RUNTIME_JSON` names a manifest that points at this crate's shared library
//!   ([`write_manifest`]), `XR_SIM_CONFIG` a JSON file holding a [`Config`];
//! * in this process: [`configure`], then [`get_instance_proc_addr`] as the application's entry point.
//!
//! One call, followed through the files: `table` finds the function, `api` verifies its arguments against
//! the specification and makes one call into the behaviour (`session`, `pacing`, `space`, `swapchain`,
//! `input`), which reads the `script` at a time that the `clock` gives; `vulkan` holds every call into the
//! graphics driver and `sink` composes what was submitted.

mod action;
mod api;
mod clock;
mod config;
mod event;
mod extension;
mod handle;
mod input;
mod instance;
mod negotiation;
mod pacing;
mod path;
mod pose;
mod profile;
mod runtime;
mod script;
mod session;
mod sink;
mod space;
mod swapchain;
mod table;
mod two_call;
mod vulkan;

pub use config::{
    Capture, ClockKind, Config, ConfigError, DeviceChoice, MAX_IMAGE_SIZE, PictureFormat, configure,
};
pub use negotiation::{write_manifest, xrNegotiateLoaderRuntimeInterface};
pub use script::ScriptError;
pub use table::get_instance_proc_addr;

/// What a function of the API comes to: its value, or the specification's error code.
pub(crate) type XrResult<T> = Result<T, openxr_sys::Result>;

/// Tells the person at the machine what keeps this runtime from working: through `tracing` where the
/// process listens to it, else - in an application that the loader brought here - on the standard error.
pub(crate) fn report(error: &dyn std::error::Error) {
    tracing::error!("xr-sim: {error}");
    if !tracing::dispatcher::has_been_set() {
        eprintln!("xr-sim: {error}");
    }
}
