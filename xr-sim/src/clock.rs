//! What time it is in the headset.

use std::time::Instant;

use openxr_sys as sys;

use crate::config::ClockKind;

/// The time at which an instance's real-time clock starts: positive, as every `XrTime` has to be.
const START_NS: i64 = 1_000_000_000;

/// An instance's clock. Virtual time stands still but for the frames that move it on.
#[derive(Debug)]
pub(crate) struct Clock {
    kind: ClockKind,
    started: Instant,
    virtual_now_ns: i64,
}

impl Clock {
    /// Virtual time starts at `first_frame_ns`, real time at an arbitrary positive time.
    pub fn start(kind: ClockKind, first_frame_ns: i64) -> Self {
        Self {
            kind,
            started: Instant::now(),
            virtual_now_ns: first_frame_ns,
        }
    }

    pub fn kind(&self) -> ClockKind {
        self.kind
    }

    pub fn now_ns(&self) -> i64 {
        match self.kind {
            ClockKind::Virtual => self.virtual_now_ns,
            ClockKind::RealTime => START_NS.saturating_add(
                i64::try_from(self.started.elapsed().as_nanos()).unwrap_or(i64::MAX),
            ),
        }
    }

    pub fn now(&self) -> sys::Time {
        sys::Time::from_nanos(self.now_ns())
    }

    /// A frame is to be shown at that time: virtual time is there at once.
    pub fn show_frame_at(&mut self, display_time_ns: i64) {
        self.virtual_now_ns = display_time_ns;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn virtual_time_moves_with_frames_alone() {
        let mut clock = Clock::start(ClockKind::Virtual, 5);
        std::thread::sleep(std::time::Duration::from_millis(2));
        assert_eq!(clock.now_ns(), 5);
        clock.show_frame_at(16);
        assert_eq!(clock.now_ns(), 16);
    }

    #[test]
    fn real_time_moves_by_itself() {
        let mut clock = Clock::start(ClockKind::RealTime, 5);
        let before = clock.now_ns();
        clock.show_frame_at(i64::MAX);
        std::thread::sleep(std::time::Duration::from_millis(2));
        let passed = clock.now_ns() - before;
        assert!((2_000_000..2_000_000_000).contains(&passed), "{passed}");
        assert!(before >= START_NS);
    }
}
