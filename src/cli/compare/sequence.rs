//! A sequence of frames against its reference: the mean errors, flicker, and what the two eyes are shown differently.

use std::path::PathBuf;

use serde::Serialize;

use super::frames::{FrameFolder, Moment};
use super::picture::{Limits, Pictures};
use super::{Args, ReferenceSe};
use crate::cli::CliError;
use crate::cli::progress::Progress;
use crate::image::LinearImage;
use crate::metrics::error::Faults;
use crate::metrics::region::{ByRegion, EccentricityLimits, EyeView};
use crate::metrics::stereo::{self, Disagreement};
use crate::metrics::temporal::TemporalError;
use crate::metrics::{Area, Comparison};

/// What `compare` reports of a sequence. Every figure is the mean over its frames (and eyes), or over its pairs of consecutive frames;
/// a PSNR is that of the mean squared error.
#[derive(Clone, Debug, Serialize)]
pub struct SequenceJudgement {
    /// The folder that was judged.
    pub image: PathBuf,
    /// What it should be.
    pub reference: PathBuf,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Pictures compared, of both eyes together.
    pub frames: usize,
    /// Those of them whose reference has a standard error.
    pub frames_with_reference_se: usize,
    /// Those of them whose reference is black: they are in `per_frame` and in the flicker only.
    pub frames_against_black: usize,
    /// The regions' limits, where the gaze is known.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub limits: Option<Limits>,
    /// NaN, infinite and negative channel values of all frames.
    pub faults: Faults,
    /// The errors of the whole and of the regions.
    #[serde(flatten)]
    pub areas: ByRegion<SequenceArea>,
    /// What the two eyes are shown differently, where there are two.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stereo: Option<ByRegion<Disagreement>>,
    /// Each frame's own errors.
    pub per_frame: Vec<FrameErrors>,
}

/// The errors of a region over a sequence.
#[derive(Clone, Debug, Serialize)]
pub struct SequenceArea {
    /// The mean errors of single frames, where a reference is not black.
    #[serde(flatten)]
    pub area: Option<Area>,
    /// What changes from frame to frame, by the regions of the later one of each pair; `None` for a single frame.
    #[serde(flatten)]
    pub temporal: Option<TemporalError>,
}

/// The errors of one frame.
#[derive(Clone, Debug, Serialize)]
pub struct FrameErrors {
    /// Its file.
    pub frame: String,
    /// Its errors.
    #[serde(flatten)]
    pub comparison: Comparison,
}

/// A frame of one eye and where that eye looked.
struct Frame {
    pictures: Pictures,
    view: Option<EyeView>,
}

/// Compares two folders of frames.
///
/// # Errors
/// Folders whose frames differ in name or size, a frame that cannot be read or judged, options that go with single pictures only.
pub fn judge_sequence(
    args: &Args,
    limits: EccentricityLimits,
) -> Result<SequenceJudgement, CliError> {
    check_options(args)?;
    let candidate = FrameFolder::open(&args.image)?;
    let reference = FrameFolder::open(&args.reference)?;
    candidate.check_same_names(&reference)?;
    let progress = Progress::new("comparing", candidate.len() as u64, "frames");
    let mut tally = Tally {
        limits,
        size: None,
        knows_gaze: args.gaze.is_some() || candidate.knows_views(),
        frames_with_reference_se: 0,
        temporal: Vec::new(),
        stereo: Vec::new(),
        per_frame: Vec::new(),
    };
    let mut before = [None, None];
    for moment in candidate.moments() {
        let frame = |eye| read(args, [&candidate, &reference], &moment, eye);
        let now = [frame(0)?, frame(1)?];
        for eye in 0..2 {
            if let Some(frame) = &now[eye] {
                tally.add(frame, before[eye].as_ref())?;
                progress.advance(1);
            }
        }
        if let [Some(left), Some(right)] = &now {
            tally.add_stereo([left, right]);
        }
        before = now;
    }
    Ok(tally.judgement(args))
}

fn check_options(args: &Args) -> Result<(), CliError> {
    let refused = match args {
        Args {
            reference_se: ReferenceSe::File(_),
            ..
        } => {
            "--reference-se FILE goes with one picture; in a folder, NAME.se.exr beside a reference NAME.exr is taken"
        }
        Args { flip: true, .. }
        | Args {
            fovvideovdp: Some(_),
            ..
        } => "--flip and --fovvideovdp judge one picture; give them a frame and its reference",
        _ => return Ok(()),
    };
    Err(CliError::new(refused).in_arguments())
}

fn read(
    args: &Args,
    folders: [&FrameFolder; 2],
    moment: &Moment,
    eye: usize,
) -> Result<Option<Frame>, CliError> {
    let Some(name) = &moment.files[eye] else {
        return Ok(None);
    };
    let [candidate, _] = folders;
    let paths = folders.map(|folder| folder.pictures.join(name));
    let pictures = Pictures::read(&paths[0], &paths[1], &args.reference_se)?;
    let LinearImage { width, height, .. } = pictures.candidate;
    let view = match args.eye_view(width, height) {
        None if candidate.knows_views() => Some(candidate.view(moment, eye).ok_or_else(|| {
            CliError::new(format!(
                "{}: frames.csv has no row for this frame",
                paths[0].display()
            ))
        })?),
        told => told,
    };
    Ok(Some(Frame { pictures, view }))
}

/// What the frames so far gave.
struct Tally {
    limits: EccentricityLimits,
    size: Option<[u32; 2]>,
    knows_gaze: bool,
    frames_with_reference_se: usize,
    temporal: Vec<ByRegion<TemporalError>>,
    stereo: Vec<ByRegion<Disagreement>>,
    per_frame: Vec<FrameErrors>,
}

impl Tally {
    /// Takes in a frame, and the change from the one before it.
    fn add(&mut self, frame: &Frame, before: Option<&Frame>) -> Result<(), CliError> {
        let Frame { pictures, view } = frame;
        let path = &pictures.candidate_path;
        let size = [pictures.candidate.width, pictures.candidate.height];
        let [width, height] = *self.size.get_or_insert(size);
        if size != [width, height] {
            return Err(CliError::new(format!(
                "{} is {}x{} but the frames before it are {width}x{height}; compare frames of one size",
                path.display(),
                size[0],
                size[1]
            )));
        }
        self.frames_with_reference_se += usize::from(pictures.standard_error.is_some());
        self.per_frame.push(FrameErrors {
            frame: path
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned(),
            comparison: pictures.compare(*view, self.limits)?,
        });
        if let Some(before) = before {
            let angles = view.map(|view| pictures.eccentricity_rad(view));
            let region = |pixel: usize| Some(self.limits.region(angles.as_ref()?[pixel]));
            let (before, after) = (before.pictures.pair(), pictures.pair());
            let change = |pixels: &[usize]| TemporalError::of(before, after, pixels);
            self.temporal
                .push(ByRegion::of(after.candidate.len(), region, change));
        }
        Ok(())
    }

    fn add_stereo(&mut self, eyes: [&Frame; 2]) {
        let eyes = eyes.map(|frame| stereo::Eye {
            pair: frame.pictures.pair(),
            view: frame.view,
        });
        self.stereo.push(stereo::disagreement(eyes, self.limits));
    }

    fn judgement(self, args: &Args) -> SequenceJudgement {
        let comparisons = || self.per_frame.iter().map(|frame| &frame.comparison);
        let areas = Vec::from_iter(comparisons().map(Comparison::areas));
        let areas = ByRegion::combine(&areas, Area::mean);
        let temporal = ByRegion::combine(&self.temporal, TemporalError::mean);
        let [width, height] = self.size.unwrap_or_default();
        SequenceJudgement {
            image: args.image.clone(),
            reference: args.reference.clone(),
            width,
            height,
            frames: self.per_frame.len(),
            frames_with_reference_se: self.frames_with_reference_se,
            frames_against_black: comparisons().filter(|c| c.against_black.is_some()).count(),
            limits: self.knows_gaze.then(|| self.limits.into()),
            faults: comparisons().map(|comparison| comparison.faults).sum(),
            areas: areas.zip(temporal, |area, temporal| SequenceArea { area, temporal }),
            stereo: (!self.stereo.is_empty())
                .then(|| ByRegion::combine(&self.stereo, Disagreement::mean)),
            per_frame: self.per_frame,
        }
    }
}
