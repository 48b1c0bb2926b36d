//! The passes of one eye: visible points, what a technique lights them by, the filter, resolve, as far as they are called for; sample by
//! sample, in bands of rows, so that the buffers of visible points stay small whatever the image's size.

use std::f32::consts::PI;

use glam::{Affine3A, Vec2, Vec3};

use super::EyeImage;
use super::filter::Filter;
use super::history::{HISTORY, History};
use super::light_pass::{Layer, LightPass};
use crate::gpu::layout::{self, EyeUniform, VisiblePoint};
use crate::gpu::pass::{BoundKernel, Constants, Kernel, Recorder, UniformSequence};
use crate::gpu::resources::{self, SplitArray};
use crate::gpu::shader::stages;
use crate::gpu::{GpuDevice, GpuError};
use crate::params::Params;
use crate::scene::effects::Effects;
use crate::scene::gpu_scene::GpuScene;
use crate::view::{Fov, View};

/// Threads in a workgroup of the eye passes.
const GROUP: u32 = 64;
/// Names of the passes, as the timings give them.
pub const VISIBLE_POINTS: &str = "visible points";
/// See [`VISIBLE_POINTS`].
pub const RESOLVE: &str = "resolve";

/// Most bytes that a band's visible points take.
const BAND_BYTES: u64 = 64 << 20;

/// What an eye's pixels get.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EyeSettings {
    /// Scene space from view space.
    pub scene_from_view: Affine3A,
    /// Field of view.
    pub fov: Fov,
    /// Unit gaze direction in this eye's view space.
    pub gaze_dir_in_view: Vec3,
    /// Half-angle of the fovea, radians; π and more: the whole image is fovea.
    pub fovea_radius_rad: f32,
    /// Half-angle where the periphery begins, radians.
    pub transition_radius_rad: f32,
    /// Samples a pixel in fovea, transition, periphery.
    pub samples: [u32; 3],
    /// Factor on the gather radius, likewise.
    pub radius_scale: [f32; 3],
    /// Shadow rays a visible point.
    pub shadow_rays: u32,
    /// Light candidates a shadow ray.
    pub light_candidates: u32,
    /// Paths that bring indirect light to a visible point, in fovea, transition, periphery.
    pub paths: [u32; 3],
    /// Most surfaces that such a path meets.
    pub path_depth_max: u32,
    /// Most traced vertices of an eye path.
    pub chain_max: u32,
    /// Which eye: 0 left, 1 right.
    pub eye: usize,
    /// Samples that a pixel keeps of earlier frames, where the eye passes keep any.
    pub kept_max: u32,
    /// Frames from one lit sample of a pixel outside the fovea to the next, where its light is kept.
    pub refresh_frames: u32,
    /// Seed of the random numbers; give each eye its own.
    pub seed: u32,
    /// Number of the frame or pass.
    pub frame: u32,
}

impl EyeSettings {
    /// What an eye's pixels get by the parameters; without a gaze the whole image is fovea. `view` is in scene space.
    pub fn new(params: &Params, view: View, gaze_dir_in_view: Option<Vec3>) -> Self {
        let fovea = &params.fovea;
        let (fovea_radius_rad, transition_radius_rad) = match gaze_dir_in_view {
            Some(_) => (
                fovea.radius_deg.to_radians(),
                fovea.transition_deg.to_radians(),
            ),
            None => (2.0 * PI, 2.0 * PI),
        };
        Self {
            scene_from_view: view.pose.to_affine(),
            fov: view.fov,
            gaze_dir_in_view: gaze_dir_in_view.unwrap_or(Vec3::NEG_Z),
            fovea_radius_rad,
            transition_radius_rad,
            samples: [
                fovea.samples,
                fovea.transition_samples,
                fovea.periphery_samples,
            ],
            radius_scale: [
                1.0,
                fovea.transition_radius_scale,
                fovea.periphery_radius_scale,
            ],
            shadow_rays: params.direct.shadow_rays,
            light_candidates: params.direct.candidates,
            paths: [
                params.indirect.paths,
                params.indirect.transition_paths,
                params.indirect.periphery_paths,
            ],
            path_depth_max: params.indirect.depth_max,
            chain_max: params.eye.chain_max,
            eye: 0,
            kept_max: params.temporal.kept_samples,
            refresh_frames: params.temporal.refresh_frames,
            seed: params.random.seed,
            frame: 0,
        }
    }
}

impl EyeSettings {
    /// The settings as shaders read them, for an image of `size`; band and sample are still to be filled in.
    pub(super) fn uniform(&self, (width, height): (u32, u32)) -> EyeUniform {
        let corner = self.fov.slope_at(Vec2::ZERO);
        EyeUniform {
            scene_from_view: layout::affine_rows(self.scene_from_view),
            slope_left_top: corner.to_array(),
            slope_extent: (self.fov.slope_at(Vec2::ONE) - corner).to_array(),
            gaze_dir_in_view: self.gaze_dir_in_view.to_array(),
            fovea_radius_rad: self.fovea_radius_rad,
            size: [width, height],
            samples: self.samples,
            transition_radius_rad: self.transition_radius_rad,
            radius_scale: self.radius_scale,
            seed: self.seed,
            frame: self.frame,
            shadow_rays: self.shadow_rays,
            light_candidates: self.light_candidates,
            paths: self.paths,
            path_depth_max: self.path_depth_max,
            chain_max: self.chain_max,
            ..Default::default()
        }
    }
}

/// What the eye passes start from.
#[derive(Clone, Copy)]
pub struct EyeStart<'a> {
    /// The device.
    pub gpu: &'a GpuDevice,
    /// The scene on it.
    pub scene: &'a GpuScene,
    /// What lights the visible points.
    pub light: &'a [LightPass<'a>],
    /// Levels of the filter over what is smooth of that light; 0: none.
    pub filter_levels: u32,
    /// Eyes whose pixels keep light from frame to frame: none, or both.
    pub keeping_eyes: usize,
    /// What is simulated.
    pub effects: Effects,
    /// Pixels of the images, across and down.
    pub size: (u32, u32),
    /// Most samples a pixel.
    pub samples_max: u32,
}

/// What pixels kept of their light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KeptLight {
    /// Pixels whose light may be kept.
    pub pixels: u32,
    /// Those among them whose light was kept and found again.
    pub found: u32,
    /// Samples that are kept in all.
    pub samples: u32,
}

/// Buffers and kernels of the eye passes for one image size.
pub struct EyePass {
    uniforms: UniformSequence,
    visible_points: BoundKernel,
    /// What adds light at each slot, with the name of its pass.
    light: Vec<(&'static str, BoundKernel)>,
    filter: Option<Filter>,
    /// One for each eye that keeps light.
    histories: Vec<History>,
    history_counts: wgpu::Buffer,
    resolve: Kernel,
    seen_emission: wgpu::Buffer,
    slot_radiance: wgpu::Buffer,
    width: u32,
    height: u32,
    /// Rows of a band that are shown.
    band_rows: u32,
    /// Rows above and below them that the filter looks at.
    margin_rows: u32,
    samples_max: u32,
    /// Visible points that a pixel may have (shaders/eye.wgsl).
    slots: u32,
    /// See `RUNS` in eye.wgsl.
    runs: u32,
}

impl EyePass {
    /// Prepares the passes; `constants` are the shaders'.
    ///
    /// # Errors
    /// [`GpuError`] when a buffer can't be made.
    pub fn new(start: &EyeStart<'_>, constants: &Constants) -> Result<Self, GpuError> {
        let &EyeStart {
            gpu,
            scene,
            light,
            filter_levels,
            keeping_eyes,
            effects,
            size: (width, height),
            samples_max,
        } = start;
        let slots_a_pixel = if effects.has_chains() { 2 } else { 1 };
        let margin_rows = Filter::reach_rows(filter_levels);
        let row_bytes =
            u64::from(width) * u64::from(slots_a_pixel) * size_of::<VisiblePoint>() as u64;
        let band_rows = (BAND_BYTES / row_bytes).clamp(1, u64::from(height.max(1))) as u32;
        let rows = (band_rows + 2 * margin_rows).min(height.max(1));
        let pixels = u64::from(width) * u64::from(rows);
        let slots = pixels * u64::from(slots_a_pixel);
        let bands = height.div_ceil(band_rows);
        let uniforms = UniformSequence::new::<EyeUniform>(gpu, "eye", bands * samples_max);
        let points = resources::storage::<VisiblePoint>(gpu, "visible_points_", slots)?;
        let seen_emission = resources::storage::<[f32; 4]>(gpu, "seen_emission", pixels)?;
        let slot_radiance = resources::storage::<[f32; 4]>(gpu, "slot_radiance", slots)?;
        let kept_at = resources::storage::<u32>(gpu, "kept_at", pixels)?;
        let history_counts = resources::storage::<[u32; 4]>(gpu, "history_counts", 1)?;
        let bound = scene
            .resources()
            .with("kept_at", &kept_at)
            .with("history_counts", &history_counts)
            .with("eye", uniforms.buffer())
            .with("visible_points_", &points)
            .with("seen_emission", &seen_emission)
            .with("slot_radiance", &slot_radiance);
        let image_chunks =
            SplitArray::chunk_count::<[f32; 4]>(u64::from(width) * u64::from(height));
        let size_of_name = |array: &str| match array {
            "image" => image_chunks,
            _ => scene.shader_size(array).unwrap_or(1),
        };
        let runs = gpu.equal_runs();
        let collects = filter_levels > 0 || keeping_eyes > 0;
        let flag = |on: bool| f64::from(u8::from(on));
        let own = [
            ("RUNS", f64::from(runs)),
            ("COLLECTS_LIGHT", flag(collects)),
        ];
        let constants = [constants, &own].concat();
        let kernel = |stage| Kernel::new(gpu, stage, &constants, &size_of_name);
        let filter = match collects {
            false => None,
            true => Some(Filter::new(
                gpu,
                (&bound, uniforms.buffer()),
                &constants,
                &size_of_name,
                slots,
                filter_levels,
            )?),
        };
        let histories = match &filter {
            None => Vec::new(),
            Some(filter) => {
                let bound = bound.clone().with_all(filter.collected());
                let pixels = u64::from(width) * u64::from(height);
                (0..keeping_eyes)
                    .map(|_| History::new(gpu, &bound, &constants, pixels))
                    .collect::<Result<_, GpuError>>()?
            }
        };
        let light = light
            .iter()
            .map(|pass| {
                let constants = [constants.as_slice(), &pass.constants].concat();
                let size_of_name = |array: &str| scene.shader_size(array).unwrap_or(pass.chunks);
                let kernel = Kernel::new(gpu, pass.stage, &constants, &size_of_name)?;
                let mut bound = bound.clone().with_all(pass.resources.clone());
                if let (Layer::Smooth, Some(filter)) = (pass.layer, &filter) {
                    bound = bound.with("slot_radiance", filter.smooth_radiance());
                }
                Ok((pass.name, kernel.bind(gpu, &bound)?))
            })
            .collect::<Result<_, GpuError>>()?;
        Ok(Self {
            visible_points: kernel(stages::visible_points)?.bind(gpu, &bound)?,
            light,
            filter,
            histories,
            history_counts,
            resolve: kernel(stages::resolve)?,
            uniforms,
            seen_emission,
            slot_radiance,
            width,
            height,
            band_rows,
            margin_rows,
            samples_max,
            slots: slots_a_pixel,
            runs,
        })
    }

    /// Records the samples of one eye, added onto `image`.
    ///
    /// # Errors
    /// [`GpuError::Unbound`] never in practice: the resolve pass is bound to `image` here.
    pub fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        settings: &EyeSettings,
        image: &EyeImage,
    ) -> Result<(), GpuError> {
        let gpu = recorder.gpu();
        let resources = resources_of_resolve(self, image);
        let resolve = self.resolve.bind(gpu, &resources)?;
        let values = self.uniform_values(settings);
        // The values are read by copies of this and later submissions: finish with the old ones first.
        recorder.submit();
        self.uniforms.write(gpu, &values);
        for (index, value) in values.iter().enumerate() {
            let pixels = (value.row_count * self.width).next_multiple_of(GROUP * self.runs);
            self.uniforms.select(recorder, index as u32);
            if let Some(filter) = &self.filter {
                if value.sample == 0 {
                    filter.start_band(recorder);
                }
                filter.start_sample(recorder);
            }
            recorder.pass(VISIBLE_POINTS, &[(&self.visible_points, pixels)]);
            let history = self.histories.get(settings.eye);
            if let Some(history) = history {
                recorder.pass(HISTORY, &[(history.kernels().0, pixels)]);
            }
            for (name, kernel) in &self.light {
                recorder.pass(name, &[(kernel, pixels * self.slots)]);
            }
            if let Some(filter) = &self.filter {
                filter.collect(recorder, pixels * self.slots);
            }
            recorder.pass(RESOLVE, &[(&resolve, pixels)]);
            let is_last = values.get(index + 1).is_none_or(|next| next.sample == 0);
            if let (Some(filter), true) = (&self.filter, is_last) {
                if let Some(history) = history {
                    recorder.pass(HISTORY, &[(history.kernels().1, pixels)]);
                }
                filter.finish_band(recorder, pixels, pixels * self.slots, image)?;
            }
            recorder.submit();
        }
        if let Some(history) = self.histories.get_mut(settings.eye) {
            history.turn(settings);
        }
        Ok(())
    }

    /// Forgets how much light was kept in the frame before, as [`EyePass::kept_light`] counts it.
    pub fn start_counting(&self, recorder: &mut Recorder<'_>) {
        let encoder = recorder.encoder();
        encoder.clear_buffer(&self.history_counts, 0, None);
    }

    /// What both eyes kept since [`EyePass::start_counting`]; nothing where none is kept.
    ///
    /// # Errors
    /// [`GpuError::Failed`] when the device is lost.
    pub fn kept_light(&self, gpu: &GpuDevice) -> Result<Option<KeptLight>, GpuError> {
        if self.histories.is_empty() {
            return Ok(None);
        }
        let counts = resources::read_back::<[u32; 4]>(gpu, &self.history_counts, 1)?;
        let [pixels, found, samples, _] = counts.first().copied().unwrap_or_default();
        Ok(Some(KeptLight {
            pixels,
            found,
            samples,
        }))
    }

    fn uniform_values(&self, settings: &EyeSettings) -> Vec<EyeUniform> {
        let samples = settings
            .samples
            .map(|count| count.clamp(1, self.samples_max));
        let mut whole = EyeUniform {
            samples,
            ..settings.uniform((self.width, self.height))
        };
        let history = self.histories.get(settings.eye);
        if let Some(previous) = history.and_then(History::previous) {
            let corner = previous.fov.slope_at(Vec2::ZERO);
            let view_from_scene = previous.scene_from_view.inverse();
            whole.kept_max = settings.kept_max;
            whole.refresh_frames = settings.refresh_frames;
            whole.previous_view_from_scene = layout::affine_rows(view_from_scene);
            whole.previous_slope_left_top = corner.to_array();
            whole.previous_slope_extent = (previous.fov.slope_at(Vec2::ONE) - corner).to_array();
        }
        let most_samples = samples.into_iter().max().unwrap_or(1);
        (0..self.height)
            .step_by(self.band_rows as usize)
            .flat_map(|shown_row| {
                let shown_rows = self.band_rows.min(self.height - shown_row);
                let first_row = shown_row.saturating_sub(self.margin_rows);
                let end_row = (shown_row + shown_rows + self.margin_rows).min(self.height);
                (0..most_samples).map(move |sample| EyeUniform {
                    first_row,
                    row_count: end_row - first_row,
                    resolve_first_row: shown_row,
                    resolve_row_count: shown_rows,
                    sample,
                    ..whole
                })
            })
            .collect()
    }
}

fn resources_of_resolve<'a>(
    pass: &'a EyePass,
    image: &'a EyeImage,
) -> crate::gpu::pass::Resources<'a> {
    crate::gpu::pass::Resources::default()
        .with("eye", pass.uniforms.buffer())
        .with("seen_emission", &pass.seen_emission)
        .with("slot_radiance", &pass.slot_radiance)
        .with_all(image.sums().resources())
}
