//! The queue that `xrPollEvent` empties.

use std::collections::VecDeque;

use openxr_sys as sys;

/// An application that doesn't poll loses events beyond this, and is told so.
const MAX_QUEUED: usize = 1024;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Event {
    SessionState {
        session: sys::Session,
        state: sys::SessionState,
        time: sys::Time,
    },
    InteractionProfileChanged {
        session: sys::Session,
    },
    EventsLost {
        count: u32,
    },
}

#[derive(Debug, Default)]
pub(crate) struct EventQueue {
    events: VecDeque<Event>,
    lost: u32,
}

impl EventQueue {
    pub fn push(&mut self, event: Event) {
        if self.events.len() < MAX_QUEUED {
            self.events.push_back(event);
        } else {
            self.lost += 1;
        }
    }

    /// The oldest event; after the ones that were kept, how many were lost.
    pub fn pop(&mut self) -> Option<Event> {
        self.events
            .pop_front()
            .or_else(|| match std::mem::take(&mut self.lost) {
                0 => None,
                count => Some(Event::EventsLost { count }),
            })
    }

    /// A session that is gone has nothing to tell any more.
    pub fn forget(&mut self, gone: sys::Session) {
        self.events.retain(|event| match event {
            Event::SessionState { session, .. } | Event::InteractionProfileChanged { session } => {
                *session != gone
            }
            Event::EventsLost { .. } => true,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_beyond_the_queue_are_counted_and_told() {
        let mut queue = EventQueue::default();
        for _ in 0..MAX_QUEUED + 3 {
            queue.push(Event::InteractionProfileChanged {
                session: sys::Session::default(),
            });
        }
        for _ in 0..MAX_QUEUED {
            assert!(matches!(
                queue.pop(),
                Some(Event::InteractionProfileChanged { .. })
            ));
        }
        assert_eq!(queue.pop(), Some(Event::EventsLost { count: 3 }));
        assert_eq!(queue.pop(), None);
    }
}
