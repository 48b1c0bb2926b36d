//! A tracker's own counter against the computer's clock.

/// Largest difference between the delays of two lines that still lets the counter's times be used, ns.
const MAX_DELAY_SPREAD_NS: f64 = 100e6;
/// Largest drift between two clocks that both count milliseconds.
const MAX_DRIFT: f64 = 0.01;

/// What the two clocks showed at one line of a file.
#[derive(Clone, Copy, Debug)]
pub(super) struct CounterReading {
    /// The tracker's counter, milliseconds; it wraps at 32 bits.
    pub counter_ms: i32,
    /// When the line was written, by the computer's clock, ns.
    pub line_ns: i64,
}

/// When the samples were taken, by the computer's clock: the counter, fitted to it by least squares, so that the drift between
/// the clocks goes, and with it the jitter of writing lines; then shifted so that no sample is written before it was taken.
/// `None` where the counter makes no sense.
pub(super) fn fitted_times_ns(readings: &[CounterReading]) -> Option<Vec<i64>> {
    let first = readings.first()?;
    let mut counted_ns = 0.0;
    let mut previous_ms = first.counter_ms;
    let pairs: Vec<(f64, f64)> = readings
        .iter()
        .map(|reading| {
            counted_ns += f64::from(reading.counter_ms.wrapping_sub(previous_ms)) * 1e6;
            previous_ms = reading.counter_ms;
            (counted_ns, (reading.line_ns - first.line_ns) as f64)
        })
        .collect();
    let mean =
        |pick: fn(&(f64, f64)) -> f64| pairs.iter().map(pick).sum::<f64>() / pairs.len() as f64;
    let (mean_counted, mean_line) = (mean(|pair| pair.0), mean(|pair| pair.1));
    let covariance: f64 = pairs
        .iter()
        .map(|(counted, line)| (counted - mean_counted) * (line - mean_line))
        .sum();
    let variance: f64 = pairs
        .iter()
        .map(|(counted, _)| (counted - mean_counted).powi(2))
        .sum();
    let slope = covariance / variance;
    let fitted = |counted: f64| mean_line + slope * (counted - mean_counted);
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    for (counted, line) in &pairs {
        let delay = line - fitted(*counted);
        (least, most) = (least.min(delay), most.max(delay));
    }
    // Written so that a slope of 0/0 is none either.
    let agrees = (slope - 1.0).abs() < MAX_DRIFT && most - least < MAX_DELAY_SPREAD_NS;
    agrees.then(|| {
        let time_ns = |counted: f64| first.line_ns + (fitted(counted) + least) as i64;
        pairs
            .iter()
            .map(|(counted, _)| time_ns(*counted).max(1))
            .collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const START_NS: i64 = 1_000_000_000;

    #[test]
    fn the_counter_wraps_drifts_and_loses_the_jitter_of_the_lines() {
        let readings: Vec<CounterReading> = (0..200)
            .map(|i: i32| CounterReading {
                counter_ms: (i32::MAX - 800).wrapping_add(8 * i),
                line_ns: START_NS + i64::from(i) * 8_000_800 + i64::from(i % 3) * 1_000_000,
            })
            .collect();
        let times_ns = fitted_times_ns(&readings).unwrap();
        let steps_ns = times_ns.windows(2).map(|pair| pair[1] - pair[0]);
        assert!(
            steps_ns
                .into_iter()
                .all(|step_ns| (step_ns - 8_000_800).abs() < 1000)
        );
        let mut pairs = times_ns.iter().zip(&readings);
        assert!(pairs.all(|(time_ns, reading)| *time_ns <= reading.line_ns));
    }

    #[test]
    fn a_counter_that_stands_still_or_jumps_is_not_trusted() {
        let readings = |counter_ms: fn(i32) -> i32| -> Vec<CounterReading> {
            (0..50)
                .map(|i| CounterReading {
                    counter_ms: counter_ms(i),
                    line_ns: START_NS + i64::from(i) * 8_000_000,
                })
                .collect()
        };
        assert!(fitted_times_ns(&readings(|i| 8 * i)).is_some());
        assert_eq!(fitted_times_ns(&readings(|_| 5)), None);
        assert_eq!(fitted_times_ns(&readings(|i| 8 * i + 900 * (i / 25))), None);
        assert_eq!(fitted_times_ns(&[]), None);
    }
}
