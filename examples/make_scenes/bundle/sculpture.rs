//! Sculptures and plinths of the gallery, each standing on its origin.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DVec2, DVec3};

use super::furniture::CREASE_DEG;
use super::math::{rotation, sin_cos};
use super::mesh::{Mesh, joined};
use super::shapes::{curve, rounded_cuboid, torus, tube};

/// A trefoil knot, standing upright.
pub fn knot(radius_m: f64) -> Mesh {
    let center = |t: f64| {
        let (sin2, cos2) = sin_cos(2.0 * TAU * t);
        let (sin3, cos3) = sin_cos(3.0 * TAU * t);
        let around = radius_m * (0.68 + 0.3 * cos3);
        DVec3::new(around * cos2, around * sin2, 0.34 * radius_m * sin3)
    };
    let knot = tube(28, 224, |t| (center(t), 0.17 * radius_m, DVec3::Z));
    standing(knot).shaded(60.0)
}

/// A band with one side only, made solid: an oval carried once round, and half a turn about its path.
pub fn moebius(radius_m: f64) -> Mesh {
    let band = Mesh::sheet(48, 128, |u, v| {
        let (sin, cos) = sin_cos(TAU * v);
        let out = DVec3::new(cos, sin, 0.0);
        let (across_sin, across_cos) = sin_cos(0.5 * TAU * v);
        let (wide_sin, wide_cos) = sin_cos(TAU * u);
        let wide = out * across_cos + DVec3::Z * across_sin;
        let thin = DVec3::Z * across_cos - out * across_sin;
        out * radius_m + wide * (0.36 * radius_m * wide_cos) - thin * (0.05 * radius_m * wide_sin)
    });
    standing(band).shaded(60.0)
}

/// A square column that winds up and narrows.
pub fn wound_column(height_m: f64) -> Mesh {
    let half = DVec3::new(0.14, 0.5 * height_m, 0.14);
    let column = rounded_cuboid(half, 0.03, 3, 28).deformed(|p| {
        let up = (p.y + half.y) / height_m;
        let shrink = DVec3::new(1.0 - 0.45 * up, 1.0, 1.0 - 0.45 * up);
        rotation(DVec3::Y, 1.2 * FRAC_PI_2 * up) * (p * shrink)
    });
    standing(column).shaded(50.0)
}

/// A drop that tapers upward.
pub fn drop(height_m: f64) -> Mesh {
    let outline = [
        [0.0, 0.0],
        [0.19, 0.04],
        [0.27, 0.2],
        [0.22, 0.42],
        [0.1, 0.68],
        [0.03, 0.9],
        [0.0, 1.0],
    ];
    let profile = curve(&outline.map(|p| DVec2::from_array(p) * height_m), 8);
    Mesh::lathe(&profile, 72).shaded(60.0)
}

/// Three rings through each other.
pub fn rings(radius_m: f64) -> Mesh {
    let ring = torus(radius_m, 0.11 * radius_m, 72, 20);
    let turned = [
        (DVec3::X, FRAC_PI_2),
        (DVec3::Z, FRAC_PI_2),
        (DVec3::X, 0.3),
    ]
    .map(|(axis, angle_rad)| ring.clone().turned(rotation(axis, angle_rad)));
    standing(joined(turned)).shaded(60.0)
}

/// An egg.
pub fn egg(height_m: f64) -> Mesh {
    let egg = Mesh::icosphere(0.5 * height_m, 4).deformed(|p| {
        let up = p.y / height_m;
        p * DVec3::new(0.78 - 0.25 * up, 1.0, 0.78 - 0.25 * up)
    });
    standing(egg).shaded(60.0)
}

/// A square plinth.
pub fn plinth(width_m: f64, height_m: f64) -> Mesh {
    let half = DVec3::new(0.5 * width_m, 0.5 * height_m, 0.5 * width_m);
    standing(rounded_cuboid(half, 0.006, 2, 1)).shaded(CREASE_DEG)
}

/// The mesh moved up so that its lowest point is at height 0.
fn standing(mesh: Mesh) -> Mesh {
    let low = mesh.positions.iter().fold(f64::MAX, |low, p| low.min(p.y));
    mesh.moved(DVec3::NEG_Y * low)
}
