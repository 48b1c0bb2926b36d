//! `macula cost`: what accuracy costs in time. Here are its options and the check of a budget; `prepare` makes what is measured with,
//! `weigh` measures, `write` leaves the results.

mod page;
mod prepare;
mod weigh;
mod write;

use std::path::PathBuf;
use std::str::FromStr;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use super::common::{self, ImageSize};
use super::compare::GazeAngles;
use super::output::interrupt_flag;
use super::progress::Progress;
use super::{CliError, CliResult, Globals};
use crate::cost::check::{BudgetCheck, TIMINGS, TOLERANCE};
use crate::cost::measure::Bench;
use crate::cost::sentences;
use crate::cost::setting::Setting;
use crate::gpu::GpuDevice;
use crate::scene::loaded::LoadedScene;
use crate::scene::{Camera, Scene};

/// Pixels where nobody says how many: a processor fills them within some tens of milliseconds.
const DEFAULT_SIZE: ImageSize = ImageSize {
    width: 64,
    height: 64,
};

/// Show what accuracy costs in time: sweep parameters, and weigh each setting's error against the time of its frames.
///
/// A frame is one eye's picture with a gaze. Each setting is warmed up and timed over independent frames; its error is that of a single
/// frame against the reference, in fovea, transition and periphery. Without --sweep the techniques are swept from few photons to many,
/// with a sharp and a soft estimate. The folder holds report.html (open it first), cost.csv, cost.json, the reference, every point, and
/// with --budget-ms the chosen setting as best.toml, which `render` and `replay` take as --params. The same command again goes on where
/// it was stopped, and measures no point twice.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// The scene: .glb or .gltf.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// Values to try, all combinations of all sweeps: technique, size, passes, or any parameter of `macula help params` (short: photons,
    /// radius, depth). FROM..TO*FACTOR stands for a range. May be repeated.
    #[arg(long, value_name = "KEY=V1,V2,..")]
    pub sweep: Vec<String>,
    /// Find the setting with the least foveal error within this frame time, measure it again, and write it as best.toml. The periphery is
    /// not weighed. Photons, samples, radius, depth and, unless --size or --sweep size= says it, the pictures' size are searched.
    #[arg(long, value_name = "MS", allow_hyphen_values = true, value_parser = positive)]
    pub budget_ms: Option<f64>,
    /// Find the time that each technique of the sweep needs for this relative mean squared error in the fovea: with more or fewer paths,
    /// then passes, from the nearest point of the sweep.
    #[arg(long, value_name = "ERROR", allow_hyphen_values = true, value_parser = positive)]
    pub equal_error: Option<f64>,
    /// Search each technique of the sweep for the least error that it reaches in this frame time.
    #[arg(long, value_name = "MS", allow_hyphen_values = true, value_parser = positive)]
    pub equal_time: Option<f64>,
    /// Only time the setting of --params, three times over, and say whether its frames keep this time within 15 %. The exit code is 0 if they
    /// do, 1 if not, and 3 if the machine's times scatter too much to tell.
    #[arg(long, value_name = "MS", allow_hyphen_values = true, value_parser = positive, conflicts_with_all = ["sweep", "budget_ms", "equal_error", "equal_time", "out"])]
    pub check_budget: Option<f64>,
    /// Size of the pictures [default: that of --params, or 64x64]; the largest size swept is the reference's.
    #[arg(long, value_name = "WxH")]
    pub size: Option<ImageSize>,
    /// The camera in the file, by name or index.
    #[arg(long, value_name = "NAME|INDEX", default_value = "0")]
    pub camera: String,
    /// Where the eye looks, in degrees right and up of the picture's axis [default: that of --params, or 0,0].
    #[arg(long, value_name = "AZ,EL", allow_hyphen_values = true)]
    pub gaze: Option<GazeAngles>,
    /// Judge by this picture of radiance; its standard error is taken off if FILE.se.exr is beside it.
    #[arg(long, value_name = "FILE.exr")]
    pub reference: Option<PathBuf>,
    /// Time for the reference where none is given: paths traced on the processor.
    #[arg(long, value_name = "S", default_value = "90", allow_hyphen_values = true, value_parser = seconds)]
    pub reference_seconds: Duration,
    /// Time for one point, at least five frames.
    #[arg(long, value_name = "S", default_value = "2.5", allow_hyphen_values = true, value_parser = seconds)]
    pub point_seconds: Duration,
    /// Time for the search of --budget-ms, and for that of --equal-time.
    #[arg(long, value_name = "S", default_value = "180", allow_hyphen_values = true, value_parser = seconds)]
    pub search_seconds: Duration,
    /// The folder to write.
    #[arg(long, value_name = "DIR", required_unless_present = "check_budget")]
    pub out: Option<PathBuf>,
}

fn seconds(text: &str) -> Result<Duration, String> {
    positive(text)
        .ok()
        .and_then(|seconds| Duration::try_from_secs_f64(seconds).ok())
        .filter(|seconds| !seconds.is_zero())
        .ok_or_else(|| "a number of seconds above 0, such as 90 or 2.5".into())
}

fn positive(text: &str) -> Result<f64, String> {
    f64::from_str(text)
        .ok()
        .filter(|value| value.is_finite() && *value > 0.0)
        .ok_or_else(|| "a number above 0, such as 50 or 0.02".into())
}

/// Weighs accuracy and time.
///
/// # Errors
/// A bad scene, sweep, reference or place, or a failing device: each with its mend.
pub fn run(args: Args, globals: &Globals) -> CliResult {
    let (params, defaults) = common::settings(globals)?;
    let technique = defaults.technique.as_deref();
    let entry = common::technique(technique.unwrap_or(common::DEFAULT_TECHNIQUE))?;
    let base = Setting {
        technique: entry.name,
        size: args.size.or(defaults.size).unwrap_or(DEFAULT_SIZE),
        passes: defaults.passes.map_or(1, |passes| passes.get()),
        params,
    };
    let gaze = args.gaze.or(defaults.gaze).unwrap_or(GazeAngles {
        azimuth_deg: 0.0,
        elevation_deg: 0.0,
    });
    match (args.check_budget, &args.out) {
        (Some(budget_ms), _) => check_budget(&args, &base, gaze, budget_ms, globals),
        (None, Some(out)) => weigh::run(&args, out, &base, gaze, globals),
        // The parser asks for one of the two.
        (None, None) => Err(CliError::new("--out is missing").in_arguments()),
    }
}

/// Times one setting over and over and compares it with a budget.
fn check_budget(
    args: &Args,
    setting: &Setting,
    gaze: GazeAngles,
    budget_ms: f64,
    globals: &Globals,
) -> CliResult {
    let interrupted = interrupt_flag()?;
    let scene = Scene::load(&args.scene)?;
    let camera = common::find_camera(&scene, &args.camera, &args.scene)?;
    let gpu = common::headless_device(globals)?;
    let loaded = LoadedScene::new(&gpu, scene)?;
    let bench = bench(&gpu, &loaded, &camera, gaze, args, interrupted);
    let progress = Progress::new("timing", TIMINGS as u64, "times");
    let mut timings = Vec::with_capacity(TIMINGS);
    for _ in 0..TIMINGS {
        timings.extend(bench.time(setting)?);
        progress.advance(1);
    }
    drop(progress);
    let check = match timings.len() {
        TIMINGS => BudgetCheck::of(budget_ms, timings),
        _ => None,
    };
    let check = check.ok_or_else(|| CliError::new("stopped before the time was steady"))?;
    let number = sentences::number;
    let (took, budget) = (number(check.frame.median_ms), number(budget_ms));
    let scatter = number((100.0 * check.noise_share).round());
    if globals.json {
        println!("{}", serde_json::json!(check));
    } else {
        println!(
            "{took} ms of {budget} (median of {} frames, half of them between {} and {}; times scatter by {scatter} %)",
            check.frame.frames,
            number(check.frame.q25_ms),
            number(check.frame.q75_ms)
        );
    }
    let tolerance = number(100.0 * TOLERANCE);
    match check.is_met {
        Some(true) => Ok(()),
        Some(false) => Err(CliError::new(format!(
            "a frame takes {took} ms, more than {budget} ms and {tolerance} %: look for a setting with --budget-ms on this machine"
        ))),
        None => Err(CliError::new(format!(
            "whether {budget} ms and {tolerance} % are kept can't be told: a frame takes {took} ms, but the machine's times scatter by {scatter} %; \
             run the check again when nothing else keeps the machine busy"
        ))
        .undecided()),
    }
}

fn bench<'a>(
    gpu: &'a GpuDevice,
    scene: &'a LoadedScene,
    camera: &'a Camera,
    gaze: GazeAngles,
    args: &Args,
    interrupted: &'a AtomicBool,
) -> Bench<'a> {
    Bench {
        gpu,
        scene,
        camera,
        gaze_dir_in_view: gaze.dir_in_view().as_vec3(),
        point_limit: args.point_seconds,
        interrupted,
    }
}
