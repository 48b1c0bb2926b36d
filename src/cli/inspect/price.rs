//! What an effect costs, in words.

use super::text::{grouped, row, significant};
use crate::effect_cost::{EffectCost, EffectCosts, TimeCost};

/// The frames that were timed, as rows of a section.
pub(super) fn base(costs: &EffectCosts) -> Vec<Vec<String>> {
    let frame = format!(
        "{} ms with the scene's own effects (median of {}), {} ms with all effects on (of {})",
        significant(costs.frame_ms),
        costs.frames,
        significant(costs.frame_with_all_ms),
        costs.pairs_with_all
    );
    let [low_ms, high_ms] = costs.frame_ms_quartiles.map(significant);
    let steadiness = format!(
        "half of the frames with the scene's own effects took {low_ms} to {high_ms} ms: the nearer, the surer the prices"
    );
    let picture = format!(
        "{}x{} pixels, {} photons a frame",
        costs.width_px,
        costs.height_px,
        grouped(costs.photons as usize)
    );
    vec![
        row(["technique", costs.technique]),
        row(["picture", &picture]),
        row(["device", &costs.device]),
        row(["frame", &frame]),
        row(["steadiness", &steadiness]),
    ]
}

/// What an effect costs in a frame of so many ms, or what leaving it out saves.
pub(super) fn price(cost: &EffectCost, technique: &str, frame_ms: f64) -> String {
    let verb = if cost.on { "costs" } else { "saves" };
    let sharers = cost.shared_with.join(", ");
    let price = cost.time.as_ref();
    let price = price.map(|time| time_and_memory(time, cost, frame_ms));
    match (price, cost.shared_with.is_empty()) {
        (Some(price), true) => price,
        (Some(price), false) => {
            format!(
                "{verb} nothing by itself, as its work is done for {sharers} anyway; together: {price}"
            )
        }
        (None, false) => {
            format!("{verb} nothing by itself, as its work is done for {sharers} anyway")
        }
        (None, true) => {
            format!("{verb} nothing: `{technique}` has no pass or shader path for it in a still")
        }
    }
}

fn time_and_memory(time: &TimeCost, cost: &EffectCost, frame_ms: f64) -> String {
    let memory = match cost.bytes {
        Some(bytes) if bytes.abs() >= 1 << 16 => {
            format!(", {:.1} MiB", bytes as f64 / f64::from(1 << 20))
        }
        _ => String::new(),
    };
    if !time.is_told {
        let pairs = time.pairs;
        return format!("its time can't be told from nothing in {pairs} pairs{memory}");
    }
    // An effect may turn light away from costlier paths.
    let (verb, sign) = match (time.share < 0.0, cost.on) {
        (true, true) => ("without it a frame takes longer by", -1.0),
        (true, false) => ("with it a frame would take less by", -1.0),
        (false, true) => ("costs", 1.0),
        (false, false) => ("saves", 1.0),
    };
    let mut percent_quartiles = time.share_quartiles.map(|share| sign * 100.0 * share);
    percent_quartiles.sort_by(f64::total_cmp);
    let [percent_low, percent_high] = percent_quartiles.map(|percent| format!("{percent:.1}"));
    format!(
        "{verb} {:.1} % of a frame ({percent_low} to {percent_high}, {} pairs), {:.1} ms{memory}",
        sign * 100.0 * time.share,
        time.pairs,
        sign * frame_ms * time.share,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cost(on: bool, shared_with: Vec<&'static str>, time: Option<TimeCost>) -> EffectCost {
        EffectCost {
            effect: "indirect light",
            on,
            shared_with,
            time,
            bytes: Some(0),
        }
    }

    fn time(is_told: bool, share: f64) -> TimeCost {
        TimeCost {
            pairs: 7,
            is_told,
            share,
            share_quartiles: [share - 0.01, share + 0.01],
        }
    }

    /// In `pm-direct`, of a frame of 200 ms.
    fn said(cost: &EffectCost) -> String {
        price(cost, "pm-direct", 200.0)
    }

    #[test]
    fn a_price_is_told_in_percent_with_quartiles_and_in_ms_and_noise_as_nothing() {
        let words = |on, share| said(&cost(on, Vec::new(), Some(time(true, share))));
        let twelve = "12.0 % of a frame (11.0 to 13.0, 7 pairs), 24.0 ms";
        assert_eq!(words(true, 0.12), format!("costs {twelve}"));
        assert_eq!(words(false, 0.12), format!("saves {twelve}"));
        assert_eq!(
            words(true, -0.12),
            format!("without it a frame takes longer by {twelve}")
        );
        assert_eq!(
            words(false, -0.12),
            format!("with it a frame would take less by {twelve}")
        );
        let noise = cost(true, Vec::new(), Some(time(false, 0.005)));
        assert_eq!(
            said(&noise),
            "its time can't be told from nothing in 7 pairs"
        );
    }

    #[test]
    fn an_effect_that_costs_nothing_by_itself_says_why() {
        let caustics = || vec!["caustics"];
        let together = said(&cost(true, caustics(), Some(time(true, 0.12))));
        assert!(
            together.contains("as its work is done for caustics anyway; together: costs 12.0 %")
        );
        let off = said(&cost(false, caustics(), None));
        assert_eq!(
            off,
            "saves nothing by itself, as its work is done for caustics anyway"
        );
        let never = price(&cost(true, Vec::new(), None), "pm", 200.0);
        assert!(never.contains("`pm` has no pass or shader path for it"));
    }
}
