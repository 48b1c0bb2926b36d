//! Shapes beyond the plainest: rounded, swept and turned ones.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DVec2, DVec3};

use super::math::sin_cos;
use super::mesh::{Mesh, joined};

/// A box about the origin with rounded edges: `round_cells` cells across each edge's rounding, `flat_cells` between.
pub fn rounded_cuboid(half: DVec3, radius_m: f64, round_cells: u32, flat_cells: u32) -> Mesh {
    let cells = 2 * round_cells + flat_cells;
    // Where the grid's lines lie along a half-length, in its own units.
    let line = |half_m: f64, at: f64| {
        let (index, inner) = ((at * cells as f64).round() as u32, half_m - radius_m);
        let fraction = |from: u32, count: u32| (index - from) as f64 / count as f64;
        if index <= round_cells {
            -half_m + radius_m * fraction(0, round_cells)
        } else if index <= round_cells + flat_cells {
            -inner + 2.0 * inner * fraction(round_cells, flat_cells)
        } else {
            inner + radius_m * fraction(round_cells + flat_cells, round_cells)
        }
    };
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let faces = [(y, z), (z, y), (z, x), (x, z), (x, y), (y, x)];
    joined(faces.map(|(u_axis, v_axis)| {
        let out = u_axis.cross(v_axis);
        Mesh::sheet(cells, cells, |u, v| {
            let on_box = out * half
                + u_axis * line(half.dot(u_axis), u)
                + v_axis * line(half.dot(v_axis), v);
            let core = on_box.clamp(radius_m - half, half - radius_m);
            core + (on_box - core).normalize() * radius_m
        })
    }))
}

/// Blows a box of half-lengths `half` up by `height_m` along its thin axis, most in the middle, like a cushion's filling.
pub fn puffed(mesh: Mesh, half: DVec3, thin_axis: DVec3, height_m: f64) -> Mesh {
    mesh.deformed(|p| {
        let share = DVec3::ONE - (p / half) * (p / half);
        let flat = share.max(DVec3::ZERO) * (DVec3::ONE - thin_axis) + thin_axis;
        let side = (p / half).dot(thin_axis);
        p + thin_axis * (height_m * side * flat.element_product())
    })
}

/// A tube along `path(t)`, t in \[0,1\], which gives its centre, its radius, and a direction from which angles around it count. It is
/// closed where its ends meet or its radius is zero.
pub fn tube(sides: u32, rings: u32, path: impl Fn(f64) -> (DVec3, f64, DVec3)) -> Mesh {
    const STEP: f64 = 1e-5;
    Mesh::sheet(sides, rings, |u, v| {
        let (center, radius_m, reference) = path(v);
        let tangent = (path(v + STEP).0 - path(v - STEP).0).normalize();
        let first = reference.reject_from_normalized(tangent).normalize();
        let second = tangent.cross(first);
        let (sin, cos) = sin_cos(u * TAU);
        center + (first * cos + second * sin) * radius_m
    })
}

/// A straight round rod with flat ends.
pub fn rod(from: DVec3, to: DVec3, radius_m: f64, sides: u32) -> Mesh {
    let axis = (to - from).normalize();
    let reference = axis.any_orthogonal_vector();
    // Four rings: the end's centre, its rim, and the same at the other end.
    tube(sides, 3, |t| {
        let ring = (t * 3.0).round();
        let center = if ring < 1.5 { from } else { to };
        let radius_m = if ring == 1.0 || ring == 2.0 {
            radius_m
        } else {
            0.0
        };
        (center + axis * (t - ring / 3.0), radius_m, reference)
    })
}

/// A ring about +Y: a circle of radius `thickness_m` turned at distance `radius_m`.
pub fn torus(radius_m: f64, thickness_m: f64, segments: u32, sides: u32) -> Mesh {
    let profile: Vec<DVec2> = (0..=sides)
        .map(|side| {
            let (sin, cos) = sin_cos(side as f64 / sides as f64 * TAU);
            DVec2::new(radius_m + thickness_m * cos, thickness_m * sin)
        })
        .collect();
    Mesh::lathe(&profile, segments)
}

/// A leaf that grows along +Z from the origin with its upper face to +Y, bent down by `droop_rad` towards its tip.
pub fn leaf(length_m: f64, width_m: f64, droop_rad: f64) -> Mesh {
    Mesh::sheet(4, 12, |u, v| {
        let side = 2.0 * u - 1.0;
        // Widest a third of the way, pointed at the tip.
        let half_width_m = 0.5 * width_m * 2.6 * v.sqrt() * (1.0 - v);
        let (sin, cos) = sin_cos(droop_rad * v);
        let fold_m = 0.35 * half_width_m * side.abs();
        let along_m = length_m * v;
        DVec3::new(
            -half_width_m * side,
            fold_m - along_m * sin * v,
            along_m * (0.4 + 0.6 * cos),
        )
    })
}

/// A smooth curve through `points` (Catmull and Rom's), `cells` a span.
pub fn curve(points: &[DVec2], cells: u32) -> Vec<DVec2> {
    let last = points.len() - 1;
    let mut curve = vec![points[0]];
    for (span, ends) in points.windows(2).enumerate() {
        let before = points[span.saturating_sub(1)];
        let after = points[(span + 2).min(last)];
        let (start, end) = (ends[0], ends[1]);
        for cell in 1..=cells {
            let t = cell as f64 / cells as f64;
            let (t2, t3) = (t * t, t * t * t);
            let point = start * 2.0
                + (end - before) * t
                + (before * 2.0 - start * 5.0 + end * 4.0 - after) * t2
                + (start * 3.0 - before - end * 3.0 + after) * t3;
            curve.push((point * 0.5).max(DVec2::new(0.0, f64::MIN)));
        }
    }
    curve
}

/// The profile of a pot `wall_m` thick: up along the outside `points`, over a round rim, and down inside to the bottom's middle.
pub fn vessel(points: &[DVec2], cells: u32, wall_m: f64) -> Vec<DVec2> {
    let outside = curve(points, cells);
    let mut profile = vec![DVec2::new(0.0, outside[0].y)];
    profile.extend(&outside);
    let rim = outside[outside.len() - 1] - DVec2::new(0.5 * wall_m, 0.0);
    for cell in 1..4 {
        let (sin, cos) = sin_cos(cell as f64 / 4.0 * 2.0 * FRAC_PI_2);
        profile.push(rim + DVec2::new(cos, sin) * 0.5 * wall_m);
    }
    let floor_m = outside[0].y + wall_m;
    let inside = outside.iter().rev().map(|p| *p - DVec2::new(wall_m, 0.0));
    profile.extend(inside.filter(|p| p.y > floor_m && p.x > 0.0));
    let innermost = profile[profile.len() - 1].x;
    profile.push(DVec2::new(0.7 * innermost, floor_m));
    profile.push(DVec2::new(0.0, floor_m));
    profile
}
