//! One eye's picture on the device: radiance sums and their counts, one vector a pixel.

use crate::gpu::resources::SplitArray;
use crate::gpu::{GpuDevice, GpuError};
use crate::image::LinearImage;

/// Radiance sums of an image.
pub struct EyeImage {
    sums: SplitArray,
    width: u32,
    height: u32,
}

impl EyeImage {
    /// A black image.
    ///
    /// # Errors
    /// [`GpuError::BufferTooLarge`] for a size that the device can't bind.
    pub fn new(gpu: &GpuDevice, width: u32, height: u32) -> Result<Self, GpuError> {
        let sums = SplitArray::new::<[f32; 4]>(gpu, "image", u64::from(width) * u64::from(height))?;
        Ok(Self {
            sums,
            width,
            height,
        })
    }

    /// Pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Four floats a pixel: sums of linear RGB radiance, W/(m² sr), and how many samples they hold.
    pub fn sums(&self) -> &SplitArray {
        &self.sums
    }

    /// Empties the image.
    pub fn clear(&self, encoder: &mut wgpu::CommandEncoder) {
        self.sums.clear(encoder);
    }

    /// Reads the mean radiance of every pixel.
    ///
    /// # Errors
    /// [`GpuError::Failed`] when the device is lost.
    pub fn read(&self, gpu: &GpuDevice) -> Result<LinearImage, GpuError> {
        let count = u64::from(self.width) * u64::from(self.height);
        let sums: Vec<[f32; 4]> = self.sums.read(gpu, count)?;
        let rgb = sums
            .iter()
            .map(|[r, g, b, count]| [r, g, b].map(|sum| sum / count.max(1.0)))
            .collect();
        Ok(LinearImage {
            width: self.width,
            height: self.height,
            rgb,
        })
    }
}
