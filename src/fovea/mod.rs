//! From the gaze to what each part of the picture is worth: pure functions of angles, nothing of devices or files.
//!
//! [`fixation`] turns one gaze ray into the point that is looked at and a direction for each eye; [`region`] turns a pixel's
//! angle from that direction into fovea, transition or periphery; [`acuity`] is what the eye resolves there.

pub mod acuity;
pub mod fixation;
pub mod region;

pub use acuity::Acuity;
pub use fixation::{Fixation, FixationParams};
pub use region::{Region, Regions, eccentricity_rad};
