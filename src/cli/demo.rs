//! `macula demo`: the bundled session in the bundled scene on the simulated headset.

use std::path::{Path, PathBuf};

use super::collect::CaptureFormat;
use super::common::ImageSize;
use super::replay::{self, RuntimeChoice};
use super::{CliError, CliResult, Globals};

/// Replay the bundled session in the bundled scene; needs no headset, no GPU and no network.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// The folder to write.
    #[arg(long, value_name = "DIR", default_value = "out/demo")]
    pub out: PathBuf,
}

/// Every tenth frame of the 90 Hz recording: 90 frames over its ten seconds.
const EVERY: u32 = 10;

/// Runs the demo.
///
/// # Errors
/// As for `replay`; or the bundled files are not beside the program.
pub fn run(args: Args, globals: &Globals) -> CliResult {
    let assets = find_assets()?;
    let replay = replay::Args {
        scene: assets.join("scenes").join("cornell.glb"),
        session: assets.join("sessions").join("natural-look"),
        technique: None,
        size: Some(ImageSize {
            width: 320,
            height: 320,
        }),
        frames: None,
        every: EVERY,
        runtime: RuntimeChoice::Sim,
        capture: CaptureFormat::Png,
        report: true,
        out: args.out,
    };
    replay::run(replay, globals)
}

/// The folder `assets` in the working folder, beside the program or above it, or where it was built.
fn find_assets() -> Result<PathBuf, CliError> {
    let program = std::env::current_exe().unwrap_or_default();
    let above_program = program.ancestors().skip(1).map(Path::to_path_buf);
    std::iter::once(PathBuf::new())
        .chain(above_program)
        .chain([PathBuf::from(env!("CARGO_MANIFEST_DIR"))])
        .map(|folder| folder.join("assets"))
        .find(|assets| assets.join("scenes").join("cornell.glb").is_file())
        .ok_or_else(|| {
            CliError::new("the bundled scene assets/scenes/cornell.glb was not found: run macula in its repository")
        })
}
