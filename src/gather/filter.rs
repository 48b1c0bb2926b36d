//! The edge-avoiding filter over the light of visible points: each sample is collected; then some levels of ever wider taps.
//!
//! Source: Dammertz, Sewtz, Hanika and Lensch, "Edge-Avoiding À-Trous Wavelet Transform for Fast Global Illumination Filtering", 2010.

use super::EyeImage;
use crate::gpu::pass::{BoundKernel, Constants, Kernel, Recorder, Resources};
use crate::gpu::resources;
use crate::gpu::shader::stages;
use crate::gpu::{GpuDevice, GpuError};

/// Name of the pass, as the timings give it.
pub const FILTER: &str = "filter";

/// Buffers and kernels of the filter.
pub(super) struct Filter {
    eye: wgpu::Buffer,
    smooth_radiance: wgpu::Buffer,
    /// What the samples of a band are collected in, by their WGSL names.
    sums: [(&'static str, wgpu::Buffer); 10],
    /// The light after the last level.
    filtered: wgpu::Buffer,
    collect: BoundKernel,
    prepare: BoundKernel,
    levels: Vec<BoundKernel>,
    finish: Kernel,
}

impl Filter {
    /// A filter of `levels` levels over `slots` visible points; `eye` names the eye's buffers: uniform, visible points, radiance.
    ///
    /// # Errors
    /// [`GpuError`] when a buffer can't be made.
    pub fn new(
        gpu: &GpuDevice,
        (eye, uniform): (&Resources<'_>, &wgpu::Buffer),
        constants: &Constants,
        size_of_name: &dyn Fn(&str) -> u32,
        slots: u64,
        levels: u32,
    ) -> Result<Self, GpuError> {
        let array = |name| resources::storage::<[f32; 4]>(gpu, name, slots);
        let smooth_radiance = array("smooth_radiance")?;
        let sum = |name| Ok::<_, GpuError>((name, array(name)?));
        let sums = [
            sum("filter_guide")?,
            sum("smooth_sum")?,
            sum("sharp_sum")?,
            sum("albedo_sum")?,
            sum("shown_sum")?,
            sum("beyond_guide")?,
            sum("beyond_smooth_sum")?,
            sum("beyond_sharp_sum")?,
            sum("beyond_albedo_sum")?,
            sum("beyond_shown_sum")?,
        ];
        let lights = [array("filter_light (even)")?, array("filter_light (odd)")?];
        let on_side = |side: usize| {
            eye.clone()
                .with_all(named(&sums))
                .with("smooth_radiance", &smooth_radiance)
                .with("filter_light", &lights[side])
                .with("filtered_light", &lights[1 - side])
        };
        let kernel = |stage| Kernel::new(gpu, stage, constants, size_of_name);
        let collect = kernel(stages::filter_collect)?.bind(gpu, &on_side(0))?;
        let prepare = kernel(stages::filter_prepare)?.bind(gpu, &on_side(0))?;
        let levels: Vec<BoundKernel> = (0..levels)
            .map(|level| {
                let step = [("FILTER_STEP", f64::from(1u32 << level))];
                let constants = [constants, &step].concat();
                let kernel = Kernel::new(gpu, stages::filter_level, &constants, size_of_name)?;
                kernel.bind(gpu, &on_side(level as usize % 2))
            })
            .collect::<Result<_, GpuError>>()?;
        let [even, odd] = lights;
        Ok(Self {
            finish: kernel(stages::filter_finish)?,
            filtered: if levels.len().is_multiple_of(2) {
                even
            } else {
                odd
            },
            eye: uniform.clone(),
            collect,
            prepare,
            levels,
            smooth_radiance,
            sums,
        })
    }

    /// Rows beside those that are shown which the filter of that many levels looks at: one tap at each level's distance.
    pub fn reach_rows(levels: u32) -> u32 {
        (1 << levels) - 1
    }

    /// Where light that is to be filtered is added.
    pub fn smooth_radiance(&self) -> &wgpu::Buffer {
        &self.smooth_radiance
    }

    /// What the samples are collected in, by their WGSL names.
    pub fn collected(&self) -> Resources<'_> {
        named(&self.sums)
    }

    /// Forgets the band before.
    pub fn start_band(&self, recorder: &mut Recorder<'_>) {
        let encoder = recorder.encoder();
        for (_, sum) in &self.sums {
            encoder.clear_buffer(sum, 0, None);
        }
    }

    /// Forgets the light of the sample before.
    pub fn start_sample(&self, recorder: &mut Recorder<'_>) {
        let encoder = recorder.encoder();
        encoder.clear_buffer(&self.smooth_radiance, 0, None);
    }

    /// Records the collecting of a sample of `slots` visible points.
    pub fn collect(&self, recorder: &mut Recorder<'_>, slots: u32) {
        recorder.pass(FILTER, &[(&self.collect, slots)]);
    }

    /// Records the filter over a band whose samples were collected: `slots` visible points of `pixels` pixels. Adds to `image`.
    ///
    /// # Errors
    /// [`GpuError::Unbound`] never in practice.
    pub fn finish_band(
        &self,
        recorder: &mut Recorder<'_>,
        pixels: u32,
        slots: u32,
        image: &EyeImage,
    ) -> Result<(), GpuError> {
        let bound = Resources::default()
            .with("eye", &self.eye)
            .with_all(named(&self.sums))
            .with("filter_light", &self.filtered)
            .with_all(image.sums().resources());
        let finish = self.finish.bind(recorder.gpu(), &bound)?;
        let levels = self.levels.iter().map(|level| (level, slots));
        let dispatches = std::iter::once((&self.prepare, slots));
        let dispatches = dispatches.chain(levels).chain([(&finish, pixels)]);
        recorder.pass(FILTER, &Vec::from_iter(dispatches));
        Ok(())
    }
}

fn named<'a>(sums: &'a [(&'static str, wgpu::Buffer)]) -> Resources<'a> {
    sums.iter()
        .fold(Resources::default(), |all, (name, sum)| all.with(name, sum))
}
