//! macula: real-time global illumination that follows the eye.

pub mod cli;
pub mod fovea;
pub mod gaze;
pub mod gpu;
pub mod image;
pub mod metrics;
pub mod params;
pub mod report;
pub mod scene;
pub mod view;
