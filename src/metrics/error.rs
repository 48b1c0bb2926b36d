//! Errors of linear radiance over a set of pixels, and the peak signal-to-noise ratio of display values.
//!
//! Relative squared error is (c - r)² / (r² + eps²), eps = 1% of the mean of the whole reference, so that regions share one scale. A
//! reference that was itself estimated adds its own variance; where its standard error is known, `*_corrected` subtracts it and
//! [`ReferenceNoise`] says how large it is and what it hides.

use std::iter::Sum;

use serde::Serialize;

use super::noise::{NoiseSums, ReferenceNoise};

/// The share of pixels, those with the largest error, that the trimmed relative error leaves out: 0.1%, the fireflies.
const TRIMMED_SHARE: f64 = 0.001;

/// Two pictures of the same size in linear RGB, row by row, and how sure the reference is.
#[derive(Clone, Copy, Debug)]
pub struct ImagePair<'a> {
    /// Pixels across.
    pub width: usize,
    /// The picture that is judged.
    pub candidate: &'a [[f32; 3]],
    /// What it should be.
    pub reference: &'a [[f32; 3]],
    /// The standard error of each channel of the reference.
    pub reference_standard_error: Option<&'a [[f32; 3]]>,
}

/// Channel values that no picture should hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Faults {
    /// Values that are not a number.
    pub nan: usize,
    /// Values that are infinite, of either sign.
    pub infinite: usize,
    /// Values below zero.
    pub negative: usize,
}

impl Faults {
    /// Counts them in a whole picture.
    pub fn count(rgb: &[[f32; 3]]) -> Self {
        Self::among(rgb.as_flattened())
    }

    /// Counts them in the given pixels.
    pub fn over(rgb: &[[f32; 3]], pixels: &[usize]) -> Self {
        Self::among(pixels.iter().flat_map(|&pixel| &rgb[pixel]))
    }

    fn among<'a>(values: impl IntoIterator<Item = &'a f32>) -> Self {
        let one = |value: &f32| Self {
            nan: usize::from(value.is_nan()),
            infinite: usize::from(value.is_infinite()),
            negative: usize::from(*value < 0.0),
        };
        values.into_iter().map(one).sum()
    }
}

impl Sum for Faults {
    fn sum<I: Iterator<Item = Self>>(many: I) -> Self {
        many.fold(Self::default(), |sum, one| Self {
            nan: sum.nan + one.nan,
            infinite: sum.infinite + one.infinite,
            negative: sum.negative + one.negative,
        })
    }
}

/// Errors over a set of pixels; every mean is over pixels and channels. Units follow the pictures' (W/(m² sr) and its square).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ErrorStats {
    /// Pixels (or blocks) judged.
    pub pixels: usize,
    /// Bias: mean of the picture less mean of the reference, for R, G and B, W/(m² sr).
    pub bias: [f64; 3],
    /// Bias as a ratio: sum of the picture over sum of the reference, for R, G and B; 1 is unbiased, `None` where the reference sums to
    /// zero.
    pub mean_ratio: [Option<f64>; 3],
    /// Mean squared error.
    pub mse: f64,
    /// Mean squared error less the reference's own variance.
    pub mse_corrected: Option<f64>,
    /// Relative mean squared error.
    pub relmse: f64,
    /// Relative mean squared error less what the reference's own variance contributes.
    pub relmse_corrected: Option<f64>,
    /// Relative mean squared error without the worst 0.1% of pixels.
    pub relmse_trimmed: f64,
    /// Median of the absolute relative error |c - r| / sqrt(r² + eps²).
    pub relative_error_p50: f64,
    /// Its 95th percentile.
    pub relative_error_p95: f64,
    /// How noisy the reference itself is here, where its standard error is known.
    #[serde(flatten)]
    pub reference_noise: Option<ReferenceNoise>,
}

impl ErrorStats {
    /// Whether the relative error is too small for the noise of this reference; `false` where that noise is not known.
    pub fn is_below_reference_noise(&self) -> bool {
        let limit = self.reference_noise.map(|noise| noise.detectable_relmse);
        self.relmse_corrected
            .zip(limit)
            .is_some_and(|(error, limit)| error < limit)
    }

    /// The errors over the given pixels, or `None` if there are none. `epsilon` is in units of the pictures and above zero.
    pub fn of(pair: ImagePair, pixels: &[usize], epsilon: f64) -> Option<Self> {
        if pixels.is_empty() {
            return None;
        }
        let mut sums = Sums::default();
        let mut noise = NoiseSums::default();
        let mut relative_errors = Vec::with_capacity(3 * pixels.len());
        let mut relative_squares = Vec::with_capacity(pixels.len());
        for &pixel in pixels {
            let mut relative_square = 0.0;
            let [mut variance, mut relative_variance] = [[0.0; 3]; 2];
            for channel in 0..3 {
                let candidate = f64::from(pair.candidate[pixel][channel]);
                let reference = f64::from(pair.reference[pixel][channel]);
                let square = (candidate - reference).powi(2);
                let scale = reference * reference + epsilon * epsilon;
                sums.candidate[channel] += candidate;
                sums.reference[channel] += reference;
                sums.square += square;
                relative_square += square / scale;
                relative_errors.push((square / scale).sqrt());
                if let Some(standard_error) = pair.reference_standard_error {
                    variance[channel] = f64::from(standard_error[pixel][channel]).powi(2);
                    relative_variance[channel] = variance[channel] / scale;
                }
            }
            noise.add(variance, relative_variance);
            relative_squares.push(relative_square / 3.0);
        }
        relative_errors.sort_unstable_by(f64::total_cmp);
        relative_squares.sort_unstable_by(f64::total_cmp);
        let kept = ((1.0 - TRIMMED_SHARE) * pixels.len() as f64).ceil() as usize;
        let values = (3 * pixels.len()) as f64;
        let (mse, relmse) = (sums.square / values, mean_of(&relative_squares));
        let reference_noise = pair
            .reference_standard_error
            .map(|_| noise.over(pixels.len()));
        Some(Self {
            pixels: pixels.len(),
            bias: std::array::from_fn(|channel| {
                (sums.candidate[channel] - sums.reference[channel]) / pixels.len() as f64
            }),
            mean_ratio: std::array::from_fn(|channel| {
                let (candidate, reference) = (sums.candidate[channel], sums.reference[channel]);
                (reference > 0.0).then(|| candidate / reference)
            }),
            mse,
            mse_corrected: reference_noise.map(|noise| mse - noise.reference_mse),
            relmse,
            relmse_corrected: reference_noise.map(|noise| relmse - noise.reference_relmse),
            relmse_trimmed: mean_of(&relative_squares[..kept.max(1)]),
            relative_error_p50: percentile(&relative_errors, 0.50),
            relative_error_p95: percentile(&relative_errors, 0.95),
            reference_noise,
        })
    }
}

#[derive(Default)]
struct Sums {
    candidate: [f64; 3],
    reference: [f64; 3],
    square: f64,
}

fn mean_of(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The value below which the share `q` of sorted, non-empty `values` lies, interpolated linearly between neighbours.
pub fn percentile(values: &[f64], q: f64) -> f64 {
    let at = q * (values.len() - 1) as f64;
    let (below, above) = (values[at.floor() as usize], values[at.ceil() as usize]);
    below + (above - below) * at.fract()
}

/// Mean over pixels and channels.
pub fn mean(rgb: &[[f32; 3]], pixels: &[usize]) -> f64 {
    let sum: f64 = pixels
        .iter()
        .flat_map(|&pixel| rgb[pixel])
        .map(f64::from)
        .sum();
    sum / (3 * pixels.len()) as f64
}

/// Peak signal-to-noise ratio in dB of two pictures whose full scale is 1, over the given pixels; `None` if there are none or the
/// pictures are equal there (the ratio is infinite).
pub fn psnr_db(candidate: &[[f32; 3]], reference: &[[f32; 3]], pixels: &[usize]) -> Option<f64> {
    let square = |&pixel: &usize| -> f64 {
        (0..3)
            .map(|channel| f64::from(candidate[pixel][channel] - reference[pixel][channel]).powi(2))
            .sum()
    };
    let sum: f64 = pixels.iter().map(square).sum();
    (sum > 0.0).then(|| -10.0 * (sum / (3 * pixels.len()) as f64).log10())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stats(candidate: &[[f32; 3]], reference: &[[f32; 3]], epsilon: f64) -> ErrorStats {
        let pair = ImagePair {
            width: candidate.len(),
            candidate,
            reference,
            reference_standard_error: None,
        };
        ErrorStats::of(pair, &Vec::from_iter(0..candidate.len()), epsilon).unwrap()
    }

    #[test]
    fn squared_errors_and_ratios_match_the_closed_form() {
        // One channel off by 0.5 at r = 1, one by 1 at r = 0, the third right: squares 0.25, 1, 0.
        let result = stats(&[[1.5, 1.0, 2.0]], &[[1.0, 0.0, 2.0]], 0.1);
        assert!((result.mse - 1.25 / 3.0).abs() < 1e-12);
        let relmse = (0.25 / 1.01 + 1.0 / 0.01) / 3.0;
        assert!((result.relmse - relmse).abs() < 1e-9);
        assert_eq!(result.mean_ratio, [Some(1.5), None, Some(1.0)]);
        assert_eq!(result.bias, [0.5, 1.0, 0.0]);
        assert!((result.relative_error_p50 - (0.25_f64 / 1.01).sqrt()).abs() < 1e-9);
        assert_eq!(
            (result.relmse_corrected, result.reference_noise),
            (None, None)
        );
        assert!(!result.is_below_reference_noise());
    }

    #[test]
    fn a_percentile_lies_between_its_neighbours() {
        assert_eq!(percentile(&[0.0, 1.0, 2.0, 3.0, 4.0], 0.5), 2.0);
        assert!((percentile(&[0.0, 10.0], 0.95) - 9.5).abs() < 1e-12);
        assert_eq!(percentile(&[7.0], 0.95), 7.0);
    }

    #[test]
    fn trimming_forgives_a_firefly_and_nothing_else() {
        let reference = vec![[1.0; 3]; 2000];
        let mut candidate = vec![[1.1; 3]; 2000];
        let calm = stats(&candidate, &reference, 0.01);
        assert!((calm.relmse_trimmed - calm.relmse).abs() < 1e-12);
        candidate[5] = [1000.0; 3];
        let lit = stats(&candidate, &reference, 0.01);
        assert!(lit.relmse > 400.0);
        assert!((lit.relmse_trimmed - calm.relmse_trimmed).abs() < 1e-12);
    }

    #[test]
    fn the_reference_noise_is_taken_off_exactly() {
        // The candidate is right; the reference errs by its standard error everywhere, so nothing remains.
        let (truth, standard_error) = (vec![[2.0; 3]; 4], vec![[0.5; 3]; 4]);
        let reference = [[2.5; 3], [2.5; 3], [1.5; 3], [1.5; 3]];
        let pair = ImagePair {
            width: 2,
            candidate: &truth,
            reference: &reference,
            reference_standard_error: Some(&standard_error),
        };
        let result = ErrorStats::of(pair, &[0, 1, 2, 3], 0.02).unwrap();
        assert!(result.mse_corrected.unwrap().abs() < 1e-12);
        assert!(result.relmse_corrected.unwrap().abs() < 1e-12);
        assert!(result.relmse > 0.03);
        let noise = result.reference_noise.unwrap();
        assert_eq!(noise.reference_mse, 0.25);
        // The mean of four pixels of standard error 0.5; per pixel 2 v² with v the sum of 0.25 over three channels.
        assert_eq!(noise.bias_standard_error, [0.25; 3]);
        let deviation = (2.0 * 4.0 * 0.75_f64.powi(2)).sqrt() / 12.0;
        assert!((noise.detectable_mse - 2.0 * deviation).abs() < 1e-12);
        assert!(result.is_below_reference_noise());
        let wrong = ImagePair {
            candidate: &[[4.0; 3]; 4],
            ..pair
        };
        let wrong = ErrorStats::of(wrong, &[0, 1, 2, 3], 0.02).unwrap();
        assert!(!wrong.is_below_reference_noise());
    }

    #[test]
    fn psnr_of_a_tenth_of_full_scale_is_twenty_decibels() {
        let (candidate, reference) = ([[0.6; 3]; 4], [[0.5; 3]; 4]);
        let psnr = psnr_db(&candidate, &reference, &[0, 1, 2, 3]).unwrap();
        assert!((psnr - 20.0).abs() < 1e-4, "{psnr}");
        assert_eq!(psnr_db(&reference, &reference, &[0, 1, 2, 3]), None);
    }
}
