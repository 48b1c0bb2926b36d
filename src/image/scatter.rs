//! The mean of independent estimates of a picture, and how sure it is.

/// Running means and sums of squared deviations (Welford, "Note on a Method for Calculating Corrected Sums of Squares and Products", 1962).
pub struct Scatter {
    samples: u32,
    mean: Vec<[f64; 3]>,
    deviation: Vec<[f64; 3]>,
}

impl Scatter {
    /// Of no estimates yet.
    pub fn new(pixels: usize) -> Self {
        Self {
            samples: 0,
            mean: vec![[0.0; 3]; pixels],
            deviation: vec![[0.0; 3]; pixels],
        }
    }

    /// Takes in one estimate of each pixel.
    pub fn add(&mut self, estimates: &[[f64; 3]]) {
        self.samples += 1;
        let count = f64::from(self.samples);
        let running = self.mean.iter_mut().zip(&mut self.deviation);
        for ((mean, deviation), estimate) in running.zip(estimates) {
            for channel in 0..3 {
                let before = estimate[channel] - mean[channel];
                mean[channel] += before / count;
                deviation[channel] += before * (estimate[channel] - mean[channel]);
            }
        }
    }

    /// The mean of the estimates.
    pub fn mean(&self) -> Vec<[f32; 3]> {
        self.mean.iter().map(|rgb| rgb.map(|x| x as f32)).collect()
    }

    /// How many estimates of each pixel there are.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// The standard error of the mean, the root of s²/n; 0 for a single estimate, which tells nothing.
    pub fn standard_error(&self) -> Vec<[f32; 3]> {
        let count = f64::from(self.samples);
        let error = |square: f64| (square / (count * (count - 1.0).max(1.0))).sqrt() as f32;
        self.deviation.iter().map(|rgb| rgb.map(error)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scatter_of_estimates_gives_the_standard_error_of_their_mean() {
        let mut scatter = Scatter::new(1);
        for value in [1.0, 2.0, 3.0, 6.0] {
            scatter.add(&[[value, 2.0 * value, 5.0]]);
        }
        assert_eq!(scatter.mean(), [[3.0, 6.0, 5.0]]);
        // The variance of the four is 14/3; of their mean a fourth of that.
        let expected = (14.0_f32 / 12.0).sqrt();
        let [red, green, blue] = scatter.standard_error()[0];
        assert!((red - expected).abs() < 1e-6 && (green - 2.0 * expected).abs() < 1e-6);
        assert_eq!(blue, 0.0);
    }
}
