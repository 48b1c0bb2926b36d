//! Metrics of other programs: FLIP and FovVideoVDP, called where they are installed.
//!
//! Each gets copies of the pictures in a folder of its own, which goes away afterwards, and its words on stdout are read.

use std::fmt;
use std::io::{self, Write as _};
use std::path::Path;
use std::process::{Command, Output};

use serde::Serialize;
use tempfile::TempDir;

use super::picture::Pictures;
use crate::cli::CliError;
use crate::image::{LinearImage, exr, png};
use crate::metrics::error::Faults;
use crate::metrics::region::EyeView;

/// A program and how to get it.
struct Tool {
    option: &'static str,
    program: &'static str,
    package: &'static str,
}

const FLIP: Tool = Tool {
    option: "--flip",
    program: "flip",
    package: "flip-evaluator",
};
const FOVVIDEOVDP: Tool = Tool {
    option: "--fovvideovdp",
    program: "fvvdp",
    package: "pyfvvdp",
};

/// What HDR-FLIP says (Andersson et al. 2021): 0 looks alike, 1 could not differ more.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FlipVerdict {
    /// Mean over pixels.
    pub mean: f64,
    /// Median, weighted by the error.
    pub weighted_median: f64,
    /// The largest.
    pub max: f64,
    /// The pixels per degree of visual angle that it was told, or assumed.
    pub pixels_per_degree: f64,
    /// The lowest exposure that it looked at, stops.
    pub start_exposure_ev: f64,
    /// The highest, stops.
    pub stop_exposure_ev: f64,
}

/// What FovVideoVDP says (Mantiuk et al. 2021) of the picture as a still.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FovVideoVdpVerdict {
    /// Quality in just-objectionable differences: 10 looks alike; of two pictures one unit apart, three people in four choose the better.
    pub jod: f64,
    /// The display that it was told.
    pub display: String,
    /// Whether it took the gaze to be in the picture's middle, the only place it can be told.
    pub foveated: bool,
    /// Its version, and the display's resolution and luminance, as it wants to be quoted.
    pub quote: Option<String>,
}

/// Calls `flip` on the linear pictures, with the pixels per degree on the picture's axis where its field of view is known.
///
/// # Errors
/// It is not installed, it fails, or what it says is not understood; a picture that is not finite.
pub(super) fn flip(pictures: &Pictures, view: Option<EyeView>) -> Result<FlipVerdict, CliError> {
    let folder = FLIP.folder_for(pictures)?;
    exr::write(&folder.path().join("test.exr"), &pictures.candidate)?;
    exr::write(&folder.path().join("reference.exr"), &pictures.reference)?;
    let mut command = FLIP.command(&folder);
    command.args(["--reference", "reference.exr", "--test", "test.exr"]);
    command.args(["--verbosity", "2", "--no-exposure-map", "--no-error-map"]);
    if let Some(view) = view {
        let pixels_per_degree = pixels_per_degree(view, pictures.candidate.width);
        command.args(["--pixels-per-degree", &format!("{pixels_per_degree:.4}")]);
    }
    let words = FLIP.run(command)?.stdout;
    let words = String::from_utf8_lossy(&words);
    let number = |label: &str| -> Result<f64, CliError> {
        words
            .lines()
            .filter_map(|line| line.trim().strip_prefix(label)?.strip_prefix(':'))
            .find_map(|value| value.trim().parse().ok())
            .ok_or_else(|| FLIP.not_understood(&format!("says no `{label}`")))
    };
    Ok(FlipVerdict {
        mean: number("Mean")?,
        weighted_median: number("Weighted median")?,
        max: number("Max")?,
        pixels_per_degree: number("Pixels per degree")?,
        start_exposure_ev: number("Start exposure")?,
        stop_exposure_ev: number("Stop exposure")?,
    })
}

/// Calls `fvvdp` on the pictures as they are shown at `exposure_ev`.
///
/// # Errors
/// As [`flip`].
pub(super) fn fovvideovdp(
    pictures: &Pictures,
    view: Option<EyeView>,
    display: &str,
    exposure_ev: f32,
) -> Result<FovVideoVdpVerdict, CliError> {
    let folder = FOVVIDEOVDP.folder_for(pictures)?;
    // Not PNG: for that it fetches a library from the network.
    write_ppm(
        &folder.path().join("test.ppm"),
        &pictures.candidate,
        exposure_ev,
    )?;
    write_ppm(
        &folder.path().join("reference.ppm"),
        &pictures.reference,
        exposure_ev,
    )?;
    let foveated = view.is_some_and(|view| looks_at_the_middle(view, &pictures.candidate));
    let mut command = FOVVIDEOVDP.command(&folder);
    command.args(["--test", "test.ppm", "--ref", "reference.ppm"]);
    command.args(["--display", display]);
    if foveated {
        command.arg("--foveated");
    }
    let output = FOVVIDEOVDP.run(command)?;
    let words = String::from_utf8_lossy(&output.stdout);
    let jod = words
        .lines()
        .filter_map(|line| line.rsplit_once('=')?.1.split_whitespace().next())
        .find_map(|value| value.parse().ok())
        .ok_or_else(|| FOVVIDEOVDP.not_understood("says no `FovVideoVDP=NUMBER`"))?;
    let log = String::from_utf8_lossy(&output.stderr);
    let mut quotes = log.lines().filter_map(|line| line.split('"').nth(1));
    Ok(FovVideoVdpVerdict {
        jod,
        display: display.to_owned(),
        foveated,
        quote: quotes
            .find(|quote| quote.starts_with("FovVideoVDP"))
            .map(str::to_owned),
    })
}

impl Tool {
    /// A folder to work in, for pictures that the tool can judge.
    fn folder_for(&self, pictures: &Pictures) -> Result<TempDir, CliError> {
        let faults = Faults::count(&pictures.candidate.rgb);
        if faults.nan + faults.infinite > 0 {
            return Err(CliError::new(format!(
                "{} cannot judge {}: {} of its values are NaN or infinite",
                self.option,
                pictures.candidate_path.display(),
                faults.nan + faults.infinite
            )));
        }
        TempDir::with_prefix("macula-compare-").map_err(|error| {
            CliError::because(
                format!("{} finds no place for its temporary files", self.option),
                error,
            )
        })
    }

    fn command(&self, folder: &TempDir) -> Command {
        let mut command = Command::new(self.program);
        command.current_dir(folder.path());
        command
    }

    fn run(&self, mut command: Command) -> Result<Output, CliError> {
        let output = command.output().map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => CliError::new(format!(
                "{} needs the program `{}`, which is not on the search path; `pip install {}` brings it",
                self.option, self.program, self.package
            )),
            _ => CliError::because(format!("{}: cannot start `{}`", self.option, self.program), error),
        })?;
        if output.status.success() {
            return Ok(output);
        }
        let complaint = String::from_utf8_lossy(&output.stderr).into_owned();
        let words = String::from_utf8_lossy(&output.stdout).into_owned();
        let last_line = complaint
            .lines()
            .chain(words.lines())
            .rfind(|line| !line.trim().is_empty());
        Err(CliError::because(
            format!(
                "{}: `{}` failed ({})",
                self.option, self.program, output.status
            ),
            last_line.unwrap_or("it said nothing").to_owned(),
        ))
    }

    fn not_understood(&self, why: &str) -> CliError {
        CliError::new(format!(
            "{}: `{}` on the search path {why}; is it the one of `pip install {}`?",
            self.option, self.program, self.package
        ))
    }
}

/// On the picture's axis.
fn pixels_per_degree(view: EyeView, width: u32) -> f64 {
    let slopes = f64::from(view.fov.right_rad).tan() - f64::from(view.fov.left_rad).tan();
    f64::from(width) / slopes * 1_f64.to_radians()
}

/// Within a pixel.
fn looks_at_the_middle(view: EyeView, image: &LinearImage) -> bool {
    let size = glam::Vec2::new(image.width as f32, image.height as f32);
    let gaze_uv = view.fov.project(view.gaze_dir_in_view.as_vec3());
    gaze_uv.is_some_and(|uv| ((uv - 0.5) * size).abs().max_element() <= 1.0)
}

/// A picture as it is shown, in the plainest of formats.
fn write_ppm(path: &Path, image: &LinearImage, exposure_ev: f32) -> Result<(), CliError> {
    let write = || -> io::Result<()> {
        let mut file = std::fs::File::create(path)?;
        writeln!(file, "P6 {} {} 255", image.width, image.height)?;
        file.write_all(&png::to_rgb8(image, exposure_ev))
    };
    write().map_err(|error| CliError::because(format!("cannot write {}", path.display()), error))
}

impl fmt::Display for FlipVerdict {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(
            f,
            "mean {:.4}, weighted median {:.4}, largest {:.4} (0 looks alike; {:.1} pixels per degree, {:+.2} to {:+.2} EV)",
            self.mean,
            self.weighted_median,
            self.max,
            self.pixels_per_degree,
            self.start_exposure_ev,
            self.stop_exposure_ev
        )
    }
}

impl fmt::Display for FovVideoVdpVerdict {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let quote = self.quote.as_deref().unwrap_or("no version told");
        write!(
            f,
            "{:.4} JOD (10 looks alike; {}: {quote})",
            self.jod, self.display
        )
    }
}
