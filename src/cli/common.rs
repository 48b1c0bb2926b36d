//! What several subcommands do alike: parameters, device, scene, technique, sizes.

use std::error::Error;
use std::fs;
use std::path::Path;

use super::run_defaults::{RUN_KEYS, RUN_TABLE, RunDefaults};
use super::{CliError, Globals};
use crate::gpu::{GpuDevice, GpuError, Headless};
pub use crate::image::ImageSize;
use crate::params::Params;
use crate::scene::{Camera, Scene};
use crate::technique::{self, TechniqueEntry};

/// The technique where nobody names one.
pub const DEFAULT_TECHNIQUE: &str = "pm-direct";
/// Pixels of a picture where nobody says how many.
pub const DEFAULT_SIZE: ImageSize = ImageSize {
    width: 512,
    height: 512,
};

/// The parameters: defaults, then `--params`, then each `--set`.
///
/// # Errors
/// An unreadable file, an unknown key, a value out of range.
pub fn params(globals: &Globals) -> Result<Params, CliError> {
    settings(globals).map(|(params, _)| params)
}

/// The parameters, and the table `[run]` of the parameter file.
///
/// # Errors
/// As for [`params`].
pub fn settings(globals: &Globals) -> Result<(Params, RunDefaults), CliError> {
    let mut params = Params::default();
    let mut run = RunDefaults::default();
    if let Some(path) = &globals.params {
        let unusable = |error: Box<dyn Error + Send + Sync>| {
            CliError::because(
                format!("cannot use the parameter file {}", path.display()),
                error,
            )
        };
        let text = fs::read_to_string(path).map_err(|error| {
            CliError::because(
                format!(
                    "cannot read the parameter file {}: it must be TOML text, with [room] and name = value as `macula help params` lists them",
                    path.display()
                ),
                error,
            )
        })?;
        let mut table: toml::Table = text
            .parse()
            .map_err(|error: toml::de::Error| unusable(error.into()))?;
        if let Some(table) = table.remove(RUN_TABLE) {
            run = RunDefaults::read(table).map_err(|fault| unusable(fault.into()))?;
        }
        if let Some(key) = RUN_KEYS.iter().find(|key| table.contains_key(**key)) {
            let fault = format!("`{key}` is no parameter: write it under [{RUN_TABLE}]");
            return Err(unusable(fault.into()));
        }
        params
            .set_table(table)
            .map_err(|error| unusable(error.into()))?;
    }
    for assignment in &globals.set {
        params
            .set_assignment(assignment)
            .map_err(|error| CliError::from(error).in_arguments())?;
    }
    let params = params
        .checked()
        .map_err(|error| CliError::from(error).in_arguments())?;
    Ok((params, run))
}

/// The technique of that name.
///
/// # Errors
/// There is none; the message lists those that are.
pub fn technique(name: &str) -> Result<&'static TechniqueEntry, CliError> {
    technique::find(name).ok_or_else(|| {
        let names: Vec<&str> = technique::REGISTRY.iter().map(|entry| entry.name).collect();
        CliError::new(format!(
            "there is no technique `{name}`; there are: {}",
            names.join(", ")
        ))
        .in_arguments()
    })
}

/// A device of macula's own, as `--device` wants it.
///
/// # Errors
/// There is no Vulkan device, or not that one.
pub fn headless_device(globals: &Globals) -> Result<GpuDevice, GpuError> {
    GpuDevice::create(&Headless {
        wanted: globals.device.clone(),
    })
}

/// The camera of that name or number.
///
/// # Errors
/// There is none; the message lists those that are.
pub fn find_camera(scene: &Scene, wanted: &str, path: &Path) -> Result<Camera, CliError> {
    let by_name = scene.cameras.iter().find(|camera| camera.name == wanted);
    let by_index = || {
        wanted
            .parse::<usize>()
            .ok()
            .and_then(|index| scene.cameras.get(index))
    };
    by_name.or_else(by_index).cloned().ok_or_else(|| {
        let names: Vec<&str> = scene
            .cameras
            .iter()
            .map(|camera| camera.name.as_str())
            .collect();
        let has = if names.is_empty() {
            "it has none".into()
        } else {
            format!("it has: {}", names.join(", "))
        };
        CliError::new(format!(
            "{}: no camera is named or numbered `{wanted}`; {has}",
            path.display()
        ))
    })
}
