//! macula: real-time global illumination that follows the eye.
//!
//! A frame, in the order of the modules that it passes:
//!
//! 1. [`session`] runs the loop. [`xr`] gives it a frame from OpenXR: when it will be shown, where head and eyes are, where the eyes look.
//! 2. [`frame`] turns that into a picture for each eye, one stage after the other:
//!    1. [`scene`] moves objects and lights to where they are at that time.
//!    2. [`gaze`] makes one steady gaze ray of the newest sample, through blinks and losses.
//!    3. [`fovea`] cuts it with the scene, aims each eye at the point, and says where the regions end.
//!    4. [`technique`] names what runs: [`photon`] traces light from the lamps into a sorted map, [`gather`] follows each eye's pixels to the
//!       surfaces that they see and sums the light there.
//!    5. [`image`] exposes the result and draws it onto the headset's image.
//! 3. [`xr`] hands it to the compositor.
//!
//! All of it computes through [`gpu`] and is set by [`params`]; [`view`] is the one convention of eyes and images. [`still`] makes one
//! picture from a fixed camera in place of a session. [`report`] shows people what a session did, [`metrics`] judges a picture by its
//! reference, [`oracle`] computes one slowly, and [`cli`] is the program around it: nothing else prints, reads the environment or ends the process.
//!
//! Lengths are metres, angles radians, times nanoseconds of `XrTime`; light is linear radiance in W/(m² sr). `ARCHITECTURE.md` has the
//! conventions, and the reasons for what was decided.

pub mod cli;
pub mod cost;
pub mod effect_cost;
pub mod file_kind;
pub mod fovea;
pub mod frame;
pub mod gather;
pub mod gaze;
pub mod gpu;
pub mod image;
pub mod metrics;
pub mod oracle;
pub mod params;
pub mod photon;
pub mod report;
pub mod scene;
pub mod session;
pub mod still;
pub mod technique;
pub mod view;
pub mod xr;
