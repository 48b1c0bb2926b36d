//! `run.json`: what produced an output folder, and the mark by which macula knows its own.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::CliError;
use super::output::{OutputError, failed};
use crate::gpu::GpuDevice;
use crate::params::Params;
use crate::scene::Scene;

/// The name of the record in every output folder.
pub const RUN_FILE: &str = "run.json";
/// What `program` says in it: the mark of a folder that is ours.
const PROGRAM: &str = "macula";

/// What produced an output: everything needed to produce it again. Written as `run.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RunRecord {
    /// macula's version.
    pub version: String,
    /// The commit that the binary was built from, where known.
    pub git_commit: Option<String>,
    /// The command line, word by word.
    pub command: Vec<String>,
    /// Every parameter with its value.
    pub parameters: serde_json::Value,
    /// SHA-256 of the parameters, as the parameter module defines it.
    pub parameters_sha256: Option<String>,
    /// The seed of all random numbers.
    pub seed: Option<u64>,
    /// The Vulkan device's name.
    pub device: Option<String>,
    /// The Vulkan driver's name and version.
    pub driver: Option<String>,
    /// The OpenXR runtime's name and version.
    pub runtime: Option<String>,
    /// The scene file.
    pub scene: Option<PathBuf>,
    /// SHA-256 of the scene file.
    pub scene_sha256: Option<String>,
    /// How long each part of the run took, seconds.
    pub timings_s: BTreeMap<String, f64>,
    /// Every warning that was given.
    pub warnings: Vec<String>,
}

/// `run.json` as it lies on the disk.
#[derive(Serialize)]
struct RunFile<'a> {
    program: &'static str,
    complete: bool,
    #[serde(flatten)]
    record: &'a RunRecord,
}

impl RunRecord {
    /// A record with the version and the command line filled in.
    pub fn new(command: impl IntoIterator<Item = String>) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            command: command.into_iter().collect(),
            ..Self::default()
        }
    }

    /// Fills in what every run has: parameters, device, scene.
    pub fn describe(&mut self, params: &Params, gpu: &GpuDevice, scene: &Scene, file: &Path) {
        let values: BTreeMap<_, _> = params.values().into_iter().collect();
        self.git_commit = option_env!("MACULA_GIT_COMMIT").map(str::to_owned);
        self.parameters = serde_json::json!(values);
        self.parameters_sha256 = Some(params.sha256());
        self.seed = Some(u64::from(params.random.seed));
        self.device = Some(gpu.info.name.clone());
        self.driver = Some(format!("{} {}", gpu.info.driver, gpu.info.driver_info));
        self.scene = Some(file.into());
        self.scene_sha256 = Some(scene.content_sha256.clone());
    }

    /// Writes it into a folder.
    pub(super) fn write(&self, folder: &Path, complete: bool) -> Result<(), OutputError> {
        let path = folder.join(RUN_FILE);
        let run = RunFile {
            program: PROGRAM,
            complete,
            record: self,
        };
        serde_json::to_vec_pretty(&run)
            .map_err(io::Error::from)
            .and_then(|json| fs::write(&path, json))
            .map_err(failed("write", &path))
    }
}

/// Whether a folder holds a `run.json` that macula wrote.
pub(super) fn is_ours(folder: &Path) -> bool {
    #[derive(Deserialize)]
    struct Mark {
        program: String,
    }
    let run = fs::read(folder.join(RUN_FILE)).unwrap_or_default();
    serde_json::from_slice::<Mark>(&run).is_ok_and(|mark| mark.program == PROGRAM)
}

/// The SHA-256 of a file, in hexadecimal, read piece by piece.
///
/// # Errors
/// The file cannot be read.
pub fn file_sha256(path: &Path) -> Result<String, CliError> {
    let unreadable =
        |error: io::Error| CliError::because(format!("cannot read {}", path.display()), error);
    let mut file = File::open(path).map_err(unreadable)?;
    let mut hasher = Sha256::new();
    io::copy(&mut file, &mut hasher).map_err(unreadable)?;
    let digest = hasher.finalize();
    Ok(digest.iter().map(|byte| format!("{byte:02x}")).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_cannot_be_read_is_named_and_not_said_to_be_written() {
        let error = file_sha256(Path::new("absent.exr")).unwrap_err();
        assert_eq!(error.message, "cannot read absent.exr");
        assert!(error.cause.is_some());
    }

    #[test]
    fn the_hash_of_a_file_is_the_standard_one() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("abc");
        fs::write(&path, "abc").unwrap();
        assert_eq!(
            file_sha256(&path).unwrap(),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
        );
    }
}
