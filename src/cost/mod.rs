//! What accuracy costs in time: settings are tried, each is timed and judged by a reference, and the trade between the two is drawn from
//! what was measured.
//!
//! 1. [`setting`] is what can be varied; [`plan`] makes the settings of a sweep.
//! 2. [`reference`](mod@reference) is the truth; [`judge`] measures frames against it, after [`resample`] has brought them to its size.
//! 3. [`measure`] runs one setting: warm-up, timed frames, errors. The result is a [`point::Point`].
//! 4. [`store`] keeps points on disk, so that none is measured twice; [`campaign`] is the run over many settings.
//! 5. [`alike`] tells settings that make the same picture, which need no two trials.
//! 6. [`search`] looks for the best setting of a frame budget, on the knobs of [`ladder`]; [`level`] for equal errors and equal times.
//! 7. [`fit`] finds the front and its power law, [`limit`] what stops a technique, [`noise`] what is chance; [`sentences`] says it in
//!    words, [`table`] writes all of it for machines.
//! 8. [`check`] tells whether one setting keeps a frame budget.
//!
//! An error is a mean over independent frames; it is split into the error of their mean (bias: more photons don't help) and the rest
//! (variance: more photons do).

pub mod alike;
pub mod campaign;
pub mod check;
pub mod fit;
pub mod judge;
pub mod ladder;
pub mod level;
pub mod limit;
pub mod measure;
pub mod noise;
pub mod plan;
pub mod point;
pub mod reference;
pub mod resample;
pub mod search;
pub mod sentences;
pub mod setting;
pub mod store;
pub mod table;

use std::io;
use std::path::{Path, PathBuf};

use crate::gpu::GpuError;
use crate::image::exr::ExrError;
use crate::params::ParamError;

/// Why accuracy and time could not be weighed.
#[derive(Debug, thiserror::Error)]
pub enum CostError {
    /// `--sweep` was given something else than KEY=V1,V2,...
    #[error(
        "`{0}` is not a sweep: write KEY=V1,V2,.. or KEY=FROM..TO*FACTOR, such as photons=1000..64000*4; FROM is above 0 and at most TO, \
         FACTOR above 1, and 64 values are the most"
    )]
    NotASweep(String),
    /// Nothing that can be varied has this name.
    #[error(
        "nothing that can be swept is called `{key}`{}; there are technique, size, passes and what `macula help params` lists",
        .nearest.as_ref().map(|key| format!(" (did you mean `{key}`?)")).unwrap_or_default()
    )]
    UnknownKey {
        /// The name given.
        key: String,
        /// The most similar one, if one is similar.
        nearest: Option<String>,
    },
    /// One of the three that are no parameters has a value that it can't have.
    #[error("`{key}` can't be `{value}`: {expected}")]
    BadValue {
        /// What was to be varied.
        key: &'static str,
        /// The value given.
        value: String,
        /// What it takes.
        expected: String,
    },
    /// A key was given in two sweeps.
    #[error("`{0}` is swept twice: give all its values in one --sweep")]
    SweptTwice(String),
    /// More settings than anybody waits for.
    #[error("the sweep asks for {0} points; {max} at most are measured: leave out values", max = plan::MAX_POINTS)]
    TooManyPoints(usize),
    /// A parameter is unknown or out of its range.
    #[error(transparent)]
    Param(#[from] ParamError),
    /// The device failed.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A picture could not be read or written.
    #[error(transparent)]
    Picture(#[from] ExrError),
    /// The reference can't judge these pictures.
    #[error("the reference can't be used: {0}")]
    Reference(String),
    /// The gaze is so far aside that no pixel is foveal.
    #[error(
        "no pixel of the picture lies in the fovea: choose a --gaze within the picture, or a larger fovea.radius_deg"
    )]
    NoFovea,
    /// One setting could not be measured.
    #[error(
        "cannot measure {setting}; leave it out of the sweep, the points measured so far are kept"
    )]
    Point {
        /// The setting in a few words.
        setting: String,
        /// Why.
        source: Box<CostError>,
    },
    /// Stored points could not be read or written.
    #[error("cannot {action} {}", path.display())]
    Store {
        /// What was tried.
        action: &'static str,
        /// On which file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

/// An error of the file system, told with the place.
fn store_error<'a>(
    action: &'static str,
    path: &'a Path,
) -> impl FnOnce(io::Error) -> CostError + 'a {
    move |source| CostError::Store {
        action,
        path: path.into(),
        source,
    }
}
