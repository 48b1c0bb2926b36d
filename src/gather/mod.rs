//! From an eye's pixels to radiance: visible points through specular chains, direct light, light from the photon map, the filter.

pub mod eye_image;
pub mod eye_pass;
pub mod filter;
mod focus;
pub mod history;
pub mod host_samples;
pub mod light_pass;
pub mod records;

pub use eye_image::EyeImage;
pub use eye_pass::{EyePass, EyeSettings, EyeStart, KeptLight};
pub use host_samples::HostSamples;
pub use light_pass::LightPass;
pub use records::IrradianceRecords;
