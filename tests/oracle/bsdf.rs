//! Scattering of surfaces: samples follow their density, weights are value over density, energy is kept, light goes both ways.

use std::f64::consts::PI;

use glam::DVec3;
use macula::oracle::bsdf::Bsdf;
use macula::oracle::random::Random;

use crate::chi_squared::{SIGMAS, sigmas};
use crate::kinds::{eyes, glass, lambert, metal, rough_bsdfs};
use crate::sphere::{BINS, bin_integrals, bin_of};

const N: DVec3 = DVec3::Z;
const SAMPLES: usize = 200_000;

fn counts(bsdf: &Bsdf, wo: DVec3) -> Vec<f64> {
    let mut counts = vec![0.0; BINS + 1];
    let mut random = Random::of([7, 0, 0, 0]);
    for _ in 0..SAMPLES {
        match bsdf.sample(N, wo, &mut random) {
            Some(sample) => counts[bin_of(sample.wi)] += 1.0,
            None => counts[BINS] += 1.0,
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
            let above = sigmas(&counts(&bsdf, wo), &expected);
            assert!(above < SIGMAS, "{name} at {wo}: {above} sigmas");
            // Control: the same samples against a density that is a little off.
            let wrong = Bsdf {
                alpha: 1.15 * bsdf.alpha,
                albedo: 0.8 * bsdf.albedo,
                ..bsdf
            };
            let mut expected = bin_integrals(|wi| wrong.density(N, wo, wi));
            expected.push(1.0 - expected.iter().sum::<f64>());
            expected.iter_mut().for_each(|e| *e *= SAMPLES as f64);
            let above = sigmas(&counts(&bsdf, wo), &expected);
            assert!(
                above > SIGMAS || name == "Lambert",
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
            let (there, back) = (bsdf.evaluate(N, a, b), bsdf.evaluate(N, b, a));
            let is_same = (there - back).abs().max_element() <= 1e-9 * (1.0 + there.max_element());
            assert!(is_same, "{name}: {there} and {back}");
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
