//! How far a picture is from its reference: slices in, numbers out.
//!
//! Linear radiance is judged by [`error`] (bias, squared error, relative error), what an observer sees by [`ssim`] and
//! [`error::psnr_db`] on display values; [`region`] cuts the picture by true eccentricity. [`compare`] puts them together.

pub mod error;
pub mod region;
pub mod ssim;
pub mod temporal;

use serde::Serialize;

use crate::image::png;
use error::{ErrorStats, Faults, ImagePair};
use region::{EccentricityLimits, Region};

/// The share of the reference's mean that keeps relative errors finite where the reference is dark: eps = 1%.
pub const RELATIVE_EPSILON: f64 = 0.01;
/// What the mean luminance of the reference is exposed to before display metrics are taken: middle grey.
const DISPLAY_KEY: f64 = 0.18;

/// Why two pictures cannot be compared.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum MetricsError {
    /// The pictures do not have the same number of pixels, or their number does not fill rows of the given width.
    #[error(
        "the pictures differ in size: {candidate} pixels, reference {reference}, width {width}"
    )]
    SizeMismatch {
        /// Pixels of the picture that is judged.
        candidate: usize,
        /// Pixels of the reference (or of its standard error).
        reference: usize,
        /// Pixels across.
        width: usize,
    },
    /// The reference itself holds NaN or infinite values, so nothing can be judged by it.
    #[error("the reference has {0} channel values that are NaN or infinite")]
    BadReference(usize),
    /// The standard error of the reference holds NaN or infinite values.
    #[error("the reference's standard error has {0} channel values that are NaN or infinite")]
    BadStandardError(usize),
    /// Not one pixel of the picture is finite.
    #[error("not one pixel of the picture is finite")]
    NothingFinite,
}

/// The errors of one region of the picture, or of all of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Area {
    /// Errors of linear radiance.
    #[serde(flatten)]
    pub error: ErrorStats,
    /// Peak signal-to-noise ratio of display values (full scale 1), dB; `None` where they are equal.
    pub psnr_db: Option<f64>,
    /// Structural similarity of display values, 1 = equal; `None` where no 11x11 window fits.
    pub ssim: Option<f64>,
}

/// What [`compare`] found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// NaN, infinite and negative channel values of the picture. Pixels that are not finite take part in nothing else.
    pub faults: Faults,
    /// Set where the reference is black, so that no ratio means anything.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub against_black: Option<AgainstBlack>,
    /// All pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub whole: Option<Area>,
    /// Means of 8x8 pixels: noise drops about 8 times, so bias and blur show that the number per pixel hides.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub block8: Option<ErrorStats>,
    /// Pixels within the fovea's eccentricity, where a gaze was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fovea: Option<Area>,
    /// Pixels between the fovea's and the transition's eccentricity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub transition: Option<Area>,
    /// Pixels beyond.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub periphery: Option<Area>,
    /// The exposure at which display values were taken: the mean luminance of the reference becomes middle grey, 0.18.
    pub display_exposure_ev: f64,
}

/// How a picture departs from a black reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AgainstBlack {
    /// Mean of the absolute channel values.
    pub mean_absolute: f64,
    /// Largest absolute channel value.
    pub max_absolute: f64,
    /// Pixels with any channel not zero.
    pub nonzero_pixels: usize,
}

/// Compares a picture with its reference: whole, in blocks, and by region where `eccentricity_rad` gives the angle of each pixel
/// from the gaze together with the limits of the regions.
///
/// # Errors
/// Sizes that differ, a reference that is not finite, or a picture without one finite pixel.
pub fn compare(
    pair: ImagePair,
    regions: Option<(&[f64], EccentricityLimits)>,
) -> Result<Comparison, MetricsError> {
    check(pair, regions.map(|(angles, _)| angles.len()))?;
    let faults = Faults::count(pair.candidate);
    let finite = |&pixel: &usize| pair.candidate[pixel].iter().all(|x| x.is_finite());
    let all: Vec<usize> = (0..pair.candidate.len()).filter(finite).collect();
    if all.is_empty() {
        return Err(MetricsError::NothingFinite);
    }
    let mut comparison = Comparison {
        faults,
        against_black: None,
        whole: None,
        block8: None,
        fovea: None,
        transition: None,
        periphery: None,
        display_exposure_ev: 0.0,
    };
    if all
        .iter()
        .all(|&pixel| pair.reference[pixel].iter().all(|&x| x <= 0.0))
    {
        comparison.against_black = Some(against_black(pair.candidate, &all));
        return Ok(comparison);
    }
    let epsilon = RELATIVE_EPSILON * error::mean(pair.reference, &all);
    let display = Display::new(pair, &all);
    let area = |pixels: &[usize]| -> Option<Area> {
        Some(Area {
            error: ErrorStats::of(pair, pixels, epsilon)?,
            psnr_db: error::psnr_db(&display.candidate, &display.reference, pixels),
            ssim: display.mean_ssim(pixels),
        })
    };
    comparison.display_exposure_ev = display.exposure_ev;
    comparison.block8 = error::block_stats(pair, epsilon);
    if let Some((angles, limits)) = regions {
        let within = |region: Region| -> Vec<usize> {
            let inside = |&pixel: &usize| limits.region(angles[pixel]) == region;
            all.iter().copied().filter(inside).collect()
        };
        comparison.fovea = area(&within(Region::Fovea));
        comparison.transition = area(&within(Region::Transition));
        comparison.periphery = area(&within(Region::Periphery));
    }
    comparison.whole = area(&all);
    Ok(comparison)
}

fn check(pair: ImagePair, angles: Option<usize>) -> Result<(), MetricsError> {
    let candidate = pair.candidate.len();
    let mismatch = |reference| MetricsError::SizeMismatch {
        candidate,
        reference,
        width: pair.width,
    };
    if candidate == 0 || pair.width == 0 || !candidate.is_multiple_of(pair.width) {
        return Err(mismatch(pair.reference.len()));
    }
    let others = [
        Some(pair.reference.len()),
        pair.reference_standard_error.map(<[_]>::len),
        angles,
    ];
    if let Some(other) = others.into_iter().flatten().find(|&n| n != candidate) {
        return Err(mismatch(other));
    }
    let bad = |rgb: &[[f32; 3]]| rgb.as_flattened().iter().filter(|x| !x.is_finite()).count();
    match (
        bad(pair.reference),
        pair.reference_standard_error.map_or(0, bad),
    ) {
        (0, 0) => Ok(()),
        (0, n) => Err(MetricsError::BadStandardError(n)),
        (n, _) => Err(MetricsError::BadReference(n)),
    }
}

fn against_black(candidate: &[[f32; 3]], pixels: &[usize]) -> AgainstBlack {
    let values = || pixels.iter().flat_map(|&pixel| candidate[pixel]);
    AgainstBlack {
        mean_absolute: values().map(|x| f64::from(x.abs())).sum::<f64>()
            / (3 * pixels.len()) as f64,
        max_absolute: values().map(|x| f64::from(x.abs())).fold(0.0, f64::max),
        nonzero_pixels: pixels
            .iter()
            .filter(|&&pixel| candidate[pixel] != [0.0; 3])
            .count(),
    }
}

/// Both pictures as they would be shown, at the exposure that makes the reference middle grey.
struct Display {
    exposure_ev: f64,
    candidate: Vec<[f32; 3]>,
    reference: Vec<[f32; 3]>,
    /// Structural similarity around each pixel where a window fits.
    ssim: Vec<Option<f64>>,
}

impl Display {
    fn new(pair: ImagePair, pixels: &[usize]) -> Self {
        let luminance = |&pixel: &usize| ssim::luminance(pair.reference[pixel]);
        let mean = pixels.iter().map(luminance).sum::<f64>() / pixels.len() as f64;
        let exposure_ev = (DISPLAY_KEY / mean.max(f64::MIN_POSITIVE)).log2();
        let show = |rgb: &[[f32; 3]]| -> Vec<[f32; 3]> {
            rgb.iter()
                .map(|&rgb| png::tone_map(rgb, exposure_ev as f32).map(png::srgb_encode))
                .collect()
        };
        let (candidate, reference) = (show(pair.candidate), show(pair.reference));
        let ssim = ssim::map(&candidate, &reference, pair.width);
        Self {
            exposure_ev,
            candidate,
            reference,
            ssim,
        }
    }

    fn mean_ssim(&self, pixels: &[usize]) -> Option<f64> {
        let values = || pixels.iter().filter_map(|&pixel| self.ssim[pixel]);
        match values().count() {
            0 => None,
            n => Some(values().sum::<f64>() / n as f64),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: usize = 16;

    fn flat(value: f32) -> Vec<[f32; 3]> {
        vec![[value, 0.5 * value, 2.0 * value]; SIZE * SIZE]
    }

    fn pair<'a>(candidate: &'a [[f32; 3]], reference: &'a [[f32; 3]]) -> ImagePair<'a> {
        ImagePair {
            width: SIZE,
            candidate,
            reference,
            reference_standard_error: None,
        }
    }

    #[test]
    fn a_picture_equals_itself_and_a_brighter_one_does_not() {
        let reference = flat(3.0);
        let same = compare(pair(&reference, &reference), None).unwrap();
        let whole = same.whole.unwrap();
        assert_eq!(whole.error.mse, 0.0);
        assert_eq!(whole.error.mean_ratio, [Some(1.0); 3]);
        assert_eq!((whole.psnr_db, whole.ssim), (None, Some(1.0)));
        assert_eq!(same.block8.unwrap().relmse, 0.0);

        let brighter = compare(pair(&flat(3.3), &reference), None).unwrap();
        let whole = brighter.whole.unwrap();
        for ratio in whole.error.mean_ratio {
            assert!((ratio.unwrap() - 1.1).abs() < 1e-6);
        }
        assert!(whole.error.mse > 0.0 && whole.ssim.unwrap() < 1.0 && whole.psnr_db.is_some());
    }

    #[test]
    fn each_region_is_judged_by_its_own_pixels() {
        let reference = flat(1.0);
        let mut candidate = reference.clone();
        // Eccentricity grows by a degree a column: columns 0..=4 are fovea, 5..=9 transition, the rest periphery.
        let angles: Vec<f64> = (0..SIZE * SIZE)
            .map(|pixel| ((pixel % SIZE) as f64).to_radians())
            .collect();
        for row in candidate.chunks_mut(SIZE) {
            row[12..].fill([2.0, 1.0, 4.0]);
        }
        let limits = EccentricityLimits {
            fovea_rad: 4.5_f64.to_radians(),
            transition_rad: 9.5_f64.to_radians(),
        };
        let result = compare(pair(&candidate, &reference), Some((&angles, limits))).unwrap();
        let (fovea, transition, periphery) = (
            result.fovea.unwrap().error,
            result.transition.unwrap().error,
            result.periphery.unwrap().error,
        );
        assert_eq!(
            fovea.pixels + transition.pixels + periphery.pixels,
            SIZE * SIZE
        );
        assert_eq!((fovea.pixels, transition.pixels), (5 * SIZE, 5 * SIZE));
        assert_eq!((fovea.mse, transition.mse), (0.0, 0.0));
        assert!(periphery.mse > 0.0);
    }

    #[test]
    fn pixels_that_are_not_finite_are_counted_and_left_out() {
        let reference = flat(1.0);
        let mut candidate = reference.clone();
        candidate[3] = [f32::NAN, f32::INFINITY, -1.0];
        let result = compare(pair(&candidate, &reference), None).unwrap();
        let expected = Faults {
            nan: 1,
            infinite: 1,
            negative: 1,
        };
        assert_eq!(result.faults, expected);
        let whole = result.whole.unwrap().error;
        assert_eq!((whole.pixels, whole.mse), (SIZE * SIZE - 1, 0.0));
        let hopeless = vec![[f32::NAN; 3]; SIZE * SIZE];
        assert_eq!(
            compare(pair(&hopeless, &reference), None),
            Err(MetricsError::NothingFinite)
        );
    }

    #[test]
    fn a_black_reference_is_judged_by_absolute_values() {
        let black = flat(0.0);
        let mut candidate = black.clone();
        candidate[7] = [0.25, 0.0, 0.0];
        let result = compare(pair(&candidate, &black), None).unwrap();
        let against_black = result.against_black.unwrap();
        assert_eq!(
            (against_black.max_absolute, against_black.nonzero_pixels),
            (0.25, 1)
        );
        assert!(result.whole.is_none());
    }

    #[test]
    fn sizes_that_differ_and_bad_references_are_refused() {
        let reference = flat(1.0);
        assert!(matches!(
            compare(pair(&reference[1..], &reference), None),
            Err(MetricsError::SizeMismatch { .. })
        ));
        let mut bad = reference.clone();
        bad[0][1] = f32::NAN;
        assert_eq!(
            compare(pair(&reference, &bad), None),
            Err(MetricsError::BadReference(1))
        );
    }
}
