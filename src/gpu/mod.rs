//! The GPU: device, shaders, buffers, passes, timing. Knows no technique.

pub mod device;
pub mod survey;

pub use device::{GpuDevice, GpuError, Headless, VulkanMaker};
