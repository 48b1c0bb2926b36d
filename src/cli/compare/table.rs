//! What `compare` found, as tables for people.

use std::fmt::{Display, Formatter, Result};

use super::picture::{Judgement, Limits};
use super::sequence::SequenceJudgement;
use crate::metrics::Area;
use crate::metrics::error::{ErrorStats, Faults};

impl Display for Judgement {
    fn fmt(&self, f: &mut Formatter) -> Result {
        let comparison = &self.comparison;
        writeln!(
            f,
            "image      {}  {}x{}",
            self.image.display(),
            self.width,
            self.height
        )?;
        writeln!(f, "reference  {}", self.reference.display())?;
        match &self.reference_se {
            Some(path) => writeln!(f, "its noise  {}", path.display())?,
            None => writeln!(
                f,
                "its noise  not known: it is in every error (NAME.se.exr beside NAME.exr or --reference-se would tell it)"
            )?,
        }
        write_faults(f, comparison.faults)?;
        if let Some(black) = comparison.against_black {
            writeln!(
                f,
                "\nThe reference is black. Mean |value| {:.3e}, largest {:.3e}, {} pixels not black.",
                black.mean_absolute, black.max_absolute, black.nonzero_pixels
            )?;
        } else {
            let areas = comparison.areas();
            let blocks = comparison
                .block8
                .iter()
                .map(|blocks| ("8x8 blocks", blocks, None));
            let rows = areas
                .named()
                .map(|(name, area)| (name, &area.error, Some(area)));
            write_errors(f, &Vec::from_iter(rows.chain(blocks)))?;
            write_limits(f, self.limits)?;
            writeln!(
                f,
                "PSNR and SSIM are of display values at {:+.2} EV.",
                comparison.display_exposure_ev
            )?;
        }
        if let Some(flip) = &self.flip {
            writeln!(f, "FLIP {flip}.")?;
        }
        if let Some(verdict) = &self.fovvideovdp {
            writeln!(f, "FovVideoVDP {verdict}.")?;
        }
        Ok(())
    }
}

impl Display for SequenceJudgement {
    fn fmt(&self, f: &mut Formatter) -> Result {
        writeln!(
            f,
            "image      {}  {} frames of {}x{}",
            self.image.display(),
            self.frames,
            self.width,
            self.height
        )?;
        writeln!(f, "reference  {}", self.reference.display())?;
        match self.frames_with_reference_se {
            0 => writeln!(
                f,
                "its noise  not known: it is in every error (NAME.se.exr beside NAME.exr would tell it)"
            )?,
            known if known == self.frames => writeln!(f, "its noise  known of {known} frames")?,
            known => writeln!(
                f,
                "its noise  known of {known} of {} frames: means that need it are told only where all their frames have it",
                self.frames
            )?,
        }
        write_faults(f, self.faults)?;
        if self.frames_against_black > 0 {
            writeln!(
                f,
                "black      {} references: their frames are in the changes only",
                self.frames_against_black
            )?;
        }
        let areas = self.areas.named().filter_map(|(name, area)| {
            let area = area.area.as_ref()?;
            Some((name, &area.error, Some(area)))
        });
        write_errors(f, &Vec::from_iter(areas))?;
        writeln!(
            f,
            "Means over frames; PSNR is that of the mean squared error."
        )?;
        self.write_changes(f)?;
        self.write_stereo(f)?;
        writeln!(f)?;
        write_limits(f, self.limits)
    }
}

impl SequenceJudgement {
    fn write_changes(&self, f: &mut Formatter) -> Result {
        let known = self
            .areas
            .named()
            .filter_map(|(name, area)| Some((name, area.temporal?)));
        let known = Vec::from_iter(known);
        if known.is_empty() {
            return Ok(());
        }
        writeln!(
            f,
            "\n{:<11}{:>10}  {:>10}  {:>10}  {:>10}",
            "change", "MSE'", "reference", "flicker", "ref. noise"
        )?;
        for (name, change) in known {
            writeln!(
                f,
                "{name:<11}{:>10.3e}  {:>10.3e}  {:>10.3e}  {:>10}",
                change.temporal_mse,
                change.temporal_mse_reference,
                change.temporal_mse_error,
                optional(change.temporal_mse_reference_noise, |x| format!("{x:.3e}"))
            )?;
        }
        writeln!(
            f,
            "Mean squared change from one frame to the next: of the frames, of the reference, and of the error; what the reference's noise adds\n\
             to the last two if its frames are independent."
        )
    }

    fn write_stereo(&self, f: &mut Formatter) -> Result {
        let Some(stereo) = &self.stereo else {
            return Ok(());
        };
        writeln!(
            f,
            "\n{:<11}{:>10}  {:>10}  {:>6}  {:>10}  {:^23}",
            "eyes", "disagree", "error", "share", "ref. noise", "left/right R, G, B"
        )?;
        for (name, eyes) in stereo.named() {
            let [r, g, b] = eyes
                .left_right_ratio
                .map(|ratio| optional(ratio, |x| format!("{x:.4}")));
            writeln!(
                f,
                "{name:<11}{:>10.3e}  {:>10.3e}  {:>6}  {:>10}  {r:>7} {g:>7} {b:>7}",
                eyes.disagreement_mse,
                eyes.block_mse,
                optional(eyes.disagreement_share, |x| format!("{x:.3}")),
                optional(eyes.reference_disagreement_mse, |x| format!("{x:.3e}")),
            )?;
        }
        let place = match self.limits {
            Some(_) => "at the same direction from each eye's gaze",
            None => "at the same place in both pictures (the gaze is not known)",
        };
        writeln!(
            f,
            "Mean squares over 8x8 blocks {place}: left error less right error, and the error itself; share: 0 the eyes err\n\
             alike, 1 independently, 2 opposed. left/right: brightness of one eye over the other's, over that of the references."
        )
    }
}

fn write_faults(f: &mut Formatter, faults: Faults) -> Result {
    writeln!(
        f,
        "faults     {} NaN, {} infinite, {} negative channel values",
        faults.nan, faults.infinite, faults.negative
    )
}

fn write_limits(f: &mut Formatter, limits: Option<Limits>) -> Result {
    let Some(limits) = limits else {
        return Ok(());
    };
    writeln!(
        f,
        "Regions by angle from the gaze: fovea to {:.2} degrees, transition to {:.2}.",
        limits.fovea_limit_rad.to_degrees(),
        limits.transition_limit_rad.to_degrees()
    )
}

/// A row: its name, its errors and, if it has them, its display metrics.
type Row<'a> = (&'static str, &'a ErrorStats, Option<&'a Area>);

/// Bias and errors, and what the reference's noise means for them.
fn write_errors(f: &mut Formatter, rows: &[Row]) -> Result {
    writeln!(
        f,
        "\n{:<11}{:>8}  {:^32}  {:^26}  {:^23}  {:>11}",
        "bias",
        "pixels",
        "difference R, G, B, W/(m2 sr)",
        "standard error",
        "mean ratio R, G, B",
        "NaN/inf/neg"
    )?;
    for (name, error, area) in rows {
        let [r, g, b] = error.bias.map(|bias| format!("{bias:+.3e}"));
        write!(f, "{name:<11}{:>8}  {r:>10} {g:>10} {b:>10}", error.pixels)?;
        let sure = error.reference_noise.map(|noise| noise.bias_standard_error);
        let [r, g, b] =
            std::array::from_fn(|i| optional(sure.map(|se| se[i]), |x| format!("{x:.1e}")));
        write!(f, "  {r:>8} {g:>8} {b:>8}")?;
        let [r, g, b] = error
            .mean_ratio
            .map(|ratio| optional(ratio, |x| format!("{x:.4}")));
        write!(f, "  {r:>7} {g:>7} {b:>7}")?;
        match area.map(|area| area.faults) {
            Some(Faults {
                nan,
                infinite,
                negative,
            }) => {
                writeln!(f, "  {:>11}", format!("{nan}/{infinite}/{negative}"))?;
            }
            None => writeln!(f)?,
        }
    }
    writeln!(
        f,
        "\n{:<11}{:>9}  {:>9}  {:>9}  {:>9}  {:>10}  {:>9}  {:>7}  {:>7}  {:>6}  {:>6}",
        "error",
        "MSE",
        "less ref.",
        "relMSE",
        "ref. noise",
        "less ref.",
        "trimmed",
        "p50",
        "p95",
        "PSNR",
        "SSIM"
    )?;
    for (name, error, area) in rows {
        write_error_row(f, name, error)?;
        match area {
            Some(area) => writeln!(
                f,
                "  {:>6}  {:>6}",
                area.psnr_db
                    .map_or("inf".into(), |value| format!("{value:.1}")),
                optional(area.ssim, |value| format!("{value:.4}"))
            )?,
            None => writeln!(f)?,
        }
    }
    writeln!(
        f,
        "\nrelMSE: mean of (c-r)²/(r²+eps²), eps 1% of the reference's mean; ref. noise: what of it is the reference's own; less ref.: without that\n\
         (`<`: too small for this reference to tell from none); trimmed: without the worst 0.1% of pixels; p50, p95 of |c-r|/sqrt(r²+eps²)."
    )?;
    let psnr = rows
        .iter()
        .find_map(|(_, _, area)| area.as_ref()?.reference_psnr_db);
    match psnr {
        Some(psnr) => writeln!(
            f,
            "The reference's own noise stands at a PSNR of {psnr:.1} dB; PSNR and SSIM have it in them."
        ),
        None => Ok(()),
    }
}

fn write_error_row(f: &mut Formatter, name: &str, error: &ErrorStats) -> Result {
    let noise = error.reference_noise;
    let less = |value: Option<f64>, limit: Option<f64>| match value.zip(limit) {
        Some((value, limit)) if value < limit => format!("<{limit:.2e}"),
        _ => optional(value, |x| format!("{x:.3e}")),
    };
    write!(
        f,
        "{name:<11}{:>9.3e}  {:>9}  {:>9.3e}  {:>10}  {:>9}  {:>9.3e}  {:>7.4}  {:>7.4}",
        error.mse,
        less(error.mse_corrected, noise.map(|noise| noise.detectable_mse)),
        error.relmse,
        optional(noise.map(|noise| noise.reference_relmse), |x| format!(
            "{x:.3e}"
        )),
        less(
            error.relmse_corrected,
            noise.map(|noise| noise.detectable_relmse)
        ),
        error.relmse_trimmed,
        error.relative_error_p50,
        error.relative_error_p95,
    )
}

fn optional<T>(value: Option<T>, show: impl Fn(T) -> String) -> String {
    value.map_or_else(|| "-".to_owned(), show)
}
