//! The recording that a session replays: heads, eyes, gaze and buttons of a native session folder, at any time.
//!
//! The folder holds `frames.csv` (what was shown when, to which head), and perhaps `gaze.csv` and
//! `events.csv`. Times are nanoseconds, lengths metres, angles radians; axes are OpenXR's.

mod buttons;
mod frames;
mod gaze;
mod table;

use std::path::Path;

pub(crate) use buttons::Hand;
pub(crate) use frames::{DEFAULT_PERIOD_NS, Eye, Frame, HeadPose, TRACKED};
pub(crate) use gaze::GazeSample;
pub use table::ScriptError;

use buttons::Buttons;
use gaze::Gaze;

/// A recording, or the still head that stands in for one. Every question is asked with a time.
#[derive(Debug)]
pub(crate) struct Script {
    frames: Vec<Frame>,
    gaze: Gaze,
    buttons: Buttons,
}

impl Script {
    /// A head at rest with its gaze ahead, for ever.
    pub fn still() -> Self {
        Self {
            frames: Vec::new(),
            gaze: Gaze::Ahead,
            buttons: Buttons::default(),
        }
    }

    /// Reads a session folder.
    ///
    /// # Errors
    /// A file that is missing, unreadable, too large or damaged, named with its line and column.
    pub fn load(folder: &Path) -> Result<Self, ScriptError> {
        Ok(Self {
            frames: frames::read(&folder.join("frames.csv"))?,
            gaze: gaze::read(&folder.join("gaze.csv"))?,
            buttons: buttons::read(&folder.join("events.csv"))?,
        })
    }

    /// The recorded frames, in ascending order of time. Empty: without end, at a steady pace.
    pub fn frames(&self) -> &[Frame] {
        &self.frames
    }

    /// The head at that time: interpolated between frames, held before the first and after the last.
    pub fn head(&self, time_ns: i64) -> HeadPose {
        frames::head(&self.frames, time_ns)
    }

    /// The left and right eye of the latest frame not after that time.
    pub fn eyes(&self, time_ns: i64) -> [Eye; 2] {
        frames::latest(&self.frames, time_ns).map_or(Eye::DEFAULT, |frame| frame.eyes)
    }

    /// Whether there is any gaze to be had.
    pub fn has_gaze(&self) -> bool {
        !matches!(self.gaze, Gaze::None)
    }

    /// The latest sample not after that time, unless it is too old to stand for it.
    pub fn gaze(&self, time_ns: i64) -> Option<GazeSample> {
        self.gaze.at(time_ns)
    }

    /// How far a hand's input (`trigger`, `select`, ...) is pressed at that time, 0 to 1.
    pub fn pressed(&self, hand: Hand, input: &str, time_ns: i64) -> f32 {
        self.buttons.pressed(hand, input, time_ns)
    }
}

#[cfg(test)]
mod tests;
