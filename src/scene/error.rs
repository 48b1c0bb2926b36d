//! Why a scene file is refused.

use std::error::Error;
use std::fmt;
use std::path::PathBuf;

/// A scene file that could not be loaded: which one, and why. Its message is one line with the file, the problem and the mend.
#[derive(Debug)]
pub struct SceneError {
    /// The file that was asked for.
    pub path: PathBuf,
    /// What is wrong with it.
    pub problem: SceneProblem,
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "cannot load {}: {}", self.path.display(), self.problem)
    }
}

impl Error for SceneError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.problem.source()
    }
}

/// What is wrong with a scene file; each names the thing, and the mend where there is one.
#[derive(Debug, thiserror::Error)]
pub enum SceneProblem {
    /// What was given is no glTF file at all.
    #[error(
        "{0}; a scene is a glTF 2.0 file, .glb or .gltf, such as assets/scenes/cornell.glb of macula's repository"
    )]
    NotAScene(String),
    /// A file cannot be opened or read.
    #[error("cannot read {}: check that it exists and may be read", path.display())]
    Io {
        /// The scene file, or a buffer or image that it names.
        path: PathBuf,
        /// What the system said.
        #[source]
        source: std::io::Error,
    },
    /// A GLB container that is cut short or out of order.
    #[error("{0}; export the scene again")]
    Container(String),
    /// The JSON does not parse as glTF 2.0.
    #[error("the glTF JSON is malformed; export the scene again")]
    Json(#[source] serde_json::Error),
    /// The JSON parses but breaks a rule of glTF 2.0.
    #[error("{0}")]
    Invalid(String),
    /// A vertex, transform, key or factor is NaN, infinite or absurdly far away.
    #[error("{0}")]
    NotFinite(String),
    /// The file claims more than the limits allow.
    #[error("{what}: {claimed}, but at most {limit} are accepted (LoadLimits::{field})")]
    TooLarge {
        /// What there is too much of, and where.
        what: String,
        /// How many the file claims.
        claimed: u64,
        /// How many are accepted.
        limit: u64,
        /// The field of [`super::LoadLimits`] that raises the limit.
        field: &'static str,
    },
    /// The file cannot be shown without an extension that macula does not read.
    #[error(
        "the file requires the glTF extension {0}, which macula does not read; export the scene without it"
    )]
    RequiredExtension(String),
    /// A buffer or image lies outside the scene's own folder.
    #[error(
        "{what} names `{uri}`: only files beside the scene file or below it, and data: URIs, are read"
    )]
    ForbiddenUri {
        /// Which buffer or image.
        what: String,
        /// Its URI, shortened.
        uri: String,
    },
    /// An image does not decode.
    #[error("image {what} cannot be decoded; only PNG and JPEG are read")]
    Image {
        /// Which image.
        what: String,
        /// What the decoder said.
        #[source]
        source: image::ImageError,
    },
}

impl SceneProblem {
    /// Refuses `claimed` things if there are more than `limit`.
    pub(super) fn check_limit(
        what: impl Into<String>,
        claimed: u64,
        limit: u64,
        field: &'static str,
    ) -> Result<(), Self> {
        if claimed <= limit {
            return Ok(());
        }
        Err(Self::TooLarge {
            what: what.into(),
            claimed,
            limit,
            field,
        })
    }
}
