//! The runtime as an application in this process meets it.

#[path = "../common/mod.rs"]
mod common;

mod actions;
mod codes;
mod gaze;
mod layers;
mod order;
mod replay;
mod session;
