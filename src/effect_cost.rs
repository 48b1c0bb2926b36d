//! What each effect costs: frames with it and without it, side by side on the device at hand.

use std::time::Instant;

use serde::Serialize;

use crate::gather::EyeSettings;
use crate::gpu::{GpuDevice, GpuError};
use crate::params::Params;
use crate::scene::effects::Effects;
use crate::scene::loaded::LoadedScene;
use crate::still::Still;
use crate::technique::TechniqueEntry;

/// Pairs of frames that are compared, after one pair to warm up.
const PAIRS: usize = 5;

/// One effect's price in a scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EffectCost {
    /// Name of the effect, as in [`Effects::named`].
    pub effect: &'static str,
    /// Whether the scene calls for it. Where it does, leaving it out would make another picture.
    pub on: bool,
    /// Time of a frame with it over one without it, the median of pairs taken in turn.
    pub time_ratio: f64,
    /// The middle half of the pairs lies between.
    pub time_ratio_quartiles: [f64; 2],
    /// Device memory that it takes, bytes; `None` where the driver's allocator tells nothing.
    pub bytes: Option<i64>,
}

/// Two sets of effects for one picture, compared.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Time of a frame with the first set over one with the second, of each pair.
    pub time_ratios: Vec<f64>,
    /// Device memory of the first less that of the second.
    pub bytes: Option<i64>,
}

/// A picture to be made again and again.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// The device.
    pub gpu: &'a GpuDevice,
    /// The scene.
    pub scene: &'a LoadedScene,
    /// What is set.
    pub params: &'a Params,
    /// How light is transported.
    pub technique: &'a TechniqueEntry,
    /// The eye.
    pub eye: EyeSettings,
    /// Pixels across and down.
    pub size: (u32, u32),
}

impl<'a> Subject<'a> {
    /// The picture with the effects as told, and the device memory that it takes.
    ///
    /// # Errors
    /// [`GpuError`] when the device fails.
    pub fn start(&self, effects: Effects) -> Result<(Still<'a>, Option<i64>), GpuError> {
        let before = self.allocated_bytes()?;
        let still = Still::with_effects(
            self.gpu,
            self.scene,
            self.params,
            self.technique,
            self.eye,
            self.size,
            effects,
        )?;
        let after = self.allocated_bytes()?;
        let bytes = before.zip(after).map(|(before, after)| after - before);
        Ok((still, bytes))
    }

    /// Frames with either set in turn: first, second, second, first, so that what drifts hits both alike.
    ///
    /// # Errors
    /// [`GpuError`] when the device fails.
    pub fn compare(
        &self,
        first: Effects,
        second: Effects,
        pairs: usize,
    ) -> Result<Comparison, GpuError> {
        let (mut a, a_bytes) = self.start(first)?;
        let (mut b, b_bytes) = self.start(second)?;
        frame_ms(&mut a)?;
        frame_ms(&mut b)?;
        let mut time_ratios = Vec::with_capacity(pairs);
        for pair in 0..pairs {
            let (a_ms, b_ms) = if pair % 2 == 0 {
                let a_ms = frame_ms(&mut a)?;
                (a_ms, frame_ms(&mut b)?)
            } else {
                let b_ms = frame_ms(&mut b)?;
                (frame_ms(&mut a)?, b_ms)
            };
            time_ratios.push(a_ms / b_ms);
        }
        Ok(Comparison {
            time_ratios,
            bytes: a_bytes.zip(b_bytes).map(|(a, b)| a - b),
        })
    }

    /// The price of every effect, on or off; `done` is told after each, and ends the work by `false`.
    ///
    /// # Errors
    /// [`GpuError`] when the device fails.
    pub fn price(
        &self,
        own: Effects,
        done: &mut dyn FnMut() -> bool,
    ) -> Result<Vec<EffectCost>, GpuError> {
        let mut costs = Vec::new();
        for (effect, on) in own.named() {
            let (with, without) = (own.with(effect, true), own.with(effect, false));
            let comparison = match self.is_same_work(with, without) {
                true => Comparison {
                    time_ratios: vec![1.0],
                    bytes: Some(0),
                },
                false => self.compare(with, without, PAIRS)?,
            };
            let mut ratios = comparison.time_ratios;
            ratios.sort_by(f64::total_cmp);
            let at = |share: f64| ratios[((ratios.len() - 1) as f64 * share).round() as usize];
            costs.push(EffectCost {
                effect,
                on,
                time_ratio: at(0.5),
                time_ratio_quartiles: [at(0.25), at(0.75)],
                bytes: comparison.bytes,
            });
            if !done() {
                break;
            }
        }
        Ok(costs)
    }

    /// Whether two sets of effects lead to the same shaders and passes: what one effect needs, another may need too.
    fn is_same_work(&self, a: Effects, b: Effects) -> bool {
        let passes = self.technique.passes;
        a.constants() == b.constants() && passes(&a) == passes(&b)
    }

    fn allocated_bytes(&self) -> Result<Option<i64>, GpuError> {
        // What was dropped is freed once the device has looked.
        self.gpu.wait("counting memory")?;
        let report = self.gpu.device.generate_allocator_report();
        Ok(report.map(|report| report.total_allocated_bytes as i64))
    }
}

/// Wall time of one more pass, ms; the device is idle before and after.
fn frame_ms(still: &mut Still<'_>) -> Result<f64, GpuError> {
    let started = Instant::now();
    still.add_pass()?;
    Ok(started.elapsed().as_secs_f64() * 1e3)
}
