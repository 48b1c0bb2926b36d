//! Pictures against closed forms and independent references, what holds for every picture, and the device's own building blocks.
//!
//! Every comparison has a negative control beside it: the same check on a picture that is wrong.

mod aimed_caustics;
mod closed_forms;
mod determinism;
mod device;
mod effects;
mod energy;
mod filter;
mod light_importance;
mod references;
mod temporal;

#[allow(dead_code, reason = "other tests use the rest of it")]
#[path = "../common/glb.rs"]
mod glb;
#[allow(dead_code, reason = "other tests use the rest of it")]
#[path = "../common/maker.rs"]
mod maker;
#[path = "../common/photon_flux.rs"]
mod photon_flux;
#[path = "../common/shared.rs"]
mod shared;
