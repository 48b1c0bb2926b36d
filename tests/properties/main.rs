//! Properties over random input. `make test` runs some thousand cases with one seed, `make test-long` more than a hundred thousand with
//! new ones (`PROPTEST_CASES`, as a multiple of 256); every property says how many really ran.

mod eyes;
mod files;
mod knobs;
mod params;
mod photons;
mod pictures;
mod runner;
mod scattering;
mod scenes;

#[path = "../common/energy_bound.rs"]
mod energy_bound;
#[allow(dead_code, reason = "other tests use the rest of it")]
#[path = "../common/glb.rs"]
mod glb;
#[allow(dead_code, reason = "other tests use the rest of it")]
#[path = "../common/maker.rs"]
mod maker;
#[path = "../common/photon_flux.rs"]
mod photon_flux;
#[path = "../common/untrusted.rs"]
mod untrusted;

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Keeps the device to one test at a time, so that each can tell what memory it holds.
fn alone() -> MutexGuard<'static, ()> {
    static DEVICE: Mutex<()> = Mutex::new(());
    DEVICE.lock().unwrap_or_else(PoisonError::into_inner)
}
