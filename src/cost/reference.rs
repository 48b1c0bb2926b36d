//! The truth that points are judged by: a file, or the oracle's own picture within a share of time.

use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::store::{read_json, write_json};
use super::{CostError, store_error};
use crate::image::{ImageSize, LinearImage, Scatter, exr};
use crate::oracle::{Oracle, PathSettings};
use crate::scene::loaded::LoadedScene;
use crate::view::View;

/// Photons of the oracle for each of its paths, where some light needs them: chosen so that most of the time is left to paths.
const CAUSTIC_PHOTONS_PER_PATH: u32 = 4;
/// Paths a pixel below which a reference is none.
const MIN_SAMPLES: u32 = 16;

/// Name of a kept reference.
pub const PICTURE_FILE: &str = "reference.exr";
/// Name of the standard error of a kept reference.
pub const STANDARD_ERROR_FILE: &str = "reference.se.exr";
/// Name of the file that says where a kept reference comes from. It is written last: where it is, the reference is whole.
pub const ORIGIN_FILE: &str = "reference.json";

/// A reference and how sure it is.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Radiance.
    pub image: LinearImage,
    /// Standard error of each channel of each pixel, where it is known.
    pub standard_error: Option<LinearImage>,
    /// Where it comes from.
    pub origin: Origin,
}

/// Where a reference comes from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "from", rename_all = "lowercase")]
pub enum Origin {
    /// A file that the user gave.
    File {
        /// Its SHA-256.
        sha256: String,
    },
    /// The oracle.
    Oracle {
        /// Paths a pixel.
        samples: u32,
        /// Whole seconds that it took.
        seconds: u64,
    },
}

impl Reference {
    /// Reads a reference, and its standard error where a file of that name is there.
    ///
    /// # Errors
    /// [`CostError`]: an unreadable file, one that is not finite, or one whose error has another size.
    pub fn read(picture: &Path, standard_error: &Path, origin: Origin) -> Result<Self, CostError> {
        let image = exr::read(picture)?;
        let standard_error = match standard_error.is_file() {
            true => Some(exr::read(standard_error)?),
            false => None,
        };
        for picture in std::iter::once(&image).chain(&standard_error) {
            if picture.rgb.as_flattened().iter().any(|x| !x.is_finite()) {
                let fault = "it holds values that are not finite";
                return Err(CostError::Reference(fault.into()));
            }
            if (picture.width, picture.height) != (image.width, image.height) {
                let fault = "its standard error has another size";
                return Err(CostError::Reference(fault.into()));
            }
        }
        Ok(Self {
            image,
            standard_error,
            origin,
        })
    }

    /// The reference that an earlier run kept in a folder; `None` if there is none.
    ///
    /// # Errors
    /// [`CostError`]: what is there can't be read.
    pub fn kept(folder: &Path) -> Result<Option<Self>, CostError> {
        let Some(origin) = read_json(&folder.join(ORIGIN_FILE))? else {
            return Ok(None);
        };
        let [picture, standard_error] =
            [PICTURE_FILE, STANDARD_ERROR_FILE].map(|name| folder.join(name));
        Self::read(&picture, &standard_error, origin).map(Some)
    }

    /// Keeps it in a folder.
    ///
    /// # Errors
    /// [`CostError`]: the place can't be written.
    pub fn keep(&self, folder: &Path) -> Result<(), CostError> {
        // The origin last, and no other's meanwhile: a reference that has one is whole.
        let origin = folder.join(ORIGIN_FILE);
        if origin.is_file() {
            fs::remove_file(&origin).map_err(store_error("remove the file", &origin))?;
        }
        exr::write(&folder.join(PICTURE_FILE), &self.image)?;
        let standard_error = folder.join(STANDARD_ERROR_FILE);
        match &self.standard_error {
            Some(image) => exr::write(&standard_error, image)?,
            // Another reference's must not stand beside this one.
            None if standard_error.is_file() => fs::remove_file(&standard_error)
                .map_err(store_error("remove the file", &standard_error))?,
            None => {}
        }
        write_json(&origin, &self.origin)
    }

    /// SHA-256 of the picture and its standard error, as lower-case hex: what points are judged by.
    pub fn sha256(&self) -> String {
        let mut hasher = Sha256::new();
        for picture in std::iter::once(&self.image).chain(&self.standard_error) {
            hasher.update(bytemuck::cast_slice::<f32, u8>(picture.rgb.as_flattened()));
        }
        let digest = hasher.finalize();
        digest.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// Whether it is worth keeping where the oracle is given so much time now.
    pub fn is_worth(&self, limit: Duration) -> bool {
        match self.origin {
            Origin::Oracle { seconds, .. } => seconds >= limit.as_secs(),
            Origin::File { .. } => true,
        }
    }

    /// Traces paths from the eye for that long, one a pixel at a time, so that the scatter of the estimates gives the standard error.
    /// `None` if it was interrupted. `step` is told the share of the time that is over.
    pub fn trace(
        scene: &LoadedScene,
        view: View,
        size: ImageSize,
        seed: u32,
        limit: Duration,
        interrupted: &AtomicBool,
        mut step: impl FnMut(f64),
    ) -> Option<Self> {
        let pose = scene.scene.pose_at(0.0);
        let oracle = Oracle::new(&scene.scene, &scene.caster, &pose);
        let started = Instant::now();
        let mut scatter = Scatter::new(size.width as usize * size.height as usize);
        while scatter.samples() < MIN_SAMPLES || started.elapsed() < limit {
            if interrupted.load(Ordering::SeqCst) {
                return None;
            }
            let settings = PathSettings {
                samples: 1,
                depth_max: 0,
                caustic_photons: CAUSTIC_PHOTONS_PER_PATH * size.width * size.height,
                caustic_radius_m: 0.0,
                seed,
                frame: scatter.samples(),
            };
            let pixels = (size.width, size.height);
            let estimates = oracle.sums(view.pose.to_affine(), view.fov, pixels, &settings);
            scatter.add(&estimates);
            step((started.elapsed().as_secs_f64() / limit.as_secs_f64().max(1e-9)).min(1.0));
        }
        let picture = |rgb| LinearImage {
            width: size.width,
            height: size.height,
            rgb,
        };
        Some(Self {
            image: picture(scatter.mean()),
            standard_error: Some(picture(scatter.standard_error())),
            origin: Origin::Oracle {
                samples: scatter.samples(),
                seconds: started.elapsed().as_secs(),
            },
        })
    }
}
