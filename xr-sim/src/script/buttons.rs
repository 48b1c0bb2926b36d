//! `events.csv`: the buttons that were pressed and released.

use std::path::Path;

use super::table::{ScriptError, Table};

/// A hand and its controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Hand {
    Left,
    Right,
}

/// A button's new state.
#[derive(Debug, Clone, PartialEq)]
struct Press {
    time_ns: i64,
    hand: Hand,
    /// As in the interaction profiles' paths: `trigger`, `select`, `menu`, ...
    input: String,
    /// 0 released, 1 pressed.
    value: f32,
}

/// All buttons of a recording, in ascending order of time.
#[derive(Debug, Default)]
pub(super) struct Buttons(Vec<Press>);

impl Buttons {
    pub fn pressed(&self, hand: Hand, input: &str, time_ns: i64) -> f32 {
        let after = self.0.partition_point(|press| press.time_ns <= time_ns);
        self.0[..after]
            .iter()
            .rfind(|press| press.hand == hand && press.input == input)
            .map_or(0.0, |press| press.value)
    }
}

/// Reads the file; none where there is no file. Events other than `button` are left out.
pub(super) fn read(path: &Path) -> Result<Buttons, ScriptError> {
    let Some(table) = Table::read_if_any(path)? else {
        return Ok(Buttons::default());
    };
    let presses = table.rows(
        |header| {
            Ok((
                header.needed("time_ns")?,
                header.needed("event")?,
                header.needed("value")?,
            ))
        },
        |(time_ns, event, value), row| {
            let time_ns = row.needed_integer(time_ns)?;
            if row.text(event) != Some("button") {
                return Ok(None);
            }
            let reason = "is no button's state, such as `select_right down` or `trigger_left 0.5`";
            let (hand, input, value) = row
                .text(value)
                .and_then(parse)
                .ok_or_else(|| row.refuse(value, reason))?;
            Ok(Some(Press {
                time_ns,
                hand,
                input,
                value,
            }))
        },
    )?;
    let mut presses: Vec<_> = presses.into_iter().flatten().collect();
    presses.sort_by_key(|press| press.time_ns);
    Ok(Buttons(presses))
}

/// `select_right down`, `trigger_left up`, `trigger_left 0.5`.
fn parse(text: &str) -> Option<(Hand, String, f32)> {
    let (button, state) = text.split_once(' ')?;
    let (input, hand) = button.rsplit_once('_')?;
    let hand = match hand {
        "left" => Hand::Left,
        "right" => Hand::Right,
        _ => return None,
    };
    let value = match state.trim() {
        "down" => 1.0,
        "up" => 0.0,
        number => number
            .parse()
            .ok()
            .filter(|value| (0.0..=1.0).contains(value))?,
    };
    Some((hand, input.into(), value))
}
