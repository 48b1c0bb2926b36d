//! Which frame is next, when it is to be shown, and the order of `xrWaitFrame`, `xrBeginFrame`, `xrEndFrame`.

use std::sync::Arc;

use openxr_sys as sys;

use crate::XrResult;
use crate::clock::Clock;
use crate::config::{ClockKind, Config, Setup};
use crate::script::DEFAULT_PERIOD_NS;

/// The script's time of the first frame where there is no recording.
const FIRST_STILL_FRAME_NS: i64 = 1_000_000_000;

/// A frame that the application is to make.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PlannedFrame {
    /// Counted from 0, of the frames that the script shows.
    pub index: u64,
    /// The predicted display time, as `XrTime`.
    pub display_time_ns: i64,
    pub period_ns: i64,
}

impl PlannedFrame {
    /// When the application may start on it.
    pub fn wake_time_ns(&self) -> i64 {
        self.display_time_ns - self.period_ns
    }
}

/// The frames that a configuration picks from its recording.
#[derive(Debug)]
struct Schedule {
    setup: Arc<Setup>,
    /// How many there are; none: without end.
    count: Option<u64>,
}

impl Schedule {
    fn new(setup: Arc<Setup>) -> Self {
        let Config {
            first_frame,
            last_frame,
            frame_step,
            ..
        } = setup.config;
        let count = setup.script.frames().len().checked_sub(1).map(|last_row| {
            let last = last_frame.unwrap_or(last_row).min(last_row);
            ((last - first_frame) / frame_step + 1) as u64
        });
        Self { setup, count }
    }

    /// A frame in the script's time. Beyond the end it goes on at the last pace.
    fn frame(&self, index: u64) -> PlannedFrame {
        let Config {
            first_frame,
            frame_step,
            ..
        } = self.setup.config;
        let last = self.count.map_or(0, |count| count - 1);
        let row = first_frame + index.min(last) as usize * frame_step;
        let (row_time_ns, row_period_ns) = match self.setup.script.frames().get(row) {
            Some(frame) => (frame.display_time_ns, frame.period_ns),
            None => (FIRST_STILL_FRAME_NS, DEFAULT_PERIOD_NS),
        };
        let period_ns = row_period_ns.saturating_mul(frame_step as i64);
        let beyond = index.saturating_sub(last) as i64;
        let display_time_ns = row_time_ns.saturating_add(period_ns.saturating_mul(beyond));
        PlannedFrame {
            index,
            display_time_ns,
            period_ns,
        }
    }
}

/// A session's frames: the script's schedule, and how far the application is with them.
#[derive(Debug)]
pub(crate) struct Pacing {
    schedule: Schedule,
    next_index: u64,
    /// `XrTime` less the script's time: fixed by the first frame.
    offset_ns: Option<i64>,
    /// Waited for, not yet begun.
    waited: Option<u64>,
    /// Begun, not yet ended.
    begun: Option<u64>,
}

impl Pacing {
    pub fn new(setup: Arc<Setup>) -> Self {
        let schedule = Schedule::new(setup);
        Self {
            schedule,
            next_index: 0,
            offset_ns: None,
            waited: None,
            begun: None,
        }
    }

    /// The time of the first frame in the script: where virtual time starts.
    pub fn first_frame_ns(&self) -> i64 {
        self.schedule.frame(0).display_time_ns
    }

    /// The script's time at an `XrTime`.
    pub fn script_time_ns(&self, time: sys::Time) -> i64 {
        time.as_nanos().saturating_sub(self.offset_ns.unwrap_or(0))
    }

    /// The `XrTime` of a time of the script.
    pub fn time(&self, script_time_ns: i64) -> sys::Time {
        sys::Time::from_nanos(script_time_ns.saturating_add(self.offset_ns.unwrap_or(0)))
    }

    /// Whether `xrWaitFrame` has to wait for `xrBeginFrame`.
    pub fn awaits_begin(&self) -> bool {
        self.waited.is_some()
    }

    /// `xrWaitFrame`: plans the next frame that can still be made.
    pub fn wait(&mut self, clock: &mut Clock) -> PlannedFrame {
        let now_ns = clock.now_ns();
        let first = self.schedule.frame(0);
        let offset_ns = *self.offset_ns.get_or_insert(match clock.kind() {
            ClockKind::Virtual => 0,
            // the application may start on the first frame at once
            ClockKind::RealTime => now_ns - first.wake_time_ns(),
        });
        let planned = |index| {
            let frame = self.schedule.frame(index);
            PlannedFrame {
                display_time_ns: frame.display_time_ns.saturating_add(offset_ns),
                ..frame
            }
        };
        let mut frame = planned(self.next_index);
        if clock.kind() == ClockKind::RealTime {
            // what should be on the display already can't be made any more
            while frame.display_time_ns < now_ns {
                frame = planned(frame.index + 1);
            }
        }
        clock.show_frame_at(frame.display_time_ns);
        self.next_index = frame.index + 1;
        self.waited = Some(frame.index);
        frame
    }

    /// `xrBeginFrame`.
    pub fn begin(&mut self) -> XrResult<sys::Result> {
        let waited = self
            .waited
            .take()
            .ok_or(sys::Result::ERROR_CALL_ORDER_INVALID)?;
        match self.begun.replace(waited) {
            None => Ok(sys::Result::SUCCESS),
            Some(_) => Ok(sys::Result::FRAME_DISCARDED),
        }
    }

    /// Whether a frame can be ended.
    pub fn has_begun(&self) -> bool {
        self.begun.is_some()
    }

    /// `xrEndFrame`: the index of the frame that is done.
    pub fn end(&mut self) -> XrResult<u64> {
        self.begun
            .take()
            .ok_or(sys::Result::ERROR_CALL_ORDER_INVALID)
    }

    /// Whether the script shows nothing after that frame.
    pub fn is_last(&self, index: u64) -> bool {
        self.schedule.count.is_some_and(|count| index + 1 >= count)
    }

    /// Whether that frame is one of the script's, and not waited for past its end.
    pub fn is_in_script(&self, index: u64) -> bool {
        self.schedule.count.is_none_or(|count| index < count)
    }
}
