//! One measured setting.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::image::ImageSize;
use crate::metrics::error::percentile;

/// What came of one setting.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Hash of everything that it depends on.
    pub key: String,
    /// Name of the technique.
    pub technique: String,
    /// Pixels of the picture.
    pub size: ImageSize,
    /// Passes that a frame averages.
    pub passes: u32,
    /// Parameters that differ from their defaults.
    pub changed: BTreeMap<String, String>,
    /// Value of the technique's own effort: photons a pass, or paths a pixel and pass.
    pub effort: u32,
    /// Photons a pass; `None` for a technique that emits none.
    pub photons: Option<u32>,
    /// Gather radius of the last pass, metres; `None` for a technique that gathers none.
    pub radius_m: Option<f64>,
    /// How long a frame takes.
    pub time: FrameTime,
    /// How far frames are from the reference.
    pub error: Errors,
    /// What the technique warned of.
    pub warnings: Vec<String>,
    /// How fast the machine was just before.
    pub anchor: Option<Anchor>,
}

/// A setting that stays the same through a run, and how long its frame took at one time: machines get faster and slower.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Anchor {
    /// Key of the setting.
    pub key: String,
    /// Median time of its frames, milliseconds.
    pub ms: f64,
}

/// Times of independent frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameTime {
    /// Timed frames.
    pub frames: usize,
    /// Median over frames of the sum of their passes, milliseconds.
    pub median_ms: f64,
    /// 25th percentile, milliseconds.
    pub q25_ms: f64,
    /// 75th percentile, milliseconds.
    pub q75_ms: f64,
    /// 95th percentile, milliseconds.
    pub p95_ms: f64,
    /// Mean time of each stage, milliseconds, in order.
    pub pass_ms: Vec<(String, f64)>,
}

/// Errors by region; a region that holds no pixel has none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Within the fovea's limit.
    pub fovea: Option<RegionError>,
    /// Between the fovea's and the transition's limit.
    pub transition: Option<RegionError>,
    /// Beyond.
    pub periphery: Option<RegionError>,
    /// Temporal error MSE' in the fovea, (W/(m² sr))²: the frames are independent, so this is twice their variance.
    pub mse_temporal_fovea: Option<f64>,
    /// Channel values over all frames that were not finite; they count as black.
    pub not_finite: usize,
}

/// Errors over one region, means over frames, pixels and channels, less the reference's own variance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RegionError {
    /// Mean squared error, (W/(m² sr))².
    pub mse: f64,
    /// The share of `mse` that stays when frames are averaged: squared bias.
    pub bias_squared: f64,
    /// The rest of `mse`, which averaging takes away.
    pub variance: f64,
    /// Relative mean squared error: each square over r² + eps², eps 1 % of the reference's mean.
    pub relmse: f64,
    /// The biased share of `relmse`.
    pub relative_bias_squared: f64,
    /// The rest of `relmse`.
    pub relative_variance: f64,
    /// Standard error of `relmse` over frames.
    pub relmse_standard_error: f64,
    /// What the reference's noise had added to `relmse`.
    pub relative_reference_variance: f64,
    /// Sum of the pictures over sum of the reference; `None` where the reference sums to zero.
    pub mean_ratio: Option<f64>,
}

impl RegionError {
    /// Root of the squared bias, W/(m² sr); noise can make the square negative, which is no bias.
    pub fn bias(&self) -> f64 {
        self.bias_squared.max(0.0).sqrt()
    }

    /// The share of the relative error that is bias, 0 to 1.
    pub fn bias_share(&self) -> f64 {
        (self.relative_bias_squared / self.relmse.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
    }
}

impl Point {
    /// The relative mean squared error in the fovea: the error that is traded for time. Never below a thousandth of what the
    /// reference's own noise adds: less can't be told from nothing.
    pub fn relmse(&self) -> f64 {
        let fovea = self.error.fovea.unwrap_or_default();
        let floor = 1e-3 * fovea.relative_reference_variance;
        fovea.relmse.max(floor).max(1e-12)
    }

    /// Median time of a frame, milliseconds.
    pub fn frame_ms(&self) -> f64 {
        self.time.median_ms
    }

    /// The point in a few words: technique, size, paths, and what else was changed.
    pub fn label(&self) -> String {
        let mut words = vec![self.technique.clone(), self.size.to_string()];
        words.push(match self.photons {
            Some(photons) => format!("{} photons", grouped(photons)),
            None if self.effort == 1 => "1 path a pixel".into(),
            None => format!("{} paths a pixel", grouped(self.effort)),
        });
        if self.passes > 1 {
            words.push(format!("{} passes", self.passes));
        }
        let said = ["photon.count", "path.samples"];
        let others = self
            .changed
            .iter()
            .filter(|(key, _)| !said.contains(&key.as_str()));
        let name = |key: &str| {
            key.rsplit('.')
                .next()
                .map_or(String::new(), |name| name.replace('_', " "))
        };
        words.extend(others.map(|(key, value)| format!("{} {value}", name(key))));
        words.join(", ")
    }
}

impl FrameTime {
    /// Statistics over frames, each with its stages; `None` without frames.
    pub fn of(frames: &[Vec<(String, f64)>]) -> Option<Self> {
        let sum = |frame: &Vec<(String, f64)>| frame.iter().map(|(_, ms)| ms).sum::<f64>();
        let mut sums: Vec<f64> = frames.iter().map(sum).collect();
        if sums.is_empty() {
            return None;
        }
        sums.sort_unstable_by(f64::total_cmp);
        let mut pass_ms: Vec<(String, f64)> = Vec::new();
        for (name, ms) in frames.iter().flatten() {
            let ms = ms / frames.len() as f64;
            match pass_ms.iter_mut().find(|(known, _)| known == name) {
                Some((_, sum)) => *sum += ms,
                None => pass_ms.push((name.clone(), ms)),
            }
        }
        Some(Self {
            frames: sums.len(),
            median_ms: percentile(&sums, 0.5),
            q25_ms: percentile(&sums, 0.25),
            q75_ms: percentile(&sums, 0.75),
            p95_ms: percentile(&sums, 0.95),
            pass_ms,
        })
    }

    /// Distance between the quartiles over the median.
    pub fn spread(&self) -> f64 {
        (self.q75_ms - self.q25_ms) / self.median_ms.max(f64::MIN_POSITIVE)
    }
}

/// A count with a thin gap between thousands: 64 000.
pub fn grouped(count: u32) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A point of a technique with that time and that relative error, of which `bias_share` is bias.
    pub(crate) fn point(technique: &str, ms: f64, relmse: f64, bias_share: f64) -> Point {
        let effort = (ms * 100.0) as u32;
        Point {
            key: format!("{technique} {ms} {relmse}"),
            technique: technique.into(),
            size: "64x64".parse().unwrap(),
            passes: 1,
            changed: BTreeMap::from([("photon.count".to_owned(), effort.to_string())]),
            effort,
            photons: Some(effort),
            radius_m: Some(0.1),
            time: FrameTime::of(&[vec![("gather".into(), ms)]]).unwrap(),
            error: Errors {
                fovea: Some(RegionError {
                    mse: relmse,
                    relmse,
                    relative_bias_squared: relmse * bias_share,
                    relative_variance: relmse * (1.0 - bias_share),
                    ..RegionError::default()
                }),
                transition: None,
                periphery: None,
                mse_temporal_fovea: None,
                not_finite: 0,
            },
            warnings: Vec::new(),
            anchor: None,
        }
    }

    #[test]
    fn a_frame_is_the_sum_of_its_passes_and_the_median_forgives_a_hiccup() {
        let frame =
            |trace: f64, gather: f64| vec![("trace".into(), trace), ("gather".into(), gather)];
        let time = FrameTime::of(&[frame(1.0, 2.0), frame(1.0, 3.0), frame(90.0, 10.0)]).unwrap();
        assert_eq!((time.frames, time.median_ms), (3, 4.0));
        assert_eq!(time.pass_ms[1], ("gather".into(), 5.0));
        assert!(time.p95_ms > 50.0 && time.spread() > 1.0);
        assert_eq!(FrameTime::of(&[]), None);
    }

    #[test]
    fn counts_are_grouped_by_thousands() {
        assert_eq!(grouped(999), "999");
        assert_eq!(grouped(1_234_567), "1\u{202f}234\u{202f}567");
    }
}
