//! Progress of long work on stderr: a bar on a terminal, a plain line now and then elsewhere.

use std::io::{IsTerminal, stderr};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// How often a plain line is written where there is no terminal.
const PLAIN_PERIOD: Duration = Duration::from_secs(10);

/// One piece of long work. It may be shared between threads.
#[derive(Debug)]
pub struct Progress {
    bar: ProgressBar,
    plain: Option<Mutex<PlainLines>>,
}

impl Progress {
    /// Starts `total` steps of `what`, counted in `unit`s: `new("rendering", 100, "frames")`. `None` (or 0): nobody knows how many.
    pub fn new(what: &str, total: impl Into<Option<u64>>, unit: &str) -> Self {
        let total = total.into().filter(|&total| total > 0);
        let on_terminal = stderr().is_terminal();
        let target = if on_terminal {
            ProgressDrawTarget::stderr()
        } else {
            ProgressDrawTarget::hidden()
        };
        let bar = ProgressBar::with_draw_target(total, target);
        let steps = match total {
            Some(_) => format!("{{bar:32}} {{pos}}/{{len}} {unit}, {{elapsed}}, {{eta}} left"),
            None => format!("{{spinner}} {{pos}} {unit}, {{elapsed}}"),
        };
        let template = format!("{{prefix}} {steps} {{msg}}");
        // The template is fixed but for `unit`; a brace in it would cost the layout, not the run.
        if let Ok(style) = ProgressStyle::with_template(&template) {
            bar.set_style(style.progress_chars("█▉▊▋▌▍▎▏ "));
        }
        bar.set_prefix(what.to_owned());
        let plain = (!on_terminal).then(|| {
            Mutex::new(PlainLines {
                what: what.into(),
                unit: unit.into(),
                total,
                last: None,
            })
        });
        Self { bar, plain }
    }

    /// `steps` more are done.
    pub fn advance(&self, steps: u64) {
        self.bar.inc(steps);
        if let Some(Ok(mut plain)) = self.plain.as_ref().map(Mutex::lock)
            && let Some(line) = plain.line(self.bar.position(), Instant::now())
        {
            eprintln!("{line}");
        }
    }

    /// A few words at the end of the bar, such as the current error.
    pub fn set_message(&self, message: impl Into<String>) {
        self.bar.set_message(message.into());
    }

    /// Prints a line above the bar without tearing it.
    pub fn println(&self, line: &str) {
        if self.plain.is_some() {
            eprintln!("{line}");
        } else {
            self.bar.println(line);
        }
    }
}

impl Drop for Progress {
    /// The bar leaves the terminal as it found it; what was done is the command's to say.
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// When to write a plain line, and what it says. Time is an argument.
#[derive(Debug)]
struct PlainLines {
    what: String,
    unit: String,
    total: Option<u64>,
    last: Option<Instant>,
}

impl PlainLines {
    fn line(&mut self, done: u64, now: Instant) -> Option<String> {
        let due = self
            .last
            .is_none_or(|last| now.duration_since(last) >= PLAIN_PERIOD);
        if !due && self.total.is_none_or(|total| done < total) {
            return None;
        }
        self.last = Some(now);
        let total = self
            .total
            .map_or(String::new(), |total| format!(" of {total}"));
        Some(format!("{}: {done}{total} {}", self.what, self.unit))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plain_lines_come_at_the_start_every_period_and_at_the_end() {
        let start = Instant::now();
        let mut lines = PlainLines {
            what: "rendering".into(),
            unit: "frames".into(),
            total: Some(100),
            last: None,
        };
        let mut at = |done, seconds| lines.line(done, start + Duration::from_secs(seconds));
        assert_eq!(at(1, 0).unwrap(), "rendering: 1 of 100 frames");
        assert_eq!(at(20, 9), None);
        assert!(at(30, 10).is_some());
        assert_eq!(at(99, 11), None);
        assert_eq!(at(100, 12).unwrap(), "rendering: 100 of 100 frames");
        lines.total = None;
        let line = lines.line(7, start + Duration::from_secs(60));
        assert_eq!(line.unwrap(), "rendering: 7 frames");
    }
}
