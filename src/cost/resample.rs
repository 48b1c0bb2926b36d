//! Pictures at another size, as a display would show them: bilinear where they grow, the mean of what falls into a pixel where they shrink.

use crate::image::LinearImage;

/// The picture at `width` × `height`; each axis grows or shrinks on its own.
pub fn resample(image: &LinearImage, width: u32, height: u32) -> LinearImage {
    if (image.width, image.height) == (width, height) {
        return image.clone();
    }
    let across = weights(image.width, width);
    let down = weights(image.height, height);
    let source_width = image.width as usize;
    let mut rgb = Vec::with_capacity(width as usize * height as usize);
    for row in &down {
        for column in &across {
            let mut sum = [0.0; 3];
            for &(y, weight_y) in row {
                for &(x, weight_x) in column {
                    let pixel = image.rgb[y * source_width + x];
                    for (sum, value) in sum.iter_mut().zip(pixel) {
                        *sum += weight_x * weight_y * f64::from(value);
                    }
                }
            }
            rgb.push(sum.map(|x| x as f32));
        }
    }
    LinearImage { width, height, rgb }
}

/// For each pixel of an axis of `to` pixels, the pixels of one of `from` that it is made of, with weights that sum to one.
fn weights(from: u32, to: u32) -> Vec<Vec<(usize, f64)>> {
    let scale = f64::from(from) / f64::from(to);
    let last = from as usize - 1;
    let bilinear = |pixel: u32| {
        let center = (f64::from(pixel) + 0.5) * scale - 0.5;
        let below = center.floor().max(0.0) as usize;
        let share = (center - below as f64).clamp(0.0, 1.0);
        vec![(below, 1.0 - share), ((below + 1).min(last), share)]
    };
    let covered = |pixel: u32| {
        let (start, end) = (f64::from(pixel) * scale, f64::from(pixel + 1) * scale);
        let sources = start.floor() as usize..=last.min(end.ceil() as usize - 1);
        sources
            .map(|source| {
                let (left, right) = (source as f64, source as f64 + 1.0);
                let shared = (right.min(end) - left.max(start)).max(0.0);
                (source, shared / scale)
            })
            .collect()
    };
    (0..to)
        .map(|pixel| {
            if to >= from {
                bilinear(pixel)
            } else {
                covered(pixel)
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, values: &[f32]) -> LinearImage {
        LinearImage {
            width,
            height: values.len() as u32 / width,
            rgb: values.iter().map(|value| [*value; 3]).collect(),
        }
    }

    fn reds(image: &LinearImage) -> Vec<f32> {
        image.rgb.iter().map(|rgb| rgb[0]).collect()
    }

    #[test]
    fn a_picture_that_shrinks_keeps_its_mean() {
        let ramp: Vec<f32> = (0..12).map(|value| value as f32).collect();
        let mean = |image: &LinearImage| {
            let reds = reds(image);
            reds.iter().sum::<f32>() / reds.len() as f32
        };
        let large = image(4, &ramp);
        for (width, height) in [(2, 1), (3, 2), (1, 1), (4, 2)] {
            let small = resample(&large, width, height);
            assert!(
                (mean(&small) - mean(&large)).abs() < 1e-5,
                "{width}x{height}"
            );
        }
        assert_eq!(reds(&resample(&image(2, &[0.0, 4.0]), 1, 1)), [2.0]);
    }

    #[test]
    fn a_picture_that_grows_is_linear_between_its_pixels_and_constant_beyond() {
        let wide = resample(&image(2, &[0.0, 4.0]), 4, 1);
        assert_eq!(reds(&wide), [0.0, 1.0, 3.0, 4.0]);
        assert_eq!(reds(&resample(&image(1, &[7.0]), 3, 2)), [7.0; 6]);
    }
}
