//! The oracle's parts against what is known without it.

mod bsdf;
