//! Many settings, one after the other: each is looked for in the store first, and one that stays the same, the anchor, is timed again and
//! again, so that a machine that slows down is found out, and a search compares times as if they were taken at one moment.

use std::time::{Duration, Instant};

use serde::Serialize;

use super::judge::Judge;
use super::measure::Bench;
use super::point::{Anchor, Point};
use super::search::Trial;
use super::setting::Setting;
use super::store::Store;
use super::{CostError, alike};
use crate::technique::radius::RadiusRule;

/// How often the anchor is timed again.
const ANCHOR_PERIOD: Duration = Duration::from_secs(20);

/// A run over many settings.
pub struct Campaign<'a> {
    bench: &'a Bench<'a>,
    judge: &'a Judge,
    store: &'a Store,
    /// What is told about each setting before it is measured.
    tell: &'a mut dyn FnMut(&Setting),
    points: Vec<Point>,
    reused: usize,
    /// The setting that is timed through the run, and when it was last.
    anchor: Setting,
    anchored: Option<Instant>,
    drift: Drift,
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
    /// Median frame times of the anchor, milliseconds, in the order of time; those of earlier runs in the folder too.
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
    /// A run that has found nothing yet, but knows how fast the machine was in earlier ones.
    ///
    /// # Errors
    /// [`CostError::Store`].
    pub fn new(
        bench: &'a Bench<'a>,
        judge: &'a Judge,
        store: &'a Store,
        anchor: Setting,
        tell: &'a mut dyn FnMut(&Setting),
    ) -> Result<Self, CostError> {
        let anchor = anchor.normalised();
        let anchor_ms = store.anchor_ms(&store.key(&anchor))?;
        Ok(Self {
            bench,
            judge,
            store,
            tell,
            points: Vec::new(),
            reused: 0,
            anchor,
            anchored: None,
            drift: Drift { anchor_ms },
        })
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
        if let Some(point) = self.store.find(&key)? {
            self.reused += 1;
            self.points.push(point.clone());
            return Ok(Some(point));
        }
        self.fresh_point(setting)
    }

    /// The point of a setting, or one of this run that makes the same picture by the same work. `None` if it was interrupted.
    ///
    /// # Errors
    /// [`CostError`].
    pub fn point_alike(&mut self, setting: &Setting) -> Result<Option<Point>, CostError> {
        match alike::find(&self.points, setting, &self.radius())? {
            Some(known) => Ok(Some(known.clone())),
            None => self.point(setting),
        }
    }

    /// The point of a setting, measured now whether it is known or not. `None` if it was interrupted.
    ///
    /// # Errors
    /// [`CostError`].
    pub fn fresh_point(&mut self, setting: &Setting) -> Result<Option<Point>, CostError> {
        (self.tell)(setting);
        if self
            .anchored
            .is_none_or(|last| last.elapsed() >= ANCHOR_PERIOD)
        {
            self.time_anchor()?;
        }
        let setting = setting.clone().normalised();
        let measured = self.bench.measure(&setting, self.judge);
        let Some(measured) = measured.map_err(|source| CostError::Point {
            setting: setting.words(),
            source: Box::new(source),
        })?
        else {
            return Ok(None);
        };
        let point = Point {
            key: self.store.key(&setting),
            anchor: self.drift.anchor_ms.last().map(|ms| Anchor {
                key: self.store.key(&self.anchor),
                ms: *ms,
            }),
            ..measured.point
        };
        self.store.keep(&point, &measured.frame)?;
        self.points.retain(|known| known.key != point.key);
        self.points.push(point.clone());
        Ok(Some(point))
    }

    /// A point as a search sees it: the time is what it would be now, if the machine has become faster or slower as the anchor has.
    ///
    /// # Errors
    /// [`CostError`]: the point is of a program that knew other keys.
    pub fn trial(&self, point: &Point) -> Result<Trial, CostError> {
        let key = self.store.key(&self.anchor);
        let then = point.anchor.as_ref().filter(|anchor| anchor.key == key);
        let change = match (self.drift.anchor_ms.last(), then) {
            (Some(now_ms), Some(then)) => now_ms / then.ms,
            _ => 1.0,
        };
        Ok(Trial {
            setting: Setting::of(point)?,
            ms: point.frame_ms() * change,
            error: point.relmse(),
        })
    }

    /// A point as [`Campaign::trial`] has it, or with the time that was measured where that is less: what it may take at best.
    ///
    /// # Errors
    /// [`CostError`]: the point is of a program that knew other keys.
    pub fn trial_at_best(&self, point: &Point) -> Result<Trial, CostError> {
        let trial = self.trial(point)?;
        let ms = trial.ms.min(point.frame_ms());
        Ok(Trial { ms, ..trial })
    }

    /// What gather radii are derived from in the scene.
    pub fn radius(&self) -> RadiusRule {
        self.bench.radius()
    }

    /// Every point so far.
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// Ends the run. The drift is that of all its points' times: those of earlier runs count too.
    ///
    /// # Errors
    /// [`CostError`].
    pub fn finish(mut self) -> Result<Findings, CostError> {
        if self.anchored.is_some() {
            self.time_anchor()?;
        }
        Ok(Findings {
            points: self.points,
            reused: self.reused,
            drift: self.drift,
        })
    }

    /// Times the anchor; an interrupted run times nothing more.
    fn time_anchor(&mut self) -> Result<(), CostError> {
        let time = self.bench.time(&self.anchor)?;
        self.drift.anchor_ms.extend(time.map(|time| time.median_ms));
        self.anchored = Some(Instant::now());
        let key = self.store.key(&self.anchor);
        self.store.keep_anchor_ms(&key, &self.drift.anchor_ms)
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
