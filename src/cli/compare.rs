//! `macula compare`: how far a picture is from its reference, whole and per region of the retina.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{CliError, CliResult, Globals, common};
use crate::image::{LinearImage, exr};
use crate::metrics::error::{ErrorStats, ImagePair};
use crate::metrics::region::{EccentricityLimits, eccentricities_rad};
use crate::metrics::{self, Area, Comparison};
use crate::view::Fov;

/// Compare a linear EXR picture with its reference: bias, error, NaN counts, whole and per region.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// The picture that is judged.
    #[arg(value_name = "IMAGE.exr")]
    pub image: PathBuf,
    /// What it should be, of the same size.
    #[arg(value_name = "REFERENCE.exr")]
    pub reference: PathBuf,
    /// Where the eye looked, in degrees right and up of the picture's axis: judge fovea, transition and periphery too (their limits are
    /// `fovea.radius_deg` and `fovea.transition_deg`).
    #[arg(
        long,
        value_name = "AZ,EL",
        requires = "vfov",
        allow_hyphen_values = true
    )]
    pub gaze: Option<GazeAngles>,
    /// The picture's vertical field of view, in degrees.
    #[arg(long, value_name = "DEG", requires = "gaze", value_parser = parse_vfov_deg)]
    pub vfov: Option<f32>,
    /// The standard error of each pixel of the reference: its noise is taken off the errors.
    #[arg(long, value_name = "FILE.exr")]
    pub reference_se: Option<PathBuf>,
}

/// A direction of gaze in angles from the view's axis, as the command line takes it: `AZ,EL` in degrees.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(try_from = "String")]
pub struct GazeAngles {
    /// To the right, degrees.
    pub azimuth_deg: f64,
    /// Up, degrees.
    pub elevation_deg: f64,
}

impl GazeAngles {
    /// Unit direction in view space (+X right, +Y up, -Z forward).
    pub fn dir_in_view(self) -> DVec3 {
        let (sin_azimuth, cos_azimuth) = self.azimuth_deg.to_radians().sin_cos();
        let (sin_elevation, cos_elevation) = self.elevation_deg.to_radians().sin_cos();
        DVec3::new(
            sin_azimuth * cos_elevation,
            sin_elevation,
            -cos_azimuth * cos_elevation,
        )
    }
}

impl TryFrom<String> for GazeAngles {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl FromStr for GazeAngles {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let angle = |part: &str, limit: f64| -> Option<f64> {
            let angle = part.trim().parse::<f64>().ok()?;
            (angle.abs() <= limit).then_some(angle)
        };
        text.split_once(',')
            .and_then(|(azimuth, elevation)| {
                Some(Self {
                    azimuth_deg: angle(azimuth, 180.0)?,
                    elevation_deg: angle(elevation, 90.0)?,
                })
            })
            .ok_or_else(|| {
                "two angles in degrees, AZ,EL, within ±180 and ±90: --gaze -5,2.5".to_owned()
            })
    }
}

fn parse_vfov_deg(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(angle) if angle > 0.0 && angle < 179.0 => Ok(angle),
        _ => Err("an angle above 0 and below 179 degrees".to_owned()),
    }
}

/// What `compare` reports.
#[derive(Clone, Debug, Serialize)]
pub struct Judgement {
    /// The picture that was judged.
    pub image: PathBuf,
    /// What it should be.
    pub reference: PathBuf,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// The regions' limits, where a gaze was given.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub limits: Option<Limits>,
    /// The errors.
    #[serde(flatten)]
    pub comparison: Comparison,
}

/// Where the regions end, as reported.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Limits {
    /// The fovea's limit, radians.
    pub fovea_limit_rad: f64,
    /// The transition's limit, radians.
    pub transition_limit_rad: f64,
}

/// Runs the subcommand: a table for people, or one JSON object.
///
/// # Errors
/// A file that cannot be read, sizes that differ, a reference that nothing can be judged by.
pub fn run(args: Args, globals: &Globals) -> CliResult {
    let fovea = common::params(globals)?.fovea;
    let limits = EccentricityLimits {
        fovea_rad: f64::from(fovea.radius_deg).to_radians(),
        transition_rad: f64::from(fovea.transition_deg).to_radians(),
    };
    let judgement = judge(&args, limits)?;
    if globals.json {
        println!("{}", serde_json::to_string(&judgement)?);
    } else {
        print!("{judgement}");
    }
    Ok(())
}

/// Reads the pictures and compares them; with a gaze, by region within `limits` too.
///
/// # Errors
/// As [`run`].
pub fn judge(args: &Args, limits: EccentricityLimits) -> Result<Judgement, CliError> {
    let image = exr::read(&args.image)?;
    let reference = read_like(&args.reference, &image, args)?;
    let standard_error = match &args.reference_se {
        Some(path) => Some(read_like(path, &image, args)?),
        None => None,
    };
    let (width, height) = (image.width as usize, image.height as usize);
    let eccentricity_rad = args.gaze.zip(args.vfov).map(|(gaze, vfov_deg)| {
        let fov = Fov::symmetric(vfov_deg.to_radians(), width as f32 / height as f32);
        eccentricities_rad(fov, width, height, gaze.dir_in_view())
    });
    let pair = ImagePair {
        width,
        candidate: &image.rgb,
        reference: &reference.rgb,
        reference_standard_error: standard_error.as_ref().map(|image| image.rgb.as_slice()),
    };
    let regions = eccentricity_rad.as_deref().map(|angles| (angles, limits));
    let comparison = metrics::compare(pair, regions).map_err(|error| {
        CliError::because(
            format!(
                "cannot compare {} with {}",
                args.image.display(),
                args.reference.display()
            ),
            error,
        )
    })?;
    Ok(Judgement {
        image: args.image.clone(),
        reference: args.reference.clone(),
        width: image.width,
        height: image.height,
        limits: regions.map(|_| Limits {
            fovea_limit_rad: limits.fovea_rad,
            transition_limit_rad: limits.transition_rad,
        }),
        comparison,
    })
}

fn read_like(path: &Path, image: &LinearImage, args: &Args) -> Result<LinearImage, CliError> {
    let other = exr::read(path)?;
    if (other.width, other.height) == (image.width, image.height) {
        return Ok(other);
    }
    Err(CliError::new(format!(
        "{} is {}x{} but {} is {}x{}; render it at the reference's size",
        args.image.display(),
        image.width,
        image.height,
        path.display(),
        other.width,
        other.height,
    )))
}

impl fmt::Display for Judgement {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let comparison = &self.comparison;
        let faults = comparison.faults;
        writeln!(
            f,
            "image      {}  {}x{}",
            self.image.display(),
            self.width,
            self.height
        )?;
        writeln!(f, "reference  {}", self.reference.display())?;
        writeln!(
            f,
            "faults     {} NaN, {} infinite, {} negative channel values",
            faults.nan, faults.infinite, faults.negative
        )?;
        if let Some(black) = comparison.against_black {
            return writeln!(
                f,
                "\nThe reference is black. Mean |value| {:.3e}, largest {:.3e}, {} pixels not black.",
                black.mean_absolute, black.max_absolute, black.nonzero_pixels
            );
        }
        writeln!(
            f,
            "\n{:<11}{:>8}  {:^23}  {:>9}  {:>9}  {:>9}  {:>9}  {:>7}  {:>7}  {:>6}  {:>6}",
            "",
            "pixels",
            "mean ratio R, G, B",
            "MSE",
            "relMSE",
            "less ref.",
            "trimmed",
            "p50",
            "p95",
            "PSNR",
            "SSIM"
        )?;
        let regions = [
            ("whole", &comparison.whole),
            ("fovea", &comparison.fovea),
            ("transition", &comparison.transition),
            ("periphery", &comparison.periphery),
        ];
        for (name, area) in regions {
            if let Some(Area {
                error,
                psnr_db,
                ssim,
            }) = area
            {
                let psnr = psnr_db.map_or("inf".into(), |value| format!("{value:.1}"));
                let ssim = ssim.map_or("-".into(), |value| format!("{value:.4}"));
                writeln!(f, "{}  {psnr:>6}  {ssim:>6}", Row(name, error))?;
            }
        }
        if let Some(blocks) = &comparison.block8 {
            writeln!(f, "{}", Row("8x8 blocks", blocks))?;
        }
        if let Some(limits) = self.limits {
            writeln!(
                f,
                "\nRegions by angle from the gaze: fovea to {:.2} degrees, transition to {:.2}.",
                limits.fovea_limit_rad.to_degrees(),
                limits.transition_limit_rad.to_degrees()
            )?;
        } else {
            writeln!(f)?;
        }
        writeln!(
            f,
            "relMSE: mean of (c-r)²/(r²+eps²), eps 1% of the reference's mean; less ref.: without the reference's own noise (--reference-se);\n\
             trimmed: without the worst 0.1% of pixels; p50, p95 of |c-r|/sqrt(r²+eps²); PSNR (dB) and SSIM of display values at {:+.2} EV.",
            comparison.display_exposure_ev
        )
    }
}

/// The part of a row that regions and blocks share.
struct Row<'a>(&'a str, &'a ErrorStats);

impl fmt::Display for Row<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self(name, error) = self;
        let [r, g, b] = error
            .mean_ratio
            .map(|ratio| ratio.map_or("-".into(), |value| format!("{value:.4}")));
        let corrected = error
            .relmse_corrected
            .map_or("-".into(), |value| format!("{value:.3e}"));
        write!(
            f,
            "{name:<11}{:>8}  {r:>7} {g:>7} {b:>7}  {:>9.3e}  {:>9.3e}  {corrected:>9}  {:>9.3e}  {:>7.4}  {:>7.4}",
            error.pixels,
            error.mse,
            error.relmse,
            error.relmse_trimmed,
            error.relative_error_p50,
            error.relative_error_p95,
        )
    }
}
