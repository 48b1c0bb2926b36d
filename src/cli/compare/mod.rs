//! `macula compare`: how far pictures are from their reference, whole and per region of the retina.
//!
//! One picture is judged in `picture`, a sequence of frames for one or two eyes in `sequence`, which finds its files by `frames`; `external`
//! calls metrics of other programs, `table` shows all of it to people.

mod external;
mod frames;
mod picture;
mod sequence;
mod table;

use std::ffi::OsString;
use std::path::PathBuf;
use std::str::FromStr;

use clap::builder::{OsStringValueParser, TypedValueParser as _};
use glam::DVec3;

use super::{CliError, CliResult, Globals, common, eye_columns};
use crate::metrics::region::{EccentricityLimits, EyeView};
use crate::view::Fov;

pub use external::{FlipVerdict, FovVideoVdpVerdict};
pub use picture::{Judgement, Limits, judge};
pub use sequence::{FrameErrors, SequenceArea, SequenceJudgement, judge_sequence};

const AFTER_HELP: &str = "\
Examples:
  macula compare still.exr reference.exr
  macula compare still.exr reference.exr --gaze 5,-2 --vfov 60       fovea, transition and periphery too
  macula compare out/fpm out/reference                               two replays with --capture exr: flicker and stereo too
  macula compare still.exr reference.exr --flip --fovvideovdp=standard_hmd

What to look at:
  faults      NaN, infinite and negative values: anything but 0 is a defect, not noise. Pixels that are not finite are left out below.
  bias        what more samples will not mend. Where the reference's noise is known, its share of the bias stands beside it.
  8x8 blocks  noise drops 8 times, bias and blur stay: a relMSE that hardly falls here is not noise.
  less ref.   the error without the reference's own noise: quote this one. `<` before it: too small for this reference to tell. That of
              relMSE is too large where the reference's pixels scatter by more than about a tenth, as it divides by them: quote the MSE.
  trimmed     without the worst 0.1 % of pixels: far below relMSE means fireflies.

The noise of a reference is read from NAME.se.exr beside NAME.exr, the standard error of each of its values.

In a sequence, frames are EXR files of the same names in both folders, in the order of their names; left_ and right_ mark the eyes. The
folder may be a replay's output: then the gaze of each frame and eye comes from its frames.csv.";

/// Compare linear EXR pictures with their references: bias, error, NaN counts, whole and per region; flicker and stereo in a sequence.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    /// The picture that is judged, or a folder of frames.
    #[arg(value_name = "IMAGE.exr|DIR")]
    pub image: PathBuf,
    /// What it should be, of the same size; or a folder of frames with the same names.
    #[arg(value_name = "REFERENCE.exr|DIR")]
    pub reference: PathBuf,
    /// Where the eye looked, in degrees right and up of the picture's axis: judge fovea, transition and periphery too (their limits are
    /// `fovea.radius_deg` and `fovea.transition_deg`). Needs --vfov. In a sequence it holds for all frames.
    #[arg(
        long,
        value_name = "AZ,EL",
        requires = "vfov",
        allow_hyphen_values = true
    )]
    pub gaze: Option<GazeAngles>,
    /// The picture's vertical field of view, in degrees: of a camera, what `macula inspect SCENE` tells under Cameras.
    #[arg(long, value_name = "DEG", requires = "gaze", value_parser = parse_vfov_deg)]
    pub vfov: Option<f32>,
    /// The standard error of each value of the reference, by which its noise is taken off the errors: a file, `beside` for NAME.se.exr
    /// beside NAME.exr where there is one, or `none`.
    #[arg(
        long,
        value_name = "FILE.exr|beside|none",
        default_value = "beside",
        value_parser = OsStringValueParser::new().map(ReferenceSe::from)
    )]
    pub reference_se: ReferenceSe,
    /// Judge by FLIP too (HDR-FLIP of the linear pictures): calls `flip`, which `pip install flip-evaluator` brings.
    #[arg(long)]
    pub flip: bool,
    /// Judge by FovVideoVDP too, as shown on one of its displays: calls `fvvdp`, which `pip install pyfvvdp` brings.
    /// Foveated if the gaze is in the picture's middle, the only place it can be told.
    #[arg(long, value_name = "DISPLAY", num_args = 0..=1, require_equals = true, default_missing_value = "standard_hmd")]
    pub fovvideovdp: Option<String>,
}

impl Args {
    /// The view that `--gaze` and `--vfov` tell, of a picture of this size.
    fn eye_view(&self, width: u32, height: u32) -> Option<EyeView> {
        let (gaze, vfov_deg) = self.gaze.zip(self.vfov)?;
        Some(EyeView {
            fov: Fov::symmetric(vfov_deg.to_radians(), width as f32 / height as f32),
            gaze_dir_in_view: gaze.dir_in_view(),
        })
    }
}

/// Where the noise of the reference is known from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum ReferenceSe {
    /// NAME.se.exr beside NAME.exr, where there is one.
    #[default]
    Beside,
    /// Nowhere: the reference's noise stays in the errors.
    None,
    /// This file.
    File(PathBuf),
}

impl From<OsString> for ReferenceSe {
    fn from(text: OsString) -> Self {
        match text.to_str() {
            Some("beside") => Self::Beside,
            Some("none") => Self::None,
            _ => Self::File(text.into()),
        }
    }
}

/// A direction of gaze in angles from the view's axis, as the command line takes it: `AZ,EL` in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GazeAngles {
    /// To the right, degrees.
    pub azimuth_deg: f64,
    /// Up, degrees.
    pub elevation_deg: f64,
}

impl GazeAngles {
    /// Unit direction in view space (+X right, +Y up, -Z forward).
    pub fn dir_in_view(self) -> DVec3 {
        eye_columns::dir_in_view([self.azimuth_deg, self.elevation_deg])
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
                "two angles in degrees, AZ,EL, within ±180 and ±90, such as -5,2.5".to_owned()
            })
    }
}

fn parse_vfov_deg(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(angle) if angle > 0.0 && angle < 179.0 => Ok(angle),
        _ => Err("an angle above 0 and below 179 degrees".to_owned()),
    }
}

/// Runs the subcommand: a table for people, or one JSON object.
///
/// # Errors
/// A file that cannot be read, sizes that differ, a reference that nothing can be judged by, an external metric that is not installed.
pub fn run(args: Args, globals: &Globals) -> CliResult {
    let fovea = common::params(globals)?.fovea;
    let limits = EccentricityLimits {
        fovea_rad: f64::from(fovea.radius_deg).to_radians(),
        transition_rad: f64::from(fovea.transition_deg).to_radians(),
    };
    match (args.image.is_dir(), args.reference.is_dir()) {
        (false, false) => tell(&judge(&args, limits)?, globals),
        (true, true) => tell(&judge_sequence(&args, limits)?, globals),
        (image_is_folder, _) => {
            let (folder, file) = match image_is_folder {
                true => (&args.image, &args.reference),
                false => (&args.reference, &args.image),
            };
            Err(CliError::new(format!(
                "{} is a folder and {} is not; give two pictures or two folders of frames",
                folder.display(),
                file.display()
            ))
            .in_arguments())
        }
    }
}

fn tell(judgement: &(impl serde::Serialize + std::fmt::Display), globals: &Globals) -> CliResult {
    if globals.json {
        println!("{}", serde_json::to_string(judgement)?);
    } else {
        print!("{judgement}");
    }
    Ok(())
}
