//! Photons: emitted at the lights, traced through the scene, kept in a sorted grid. Knows no gaze and no technique.

pub mod map;
pub mod sort;
pub mod store;
pub mod trace;

pub use map::{MapSettings, PhotonMap};
pub use store::{PhotonClass, PhotonStore};
pub use trace::{PhotonTracer, TraceSettings};
