//! The oracle: a path tracer in f64 on the host, by the definitions of materials and lights, that other techniques are judged against.
//!
//! It is slow and right. It shares the loaded scene with them and no code of light transport: not a formula of `photon/`, `gather/` or
//! the shaders is used here. Source: Kajiya, "The Rendering Equation", 1986; multiple importance sampling after Veach, 1997, chapter 9.
//! Limits: where a light without extent shines through glass or by way of a mirror, which no path from the eye can meet, photons of its
//! own ([`PathSettings::caustic_photons`]) blur that light over a small radius; everything else is unbiased.

pub mod bsdf;
pub mod random;

mod caustics;
mod geometry;
mod light;
mod material;
mod path;

pub use geometry::Ray;
pub use path::{Oracle, PathSettings};
