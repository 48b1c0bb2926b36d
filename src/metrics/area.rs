//! All figures of one region of a picture, and their mean over the frames of a sequence.

use serde::Serialize;

use super::error::{ErrorStats, Faults};
use super::noise::ReferenceNoise;
use super::temporal::mean;

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
    /// Each figure's mean over frames, where it exists; `pixels` and `faults` are sums. `None` for no frames.
    pub fn mean(frames: &[Self]) -> Option<Self> {
        if frames.is_empty() {
            return None;
        }
        let errors = || frames.iter().map(|area| &area.error);
        let each = |figure: fn(&ErrorStats) -> f64| mean(errors().map(figure)).unwrap_or_default();
        let known = |figure: fn(&ErrorStats) -> Option<f64>| mean(errors().filter_map(figure));
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
                reference_noise: mean_noise(
                    errors().filter_map(|error| error.reference_noise).collect(),
                ),
            },
            faults: frames.iter().map(|area| area.faults).sum(),
            psnr_db: mean(frames.iter().filter_map(|area| area.psnr_db)),
            ssim: mean(frames.iter().filter_map(|area| area.ssim)),
            reference_psnr_db: mean(frames.iter().filter_map(|area| area.reference_psnr_db)),
        })
    }
}

/// The noise of the references may be one in all frames, so that it does not drop with their number.
fn mean_noise(frames: Vec<ReferenceNoise>) -> Option<ReferenceNoise> {
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
