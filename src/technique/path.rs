//! The oracle as a technique, so that whatever renders can also render the truth.

use super::{FrameSettings, Start, Statistics, Technique};
use crate::gather::{EyeImage, EyeSettings, HostSamples};
use crate::gpu::pass::Recorder;
use crate::gpu::{GpuDevice, GpuError};
use crate::oracle::{Oracle, PathSettings};
use crate::params;
use crate::scene::Scene;
use crate::scene::bvh::SceneCaster;

/// The passes of a frame, as the timings name them.
pub const PASSES: &[&str] = &["path tracing", "resolve"];

/// `path`.
pub struct PathTracing<'s> {
    scene: &'s Scene,
    caster: &'s SceneCaster,
    oracle: Option<Oracle<'s>>,
    host_samples: HostSamples,
    params: params::Path,
    paths: u64,
}

impl PathTracing<'_> {
    /// Prepares the technique.
    ///
    /// # Errors
    /// [`GpuError`] when the device can't hold an image of samples.
    pub fn start<'s>(start: &Start<'s, '_>) -> Result<Box<dyn Technique + 's>, GpuError> {
        Ok(Box::new(PathTracing {
            scene: start.scene,
            caster: start.caster,
            oracle: None,
            host_samples: HostSamples::new(start.gpu, start.size)?,
            params: start.params.path.clone(),
            paths: 0,
        }))
    }
}

impl Technique for PathTracing<'_> {
    fn prepare(&mut self, _: &mut Recorder<'_>, frame: &FrameSettings<'_>) -> Result<(), GpuError> {
        // A picture's passes share the pose; a session's frames have one each.
        if frame.pass == 0 {
            self.oracle = Some(Oracle::new(self.scene, self.caster, frame.pose));
        }
        self.paths = 0;
        Ok(())
    }

    fn shade(
        &mut self,
        recorder: &mut Recorder<'_>,
        eye: &EyeSettings,
        image: &EyeImage,
    ) -> Result<(), GpuError> {
        let Some(oracle) = &self.oracle else {
            return Ok(());
        };
        let size = (image.width(), image.height());
        let count = self.params.samples;
        let settings = PathSettings {
            samples: count,
            depth_max: self.params.depth_max,
            caustic_photons: self.params.caustic_photons,
            caustic_radius_m: f64::from(self.params.caustic_radius_m),
            seed: eye.seed,
            frame: eye.frame,
        };
        let sums = recorder.on_host("path tracing", || {
            oracle.sums(eye.scene_from_view, eye.fov, size, &settings)
        });
        let sums: Vec<[f32; 4]> = sums
            .iter()
            .map(|[r, g, b]| [*r as f32, *g as f32, *b as f32, count as f32])
            .collect();
        self.paths += sums.len() as u64 * u64::from(count);
        self.host_samples.record(recorder, "resolve", &sums, image)
    }

    fn has_independent_passes(&self) -> bool {
        true
    }

    fn statistics(&self, _: &GpuDevice) -> Result<Statistics, GpuError> {
        Ok(Statistics {
            counts: vec![("paths", self.paths as f64)],
            warnings: Vec::new(),
        })
    }
}
