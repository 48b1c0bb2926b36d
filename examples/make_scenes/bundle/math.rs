//! Arithmetic that gives the same bits on every machine.

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};

use glam::{DQuat, DVec3};

/// Sine and cosine of an angle in radians, by Taylor's series after reduction to an eighth of a turn; error below 1e-15.
pub fn sin_cos(angle_rad: f64) -> (f64, f64) {
    let quarters = (angle_rad * FRAC_2_PI).round();
    let x = angle_rad - quarters * FRAC_PI_2;
    let x2 = x * x;
    let series = |divisors: [f64; 8]| {
        divisors
            .iter()
            .rev()
            .fold(1.0, |sum, divisor| 1.0 - x2 / divisor * sum)
    };
    // n! / (n-2)! for the odd and for the even terms.
    let sin = x * series([6.0, 20.0, 42.0, 72.0, 110.0, 156.0, 210.0, 272.0]);
    let cos = series([2.0, 12.0, 30.0, 56.0, 90.0, 132.0, 182.0, 240.0]);
    match (quarters as i64).rem_euclid(4) {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// The rotation by `angle_rad` about the unit vector `axis`, counter-clockwise seen against it.
pub fn rotation(axis: DVec3, angle_rad: f64) -> DQuat {
    let (sin, cos) = sin_cos(angle_rad * 0.5);
    DQuat::from_xyzw(axis.x * sin, axis.y * sin, axis.z * sin, cos)
}
