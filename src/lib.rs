//! macula: real-time global illumination that follows the eye.

pub mod cli;
pub mod fovea;
pub mod frame;
pub mod gather;
pub mod gaze;
pub mod gpu;
pub mod image;
pub mod metrics;
pub mod params;
pub mod photon;
pub mod report;
pub mod scene;
pub mod session;
pub mod still;
pub mod technique;
pub mod view;
pub mod xr;
