//! Bins of equal solid angle over the sphere.

use std::f64::consts::PI;

use glam::DVec3;

const RINGS: usize = 24;
const SECTORS: usize = 24;
/// Bins over the sphere.
pub const BINS: usize = RINGS * SECTORS;

/// Where a direction falls in a grid of equal solid angles over the sphere.
pub fn bin_of(wi: DVec3) -> usize {
    let ring = (0.5 * (wi.z + 1.0) * RINGS as f64) as usize;
    let turn = wi.y.atan2(wi.x).rem_euclid(2.0 * PI) / (2.0 * PI);
    ring.min(RINGS - 1) * SECTORS + ((turn * SECTORS as f64) as usize).min(SECTORS - 1)
}

/// Parts of a bin along each side, and along each side where a lobe may be narrower than those.
const PARTS: [usize; 2] = [24, 120];
/// The density from which a bin may hold such a lobe: sixteen times that of a sphere evenly filled.
const BRIGHT: f64 = 16.0 / (4.0 * PI);

/// The integral of `f` over each bin, by the midpoints of equal parts.
pub fn bin_integrals(f: impl Fn(DVec3) -> f64) -> Vec<f64> {
    let bins = (0..BINS).map(|bin| {
        let (sum, largest) = midpoints(bin, PARTS[0], &f);
        match largest < BRIGHT {
            true => sum,
            false => midpoints(bin, PARTS[1], &f).0,
        }
    });
    bins.collect()
}

/// The integral over a bin, by the midpoints of `parts` x `parts` equal parts, and the largest value that was met.
fn midpoints(bin: usize, parts: usize, f: &impl Fn(DVec3) -> f64) -> (f64, f64) {
    let solid_angle = 4.0 * PI / (BINS * parts * parts) as f64;
    let at = |place: usize, part: usize| place as f64 + (part as f64 + 0.5) / parts as f64;
    let values = (0..parts * parts).map(|part| {
        let z = 2.0 * at(bin / SECTORS, part / parts) / RINGS as f64 - 1.0;
        let phi = 2.0 * PI * at(bin % SECTORS, part % parts) / SECTORS as f64;
        let r = (1.0 - z * z).sqrt();
        f(DVec3::new(r * phi.cos(), r * phi.sin(), z))
    });
    let fold = |(sum, largest): (f64, f64), value: f64| (sum + value, largest.max(value));
    let (sum, largest) = values.fold((0.0, 0.0), fold);
    (sum * solid_angle, largest)
}
