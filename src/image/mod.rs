//! What happens to pictures after light transport: how they are kept ([`exr`]) and how they are shown ([`png`]).

pub mod exr;
pub mod png;
pub mod present;
mod scatter;
mod size;

pub use scatter::Scatter;
pub use size::ImageSize;

/// A picture in linear RGB, row by row from the top left; radiance in W/(m² sr) unless its maker says otherwise.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearImage {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// `width * height` pixels: red, green, blue.
    pub rgb: Vec<[f32; 3]>,
}

impl LinearImage {
    /// Whether the number of pixels is what the size says, and there is at least one.
    fn is_whole(&self) -> bool {
        !self.rgb.is_empty() && self.width as usize * self.height as usize == self.rgb.len()
    }
}
