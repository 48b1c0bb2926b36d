//! One frame, stage by stage: from where the head is and the eyes look, to a lit picture in each eye.

use std::time::Instant;

use glam::{Quat, Vec3};

use crate::fovea::{Fixation, FixationParams, Regions};
use crate::gather::{EyeImage, EyeSettings};
use crate::gaze::source::GazeParams;
use crate::gaze::{GazeReading, GazeSample, GazeSource};
use crate::gpu::pass::Recorder;
use crate::gpu::timing::{PassTime, PassTimer};
use crate::gpu::{GpuDevice, GpuError};
use crate::image::present::Presenter;
use crate::params::Params;
use crate::scene::bvh::SceneCaster;
use crate::scene::gpu_scene::GpuScene;
use crate::scene::light_importance::{LightImportance, Surroundings};
use crate::scene::{Scene, ScenePose};
use crate::technique::{self, FrameSettings, Start, Statistics, Technique, TechniqueEntry};
use crate::view::{Pose, View};

/// What a frame starts from. Poses are in the session's play space (OpenXR's LOCAL).
#[derive(Clone, Copy, Debug)]
pub struct FrameInput {
    /// Counts the session's frames.
    pub index: u32,
    /// When the frame will be seen, ns.
    pub display_time_ns: i64,
    /// Seconds since the session's first frame, for what moves in the scene.
    pub scene_time_s: f64,
    /// Where the head is.
    pub local_from_head: Pose,
    /// Left and right eye.
    pub local_from_eye: [View; 2],
    /// The eye tracker's newest sample, or `None` where it sees no eye.
    pub gaze: Option<GazeSample>,
}

/// What a frame was made from and what it took.
#[derive(Clone, Debug)]
pub struct FrameOutcome {
    /// The gaze that the frame was drawn with.
    pub gaze: GazeReading,
    /// Unit gaze direction in each eye's view space.
    pub gaze_dir_in_eye: [Vec3; 2],
    /// Where the regions end, widened while the gaze is unsure.
    pub regions: Regions,
    /// What was looked at.
    pub fixation: Fixation,
    /// Time per pass on the device; empty where it has no timestamps.
    pub passes: Vec<PassTime>,
    /// Wall time of the frame, ms.
    pub wall_ms: f64,
    /// Photon counts and warnings.
    pub statistics: Statistics,
}

/// Name of the stage that moves objects and lights, as the timings give it; only scenes with motion have it.
pub const MOTION: &str = "scene motion";
/// Name of the stage that finds which lights matter to the eyes; only scenes with several lamps have it.
pub const LIGHT_IMPORTANCE: &str = "light importance";

/// Everything that stays from frame to frame.
pub struct FrameRenderer<'a> {
    gpu: &'a GpuDevice,
    scene: &'a Scene,
    caster: &'a SceneCaster,
    on_gpu: GpuScene,
    has_motion: bool,
    light_importance: LightImportance,
    params: Params,
    scene_from_local: Pose,
    gaze: GazeSource,
    technique: Box<dyn Technique + 'a>,
    images: [EyeImage; 2],
    presenter: Presenter,
    timer: PassTimer,
}

impl<'a> FrameRenderer<'a> {
    /// Prepares frames of `size` per eye, shown on targets of `format`.
    ///
    /// # Errors
    /// [`GpuError`] when scene or buffers do not fit the device.
    pub fn new(
        gpu: &'a GpuDevice,
        scene: &'a Scene,
        caster: &'a SceneCaster,
        params: &Params,
        entry: &TechniqueEntry,
        size: [u32; 2],
        format: wgpu::TextureFormat,
    ) -> Result<Self, GpuError> {
        let pose = scene.pose_at(0.0);
        let on_gpu = GpuScene::new(gpu, scene, caster, &pose)?;
        let effects = technique::effects(scene, params);
        let technique = (entry.start)(&Start {
            gpu,
            scene,
            caster,
            on_gpu: &on_gpu,
            effects,
            params,
            size: (size[0], size[1]),
            is_session: true,
        })?;
        let image = || EyeImage::new(gpu, size[0], size[1]);
        let images = [image()?, image()?];
        Ok(Self {
            gpu,
            scene,
            caster,
            on_gpu,
            has_motion: effects.has_motion(),
            light_importance: LightImportance::new(params.direct.importance_share),
            params: params.clone(),
            scene_from_local: viewer_place(scene, params),
            gaze: GazeSource::live(gaze_params(params)),
            technique,
            presenter: Presenter::new(gpu, &images[0], format)?,
            images,
            timer: PassTimer::new(gpu),
        })
    }

    /// Renders one frame and shows it on `targets`.
    ///
    /// # Errors
    /// [`GpuError`] when the device fails.
    pub fn render(
        &mut self,
        input: &FrameInput,
        targets: &[wgpu::TextureView; 2],
    ) -> Result<FrameOutcome, GpuError> {
        let started = Instant::now();
        let pose = self.scene.pose_at(input.scene_time_s);
        let gaze = self.gaze.update(input.display_time_ns, input.gaze.as_ref());
        let fixation = self.fixation(input, &gaze, &pose);
        let regions = regions(&self.params).widened(gaze.widening_rad);
        let views = input.local_from_eye.map(|view| View {
            pose: self.scene_from_local.compose(view.pose),
            fov: view.fov,
        });
        let eyes =
            [0, 1].map(|eye| self.eye_settings(input.index, eye, views[eye], &fixation, &regions));

        let mut recorder = Recorder::new(self.gpu, &mut self.timer);
        if self.has_motion {
            let move_scene = || self.on_gpu.set_pose(self.gpu, &pose);
            recorder.on_host(MOTION, move_scene);
        }
        // Without a place or a field of view there is no picture: it stays black.
        let drawn = eyes.iter().zip(&views).zip(&self.images);
        let drawn = Vec::from_iter(drawn.filter(|((_, view), _)| view.is_drawable()));
        if self.light_importance.matters_to(&self.on_gpu) {
            let around = Surroundings {
                scene: self.scene,
                caster: self.caster,
                pose: &pose,
                on_gpu: &self.on_gpu,
            };
            let focuses = Vec::from_iter(drawn.iter().map(|((eye, _), _)| eye.focus()));
            recorder.on_host(LIGHT_IMPORTANCE, || {
                self.light_importance.look(&around, &focuses);
                self.light_importance.apply(self.gpu, &self.on_gpu);
            });
        }
        let frame = FrameSettings {
            frame: input.index,
            pass: 0,
            pose: &pose,
            eyes: &Vec::from_iter(drawn.iter().map(|((eye, _), _)| **eye)),
        };
        self.technique.prepare(&mut recorder, &frame)?;
        for image in &self.images {
            image.clear(recorder.encoder());
        }
        for ((eye, _), image) in drawn {
            self.technique.shade(&mut recorder, eye, image)?;
        }
        for (image, target) in self.images.iter().zip(targets) {
            let exposure_ev = self.params.display.exposure_ev;
            self.presenter
                .record(self.gpu, recorder.encoder(), image, exposure_ev, target);
        }
        let passes = recorder.finish()?;

        Ok(FrameOutcome {
            gaze,
            gaze_dir_in_eye: eyes.map(|eye| eye.gaze_dir_in_view),
            regions,
            fixation,
            passes,
            statistics: self.technique.statistics(self.gpu)?,
            wall_ms: started.elapsed().as_secs_f64() * 1e3,
        })
    }

    /// The left and right eye's pictures of the last frame.
    pub fn images(&self) -> &[EyeImage; 2] {
        &self.images
    }

    /// Cuts the gaze ray with the scene, so that each eye can aim at the point itself.
    fn fixation(&self, input: &FrameInput, gaze: &GazeReading, pose: &ScenePose) -> Fixation {
        let scene_from_head = self
            .scene_from_local
            .compose(input.local_from_head)
            .to_affine();
        let origin_m = scene_from_head.transform_point3(gaze.ray.origin_m());
        let dir = scene_from_head.transform_vector3(gaze.ray.dir());
        let hit = self.caster.first_hit(origin_m, dir, f32::INFINITY, pose);
        let params = FixationParams {
            default_distance_m: self.params.gaze.default_distance_m,
            ..Default::default()
        };
        Fixation::of_ray(origin_m, dir, hit.map(|hit| hit.t), &params)
    }

    fn eye_settings(
        &self,
        index: u32,
        eye: usize,
        view: View,
        fixation: &Fixation,
        regions: &Regions,
    ) -> EyeSettings {
        // A point inside the eye has no direction: look straight ahead then.
        let gaze_dir = fixation.gaze_dir_in_eye(view.pose).unwrap_or(Vec3::NEG_Z);
        EyeSettings {
            fovea_radius_rad: regions.fovea_radius_rad,
            transition_radius_rad: regions.transition_radius_rad,
            // Each eye has random numbers of its own: alike, their noise would be seen in depth.
            seed: self
                .params
                .random
                .seed
                .wrapping_add(0x9e37_79b9_u32.wrapping_mul(eye as u32)),
            frame: index,
            eye,
            ..EyeSettings::new(&self.params, view, Some(gaze_dir))
        }
    }
}

/// Where the regions end by the parameters.
pub fn regions(params: &Params) -> Regions {
    Regions {
        fovea_radius_rad: params.fovea.radius_deg.to_radians(),
        transition_radius_rad: params.fovea.transition_deg.to_radians(),
    }
}

fn gaze_params(params: &Params) -> GazeParams {
    GazeParams {
        hold_ns: (f64::from(params.gaze.hold_s) * 1e9) as i64,
        widening_rad_s: params.gaze.widening_deg_s.to_radians(),
        widening_max_rad: params.gaze.widening_max_deg.to_radians(),
        ..GazeParams::default()
    }
}

/// Where the play space lies in the scene: at the file's first camera (or in the middle without one), upright, turned as it is, and
/// from there as the viewer parameters say.
fn viewer_place(scene: &Scene, params: &Params) -> Pose {
    let at_camera = scene.cameras.first().map_or(
        Pose {
            position_m: scene.bounds.center(),
            ..Pose::IDENTITY
        },
        |camera| {
            let ahead = camera.pose.orientation * Vec3::NEG_Z;
            let yaw_rad = f32::atan2(-ahead.x, -ahead.z);
            Pose {
                orientation: Quat::from_rotation_y(yaw_rad),
                position_m: camera.pose.position_m,
            }
        },
    );
    let viewer = &params.viewer;
    at_camera.compose(Pose {
        orientation: Quat::from_rotation_y(viewer.yaw_deg.to_radians()),
        position_m: Vec3::new(viewer.right_m, viewer.up_m, -viewer.forward_m),
    })
}
