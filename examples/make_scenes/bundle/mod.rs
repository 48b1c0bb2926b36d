//! The bundled scenes, one file each, and what they are built with.
//!
//! The files come out the same to the byte on every machine, so a test can hold them against this code: all arithmetic is
//! `+ - * /` and square root in f64, which IEEE 754 rounds one way only; the platform's own `sin` and `pow`, which may
//! differ in the last bit, are not used (see [`math`]).

mod chamber;
mod cornell;
mod furnace;
mod furniture;
mod gallery;
mod glb;
mod material;
mod math;
mod mesh;
mod painting;
mod room;
mod sculpture;
mod shapes;
mod texture;

/// A function that makes one scene's file.
pub type MakeGlb = fn() -> Vec<u8>;

/// Every bundled scene: its file's name, and what makes it.
pub const SCENES: [(&str, MakeGlb); 4] = [
    ("cornell.glb", cornell::make),
    ("furnace.glb", furnace::make),
    ("gallery.glb", gallery::make),
    ("room.glb", room::make),
];
