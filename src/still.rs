//! A still picture from a fixed camera: passes of one technique, each with photons of its own, averaged.
//!
//! Every pass is a picture of its own radius, so stopping after any of them leaves a whole picture.

use glam::Vec3;

use crate::gather::{EyeImage, EyeSettings};
use crate::gpu::pass::Recorder;
use crate::gpu::timing::{PassTime, PassTimer};
use crate::gpu::{GpuDevice, GpuError};
use crate::image::{LinearImage, Scatter};
use crate::params::Params;
use crate::scene::ScenePose;
use crate::scene::effects::Effects;
use crate::scene::gpu_scene::GpuScene;
use crate::scene::light_importance::{LightImportance, Surroundings};
use crate::scene::loaded::LoadedScene;
use crate::technique::{self, FrameSettings, Start, Statistics, Technique, TechniqueEntry};
use crate::view::View;

/// A picture in the making.
pub struct Still<'a> {
    gpu: &'a GpuDevice,
    params: Params,
    pose: ScenePose,
    on_gpu: &'a GpuScene,
    /// As the first look tells it: all passes pick lights alike.
    light_importance: LightImportance,
    technique: Box<dyn Technique + 'a>,
    eye: EyeSettings,
    image: EyeImage,
    timer: PassTimer,
    /// Of the passes, where it is kept; the image then holds the last one alone.
    scatter: Option<Scatter>,
    /// Passes in the picture.
    passes: u32,
    /// Passes since the start: another one gives other random numbers.
    frame: u32,
}

impl<'a> Still<'a> {
    /// Prepares a picture of `size` from `view` (scene space); with a gaze, its regions get what the parameters give them, without
    /// one the whole picture is fovea.
    ///
    /// # Errors
    /// [`GpuError`] when a buffer can't be made.
    pub fn start(
        gpu: &'a GpuDevice,
        scene: &'a LoadedScene,
        params: &Params,
        entry: &TechniqueEntry,
        view: View,
        size: (u32, u32),
        gaze_dir_in_view: Option<Vec3>,
    ) -> Result<Self, GpuError> {
        let eye = EyeSettings::new(params, view, gaze_dir_in_view);
        let effects = technique::effects(&scene.scene, params);
        Self::with_effects(gpu, scene, params, entry, eye, size, effects)
    }

    /// Prepares a picture of `size` for an eye as told, with the effects as told.
    ///
    /// # Errors
    /// [`GpuError`] when a buffer can't be made.
    pub fn with_effects(
        gpu: &'a GpuDevice,
        scene: &'a LoadedScene,
        params: &Params,
        entry: &TechniqueEntry,
        eye: EyeSettings,
        size: (u32, u32),
        effects: Effects,
    ) -> Result<Self, GpuError> {
        let technique = (entry.start)(&Start {
            gpu,
            scene: &scene.scene,
            caster: &scene.caster,
            on_gpu: &scene.on_gpu,
            effects,
            params,
            size,
            is_session: false,
        })?;
        let pose = scene.scene.pose_at(0.0);
        let mut light_importance = LightImportance::new(params.direct.importance_share);
        if light_importance.matters_to(&scene.on_gpu) {
            let around = Surroundings {
                scene: &scene.scene,
                caster: &scene.caster,
                pose: &pose,
                on_gpu: &scene.on_gpu,
            };
            light_importance.look(&around, &[eye.focus()]);
        }
        Ok(Self {
            gpu,
            params: params.clone(),
            pose,
            on_gpu: &scene.on_gpu,
            light_importance,
            technique,
            eye,
            image: EyeImage::new(gpu, size.0, size.1)?,
            timer: PassTimer::new(gpu),
            scatter: None,
            passes: 0,
            frame: 0,
        })
    }

    /// Keeps the scatter of the passes too, where the technique's are independent, for [`Still::standard_error`]. Costs a reading of the
    /// picture each pass. Starts the picture anew.
    pub fn keep_scatter(&mut self) {
        self.start_over();
        self.scatter = self
            .technique
            .has_independent_passes()
            .then(|| self.no_scatter());
    }

    fn no_scatter(&self) -> Scatter {
        Scatter::new(self.image.width() as usize * self.image.height() as usize)
    }

    /// Adds one pass; returns the time of its stages.
    ///
    /// # Errors
    /// [`GpuError`] when the device fails.
    pub fn add_pass(&mut self) -> Result<Vec<PassTime>, GpuError> {
        // Another picture of the scene may have picked by its own since.
        self.light_importance.apply(self.gpu, self.on_gpu);
        let mut recorder = Recorder::new(self.gpu, &mut self.timer);
        if self.passes == 0 || self.scatter.is_some() {
            self.image.clear(recorder.encoder());
        }
        let eye = EyeSettings {
            frame: self.frame,
            ..self.eye
        };
        let frame = FrameSettings {
            frame: self.frame,
            pass: self.passes,
            pose: &self.pose,
            eyes: &[eye],
        };
        self.technique.prepare(&mut recorder, &frame)?;
        self.technique.shade(&mut recorder, &eye, &self.image)?;
        let times = recorder.finish()?;
        if let Some(scatter) = &mut self.scatter {
            let pass = self.image.read(self.gpu)?;
            let pass = pass.rgb.iter().map(|rgb| rgb.map(f64::from));
            scatter.add(&Vec::from_iter(pass));
        }
        self.passes += 1;
        self.frame += 1;
        Ok(times)
    }

    /// Starts the picture anew, with random numbers that no pass has had: the next pass is the first of another, independent picture.
    pub fn start_over(&mut self) {
        self.passes = 0;
        if self.scatter.is_some() {
            self.scatter = Some(self.no_scatter());
        }
    }

    /// Starts the picture anew with the random numbers of the pass `frame`, so that two pictures can be made of the same ones.
    pub fn start_over_at(&mut self, frame: u32) {
        self.start_over();
        self.frame = frame;
    }

    /// The mean over the passes so far.
    ///
    /// # Errors
    /// [`GpuError`] when the device fails.
    pub fn read(&self) -> Result<LinearImage, GpuError> {
        match &self.scatter {
            Some(scatter) => Ok(self.picture(scatter.mean())),
            None => self.image.read(self.gpu),
        }
    }

    /// The standard error of each channel of the mean, where the scatter is kept and there are two passes at least.
    pub fn standard_error(&self) -> Option<LinearImage> {
        let scatter = self
            .scatter
            .as_ref()
            .filter(|scatter| scatter.samples() > 1)?;
        Some(self.picture(scatter.standard_error()))
    }

    fn picture(&self, rgb: Vec<[f32; 3]>) -> LinearImage {
        LinearImage {
            width: self.image.width(),
            height: self.image.height(),
            rgb,
        }
    }

    /// What happened in the last pass.
    ///
    /// # Errors
    /// [`GpuError`] when the device fails.
    pub fn statistics(&self) -> Result<Statistics, GpuError> {
        self.technique.statistics(self.gpu)
    }

    /// The parameters that the picture is made with.
    pub fn params(&self) -> &Params {
        &self.params
    }
}
