//! Frames against the reference, region by region: error, its biased share, flicker.
//!
//! Over n independent frames f of one setting, with r the reference and s its standard error: the mean of (f - r)² is bias² + variance
//! + s²; the square of (mean of f) - r is bias² + variance/n + s². From these two follow bias² and variance; s² is taken off.

use super::CostError;
use super::point::{Errors, RegionError};
use super::reference::Reference;
use super::resample::resample;
use crate::image::{ImageSize, LinearImage};
use crate::metrics::region::{EccentricityLimits, Region};
use crate::metrics::temporal::temporal_mse;
use crate::metrics::{RELATIVE_EPSILON, error};

/// A reference, cut into regions.
#[derive(Debug)]
pub struct Judge {
    reference: Reference,
    /// Pixels of fovea, transition and periphery.
    pixels: [Vec<usize>; 3],
    /// What keeps relative errors finite where the reference is dark.
    epsilon: f64,
}

impl Judge {
    /// Cuts the reference by the angle of each of its pixels from the gaze, radians.
    ///
    /// # Errors
    /// [`CostError`]: a black reference, or a gaze that makes no pixel foveal.
    pub fn new(
        reference: Reference,
        eccentricities_rad: &[f64],
        limits: EccentricityLimits,
    ) -> Result<Self, CostError> {
        let mut pixels: [Vec<usize>; 3] = Default::default();
        for (pixel, angle) in eccentricities_rad.iter().enumerate() {
            let region = match limits.region(*angle) {
                Region::Fovea => 0,
                Region::Transition => 1,
                Region::Periphery => 2,
            };
            pixels[region].push(pixel);
        }
        if pixels[0].is_empty() {
            return Err(CostError::NoFovea);
        }
        let all: Vec<usize> = (0..reference.image.rgb.len()).collect();
        let epsilon = RELATIVE_EPSILON * error::mean(&reference.image.rgb, &all);
        let fault = match epsilon {
            epsilon if !epsilon.is_finite() => Some("it holds values that are not finite"),
            epsilon if epsilon <= 0.0 => Some("it is black, so no relative error exists"),
            _ => None,
        };
        if let Some(fault) = fault {
            return Err(CostError::Reference(fault.into()));
        }
        Ok(Self {
            reference,
            pixels,
            epsilon,
        })
    }

    /// The reference.
    pub fn reference(&self) -> &Reference {
        &self.reference
    }

    /// Its size, which every picture is brought to.
    pub fn size(&self) -> ImageSize {
        ImageSize {
            width: self.reference.image.width,
            height: self.reference.image.height,
        }
    }

    /// Pixels of the fovea.
    pub fn fovea(&self) -> &[usize] {
        &self.pixels[0]
    }

    /// What keeps relative errors finite where the reference is dark, W/(m² sr).
    pub fn epsilon(&self) -> f64 {
        self.epsilon
    }

    /// Starts to judge a setting.
    pub fn tally(&self) -> Tally<'_> {
        Tally {
            judge: self,
            sum: vec![[0.0; 3]; self.reference.image.rgb.len()],
            frames: Default::default(),
            flicker: Vec::new(),
            last: None,
            not_finite: 0,
        }
    }

    /// Mean over a region of squared differences from the reference, plain and relative.
    fn squares(&self, region: usize, value: impl Fn(usize) -> [f64; 3]) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for &pixel in &self.pixels[region] {
            for (value, reference) in value(pixel).iter().zip(self.reference.image.rgb[pixel]) {
                let square = (value - f64::from(reference)).powi(2);
                sums[0] += square;
                sums[1] += square / self.scale(reference);
            }
        }
        sums.map(|sum| sum / (3 * self.pixels[region].len()) as f64)
    }

    /// Mean variance of the reference over a region, plain and relative.
    fn reference_variance(&self, region: usize) -> [f64; 2] {
        let Some(standard_error) = &self.reference.standard_error else {
            return [0.0; 2];
        };
        let mut sums = [0.0; 2];
        for &pixel in &self.pixels[region] {
            let errors = standard_error.rgb[pixel].iter();
            for (error, reference) in errors.zip(self.reference.image.rgb[pixel]) {
                let variance = f64::from(*error).powi(2);
                sums[0] += variance;
                sums[1] += variance / self.scale(reference);
            }
        }
        sums.map(|sum| sum / (3 * self.pixels[region].len()) as f64)
    }

    fn scale(&self, reference: f32) -> f64 {
        f64::from(reference).powi(2) + self.epsilon.powi(2)
    }
}

/// The frames of one setting so far.
pub struct Tally<'a> {
    judge: &'a Judge,
    sum: Vec<[f64; 3]>,
    /// For each region and frame the mean square, plain and relative.
    frames: [Vec<[f64; 2]>; 3],
    flicker: Vec<f64>,
    last: Option<LinearImage>,
    not_finite: usize,
}

impl Tally<'_> {
    /// Adds a frame of any size. Values that are not finite count as black.
    pub fn add(&mut self, frame: &LinearImage) {
        let mut frame = frame.clone();
        for value in frame.rgb.as_flattened_mut() {
            if !value.is_finite() {
                *value = 0.0;
                self.not_finite += 1;
            }
        }
        let size = self.judge.size();
        let frame = resample(&frame, size.width, size.height);
        for (sum, rgb) in self.sum.iter_mut().zip(&frame.rgb) {
            for channel in 0..3 {
                sum[channel] += f64::from(rgb[channel]);
            }
        }
        for region in 0..3 {
            if !self.judge.pixels[region].is_empty() {
                let value = |pixel: usize| frame.rgb[pixel].map(f64::from);
                self.frames[region].push(self.judge.squares(region, value));
            }
        }
        if let Some(last) = &self.last {
            let pair: [&[[f32; 3]]; 2] = [&last.rgb, &frame.rgb];
            self.flicker
                .extend(temporal_mse(&pair, Some(self.judge.fovea())));
        }
        self.last = Some(frame);
    }

    /// Standard error of the foveal relative error over its mean; infinite below two frames.
    pub fn relative_standard_error(&self) -> f64 {
        let values: Vec<f64> = self.frames[0].iter().map(|squares| squares[1]).collect();
        standard_error(&values) / mean(&values)
    }

    /// The errors.
    pub fn finish(self) -> Errors {
        let [fovea, transition, periphery] = [0, 1, 2].map(|region| self.region(region));
        Errors {
            fovea,
            transition,
            periphery,
            mse_temporal_fovea: (!self.flicker.is_empty()).then(|| mean(&self.flicker)),
            not_finite: self.not_finite,
        }
    }

    fn region(&self, region: usize) -> Option<RegionError> {
        let frames = &self.frames[region];
        if frames.is_empty() {
            return None;
        }
        let count = frames.len() as f64;
        let of_mean = self
            .judge
            .squares(region, |pixel| self.sum[pixel].map(|sum| sum / count));
        let noise = self.judge.reference_variance(region);
        let split = |kind: usize| {
            let values: Vec<f64> = frames.iter().map(|squares| squares[kind]).collect();
            let error = mean(&values) - noise[kind];
            // One frame can't tell bias from variance.
            let unbiased = count / (count - 1.0).max(1.0);
            let variance = (mean(&values) - of_mean[kind]) * unbiased;
            (error, error - variance, variance, standard_error(&values))
        };
        let (mse, bias_squared, variance, _) = split(0);
        let (relmse, relative_bias_squared, relative_variance, relmse_standard_error) = split(1);
        let pixels = &self.judge.pixels[region];
        let light: f64 = pixels.iter().flat_map(|&pixel| self.sum[pixel]).sum();
        let reference = error::mean(&self.judge.reference.image.rgb, pixels);
        let reference = reference * (3 * pixels.len()) as f64;
        Some(RegionError {
            mse,
            bias_squared,
            variance,
            relmse,
            relative_bias_squared,
            relative_variance,
            relmse_standard_error,
            relative_reference_variance: noise[1],
            mean_ratio: (reference > 0.0).then(|| light / count / reference),
        })
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Standard error of the mean.
fn standard_error(values: &[f64]) -> f64 {
    if values.len() < 2 {
        return f64::INFINITY;
    }
    let (count, mean) = (values.len() as f64, mean(values));
    let square: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (square / (count * (count - 1.0))).sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::reference::Origin;
    use super::*;

    const SIDE: u32 = 32;

    /// Numbers between -1 and 1 that look random, with variance 1/3.
    fn noise(seed: u32) -> impl FnMut() -> f32 {
        let mut state = seed.wrapping_mul(0x9e37_79b9) | 1;
        move || {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            (state >> 8) as f32 / (1 << 23) as f32 - 1.0
        }
    }

    fn image(mut value: impl FnMut() -> f32) -> LinearImage {
        let pixels = 0..SIDE * SIDE;
        LinearImage {
            width: SIDE,
            height: SIDE,
            rgb: pixels.map(|_| [value(), value(), value()]).collect(),
        }
    }

    /// All of the picture is fovea.
    fn judge(reference: LinearImage, standard_error: Option<f32>) -> Judge {
        let angles = vec![0.0; reference.rgb.len()];
        let reference = Reference {
            standard_error: standard_error.map(|error| image(|| error)),
            image: reference,
            origin: Origin::File {
                sha256: String::new(),
            },
        };
        let limits = EccentricityLimits {
            fovea_rad: 0.1,
            transition_rad: 0.2,
        };
        Judge::new(reference, &angles, limits).unwrap()
    }

    #[test]
    fn an_error_is_split_into_bias_and_variance() {
        let judge = judge(image(|| 2.0), None);
        let mut tally = judge.tally();
        for frame in 0..8 {
            let mut noise = noise(frame + 1);
            tally.add(&image(|| 2.5 + 0.6 * noise()));
        }
        let errors = tally.finish();
        let fovea = errors.fovea.unwrap();
        assert!((fovea.bias_squared - 0.25).abs() < 0.01, "{fovea:?}");
        assert!((fovea.variance - 0.12).abs() < 0.01, "{fovea:?}");
        assert!((fovea.mse - fovea.bias_squared - fovea.variance).abs() < 1e-9);
        assert!((fovea.relmse - fovea.mse / 4.0).abs() < 1e-3);
        assert!((fovea.mean_ratio.unwrap() - 1.25).abs() < 0.01);
        let flicker = errors.mse_temporal_fovea.unwrap();
        assert!((flicker - 2.0 * fovea.variance).abs() < 0.02);
        assert_eq!((errors.transition, errors.periphery), (None, None));
    }

    #[test]
    fn the_reference_noise_is_taken_off_and_only_where_it_is_known() {
        // The frames are right; the reference errs by 0.5 times a number of variance 1/3.
        let mut error = noise(99);
        let reference = image(|| 2.0 + 0.5 * error());
        let known = (0.25_f32 / 3.0).sqrt();
        let of = |standard_error| {
            let judge = judge(reference.clone(), standard_error);
            let mut tally = judge.tally();
            tally.add(&image(|| 2.0));
            tally.add(&image(|| 2.0));
            tally.finish().fovea.unwrap()
        };
        assert!(of(Some(known)).mse.abs() < 0.004, "{:?}", of(Some(known)));
        assert!(of(None).mse > 0.07);
    }

    #[test]
    fn a_picture_of_another_size_and_one_with_holes_are_judged() {
        let judge = judge(image(|| 2.0), None);
        let mut tally = judge.tally();
        let small = LinearImage {
            width: 2,
            height: 1,
            rgb: vec![[2.0; 3], [2.0, f32::NAN, 2.0]],
        };
        tally.add(&small);
        let errors = tally.finish();
        assert_eq!(errors.not_finite, 1);
        assert!(errors.fovea.unwrap().mse > 0.3);
    }

    #[test]
    fn a_black_reference_and_a_gaze_aside_are_refused() {
        let reference = |value: f32| Reference {
            image: image(|| value),
            standard_error: None,
            origin: Origin::File {
                sha256: String::new(),
            },
        };
        let limits = EccentricityLimits {
            fovea_rad: 0.1,
            transition_rad: 0.2,
        };
        let angles = |angle: f64| vec![angle; (SIDE * SIDE) as usize];
        let black = Judge::new(reference(0.0), &angles(0.0), limits);
        assert!(black.unwrap_err().to_string().contains("black"));
        let aside = Judge::new(reference(1.0), &angles(1.0), limits);
        assert!(aside.unwrap_err().to_string().contains("--gaze"));
    }
}
