//! The edge-avoiding filter over the light of visible points: prepare, some levels of ever wider taps, finish.
//!
//! Source: Dammertz, Sewtz, Hanika and Lensch, "Edge-Avoiding À-Trous Wavelet Transform for Fast Global Illumination Filtering", 2010.

use crate::gpu::pass::{BoundKernel, Constants, Kernel, Recorder, Resources};
use crate::gpu::resources;
use crate::gpu::shader::stages;
use crate::gpu::{GpuDevice, GpuError};

/// Name of the pass, as the timings give it.
pub const FILTER: &str = "filter";

/// Buffers and kernels of the filter.
pub(super) struct Filter {
    prepare: BoundKernel,
    levels: Vec<BoundKernel>,
    finish: BoundKernel,
    smooth_radiance: wgpu::Buffer,
}

impl Filter {
    /// A filter of `levels` levels over `slots` visible points; `eye` names the eye's buffers: uniform, visible points, radiance.
    ///
    /// # Errors
    /// [`GpuError`] when a buffer can't be made.
    pub fn new(
        gpu: &GpuDevice,
        eye: &Resources<'_>,
        constants: &Constants,
        size_of_name: &dyn Fn(&str) -> u32,
        slots: u64,
        levels: u32,
    ) -> Result<Self, GpuError> {
        let array = |name| resources::storage::<[f32; 4]>(gpu, name, slots);
        let smooth_radiance = array("smooth_radiance")?;
        let guide = array("filter_guide")?;
        let lights = [array("filter_light (even)")?, array("filter_light (odd)")?];
        let on_side = |side: usize| {
            eye.clone()
                .with("smooth_radiance", &smooth_radiance)
                .with("filter_guide", &guide)
                .with("filter_light", &lights[side])
                .with("filtered_light", &lights[1 - side])
        };
        let levels: Vec<BoundKernel> = (0..levels)
            .map(|level| {
                let step = [("FILTER_STEP", f64::from(1u32 << level))];
                let constants = [constants, &step].concat();
                let kernel = Kernel::new(gpu, stages::filter_level, &constants, size_of_name)?;
                kernel.bind(gpu, &on_side(level as usize % 2))
            })
            .collect::<Result<_, GpuError>>()?;
        let kernel = |stage| Kernel::new(gpu, stage, constants, size_of_name);
        Ok(Self {
            prepare: kernel(stages::filter_prepare)?.bind(gpu, &on_side(0))?,
            finish: kernel(stages::filter_finish)?.bind(gpu, &on_side(levels.len() % 2))?,
            levels,
            smooth_radiance,
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

    /// Empties the light of the sample before.
    pub fn clear(&self, recorder: &mut Recorder<'_>) {
        let encoder = recorder.encoder();
        encoder.clear_buffer(&self.smooth_radiance, 0, None);
    }

    /// Records the filter over `threads` visible points.
    pub fn record(&self, recorder: &mut Recorder<'_>, threads: u32) {
        let levels = self.levels.iter();
        let dispatches: Vec<_> = std::iter::once(&self.prepare)
            .chain(levels)
            .chain([&self.finish])
            .map(|kernel| (kernel, threads))
            .collect();
        recorder.pass(FILTER, &dispatches);
    }
}
