//! Many settings, one after the other: each is looked for in the store first, and one that stays the same is timed again and again, so
//! that a machine that slows down is found out.

use std::time::{Duration, Instant};

use serde::Serialize;

use super::CostError;
use super::judge::Judge;
use super::measure::Bench;
use super::point::Point;
use super::setting::Setting;
use super::store::Store;

/// How often the anchor is timed again.
const ANCHOR_PERIOD: Duration = Duration::from_secs(45);

/// A run over many settings.
pub struct Campaign<'a> {
    bench: &'a Bench<'a>,
    judge: &'a Judge,
    store: &'a Store,
    /// What is told about each setting before it is measured.
    tell: &'a mut dyn FnMut(&Setting),
    points: Vec<Point>,
    reused: usize,
    anchor: Option<Anchor>,
}

/// One setting, timed through the run.
struct Anchor {
    setting: Setting,
    times_ms: Vec<f64>,
    last: Instant,
}

/// What a campaign found.
#[derive(Clone, Debug)]
pub struct Findings {
    /// Every point, in the order in which they were asked for.
    pub points: Vec<Point>,
    /// How many of them were there already.
    pub reused: usize,
    /// How steady the machine was.
    pub drift: Drift,
}

/// How steady the machine was: one setting, timed through the run.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Drift {
    /// Median frame times of the anchor, milliseconds, in order.
    pub anchor_ms: Vec<f64>,
}

impl Drift {
    /// Slowest over fastest, less one; `None` below two times.
    pub fn range(&self) -> Option<f64> {
        let slowest = self.anchor_ms.iter().copied().reduce(f64::max)?;
        let fastest = self.anchor_ms.iter().copied().reduce(f64::min)?;
        (self.anchor_ms.len() > 1).then(|| slowest / fastest.max(f64::MIN_POSITIVE) - 1.0)
    }
}

impl<'a> Campaign<'a> {
    /// A run that has found nothing yet.
    pub fn new(
        bench: &'a Bench<'a>,
        judge: &'a Judge,
        store: &'a Store,
        tell: &'a mut dyn FnMut(&Setting),
    ) -> Self {
        Self {
            bench,
            judge,
            store,
            tell,
            points: Vec::new(),
            reused: 0,
            anchor: None,
        }
    }

    /// The point of a setting, from the store or measured. `None` if it was interrupted.
    ///
    /// # Errors
    /// [`CostError`].
    pub fn point(&mut self, setting: &Setting) -> Result<Option<Point>, CostError> {
        let key = self.store.key(setting);
        if let Some(point) = self.points.iter().find(|point| point.key == key) {
            return Ok(Some(point.clone()));
        }
        (self.tell)(setting);
        if let Some(point) = self.store.find(&key)? {
            self.reused += 1;
            self.points.push(point.clone());
            return Ok(Some(point));
        }
        self.time_anchor(setting)?;
        self.measure(setting, key)
    }

    /// The point of a setting, measured now whether it is known or not. `None` if it was interrupted.
    ///
    /// # Errors
    /// [`CostError`].
    pub fn fresh_point(&mut self, setting: &Setting) -> Result<Option<Point>, CostError> {
        let key = self.store.key(setting);
        (self.tell)(setting);
        self.points.retain(|point| point.key != key);
        self.measure(setting, key)
    }

    fn measure(&mut self, setting: &Setting, key: String) -> Result<Option<Point>, CostError> {
        let setting = setting.clone().normalised();
        let Some(measured) = self.bench.measure(&setting, self.judge)? else {
            return Ok(None);
        };
        let point = Point {
            key,
            ..measured.point
        };
        self.store.keep(&point, &measured.frame)?;
        self.points.push(point.clone());
        Ok(Some(point))
    }

    /// Every point so far.
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// Ends the run.
    ///
    /// # Errors
    /// [`CostError`].
    pub fn finish(mut self) -> Result<Findings, CostError> {
        if let Some(anchor) = &mut self.anchor {
            // An interrupted run times nothing more.
            let time = self.bench.time(&anchor.setting)?;
            anchor.times_ms.extend(time.map(|time| time.median_ms));
        }
        Ok(Findings {
            points: self.points,
            reused: self.reused,
            drift: Drift {
                anchor_ms: self.anchor.map_or(Vec::new(), |anchor| anchor.times_ms),
            },
        })
    }

    /// Times the anchor where it is due. The first setting that is measured is the anchor.
    fn time_anchor(&mut self, setting: &Setting) -> Result<(), CostError> {
        let is_due = |anchor: &Anchor| anchor.last.elapsed() >= ANCHOR_PERIOD;
        if !self.anchor.as_ref().is_none_or(is_due) {
            return Ok(());
        }
        let anchor = self.anchor.get_or_insert_with(|| Anchor {
            setting: setting.clone().normalised(),
            times_ms: Vec::new(),
            last: Instant::now(),
        });
        let time = self.bench.time(&anchor.setting)?;
        anchor.times_ms.extend(time.map(|time| time.median_ms));
        anchor.last = Instant::now();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drift_is_the_slowest_time_of_the_anchor_over_the_fastest() {
        let drift = |times: &[f64]| Drift {
            anchor_ms: times.to_vec(),
        };
        assert!((drift(&[10.0, 12.0, 11.0]).range().unwrap() - 0.2).abs() < 1e-12);
        assert_eq!(drift(&[10.0, 10.0]).range(), Some(0.0));
        assert_eq!(drift(&[10.0]).range(), None);
    }
}
