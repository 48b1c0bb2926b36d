//! Light from lamps without extent by way of mirrors, glass and sharp lobes, which paths from the eye can't meet, or seldom: photons, kept
//! where they fall onto a surface that spreads light, and counted within a small disc.
//!
//! A way from a lamp to the eye begins with some surfaces that scatter by single directions or sharp lobes. Where a wide lobe follows
//! them, photons bring it that far. Where none does, the eye looks along sharp lobes all the way and paths find the lamp from the first of
//! these; photons bring it there by way of single directions before it.
//!
//! Source: Jensen, "Global Illumination using Photon Maps", 1996, section 2.1; the rest of the oracle needs no photons.
//! Limits: the one part of the oracle that blurs, by the disc's radius; vanishes with it, as do the photons in a disc.

use std::collections::HashMap;
use std::f64::consts::PI;

use glam::{DVec3, I64Vec3};
use rayon::prelude::*;

use super::geometry::{Ray, Surface};
use super::path::Oracle;
use super::random::Random;
use super::{bsdf::Bsdf, material};

/// Smallest cosine between the surfaces of a photon and of the point that counts it: corners stay apart.
const NORMAL_COS_MIN: f64 = 0.9;
/// Most surfaces that a photon meets: chance ends all but a few long before.
const DEPTH_MAX: u32 = 1024;
/// Surfaces that a photon meets before chance may end it, and its chance to go on from each after that.
const SURE_SURFACES: u32 = 8;
const SURVIVAL: f64 = 0.9;
/// Photons that one thread traces in a row.
const BATCH: u32 = 4096;
/// Sets the photons' random numbers apart from the pixels'.
const STREAM: u32 = 0x6361_7573;

struct Photon {
    position: DVec3,
    geometric_normal: DVec3,
    /// Unit, to where it came from.
    wi: DVec3,
    flux_w: DVec3,
    /// Surfaces that scattered it on its way.
    depth: u32,
    /// Whether one of these did by a sharp lobe.
    is_by_sharp_lobe: bool,
}

/// Photons of one pass.
pub(super) struct Caustics {
    /// In the order of their cells.
    photons: Vec<Photon>,
    /// First photon and the one after the last, by cell.
    cells: HashMap<I64Vec3, (usize, usize)>,
    radius_m: f64,
    emitted: f64,
}

impl Caustics {
    /// Traces `count` photons; what is nearer than `radius_m` counts as in one place.
    pub fn trace(oracle: &Oracle<'_>, count: u32, radius_m: f64, seed: u32, frame: u32) -> Self {
        let batches = count.div_ceil(BATCH);
        let mut photons: Vec<Photon> = (0..batches)
            .into_par_iter()
            .flat_map_iter(|batch| {
                let first = batch * BATCH;
                let mut kept = Vec::new();
                for index in first..count.min(first + BATCH) {
                    let mut random = Random::of([seed ^ STREAM, frame, index, STREAM]);
                    follow(oracle, &mut random, &mut kept);
                }
                kept
            })
            .collect();
        let cell_of = |photon: &Photon| cell(photon.position, radius_m).to_array();
        photons.par_sort_by_key(cell_of);
        let mut cells: HashMap<I64Vec3, (usize, usize)> = HashMap::new();
        for (index, photon) in photons.iter().enumerate() {
            let range = cells
                .entry(cell(photon.position, radius_m))
                .or_insert((index, index));
            range.1 = index + 1;
        }
        Self {
            photons,
            cells,
            radius_m,
            emitted: f64::from(count),
        }
    }

    /// Radiance that a surface reflects (or lets through) towards `wo`, W/(m² sr), of those that met `depth_max` surfaces before at most;
    /// by its wide lobes alone where the way on to the eye `has_wide_lobe`.
    pub fn radiance(
        &self,
        surface: &Surface,
        bsdf: &Bsdf,
        wo: DVec3,
        depth_max: u32,
        has_wide_lobe: bool,
    ) -> DVec3 {
        // Cells are as wide as the disc: it reaches into two along each axis at most.
        let lowest = cell(surface.position - self.radius_m, self.radius_m);
        let n = surface.scattering_normal(bsdf, wo);
        let mut sum = DVec3::ZERO;
        for offset in 0..8 {
            let neighbour = I64Vec3::new(offset & 1, offset >> 1 & 1, offset >> 2);
            let Some(&(first, end)) = self.cells.get(&(lowest + neighbour)) else {
                continue;
            };
            for photon in &self.photons[first..end] {
                let is_near = photon.position.distance_squared(surface.position)
                    <= self.radius_m * self.radius_m;
                let faces = photon.geometric_normal.dot(surface.geometric_normal).abs();
                let is_reflected = photon.wi.dot(n) > 0.0;
                let is_consistent = is_reflected == (photon.wi.dot(surface.geometric_normal) > 0.0);
                let is_short = photon.depth <= depth_max;
                if is_near && is_short && faces >= NORMAL_COS_MIN && is_consistent {
                    let f = match has_wide_lobe || photon.is_by_sharp_lobe {
                        true => bsdf.evaluate_wide(n, wo, photon.wi),
                        false => bsdf.evaluate(n, wo, photon.wi),
                    };
                    sum += photon.flux_w * f;
                }
            }
        }
        sum / (PI * self.radius_m * self.radius_m * self.emitted)
    }
}

/// Interpolated normals scatter sight and light differently: light that comes from `wi` and goes to `wo` about the normal `n` brings this
/// much more (Veach, 1997, equation 5.19).
fn adjoint_factor(surface: &Surface, n: DVec3, wi: DVec3, wo: DVec3) -> f64 {
    let geometric = surface.geometric_normal;
    let factor = (wi.dot(n) * wo.dot(geometric)) / (wi.dot(geometric) * wo.dot(n));
    // Both sides are those of a real surface, or the photon has ended.
    if factor.is_finite() {
        factor.abs()
    } else {
        0.0
    }
}

/// The same for light that ends here: the cosine that the interpolated normal makes of it over that of the surface that it fell on.
fn arrival_factor(surface: &Surface, wi: DVec3) -> f64 {
    let cos = wi.dot(surface.shading_normal).max(0.0);
    let factor = cos / wi.dot(surface.geometric_normal);
    if factor.is_finite() { factor } else { 0.0 }
}

fn cell(position: DVec3, radius_m: f64) -> I64Vec3 {
    (position / (2.0 * radius_m)).floor().as_i64vec3()
}

/// Follows one photon by single directions and sharp lobes, and keeps it wherever it falls onto a surface that may spread it.
fn follow(oracle: &Oracle<'_>, random: &mut Random, kept: &mut Vec<Photon>) {
    let Some((mut ray, mut flux_w)) = oracle.lights.emit(random) else {
        return;
    };
    let scene = oracle.geometry.scene;
    let mut medium = None;
    let mut is_by_sharp_lobe = false;
    for depth in 0..DEPTH_MAX {
        let Some((_, surface)) = oracle.first_surface(&ray, f64::INFINITY) else {
            return;
        };
        flux_w *= oracle.transmittance(medium, surface.position.distance(ray.origin));
        let bsdf = material::bsdf(scene, &surface);
        let wi = -ray.direction;
        let may_spread = material::may_spread(&scene.materials[surface.material]);
        if depth > 0 && (may_spread.widely || (may_spread.at_all && !is_by_sharp_lobe)) {
            kept.push(Photon {
                position: surface.position,
                geometric_normal: surface.geometric_normal,
                wi,
                flux_w: flux_w * arrival_factor(&surface, wi),
                depth,
                is_by_sharp_lobe,
            });
        }
        let n = surface.scattering_normal(&bsdf, wi);
        let sample = bsdf.sample(n, wi, random);
        let sample = sample.map(|sample| bsdf.part(n, wi, sample, random));
        // What goes in a wide lobe is met by paths from the eye.
        let sample = sample.and_then(|(sample, is_wide)| (!is_wide).then_some(sample));
        let Some(sample) = sample.and_then(|sample| surface.scattered(sample)) else {
            return;
        };
        is_by_sharp_lobe |= sample.density.is_some();
        flux_w *= sample.weight * adjoint_factor(&surface, n, wi, sample.wi);
        if let Some(interface) = bsdf.interface.filter(|i| sample.is_refracted && !i.is_thin) {
            // Radiance is squeezed in glass; flux is not.
            flux_w *= interface.ior * interface.ior;
        }
        if depth >= SURE_SURFACES {
            if random.uniform() >= SURVIVAL {
                return;
            }
            flux_w /= SURVIVAL;
        }
        medium = oracle.medium_beyond(medium, &surface, sample.is_refracted);
        ray = Ray {
            origin: surface.position,
            direction: sample.wi,
        };
    }
}
