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

/// The integral of `f` over each bin, by the midpoints of 24 x 24 equal parts.
pub fn bin_integrals(f: impl Fn(DVec3) -> f64) -> Vec<f64> {
    const PARTS: usize = 24;
    let solid_angle = 4.0 * PI / (RINGS * SECTORS * PARTS * PARTS) as f64;
    (0..BINS)
        .map(|bin| {
            let sum: f64 = (0..PARTS * PARTS)
                .map(|part| {
                    let part_of = |i: usize, of: usize| {
                        (i as f64
                            + ((if of == 0 { part / PARTS } else { part % PARTS }) as f64 + 0.5)
                                / PARTS as f64)
                            / (if of == 0 { RINGS } else { SECTORS }) as f64
                    };
                    let z = 2.0 * part_of(bin / SECTORS, 0) - 1.0;
                    let phi = 2.0 * PI * part_of(bin % SECTORS, 1);
                    let r = (1.0 - z * z).sqrt();
                    f(DVec3::new(r * phi.cos(), r * phi.sin(), z))
                })
                .sum();
            sum * solid_angle
        })
        .collect()
}
