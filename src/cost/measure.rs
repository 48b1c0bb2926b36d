//! One setting, timed and judged: warm-up, then independent frames until the median is steady.
//!
//! A frame is a picture of its own: passes start over, with random numbers that no frame has had. Its time is the sum of its stages on
//! the device, by its timestamps, or by the wall clock on software devices; reading pictures back is not in it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use glam::Vec3;

use super::CostError;
use super::judge::Judge;
use super::point::{FrameTime, Point};
use super::setting::Setting;
use crate::gpu::GpuDevice;
use crate::image::LinearImage;
use crate::scene::Camera;
use crate::scene::loaded::LoadedScene;
use crate::still::Still;
use crate::technique;
use crate::technique::radius::RadiusRule;

/// Changes whenever a point measured before could no longer stand beside one measured now.
pub const MEASUREMENT_VERSION: u32 = 3;
/// Frames before any is timed, if they are not slow.
const WARM_UP_FRAMES: usize = 2;
/// Frames that are timed at least.
const MIN_FRAMES: usize = 5;
/// Frames that are timed at least where there is time.
const STEADY_FRAMES: usize = 8;
/// Frames that are timed at most.
const MAX_FRAMES: usize = 64;
/// Half the confidence interval of the median, and the standard error of the error, that are steady enough.
const STEADY_SHARE: f64 = 0.05;

/// Where settings are tried.
pub struct Bench<'a> {
    /// The device.
    pub gpu: &'a GpuDevice,
    /// The scene.
    pub scene: &'a LoadedScene,
    /// The eye.
    pub camera: &'a Camera,
    /// Where it looks; unit direction in view space.
    pub gaze_dir_in_view: Vec3,
    /// Time for one setting: once it is over no further frame begins.
    pub point_limit: Duration,
    /// Raised to stop between two frames.
    pub interrupted: &'a AtomicBool,
}

/// What came of a setting, and its last frame.
pub struct Measured {
    /// The point, without its key and its anchor.
    pub point: Point,
    /// A frame as a viewer would see it, at its own size.
    pub frame: LinearImage,
}

impl Bench<'_> {
    /// Times a setting and judges its frames. `None` if it was interrupted.
    ///
    /// # Errors
    /// [`CostError::Gpu`].
    pub fn measure(&self, setting: &Setting, judge: &Judge) -> Result<Option<Measured>, CostError> {
        let mut frames = self.frames(setting)?;
        let mut tally = judge.tally();
        let mut times = Vec::new();
        let started = frames.warm_up(self.point_limit)?;
        let frame = loop {
            if self.interrupted.load(Ordering::SeqCst) {
                return Ok(None);
            }
            times.push(frames.next()?);
            let frame = frames.still.read()?;
            tally.add(&frame);
            let is_steady = is_steady(&times) && tally.relative_standard_error() < STEADY_SHARE;
            if is_enough(times.len(), is_steady, started.elapsed() > self.point_limit) {
                break frame;
            }
        };
        let statistics = frames.still.statistics()?;
        let count = |name: &str| {
            let found = statistics.counts.iter().find(|(known, _)| *known == name);
            found.map(|(_, value)| *value)
        };
        let error = tally.finish();
        let mut warnings = statistics.warnings.clone();
        if error.not_finite > 0 {
            warnings.push(format!(
                "{} values of its frames were not finite and count as black",
                error.not_finite
            ));
        }
        let Some(time) = FrameTime::of(&times) else {
            return Ok(None);
        };
        let point = Point {
            key: String::new(),
            technique: setting.technique.into(),
            size: setting.size,
            passes: setting.passes,
            changed: setting.changed(),
            effort: setting.effort(),
            photons: count("photons_emitted").map(|_| setting.params.photon.count),
            radius_m: count("gather_radius_m"),
            time,
            error,
            warnings,
            anchor: None,
        };
        Ok(Some(Measured { point, frame }))
    }

    /// Times a setting only. `None` if it was interrupted.
    ///
    /// # Errors
    /// [`CostError::Gpu`].
    pub fn time(&self, setting: &Setting) -> Result<Option<FrameTime>, CostError> {
        let mut frames = self.frames(setting)?;
        let mut times = Vec::new();
        let started = frames.warm_up(self.point_limit)?;
        while !is_enough(
            times.len(),
            is_steady(&times),
            started.elapsed() > self.point_limit,
        ) {
            if self.interrupted.load(Ordering::SeqCst) {
                return Ok(None);
            }
            times.push(frames.next()?);
        }
        Ok(FrameTime::of(&times))
    }

    /// What gather radii are derived from here.
    pub fn radius(&self) -> RadiusRule {
        RadiusRule::of(&self.scene.on_gpu)
    }

    fn frames(&self, setting: &Setting) -> Result<Frames<'_>, CostError> {
        let size = (setting.size.width, setting.size.height);
        let entry = technique::find(setting.technique).ok_or_else(|| CostError::BadValue {
            key: "technique",
            value: setting.technique.into(),
            expected: "one of those that `macula render --help` lists".into(),
        })?;
        let still = Still::start(
            self.gpu,
            self.scene,
            &setting.params,
            entry,
            self.camera.view(size.0, size.1),
            size,
            Some(self.gaze_dir_in_view),
        )?;
        Ok(Frames {
            still,
            passes: setting.passes,
        })
    }
}

/// Frame after frame of one setting.
struct Frames<'a> {
    still: Still<'a>,
    passes: u32,
}

impl Frames<'_> {
    /// Frames that nobody times: the first ones compile. Returns when it began.
    fn warm_up(&mut self, limit: Duration) -> Result<Instant, CostError> {
        let started = Instant::now();
        for _ in 0..WARM_UP_FRAMES {
            self.next()?;
            if started.elapsed() > limit / 4 {
                break;
            }
        }
        Ok(started)
    }

    /// The next frame's stages, each with its time in milliseconds.
    fn next(&mut self) -> Result<Vec<(String, f64)>, CostError> {
        self.still.start_over();
        let started = Instant::now();
        let mut stages: Vec<(String, f64)> = Vec::new();
        for _ in 0..self.passes {
            for time in self.still.add_pass()? {
                match stages.iter_mut().find(|(name, _)| name == time.name) {
                    Some((_, sum)) => *sum += time.ms,
                    None => stages.push((time.name.into(), time.ms)),
                }
            }
        }
        if stages.is_empty() {
            // A GPU without timestamps: the whole frame, with what the host adds.
            stages.push(("frame".into(), started.elapsed().as_secs_f64() * 1e3));
        }
        Ok(stages)
    }
}

fn is_enough(frames: usize, is_steady: bool, is_late: bool) -> bool {
    frames >= MAX_FRAMES || frames >= MIN_FRAMES && is_late || frames >= STEADY_FRAMES && is_steady
}

/// Whether half the 95 % confidence interval of the median frame (between order statistics n/2 ∓ 0.98 √n) is small beside it.
fn is_steady(frames: &[Vec<(String, f64)>]) -> bool {
    let sum = |frame: &Vec<(String, f64)>| frame.iter().map(|(_, ms)| ms).sum::<f64>();
    let mut sums: Vec<f64> = frames.iter().map(sum).collect();
    if sums.len() < MIN_FRAMES {
        return false;
    }
    sums.sort_unstable_by(f64::total_cmp);
    let count = sums.len() as f64;
    let low = (0.5 * count - 0.98 * count.sqrt()).floor().max(0.0) as usize;
    let high = sums.len() - 1 - low;
    0.5 * (sums[high] - sums[low]) < STEADY_SHARE * sums[sums.len() / 2]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames(sums_ms: &[f64]) -> Vec<Vec<(String, f64)>> {
        sums_ms.iter().map(|ms| vec![("all".into(), *ms)]).collect()
    }

    #[test]
    fn a_median_is_steady_when_its_confidence_interval_is_narrow() {
        assert!(is_steady(&frames(&[10.0, 10.1, 9.9, 10.0, 10.2])));
        assert!(!is_steady(&frames(&[10.0, 10.1, 9.9, 10.0, 14.0])));
        let mut hiccups = vec![10.0; 30];
        hiccups.extend([50.0; 3]);
        assert!(
            is_steady(&frames(&hiccups)),
            "a few slow frames do not matter"
        );
        assert!(!is_steady(&frames(&[10.0; 4])), "four frames say nothing");
    }

    #[test]
    fn five_frames_are_timed_however_slow_and_more_while_they_scatter() {
        assert!(!is_enough(4, true, true));
        assert!(is_enough(5, false, true));
        assert!(!is_enough(7, true, false));
        assert!(is_enough(8, true, false));
        assert!(!is_enough(63, false, false));
        assert!(is_enough(64, false, false));
    }
}
