//! The parts of the page that need no script: headings and tables.

use std::io::{self, Write};

use super::statistics::{Spread, names_in_order};
use super::{Effect, Fact, Frame, Parameter, Report};

/// Text as HTML, in content and in quoted attributes.
pub(super) fn escape(text: &str) -> String {
    let mut html = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => html.push_str("&amp;"),
            '<' => html.push_str("&lt;"),
            '>' => html.push_str("&gt;"),
            '"' => html.push_str("&quot;"),
            '\'' => html.push_str("&#39;"),
            _ => html.push(c),
        }
    }
    html
}

/// What was shown, how many frames, how long, how fast.
pub(super) fn subtitle(report: &Report, out: &mut impl Write) -> io::Result<()> {
    let mut parts: Vec<String> = report.subtitle.iter().map(|part| escape(part)).collect();
    let [width, height] = report.picture_size;
    parts.push(format!("{width} × {height} per eye"));
    parts.push(match report.frames.as_slice() {
        [] => "no frames".into(),
        [_] => "1 frame".into(),
        frames @ [first, .., last] => {
            let span_ns = last.display_time_ns.saturating_sub(first.display_time_ns);
            format!(
                "{} frames over {:.2} s",
                frames.len(),
                span_ns as f64 * 1e-9
            )
        }
    });
    if let Some(spread) = Spread::of(report.frames.iter().map(frame_ms)) {
        parts.push(format!("median frame {} ms", milliseconds(spread.median)));
    }
    write!(out, "{}", parts.join("<span class=\"dot\"> · </span>"))
}

pub(super) fn warnings(warnings: &[String], out: &mut impl Write) -> io::Result<()> {
    if warnings.is_empty() {
        return Ok(());
    }
    write!(out, "<aside class=\"warnings\"><h2>Warnings</h2><ul>")?;
    for warning in warnings {
        write!(out, "<li>{}</li>", escape(warning))?;
    }
    write!(out, "</ul></aside>")
}

/// Time per pass over all frames.
pub(super) fn times(frames: &[Frame], out: &mut impl Write) -> io::Result<()> {
    let passes = names_in_order(frames.iter().map(|frame| {
        frame
            .pass_ms
            .iter()
            .map(|(name, _)| name.as_str())
            .collect()
    }));
    if passes.is_empty() {
        return write!(out, "<p class=\"none\">No passes were timed.</p>");
    }
    let all_ms: f64 = frames.iter().map(frame_ms).sum();
    write!(
        out,
        "<table class=\"numbers\"><thead><tr><th>pass</th><th>median, ms</th><th>95th, ms</th><th>max, ms</th><th>share</th></tr></thead><tbody>"
    )?;
    let mut row = |tag: &str, name: &str, values: &dyn Fn(&Frame) -> f64| -> io::Result<()> {
        let Some(spread) = Spread::of(frames.iter().map(values)) else {
            return Ok(());
        };
        let share = frames.iter().map(values).sum::<f64>() / all_ms.max(f64::MIN_POSITIVE);
        write!(
            out,
            "<tr{tag}><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td><td>{:.1}%</td></tr>",
            escape(name),
            milliseconds(spread.median),
            milliseconds(spread.p95),
            milliseconds(spread.max),
            100.0 * share
        )
    };
    for pass in passes {
        let of_pass = |frame: &Frame| -> f64 {
            let times = frame.pass_ms.iter().filter(|(name, _)| name == pass);
            times.map(|(_, ms)| ms).sum()
        };
        row("", pass, &of_pass)?;
    }
    row(" class=\"total\"", "frame", &frame_ms)?;
    write!(out, "</tbody></table>")
}

/// Gaze states and ages over all frames.
pub(super) fn gaze(frames: &[Frame], out: &mut impl Write) -> io::Result<()> {
    if frames.is_empty() {
        return write!(out, "<p class=\"none\">No frames.</p>");
    }
    write!(
        out,
        "<table class=\"numbers\"><thead><tr><th>gaze state</th><th>frames</th><th>share</th><th>median age, ms</th><th>95th, ms</th></tr></thead><tbody>"
    )?;
    let mut states: Vec<&str> = Vec::new();
    for frame in frames {
        if !states.contains(&frame.gaze_state.as_str()) {
            states.push(&frame.gaze_state);
        }
    }
    for state in states {
        let with_state = || frames.iter().filter(|frame| frame.gaze_state == state);
        let count = with_state().count();
        let ages = Spread::of(with_state().filter_map(|frame| frame.gaze_age_ms));
        let age =
            |pick: fn(Spread) -> f64| ages.map_or("–".into(), |a| format!("{:.1}", pick(a)));
        write!(
            out,
            "<tr><th scope=\"row\">{}</th><td>{count}</td><td>{:.1}%</td><td>{}</td><td>{}</td></tr>",
            escape(state),
            100.0 * count as f64 / frames.len() as f64,
            age(|a| a.median),
            age(|a| a.p95),
        )?;
    }
    write!(out, "</tbody></table>")
}

pub(super) fn effects(effects: &[Effect], out: &mut impl Write) -> io::Result<()> {
    let rows = effects.iter().map(|effect| {
        let (class, mark) = if effect.active {
            ("on", "on")
        } else {
            ("off", "off")
        };
        format!(
            "<tr class=\"{class}\"><th scope=\"row\">{}</th><td>{mark}</td><td>{}</td></tr>",
            escape(&effect.name),
            escape(&effect.why)
        )
    });
    table("effects", ["effect", "", "why"], rows, out)
}

pub(super) fn parameters(parameters: &[Parameter], out: &mut impl Write) -> io::Result<()> {
    let rows = parameters.iter().map(|parameter| {
        format!(
            "<tr><th scope=\"row\"><code>{}</code></th><td>{}</td><td>{}</td></tr>",
            escape(&parameter.key),
            escape(&parameter.value),
            escape(&parameter.unit)
        )
    });
    table("parameters", ["key", "value", "unit"], rows, out)
}

pub(super) fn provenance(facts: &[Fact], out: &mut impl Write) -> io::Result<()> {
    let rows = facts.iter().map(|fact| {
        format!(
            "<tr><th scope=\"row\">{}</th><td>{}</td></tr>",
            escape(&fact.name),
            escape(&fact.value)
        )
    });
    table("provenance", [], rows, out)
}

fn table<const N: usize>(
    class: &str,
    head: [&str; N],
    rows: impl Iterator<Item = String>,
    out: &mut impl Write,
) -> io::Result<()> {
    let body: String = rows.collect();
    if body.is_empty() {
        return write!(out, "<p class=\"none\">Nothing was recorded.</p>");
    }
    let cells: String = head.iter().map(|name| format!("<th>{name}</th>")).collect();
    let head = match N {
        0 => String::new(),
        _ => format!("<thead><tr>{cells}</tr></thead>"),
    };
    write!(
        out,
        "<table class=\"{class}\">{head}<tbody>{body}</tbody></table>"
    )
}

fn frame_ms(frame: &Frame) -> f64 {
    frame.pass_ms.iter().map(|(_, ms)| ms).sum()
}

/// Three significant digits or so, without a flicker of decimals.
fn milliseconds(ms: f64) -> String {
    match ms {
        ms if ms >= 100.0 => format!("{ms:.0}"),
        ms if ms >= 10.0 => format!("{ms:.1}"),
        ms if ms >= 1.0 => format!("{ms:.2}"),
        ms => format!("{ms:.3}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(write: impl Fn(&mut Vec<u8>) -> io::Result<()>) -> String {
        let mut html = Vec::new();
        write(&mut html).unwrap();
        String::from_utf8(html).unwrap()
    }

    #[test]
    fn the_time_table_sums_what_ran() {
        let frame = |trace, filter| Frame {
            pass_ms: vec![("trace".into(), trace), ("filter".into(), filter)],
            ..Frame::default()
        };
        let html = written(|out| times(&[frame(6.0, 2.0), frame(9.0, 3.0)], out));
        assert!(
            html.contains("trace</th><td>7.50</td><td>8.85</td><td>9.00</td><td>75.0%"),
            "{html}"
        );
        assert!(html.contains("frame</th><td>10.0</td>"), "{html}");
    }

    #[test]
    fn the_gaze_table_counts_states_and_ages() {
        let frame = |state: &str, age| Frame {
            gaze_state: state.into(),
            gaze_age_ms: age,
            ..Frame::default()
        };
        let frames = [
            frame("tracked", Some(4.0)),
            frame("tracked", Some(6.0)),
            frame("held", None),
        ];
        let html = written(|out| gaze(&frames, out));
        assert!(
            html.contains("tracked</th><td>2</td><td>66.7%</td><td>5.0</td>"),
            "{html}"
        );
        assert!(
            html.contains("held</th><td>1</td><td>33.3%</td><td>–</td>"),
            "{html}"
        );
    }
}
