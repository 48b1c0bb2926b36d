//! What stands in the rooms, each piece about its own origin on the floor (or where it stands), its front towards +Z.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DVec2, DVec3};

use super::math::{rotation, sin_cos};
use super::mesh::{Mesh, joined};
use super::shapes::{curve, leaf, puffed, rod, rounded_cuboid, torus, tube, vessel};
use super::texture::hash;

/// Above this angle between faces an edge is sharp, degrees.
pub const CREASE_DEG: f64 = 35.0;

/// A seat of `places` cushions, `width_m` between its arms' outer sides: its upholstery, and its feet.
pub fn sofa(width_m: f64, places: u32) -> (Mesh, Mesh) {
    let inner_m = width_m - 0.4;
    let block = |half: DVec3, center: DVec3| rounded_cuboid(half, 0.05, 3, 2).moved(center);
    let mut parts = vec![
        block(
            DVec3::new(0.5 * width_m - 0.02, 0.1, 0.42),
            DVec3::new(0.0, 0.21, 0.0),
        ),
        block(
            DVec3::new(0.5 * inner_m + 0.06, 0.33, 0.11),
            DVec3::new(0.0, 0.5, -0.33),
        ),
    ];
    for side in [-1.0, 1.0] {
        let center = DVec3::new(side * (0.5 * width_m - 0.1), 0.34, 0.0);
        parts.push(block(DVec3::new(0.1, 0.26, 0.45), center));
    }
    let half_width = 0.5 * inner_m / f64::from(places) - 0.004;
    for place in 0..places {
        let x = (f64::from(place) + 0.5) * inner_m / f64::from(places) - 0.5 * inner_m;
        let seat = DVec3::new(half_width, 0.07, 0.34);
        let seat = puffed(rounded_cuboid(seat, 0.05, 3, 7), seat, DVec3::Y, 0.03);
        parts.push(seat.moved(DVec3::new(x, 0.385, 0.1)));
        let back = DVec3::new(half_width, 0.2, 0.07);
        let back = puffed(rounded_cuboid(back, 0.05, 3, 7), back, DVec3::Z, 0.05);
        let lean = rotation(DVec3::X, -0.2);
        parts.push(back.turned(lean).moved(DVec3::new(x, 0.66, -0.14)));
    }
    let foot = Mesh::lathe(
        &[[0.0, 0.0], [0.018, 0.0], [0.03, 0.12], [0.0, 0.12]].map(DVec2::from_array),
        16,
    );
    let feet = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)].map(|(x, z)| {
        foot.clone()
            .moved(DVec3::new(x * (0.5 * width_m - 0.1), 0.0, z * 0.34))
    });
    (
        joined(parts).shaded(CREASE_DEG),
        joined(feet).shaded(CREASE_DEG),
    )
}

/// A throw pillow, pinched at its corners, leaning back.
pub fn pillow(size_m: f64) -> Mesh {
    let half = DVec3::new(0.5 * size_m, 0.5 * size_m, 0.03);
    let pillow = rounded_cuboid(half, 0.025, 3, 8).deformed(|p| {
        let (x, y) = (p.x / half.x, p.y / half.y);
        // Corners stand out, sides draw in.
        let drawn = DVec3::new(1.0 - 0.12 * (1.0 - y * y), 1.0 - 0.12 * (1.0 - x * x), 1.0);
        let full = ((1.0 - x * x) * (1.0 - y * y)).max(0.0).sqrt();
        p * drawn * DVec3::new(1.0, 1.0, 0.35 + 2.4 * full)
    });
    pillow.turned(rotation(DVec3::X, -0.35)).shaded(60.0)
}

/// A book of the given size standing on the floor with its spine to +Z: its cover, whose texture coordinates pick spine `style` of
/// sixteen, and its pages.
pub fn book(size: DVec3, style: u32) -> (Mesh, Mesh) {
    const BOARD_M: f64 = 0.0025;
    let half_m = 0.5 * size.x;
    let spine_z = 0.5 * size.z - 0.3 * half_m;
    let mut cover = Vec::new();
    for side in [-1.0, 1.0] {
        let (outer, inner) = (side * half_m, side * (half_m - BOARD_M));
        let min = DVec3::new(outer.min(inner), 0.0, -0.5 * size.z);
        let max = DVec3::new(outer.max(inner), size.y, spine_z);
        cover.push(Mesh::cuboid(min, max));
    }
    // The spine: a flat arch of eight strips, closed behind.
    let arch = |t: f64| {
        let (sin, cos) = sin_cos((1.0 - t) * 2.0 * FRAC_PI_2);
        DVec3::new(half_m * cos, 0.0, spine_z + 0.3 * half_m * sin)
    };
    cover.push(Mesh::sheet(6, 1, |u, v| arch(u) + DVec3::Y * (v * size.y)));
    let behind = DVec3::new(half_m, 0.0, spine_z);
    cover.push(Mesh::wall(
        behind,
        (DVec3::NEG_X, size.x),
        (DVec3::Y, size.y),
        &[],
    ));
    let cap = Mesh::sheet(8, 1, |u, v| {
        arch(u).lerp(DVec3::new(half_m * (2.0 * u - 1.0), 0.0, spine_z), v)
    });
    cover.push(cap.clone().moved(DVec3::Y * size.y));
    cover.push(cap.flipped());
    let cover = joined(cover).textured(|p, _| {
        let across = (0.05 + 0.9 * (p.x / size.x + 0.5)).clamp(0.05, 0.95);
        DVec2::new((f64::from(style) + across) / 16.0, 1.0 - p.y / size.y)
    });
    let pages = Mesh::cuboid(
        DVec3::new(BOARD_M - half_m, 0.003, 0.004 - 0.5 * size.z),
        DVec3::new(half_m - BOARD_M, size.y - 0.003, spine_z - 0.001),
    );
    (cover.shaded(CREASE_DEG), pages.shaded(CREASE_DEG))
}

/// Books side by side along +X from the origin until `width_m` is full: their covers and pages. `seed` says which books.
pub fn row_of_books(width_m: f64, height_m: f64, seed: i64) -> (Mesh, Mesh) {
    let (mut covers, mut pages) = (Mesh::default(), Mesh::default());
    let mut x = 0.0;
    for number in 0.. {
        let random = |salt: i64| hash(seed * 1000 + number, salt);
        let size = DVec3::new(
            0.018 + 0.03 * random(1) * random(2),
            height_m * (0.68 + 0.26 * random(3)),
            0.15 + 0.05 * random(4),
        );
        if x + size.x > width_m {
            break;
        }
        let (cover, leaves) = book(size, (random(5) * 16.0) as u32);
        let place = DVec3::new(x + 0.5 * size.x, 0.0, -0.5 * size.z - 0.02 * random(6));
        covers.append(cover.moved(place));
        pages.append(leaves.moved(place));
        x += size.x + 0.0008;
    }
    (covers, pages)
}

/// A pot plant: its pot, its earth, and its stems and leaves.
pub fn plant(height_m: f64, leaves: u32) -> (Mesh, Mesh, Mesh) {
    let outline = [
        [0.13, 0.0],
        [0.17, 0.12],
        [0.19, 0.26],
        [0.185, 0.34],
        [0.2, 0.36],
    ];
    let pot = Mesh::lathe(&vessel(&outline.map(DVec2::from_array), 5, 0.015), 40);
    let earth = Mesh::lathe(&[DVec2::new(0.172, 0.3), DVec2::new(0.0, 0.31)], 24);
    let mut greens = Vec::new();
    for number in 0..leaves {
        let random = |salt: i64| hash(i64::from(number), salt);
        // Leaves follow one another by the golden angle, the outer ones lower.
        let share = (f64::from(number) + 0.5) / f64::from(leaves);
        let turn = rotation(DVec3::Y, f64::from(number) * 2.399_963);
        let reach_m = 0.06 + 0.32 * share;
        let top_m = 0.3 + (height_m - 0.3) * (1.0 - 0.75 * share) * (0.85 + 0.15 * random(1));
        let root = DVec3::new(0.0, 0.3, 0.03);
        let tip = DVec3::new(0.0, top_m, reach_m);
        let bend = DVec3::new(0.0, top_m, 0.3 * reach_m);
        let stem = tube(6, 8, |t| {
            let center =
                root * ((1.0 - t) * (1.0 - t)) + bend * (2.0 * t * (1.0 - t)) + tip * (t * t);
            (center, 0.005 * (1.0 - 0.6 * t), DVec3::X)
        });
        let length_m = 0.26 + 0.14 * random(2);
        let blade = leaf(length_m, 0.4 * length_m, 0.7 + 0.8 * random(3));
        let blade = blade
            .turned(rotation(DVec3::X, 0.5 * (share - 0.6)))
            .moved(tip);
        greens.extend([stem.turned(turn), blade.turned(turn)]);
    }
    (
        pot.shaded(CREASE_DEG),
        earth.shaded(CREASE_DEG),
        joined(greens).shaded(60.0),
    )
}

/// A lamp for a table: its foot, its brass stem, its shade, and its bulb.
pub fn table_lamp() -> [Mesh; 4] {
    let points = |profile: &[[f64; 2]]| -> Vec<DVec2> {
        profile.iter().map(|p| DVec2::from_array(*p)).collect()
    };
    let mut foot = points(&[[0.0, 0.0], [0.07, 0.0]]);
    let belly = [
        [0.07, 0.0],
        [0.075, 0.015],
        [0.06, 0.03],
        [0.1, 0.12],
        [0.09, 0.2],
        [0.035, 0.27],
        [0.03, 0.29],
    ];
    foot.extend(curve(&points(&belly), 5));
    foot.push(DVec2::new(0.0, 0.29));
    let stem = rod(DVec3::Y * 0.289, DVec3::Y * 0.36, 0.008, 16);
    // Two skins 2 mm apart, joined at both rims.
    let shade = points(&[
        [0.19, 0.3],
        [0.12, 0.56],
        [0.118, 0.56],
        [0.188, 0.3],
        [0.19, 0.3],
    ]);
    let bulb = Mesh::sphere(0.035, 2).moved(DVec3::Y * 0.4);
    [
        Mesh::lathe(&foot, 40).shaded(CREASE_DEG),
        stem.shaded(CREASE_DEG),
        Mesh::lathe(&shade, 64).shaded(CREASE_DEG),
        bulb,
    ]
}

/// A drawn curtain of `width_m` × `height_m` that hangs in folds from the origin down, along +X.
pub fn curtain(width_m: f64, height_m: f64, folds: f64) -> Mesh {
    let sheet = Mesh::sheet(104, 24, |u, v| {
        let down = 1.0 - v;
        let (fold, _) = sin_cos(TAU * folds * u + 0.5 * down);
        let (slow, _) = sin_cos(TAU * (folds * 0.37 * u + 0.3 * down));
        let depth_m = (0.022 + 0.02 * down) * fold + 0.014 * down * slow;
        DVec3::new(
            width_m * u * (1.0 - 0.06 * down),
            height_m * (v - 1.0),
            depth_m,
        )
    });
    sheet.shaded(60.0)
}

/// A picture frame about a picture of `width_m` × `height_m` that hangs with its back on z = 0: four mitred mouldings.
pub fn picture_frame(width_m: f64, height_m: f64, moulding_m: f64) -> Mesh {
    // Outward distance from the picture's edge, and height over the wall, in mouldings.
    let steps = [
        [0.0, 0.0],
        [0.0, 0.3],
        [0.15, 0.38],
        [0.3, 0.36],
        [0.45, 0.5],
        [0.7, 0.62],
        [0.9, 0.5],
        [1.0, 0.3],
        [1.0, 0.0],
    ];
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let sides = (0..4).map(|side| {
        let at = |corner: usize, step: [f64; 2]| {
            let (x, y) = corners[corner % 4];
            let out = step[0] * moulding_m;
            DVec3::new(
                x * (0.5 * width_m + out),
                y * (0.5 * height_m + out),
                step[1] * moulding_m,
            )
        };
        Mesh::sheet(1, 8, |u, v| {
            let step = steps[(v * 8.0).round() as usize];
            at(side + 1, step).lerp(at(side, step), u)
        })
    });
    joined(sides).shaded(CREASE_DEG)
}

/// The picture for [`picture_frame`], a little over the wall.
pub fn picture(width_m: f64, height_m: f64, moulding_m: f64) -> Mesh {
    let corner = DVec3::new(-0.5 * width_m, -0.5 * height_m, 0.2 * moulding_m);
    Mesh::wall(corner, (DVec3::X, width_m), (DVec3::Y, height_m), &[])
        .textured(|_, uv| DVec2::new(uv.x / width_m, 1.0 - uv.y / height_m))
        .shaded(CREASE_DEG)
}

/// A round mirror that hangs with its back on z = 0: the glass, and its frame.
pub fn round_mirror(radius_m: f64) -> (Mesh, Mesh) {
    let upright = rotation(DVec3::X, FRAC_PI_2);
    let disc = Mesh::lathe(&[DVec2::new(radius_m, 0.012), DVec2::new(0.0, 0.012)], 96);
    let frame = torus(radius_m, 0.02, 80, 12).moved(DVec3::Y * 0.02);
    (
        disc.shaded(CREASE_DEG).turned(upright),
        frame.shaded(CREASE_DEG).turned(upright),
    )
}

/// A door with two raised panels that stands before a wall at z = 0.
pub fn door(width_m: f64, height_m: f64) -> Mesh {
    let half = DVec3::new(0.5 * width_m, 0.5 * height_m, 0.02);
    let mut door = vec![rounded_cuboid(half, 0.01, 2, 1).moved(half.with_x(0.0))];
    for (low, high) in [(0.1, 0.42), (0.49, 0.93)] {
        let half = DVec3::new(0.34 * width_m, 0.5 * (high - low) * height_m, 0.012);
        let center = DVec3::new(0.0, 0.5 * (low + high) * height_m, 0.045);
        door.push(rounded_cuboid(half, 0.01, 2, 1).moved(center));
    }
    joined(door)
}

/// A vessel turned about +Y from outline points (radius, height).
pub fn turned_vessel<const N: usize>(outline: [[f64; 2]; N], wall_m: f64, segments: u32) -> Mesh {
    Mesh::lathe(
        &vessel(&outline.map(DVec2::from_array), 4, wall_m),
        segments,
    )
    .shaded(CREASE_DEG)
}
