//! How much a picture flickers: differences between consecutive frames.

/// The temporal error MSE': the mean, over consecutive pairs of frames, pixels and channels, of squared differences (Shi et al., "Foveated
/// Photon Mapping", 2021, Eq. 9), in the square of the frames' unit. `pixels` are those that count, all where it is `None`. `None` for
/// fewer than two frames or no pixels.
pub fn temporal_mse(frames: &[&[[f32; 3]]], pixels: Option<&[usize]>) -> Option<f64> {
    let pairs = frames.windows(2).map(|pair| {
        let square = |pixel: usize| -> f64 {
            let channels = pair[0][pixel].iter().zip(&pair[1][pixel]);
            channels
                .map(|(before, after)| (f64::from(*after) - f64::from(*before)).powi(2))
                .sum()
        };
        let (sum, count): (f64, usize) = match pixels {
            Some(pixels) => (pixels.iter().copied().map(square).sum(), pixels.len()),
            None => ((0..pair[0].len()).map(square).sum(), pair[0].len()),
        };
        (count > 0).then(|| sum / (3 * count) as f64)
    });
    let errors: Vec<f64> = pairs.collect::<Option<_>>()?;
    (!errors.is_empty()).then(|| errors.iter().sum::<f64>() / errors.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_still_picture_does_not_flicker_and_a_step_counts_once_a_pair() {
        let (dark, bright) = ([[0.0; 3]; 4], [[1.0; 3]; 4]);
        assert_eq!(temporal_mse(&[&dark, &dark, &dark], None), Some(0.0));
        assert_eq!(temporal_mse(&[&dark, &bright, &bright], None), Some(0.5));
    }

    #[test]
    fn only_the_given_pixels_count() {
        let before = [[0.0; 3]; 2];
        let after = [[0.0; 3], [2.0; 3]];
        assert_eq!(temporal_mse(&[&before, &after], Some(&[0])), Some(0.0));
        assert_eq!(temporal_mse(&[&before, &after], Some(&[1])), Some(4.0));
        assert_eq!(temporal_mse(&[&before, &after], Some(&[])), None);
        assert_eq!(temporal_mse(&[&before], None), None);
    }
}
