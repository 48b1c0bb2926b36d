//! `macula render`: one still picture of a scene.

use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use serde::Serialize;

use super::common::{self, ImageSize};
use super::compare::GazeAngles;
use super::output::{OutputFile, interrupt_flag};
use super::progress::Progress;
use super::{CliError, CliResult, Globals};
use crate::image::{exr, png};
use crate::metrics::error::percentile;
use crate::scene::Scene;
use crate::scene::loaded::LoadedScene;
use crate::still::Still;

/// Passes where nobody says how many.
const DEFAULT_PASSES: u32 = 16;

/// Render one picture of a scene to linear EXR (radiance, W/(m2 sr)) or PNG.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// The scene: .glb or .gltf.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// The camera in the file, by name or index.
    #[arg(long, value_name = "NAME|INDEX", default_value = "0")]
    pub camera: String,
    /// Size of the picture in pixels [default: that of --params, or 512x512].
    #[arg(long, value_name = "WxH")]
    pub size: Option<ImageSize>,
    /// How light is transported: pm-direct, pm, or path, slow and right [default: that of --params, or pm-direct].
    #[arg(long, value_name = "T")]
    pub technique: Option<String>,
    /// Photons emitted a pass; short for --set photon.count=N.
    #[arg(long, value_name = "N")]
    pub photons: Option<u32>,
    /// Passes to average: each has photons of its own, and the gather radius shrinks from one to the next
    /// [default: that of --params, or 16].
    #[arg(long, value_name = "K", conflicts_with = "seconds", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..))]
    pub passes: Option<u32>,
    /// Add passes until this many seconds have gone by.
    #[arg(long, value_name = "S", allow_hyphen_values = true, value_parser = seconds)]
    pub seconds: Option<Duration>,
    /// Where the eye looks, in degrees right and up of the picture's axis: the regions around it get what the fovea parameters say
    /// [default: that of --params, or nowhere: the whole picture is fovea].
    #[arg(long, value_name = "AZ,EL", allow_hyphen_values = true)]
    pub gaze: Option<GazeAngles>,
    /// Seed of the random numbers; short for --set random.seed=N.
    #[arg(long, value_name = "N")]
    pub seed: Option<u32>,
    /// The picture to write: .exr holds radiance, .png a tone-mapped view of it. Beside FILE.exr, from two passes of `path` on,
    /// FILE.se.exr holds the standard error of each value, which `compare` takes by itself. The photon maps get none: their radius
    /// shrinks from pass to pass, and the scatter of the passes does not tell of that bias.
    #[arg(long, value_name = "FILE.exr|.png")]
    pub out: PathBuf,
}

#[derive(Serialize)]
struct Summary {
    out: PathBuf,
    /// The file with the standard error of `out`, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    standard_error: Option<PathBuf>,
    technique: &'static str,
    passes: u32,
    device: String,
    wall_s: f64,
    pass_ms: Vec<(&'static str, f64)>,
    /// Median over the passes after the first, which compiles, of the sum of a pass's stages.
    frame_ms_median: Option<f64>,
    counts: Vec<(&'static str, f64)>,
    mean_w_per_m2_sr: [f64; 3],
    params_sha256: String,
    warnings: Vec<String>,
}

fn seconds(text: &str) -> Result<Duration, String> {
    text.parse()
        .ok()
        .and_then(|seconds| Duration::try_from_secs_f64(seconds).ok())
        .filter(|seconds| !seconds.is_zero())
        .ok_or_else(|| "a positive number of seconds, such as 30 or 0.5".into())
}

/// Renders.
///
/// # Errors
/// A bad scene, parameter or place, or a failing device: each with its mend.
pub fn run(args: Args, globals: &Globals) -> CliResult {
    let format = PictureFormat::of(&args.out)?;
    let (mut params, defaults) = common::settings(globals)?;
    if let Some(photons) = args.photons {
        params
            .set("photon.count", &photons.to_string())
            .map_err(|error| CliError::from(error).in_arguments())?;
    }
    if let Some(seed) = args.seed {
        params.set("random.seed", &seed.to_string())?;
    }
    let technique = args.technique.or(defaults.technique);
    let entry = common::technique(technique.as_deref().unwrap_or(common::DEFAULT_TECHNIQUE))?;
    let size = args.size.or(defaults.size).unwrap_or(common::DEFAULT_SIZE);
    let wanted_passes = args
        .passes
        .or(defaults.passes.map(NonZeroU32::get))
        .unwrap_or(DEFAULT_PASSES);
    let output = OutputFile::create(&args.out, globals.force)?;
    let standard_error = match format {
        PictureFormat::Exr => Some(args.out.with_extension("se.exr")),
        PictureFormat::Png => None,
    };
    let standard_error = standard_error
        .map(|path| OutputFile::create(&path, globals.force))
        .transpose()?;
    let interrupted = interrupt_flag()?;

    let scene = Scene::load(&args.scene)?;
    let camera = common::find_camera(&scene, &args.camera, &args.scene)?;
    let gpu = common::headless_device(globals)?;
    let loaded = LoadedScene::new(&gpu, scene)?;
    let view = camera.view(size.width, size.height);
    let gaze = args.gaze.or(defaults.gaze);
    let gaze = gaze.map(|gaze| gaze.dir_in_view().as_vec3());
    let size = (size.width, size.height);
    let mut still = Still::start(&gpu, &loaded, &params, entry, view, size, gaze)?;
    if standard_error.is_some() {
        still.keep_scatter();
    }

    let started = Instant::now();
    let progress = Progress::new(
        "rendering",
        args.seconds.map_or(u64::from(wanted_passes), |_| 0),
        "passes",
    );
    let mut pass_ms: Vec<(&'static str, f64)> = Vec::new();
    let mut frames_ms: Vec<f64> = Vec::new();
    let mut passes = 0;
    let is_done = |passes: u32| match args.seconds {
        Some(seconds) => started.elapsed() >= seconds,
        None => passes >= wanted_passes,
    };
    while passes == 0 || !(is_done(passes) || interrupted.load(Ordering::SeqCst)) {
        let times = still.add_pass()?;
        frames_ms.push(times.iter().map(|time| time.ms).sum());
        for time in times {
            match pass_ms.iter_mut().find(|(name, _)| *name == time.name) {
                Some((_, sum)) => *sum += time.ms,
                None => pass_ms.push((time.name, time.ms)),
            }
        }
        passes += 1;
        progress.advance(1);
    }
    let image = still.read()?;
    let statistics = still.statistics()?;
    match format {
        PictureFormat::Exr => exr::write(output.path(), &image)?,
        PictureFormat::Png => png::write(output.path(), &image, params.display.exposure_ev)?,
    }
    // An older picture's standard error must at no moment stand beside this one.
    if let Some(old) = &standard_error {
        old.remove_old()?;
    }
    let out = output.finish()?;
    let standard_error = match standard_error.zip(still.standard_error()) {
        Some((file, image)) => {
            exr::write(file.path(), &image)?;
            Some(file.finish()?)
        }
        None => None,
    };

    let pixels = image.rgb.len() as f64;
    let mean = [0, 1, 2].map(|channel| {
        image
            .rgb
            .iter()
            .map(|rgb| f64::from(rgb[channel]))
            .sum::<f64>()
            / pixels
    });
    let summary = Summary {
        out,
        standard_error,
        technique: entry.name,
        passes,
        device: gpu.info.name.clone(),
        wall_s: started.elapsed().as_secs_f64(),
        pass_ms,
        frame_ms_median: median_after_the_first(frames_ms),
        counts: statistics.counts,
        mean_w_per_m2_sr: mean,
        params_sha256: params.sha256(),
        warnings: [loaded.scene.warnings.clone(), statistics.warnings].concat(),
    };
    report(&summary, globals);
    if is_done(passes) {
        return Ok(());
    }
    Err(CliError::new(format!(
        "stopped after {passes} passes; {} is their mean",
        summary.out.display()
    )))
}

fn report(summary: &Summary, globals: &Globals) {
    if globals.json {
        println!("{}", serde_json::json!(summary));
        return;
    }
    println!(
        "{}: {} passes of {} in {:.1} s on {}",
        summary.out.display(),
        summary.passes,
        summary.technique,
        summary.wall_s,
        summary.device
    );
    if let Some(path) = &summary.standard_error {
        println!("{}: the standard error of each value", path.display());
    }
    for (name, ms) in &summary.pass_ms {
        println!(
            "  {name:<18} {:9.1} ms a pass",
            ms / f64::from(summary.passes)
        );
    }
    for (name, value) in &summary.counts {
        println!("  {name:<18} {value:9}");
    }
    for warning in &summary.warnings {
        eprintln!("warning: {warning}");
    }
}

/// The median of all but the first; `None` if there is no other.
fn median_after_the_first(mut frames_ms: Vec<f64>) -> Option<f64> {
    frames_ms.remove(0);
    frames_ms.sort_unstable_by(f64::total_cmp);
    (!frames_ms.is_empty()).then(|| percentile(&frames_ms, 0.5))
}

#[derive(Clone, Copy)]
enum PictureFormat {
    Exr,
    Png,
}

impl PictureFormat {
    fn of(path: &Path) -> Result<Self, CliError> {
        match path
            .extension()
            .and_then(|extension| extension.to_str())
            .map(str::to_lowercase)
            .as_deref()
        {
            Some("exr") => Ok(Self::Exr),
            Some("png") => Ok(Self::Png),
            _ => Err(CliError::new(format!(
                "{}: the picture's name must end in .exr or .png",
                path.display()
            ))
            .in_arguments()),
        }
    }
}
