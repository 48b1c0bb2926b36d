//! The pictures on the walls, painted by formula. Colours are sRGB-encoded.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::math::sin_cos;
use super::texture::{fractal, hash, hex, noise, png, smoothstep};

/// Blue hills one behind the other under an evening sun.
pub fn landscape(width: u32, height: u32) -> Vec<u8> {
    let aspect = width as f64 / height as f64;
    png(width, height, |u, v| {
        let sky = hex(0x33547a).lerp(hex(0xf3b069), smoothstep(0.0, 0.6, v));
        let sun = DVec2::new((u - 0.66) * aspect, v - 0.36).length();
        let glow = smoothstep(0.5, 0.0, sun);
        let mut color = sky.lerp(hex(0xffe2a8), 0.6 * glow * glow);
        color = color.lerp(hex(0xfff4d6), smoothstep(0.062, 0.055, sun));
        let cloud = fractal(u, (v * 0.9).fract(), (3, 12));
        color = color.lerp(
            hex(0xf6d2b0),
            0.55 * smoothstep(0.52, 0.75, cloud) * smoothstep(0.5, 0.1, v),
        );
        for range in 0..6 {
            let depth = f64::from(range) / 5.0;
            let cells = 3 + i64::from(range);
            let ridge = fractal(
                (u + 0.17 * f64::from(range)).fract(),
                0.137 * f64::from(range),
                (cells, 8),
            );
            let top = 0.42 + 0.1 * f64::from(range) - (0.22 - 0.1 * depth) * (ridge - 0.35);
            let texel = 1.0 / f64::from(height);
            let shade = hex(0xa98d97).lerp(hex(0x1e2f33), depth);
            let mist = hex(0xe6b48a).lerp(
                shade,
                smoothstep(0.25, -0.02, v - top).max(0.55 + 0.45 * depth),
            );
            color = color.lerp(mist, smoothstep(-texel, texel, v - top));
        }
        brushed(color, u, v)
    })
}

/// A touch of the brush over a picture.
fn brushed(color: DVec3, u: f64, v: f64) -> DVec3 {
    color * (0.93 + 0.12 * fractal(u, v, (40, 64)))
}
