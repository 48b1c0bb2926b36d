//! Recorded, live and fixed gaze: from samples and session folders to one steady direction a frame.
//!
//! In the order of the data: [`sample`] is what an eye tracker says, [`trace`] keeps it on disk and reads it back,
//! [`import`] turns other formats into the same session, [`events`] finds saccades, fixations, pursuits and blinks,
//! [`filter`] steadies a fixation, [`source`] answers "where does the wearer look in this frame", [`summary`] tells what a
//! session holds, and [`synthetic`] makes the recording that is bundled with the project.
//!
//! Time is always an argument, int64 nanoseconds of `XrTime`. Space is OpenXR's: +X right, +Y up, -Z forward, metres,
//! radians; VIEW moves with the head, LOCAL stays with the room.

pub mod events;
pub mod filter;
pub mod import;
pub mod sample;
pub mod source;
pub mod summary;
pub mod synthetic;
pub mod trace;

pub use sample::{EyeSample, GazeRay, GazeSample};
pub use source::{GazeReading, GazeSource, GazeState};
pub use trace::Session;
