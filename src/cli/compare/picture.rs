//! One picture against its reference.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::external::{self, FlipVerdict, FovVideoVdpVerdict};
use super::{Args, ReferenceSe};
use crate::cli::CliError;
use crate::image::{LinearImage, exr};
use crate::metrics::error::ImagePair;
use crate::metrics::region::{EccentricityLimits, EyeView, eccentricities_rad};
use crate::metrics::{self, Comparison};

/// What `compare` reports of a picture.
#[derive(Clone, Debug, Serialize)]
pub struct Judgement {
    /// The picture that was judged.
    pub image: PathBuf,
    /// What it should be.
    pub reference: PathBuf,
    /// The standard error of the reference, where its noise was taken off.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference_se: Option<PathBuf>,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// The regions' limits, where a gaze was given.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub limits: Option<Limits>,
    /// The errors.
    #[serde(flatten)]
    pub comparison: Comparison,
    /// What FLIP says, if asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flip: Option<FlipVerdict>,
    /// What FovVideoVDP says, if asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fovvideovdp: Option<FovVideoVdpVerdict>,
}

/// Where the regions end, as reported.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Limits {
    /// The fovea's limit, radians.
    pub fovea_limit_rad: f64,
    /// The transition's limit, radians.
    pub transition_limit_rad: f64,
}

impl From<EccentricityLimits> for Limits {
    fn from(limits: EccentricityLimits) -> Self {
        Self {
            fovea_limit_rad: limits.fovea_rad,
            transition_limit_rad: limits.transition_rad,
        }
    }
}

/// Reads the pictures and compares them; with a gaze, by region within `limits` too.
///
/// # Errors
/// A file that cannot be read, sizes that differ, a reference that nothing can be judged by, an external metric that fails.
pub fn judge(args: &Args, limits: EccentricityLimits) -> Result<Judgement, CliError> {
    let pictures = Pictures::read(&args.image, &args.reference, &args.reference_se)?;
    let LinearImage { width, height, .. } = pictures.candidate;
    let view = args.eye_view(width, height);
    let comparison = pictures.compare(view, limits)?;
    let exposure_ev = comparison.display_exposure_ev as f32;
    Ok(Judgement {
        image: args.image.clone(),
        reference: args.reference.clone(),
        reference_se: pictures
            .standard_error
            .as_ref()
            .map(|(path, _)| path.clone()),
        width,
        height,
        limits: view.map(|_| limits.into()),
        flip: match args.flip {
            true => Some(external::flip(&pictures, view)?),
            false => None,
        },
        fovvideovdp: match &args.fovvideovdp {
            Some(display) => Some(external::fovvideovdp(
                &pictures,
                view,
                display,
                exposure_ev,
            )?),
            None => None,
        },
        comparison,
    })
}

/// A picture, its reference and the standard error of that, all of one size.
pub(super) struct Pictures {
    pub candidate_path: PathBuf,
    pub candidate: LinearImage,
    pub reference_path: PathBuf,
    pub reference: LinearImage,
    pub standard_error: Option<(PathBuf, LinearImage)>,
}

impl Pictures {
    /// Reads them.
    pub fn read(
        candidate_path: &Path,
        reference_path: &Path,
        reference_se: &ReferenceSe,
    ) -> Result<Self, CliError> {
        let candidate = exr::read(candidate_path)?;
        let read_like = |path: &Path| -> Result<LinearImage, CliError> {
            let other = exr::read(path)?;
            if (other.width, other.height) == (candidate.width, candidate.height) {
                return Ok(other);
            }
            Err(CliError::new(format!(
                "{} is {}x{} but {} is {}x{}; render it at the reference's size",
                candidate_path.display(),
                candidate.width,
                candidate.height,
                path.display(),
                other.width,
                other.height,
            )))
        };
        let reference = read_like(reference_path)?;
        let standard_error = match reference_se {
            ReferenceSe::None => None,
            ReferenceSe::File(path) => Some(path.clone()),
            ReferenceSe::Beside => {
                Some(reference_path.with_extension("se.exr")).filter(|path| path.exists())
            }
        };
        let standard_error = match standard_error {
            Some(path) => {
                let image = read_like(&path)?;
                Some((path, image))
            }
            None => None,
        };
        Ok(Self {
            candidate_path: candidate_path.into(),
            reference_path: reference_path.into(),
            candidate,
            reference,
            standard_error,
        })
    }

    /// As the metrics take them.
    pub fn pair(&self) -> ImagePair<'_> {
        ImagePair {
            width: self.candidate.width as usize,
            candidate: &self.candidate.rgb,
            reference: &self.reference.rgb,
            reference_standard_error: self
                .standard_error
                .as_ref()
                .map(|(_, image)| image.rgb.as_slice()),
        }
    }

    /// The angle of each pixel from the gaze, radians.
    pub fn eccentricity_rad(&self, view: EyeView) -> Vec<f64> {
        let (width, height) = (
            self.candidate.width as usize,
            self.candidate.height as usize,
        );
        eccentricities_rad(view.fov, width, height, view.gaze_dir_in_view)
    }

    /// The errors; with a view, by region too.
    pub fn compare(
        &self,
        view: Option<EyeView>,
        limits: EccentricityLimits,
    ) -> Result<Comparison, CliError> {
        let angles = view.map(|view| self.eccentricity_rad(view));
        let regions = angles.as_deref().map(|angles| (angles, limits));
        metrics::compare(self.pair(), regions).map_err(|error| {
            CliError::because(
                format!(
                    "cannot compare {} with {}",
                    self.candidate_path.display(),
                    self.reference_path.display()
                ),
                error,
            )
        })
    }
}
