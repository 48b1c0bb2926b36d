//! Maps that are too small for the photons: what does not fit is counted, said, and made up for by what does.

use crate::runner::{Case, Expected, hold};
use crate::stages::{FURNACE, furnace};

pub fn cases() -> Vec<Case> {
    let case = |name, stored_per_path| {
        Case::new(name, furnace().load(), Expected::Mean(FURNACE))
            .set("photon.stored_per_path", stored_per_path)
            .set("photon.batch", "256")
            .photons_only("it has no map that could be full")
    };
    vec![
        case("a map for half of the photons", "0.5").warned("photon.stored_per_path"),
        case("a map for a tenth of the photons", "0.2").warned("photon.stored_per_path"),
        case("a map for all photons", "8"),
    ]
}

#[test]
fn a_full_map_is_told_and_its_picture_stays_as_bright() {
    hold("capacity", cases());
}
