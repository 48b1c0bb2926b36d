//! Temporal error: how much a sequence changes from frame to frame, and how much of that change is wrong.
//!
//! MSE' is Eq. 9 of Shi et al., "Foveated Photon Mapping" (2021): the mean, over consecutive frame pairs, of the mean squared difference
//! between a frame and the one before it. It holds true change (motion, moving light) and flicker alike; the same figure of the errors
//! against a reference sequence holds flicker alone ([`TemporalError`]).

use serde::Serialize;

use super::error::ImagePair;

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
    mean_square(pixels, |pixel, channel| {
        f64::from(after[pixel][channel]) - f64::from(before[pixel][channel])
    })
}

/// What changes between two frames of a sequence and of its reference, and how much of it is error. In the square of the frames' unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TemporalError {
    /// MSE' of the sequence that is judged.
    pub temporal_mse: f64,
    /// MSE' of the reference: what truly changes, and its noise.
    pub temporal_mse_reference: f64,
    /// MSE' of the error, the difference of the two sequences: flicker. An error that stays as it is counts nothing here.
    pub temporal_mse_error: f64,
    /// What the noise of the reference adds to the two figures above if its frames are independent, where its standard error is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub temporal_mse_reference_noise: Option<f64>,
}

impl TemporalError {
    /// Between two frames of one size, over those of `pixels` that are finite in both; `None` if there are none.
    pub fn of(before: ImagePair, after: ImagePair, pixels: &[usize]) -> Option<Self> {
        let is_finite = |rgb: &[[f32; 3]], pixel: usize| rgb[pixel].iter().all(|x| x.is_finite());
        let pixels: Vec<usize> = pixels
            .iter()
            .copied()
            .filter(|&pixel| {
                is_finite(before.candidate, pixel) && is_finite(after.candidate, pixel)
            })
            .collect();
        let of = |value: &dyn Fn(usize, usize) -> f64| mean_square(pixels.iter().copied(), value);
        let change = |from: &[[f32; 3]], to: &[[f32; 3]], pixel: usize, channel: usize| {
            f64::from(to[pixel][channel]) - f64::from(from[pixel][channel])
        };
        let judged = |pixel, channel| change(before.candidate, after.candidate, pixel, channel);
        let true_change =
            |pixel, channel| change(before.reference, after.reference, pixel, channel);
        let standard_errors = before
            .reference_standard_error
            .zip(after.reference_standard_error);
        Some(Self {
            temporal_mse: of(&judged)?,
            temporal_mse_reference: of(&true_change)?,
            temporal_mse_error: of(&|pixel, channel| {
                judged(pixel, channel) - true_change(pixel, channel)
            })?,
            temporal_mse_reference_noise: standard_errors.and_then(|(before, after)| {
                of(&|pixel, channel| {
                    f64::from(before[pixel][channel]).hypot(f64::from(after[pixel][channel]))
                })
            }),
        })
    }

    /// The mean over frame pairs, as Eq. 9 takes it; that of the noise is known if it is known of all. `None` for none.
    pub fn mean(pairs: &[Self]) -> Option<Self> {
        let each = |figure: fn(&Self) -> f64| mean(pairs.iter().map(figure));
        Some(Self {
            temporal_mse: each(|pair| pair.temporal_mse)?,
            temporal_mse_reference: each(|pair| pair.temporal_mse_reference)?,
            temporal_mse_error: each(|pair| pair.temporal_mse_error)?,
            temporal_mse_reference_noise: mean_of_all(
                pairs.iter().map(|pair| pair.temporal_mse_reference_noise),
            ),
        })
    }
}

/// The mean over pixels and channels of the square of `value(pixel, channel)`, leaving out pixels where it is not finite.
fn mean_square(
    pixels: impl IntoIterator<Item = usize>,
    value: impl Fn(usize, usize) -> f64,
) -> Option<f64> {
    mean(pixels.into_iter().filter_map(|pixel| {
        let square: f64 = (0..3).map(|channel| value(pixel, channel).powi(2)).sum();
        square.is_finite().then_some(square / 3.0)
    }))
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

/// The mean, or `None` if one is not known or there is none.
pub(super) fn mean_of_all(values: impl IntoIterator<Item = Option<f64>>) -> Option<f64> {
    mean(values.into_iter().collect::<Option<Vec<f64>>>()?)
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

    #[test]
    fn flicker_is_told_from_motion_and_from_an_error_that_stays() {
        let frames = [1.0, 2.0, 1.5].map(flat);
        let pair = |candidate, reference| ImagePair {
            width: 2,
            candidate,
            reference,
            reference_standard_error: None,
        };
        let [low, high, middle] = &frames;
        let judge = |before, after| TemporalError::of(before, after, &[0, 1, 2, 3]).unwrap();
        // All change is true, half a unit too bright throughout.
        let brighter_high = flat(2.5);
        let steady = judge(pair(middle, low), pair(&brighter_high, high));
        assert_eq!(
            (steady.temporal_mse, steady.temporal_mse_reference),
            (1.0, 1.0)
        );
        assert_eq!(steady.temporal_mse_error, 0.0);
        // Nothing truly changes, all change is error.
        let flickering = judge(pair(low, low), pair(high, low));
        assert_eq!(flickering.temporal_mse_reference, 0.0);
        assert_eq!(flickering.temporal_mse_error, 1.0);
        assert_eq!(flickering.temporal_mse_reference_noise, None);
        let mean = TemporalError::mean(&[steady, flickering]).unwrap();
        assert_eq!((mean.temporal_mse, mean.temporal_mse_error), (1.0, 0.5));
        assert_eq!(TemporalError::mean(&[]), None);
    }

    #[test]
    fn the_noise_of_both_references_adds_to_the_flicker() {
        let (frame, standard_error) = (flat(1.0), flat(0.5));
        let pair = ImagePair {
            width: 2,
            candidate: &frame,
            reference: &frame,
            reference_standard_error: Some(&standard_error),
        };
        let noise = TemporalError::of(pair, pair, &[0, 3]).unwrap();
        assert!((noise.temporal_mse_reference_noise.unwrap() - 0.5).abs() < 1e-12);
    }
}
