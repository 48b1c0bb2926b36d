//! The oracle: a path tracer in f64 on the host, by the definitions of materials and lights, that other techniques are judged against.
//!
//! It is slow and right. It shares the loaded scene with them and no code of light transport: not a formula of `photon/`, `gather/` or
//! the shaders is used here. Source: Kajiya, "The Rendering Equation", 1986; multiple importance sampling after Veach, 1997, chapter 9.
//! Limits: a path tracer can't see a point, spot or directional light through glass or mirrors, where photons can.

pub mod bsdf;
pub mod random;

mod geometry;
mod light;
mod material;
mod path;

pub use geometry::Ray;
pub use path::Oracle;
