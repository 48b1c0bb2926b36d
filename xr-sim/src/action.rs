//! Action sets and actions as the application defines them; `input` gives them their states.

use openxr_sys as sys;

use crate::handle::Object;

/// Actions that are switched on and off together.
#[derive(Debug)]
pub(crate) struct ActionSet {
    pub instance: sys::Instance,
    pub name: String,
    pub localized_name: String,
    pub priority: u32,
    /// Attached to a session once, it can't be changed any more.
    pub is_attached: bool,
}

impl Object for ActionSet {
    type Handle = sys::ActionSet;
    const KIND: u8 = 5;
}

/// Something that the user does, whatever it is done with.
#[derive(Debug)]
pub(crate) struct Action {
    pub set: sys::ActionSet,
    pub name: String,
    pub localized_name: String,
    pub kind: sys::ActionType,
    /// The top-level user paths that it is told apart by.
    pub subactions: Vec<sys::Path>,
}

impl Object for Action {
    type Handle = sys::Action;
    const KIND: u8 = 6;
}
