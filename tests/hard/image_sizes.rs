//! Pictures of one pixel, of one row, of one column, and of odd sizes.

use crate::runner::{Case, Expected, hold};
use crate::stages::{FURNACE, furnace};

pub fn cases() -> Vec<Case> {
    let sizes = [
        ("1x1", 1, 1),
        ("1x17", 1, 17),
        ("33x1", 33, 1),
        ("7x5", 7, 5),
        ("31x65", 31, 65),
    ];
    let case = |(name, width, height)| {
        Case::new(name, furnace().load(), Expected::Mean(FURNACE))
            .size(width, height)
            .set("photon.count", "16000")
            .set("indirect.paths", "64")
            .set("fovea.samples", "16")
            .set("path.samples", "64")
    };
    sizes.into_iter().map(case).collect()
}

#[test]
fn pictures_may_have_any_size() {
    hold("image sizes", cases());
}
