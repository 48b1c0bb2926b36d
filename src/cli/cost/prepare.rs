//! What `macula cost` measures, and what it judges by.

use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use super::super::common::ImageSize;
use super::super::compare::GazeAngles;
use super::super::progress::Progress;
use super::super::run_record::{RUN_FILE, file_sha256};
use super::super::{CliError, CliResult};
use super::Args;
use crate::cost::CostError;
use crate::cost::measure::MEASUREMENT_VERSION;
use crate::cost::plan::{self, Axis};
use crate::cost::reference::{Origin, Reference};
use crate::cost::setting::Setting;
use crate::cost::store::{Store, Study};
use crate::metrics::region::{EccentricityLimits, Region, eccentricities_rad};
use crate::scene::loaded::LoadedScene;
use crate::scene::{Camera, Scene};

/// The settings of the sweep, or of the one that is made when none is asked for.
pub(super) fn settings(args: &Args, base: &Setting) -> Result<Vec<Setting>, CliError> {
    let planned = match args.sweep.is_empty() {
        true => plan::default_plan(base),
        false => args
            .sweep
            .iter()
            .map(|text| Axis::parse(text))
            .collect::<Result<Vec<_>, _>>()
            .and_then(|axes| plan::factorial(base, &axes)),
    };
    planned.map_err(|error| CliError::from(error).in_arguments())
}

/// What all points have in common.
pub(super) fn study(
    args: &Args,
    base: &Setting,
    settings: &[Setting],
    scene: &Scene,
    camera: &Camera,
    gaze: GazeAngles,
) -> Result<Study, CliError> {
    let pixels = |size: &ImageSize| u64::from(size.width) * u64::from(size.height);
    let largest = settings
        .iter()
        .map(|setting| setting.size)
        .max_by_key(pixels);
    let reference_size = largest.unwrap_or(base.size);
    let other_shape = settings
        .iter()
        .map(|setting| setting.size)
        .find(|size| !has_shape(*size, reference_size));
    if let Some(size) = other_shape {
        let message = format!(
            "{size} has another shape than {reference_size}: it shows more or less of the scene, and can't be judged by one reference; \
             sweep sizes of one aspect ratio"
        );
        return Err(CliError::new(message).in_arguments());
    }
    Ok(Study {
        measurement_version: MEASUREMENT_VERSION,
        scene_sha256: scene.content_sha256.clone(),
        camera: camera.name.clone(),
        gaze_deg: [gaze.azimuth_deg, gaze.elevation_deg],
        regions_deg: [
            base.params.fovea.radius_deg,
            base.params.fovea.transition_deg,
        ]
        .map(f64::from),
        reference_size,
        reference_sha256: match &args.reference {
            Some(path) => Some(reference_sha256(path)?),
            None => None,
        },
    })
}

/// Whether two sizes have one aspect ratio, to the pixel.
fn has_shape(size: ImageSize, of: ImageSize) -> bool {
    let width = f64::from(of.width) * f64::from(size.height) / f64::from(of.height);
    (width - f64::from(size.width)).abs() <= 1.0
}

/// Refuses a folder that holds points of another study.
pub(super) fn check_study(folder: &Path, study: &Study) -> CliResult {
    let name = folder.display();
    if !may_hold_points(folder)? {
        return Err(CliError::new(format!(
            "{name} holds what another command made; choose another --out, or pass --force to replace it"
        )));
    }
    let found = Study::of_points(folder)?;
    match found.and_then(|found| found.difference(study)) {
        None => Ok(()),
        Some(what) => Err(CliError::new(format!(
            "{name} holds points that can't stand beside those asked for: {what} differs; choose another --out, or pass --force to \
             start anew"
        ))),
    }
}

/// The SHA-256 of a reference.
fn reference_sha256(path: &Path) -> Result<String, CliError> {
    file_sha256(path).map_err(|error| CliError {
        message: format!(
            "{}: check that it exists; `macula render SCENE --technique path --out NAME.exr` writes a reference",
            error.message
        ),
        ..error
    })
}

/// Whether a folder says what its points have in common, or holds nothing but the beginnings of such a one.
fn may_hold_points(folder: &Path) -> Result<bool, CliError> {
    let look = |error| CliError::because(format!("cannot look into {}", folder.display()), error);
    if Study::read(folder)?.is_some() {
        return Ok(true);
    }
    for entry in fs::read_dir(folder).map_err(look)? {
        let name = entry.map_err(look)?.file_name();
        // A file has another ending until it is whole.
        let name = Path::new(&name);
        let is_partial = name.extension().is_some_and(|end| end == "partial");
        let is_begun = |known: &str| {
            name == Path::new(known)
                || is_partial && name.file_stem() == Path::new(known).file_stem()
        };
        if !is_begun(RUN_FILE) && !Store::CARRIED.into_iter().any(is_begun) {
            return Ok(false);
        }
    }
    Ok(true)
}

/// The reference: the one that an earlier run left, a file, or the oracle's picture. `None` if it was interrupted.
pub(super) fn reference(
    args: &Args,
    base: &Setting,
    study: &Study,
    scene: &LoadedScene,
    camera: &Camera,
    folder: &Path,
    interrupted: &AtomicBool,
) -> Result<Option<Reference>, CliError> {
    let size = study.reference_size;
    if let Some(path) = &args.reference {
        let origin = Origin::File {
            sha256: study.reference_sha256.clone().unwrap_or_default(),
        };
        let reference = Reference::read(path, &path.with_extension("se.exr"), origin)?;
        let found = ImageSize {
            width: reference.image.width,
            height: reference.image.height,
        };
        if found != size {
            return Err(CliError::new(format!(
                "{} has {found} pixels, but the largest size asked for is {size}: pass --size {found}",
                path.display()
            )));
        }
        reference.keep(folder)?;
        return Ok(Some(reference));
    }
    // More time than before asks for another reference, and points are judged anew; so does another question.
    if Study::read(folder)?.is_some_and(|found| found.difference(study).is_none())
        && let Some(kept) = Reference::kept(folder)?
        && kept.is_worth(args.reference_seconds)
    {
        return Ok(Some(kept));
    }
    /// Steps of the bar.
    const STEPS: u64 = 100;
    let progress = Progress::new("rendering the reference", STEPS, "%");
    let mut done = 0;
    let reference = Reference::trace(
        scene,
        camera.view(size.width, size.height),
        size,
        // Another seed than the frames': a path tracer must not be judged by its own random numbers.
        !base.params.random.seed,
        args.reference_seconds,
        interrupted,
        |share| {
            let steps = (share * STEPS as f64) as u64;
            progress.advance(steps - done);
            done = steps;
        },
    );
    if let Some(reference) = &reference {
        reference.keep(folder)?;
    }
    Ok(reference)
}

/// The angle of each pixel of the reference from the gaze, radians.
///
/// # Errors
/// No pixel is foveal.
pub(super) fn angles_rad(
    base: &Setting,
    study: &Study,
    camera: &Camera,
    gaze: GazeAngles,
) -> Result<Vec<f64>, CostError> {
    let ImageSize { width, height } = study.reference_size;
    let fov = camera.view(width, height).fov;
    let gaze_dir_in_view = gaze.dir_in_view();
    let angles = eccentricities_rad(fov, width as usize, height as usize, gaze_dir_in_view);
    let is_foveal = |angle: &f64| limits(base).region(*angle) == Region::Fovea;
    match angles.iter().any(is_foveal) {
        true => Ok(angles),
        false => Err(CostError::NoFovea),
    }
}

/// Where the regions end.
pub(super) fn limits(base: &Setting) -> EccentricityLimits {
    let fovea = &base.params.fovea;
    EccentricityLimits {
        fovea_rad: f64::from(fovea.radius_deg).to_radians(),
        transition_rad: f64::from(fovea.transition_deg).to_radians(),
    }
}
