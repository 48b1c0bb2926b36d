//! The GPU: device, shaders, buffers, passes, timing. Knows no technique.

pub mod device;
pub mod layout;
pub mod pass;
pub mod resources;
pub mod shader;
pub mod survey;
pub mod timing;

pub use device::{GpuDevice, GpuError, Headless, VulkanMaker};
