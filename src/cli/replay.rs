//! `macula replay`: a recorded session in a scene, frame by frame through OpenXR, with pictures and a report.

use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

use super::collect::{CaptureFormat, Collector, FrameError, Heading};
use super::common::{self, ImageSize};
use super::output::{OutputDir, interrupt_flag};
use super::progress::Progress;
use super::run_record::RunRecord;
use super::{CliError, CliResult, Globals};
use crate::frame::FrameRenderer;
use crate::gaze::Session;
use crate::scene::Scene;
use crate::scene::bvh::SceneCaster;
use crate::session;
use crate::xr::{self, EndReason, XrApp, XrOptions};

/// Replay a recorded session in a scene: head and gaze of the recording, pictures for both eyes, and a report to look at.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// The scene: .glb or .gltf.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// The session folder (see `macula session import`).
    #[arg(long, value_name = "DIR")]
    pub session: PathBuf,
    /// How light is transported: pm-direct, pm, or path, slow and right [default: that of --params, or pm-direct].
    #[arg(long, value_name = "T")]
    pub technique: Option<String>,
    /// Pixels per eye [default: that of --params, or 512x512].
    #[arg(long, value_name = "WxH")]
    pub size: Option<ImageSize>,
    /// Frames of the recording to replay, the last one included.
    #[arg(long, value_name = "A..B")]
    pub frames: Option<FrameRange>,
    /// Replay every N-th frame of the recording only.
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..))]
    pub every: u32,
    /// The OpenXR runtime: the simulated headset that plays the recording, or the system's own (with its own head and gaze).
    #[arg(long, value_name = "R", default_value = "sim")]
    pub runtime: RuntimeChoice,
    /// Keep every frame's pictures as files: exr holds radiance. No FILE.se.exr is written beside them, whatever the technique: a frame is
    /// one pass, and what tells the standard error is the scatter of several. `render` writes one.
    #[arg(long, value_name = "FORMAT", default_value = "png")]
    pub capture: CaptureFormat,
    /// Write report.html.
    #[arg(long)]
    pub report: bool,
    /// The folder to write.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

/// Which runtime shows the session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum RuntimeChoice {
    /// xr-sim, in this process.
    Sim,
    /// The one that the OpenXR loader finds.
    System,
}

/// Frames of a recording, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameRange {
    /// First frame, counted from 0.
    pub first: usize,
    /// Last frame.
    pub last: usize,
}

impl FromStr for FrameRange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        text.split_once("..")
            .and_then(|(first, last)| {
                Some(Self {
                    first: first.parse().ok()?,
                    last: last.parse().ok()?,
                })
            })
            .filter(|range| range.first <= range.last)
            .ok_or_else(|| "a frame range is A..B with A not above B, such as 0..89".into())
    }
}

/// Replays.
///
/// # Errors
/// A bad scene, session or place, no runtime, or a failing device: each with its mend.
pub fn run(args: Args, globals: &Globals) -> CliResult {
    let (params, defaults) = common::settings(globals)?;
    let technique = args.technique.as_ref().or(defaults.technique.as_ref());
    let technique = common::technique(technique.map_or(common::DEFAULT_TECHNIQUE, String::as_str))?;
    let size = args.size.or(defaults.size).unwrap_or(common::DEFAULT_SIZE);
    check_size(&args, size)?;
    let mut record = RunRecord::new(std::env::args());
    let output = OutputDir::create(&args.out, globals.force, &record)?;
    let interrupted = interrupt_flag()?;
    let started = Instant::now();

    let scene = Scene::load(&args.scene)?;
    let recording = Session::open(&args.session)?;
    let frame_count = planned_frames(&args, &recording)?;
    let caster = SceneCaster::new(&scene);
    record
        .timings_s
        .insert("loading".into(), started.elapsed().as_secs_f64());

    let mut app = connect(&args, size, globals)?;
    let gpu = Arc::clone(app.gpu());
    let headset = app.headset().clone();
    record.describe(&params, &gpu, &scene, &args.scene);
    record.runtime = Some(format!(
        "{} {}",
        headset.runtime_name, headset.runtime_version
    ));
    record
        .warnings
        .extend(scene.warnings.iter().chain(&recording.warnings).cloned());

    let size = app.image_size();
    let mut renderer = FrameRenderer::new(
        &gpu,
        &scene,
        &caster,
        &params,
        technique,
        size,
        app.format(),
    )?;
    let mut collector = Collector::new(output.path(), args.capture, &params, frame_count)?;
    let progress = Progress::new("replaying", frame_count as u64, "frames");
    let rendering = Instant::now();
    let end = session::run(
        &mut app,
        &mut renderer,
        interrupted,
        |input, outcome, renderer| {
            collector.add(&gpu, input, outcome, renderer)?;
            progress.advance(1);
            Ok::<_, FrameError>(())
        },
    );
    drop(progress);
    record
        .timings_s
        .insert("rendering".into(), rendering.elapsed().as_secs_f64());
    record.warnings.extend(collector.warnings());
    let end = match end {
        Ok(end) => end,
        Err(error) => {
            let kept = output.keep_partial(&record)?;
            let kept = kept
                .map(|path| format!("; what is complete is in {}", path.display()))
                .unwrap_or_default();
            return Err(CliError::because(
                format!("the session broke off{kept}"),
                error,
            ));
        }
    };
    if args.report {
        let report = collector.report(
            &heading(&args, technique.name, &recording, &scene),
            &scene,
            &record,
        );
        report.write(&output.path().join("report.html"))?;
    }
    if interrupted.load(Ordering::SeqCst) {
        let kept = output.keep_partial(&record)?;
        return Err(CliError::new(match kept {
            Some(path) => format!(
                "stopped after {} frames, which are in {}",
                end.frames,
                path.display()
            ),
            None => "stopped before the first frame".into(),
        }));
    }
    if end.reason != EndReason::Exit {
        let kept = output.keep_partial(&record)?;
        let kept = kept
            .map(|path| format!("; its frames are in {}", path.display()))
            .unwrap_or_default();
        return Err(CliError::new(format!(
            "the OpenXR runtime ended the session after {} of {frame_count} frames ({}){kept}",
            end.frames, end.reason
        )));
    }
    let folder = output.finish(&record)?;
    tell(
        &folder,
        &args,
        end.frames,
        started.elapsed().as_secs_f64(),
        &record,
        globals,
    );
    Ok(())
}

fn check_size(args: &Args, size: ImageSize) -> CliResult {
    let widest = xr_sim::MAX_IMAGE_SIZE;
    if args.runtime == RuntimeChoice::Sim && size.width.max(size.height) > widest {
        let message =
            format!("--size: an eye of the simulated headset has at most {widest} pixels a side");
        return Err(CliError::new(message).in_arguments());
    }
    Ok(())
}

fn planned_frames(args: &Args, recording: &Session) -> Result<usize, CliError> {
    let count = recording.frames.len();
    let range = args.frames.unwrap_or(FrameRange {
        first: 0,
        last: count.saturating_sub(1),
    });
    if count == 0 || range.first >= count {
        return Err(CliError::new(format!(
            "{}: the recording has {count} frames, so frame {} is not in it",
            args.session.display(),
            range.first
        )));
    }
    Ok((range.last.min(count - 1) - range.first) / args.every as usize + 1)
}

fn connect(args: &Args, size: ImageSize, globals: &Globals) -> Result<XrApp, CliError> {
    let options = XrOptions {
        image_size: Some([size.width, size.height]),
    };
    let runtime = match args.runtime {
        RuntimeChoice::Sim => simulated_headset(args, size, globals)?,
        RuntimeChoice::System => xr::Runtime::System,
    };
    Ok(XrApp::connect(runtime.entry()?, &options)?)
}

fn simulated_headset(
    args: &Args,
    size: ImageSize,
    globals: &Globals,
) -> Result<xr::Runtime, CliError> {
    let device = globals.device.as_ref().map(|wanted| match wanted.parse() {
        Ok(index) => xr_sim::DeviceChoice::Index(index),
        Err(_) => xr_sim::DeviceChoice::Name(wanted.clone()),
    });
    xr_sim::configure(xr_sim::Config {
        session: Some(args.session.clone()),
        first_frame: args.frames.map_or(0, |range| range.first),
        last_frame: args.frames.map(|range| range.last),
        frame_step: args.every as usize,
        eye_width: size.width,
        eye_height: size.height,
        clock: xr_sim::ClockKind::Virtual,
        device,
        ..xr_sim::Config::default()
    })?;
    Ok(xr::Runtime::InProcess(xr_sim::get_instance_proc_addr))
}

fn heading(args: &Args, technique: &str, recording: &Session, scene: &Scene) -> Heading {
    let folder = args
        .session
        .file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    let session = recording.metadata.name.clone().unwrap_or(folder);
    Heading {
        title: format!("{session} in {}", scene.name),
        subtitle: vec![
            format!("technique {technique}"),
            match args.every {
                1 => "every frame of the recording".into(),
                every => format!("one frame in {every} of the recording"),
            },
        ],
    }
}

fn tell(
    folder: &Path,
    args: &Args,
    frames: u32,
    wall_s: f64,
    record: &RunRecord,
    globals: &Globals,
) {
    let report = args.report.then(|| folder.join("report.html"));
    if globals.json {
        println!(
            "{}",
            serde_json::json!({ "out": folder, "report": report, "frames": frames, "wall_s": wall_s })
        );
        return;
    }
    for warning in &record.warnings {
        eprintln!("warning: {warning}");
    }
    println!(
        "{frames} frames for two eyes in {wall_s:.1} s: {}",
        folder.display()
    );
    if let Some(report) = report {
        println!("report: {}", report.display());
    }
}
