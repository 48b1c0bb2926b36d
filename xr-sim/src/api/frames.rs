//! The frame loop.

use std::time::Duration;

use openxr_sys as sys;

use super::functions;
use crate::config::ClockKind;
use crate::runtime::{runtime, wait_for_begun_frame, wake_waiting_frames};

functions! {
    fn wait_frame(
        session: sys::Session,
        frame_wait_info: *const sys::FrameWaitInfo,
        frame_state: *mut sys::FrameState,
    ) {
        frame_wait_info.verified_or_null()?;
        let mut frame_state = frame_state;
        let mut runtime = runtime();
        let (of_session, instance) = loop {
            let (of_session, _) = runtime.session(session)?;
            if !of_session.lifecycle.is_running() {
                return Err(sys::Result::ERROR_SESSION_NOT_RUNNING);
            }
            if !of_session.pacing.awaits_begin() {
                break runtime.session(session)?;
            }
            runtime = wait_for_begun_frame(runtime);
        };
        let state = frame_state.verified()?;
        let frame = of_session.pacing.wait(&mut instance.clock);
        let is_in_script = of_session.pacing.is_in_script(frame.index);
        state.predicted_display_time = sys::Time::from_nanos(frame.display_time_ns);
        state.predicted_display_period = sys::Duration::from_nanos(frame.period_ns);
        state.should_render = (of_session.lifecycle.is_visible() && is_in_script).into();
        let sleep_ns = match instance.clock.kind() {
            ClockKind::Virtual => 0,
            ClockKind::RealTime => frame.wake_time_ns() - instance.clock.now_ns(),
        };
        if !is_in_script {
            let states = of_session.lifecycle.request_exit()?;
            runtime.announce(session, states)?;
        }
        drop(runtime);
        if let Ok(sleep_ns) = u64::try_from(sleep_ns) {
            std::thread::sleep(Duration::from_nanos(sleep_ns));
        }
        Ok(())
    }

    fn begin_frame(session: sys::Session, frame_begin_info: *const sys::FrameBeginInfo) {
        frame_begin_info.verified_or_null()?;
        let mut runtime = runtime();
        let (of_session, _) = runtime.session(session)?;
        if !of_session.lifecycle.is_running() {
            return Err(sys::Result::ERROR_SESSION_NOT_RUNNING);
        }
        let code = of_session.pacing.begin()?;
        wake_waiting_frames();
        Ok(code)
    }

    fn end_frame(session: sys::Session, frame_end_info: *const sys::FrameEndInfo) {
        let mut runtime = runtime();
        let (of_session, _) = runtime.peek(session)?;
        let info = frame_end_info.verified()?;
        if !of_session.lifecycle.is_running() {
            return Err(sys::Result::ERROR_SESSION_NOT_RUNNING);
        }
        if !of_session.pacing.has_begun() {
            return Err(sys::Result::ERROR_CALL_ORDER_INVALID);
        }
        super::verify_time(info.display_time)?;
        match info.environment_blend_mode {
            sys::EnvironmentBlendMode::OPAQUE => {}
            sys::EnvironmentBlendMode::ADDITIVE | sys::EnvironmentBlendMode::ALPHA_BLEND => {
                return Err(sys::Result::ERROR_ENVIRONMENT_BLEND_MODE_UNSUPPORTED);
            }
            _ => return Err(sys::Result::ERROR_VALIDATION_FAILURE),
        }
        let layers = super::layers::verified(&runtime, session, info)?;
        let cameras = super::layers::cameras(&runtime, session, info.display_time)?;
        let (of_session, _) = runtime.session(session)?;
        let index = of_session.pacing.end()?;
        if of_session.pacing.is_last(index) {
            let states = of_session.lifecycle.request_exit()?;
            runtime.announce(session, states)?;
        }
        let (of_session, _) = runtime.peek(session)?;
        of_session.sink.show(index, &layers, cameras, &runtime.swapchains)
    }
}
