//! Scattering of surfaces: samples follow their density, weights are value over density, energy is kept, light goes both ways.

use std::f64::consts::PI;

use glam::DVec3;
use macula::oracle::bsdf::{Bsdf, Interface, Schlick};
use macula::oracle::random::Random;

const NO_COAT: Schlick = Schlick {
    f0: DVec3::ZERO,
    f90: 0.0,
};
const COAT: Schlick = Schlick {
    f0: DVec3::splat(0.04),
    f90: 1.0,
};
const GOLD: Schlick = Schlick {
    f0: DVec3::new(1.0, 0.78, 0.34),
    f90: 1.0,
};

fn lambert(albedo: f64) -> Bsdf {
    Bsdf {
        albedo: DVec3::splat(albedo),
        coat: NO_COAT,
        reflection: NO_COAT,
        alpha: 1.0,
        interface: None,
    }
}

fn coated(alpha: f64) -> Bsdf {
    Bsdf {
        coat: COAT,
        reflection: COAT,
        alpha,
        ..lambert(0.6)
    }
}

fn metal(alpha: f64) -> Bsdf {
    Bsdf {
        reflection: GOLD,
        alpha,
        ..lambert(0.0)
    }
}

fn glass(ior: f64, alpha: f64) -> Bsdf {
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
fn milk_glass(alpha: f64) -> Bsdf {
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

fn rough_bsdfs() -> Vec<(&'static str, Bsdf)> {
    vec![
        ("Lambert", lambert(0.8)),
        ("coat", coated(0.2)),
        ("satin coat", coated(0.6)),
        ("rough metal", metal(0.5)),
        ("brushed metal", metal(0.15)),
        ("frosted glass from outside", glass(1.5, 0.3)),
        ("frosted glass from inside", glass(1.0 / 1.5, 0.3)),
        ("milk glass", milk_glass(0.4)),
    ]
}

/// Eyes from steep to grazing.
fn eyes() -> [DVec3; 3] {
    [(0.95, 0.3), (0.6, 2.0), (0.15, 4.5)].map(|(cos_theta, phi): (f64, f64)| {
        let sin_theta = (1.0 - cos_theta * cos_theta).sqrt();
        DVec3::new(sin_theta * phi.cos(), sin_theta * phi.sin(), cos_theta)
    })
}

const N: DVec3 = DVec3::Z;
const RINGS: usize = 24;
const SECTORS: usize = 24;

/// Where a direction falls in a grid of equal solid angles over the sphere.
fn bin_of(wi: DVec3) -> usize {
    let ring = (0.5 * (wi.z + 1.0) * RINGS as f64) as usize;
    let turn = wi.y.atan2(wi.x).rem_euclid(2.0 * PI) / (2.0 * PI);
    ring.min(RINGS - 1) * SECTORS + ((turn * SECTORS as f64) as usize).min(SECTORS - 1)
}

/// The integral of `f` over each bin, by the midpoints of 24 x 24 equal parts.
fn bin_integrals(f: impl Fn(DVec3) -> f64) -> Vec<f64> {
    const PARTS: usize = 24;
    let solid_angle = 4.0 * PI / (RINGS * SECTORS * PARTS * PARTS) as f64;
    (0..RINGS * SECTORS)
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

/// How many standard deviations a chi-squared statistic lies above its mean (Wilson and Hilferty, 1931).
fn chi_squared_sigmas(observed: &[f64], expected: &[f64]) -> f64 {
    // Bins with few expected counts are taken together.
    let (mut statistic, mut bins) = (0.0, 0.0);
    let (mut rest_observed, mut rest_expected) = (0.0, 0.0);
    for (o, e) in observed.iter().zip(expected) {
        if *e < 5.0 {
            rest_observed += o;
            rest_expected += e;
        } else {
            statistic += (o - e).powi(2) / e;
            bins += 1.0;
        }
    }
    if rest_expected > 5.0 {
        statistic += (rest_observed - rest_expected).powi(2) / rest_expected;
        bins += 1.0;
    }
    let freedom: f64 = bins - 1.0;
    let spread = 2.0 / (9.0 * freedom);
    ((statistic / freedom).cbrt() - (1.0 - spread)) / spread.sqrt()
}

const SAMPLES: usize = 200_000;
/// One false alarm in 30 000 tests.
const SIGMAS: f64 = 4.0;

fn counts(bsdf: &Bsdf, wo: DVec3) -> Vec<f64> {
    let mut counts = vec![0.0; RINGS * SECTORS + 1];
    let mut random = Random::of([7, 0, 0, 0]);
    for _ in 0..SAMPLES {
        match bsdf.sample(N, wo, &mut random) {
            Some(sample) => counts[bin_of(sample.wi)] += 1.0,
            None => counts[RINGS * SECTORS] += 1.0,
        }
    }
    counts
}

#[test]
fn samples_follow_their_density() {
    for (name, bsdf) in rough_bsdfs() {
        for wo in eyes() {
            let mut expected = bin_integrals(|wi| bsdf.density(N, wo, wi));
            expected.push(1.0 - expected.iter().sum::<f64>());
            expected.iter_mut().for_each(|e| *e *= SAMPLES as f64);
            let sigmas = chi_squared_sigmas(&counts(&bsdf, wo), &expected);
            assert!(sigmas < SIGMAS, "{name} at {wo}: {sigmas} sigmas");
            // Control: the same samples against a density that is a little off.
            let wrong = Bsdf {
                alpha: 1.15 * bsdf.alpha,
                albedo: 0.8 * bsdf.albedo,
                ..bsdf
            };
            let mut expected = bin_integrals(|wi| wrong.density(N, wo, wi));
            expected.push(1.0 - expected.iter().sum::<f64>());
            expected.iter_mut().for_each(|e| *e *= SAMPLES as f64);
            let sigmas = chi_squared_sigmas(&counts(&bsdf, wo), &expected);
            assert!(
                sigmas > SIGMAS || name == "Lambert",
                "{name} at {wo}: the control passes"
            );
        }
    }
}

#[test]
fn the_mean_weight_of_samples_is_the_reflected_share_of_light() {
    for (name, bsdf) in rough_bsdfs() {
        for wo in eyes() {
            let share: f64 = bin_integrals(|wi| bsdf.evaluate(N, wo, wi).x * wi.z.abs())
                .iter()
                .sum();
            let mut random = Random::of([11, 0, 0, 0]);
            let sum: f64 = (0..SAMPLES)
                .filter_map(|_| bsdf.sample(N, wo, &mut random))
                .map(|sample| sample.weight.x)
                .sum();
            let mean = sum / SAMPLES as f64;
            assert!(
                (mean - share).abs() < 0.01 * share.max(0.1),
                "{name} at {wo}: {mean} for {share}"
            );
        }
    }
}

#[test]
fn no_surface_sends_out_more_light_than_falls_on_it() {
    let smooth = [
        ("mirror", metal(0.0)),
        ("glass", glass(1.5, 0.0)),
        ("thick glass", glass(0.5, 0.0)),
    ];
    for (name, bsdf) in rough_bsdfs().into_iter().chain(smooth) {
        for wo in eyes() {
            let mut random = Random::of([13, 0, 0, 0]);
            let sum: f64 = (0..SAMPLES)
                .filter_map(|_| bsdf.sample(N, wo, &mut random))
                .map(|sample| {
                    // What is refracted is squeezed or widened: as power, light keeps its weight.
                    let squeeze = match (sample.is_refracted, bsdf.interface) {
                        (true, Some(interface)) => interface.ior * interface.ior,
                        _ => 1.0,
                    };
                    sample.weight.max_element() * squeeze
                })
                .sum();
            let mean = sum / SAMPLES as f64;
            assert!(mean < 1.005, "{name} at {wo}: {mean}");
            let is_lossless = name == "mirror" || name == "glass" || name == "thick glass";
            assert!(!is_lossless || mean > 0.995, "{name} at {wo}: {mean}");
        }
    }
    let exact = lambert(0.8);
    let sample = exact
        .sample(N, eyes()[1], &mut Random::of([1, 2, 3, 4]))
        .unwrap();
    assert!((sample.weight.x - 0.8).abs() < 1e-12);
}

#[test]
fn light_goes_both_ways_alike() {
    let mut random = Random::of([17, 0, 0, 0]);
    let mut direction = |upper: bool| {
        let z = random.uniform() * 0.98 + 0.01;
        let phi = 2.0 * PI * random.uniform();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * phi.cos(), r * phi.sin(), if upper { z } else { -z })
    };
    for (name, bsdf) in rough_bsdfs() {
        for _ in 0..2000 {
            let (a, b) = (direction(true), direction(true));
            if name != "milk glass" {
                let (there, back) = (bsdf.evaluate(N, a, b), bsdf.evaluate(N, b, a));
                let is_same =
                    (there - back).abs().max_element() <= 1e-9 * (1.0 + there.max_element());
                assert!(is_same, "{name}: {there} and {back}");
            }
        }
    }
    // Through glass, radiance over the square of the index is what goes both ways alike (Walter et al., equation 22).
    let (outside, inside) = (glass(1.5, 0.3), glass(1.0 / 1.5, 0.3));
    let mut passed = 0;
    for _ in 0..2000 {
        let (a, b) = (direction(true), direction(false));
        let there = outside.evaluate(N, a, b).x * 1.5 * 1.5;
        let back = inside.evaluate(-N, b, a).x;
        assert!(
            (there - back).abs() <= 1e-9 * (1.0 + there),
            "{there} and {back}"
        );
        passed += u32::from(there > 0.0);
    }
    assert!(passed > 100, "{passed} pairs refract");
}
