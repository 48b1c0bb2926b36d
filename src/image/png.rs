//! Pictures for looking at: 8-bit sRGB PNG from linear radiance.
//!
//! The tone curve is the identity up to [`SHOULDER`] of full scale and bends smoothly towards white above it. It is applied to the
//! largest channel, and the other two are scaled by the same factor: hue and saturation stay as they were, and everything below the
//! shoulder is shown exactly. Measure on the EXR, never on this.

use std::path::{Path, PathBuf};

use super::LinearImage;

/// Where the tone curve leaves the identity, in units of full scale.
pub const SHOULDER: f32 = 0.8;
/// What a pixel with a NaN is shown as, so that it cannot be mistaken for darkness.
const NAN_COLOR: [f32; 3] = [1.0, 0.0, 1.0];

/// Why a picture could not be written.
#[derive(Debug, thiserror::Error)]
pub enum PngError {
    /// The picture to write has no pixels, or not as many as its size says.
    #[error(
        "cannot write {}: {samples} samples do not make a picture of {width}x{height}",
        path.display()
    )]
    WrongSampleCount {
        /// The file.
        path: PathBuf,
        /// Pixels across.
        width: u32,
        /// Pixels down.
        height: u32,
        /// Samples given.
        samples: usize,
    },
    /// The file could not be written.
    #[error("cannot write {}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the encoder said.
        source: image::ImageError,
    },
}

/// Linear radiance to linear display RGB in \[0, 1\]: exposure by 2^`exposure_ev`, negatives to black, then the curve of this
/// module, `s + (1 - s)(1 - exp(-(x - s)/(1 - s)))` above the shoulder s (continuous in value and slope).
pub fn tone_map(rgb: [f32; 3], exposure_ev: f32) -> [f32; 3] {
    if rgb.iter().any(|x| x.is_nan()) {
        return NAN_COLOR;
    }
    // Infinity times zero is NaN: bound what enters, far above anything that is not white.
    let exposed = rgb.map(|x| (x.max(0.0) * exposure_ev.exp2()).min(f32::MAX));
    let largest = exposed[0].max(exposed[1]).max(exposed[2]);
    if largest <= SHOULDER {
        return exposed;
    }
    let room = 1.0 - SHOULDER;
    let shown = SHOULDER + room * (1.0 - (-(largest - SHOULDER) / room).exp());
    exposed.map(|x| x / largest * shown)
}

/// The sRGB transfer function (IEC 61966-2-1): linear \[0, 1\] to encoded \[0, 1\].
pub fn srgb_encode(linear: f32) -> f32 {
    let linear = linear.clamp(0.0, 1.0);
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// A picture as it is shown: tone-mapped, sRGB-encoded, 8 bits a channel, row by row, R G B.
pub fn to_rgb8(image: &LinearImage, exposure_ev: f32) -> Vec<u8> {
    image
        .rgb
        .iter()
        .flat_map(|&rgb| tone_map(rgb, exposure_ev))
        .map(|x| (srgb_encode(x) * 255.0).round() as u8)
        .collect()
}

/// Writes a linear picture as 8-bit sRGB, tone-mapped at `exposure_ev` (0: radiance 1 W/(m² sr) is full scale before the curve).
///
/// # Errors
/// A picture whose pixels do not fit its size, or a file that cannot be written.
pub fn write(path: &Path, image: &LinearImage, exposure_ev: f32) -> Result<(), PngError> {
    let rgb8 = to_rgb8(image, exposure_ev);
    write_samples(
        path,
        &rgb8,
        image.width,
        image.height,
        image::ColorType::Rgb8,
    )
}

/// Writes 8-bit sRGB samples (R G B A, row by row) as they are.
///
/// # Errors
/// Samples that do not fit the size, or a file that cannot be written.
pub fn write_rgba8(path: &Path, width: u32, height: u32, rgba: &[u8]) -> Result<(), PngError> {
    write_samples(path, rgba, width, height, image::ColorType::Rgba8)
}

fn write_samples(
    path: &Path,
    samples: &[u8],
    width: u32,
    height: u32,
    color: image::ColorType,
) -> Result<(), PngError> {
    let expected = width as usize * height as usize * usize::from(color.channel_count());
    if expected == 0 || samples.len() != expected {
        return Err(PngError::WrongSampleCount {
            path: path.into(),
            width,
            height,
            samples: samples.len(),
        });
    }
    image::save_buffer_with_format(path, samples, width, height, color, image::ImageFormat::Png)
        .map_err(|source| PngError::Write {
            path: path.into(),
            source,
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radiance_below_the_shoulder_is_shown_exactly() {
        assert_eq!(tone_map([0.1, 0.5, 0.8], 0.0), [0.1, 0.5, 0.8]);
        assert_eq!(tone_map([0.1, 0.2, 0.3], 1.0), [0.2, 0.4, 0.6]);
        assert_ne!(tone_map([0.1, 0.5, 0.9], 0.0), [0.1, 0.5, 0.9]);
    }

    #[test]
    fn the_curve_rises_without_a_step_and_stays_within_full_scale() {
        let mut last = 0.0;
        for step in 0..4000 {
            let [grey, ..] = tone_map([step as f32 * 1e-3; 3], 0.0);
            assert!(grey >= last && grey <= 1.0, "{step}: {last} then {grey}");
            assert!(grey - last <= 1.01e-3, "a step at {step}");
            last = grey;
        }
        assert!(last > 0.999);
    }

    #[test]
    fn the_ratios_of_the_channels_do_not_change() {
        let [r, g, b] = tone_map([8.0, 4.0, 2.0], 3.0);
        assert!((r / g - 2.0).abs() < 1e-6 && (g / b - 2.0).abs() < 1e-6);
    }

    #[test]
    fn hostile_values_are_shown_not_propagated() {
        assert_eq!(tone_map([-1.0, 0.5, 0.0], 0.0), [0.0, 0.5, 0.0]);
        assert_eq!(tone_map([f32::NAN, 0.5, 0.0], 0.0), NAN_COLOR);
        let [r, g, b] = tone_map([f32::INFINITY, 1.0, 0.0], 20.0);
        assert!(r == 1.0 && (0.0..=1.0).contains(&g) && b == 0.0);
    }

    #[test]
    fn srgb_matches_the_standard_at_known_points() {
        for (linear, code) in [
            (0.0, 0),
            (0.002, 7),
            (0.215_861, 128),
            (0.5, 188),
            (1.0, 255),
        ] {
            assert_eq!(
                (srgb_encode(linear) * 255.0).round() as u8,
                code,
                "{linear}"
            );
        }
    }

    #[test]
    fn a_png_comes_back_as_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.png");
        let image = LinearImage {
            width: 2,
            height: 1,
            rgb: vec![[0.5, 0.0, 0.0], [0.0, 4.0, 0.0]],
        };
        write(&path, &image, 0.0).unwrap();
        let read = image::open(&path).unwrap().to_rgb8();
        assert_eq!(read.as_raw(), &[188, 0, 0, 0, 255, 0]);
        write_rgba8(&path, 1, 1, &[1, 2, 3, 4]).unwrap();
        assert_eq!(
            image::open(&path).unwrap().to_rgba8().as_raw(),
            &[1, 2, 3, 4]
        );
        let error = write_rgba8(&path, 2, 1, &[1, 2, 3, 4]).unwrap_err();
        assert!(error.to_string().contains("picture.png"), "{error}");
    }
}
