//! The page of `macula cost`, filled from what was found.

use std::collections::BTreeMap;

use super::super::CliError;
use crate::cost::fit;
use crate::cost::judge::Judge;
use crate::cost::level::Goal;
use crate::cost::point::{Point, grouped};
use crate::cost::reference::Origin;
use crate::cost::resample::resample;
use crate::cost::sentences::number;
use crate::cost::setting;
use crate::cost::store::Store;
use crate::cost::table::{Budget, Comparison, Outcome};
use crate::image::{LinearImage, png};
use crate::metrics::ssim::luminance;
use crate::report::cost::{self, CostPage, Crop, PlotPoint};
use crate::report::{Fact, Picture};
use crate::technique;

/// What the mean luminance of the fovea is exposed to: middle grey.
const DISPLAY_KEY: f64 = 0.18;
/// The relative error that is shown brightest.
const WORST_SHOWN: f64 = 0.5;
/// From no error to the worst that is shown: dark to bright, also without colours.
const ERROR_COLORS: [[f64; 3]; 5] = [
    [0.0, 0.0, 4.0],
    [87.0, 16.0, 110.0],
    [188.0, 55.0, 84.0],
    [249.0, 142.0, 9.0],
    [252.0, 255.0, 164.0],
];

/// The page; `next` are things to do and their commands.
///
/// # Errors
/// A kept frame can't be read.
pub(super) fn of(
    outcome: &Outcome,
    next: Vec<(String, String)>,
    store: &Store,
    judge: &Judge,
) -> Result<CostPage, CliError> {
    let mut points: Vec<&Point> = outcome.points.iter().collect();
    points.sort_by(|a, b| a.frame_ms().total_cmp(&b.frame_ms()));
    let study = &outcome.study;
    let shared = setting::shared(&outcome.points);
    let mut subtitle = vec![
        format!("scene {}", outcome.scene),
        format!(
            "{} points of {}",
            points.len(),
            fit::techniques(&outcome.points).join(", ")
        ),
        format!("judged at {}", study.reference_size),
        format!("gaze {}°, {}°", study.gaze_deg[0], study.gaze_deg[1]),
    ];
    if !outcome.complete {
        subtitle.push("stopped early: not everything that was asked for".into());
    }
    Ok(CostPage {
        title: outcome.title.clone(),
        subtitle,
        sentences: outcome
            .sentences
            .iter()
            .map(|paragraph| (paragraph.heading.clone(), paragraph.sentences.clone()))
            .collect(),
        next,
        warnings: outcome.warnings.clone(),
        techniques: technique::REGISTRY
            .iter()
            .map(|entry| entry.name.into())
            .collect(),
        points: points
            .iter()
            .map(|point| plotted(point, outcome, &shared))
            .collect(),
        shared: listed(&shared, |_| true),
        budget_ms: outcome.budget.as_ref().map(|budget| budget.budget_ms),
        crops: crops(outcome, store, judge)?,
        comparisons: outcome.comparisons.iter().map(comparison).collect(),
        facts: facts(outcome),
    })
}

fn is_chosen(point: &Point, budget: Option<&Budget>) -> bool {
    budget.is_some_and(|budget| budget.point == point.key)
}

/// Parameters as text, but for the paths, which have a column of their own.
fn listed(params: &BTreeMap<String, String>, is_wanted: impl Fn(&str) -> bool) -> String {
    let said = ["photon.count", "path.samples"];
    let wanted = |key: &str| !said.contains(&key) && is_wanted(key);
    let texts = params.iter().filter(|(key, _)| wanted(key));
    let texts: Vec<String> = texts
        .map(|(key, value)| format!("{key} = {value}"))
        .collect();
    texts.join(", ")
}

fn plotted(point: &Point, outcome: &Outcome, shared: &BTreeMap<String, String>) -> PlotPoint {
    let error = &point.error;
    let fovea = error.fovea.unwrap_or_default();
    PlotPoint {
        technique: point.technique.clone(),
        label: point.label(),
        size: point.size.to_string(),
        paths: match point.photons {
            Some(photons) => format!("{} photons", grouped(photons)),
            None => format!("{} a pixel", grouped(point.effort)),
        },
        effort: point.effort,
        passes: point.passes,
        others: listed(&point.changed, |key| !shared.contains_key(key)),
        ms: point.frame_ms(),
        quartiles_ms: [point.time.q25_ms, point.time.q75_ms],
        relmse_fovea: error.fovea.map(|_| point.relmse()),
        relmse_fovea_se: fovea.relmse_standard_error,
        bias_share: fovea.bias_share(),
        mse_fovea: error.fovea.map(|region| region.mse),
        mse_transition: error.transition.map(|region| region.mse),
        mse_periphery: error.periphery.map(|region| region.mse),
        pass_ms: point.time.pass_ms.clone(),
        on_front: outcome.front.contains(&point.key),
        is_chosen: is_chosen(point, outcome.budget.as_ref()),
    }
}

fn comparison(comparison: &Comparison) -> cost::Comparison {
    let (name, ratio_name) = match comparison.goal {
        Goal::Relmse(error) => (
            format!("Techniques at a foveal error of {}", number(error)),
            "times the fastest",
        ),
        Goal::FrameMs(ms) => (
            format!("Techniques at {} ms a frame", number(ms)),
            "times the least error",
        ),
    };
    let row = |level: &crate::cost::level::Level| {
        let ratio = level.ratio.map_or("not reached".into(), number);
        [
            level.technique.clone(),
            number(level.frame_ms),
            number(level.relmse),
            ratio,
            level.label.clone(),
        ]
    };
    cost::Comparison {
        name,
        ratio_name: ratio_name.into(),
        rows: comparison.levels.iter().map(row).collect(),
    }
}

/// The reference and up to four points: the chosen one, and the front's ends and middle.
fn crops(outcome: &Outcome, store: &Store, judge: &Judge) -> Result<Vec<Crop>, CliError> {
    let front = fit::front(&outcome.points);
    let chosen = outcome.points.iter();
    let chosen = chosen.filter(|point| is_chosen(point, outcome.budget.as_ref()));
    let middle = front.get(front.len() / 2);
    let candidates = [
        ("fastest", front.first()),
        ("between", middle),
        ("most accurate", front.last()),
    ];
    let mut picked: Vec<(&str, &Point)> = chosen
        .map(|point| ("chosen for the budget", point))
        .collect();
    for (name, point) in candidates {
        if let Some(point) = point
            && picked.iter().all(|(_, other)| other.key != point.key)
        {
            picked.push((name, point));
        }
    }
    picked.sort_by(|a, b| a.1.frame_ms().total_cmp(&b.1.frame_ms()));
    let frame = Frame::around_fovea(judge);
    let reference = &judge.reference().image;
    let caption = match &outcome.reference {
        Origin::File { .. } => "the file that was given".to_owned(),
        Origin::Oracle { samples, seconds } => {
            format!("path tracing, {samples} paths a pixel in {seconds} s")
        }
    };
    let mut crops = vec![Crop {
        name: "reference".into(),
        caption,
        picture: frame.picture(reference)?,
        error: None,
    }];
    for (name, point) in picked {
        let image = store.frame(&point.key)?;
        let image = resample(&image, reference.width, reference.height);
        crops.push(Crop {
            name: name.into(),
            caption: format!(
                "{} ms, foveal error {}: {}",
                number(point.frame_ms()),
                number(point.relmse()),
                point.label()
            ),
            picture: frame.picture(&image)?,
            error: Some(frame.error(&image, judge)?),
        });
    }
    Ok(crops)
}

/// The part of a picture that is shown, and how bright.
struct Frame {
    left: u32,
    top: u32,
    width: u32,
    height: u32,
    exposure_ev: f32,
}

impl Frame {
    /// The box around the fovea, with a margin.
    fn around_fovea(judge: &Judge) -> Self {
        let size = judge.size();
        let columns = || judge.fovea().iter().map(|&pixel| pixel as u32 % size.width);
        let rows = || judge.fovea().iter().map(|&pixel| pixel as u32 / size.width);
        // A judge has at least one pixel of fovea.
        let range = |values: &mut dyn Iterator<Item = u32>, side: u32| {
            let (low, high) =
                values.fold((side - 1, 0), |(low, high), v| (low.min(v), high.max(v)));
            let margin = (high - low) / 4 + 1;
            (low.saturating_sub(margin), (high + margin).min(side - 1))
        };
        let (left, right) = range(&mut columns(), size.width);
        let (top, bottom) = range(&mut rows(), size.height);
        let reference = &judge.reference().image.rgb;
        let light: f64 = judge
            .fovea()
            .iter()
            .map(|&pixel| luminance(reference[pixel]))
            .sum();
        let mean = light / judge.fovea().len() as f64;
        Self {
            left,
            top,
            width: right - left + 1,
            height: bottom - top + 1,
            exposure_ev: (DISPLAY_KEY / mean.max(f64::MIN_POSITIVE)).log2() as f32,
        }
    }

    fn pixels(&self, width: u32) -> impl Iterator<Item = usize> {
        let (left, columns) = (self.left, self.width);
        (self.top..self.top + self.height).flat_map(move |row| {
            (left..left + columns).map(move |column| (row * width + column) as usize)
        })
    }

    fn picture(&self, image: &LinearImage) -> Result<Picture, CliError> {
        let part = LinearImage {
            width: self.width,
            height: self.height,
            rgb: self
                .pixels(image.width)
                .map(|pixel| image.rgb[pixel])
                .collect(),
        };
        let rgb = png::to_rgb8(&part, self.exposure_ev);
        Ok(Picture::png_of(self.width, self.height, &rgb)?)
    }

    /// Relative errors, the mean over channels, in colours.
    fn error(&self, image: &LinearImage, judge: &Judge) -> Result<Picture, CliError> {
        let reference = &judge.reference().image.rgb;
        let rgb: Vec<u8> = self
            .pixels(image.width)
            .flat_map(|pixel| {
                let channels = image.rgb[pixel].iter().zip(reference[pixel]);
                let relative = channels.map(|(value, reference)| {
                    let reference = f64::from(reference);
                    (f64::from(*value) - reference).abs() / reference.hypot(judge.epsilon())
                });
                error_color(relative.sum::<f64>() / 3.0)
            })
            .collect();
        Ok(Picture::png_of(self.width, self.height, &rgb)?)
    }
}

fn error_color(relative: f64) -> [u8; 3] {
    let last = ERROR_COLORS.len() - 1;
    // Frames may hold values that are no numbers: as wrong as can be.
    let shown = if relative.is_nan() {
        WORST_SHOWN
    } else {
        relative
    };
    let place = (shown / WORST_SHOWN).clamp(0.0, 1.0) * last as f64;
    let below = (place.floor() as usize).min(last - 1);
    let share = place - below as f64;
    let mix = |channel: usize| {
        let (from, to) = (
            ERROR_COLORS[below][channel],
            ERROR_COLORS[below + 1][channel],
        );
        (from + share * (to - from)).round() as u8
    };
    [mix(0), mix(1), mix(2)]
}

fn facts(outcome: &Outcome) -> Vec<Fact> {
    let machine = &outcome.machine;
    let timed = match machine.is_software {
        true => "by the wall clock, waiting between passes (a software device)",
        false => "by the device's timestamps",
    };
    let fact = |name: &str, value: String| Fact {
        name: name.into(),
        value,
    };
    let mut facts = vec![
        fact("device", machine.device.clone()),
        fact("driver", machine.driver.clone()),
        fact("timed", timed.into()),
    ];
    facts.extend(
        machine
            .processor
            .clone()
            .map(|name| fact("processor", name)),
    );
    facts.push(fact("threads", machine.threads.to_string()));
    facts.push(fact("system", machine.system.clone()));
    facts.push(fact(
        "drift",
        match outcome.drift.range() {
            Some(range) => format!(
                "{} % between the fastest and the slowest of {} timings of one setting through the run",
                number((100.0 * range).round()),
                outcome.drift.anchor_ms.len()
            ),
            None => "not known: nothing was timed twice".into(),
        },
    ));
    facts.push(fact(
        "points",
        format!(
            "{}, of which {} were measured by an earlier run",
            outcome.points.len(),
            outcome.reused
        ),
    ));
    facts.push(fact(
        "reference",
        match &outcome.reference {
            Origin::File { sha256 } => format!("a file, SHA-256 {sha256}"),
            Origin::Oracle { samples, seconds } => {
                format!("the oracle: {samples} paths a pixel in {seconds} s")
            }
        },
    ));
    let [fovea, transition] = outcome.study.regions_deg;
    facts.push(fact(
        "regions",
        format!("fovea to {fovea:.2}°, transition to {transition:.2}°"),
    ));
    facts.push(fact("scene, SHA-256", outcome.study.scene_sha256.clone()));
    facts.push(fact("macula", env!("CARGO_PKG_VERSION").into()));
    facts
}
