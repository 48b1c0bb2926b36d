//! From an eye's pixels to radiance: visible points through specular chains, direct light, light from the photon map.

pub mod eye_image;
pub mod eye_pass;
pub mod host_samples;

pub use eye_image::EyeImage;
pub use eye_pass::{EyeLight, EyePass, EyeSettings};
pub use host_samples::HostSamples;
