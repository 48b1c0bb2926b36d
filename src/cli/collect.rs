//! What a session leaves behind: pictures as files, `frames.csv`, and the report's data.

use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use super::eye_columns::{self, EYE_NAMES, angles_deg};
use super::run_record::RunRecord;
use crate::fovea::region;
use crate::frame::{FrameInput, FrameOutcome, FrameRenderer};
use crate::gpu::GpuDevice;
use crate::image::{LinearImage, exr, png};
use crate::metrics::region::EyeView;
use crate::params::Params;
use crate::report::{self, Report};
use crate::scene::Scene;
use crate::scene::effects::Effects;
use crate::view::Fov;

/// What becomes of the pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum CaptureFormat {
    /// Nothing but the report's.
    None,
    /// As shown.
    Png,
    /// Linear radiance.
    Exr,
}

/// What can fail while frames are kept.
#[derive(Debug, thiserror::Error)]
pub enum FrameError {
    /// Reading a picture back failed.
    #[error(transparent)]
    Gpu(#[from] crate::gpu::GpuError),
    /// A picture could not be written.
    #[error(transparent)]
    Exr(#[from] exr::ExrError),
    /// A picture could not be written.
    #[error(transparent)]
    Png(#[from] png::PngError),
    /// A picture could not be encoded for the report.
    #[error(transparent)]
    Report(#[from] report::ReportError),
    /// The table could not be written.
    #[error("cannot write {}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// What went wrong.
        source: csv::Error,
    },
    /// The folder of pictures could not be made.
    #[error("cannot make the folder {}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
}

/// Title and a few words under it.
pub struct Heading {
    /// The report's heading.
    pub title: String,
    /// What was shown and how.
    pub subtitle: Vec<String>,
}

/// Keeps what each frame showed.
pub struct Collector {
    folder: PathBuf,
    capture: CaptureFormat,
    params: Params,
    table: csv::Writer<BufWriter<File>>,
    table_path: PathBuf,
    picture_stride: usize,
    frames: Vec<report::Frame>,
    picture_size: [u32; 2],
    warnings: Vec<String>,
}

impl Collector {
    /// Starts the table, and the folder of pictures if there will be any.
    ///
    /// # Errors
    /// [`FrameError::Table`], [`FrameError::Folder`].
    pub fn new(
        folder: &Path,
        capture: CaptureFormat,
        params: &Params,
        frame_count: usize,
    ) -> Result<Self, FrameError> {
        let pictures = folder.join("frames");
        if capture != CaptureFormat::None {
            fs::create_dir_all(&pictures).map_err(|source| FrameError::Folder {
                path: pictures.clone(),
                source,
            })?;
        }
        let table_path = folder.join("frames.csv");
        let file = File::create(&table_path).map_err(|error| FrameError::Table {
            path: table_path.clone(),
            source: error.into(),
        })?;
        Ok(Self {
            folder: pictures,
            capture,
            params: params.clone(),
            table: csv::Writer::from_writer(BufWriter::new(file)),
            table_path,
            picture_stride: report::picture_stride(frame_count),
            frames: Vec::new(),
            picture_size: [0; 2],
            warnings: Vec::new(),
        })
    }

    /// Keeps one frame.
    ///
    /// # Errors
    /// [`FrameError`]: what could not be read, encoded or written.
    pub fn add(
        &mut self,
        gpu: &GpuDevice,
        input: &FrameInput,
        outcome: &FrameOutcome,
        renderer: &FrameRenderer<'_>,
    ) -> Result<(), FrameError> {
        self.add_row(input, outcome)?;
        for warning in &outcome.statistics.warnings {
            if !self.warnings.contains(warning) {
                self.warnings.push(warning.clone());
            }
        }
        let mut eyes = [report::Eye::default(), report::Eye::default()];
        for (index, image) in renderer.images().iter().enumerate() {
            eyes[index] = report_eye(&input.local_from_eye[index].fov, outcome, index);
            let is_pictured = self.frames.len().is_multiple_of(self.picture_stride);
            if self.capture == CaptureFormat::None && !is_pictured {
                continue;
            }
            let picture = image.read(gpu)?;
            self.picture_size = [picture.width, picture.height];
            self.keep_picture(&picture, EYE_NAMES[index], input.index)?;
            if is_pictured {
                eyes[index].picture = Some(encode(&picture, self.params.display.exposure_ev)?);
            }
        }
        self.frames.push(report::Frame {
            index: u64::from(input.index),
            display_time_ns: input.display_time_ns,
            eyes,
            gaze_state: state_name(outcome),
            gaze_age_ms: gaze_age_ms(input, outcome),
            gaze_angles_deg: Some(angles_deg(outcome.gaze.ray.dir().as_dvec3())),
            pass_ms: outcome
                .passes
                .iter()
                .map(|pass| (pass.name.to_owned(), pass.ms))
                .collect(),
            counts: photon_counts(outcome),
        });
        Ok(())
    }

    fn keep_picture(&self, picture: &LinearImage, eye: &str, index: u32) -> Result<(), FrameError> {
        match self.capture {
            CaptureFormat::None => {}
            CaptureFormat::Png => {
                let path = self.folder.join(format!("{eye}_{index:05}.png"));
                png::write(&path, picture, self.params.display.exposure_ev)?;
            }
            CaptureFormat::Exr => {
                exr::write(&self.folder.join(format!("{eye}_{index:05}.exr")), picture)?
            }
        }
        Ok(())
    }

    fn add_row(&mut self, input: &FrameInput, outcome: &FrameOutcome) -> Result<(), FrameError> {
        let [azimuth_deg, elevation_deg] = angles_deg(outcome.gaze.ray.dir().as_dvec3());
        let optional =
            |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:.3}"));
        let mut columns: Vec<(String, String)> = vec![
            ("frame".into(), input.index.to_string()),
            ("display_time_ns".into(), input.display_time_ns.to_string()),
            ("gaze_state".into(), state_name(outcome)),
            ("gaze_age_ms".into(), optional(gaze_age_ms(input, outcome))),
            ("gaze_azimuth_deg".into(), format!("{azimuth_deg:.4}")),
            ("gaze_elevation_deg".into(), format!("{elevation_deg:.4}")),
            (
                "fixation_distance_m".into(),
                format!("{:.4}", outcome.fixation.distance_m),
            ),
            (
                "fovea_radius_deg".into(),
                format!("{:.4}", outcome.regions.fovea_radius_rad.to_degrees()),
            ),
            ("wall_ms".into(), format!("{:.3}", outcome.wall_ms)),
        ];
        for eye in 0..2 {
            let view = EyeView {
                fov: input.local_from_eye[eye].fov,
                gaze_dir_in_view: outcome.gaze_dir_in_eye[eye].as_dvec3(),
            };
            let values = eye_columns::values(view).map(|value| format!("{value:.4}"));
            columns.extend(eye_columns::names(eye).into_iter().zip(values));
        }
        let passes = &outcome.passes;
        columns.extend(passes.iter().map(|p| {
            (
                format!("{}_ms", p.name.replace(' ', "_")),
                format!("{:.3}", p.ms),
            )
        }));
        columns.extend(
            outcome
                .statistics
                .counts
                .iter()
                .map(|(name, value)| ((*name).into(), value.to_string())),
        );
        let failed = |source| FrameError::Table {
            path: self.table_path.clone(),
            source,
        };
        if self.frames.is_empty() {
            self.table
                .write_record(columns.iter().map(|(name, _)| name))
                .map_err(failed)?;
        }
        let failed = |source| FrameError::Table {
            path: self.table_path.clone(),
            source,
        };
        self.table
            .write_record(columns.iter().map(|(_, value)| value))
            .map_err(failed)?;
        // A run that dies leaves whole rows.
        let failed = |source: std::io::Error| FrameError::Table {
            path: self.table_path.clone(),
            source: source.into(),
        };
        self.table.flush().map_err(failed)
    }

    /// Warnings of the frames, each once.
    pub fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    /// The report over all frames.
    pub fn report(self, heading: &Heading, scene: &Scene, record: &RunRecord) -> Report {
        let fact = |name: &str, value: &Option<String>| {
            value.clone().map(|value| report::Fact {
                name: name.into(),
                value,
            })
        };
        let provenance = [
            fact("macula", &Some(record.version.clone())),
            fact("commit", &record.git_commit),
            fact("device", &record.device),
            fact("driver", &record.driver),
            fact("OpenXR runtime", &record.runtime),
            fact("scene SHA-256", &record.scene_sha256),
            fact("parameters SHA-256", &record.parameters_sha256),
            fact("seed", &record.seed.map(|seed| seed.to_string())),
        ];
        let units = Params::knobs();
        Report {
            title: heading.title.clone(),
            subtitle: heading.subtitle.clone(),
            picture_size: self.picture_size,
            frames: self.frames,
            effects: Effects::report(scene, self.params.gather.glossy_alpha_min)
                .into_iter()
                .map(|effect| report::Effect {
                    name: effect.effect.into(),
                    active: effect.on,
                    why: effect.why,
                })
                .collect(),
            parameters: self
                .params
                .values()
                .into_iter()
                .zip(units)
                .map(|((key, value), knob)| report::Parameter {
                    key: key.into(),
                    value,
                    unit: knob.unit.into(),
                })
                .collect(),
            provenance: provenance.into_iter().flatten().collect(),
            warnings: record.warnings.clone(),
        }
    }
}

/// The gaze state as `frames.csv` and the report name it.
fn state_name(outcome: &FrameOutcome) -> String {
    serde_json::json!(outcome.gaze.state)
        .as_str()
        .unwrap_or_default()
        .to_owned()
}

fn gaze_age_ms(input: &FrameInput, outcome: &FrameOutcome) -> Option<f64> {
    outcome
        .gaze
        .age_ns(input.display_time_ns)
        .map(|age_ns| age_ns as f64 * 1e-6)
}

fn photon_counts(outcome: &FrameOutcome) -> Vec<(String, u64)> {
    let counts = outcome
        .statistics
        .counts
        .iter()
        .filter(|(name, _)| name.starts_with("photons"));
    counts
        .map(|(name, value)| (name.replace('_', " "), *value as u64))
        .collect()
}

fn report_eye(fov: &Fov, outcome: &FrameOutcome, eye: usize) -> report::Eye {
    let gaze_dir = outcome.gaze_dir_in_eye[eye];
    let outlines = [
        (
            report::OutlinedRegion::Fovea,
            outcome.regions.fovea_radius_rad,
        ),
        (
            report::OutlinedRegion::Transition,
            outcome.regions.transition_radius_rad,
        ),
    ]
    .into_iter()
    .flat_map(|(region, radius_rad)| {
        region::outline(fov, gaze_dir, radius_rad)
            .into_iter()
            .map(move |points| report::Outline {
                region,
                points_uv: points.into_iter().map(|point| point.to_array()).collect(),
            })
    })
    .collect();
    report::Eye {
        picture: None,
        gaze_uv: fov.project(gaze_dir).map(|uv| uv.to_array()),
        outlines,
    }
}

fn encode(picture: &LinearImage, exposure_ev: f32) -> Result<report::Picture, report::ReportError> {
    let rgba: Vec<u8> = png::to_rgb8(picture, exposure_ev)
        .chunks_exact(3)
        .flat_map(|rgb| [rgb[0], rgb[1], rgb[2], 255])
        .collect();
    report::Picture::jpeg(picture.width, picture.height, &rgba)
}
