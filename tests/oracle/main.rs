//! The oracle against what is known without it, and the device's sampling and scattering against the oracle.

mod bsdf;
mod device;
mod kinds;
mod references;
mod sharp_lobes;
mod sphere;

#[path = "../common/chi_squared.rs"]
mod chi_squared;
#[allow(dead_code, reason = "other tests use the rest of it")]
#[path = "../common/glb.rs"]
mod glb;
#[allow(dead_code, reason = "other tests use the rest of it")]
#[path = "../common/maker.rs"]
mod maker;
#[path = "../common/shared.rs"]
mod shared;
