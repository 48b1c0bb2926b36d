//! Numbers over frames that the page's tables show.

use crate::metrics::error::percentile;

/// Median, 95th percentile and maximum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Half of the values are at most this.
    pub median: f64,
    /// 95% of the values are at most this.
    pub p95: f64,
    /// The largest.
    pub max: f64,
}

impl Spread {
    /// Of the finite ones among the values; `None` if there are none.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut values: Vec<f64> = values.into_iter().filter(|x| x.is_finite()).collect();
        values.sort_unstable_by(f64::total_cmp);
        Some(Self {
            max: *values.last()?,
            median: percentile(&values, 0.5),
            p95: percentile(&values, 0.95),
        })
    }
}

/// The distinct names in the order in which they first appear, frame after frame; a name that first appears late is put behind the one it
/// followed there, so that the order stays that of the passes.
pub fn names_in_order<'a>(frames: impl Iterator<Item = Vec<&'a str>>) -> Vec<&'a str> {
    let mut names: Vec<&str> = Vec::new();
    for frame in frames {
        let mut next = 0;
        for name in frame {
            match names.iter().position(|known| *known == name) {
                Some(at) => next = at + 1,
                None => {
                    names.insert(next, name);
                    next += 1;
                }
            }
        }
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spread_ignores_what_is_not_finite() {
        let spread = Spread::of([4.0, f64::NAN, 1.0, 2.0, 3.0, 5.0]).unwrap();
        assert_eq!((spread.median, spread.max), (3.0, 5.0));
        assert!((spread.p95 - 4.8).abs() < 1e-12);
        assert_eq!(Spread::of([f64::NAN]), None);
    }

    #[test]
    fn a_pass_that_starts_late_keeps_its_place() {
        let frames = [
            vec!["trace", "gather"],
            vec!["trace", "caustics", "gather", "filter"],
        ];
        assert_eq!(
            names_in_order(frames.into_iter()),
            ["trace", "caustics", "gather", "filter"]
        );
    }
}
