//! What each pixel keeps of its light from frame to frame, for one eye.
//!
//! Source: Shi et al., "Foveated Photon Mapping", 2021, Algorithm 2 (temporal photon management); see shaders/history.wgsl.

use super::EyeSettings;
use crate::gpu::pass::{BoundKernel, Constants, Kernel, Resources};
use crate::gpu::resources::SplitArray;
use crate::gpu::shader::stages;
use crate::gpu::{GpuDevice, GpuError};

/// Name of the pass, as the timings give it.
pub const HISTORY: &str = "light kept";

/// Sums over samples, a vector a pixel each; see shaders/history.wgsl.
struct Kept([SplitArray; 4]);

impl Kept {
    fn new(gpu: &GpuDevice, pixels: u64) -> Result<Self, GpuError> {
        let array = |name| SplitArray::new::<[f32; 4]>(gpu, name, pixels);
        Ok(Self([
            array("smooth")?,
            array("sharp")?,
            array("albedo")?,
            array("guide")?,
        ]))
    }

    /// By their WGSL names, which begin with `prefix`.
    fn resources(&self, prefix: &str) -> Resources<'_> {
        self.0.iter().fold(Resources::default(), |all, array| {
            all.with_all(array.resources_as(&format!("{prefix}_{}", array.name())))
        })
    }
}

/// Buffers and kernels of one eye's kept light: the frame before is read from one side and this one written to the other.
pub(super) struct History {
    /// For either side that is read: finding and joining.
    kernels: [(BoundKernel, BoundKernel); 2],
    /// The side that is read.
    side: usize,
    previous: Option<EyeSettings>,
}

impl History {
    /// For images of `pixels` pixels; `collected` names what the samples of a frame are collected in.
    ///
    /// # Errors
    /// [`GpuError`] when a buffer can't be made.
    pub fn new(
        gpu: &GpuDevice,
        collected: &Resources<'_>,
        constants: &Constants,
        pixels: u64,
    ) -> Result<Self, GpuError> {
        let sides = [Kept::new(gpu, pixels)?, Kept::new(gpu, pixels)?];
        let chunks = SplitArray::chunk_count::<[f32; 4]>(pixels);
        let kernel = |stage| Kernel::new(gpu, stage, constants, &|_| chunks);
        let (find, join) = (kernel(stages::history_find)?, kernel(stages::history_join)?);
        let on_side = |side: usize| {
            let bound = collected
                .clone()
                .with_all(sides[side].resources("previous"))
                .with_all(sides[1 - side].resources("next"));
            Ok::<_, GpuError>((find.bind(gpu, &bound)?, join.bind(gpu, &bound)?))
        };
        Ok(Self {
            kernels: [on_side(0)?, on_side(1)?],
            side: 0,
            previous: None,
        })
    }

    /// What a frame before was seen with, if there was one.
    pub fn previous(&self) -> Option<&EyeSettings> {
        self.previous.as_ref()
    }

    /// The kernel that looks for kept light, and the one that joins it with the frame's.
    pub fn kernels(&self) -> (&BoundKernel, &BoundKernel) {
        let (find, join) = &self.kernels[self.side];
        (find, join)
    }

    /// What was kept becomes what is read.
    pub fn turn(&mut self, seen_with: &EyeSettings) {
        self.side = 1 - self.side;
        self.previous = Some(*seen_with);
    }
}
