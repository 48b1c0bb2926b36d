//! Temporal error: how much a sequence changes from frame to frame, and how much of that change is wrong.
//!
//! MSE' is Eq. 9 of Shi et al., "Foveated Photon Mapping" (2021): the mean, over consecutive frame pairs, of the mean squared difference
//! between a frame and the one before it. It holds true change (motion, moving light) and flicker alike; the same figure of the errors
//! against a reference sequence holds flicker alone.

/// MSE' of frames of one size: the mean over consecutive pairs, pixels and channels of the squared difference, in the square of the
/// frames' unit. Over all pixels, or over `pixels` only (indices below the size of a frame). A pixel that is not finite in either frame of
/// a pair is left out of that pair. `None` for fewer than two frames, or where no pair has a pixel that counts.
pub fn temporal_mse(frames: &[&[[f32; 3]]], pixels: Option<&[usize]>) -> Option<f64> {
    let pairs = frames.windows(2).filter_map(|pair| match pixels {
        Some(pixels) => pair_mse(pair[0], pair[1], pixels.iter().copied()),
        None => pair_mse(pair[0], pair[1], 0..pair[1].len()),
    });
    mean(pairs)
}

/// The mean squared difference of one pair of pictures of one size, over pixels and channels, as [`temporal_mse`] takes it; `None` where no
/// pixel counts.
pub fn pair_mse(
    before: &[[f32; 3]],
    after: &[[f32; 3]],
    pixels: impl IntoIterator<Item = usize>,
) -> Option<f64> {
    let squares = pixels.into_iter().filter_map(|pixel| {
        let difference =
            |channel: usize| f64::from(after[pixel][channel]) - f64::from(before[pixel][channel]);
        let square: f64 = (0..3).map(|channel| difference(channel).powi(2)).sum();
        square.is_finite().then_some(square / 3.0)
    });
    mean(squares)
}

/// The mean, or `None` of nothing.
pub(super) fn mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values
        .into_iter()
        .fold((0.0, 0_usize), |(sum, count), value| {
            (sum + value, count + 1)
        });
    (count > 0).then(|| sum / count as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(value: f32) -> Vec<[f32; 3]> {
        vec![[value; 3]; 4]
    }

    #[test]
    fn a_still_sequence_has_no_temporal_error_and_a_flickering_one_has_its_square() {
        let (low, high) = (flat(1.0), flat(1.5));
        assert_eq!(temporal_mse(&[&low, &low, &low], None), Some(0.0));
        assert_eq!(temporal_mse(&[&low, &high, &low], None), Some(0.25));
    }

    #[test]
    fn the_mean_is_over_pairs_pixels_and_channels() {
        let dark = flat(0.0);
        let mut spot = dark.clone();
        spot[2][1] = 3.0;
        // One channel of twelve changes by 3, in one pair of two.
        assert_eq!(temporal_mse(&[&dark, &spot, &spot], None), Some(9.0 / 24.0));
        assert_eq!(
            temporal_mse(&[&dark, &spot], Some(&[0, 2])),
            Some(9.0 / 6.0)
        );
        assert_eq!(temporal_mse(&[&dark, &spot], Some(&[0, 1])), Some(0.0));
    }

    #[test]
    fn one_frame_or_no_pixel_has_no_temporal_error() {
        let frame = flat(1.0);
        assert_eq!(temporal_mse(&[], None), None);
        assert_eq!(temporal_mse(&[&frame], None), None);
        assert_eq!(temporal_mse(&[&frame, &frame], Some(&[])), None);
    }

    #[test]
    fn a_pixel_that_is_not_finite_is_left_out_of_its_pairs_only() {
        let (before, mut after) = (flat(1.0), flat(2.0));
        after[1][0] = f32::NAN;
        after[3][2] = f32::INFINITY;
        assert_eq!(temporal_mse(&[&before, &after], None), Some(1.0));
        assert_eq!(temporal_mse(&[&before, &after], Some(&[1, 3])), None);
    }
}
