//! Texels of the swapchain formats as linear colours.

use ash::vk;
use glam::Vec4;
use openxr_sys as sys;

use crate::XrResult;
use crate::vulkan::Texels;

/// A picture in linear colours, row by row from the top.
pub(super) struct Picture {
    pub size: [u32; 2],
    pub colors: Vec<Vec4>,
}

impl Picture {
    pub fn decode(texels: &Texels) -> XrResult<Self> {
        let decode: fn(&[u8]) -> Vec4 = match texels.format {
            vk::Format::R8G8B8A8_SRGB => |t| srgb8([t[0], t[1], t[2], t[3]]),
            vk::Format::B8G8R8A8_SRGB => |t| srgb8([t[2], t[1], t[0], t[3]]),
            vk::Format::R8G8B8A8_UNORM => |t| unorm8([t[0], t[1], t[2], t[3]]),
            vk::Format::B8G8R8A8_UNORM => |t| unorm8([t[2], t[1], t[0], t[3]]),
            vk::Format::R16G16B16A16_SFLOAT => |t| {
                Vec4::from_array(
                    [0, 2, 4, 6].map(|at| half(u16::from_le_bytes([t[at], t[at + 1]]))),
                )
            },
            _ => return Err(sys::Result::ERROR_LAYER_INVALID),
        };
        let size = [texels.width, texels.height];
        let bytes_per_texel = texels.bytes.len() / (size[0] as usize * size[1] as usize);
        Ok(Self {
            size,
            colors: texels
                .bytes
                .chunks_exact(bytes_per_texel)
                .map(decode)
                .collect(),
        })
    }

    pub fn at(&self, x: u32, y: u32) -> Vec4 {
        self.colors[y as usize * self.size[0] as usize + x as usize]
    }
}

fn unorm8(texel: [u8; 4]) -> Vec4 {
    Vec4::from_array(texel.map(|byte| f32::from(byte) / 255.0))
}

fn srgb8(texel: [u8; 4]) -> Vec4 {
    let [x, y, z, w] = unorm8(texel).to_array();
    Vec4::new(from_srgb(x), from_srgb(y), from_srgb(z), w)
}

/// The sRGB curve (IEC 61966-2-1), 0 to 1, to linear.
fn from_srgb(encoded: f32) -> f32 {
    if encoded <= 0.04045 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

/// A linear value as a byte on the sRGB curve.
pub(super) fn to_srgb8(linear: f32) -> u8 {
    let linear = linear.clamp(0.0, 1.0);
    let encoded = if linear <= 0.0031308 {
        linear * 12.92
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    };
    (encoded * 255.0).round() as u8
}

/// A 16-bit float (IEEE 754 binary16).
fn half(bits: u16) -> f32 {
    let sign = if bits & 0x8000 == 0 { 1.0 } else { -1.0 };
    let exponent = i32::from(bits >> 10 & 0x1f);
    let fraction = f32::from(bits & 0x3ff) / 1024.0;
    sign * match exponent {
        0 => fraction * 2f32.powi(-14),
        0x1f if fraction == 0.0 => f32::INFINITY,
        0x1f => f32::NAN,
        _ => (1.0 + fraction) * 2f32.powi(exponent - 15),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_srgb_byte_survives_decoding_and_encoding() {
        for byte in 0..=255 {
            assert_eq!(to_srgb8(from_srgb(f32::from(byte) / 255.0)), byte);
        }
    }

    #[test]
    fn half_floats_have_their_values() {
        for (bits, value) in [
            (0x0000, 0.0),
            (0x3c00, 1.0),
            (0xc000, -2.0),
            (0x3555, 0.333_251_95),
            (0x7bff, 65504.0),
            (0x0001, 5.960_464_5e-8),
            (0x7c00, f32::INFINITY),
        ] {
            assert_eq!(half(bits), value, "{bits:#06x}");
        }
        assert!(half(0x7e00).is_nan());
    }
}
