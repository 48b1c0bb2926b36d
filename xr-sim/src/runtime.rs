//! Everything that is alive, behind one lock.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use openxr_sys as sys;
use openxr_sys::SessionState;

use crate::XrResult;
use crate::action::{Action, ActionSet};
use crate::event::Event;
use crate::handle::Slab;
use crate::instance::Instance;
use crate::session::Session;
use crate::space::{Anchor, Origin, Resolved, Space};
use crate::swapchain::Swapchain;

/// The living objects of all applications in this process.
pub(crate) struct Runtime {
    pub instances: Slab<Instance>,
    pub sessions: Slab<Session>,
    pub spaces: Slab<Space>,
    pub swapchains: Slab<Swapchain>,
    pub action_sets: Slab<ActionSet>,
    pub actions: Slab<Action>,
}

static RUNTIME: Mutex<Runtime> = Mutex::new(Runtime {
    instances: Slab::new(),
    sessions: Slab::new(),
    spaces: Slab::new(),
    swapchains: Slab::new(),
    action_sets: Slab::new(),
    actions: Slab::new(),
});

/// Wakes the calls of `xrWaitFrame` that wait for a frame to begin or for their session's end.
static FRAME_BEGUN: Condvar = Condvar::new();

/// The runtime, for as long as a call needs it. No call sleeps while it holds it.
pub(crate) fn runtime() -> MutexGuard<'static, Runtime> {
    // a panic in another call has been answered with RUNTIME_FAILURE; the tables stay whole
    RUNTIME.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Lets other calls through until a frame has begun somewhere.
pub(crate) fn wait_for_begun_frame(runtime: MutexGuard<'_, Runtime>) -> MutexGuard<'_, Runtime> {
    FRAME_BEGUN
        .wait(runtime)
        .unwrap_or_else(PoisonError::into_inner)
}

/// To be called when a frame has begun, or a session ended.
pub(crate) fn wake_waiting_frames() {
    FRAME_BEGUN.notify_all();
}

impl Runtime {
    /// A session and the instance it belongs to.
    pub fn session(&mut self, handle: sys::Session) -> XrResult<(&mut Session, &mut Instance)> {
        let session = self.sessions.get_mut(handle)?;
        let instance = self.instances.get_mut(session.instance)?;
        Ok((session, instance))
    }

    /// As [`Self::session`], to look at.
    pub fn peek(&self, handle: sys::Session) -> XrResult<(&Session, &Instance)> {
        let session = self.sessions.get(handle)?;
        Ok((session, self.instances.get(session.instance)?))
    }

    /// A space with what it is fixed to right now; `VALIDATION_FAILURE` for one of another session.
    pub fn resolve(&self, space: sys::Space, session: sys::Session) -> XrResult<Resolved> {
        let space = self.spaces.get(space)?;
        if space.session != session {
            return Err(sys::Result::ERROR_VALIDATION_FAILURE);
        }
        let anchor = match space.origin {
            Origin::Reference(ty) => Some(Anchor::Reference(ty)),
            Origin::Action { action, subaction } => {
                let input = self.sessions.get(session)?.input.as_ref();
                input
                    .and_then(|input| input.tracker(action, subaction))
                    .map(Anchor::Tracker)
            }
        };
        Ok(Resolved {
            anchor,
            origin_from_space: space.origin_from_space,
        })
    }

    /// Tells the application of its session's new states.
    pub fn announce(&mut self, handle: sys::Session, states: &[SessionState]) -> XrResult<()> {
        let (_, instance) = self.session(handle)?;
        let time = instance.clock.now();
        for &state in states {
            instance.events.push(Event::SessionState {
                session: handle,
                state,
                time,
            });
        }
        Ok(())
    }

    /// Ends a session with all that was made from it.
    pub fn destroy_session(&mut self, handle: sys::Session) -> XrResult<()> {
        let session = self.sessions.remove(handle)?;
        self.spaces.remove_where(|space| space.session == handle);
        self.swapchains
            .remove_where(|swapchain| swapchain.session == handle);
        self.instances
            .get_mut(session.instance)?
            .events
            .forget(handle);
        wake_waiting_frames();
        Ok(())
    }

    /// Ends an action set with its actions.
    pub fn destroy_action_set(&mut self, handle: sys::ActionSet) -> XrResult<()> {
        self.action_sets.remove(handle)?;
        self.actions.remove_where(|action| action.set == handle);
        Ok(())
    }

    /// Ends an instance with all that was made from it.
    pub fn destroy_instance(&mut self, handle: sys::Instance) -> XrResult<()> {
        self.instances.get(handle)?;
        let sessions: Vec<_> = self
            .sessions
            .iter()
            .filter(|(_, s)| s.instance == handle)
            .map(|(h, _)| h)
            .collect();
        for session in sessions {
            self.destroy_session(session)?;
        }
        let sets: Vec<_> = self
            .action_sets
            .iter()
            .filter(|(_, s)| s.instance == handle)
            .map(|(h, _)| h)
            .collect();
        for set in sets {
            self.destroy_action_set(set)?;
        }
        self.instances.remove(handle).map(drop)
    }
}
