//! What several subcommands do alike: parameters, device, scene, technique, sizes.

use std::fs;
use std::str::FromStr;

use super::{CliError, Globals};
use crate::gpu::{GpuDevice, GpuError, Headless};
use crate::params::Params;
use crate::technique::{self, TechniqueEntry};

/// Pixels of a picture, as `WxH`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageSize {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
}

impl ImageSize {
    /// Largest side: beyond it no headset and no camera goes, and a typing mistake would take all memory.
    pub const MAX: u32 = 16_384;
}

impl FromStr for ImageSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let side = |part: &str| {
            part.parse::<u32>()
                .ok()
                .filter(|side| (1..=Self::MAX).contains(side))
        };
        text.split_once(['x', 'X'])
            .and_then(|(width, height)| {
                Some(Self {
                    width: side(width)?,
                    height: side(height)?,
                })
            })
            .ok_or_else(|| {
                format!(
                    "a size is WxH in pixels, each from 1 to {}, such as 640x480",
                    Self::MAX
                )
            })
    }
}

/// The parameters: defaults, then `--params`, then each `--set`.
///
/// # Errors
/// An unreadable file, an unknown key, a value out of range.
pub fn params(globals: &Globals) -> Result<Params, CliError> {
    let mut params = Params::default();
    if let Some(path) = &globals.params {
        let text = fs::read_to_string(path).map_err(|error| {
            CliError::because(
                format!("cannot read the parameter file {}", path.display()),
                error,
            )
        })?;
        params.set_toml(&text).map_err(|error| {
            CliError::because(
                format!("cannot use the parameter file {}", path.display()),
                error,
            )
        })?;
    }
    for assignment in &globals.set {
        params
            .set_assignment(assignment)
            .map_err(|error| CliError::from(error).in_arguments())?;
    }
    params
        .checked()
        .map_err(|error| CliError::from(error).in_arguments())
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
