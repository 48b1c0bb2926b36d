//! The pictures on the walls, painted by formula: each for a frame `aspect` times as wide as high. Colours are sRGB-encoded.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::math::sin_cos;
use super::texture::{fractal, hash, hex, png, smoothstep};

/// A painter: takes the picture's size in pixels (it is square) and the aspect that it will be shown at.
pub type Painter = fn(u32, f64) -> Vec<u8>;

/// Every picture, with its name.
pub const ALL: [(&str, Painter); 8] = [
    ("landscape", landscape),
    ("composition", composition),
    ("color field", color_field),
    ("circles", circles),
    ("bulge", bulge),
    ("marbling", marbling),
    ("moonlight", moonlight),
    ("seeds", seeds),
];

/// Blue hills one behind the other under an evening sun.
pub fn landscape(size: u32, aspect: f64) -> Vec<u8> {
    png(size, |u, v| {
        let sky = hex(0x33547a).lerp(hex(0xf3b069), smoothstep(0.0, 0.6, v));
        let sun = DVec2::new((u - 0.66) * aspect, v - 0.36).length();
        let glow = smoothstep(0.5, 0.0, sun);
        let mut color = sky.lerp(hex(0xffe2a8), 0.6 * glow * glow);
        color = color.lerp(hex(0xfff4d6), smoothstep(0.062, 0.055, sun));
        let cloud = fractal(u, (v * 0.9).fract(), (3, 12));
        let cover = smoothstep(0.52, 0.75, cloud) * smoothstep(0.5, 0.1, v);
        color = color.lerp(hex(0xf6d2b0), 0.55 * cover);
        for range in 0..6u8 {
            let depth = f64::from(range) / 5.0;
            let shift = 0.17 * f64::from(range);
            let ridge = fractal((u + shift).fract(), 0.8 * shift, (3 + i64::from(range), 8));
            let top = 0.42 + 0.5 * depth - (0.22 - 0.1 * depth) * (ridge - 0.35);
            let shade = hex(0xa98d97).lerp(hex(0x1e2f33), depth);
            let clear = smoothstep(0.25, -0.02, v - top).max(0.55 + 0.45 * depth);
            let hill = hex(0xe6b48a).lerp(shade, clear);
            color = color.lerp(hill, inside(v - top, size));
        }
        brushed(color, u, v)
    })
}

/// Black bars and a few primary fields.
fn composition(size: u32, aspect: f64) -> Vec<u8> {
    const COLUMNS: [f64; 5] = [0.0, 0.22, 0.31, 0.78, 1.0];
    const ROWS: [f64; 5] = [0.0, 0.15, 0.58, 0.82, 1.0];
    const FIELDS: [u32; 16] = [
        0xf2ede0, 0xf2ede0, 0xb8231f, 0xf2ede0, 0x1d3f8f, 0xf2ede0, 0xf2ede0, 0xe5b822, 0xf2ede0,
        0xf2ede0, 0xeae4d4, 0xf2ede0, 0xe5b822, 0x1b1b1b, 0xf2ede0, 0xb8231f,
    ];
    png(size, |u, v| {
        let cell = |cuts: [f64; 5], at: f64| cuts[1..4].iter().filter(|cut| at > **cut).count();
        let bar = |cuts: [f64; 5], at: f64| cuts[1..4].iter().any(|cut| (at - cut).abs() < 0.014);
        let is_bar = bar(ROWS, v) || bar(COLUMNS.map(|cut| cut * aspect), u * aspect);
        let field = FIELDS[cell(ROWS, v) * 4 + cell(COLUMNS, u)];
        brushed(hex(if is_bar { 0x171717 } else { field }), u, v)
    })
}

/// Three soft blocks that float on a ground.
fn color_field(size: u32, _aspect: f64) -> Vec<u8> {
    png(size, |u, v| {
        let ragged = 0.03 * (fractal(u, v, (9, 9)) - 0.5);
        let mut color = hex(0x5c1a1b).lerp(hex(0x7a2a1c), fractal(u, v, (5, 5)));
        for (top, bottom, code) in [
            (0.06, 0.36, 0xe0702a),
            (0.4, 0.66, 0xc2332b),
            (0.7, 0.94, 0x2a1520),
        ] {
            let in_rows = smoothstep(top - 0.02, top + 0.03, v + ragged)
                * smoothstep(bottom + 0.02, bottom - 0.03, v + ragged);
            let in_columns =
                smoothstep(0.05, 0.11, u + ragged) * smoothstep(0.95, 0.89, u - ragged);
            let thin = 0.75 + 0.25 * fractal(u, v, (14, 6));
            color = color.lerp(hex(code), in_rows * in_columns * thin);
        }
        color
    })
}

/// Squares with rings in many colours.
fn circles(size: u32, aspect: f64) -> Vec<u8> {
    const INKS: [u32; 10] = [
        0xd9452b, 0xe9a23b, 0xf0d9a0, 0x2f6f8f, 0x1e3a5f, 0x7fa650, 0xb03a5b, 0xf1efe6, 0x4d2f5e,
        0xe27d60,
    ];
    png(size, |u, v| {
        let columns = (3.0 * aspect).round();
        let at = DVec2::new(u * columns, v * 3.0);
        let tile = at.floor();
        let id = (tile.y * columns + tile.x) as i64;
        let wobble = 0.06 * (fractal(u, v, (8, 8)) - 0.5);
        let radius = (at - tile - 0.5).length() + wobble;
        let ring = if radius < 0.47 {
            (radius * 10.0) as i64
        } else {
            9
        };
        brushed(hex(INKS[(hash(id, ring) * 10.0) as usize]), u, v)
    })
}

/// A chequerboard over a ball that presses forward.
fn bulge(size: u32, aspect: f64) -> Vec<u8> {
    png(size, |u, v| {
        let p = DVec2::new((u - 0.5) * aspect, v - 0.5);
        let share = (1.0 - p.length_squared() / 0.2).max(0.0);
        let pressed = p * (1.0 - 0.62 * share);
        let squares = pressed * 16.0 + 100.0;
        let is_even = (squares.x.floor() + squares.y.floor()) as i64 % 2 == 0;
        let hue = hex(0x1fa3a0).lerp(hex(0xd83a7c), (0.5 + p.x + p.y).clamp(0.0, 1.0));
        if is_even {
            hue * (0.55 + 0.45 * share.sqrt().max(0.2))
        } else {
            hex(0x14141c).lerp(hex(0xf4f1ea), share)
        }
    })
}

/// Inks drawn through each other, as on the endpapers of old books.
fn marbling(size: u32, aspect: f64) -> Vec<u8> {
    const INKS: [u32; 6] = [0x12355b, 0xe8dcc0, 0x9b2226, 0xca8a2b, 0x1f6f5c, 0xf2e9d8];
    png(size, |u, v| {
        let drift = DVec2::new(fractal(u, v, (3, 3)), fractal(v, u, (4, 3)));
        let warped = DVec2::new(u * aspect + 0.7 * drift.x, v + 0.5 * drift.y);
        let (comb, _) = sin_cos(TAU * (warped.x * 5.0));
        let band = (warped.y * 3.0 + 0.22 * comb + 1.2 * drift.x) * 6.0;
        let (first, t) = (band.floor(), band.fract());
        let ink = |index: f64| hex(INKS[(index as i64).rem_euclid(6) as usize]);
        ink(first).lerp(ink(first + 1.0), smoothstep(0.86, 1.0, t))
    })
}

/// The moon over a sea.
fn moonlight(size: u32, aspect: f64) -> Vec<u8> {
    png(size, |u, v| {
        let p = DVec2::new((u - 0.4) * aspect, v - 0.28);
        let halo = smoothstep(0.55, 0.06, p.length());
        if v < 0.62 {
            let cloud = smoothstep(0.45, 0.8, fractal(u, v, (3, 9)));
            let sky = hex(0x0d1730)
                .lerp(hex(0x3d5378), halo)
                .lerp(hex(0x5c6b85), 0.5 * cloud * (0.3 + halo));
            brushed(
                sky.lerp(hex(0xf4efd6), inside(0.075 - p.length(), size)),
                u,
                v,
            )
        } else {
            let depth = (v - 0.62) / 0.38;
            let wave = fractal(u, (v * v).fract(), (8, 60));
            let path = smoothstep(0.05 + 0.25 * depth, 0.0, p.x.abs());
            let glint = path * smoothstep(0.42, 0.6, wave);
            hex(0x1a2a48)
                .lerp(hex(0x0a1224), depth)
                .lerp(hex(0xe8e2c4), glint)
        }
    })
}

/// Seeds set by the golden angle, from the middle out.
fn seeds(size: u32, aspect: f64) -> Vec<u8> {
    const COUNT: u32 = 420;
    let seeds: Vec<DVec2> = (0..COUNT)
        .map(|seed| {
            let (sin, cos) = sin_cos(f64::from(seed) * 2.399_963);
            DVec2::new(cos, sin) * 0.46 * (f64::from(seed) / f64::from(COUNT)).sqrt()
        })
        .collect();
    png(size, |u, v| {
        let p = DVec2::new((u - 0.5) * aspect, v - 0.5);
        let mut color = hex(0x23304a).lerp(hex(0x141c2e), p.length());
        for seed in &seeds {
            let out = seed.length();
            let inked = hex(0xf2c14e).lerp(hex(0xc8553d), out / 0.46);
            color = color.lerp(inked, inside(0.004 + 0.016 * out - seed.distance(p), size));
        }
        brushed(color, u, v)
    })
}

/// 1 where `distance` (in picture heights) is positive, 0 where it is negative, soft over a pixel.
fn inside(distance: f64, size: u32) -> f64 {
    smoothstep(-0.7, 0.7, distance * f64::from(size))
}

/// A touch of the brush over a picture.
fn brushed(color: DVec3, u: f64, v: f64) -> DVec3 {
    color * (0.93 + 0.12 * fractal(u, v, (40, 64)))
}
