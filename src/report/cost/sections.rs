//! The parts of the page that need no script.

use std::io::{self, Write};

use super::super::tables::escape;
use super::{Comparison, Crop, PlotPoint};

/// What was measured.
pub(super) fn subtitle(parts: &[String], out: &mut impl Write) -> io::Result<()> {
    let parts: Vec<String> = parts.iter().map(|part| escape(part)).collect();
    write!(out, "{}", parts.join("<span class=\"dot\"> · </span>"))
}

/// What follows.
pub(super) fn sentences(
    paragraphs: &[(String, Vec<String>)],
    out: &mut impl Write,
) -> io::Result<()> {
    write!(out, "<div class=\"said\">")?;
    for (heading, sentences) in paragraphs {
        write!(out, "<section><h2>{}</h2><ul>", escape(heading))?;
        for sentence in sentences {
            write!(out, "<li>{}</li>", escape(sentence))?;
        }
        write!(out, "</ul></section>")?;
    }
    write!(out, "</div>")
}

/// What to do next.
pub(super) fn next(steps: &[(String, String)], out: &mut impl Write) -> io::Result<()> {
    if steps.is_empty() {
        return Ok(());
    }
    write!(out, "<section class=\"next\"><h2>What to do next</h2><dl>")?;
    for (what, command) in steps {
        let (what, command) = (escape(what), escape(command));
        write!(out, "<dt>{what}</dt><dd><code>{command}</code></dd>")?;
    }
    write!(out, "</dl></section>")
}

/// Pictures beside the reference.
pub(super) fn crops(crops: &[Crop], out: &mut impl Write) -> io::Result<()> {
    if crops.is_empty() {
        return write!(out, "<p class=\"none\">No pictures were kept.</p>");
    }
    write!(out, "<div class=\"crops\">")?;
    for crop in crops {
        let (name, caption) = (escape(&crop.name), escape(&crop.caption));
        write!(
            out,
            "<figure class=\"crop\"><img alt=\"{name}: the fovea\" src=\"{}\">",
            crop.picture.data_uri()
        )?;
        match &crop.error {
            Some(error) => write!(
                out,
                "<img alt=\"{name}: where it is wrong\" src=\"{}\">",
                error.data_uri()
            )?,
            None => write!(
                out,
                "<div class=\"scale\" aria-hidden=\"true\"><i></i><span>right</span><span>wrong by half the value, or more</span></div>"
            )?,
        }
        write!(
            out,
            "<figcaption><b>{name}</b><br>{caption}</figcaption></figure>"
        )?;
    }
    write!(out, "</div>")
}

/// Techniques at one level.
pub(super) fn comparisons(comparisons: &[Comparison], out: &mut impl Write) -> io::Result<()> {
    for comparison in comparisons {
        write!(
            out,
            "<section><h2>{}</h2><table class=\"numbers\"><thead><tr><th>technique</th><th>frame, ms</th><th>foveal error</th><th>{}</th>\
             <th class=\"words\">setting</th></tr></thead><tbody>",
            escape(&comparison.name),
            escape(&comparison.ratio_name)
        )?;
        for [technique, ms, error, ratio, setting] in &comparison.rows {
            write!(
                out,
                "<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td><td class=\"words\">{}</td></tr>",
                escape(technique),
                escape(ms),
                escape(error),
                escape(ratio),
                escape(setting)
            )?;
        }
        write!(out, "</tbody></table></section>")?;
    }
    Ok(())
}

/// What the points have in common.
pub(super) fn shared(params: &str, out: &mut impl Write) -> io::Result<()> {
    match params {
        "" => Ok(()),
        _ => write!(
            out,
            "<p class=\"reading params\">The same at all points: {}.</p>",
            escape(params)
        ),
    }
}

/// All points; the script makes the heads sort.
pub(super) fn points(points: &[PlotPoint], out: &mut impl Write) -> io::Result<()> {
    const HEADS: [&str; 12] = [
        "technique",
        "size",
        "paths of a pass",
        "passes",
        "frame, ms",
        "scatter",
        "foveal error",
        "of it bias",
        "MSE fovea",
        "MSE transition",
        "MSE periphery",
        "other parameters",
    ];
    write!(out, "<table class=\"numbers sortable\"><thead><tr>")?;
    for head in HEADS {
        let class = if head == "other parameters" {
            " class=\"words\""
        } else {
            ""
        };
        write!(out, "<th scope=\"col\"{class}>{head}</th>")?;
    }
    write!(out, "</tr></thead><tbody>")?;
    for point in points {
        let class = match (point.is_chosen, point.on_front) {
            (true, _) => " class=\"chosen\"",
            (false, true) => " class=\"front\"",
            (false, false) => "",
        };
        let scatter = (point.quartiles_ms[1] - point.quartiles_ms[0]) / point.ms;
        write!(
            out,
            "<tr{class}><th scope=\"row\">{}</th><td>{}</td><td data-value=\"{}\">{}</td><td>{}</td>",
            escape(&point.technique),
            escape(&point.size),
            point.effort,
            escape(&point.paths),
            point.passes
        )?;
        number(Some(point.ms), |ms| format!("{ms:.1}"), out)?;
        number(
            Some(scatter),
            |share| format!("{:.0} %", 100.0 * share),
            out,
        )?;
        number(point.relmse_fovea, scientific, out)?;
        number(
            Some(point.bias_share),
            |share| format!("{:.0} %", 100.0 * share),
            out,
        )?;
        for error in [point.mse_fovea, point.mse_transition, point.mse_periphery] {
            number(error, scientific, out)?;
        }
        write!(
            out,
            "<td class=\"words\">{}</td></tr>",
            escape(&point.others)
        )?;
    }
    write!(out, "</tbody></table>")
}

/// A cell that sorts by its value; empty where there is none.
fn number(
    value: Option<f64>,
    text: impl Fn(f64) -> String,
    out: &mut impl Write,
) -> io::Result<()> {
    match value {
        Some(value) => write!(out, "<td data-value=\"{value:e}\">{}</td>", text(value)),
        None => write!(out, "<td>–</td>"),
    }
}

fn scientific(value: f64) -> String {
    match value.abs() {
        0.001..1000.0 => format!("{value:.4}"),
        _ => format!("{value:.2e}"),
    }
}
