//! Procedural pictures: noise, wood, cloth, paper. Colours here are sRGB-encoded, as in the files that they become.

use glam::{DVec2, DVec3};
use image::{ImageFormat, Rgb, RgbImage};

/// Paints a square picture of `color(u, v)`, v downward from the top, and packs it as PNG.
pub fn png(size: u32, color: impl Fn(f64, f64) -> DVec3) -> Vec<u8> {
    let picture = RgbImage::from_fn(size, size, |x, y| {
        let u = (x as f64 + 0.5) / f64::from(size);
        let v = (y as f64 + 0.5) / f64::from(size);
        let encoded = color(u, v).clamp(DVec3::ZERO, DVec3::ONE) * 255.0;
        Rgb(encoded.to_array().map(|channel| channel.round() as u8))
    });
    let mut file = std::io::Cursor::new(Vec::new());
    match picture.write_to(&mut file, ImageFormat::Png) {
        Ok(()) => file.into_inner(),
        Err(error) => unreachable!("a PNG in memory fails only when memory does: {error}"),
    }
}

/// An sRGB colour as on the web, 0xRRGGBB.
pub fn hex(code: u32) -> DVec3 {
    let channel = |shift: u32| f64::from(code >> shift & 0xff) / 255.0;
    DVec3::new(channel(16), channel(8), channel(0))
}

/// A number in \[0,1) that looks random and depends on nothing else than `x` and `y` (the finaliser of splitmix64).
pub fn hash(x: i64, y: i64) -> f64 {
    let mut bits = (x as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ (y as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
    bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^= bits >> 31;
    (bits >> 11) as f64 / (1u64 << 53) as f64
}

/// Smooth noise in \[0,1\] that repeats after `period` cells in x and y.
pub fn noise(point: DVec2, period: (i64, i64)) -> f64 {
    let cell = point.floor();
    let t = point - cell;
    let t = t * t * (3.0 - 2.0 * t);
    let corner = |dx: i64, dy: i64| {
        let (x, y) = (cell.x as i64 + dx, cell.y as i64 + dy);
        hash(x.rem_euclid(period.0), y.rem_euclid(period.1))
    };
    let low = corner(0, 0) + (corner(1, 0) - corner(0, 0)) * t.x;
    let high = corner(0, 1) + (corner(1, 1) - corner(0, 1)) * t.x;
    low + (high - low) * t.y
}

/// Noise of four octaves in \[0,1\] over the unit square, `cells` across in its lowest octave; it repeats.
pub fn fractal(u: f64, v: f64, cells: (i64, i64)) -> f64 {
    let (mut sum, mut weight) = (0.0, 0.5);
    for octave in 0..4 {
        let period = (cells.0 << octave, cells.1 << octave);
        let point = DVec2::new(u * period.0 as f64, v * period.1 as f64);
        sum += weight * noise(point, period);
        weight *= 0.5;
    }
    sum / 0.9375
}

/// 0 below `low`, 1 above `high`, smooth between.
pub fn smoothstep(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Oak boards along u, `rows` of them across v, each cut in two somewhere.
pub fn floorboards(size: u32, rows: i64) -> Vec<u8> {
    png(size, |u, v| {
        let row = (v * rows as f64).floor();
        let across = v * rows as f64 - row;
        let joint = hash(row as i64, 7);
        let (first, second) = (
            (u - joint).rem_euclid(1.0),
            (u - joint - 0.45).rem_euclid(1.0),
        );
        let board = if first < 0.45 { 0 } else { 1 };
        let tone = hash(row as i64, 11 + board);
        let shift = hash(row as i64, 23 + board);
        let warp = 0.06 * fractal(u, v + shift, (3, 6));
        let grain = fractal(
            (u + shift).fract(),
            (v + warp + shift).fract(),
            (4, 12 * rows),
        );
        let pores = fractal((u + shift).fract(), v, (24, 32 * rows));
        let light = hex(0xb98a5a).lerp(hex(0x8f6137), tone);
        let wood = light.lerp(hex(0x6b4424), 0.55 * grain) * (0.86 + 0.2 * pores);
        let texel = rows as f64 / size as f64;
        let edge = across.min(1.0 - across) / texel;
        let end = first.min(second).min(1.0 - first) * size as f64;
        wood * (0.45 + 0.55 * smoothstep(0.2, 1.3, edge.min(end)))
    })
}

/// One piece of wood with its grain along u.
pub fn wood(size: u32, light: DVec3, dark: DVec3) -> Vec<u8> {
    png(size, |u, v| {
        let warp = 0.12 * fractal(u, v, (2, 3));
        let rings = fractal(u, (v + warp).fract(), (2, 14));
        let pores = fractal(u, v, (12, 96));
        light.lerp(dark, smoothstep(0.25, 0.8, rings)) * (0.88 + 0.16 * pores)
    })
}

/// A wallpaper of rows of leaves, light on light.
pub fn wallpaper(size: u32) -> Vec<u8> {
    png(size, |u, v| {
        let column = (u * 4.0).floor();
        let shifted = v * 2.0 + if column as i64 % 2 == 0 { 0.0 } else { 0.5 };
        let local = DVec2::new((u * 4.0).fract() * 2.0 - 1.0, shifted.fract() * 2.0 - 1.0);
        // Two leaves that part from a stalk: lens shapes, mirrored.
        let lens = |x: f64, y: f64| 1.0 - (x / (0.34 * (1.0 - y * y).max(1e-3))).abs();
        let side = local.x.abs();
        let tilted = DVec2::new(
            side - 0.42 - 0.35 * local.y,
            (local.y * 1.5 + side * 0.6) - 0.2,
        );
        let leaf = if tilted.y.abs() < 1.0 {
            lens(tilted.x, tilted.y)
        } else {
            -1.0
        };
        let vein = smoothstep(0.0, 0.12, (tilted.x).abs());
        let stalk = smoothstep(0.05, 0.02, side);
        let mark = (smoothstep(0.0, 0.15, leaf) * (0.55 + 0.45 * vein)).max(stalk);
        let ground = hex(0xd9d6c4) * (0.98 + 0.03 * fractal(u, v, (32, 32)));
        ground.lerp(hex(0xaeb8a0), 0.8 * mark)
    })
}

/// A woven carpet for a floor `aspect` times as long as wide: borders around a field of diamonds.
pub fn carpet(size: u32, aspect: f64) -> Vec<u8> {
    let (red, navy, cream, gold) = (hex(0x8c2f2b), hex(0x22304f), hex(0xe2d3b4), hex(0xb98b3e));
    png(size, |u, v| {
        let inset = (u.min(1.0 - u) * aspect).min(v.min(1.0 - v));
        let weave = 0.9 + 0.1 * fractal(u, v, (128, 96));
        let centered = DVec2::new((u - 0.5) * aspect, v - 0.5);
        let tile = |scale: f64| {
            let p = (centered * scale + 100.0).fract() * 2.0 - 1.0;
            p.x.abs() + p.y.abs()
        };
        let color = if inset < 0.015 {
            navy
        } else if inset < 0.03 {
            gold
        } else if inset < 0.12 {
            let d = tile(11.0);
            if d < 0.3 {
                gold
            } else if d < 0.62 {
                cream
            } else {
                navy
            }
        } else if inset < 0.135 {
            cream
        } else {
            let medallion = centered.x.abs() * 0.75 + centered.y.abs();
            let ripple = (medallion * 26.0).floor() as i64;
            match medallion {
                m if m < 0.05 => gold,
                m if m < 0.22 => [navy, cream, red, gold][ripple.rem_euclid(4) as usize],
                _ => {
                    let d = tile(8.0);
                    if d < 0.22 {
                        gold
                    } else if d < 0.42 {
                        navy
                    } else {
                        red
                    }
                }
            }
        };
        color * weave
    })
}

/// Sixteen book spines side by side, each with its own cloth and gold bands.
pub fn spines(size: u32) -> Vec<u8> {
    const CLOTHS: [u32; 16] = [
        0x7a2e2a, 0x2f4858, 0x33543f, 0x5b4a3a, 0x8a6d3b, 0x41365a, 0xa14a32, 0x24505a, 0x6d7b5a,
        0x3a3a3c, 0xb08d57, 0x5e2233, 0x27406b, 0xd0c3a5, 0x4d6b76, 0x8f4f5f,
    ];
    png(size, |u, v| {
        let book = (u * 16.0).floor();
        let id = book as i64;
        let cloth =
            hex(CLOTHS[id.rem_euclid(16) as usize]) * (0.85 + 0.25 * fractal(u, v, (64, 64)));
        let across = (u * 16.0 - book - 0.5).abs();
        let band_at = 0.08 + 0.1 * hash(id, 1);
        let is_near = |at: f64, half: f64| (v - at).abs() < half;
        let is_band = is_near(band_at, 0.008)
            || is_near(1.0 - band_at, 0.008)
            || is_near(band_at + 0.03, 0.004);
        let title_at = 0.25 + 0.25 * hash(id, 2);
        let letters = hash(id * 64 + (v * 48.0) as i64, 3) > 0.35;
        let is_title = is_near(title_at, 0.11) && across < 0.16 && letters;
        if is_band || is_title {
            hex(0xd8b765)
        } else {
            cloth
        }
    })
}

/// Slabs of light and dark stone, `tiles` a side, veined.
pub fn stone_tiles(size: u32, tiles: i64) -> Vec<u8> {
    png(size, |u, v| {
        let at = DVec2::new(u, v) * tiles as f64;
        let tile = at.floor();
        let is_dark = (tile.x + tile.y) as i64 % 2 == 0;
        let shift = hash(tile.x as i64, tile.y as i64);
        let cloud = fractal((u + shift).fract(), v, (4, 5));
        let vein = smoothstep(
            0.06,
            0.0,
            (fractal(u, (v + shift).fract(), (3, 3)) - 0.5).abs(),
        );
        let (ground, line) = if is_dark {
            (hex(0x4d4a48), hex(0x8d8780))
        } else {
            (hex(0xd8d1c4), hex(0xa79d8e))
        };
        let slab = (ground * (0.88 + 0.2 * cloud)).lerp(line, 0.45 * vein);
        let edge = (at - tile).min(1.0 - (at - tile)).min_element() * size as f64 / tiles as f64;
        slab * (0.6 + 0.4 * smoothstep(0.0, 1.2, edge))
    })
}
