//! All figures of one region of a picture, and their mean over the frames of a sequence.

use serde::Serialize;

use super::error::{ErrorStats, Faults};
use super::noise::ReferenceNoise;
use super::temporal::{mean, mean_of_all};

/// The errors of one region of the picture, or of all of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Area {
    /// Errors of linear radiance.
    #[serde(flatten)]
    pub error: ErrorStats,
    /// NaN, infinite and negative channel values; pixels that are not finite are not in `error`.
    pub faults: Faults,
    /// Peak signal-to-noise ratio of display values (full scale 1), dB; `None` where they are equal.
    pub psnr_db: Option<f64>,
    /// Structural similarity of display values, 1 = equal; `None` where no 11x11 window fits.
    pub ssim: Option<f64>,
    /// The signal-to-noise ratio of the reference itself, dB: against a picture that is one standard error off in every value. A `psnr_db`
    /// near it or above says nothing more. `None` where the standard error is not known or zero.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference_psnr_db: Option<f64>,
}

impl Area {
    /// Each figure's mean over frames; `pixels` and `faults` are sums, a PSNR is that of the mean squared error. What needs the standard
    /// error of the reference is known only if it is known of all frames: a mean over some of them says nothing beside one over all.
    /// `None` for no frames.
    pub fn mean(frames: &[Self]) -> Option<Self> {
        if frames.is_empty() {
            return None;
        }
        let errors = || frames.iter().map(|area| &area.error);
        let each = |figure: fn(&ErrorStats) -> f64| mean(errors().map(figure)).unwrap_or_default();
        let known = |figure: fn(&ErrorStats) -> Option<f64>| mean_of_all(errors().map(figure));
        let reference_noise = mean_noise(errors().map(|error| error.reference_noise).collect());
        Some(Self {
            error: ErrorStats {
                pixels: errors().map(|error| error.pixels).sum(),
                bias: channels(errors().map(|error| error.bias.map(Some)))
                    .map(Option::unwrap_or_default),
                mean_ratio: channels(errors().map(|error| error.mean_ratio)),
                mse: each(|error| error.mse),
                mse_corrected: known(|error| error.mse_corrected),
                relmse: each(|error| error.relmse),
                relmse_corrected: known(|error| error.relmse_corrected),
                relmse_trimmed: each(|error| error.relmse_trimmed),
                relative_error_p50: each(|error| error.relative_error_p50),
                relative_error_p95: each(|error| error.relative_error_p95),
                reference_noise,
            },
            faults: frames.iter().map(|area| area.faults).sum(),
            psnr_db: mean_psnr_db(frames.iter().map(|area| area.psnr_db)),
            ssim: mean(frames.iter().filter_map(|area| area.ssim)),
            reference_psnr_db: reference_noise
                .and_then(|_| mean_psnr_db(frames.iter().map(|area| area.reference_psnr_db))),
        })
    }
}

/// The PSNR of the mean squared error over frames, dB, from the PSNR of each; `None` stands for no error at all.
fn mean_psnr_db(frames: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    let mse = mean(frames.map(|psnr_db| psnr_db.map_or(0.0, |x| 10.0_f64.powf(-0.1 * x))))?;
    (mse > 0.0).then(|| -10.0 * mse.log10())
}

/// `None` if it is not known of all frames. The noise of the references may be one in all frames, so that it does not drop with their number.
fn mean_noise(frames: Option<Vec<ReferenceNoise>>) -> Option<ReferenceNoise> {
    let frames = frames?;
    let each = |figure: fn(&ReferenceNoise) -> f64| mean(frames.iter().map(figure));
    Some(ReferenceNoise {
        reference_mse: each(|noise| noise.reference_mse)?,
        reference_relmse: each(|noise| noise.reference_relmse)?,
        detectable_mse: each(|noise| noise.detectable_mse)?,
        detectable_relmse: each(|noise| noise.detectable_relmse)?,
        bias_standard_error: channels(
            frames
                .iter()
                .map(|noise| noise.bias_standard_error.map(Some)),
        )
        .map(Option::unwrap_or_default),
    })
}

/// The mean of each channel.
fn channels(frames: impl Iterator<Item = [Option<f64>; 3]> + Clone) -> [Option<f64>; 3] {
    std::array::from_fn(|channel| mean(frames.clone().filter_map(|values| values[channel])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::compare;
    use crate::metrics::error::ImagePair;

    /// A grey frame of 16x16 pixels against a grey reference, whose standard error is as told.
    fn frame(candidate: f32, reference: f32, standard_error: Option<f32>) -> Area {
        let flat = |value: f32| vec![[value; 3]; 256];
        let standard_error = standard_error.map(flat);
        let pair = ImagePair {
            width: 16,
            candidate: &flat(candidate),
            reference: &flat(reference),
            reference_standard_error: standard_error.as_deref(),
        };
        compare(pair, None).unwrap().whole.unwrap()
    }

    #[test]
    fn a_frame_without_error_raises_the_psnr_of_a_sequence() {
        let (off, equal) = (frame(0.9, 1.0, None), frame(1.0, 1.0, None));
        assert_eq!(equal.psnr_db, None);
        let psnr_db = |frames: &[Area]| Area::mean(frames).unwrap().psnr_db;
        let alone = psnr_db(std::slice::from_ref(&off)).unwrap();
        assert!((alone - off.psnr_db.unwrap()).abs() < 1e-9);
        // Half the mean squared error is 3 dB more.
        let both = psnr_db(&[off, equal.clone()]).unwrap();
        assert!((both - alone - 10.0 * 2.0_f64.log10()).abs() < 1e-9);
        assert_eq!(psnr_db(&[equal.clone(), equal]), None);
    }

    #[test]
    fn what_only_some_frames_know_of_the_noise_is_not_told_of_the_sequence() {
        let (known, unknown) = (frame(1.1, 1.0, Some(0.1)), frame(1.1, 1.0, None));
        let told = |frames: &[Area]| {
            let Area {
                error,
                reference_psnr_db,
                ..
            } = Area::mean(frames).unwrap();
            [
                error.mse_corrected.is_some(),
                error.relmse_corrected.is_some(),
                error.reference_noise.is_some(),
                reference_psnr_db.is_some(),
            ]
        };
        assert_eq!(told(&[known.clone(), known.clone()]), [true; 4]);
        assert_eq!(told(&[known, unknown]), [false; 4]);
    }
}
