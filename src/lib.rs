//! macula: real-time global illumination that follows the eye.

pub mod gaze;
pub mod fovea;
pub mod scene;
pub mod view;
