//! A session and the states it walks through (specification, "Session Lifecycle").

use std::sync::Arc;

use openxr_sys as sys;
use openxr_sys::SessionState;

use crate::XrResult;
use crate::handle::Object;
use crate::input::Input;
use crate::pacing::Pacing;
use crate::sink::Sink;
use crate::vulkan::Graphics;

/// An application's presence in the headset.
pub(crate) struct Session {
    pub instance: sys::Instance,
    /// None: headless.
    pub graphics: Option<Arc<Graphics>>,
    pub lifecycle: Lifecycle,
    pub pacing: Pacing,
    /// The action sets, once attached.
    pub input: Option<Input>,
    pub sink: Sink,
}

impl Object for Session {
    type Handle = sys::Session;
    const KIND: u8 = 2;
}

/// The states of a session. Each change gives the states to be told to the application, in order.
#[derive(Debug)]
pub(crate) struct Lifecycle {
    state: SessionState,
    is_running: bool,
    exit_requested: bool,
}

impl Lifecycle {
    /// The states of a new session: the headset is on and waiting.
    pub const STARTING: &[SessionState] = &[SessionState::IDLE, SessionState::READY];

    pub fn new() -> Self {
        Self {
            state: SessionState::READY,
            is_running: false,
            exit_requested: false,
        }
    }

    pub fn is_running(&self) -> bool {
        self.is_running
    }

    /// Whether the user sees the application's frames.
    pub fn is_visible(&self) -> bool {
        matches!(self.state, SessionState::VISIBLE | SessionState::FOCUSED)
    }

    /// Whether the application gets input.
    pub fn is_focused(&self) -> bool {
        self.state == SessionState::FOCUSED
    }

    /// `xrBeginSession`. The user waits with the headset on: nothing stands between this and focus, and
    /// whoever polls to the end of the queue has it before the first frame.
    pub fn begin(&mut self) -> XrResult<&'static [SessionState]> {
        if self.is_running {
            return Err(sys::Result::ERROR_SESSION_RUNNING);
        }
        if self.state != SessionState::READY {
            return Err(sys::Result::ERROR_SESSION_NOT_READY);
        }
        self.is_running = true;
        self.state = SessionState::FOCUSED;
        Ok(&[
            SessionState::SYNCHRONIZED,
            SessionState::VISIBLE,
            SessionState::FOCUSED,
        ])
    }

    /// `xrRequestExitSession`, or the user's wish to quit.
    pub fn request_exit(&mut self) -> XrResult<&'static [SessionState]> {
        if !self.is_running {
            return Err(sys::Result::ERROR_SESSION_NOT_RUNNING);
        }
        self.exit_requested = true;
        if self.state == SessionState::STOPPING {
            return Ok(&[]);
        }
        self.state = SessionState::STOPPING;
        Ok(&[
            SessionState::VISIBLE,
            SessionState::SYNCHRONIZED,
            SessionState::STOPPING,
        ])
    }

    /// `xrEndSession`.
    pub fn end(&mut self) -> XrResult<&'static [SessionState]> {
        if !self.is_running {
            return Err(sys::Result::ERROR_SESSION_NOT_RUNNING);
        }
        if self.state != SessionState::STOPPING {
            return Err(sys::Result::ERROR_SESSION_NOT_STOPPING);
        }
        self.is_running = false;
        self.state = SessionState::EXITING;
        Ok(&[SessionState::IDLE, SessionState::EXITING])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_session_walks_from_ready_to_focus_to_exit() {
        let mut lifecycle = Lifecycle::new();
        assert_eq!(lifecycle.end(), Err(sys::Result::ERROR_SESSION_NOT_RUNNING));
        assert_eq!(
            lifecycle.request_exit(),
            Err(sys::Result::ERROR_SESSION_NOT_RUNNING)
        );
        assert_eq!(
            lifecycle.begin().map(<[_]>::last),
            Ok(Some(&SessionState::FOCUSED))
        );
        assert!(lifecycle.is_visible() && lifecycle.is_focused());
        assert_eq!(lifecycle.begin(), Err(sys::Result::ERROR_SESSION_RUNNING));
        assert_eq!(
            lifecycle.end(),
            Err(sys::Result::ERROR_SESSION_NOT_STOPPING)
        );
        assert_eq!(
            lifecycle.request_exit().map(<[_]>::last),
            Ok(Some(&SessionState::STOPPING))
        );
        assert_eq!(
            lifecycle.request_exit(),
            Ok(&[][..]),
            "asking twice tells nothing new"
        );
        assert!(lifecycle.is_running() && !lifecycle.is_visible() && !lifecycle.is_focused());
        assert_eq!(
            lifecycle.end(),
            Ok(&[SessionState::IDLE, SessionState::EXITING][..])
        );
        assert_eq!(lifecycle.begin(), Err(sys::Result::ERROR_SESSION_NOT_READY));
    }
}
