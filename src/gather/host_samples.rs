//! Samples computed on the host, added to an eye's image.

use super::EyeImage;
use crate::gpu::pass::{Kernel, Recorder};
use crate::gpu::resources::SplitArray;
use crate::gpu::shader::stages;
use crate::gpu::{GpuDevice, GpuError};

/// The way of an image's samples from the host to the device.
pub struct HostSamples {
    samples: SplitArray,
    kernel: Kernel,
}

impl HostSamples {
    /// For images of `size`.
    ///
    /// # Errors
    /// [`GpuError`] when the device can't hold an image of samples.
    pub fn new(gpu: &GpuDevice, size: (u32, u32)) -> Result<Self, GpuError> {
        let count = u64::from(size.0) * u64::from(size.1);
        let samples = SplitArray::new::<[f32; 4]>(gpu, "samples", count)?;
        let constants = [("COUNT", count as f64)];
        let kernel = Kernel::new(gpu, stages::add_samples, &constants, &|_| samples.chunks())?;
        Ok(Self { samples, kernel })
    }

    /// Adds for each pixel the sum of its radiances, W/(m² sr), and their count.
    ///
    /// # Errors
    /// [`GpuError`] when the kernel can't be bound.
    pub fn record(
        &self,
        recorder: &mut Recorder<'_>,
        pass: &'static str,
        sums: &[[f32; 4]],
        image: &EyeImage,
    ) -> Result<(), GpuError> {
        let gpu = recorder.gpu();
        let resources = self.samples.resources().with_all(image.sums().resources());
        let bound = self.kernel.bind(gpu, &resources)?;
        self.samples.write(gpu, sums);
        recorder.pass(pass, &[(&bound, sums.len() as u32)]);
        // The next image's samples are written into the same buffers.
        recorder.submit();
        Ok(())
    }
}
