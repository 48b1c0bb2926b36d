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

/// Pairs of frames that suffice where all agree about which frame is slower: by chance alone they do once in 64 times.
const AGREEING_PAIRS: usize = 7;
/// Most pairs. With one that disagrees among these a difference is told; chance alone brings that about once in 150 times.
const PAIRS_MAX: usize = 11;
/// Pairs that say either way when a difference is given up.
const DISAGREEING_PAIRS: usize = 2;

/// What the effects cost in a scene, and the frames that say so.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EffectCosts {
    /// How light was transported.
    pub technique: &'static str,
    /// Pixels across.
    pub width_px: u32,
    /// Pixels down.
    pub height_px: u32,
    /// Photon paths emitted a frame; none by a technique without photons.
    pub photons: u32,
    /// The device's name.
    pub device: String,
    /// Median time of a frame with the scene's own effects, ms, of all that were timed.
    pub frame_ms: f64,
    /// The middle half of these frames lies between, ms: how steady the machine was.
    pub frame_ms_quartiles: [f64; 2],
    /// How many they are.
    pub frames: usize,
    /// Median time of a frame with every effect that there is, taken in turn with the former, ms.
    pub frame_with_all_ms: f64,
    /// Frames of the scene's own effects with frames of all: how many pairs.
    pub pairs_with_all: usize,
    /// The price of each.
    pub effects: Vec<EffectCost>,
}

/// One effect's price in a scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EffectCost {
    /// Name of the effect, as in [`Effects::named`].
    pub effect: &'static str,
    /// Whether the frame runs it. Where the scene calls for it, leaving it out would make another picture.
    pub on: bool,
    /// Effects of the frame that need all the passes and shaders that it needs: by itself it costs nothing. If it is on, the price is that of
    /// all these together with it.
    pub shared_with: Vec<&'static str>,
    /// Its time; `None` where nothing could be compared, as the frame is the same with it and without it.
    pub time: Option<TimeCost>,
    /// Device memory that it takes, bytes; `None` where the driver's allocator tells nothing.
    pub bytes: Option<i64>,
}

/// By how much a frame with an effect takes longer than one without it, in pairs of frames taken in turn.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TimeCost {
    /// Pairs of frames.
    pub pairs: usize,
    /// Whether the pairs agree about which takes longer (all but one at most); if not, the difference can't be told from nothing.
    pub is_told: bool,
    /// The median, as a share of the frame with the scene's own effects that was taken beside it.
    pub share: f64,
    /// The middle half of the pairs lies between.
    pub share_quartiles: [f64; 2],
}

/// Times of two frames that were taken one right after the other, ms.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Pair {
    /// With the scene's own effects.
    own_ms: f64,
    /// With other effects.
    other_ms: f64,
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

    /// The price of every effect, on or off; `done` is told after each, and ends the work by `false`.
    ///
    /// # Errors
    /// [`GpuError`] when the device fails.
    pub fn price(
        &self,
        own: Effects,
        done: &mut dyn FnMut() -> bool,
    ) -> Result<EffectCosts, GpuError> {
        let (mut own_still, own_bytes) = self.start(own)?;
        // The first frame compiles.
        frame_ms(&mut own_still, 0)?;
        let mut compare = |other: Effects| -> Result<_, GpuError> {
            let (mut other_still, other_bytes) = self.start(other)?;
            frame_ms(&mut other_still, 0)?;
            let pairs = pairs(&mut own_still, &mut other_still)?;
            let bytes = own_bytes.zip(other_bytes);
            Ok((pairs, bytes.map(|(own, other)| own - other)))
        };
        let (with_all, _) = compare(Effects::ALL)?;
        let mut own_ms = Vec::from_iter(with_all.iter().map(|pair| pair.own_ms));
        let mut costs = Vec::new();
        for (effect, on) in own.named() {
            let (with, without) = (own.with(effect, true), own.with(effect, false));
            let shared_with = match self.is_same_work(with, without) {
                true => self.sharers(own, effect),
                false => Vec::new(),
            };
            let other = match on {
                true => own.without(&shared_with).with(effect, false),
                false => with,
            };
            let mut cost = EffectCost {
                effect,
                on,
                shared_with,
                time: None,
                bytes: Some(0),
            };
            if !self.is_same_work(own, other) {
                let (pairs, bytes) = compare(other)?;
                own_ms.extend(pairs.iter().map(|pair| pair.own_ms));
                cost.time = Some(TimeCost::of(&pairs, on));
                cost.bytes = bytes.map(|bytes| if on { bytes } else { -bytes });
            }
            costs.push(cost);
            if !done() {
                break;
            }
        }
        Ok(EffectCosts {
            technique: self.technique.name,
            width_px: self.size.0,
            height_px: self.size.1,
            photons: self.params.photon.count,
            device: self.gpu.info.name.clone(),
            frame_ms: quantile(own_ms.clone(), 0.5),
            frame_ms_quartiles: [0.25, 0.75].map(|part| quantile(own_ms.clone(), part)),
            frames: own_ms.len(),
            frame_with_all_ms: quantile(with_all.iter().map(|pair| pair.other_ms).collect(), 0.5),
            pairs_with_all: with_all.len(),
            effects: costs,
        })
    }

    /// Whether two sets of effects lead to the same shaders and passes: what one effect needs, another may need too.
    fn is_same_work(&self, a: Effects, b: Effects) -> bool {
        let passes = |effects| (self.technique.passes)(effects, self.params);
        a.constants() == b.constants() && passes(&a) == passes(&b)
    }

    /// The fewest effects that have to go before leaving out `effect` leaves out work; none where it never does.
    fn sharers(&self, own: Effects, effect: &str) -> Vec<&'static str> {
        let others = own.named().filter(|(name, on)| *on && *name != effect);
        let others = Vec::from_iter(others.map(|(name, _)| name));
        let chosen = |mask: u32| {
            let bits = (0..others.len()).filter(move |bit| mask >> bit & 1 == 1);
            Vec::from_iter(bits.map(|bit| others[bit]))
        };
        let shows = |gone: &[&str]| {
            let rest = own.without(gone);
            !self.is_same_work(rest.with(effect, true), rest.with(effect, false))
        };
        (1..1 << others.len())
            .filter(|mask| shows(&chosen(*mask)))
            .min_by_key(|mask| mask.count_ones())
            .map_or_else(Vec::new, chosen)
    }

    fn allocated_bytes(&self) -> Result<Option<i64>, GpuError> {
        // What was dropped is freed once the device has looked.
        self.gpu.wait("counting memory")?;
        let report = self.gpu.device.generate_allocator_report();
        Ok(report.map(|report| report.total_allocated_bytes as i64))
    }
}

impl TimeCost {
    /// What pairs of frames say of an effect that is on in the scene's own frame, or off there.
    fn of(pairs: &[Pair], on: bool) -> Self {
        let share = |pair: &Pair| match on {
            true => (pair.own_ms - pair.other_ms) / pair.own_ms,
            false => (pair.other_ms - pair.own_ms) / pair.own_ms,
        };
        let shares = Vec::from_iter(pairs.iter().map(share));
        let at = |part: f64| quantile(shares.clone(), part);
        Self {
            pairs: pairs.len(),
            is_told: Verdict::of(pairs) == Verdict::Told,
            share: at(0.5),
            share_quartiles: [at(0.25), at(0.75)],
        }
    }
}

/// What pairs of frames say about which frame takes longer: a sign test that ends as soon as it is decided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verdict {
    /// More pairs are needed.
    Open,
    /// One takes longer.
    Told,
    /// The difference can't be told from nothing.
    NotTold,
}

impl Verdict {
    fn of(pairs: &[Pair]) -> Self {
        let slower = pairs.iter().filter(|pair| pair.own_ms > pair.other_ms);
        let slower = slower.count();
        let disagreeing = slower.min(pairs.len() - slower);
        match disagreeing {
            DISAGREEING_PAIRS.. => Self::NotTold,
            0 if pairs.len() >= AGREEING_PAIRS => Self::Told,
            _ if pairs.len() >= PAIRS_MAX => Self::Told,
            _ => Self::Open,
        }
    }
}

/// Frames of either in turn, own, other, other, own, so that what drifts hits both alike; each pair has the same random numbers.
fn pairs(own: &mut Still<'_>, other: &mut Still<'_>) -> Result<Vec<Pair>, GpuError> {
    let mut pairs = Vec::new();
    while Verdict::of(&pairs) == Verdict::Open {
        let frame = pairs.len() as u32 + 1;
        let (own_ms, other_ms) = if pairs.len() % 2 == 0 {
            let own_ms = frame_ms(own, frame)?;
            (own_ms, frame_ms(other, frame)?)
        } else {
            let other_ms = frame_ms(other, frame)?;
            (frame_ms(own, frame)?, other_ms)
        };
        pairs.push(Pair { own_ms, other_ms });
    }
    Ok(pairs)
}

/// Wall time of a frame with the first radius and the random numbers of `frame`, ms; the device is idle before and after.
fn frame_ms(still: &mut Still<'_>, frame: u32) -> Result<f64, GpuError> {
    still.start_over_at(frame);
    let started = Instant::now();
    still.add_pass()?;
    Ok(started.elapsed().as_secs_f64() * 1e3)
}

/// The value below which a share of all lies, between the two nearest there are; of one at least.
fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let place = (values.len() - 1) as f64 * share;
    let (below, above) = (
        values[place.floor() as usize],
        values[place.ceil() as usize],
    );
    below + (above - below) * place.fract()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pairs_of(differences_ms: &[f64]) -> Vec<Pair> {
        let pair = |difference_ms: &f64| Pair {
            own_ms: 100.0,
            other_ms: 100.0 - difference_ms,
        };
        differences_ms.iter().map(pair).collect()
    }

    #[test]
    fn pairs_are_taken_until_they_agree_or_clearly_do_not() {
        let verdict = |differences_ms: &[f64]| Verdict::of(&pairs_of(differences_ms));
        assert_eq!(verdict(&[]), Verdict::Open);
        assert_eq!(verdict(&[3.0; 6]), Verdict::Open);
        assert_eq!(verdict(&[3.0; 7]), Verdict::Told);
        assert_eq!(verdict(&[-3.0; 7]), Verdict::Told);
        assert_eq!(verdict(&[3.0, -1.0, 2.0, -2.0]), Verdict::NotTold);
        let one_disagrees = [3.0, -1.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0];
        assert_eq!(verdict(&one_disagrees[..10]), Verdict::Open);
        assert_eq!(verdict(&one_disagrees), Verdict::Told);
    }

    #[test]
    fn a_cost_is_what_the_frame_with_the_effect_takes_longer() {
        let pairs = pairs_of(&[10.0, 12.0, 11.0, 30.0, 9.0, 11.0, 11.0]);
        let on = TimeCost::of(&pairs, true);
        assert_eq!((on.pairs, on.is_told), (7, true));
        let is_close = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(is_close(on.share, 0.11), "{on:?}");
        let [low, high] = on.share_quartiles;
        assert!(is_close(low, 0.105) && is_close(high, 0.115), "{on:?}");
        assert!(is_close(TimeCost::of(&pairs, false).share, -0.11));
    }
}
