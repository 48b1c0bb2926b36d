//! Errors of the means of 8x8 pixels: noise drops about 8 times, so bias and blur show that the errors per pixel hide.

use super::error::{ErrorStats, ImagePair};

/// The side of a block, pixels.
pub(super) const BLOCK_SIDE: usize = 8;

/// Errors of the means of 8x8 pixels. Pixels of the picture that are not finite are left out of both means, blocks that lose more than
/// half of their pixels are left out, and so are the cut blocks at the right and the bottom. `None` if no block remains.
pub fn block_stats(pair: ImagePair, epsilon: f64) -> Option<ErrorStats> {
    let (columns, rows) = (
        pair.width / BLOCK_SIDE,
        pair.candidate.len() / pair.width / BLOCK_SIDE,
    );
    let mut blocks: [Vec<[f32; 3]>; 3] = Default::default();
    for block in 0..columns * rows {
        let corner = [block % columns * BLOCK_SIDE, block / columns * BLOCK_SIDE];
        if let Some(pixels) = block_pixels(pair, corner) {
            blocks[0].push(mean_rgb(pair.candidate, &pixels));
            blocks[1].push(mean_rgb(pair.reference, &pixels));
            if let Some(standard_error) = pair.reference_standard_error {
                blocks[2].push(standard_error_of_mean(standard_error, &pixels));
            }
        }
    }
    let [candidate, reference, standard_error] = &blocks;
    let pair = ImagePair {
        width: columns,
        candidate,
        reference,
        reference_standard_error: pair
            .reference_standard_error
            .map(|_| standard_error.as_slice()),
    };
    ErrorStats::of(pair, &Vec::from_iter(0..candidate.len()), epsilon)
}

/// The pixels of the block with this top left corner (across, down) that are finite in the picture; `None` where the block is not whole in
/// the picture or loses more than half of them.
pub(super) fn block_pixels(pair: ImagePair, [x, y]: [usize; 2]) -> Option<Vec<usize>> {
    let height = pair.candidate.len() / pair.width;
    if x + BLOCK_SIDE > pair.width || y + BLOCK_SIDE > height {
        return None;
    }
    let pixels: Vec<usize> = (0..BLOCK_SIDE * BLOCK_SIDE)
        .map(|i| (y + i / BLOCK_SIDE) * pair.width + x + i % BLOCK_SIDE)
        .filter(|&pixel| pair.candidate[pixel].iter().all(|x| x.is_finite()))
        .collect();
    (2 * pixels.len() >= BLOCK_SIDE * BLOCK_SIDE).then_some(pixels)
}

/// Of pixels whose errors are independent.
pub(super) fn standard_error_of_mean(standard_error: &[[f32; 3]], pixels: &[usize]) -> [f32; 3] {
    std::array::from_fn(|channel| {
        let variance = |&pixel: &usize| f64::from(standard_error[pixel][channel]).powi(2);
        let sum: f64 = pixels.iter().map(variance).sum();
        (sum.sqrt() / pixels.len() as f64) as f32
    })
}

pub(super) fn mean_rgb(rgb: &[[f32; 3]], pixels: &[usize]) -> [f32; 3] {
    std::array::from_fn(|channel| {
        let sum: f64 = pixels
            .iter()
            .map(|&pixel| f64::from(rgb[pixel][channel]))
            .sum();
        (sum / pixels.len() as f64) as f32
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_average_noise_away_but_not_bias() {
        let reference = vec![[1.0; 3]; 256];
        let checkered = |bias: f32| -> Vec<[f32; 3]> {
            let noise = |i: usize| {
                if (i + i / 16).is_multiple_of(2) {
                    0.5
                } else {
                    -0.5
                }
            };
            (0..256).map(|i| [1.0 + bias + noise(i); 3]).collect()
        };
        let blocks = |candidate: &[[f32; 3]]| {
            let pair = ImagePair {
                width: 16,
                candidate,
                reference: &reference,
                reference_standard_error: None,
            };
            block_stats(pair, 0.01).unwrap()
        };
        let noisy = blocks(&checkered(0.0));
        assert_eq!(noisy.pixels, 4);
        assert!(noisy.mse < 1e-12);
        assert!((blocks(&checkered(0.25)).mse - 0.0625).abs() < 1e-6);
    }

    #[test]
    fn a_block_of_a_noisy_reference_is_eight_times_as_sure_as_a_pixel() {
        let (reference, standard_error) = (vec![[1.0; 3]; 256], vec![[0.5; 3]; 256]);
        let pair = ImagePair {
            width: 16,
            candidate: &reference,
            reference: &reference,
            reference_standard_error: Some(&standard_error),
        };
        let noise = |stats: ErrorStats| stats.reference_noise.unwrap();
        let pixels = noise(ErrorStats::of(pair, &Vec::from_iter(0..256), 0.01).unwrap());
        let blocks = noise(block_stats(pair, 0.01).unwrap());
        assert!((blocks.reference_mse / pixels.reference_mse - 1.0 / 64.0).abs() < 1e-9);
        let [of_blocks, of_pixels] = [blocks, pixels].map(|noise| noise.bias_standard_error[0]);
        assert!((of_blocks / of_pixels - 1.0).abs() < 1e-6);
    }
}
