//! What the page's script reads: one JSON block.

use std::collections::HashMap;
use std::io::{self, Write};

use serde_json::{Value, json};

use super::statistics::names_in_order;
use super::{Eye, Frame, OutlinedRegion, Report};

/// Writes the data with every `<` as `\u003c`: in JSON that is the same text, and no name can end the block.
pub(super) fn write(report: &Report, out: &mut impl Write) -> io::Result<()> {
    let frames = &report.frames;
    let passes = names_in_order(frames.iter().map(|frame| names(&frame.pass_ms)));
    let counts = names_in_order(frames.iter().map(|frame| names(&frame.counts)));
    let start_ns = frames.first().map_or(0, |frame| frame.display_time_ns);
    let head = json!({
        "picture_size": report.picture_size,
        "passes": &passes,
        "counts": &counts,
    });
    // One frame a line, written as it is made: the block is never whole in memory.
    write!(out, "{{\"report\":{},\"frames\":[", escaped(&head))?;
    for (i, frame) in frames.iter().enumerate() {
        let separator = if i == 0 { "" } else { "," };
        let frame = frame_data(frame, start_ns, &passes, &counts);
        write!(out, "{separator}\n{}", escaped(&frame))?;
    }
    write!(out, "]}}")
}

/// A value as JSON that can stand in a script block.
pub(super) fn escaped(value: &Value) -> String {
    value.to_string().replace('<', "\\u003c")
}

fn names<T>(pairs: &[(String, T)]) -> Vec<&str> {
    pairs.iter().map(|(name, _)| name.as_str()).collect()
}

fn frame_data(frame: &Frame, start_ns: i64, passes: &[&str], counts: &[&str]) -> Value {
    let pass_ms: HashMap<&str, f64> = frame
        .pass_ms
        .iter()
        .map(|(n, ms)| (n.as_str(), *ms))
        .collect();
    let count: HashMap<&str, u64> = frame.counts.iter().map(|(n, c)| (n.as_str(), *c)).collect();
    // Subtracted in integers: nanoseconds since boot do not fit a float.
    let time_s = frame.display_time_ns.saturating_sub(start_ns) as f64 * 1e-9;
    json!({
        "index": frame.index,
        "time_s": rounded(time_s, 6),
        "state": frame.gaze_state,
        "age_ms": frame.gaze_age_ms.map(|age| rounded(age, 3)),
        "angles_deg": frame.gaze_angles_deg.map(|angles| angles.map(|angle| rounded(angle, 3))),
        "pass_ms": passes.iter().map(|name| pass_ms.get(name).map(|ms| rounded(*ms, 4))).collect::<Vec<_>>(),
        "counts": counts.iter().map(|name| count.get(name)).collect::<Vec<_>>(),
        "eyes": frame.eyes.each_ref().map(eye_data),
    })
}

fn eye_data(eye: &Eye) -> Value {
    let point = |uv: &[f32; 2]| uv.map(|x| rounded(f64::from(x), 4));
    let outlines = eye.outlines.iter().map(|outline| {
        let region = match outline.region {
            OutlinedRegion::Fovea => "fovea",
            OutlinedRegion::Transition => "transition",
        };
        let points = outline
            .points_uv
            .iter()
            .filter(|uv| uv.iter().all(|x| x.is_finite()));
        json!({ "region": region, "points": points.map(point).collect::<Vec<_>>() })
    });
    json!({
        "picture": eye.picture.is_some(),
        "gaze": eye.gaze_uv.filter(|uv| uv.iter().all(|x| x.is_finite())).as_ref().map(point),
        "outlines": outlines.collect::<Vec<_>>(),
    })
}

/// To `digits` decimals: what a plot can show, and no more bytes.
fn rounded(value: f64, digits: i32) -> f64 {
    let scale = 10_f64.powi(digits);
    (value * scale).round() / scale
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_block_is_json_with_the_frames_aligned_to_the_passes() {
        let frame = |index, time, passes: &[(&str, f64)]| Frame {
            index,
            display_time_ns: time,
            pass_ms: passes.iter().map(|(n, ms)| (n.to_string(), *ms)).collect(),
            gaze_age_ms: Some(f64::NAN),
            ..Frame::default()
        };
        let start = 9_007_199_254_740_993;
        let report = Report {
            frames: vec![
                frame(3, start, &[("trace", 1.0)]),
                frame(4, start + 11_111_111, &[("trace", 2.0), ("filter", 0.5)]),
            ],
            ..Report::default()
        };
        let mut block = Vec::new();
        write(&report, &mut block).unwrap();
        let data: Value = serde_json::from_slice(&block).unwrap();
        assert_eq!(data["report"]["passes"], json!(["trace", "filter"]));
        assert_eq!(data["frames"][0]["pass_ms"], json!([1.0, null]));
        assert_eq!(data["frames"][1]["time_s"], 0.011_111);
        assert_eq!(data["frames"][1]["age_ms"], Value::Null);
    }
}
