//! The knobs that a search turns, and the values that each is tried at.

use super::setting::{Setting, reads};
use crate::image::ImageSize;

/// The values that a knob is tried at, in the order in which they cost more.
#[derive(Clone, Debug, PartialEq)]
pub struct Ladder {
    key: &'static str,
    values: Vec<String>,
}

impl Ladder {
    /// What it varies.
    pub fn key(&self) -> &'static str {
        self.key
    }

    /// The ladders that a technique can climb; pictures grow to the size of the reference.
    pub fn all(technique: &str, reference: ImageSize) -> Vec<Self> {
        let doubling = |from: u32, to: u32| -> Vec<String> {
            let values = std::iter::successors(Some(from), |value| value.checked_mul(2));
            let values = values.take_while(|value| *value <= to);
            values.map(|value| value.to_string()).collect()
        };
        let texts = |values: &[u32]| values.iter().map(u32::to_string).collect();
        let ladders = [
            ("size", sizes(reference)),
            ("photon.count", doubling(125, 64_000_000)),
            ("path.samples", doubling(1, 65_536)),
            ("gather.photons_per_estimate", doubling(5, 320)),
            ("gather.coverage_rays", texts(&[0, 4, 8, 12])),
            ("direct.shadow_rays", doubling(1, 16)),
            ("fovea.samples", doubling(1, 16)),
            ("fovea.transition_samples", doubling(1, 4)),
            ("photon.depth_max", texts(&[3, 6, 12, 32])),
        ];
        ladders
            .into_iter()
            .filter(|(key, _)| reads(technique, key))
            .map(|(key, values)| Self { key, values })
            .collect()
    }

    /// The setting one step up (+1) or down (-1) from its nearest place on the ladder; `None` at the end.
    pub fn step(&self, setting: &Setting, direction: isize) -> Option<Setting> {
        let here = magnitude(&setting.get(self.key)?);
        let place = |value: &String| magnitude(value);
        let next = match direction {
            1 => self.values.iter().find(|value| place(value) > here * 1.01),
            _ => self
                .values
                .iter()
                .rev()
                .find(|value| place(value) < here * 0.99),
        }?;
        let mut setting = setting.clone();
        setting.set(self.key, next).ok()?;
        Some(setting)
    }
}

/// The setting with every knob brought down to that share of its place on its ladder, 0 to 1.
pub fn scaled_down(setting: &Setting, ladders: &[Ladder], share: f64) -> Setting {
    let mut scaled = setting.clone();
    for ladder in ladders {
        let here = setting
            .get(ladder.key)
            .map_or(0.0, |value| magnitude(&value));
        let place = ladder
            .values
            .iter()
            .rposition(|value| magnitude(value) <= here);
        let place = (share * place.unwrap_or(0) as f64).floor() as usize;
        // A rung of its own ladder is a value that the knob can have.
        if magnitude(&ladder.values[place]) < here {
            let _ = scaled.set(ladder.key, &ladder.values[place]);
        }
    }
    scaled
}

/// Sizes up to the reference's, in steps that the eye can tell.
fn sizes(reference: ImageSize) -> Vec<String> {
    let shares = [0.125, 0.1875, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0];
    let side = |share: f64, side: u32| ((share * f64::from(side)).round() as u32).max(1);
    let mut sizes: Vec<String> = shares
        .iter()
        .map(|share| ImageSize {
            width: side(*share, reference.width),
            height: side(*share, reference.height),
        })
        .map(|size| size.to_string())
        .collect();
    sizes.dedup();
    sizes
}

/// How far up a ladder a value stands: the number, or the pixels of a size.
fn magnitude(value: &str) -> f64 {
    let size = value.parse::<ImageSize>();
    let pixels = size.map(|size| f64::from(size.width) * f64::from(size.height));
    pixels.unwrap_or_else(|_| value.parse().unwrap_or(0.0))
}

#[cfg(test)]
mod tests {
    use super::super::setting::tests::setting;
    use super::*;

    fn ladders() -> Vec<Ladder> {
        Ladder::all("pm-direct", "64x64".parse().unwrap())
    }

    #[test]
    fn a_ladder_ends_at_both_ends_and_skips_nothing_between() {
        let ladders = ladders();
        let shadow = ladders
            .iter()
            .find(|l| l.key == "direct.shadow_rays")
            .unwrap();
        let mut here = setting();
        here.set("direct.shadow_rays", "3").unwrap();
        let rays = |setting: Option<Setting>| setting.map(|s| s.params.direct.shadow_rays);
        assert_eq!(rays(shadow.step(&here, 1)), Some(4));
        assert_eq!(rays(shadow.step(&here, -1)), Some(2));
        here.set("direct.shadow_rays", "16").unwrap();
        assert_eq!(rays(shadow.step(&here, 1)), None);
        assert!(Ladder::all("path", "64x64".parse().unwrap()).len() == 2);
    }

    #[test]
    fn scaling_down_takes_every_knob_along_and_never_up() {
        let mut start = setting();
        start.set("direct.shadow_rays", "16").unwrap();
        start.set("gather.photons_per_estimate", "2").unwrap();
        let half = scaled_down(&start, &ladders(), 0.5);
        assert_eq!(half.params.direct.shadow_rays, 4);
        assert!(half.size.width < start.size.width);
        assert!(half.params.photon.count < start.params.photon.count);
        let bottom = scaled_down(&start, &ladders(), 0.0);
        assert_eq!(bottom.params.photon.count, 125);
        assert_eq!(
            bottom.params.gather.photons_per_estimate, 2.0,
            "it is below its ladder"
        );
        assert_eq!(scaled_down(&start, &ladders(), 1.0).size, start.size);
    }
}
