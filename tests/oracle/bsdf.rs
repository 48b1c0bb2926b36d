//! Scattering of surfaces: samples follow their density, weights are value over density, energy is kept, light goes both ways.

use std::f64::consts::PI;

use glam::DVec3;
use macula::oracle::bsdf::Bsdf;
use macula::oracle::random::Random;

use crate::chi_squared::{SIGMAS, sigmas};
use crate::kinds::{eyes, glass, lambert, metal, rough_bsdfs, thin_wall};
use crate::sphere::{BINS, bin_integrals, bin_of};

const N: DVec3 = DVec3::Z;
const SAMPLES: usize = 200_000;

/// How often samples fall into each bin, and last how often into none: absorbed, or sent on in a single direction.
fn counts(bsdf: &Bsdf, wo: DVec3) -> Vec<f64> {
    let mut counts = vec![0.0; BINS + 1];
    let mut random = Random::of([7, 0, 0, 0]);
    for _ in 0..SAMPLES {
        let sample = bsdf.sample(N, wo, &mut random);
        let spread = sample.filter(|sample| sample.density.is_some());
        counts[spread.map_or(BINS, |sample| bin_of(sample.wi))] += 1.0;
    }
    counts
}

/// What [`counts`] should find by a density.
fn predicted(density: impl Fn(DVec3) -> f64) -> Vec<f64> {
    let mut shares = bin_integrals(density);
    shares.push(1.0 - shares.iter().sum::<f64>());
    shares.iter().map(|share| share * SAMPLES as f64).collect()
}

#[test]
fn samples_follow_their_density() {
    for (name, bsdf) in rough_bsdfs() {
        for wo in eyes() {
            let counts = counts(&bsdf, wo);
            let density = |wi| bsdf.density(N, wo, wi);
            let above = sigmas(&counts, &predicted(density));
            println!("{name} at {wo:.2}: {above:.2} sigmas");
            assert!(above < SIGMAS, "{name} at {wo}: {above} sigmas");
            // Controls: a twentieth of a hemisphere evenly filled, and lobes a little wider.
            let even = |wi: DVec3| if wi.z > 0.0 { 0.5 / PI } else { 0.0 };
            let above = sigmas(
                &counts,
                &predicted(|wi| 0.95 * density(wi) + 0.05 * even(wi)),
            );
            assert!(above > SIGMAS, "{name} at {wo}: an even share passes");
            let wider = Bsdf {
                alpha: 1.15 * bsdf.alpha,
                ..bsdf
            };
            let has_lobes = bsdf.interface.is_some() || bsdf.reflection.f90 > 0.0;
            let above = sigmas(&counts, &predicted(|wi| wider.density(N, wo, wi)));
            assert!(
                above > SIGMAS || !has_lobes,
                "{name} at {wo}: wider lobes pass"
            );
        }
    }
}

#[test]
fn a_uniform_hemisphere_is_not_lambert_s_and_counts_where_there_are_none_fail() {
    let lambert = lambert(0.8);
    let expected = predicted(|wi| lambert.density(N, N, wi));
    let mut random = Random::of([19, 0, 0, 0]);
    let mut even = vec![0.0; BINS + 1];
    for _ in 0..SAMPLES {
        let [z, turn] = random.uniform2();
        let (r, phi) = ((1.0 - z * z).sqrt(), 2.0 * PI * turn);
        even[bin_of(DVec3::new(r * phi.cos(), r * phi.sin(), z))] += 1.0;
    }
    assert!(sigmas(&even, &expected) > SIGMAS);
    // One sample in ten thousand goes below, where no light comes from.
    let mut below = counts(&lambert, N);
    assert!(sigmas(&below, &expected) < SIGMAS);
    below[0] += 1e-4 * SAMPLES as f64;
    assert_eq!(sigmas(&below, &expected), f64::INFINITY);
}

#[test]
fn the_mean_weight_of_samples_is_the_reflected_share_of_light() {
    for (name, bsdf) in rough_bsdfs() {
        for wo in eyes() {
            let shares = bin_integrals(|wi| bsdf.evaluate(N, wo, wi).x * wi.z.abs());
            let share: f64 = shares.iter().sum();
            let mut random = Random::of([11, 0, 0, 0]);
            let sum: f64 = (0..SAMPLES)
                .filter_map(|_| bsdf.sample(N, wo, &mut random))
                .filter(|sample| sample.density.is_some())
                .map(|sample| sample.weight.x)
                .sum();
            let mean = sum / SAMPLES as f64;
            let is_same = |mean: f64| (mean - share).abs() < 0.01 * share.max(0.1);
            assert!(is_same(mean), "{name} at {wo}: {mean} for {share}");
            assert!(!is_same(mean + 0.02 * share.max(0.1)), "2 % is noticed");
        }
    }
}

/// The power that comes back or passes of a unit that falls in from `wo`, where all light is in the brightest channel.
fn power_out(bsdf: &Bsdf, wo: DVec3) -> f64 {
    let mut random = Random::of([13, 0, 0, 0]);
    let samples = (0..SAMPLES).filter_map(|_| bsdf.sample(N, wo, &mut random));
    let power = samples.map(|sample| {
        // What is refracted is squeezed or widened: as power, light keeps its weight.
        let squeeze = match bsdf.interface {
            Some(interface) if sample.is_refracted && !interface.is_thin => interface.ior.powi(2),
            _ => 1.0,
        };
        sample.weight.max_element() * squeeze
    });
    power.sum::<f64>() / SAMPLES as f64
}

#[test]
fn no_surface_sends_out_more_light_than_falls_on_it() {
    let smooth = [
        ("mirror", metal(0.0)),
        ("glass", glass(1.5, 0.0)),
        ("thick glass", glass(0.5, 0.0)),
        ("smooth thin wall", thin_wall(0.0)),
    ];
    let lossless = smooth.map(|(name, _)| name);
    for (name, bsdf) in rough_bsdfs().into_iter().chain(smooth) {
        for wo in eyes() {
            let power = power_out(&bsdf, wo);
            println!("{name} at {wo:.2}: {power:.4}");
            assert!(power < 1.005, "{name} at {wo}: {power}");
            assert!(
                !lossless.contains(&name) || power > 0.995,
                "{name} at {wo}: {power}"
            );
            // What masks and is not scattered again is lost: little, where facets lie nearly flat.
            let is_nearly_smooth = bsdf.alpha <= 0.05 && wo.z > 0.5;
            assert!(!is_nearly_smooth || power > 0.99, "{name} at {wo}: {power}");
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
            let (there, back) = (bsdf.evaluate(N, a, b), bsdf.evaluate(N, b, a));
            let is_same = (there - back).abs().max_element() <= 1e-9 * (1.0 + there.max_element());
            assert!(is_same, "{name}: {there} and {back}");
        }
    }
    // Through glass, radiance over the square of the index is what goes both ways alike (Walter et al., equation 22).
    for alpha in [0.05, 0.3] {
        let (outside, inside) = (glass(1.5, alpha), glass(1.0 / 1.5, alpha));
        let mut passed = 0;
        for _ in 0..20_000 {
            let (a, b) = (direction(true), direction(false));
            let there = outside.evaluate(N, a, b).x * 1.5 * 1.5;
            let back = inside.evaluate(-N, b, a).x;
            assert!(
                (there - back).abs() <= 1e-9 * (1.0 + there),
                "{there} and {back}"
            );
            passed += u32::from(there > 0.01);
        }
        assert!(passed > 100, "{passed} pairs refract at alpha {alpha}");
    }
    // A thin wall lets as much straight through from either side, and nothing aside.
    let wall = thin_wall(0.3);
    for wo in eyes() {
        assert_eq!(wall.evaluate(N, wo, -wo), DVec3::ZERO);
        let mut random = Random::of([23, 0, 0, 0]);
        let passing = (0..2000).filter_map(|_| wall.sample(N, wo, &mut random));
        let mut passing = passing.filter(|sample| sample.is_refracted).peekable();
        assert!(passing.peek().is_some());
        assert!(passing.all(|sample| sample.wi == -wo && sample.density.is_none()));
    }
}
