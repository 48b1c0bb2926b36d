//! What an effect costs, in words.

use super::text::{grouped, row, significant};
use crate::effect_cost::{EffectCost, EffectCosts, TimeCost};

/// The frames that were timed, as rows of a section.
pub(super) fn base(costs: &EffectCosts) -> Vec<Vec<String>> {
    let frame = format!(
        "{} ms with the scene's own effects, {} ms with all effects on (medians, {} pairs of frames)",
        significant(costs.frame_ms),
        significant(costs.frame_with_all_ms),
        costs.pairs_with_all
    );
    let [fastest_ms, slowest_ms] = costs.frame_ms_range.map(significant);
    let steadiness = format!(
        "{fastest_ms} to {slowest_ms} ms beside each of the effects: the nearer, the steadier the machine was, and the surer the prices"
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
        row(["its median", &steadiness]),
    ]
}

/// What an effect costs, or what leaving it out saves.
pub(super) fn price(cost: &EffectCost, technique: &str) -> String {
    let verb = if cost.on { "costs" } else { "saves" };
    let sharers = cost.shared_with.join(", ");
    let price = cost.time.as_ref().map(|time| time_and_memory(time, cost));
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

fn time_and_memory(time: &TimeCost, cost: &EffectCost) -> String {
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
    let (verb, sign) = match (time.ms < 0.0, cost.on) {
        (true, true) => ("without it a frame takes longer by", -1.0),
        (true, false) => ("with it a frame would take less by", -1.0),
        (false, true) => ("costs", 1.0),
        (false, false) => ("saves", 1.0),
    };
    let mut ms_quartiles = time.ms_quartiles.map(|ms| sign * ms);
    let mut percent_quartiles = time.share_quartiles.map(|share| sign * 100.0 * share);
    ms_quartiles.sort_by(f64::total_cmp);
    percent_quartiles.sort_by(f64::total_cmp);
    let [ms_low, ms_high] = ms_quartiles.map(|ms| format!("{ms:.1}"));
    let [percent_low, percent_high] = percent_quartiles.map(|percent| format!("{percent:.1}"));
    format!(
        "{verb} {:.1} ms ({ms_low} to {ms_high}), {:.1} % of a frame ({percent_low} to {percent_high}), {} pairs{memory}",
        sign * time.ms,
        sign * 100.0 * time.share,
        time.pairs,
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

    fn time(is_told: bool, ms: f64) -> TimeCost {
        TimeCost {
            pairs: 5,
            is_told,
            ms,
            ms_quartiles: [ms - 1.0, ms + 1.0],
            share: ms / 100.0,
            share_quartiles: [ms / 100.0 - 0.01, ms / 100.0 + 0.01],
        }
    }

    #[test]
    fn a_price_is_told_in_ms_and_percent_with_quartiles_and_noise_as_nothing() {
        let words = |on, ms| price(&cost(on, Vec::new(), Some(time(true, ms))), "pm-direct");
        let twelve = "12.0 ms (11.0 to 13.0), 12.0 % of a frame (11.0 to 13.0), 5 pairs";
        assert_eq!(words(true, 12.0), format!("costs {twelve}"));
        assert_eq!(words(false, 12.0), format!("saves {twelve}"));
        assert_eq!(
            words(true, -12.0),
            format!("without it a frame takes longer by {twelve}")
        );
        let noise = cost(true, Vec::new(), Some(time(false, 0.5)));
        let noise = price(&noise, "pm-direct");
        assert_eq!(noise, "its time can't be told from nothing in 5 pairs");
    }

    #[test]
    fn an_effect_that_costs_nothing_by_itself_says_why() {
        let caustics = || vec!["caustics"];
        let together = price(&cost(true, caustics(), Some(time(true, 12.0))), "pm-direct");
        assert!(
            together.contains("as its work is done for caustics anyway; together: costs 12.0 ms")
        );
        let off = price(&cost(false, caustics(), None), "pm-direct");
        assert_eq!(
            off,
            "saves nothing by itself, as its work is done for caustics anyway"
        );
        let never = price(&cost(true, Vec::new(), None), "pm");
        assert!(never.contains("`pm` has no pass or shader path for it"));
    }
}
