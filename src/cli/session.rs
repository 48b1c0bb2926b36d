//! `macula session`: recorded sessions, and other programs' recordings.

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::json;

use super::output::OutputDir;
use super::run_record::{RunRecord, file_sha256};
use super::{CliError, CliResult, Globals};
use crate::gaze::import::{Format, ImportReport, Imported, import};
use crate::gaze::summary::Summary;
use crate::gaze::trace::{Session, files};

/// What an imported session folder holds beside the session: which file it was made from, and what the import found there.
const ORIGIN_FILE: &str = "import.json";

/// What to do with a session.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand, Debug)]
enum Command {
    /// Turn another program's recording into a session folder.
    Import(ImportArgs),
    /// Tell what a session folder holds.
    Info(InfoArgs),
}

/// `macula session import`.
#[derive(clap::Args, Debug)]
struct ImportArgs {
    /// The recording: SRanipal CSV.
    file: PathBuf,
    /// The session folder to make.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// The recording's format, where its header does not tell: sranipal.
    #[arg(long)]
    format: Option<Format>,
}

/// `macula session info`.
#[derive(clap::Args, Debug)]
struct InfoArgs {
    /// The session folder.
    folder: PathBuf,
}

/// Runs the subcommand.
pub fn run(args: Args, globals: &Globals) -> CliResult {
    match args.command {
        Command::Import(args) => run_import(&args, globals),
        Command::Info(args) => run_info(&args, globals),
    }
}

fn run_info(args: &InfoArgs, globals: &Globals) -> CliResult {
    let session = Session::open(&args.folder)?;
    let summary = Summary::of(&session);
    if globals.json {
        print_json(&json!({
            "session": session.metadata,
            "events": session.events.len(),
            "summary": summary,
            "warnings": session.warnings,
        }));
        return Ok(());
    }
    let metadata = &session.metadata;
    println!("{}", args.folder.display());
    for (name, value) in [
        ("name", &metadata.name),
        ("source", &metadata.source),
        ("device", &metadata.device),
        ("runtime", &metadata.runtime),
        ("software", &metadata.software),
    ] {
        if let Some(value) = value {
            print_row(name, value);
        }
    }
    print_summary(&summary);
    print_row(
        "events",
        format!("{} in {}", session.events.len(), files::EVENTS),
    );
    for note in &metadata.notes {
        print_row("note", note);
    }
    print_warnings(&session.warnings);
    Ok(())
}

fn run_import(args: &ImportArgs, globals: &Globals) -> CliResult {
    let started = Instant::now();
    let mut record = RunRecord::new(std::env::args());
    let output = OutputDir::create(&args.out, globals.force, &record)?;
    let Imported {
        mut session,
        report,
    } = import(&args.file, args.format)?;
    let stem = args
        .file
        .file_stem()
        .map(|stem| stem.to_string_lossy().into_owned());
    session.metadata.name = stem;
    let origin = json!({
        "file": args.file,
        "file_sha256": file_sha256(&args.file)?,
        "report": report,
    });
    session.save(output.path())?;
    let origin_path = output.path().join(ORIGIN_FILE);
    std::fs::write(&origin_path, format!("{origin:#}\n")).map_err(|error| {
        CliError::because(format!("cannot write {}", origin_path.display()), error)
    })?;
    record.warnings.clone_from(&report.warnings);
    record
        .timings_s
        .insert("import".to_owned(), started.elapsed().as_secs_f64());
    output.finish(&record)?;
    match globals.json {
        true => print_json(&origin),
        false => print_import(&args.out, &report),
    }
    Ok(())
}

fn print_json(value: &serde_json::Value) {
    println!("{value:#}");
}

fn print_row(name: &str, value: impl std::fmt::Display) {
    println!("  {name:<10} {value}");
}

fn print_warnings(warnings: &[String]) {
    for warning in warnings {
        print_row("warning", warning);
    }
}

fn print_import(out: &Path, report: &ImportReport) {
    println!("{}", out.display());
    print_row(
        "read",
        format!(
            "{} lines of {}, {} damaged, {} repeated",
            report.lines, report.format, report.damaged_lines, report.repeated_lines
        ),
    );
    print_summary(&report.summary);
    print_warnings(&report.warnings);
}

/// The numbers for people: degrees, milliseconds, centimetres.
fn print_summary(summary: &Summary) {
    let percent = |share: f64| format!("{:.1}%", 100.0 * share);
    // Adding zero turns a rounded -0 into 0.
    let tenth_deg = |rad: f64| (10.0 * rad.to_degrees()).round() / 10.0 + 0.0;
    let span_deg =
        |[low, high]: [f64; 2]| format!("{:.1} to {:.1} deg", tenth_deg(low), tenth_deg(high));
    print_row("length", format!("{:.2} s", summary.duration_s));
    print_row(
        "frames",
        format!(
            "{} at {:.1} Hz, head tracked in {}",
            summary.frames,
            summary.frame_rate_hz,
            percent(summary.head_tracked_share)
        ),
    );
    print_row(
        "gaze",
        format!(
            "{} samples at {:.1} Hz, {} valid (left eye {}, right eye {})",
            summary.gaze_samples,
            summary.gaze_rate_hz,
            percent(summary.gaze_valid_share),
            percent(summary.eye_valid_share[0]),
            percent(summary.eye_valid_share[1]),
        ),
    );
    let latency = summary
        .gaze_median_latency_s
        .map(|latency_s| format!(", received after {:.1} ms (median)", 1e3 * latency_s));
    print_row(
        "",
        format!(
            "{} gaps, longest interval {:.1} ms{}",
            summary.gaze_gaps,
            1e3 * summary.gaze_longest_gap_s,
            latency.unwrap_or_default()
        ),
    );
    let amplitude = summary
        .saccade_median_amplitude_rad
        .map(|rad| format!(" of {:.1} deg (median)", rad.to_degrees()));
    print_row(
        "eyes",
        format!(
            "{} saccades{}, {} fixations, {} pursuits, {} blinks, {} losses",
            summary.saccades,
            amplitude.unwrap_or_default(),
            summary.fixations,
            summary.pursuits,
            summary.blinks,
            summary.losses,
        ),
    );
    if let Some(ipd_m) = summary.ipd_m {
        print_row("", format!("{:.1} mm apart", 1e3 * ipd_m));
    }
    print_row(
        "head",
        format!(
            "yaw {} (left positive), pitch {}, roll {}",
            span_deg(summary.head_yaw_rad),
            span_deg(summary.head_pitch_rad),
            span_deg(summary.head_roll_rad),
        ),
    );
    print_row(
        "",
        format!(
            "moves up to {:.1} cm, turns up to {:.0} deg/s",
            1e2 * summary.head_reach_m,
            summary.head_peak_speed_rad_s.to_degrees()
        ),
    );
    if let Some(reflex) = summary.reflex {
        let verdict = match reflex.contradicts() {
            true => "left and right are swapped",
            false => "left and right agree",
        };
        print_row(
            "reflex",
            format!(
                "eyes against head: correlation {:.2}, gain {:.2} over {} intervals; {verdict}",
                reflex.correlation, reflex.gain, reflex.intervals
            ),
        );
    }
}
