//! How noisy a reference is: what its own standard error lets a perfect picture show as error, and what that hides.

use serde::Serialize;

/// What the reference's own noise amounts to over a set of pixels, from its standard error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ReferenceNoise {
    /// The mean squared error that a perfect picture would show.
    pub reference_mse: f64,
    /// The relative mean squared error that a perfect picture would show.
    pub reference_relmse: f64,
    /// The mean squared error, less the reference's own, from which on it can be told from none; see `detectable_relmse`.
    pub detectable_mse: f64,
    /// The relative mean squared error, less the reference's own, from which on it can be told from none: two standard deviations of what
    /// a perfect picture would show, for Gaussian noise that is one in the three channels of a pixel and independent between pixels.
    /// Errors of the standard error itself are not in it.
    pub detectable_relmse: f64,
    /// The standard error of `bias`, for R, G and B, W/(m² sr).
    pub bias_standard_error: [f64; 3],
}

/// Sums of the reference's variances.
#[derive(Default)]
pub(super) struct NoiseSums {
    channel_variance: [f64; 3],
    /// Over pixels and channels; plain, then relative.
    variance: [f64; 2],
    /// Of the squares of each pixel's sum over its channels; plain, then relative.
    variance_square: [f64; 2],
}

impl NoiseSums {
    /// Takes in the variances of a pixel's channels, plain and relative.
    pub(super) fn add(&mut self, variance: [f64; 3], relative_variance: [f64; 3]) {
        for (sum, variance) in self.channel_variance.iter_mut().zip(variance) {
            *sum += variance;
        }
        for (i, variance) in [variance, relative_variance].into_iter().enumerate() {
            let over_channels: f64 = variance.iter().sum();
            self.variance[i] += over_channels;
            self.variance_square[i] += over_channels * over_channels;
        }
    }

    /// What they amount to over so many pixels.
    pub(super) fn over(&self, pixels: usize) -> ReferenceNoise {
        const STANDARD_DEVIATIONS: f64 = 2.0;
        let values = (3 * pixels) as f64;
        let [reference_mse, reference_relmse] = self.variance.map(|sum| sum / values);
        // A squared Gaussian of variance v has the variance 2 v².
        let [detectable_mse, detectable_relmse] = self
            .variance_square
            .map(|sum| STANDARD_DEVIATIONS * (2.0 * sum).sqrt() / values);
        ReferenceNoise {
            reference_mse,
            reference_relmse,
            detectable_mse,
            detectable_relmse,
            bias_standard_error: self.channel_variance.map(|sum| sum.sqrt() / pixels as f64),
        }
    }
}
