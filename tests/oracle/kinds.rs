//! Surfaces that the tests scatter light on, and directions that they are seen from.

use glam::DVec3;
use macula::oracle::bsdf::{Bsdf, Interface, Schlick};

pub const NO_COAT: Schlick = Schlick {
    f0: DVec3::ZERO,
    f90: 0.0,
};
pub const COAT: Schlick = Schlick {
    f0: DVec3::splat(0.04),
    f90: 1.0,
};
pub const GOLD: Schlick = Schlick {
    f0: DVec3::new(1.0, 0.78, 0.34),
    f90: 1.0,
};

pub fn lambert(albedo: f64) -> Bsdf {
    Bsdf {
        albedo: DVec3::splat(albedo),
        coat: NO_COAT,
        reflection: NO_COAT,
        alpha: 1.0,
        interface: None,
    }
}

pub fn coated(alpha: f64) -> Bsdf {
    Bsdf {
        coat: COAT,
        reflection: COAT,
        alpha,
        ..lambert(0.6)
    }
}

pub fn metal(alpha: f64) -> Bsdf {
    Bsdf {
        reflection: GOLD,
        alpha,
        ..lambert(0.0)
    }
}

pub fn glass(ior: f64, alpha: f64) -> Bsdf {
    Bsdf {
        alpha,
        interface: Some(Interface {
            tint: DVec3::ONE,
            ior,
            is_thin: false,
        }),
        ..lambert(0.0)
    }
}

/// Milk glass: half of what passes the interface is scattered.
pub fn milk_glass(alpha: f64) -> Bsdf {
    Bsdf {
        albedo: DVec3::splat(0.5),
        interface: Some(Interface {
            tint: DVec3::splat(0.5),
            ior: 1.5,
            is_thin: false,
        }),
        ..glass(1.5, alpha)
    }
}

/// A wall of glass without inside, with a rough sheen: light is reflected in a lobe and passes straight on.
pub fn thin_wall(alpha: f64) -> Bsdf {
    Bsdf {
        alpha,
        interface: Some(Interface {
            tint: DVec3::ONE,
            ior: 1.5,
            is_thin: true,
        }),
        ..lambert(0.0)
    }
}

/// Half gold, half a coated base of gold's colour, as glTF mixes them (metallicFactor 0.5).
pub fn part_metal(alpha: f64) -> Bsdf {
    Bsdf {
        albedo: 0.5 * GOLD.f0,
        coat: COAT,
        reflection: Schlick {
            f0: COAT.f0.lerp(GOLD.f0, 0.5),
            f90: 1.0,
        },
        alpha,
        interface: None,
    }
}

pub fn rough_bsdfs() -> Vec<(&'static str, Bsdf)> {
    vec![
        ("Lambert", lambert(0.8)),
        ("coat", coated(0.2)),
        ("satin coat", coated(0.6)),
        ("rough metal", metal(0.5)),
        ("brushed metal", metal(0.15)),
        ("frosted glass from outside", glass(1.5, 0.3)),
        ("frosted glass from inside", glass(1.0 / 1.5, 0.3)),
        ("nearly smooth glass from outside", glass(1.5, 0.05)),
        ("nearly smooth glass from inside", glass(1.0 / 1.5, 0.05)),
        ("milk glass", milk_glass(0.4)),
        ("thin wall", thin_wall(0.3)),
        ("part metal", part_metal(0.3)),
    ]
}

/// Eyes from steep to grazing.
pub fn eyes() -> [DVec3; 3] {
    [(0.95, 0.3), (0.6, 2.0), (0.15, 4.5)].map(|(cos_theta, phi): (f64, f64)| {
        let sin_theta = (1.0 - cos_theta * cos_theta).sqrt();
        DVec3::new(sin_theta * phi.cos(), sin_theta * phi.sin(), cos_theta)
    })
}
