//! The oracle's scattering for random materials and directions: samples lead somewhere, weigh what they should, and lose no side.

use glam::DVec3;
use macula::oracle::bsdf::{Bsdf, Interface, Schlick, fresnel};
use macula::oracle::random::Random;
use proptest::prelude::*;

use crate::runner::{hold, require};

/// A direction above the surface with normal Z, grazing ones too.
fn above() -> impl Strategy<Value = DVec3> {
    let cosine = prop_oneof![3 => 1e-3..=1.0f64, 1 => 1e-6..1e-3f64, 1 => Just(1.0f64)];
    (cosine, 0.0..std::f64::consts::TAU).prop_map(|(z, angle)| {
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * angle.cos(), r * angle.sin(), z)
    })
}

fn schlick() -> impl Strategy<Value = Schlick> {
    (prop::array::uniform3(0.0..=1.0f64), 0.0..=1.0f64).prop_map(|(f0, more)| {
        let f0 = DVec3::from_array(f0);
        let f90 = f0.max_element() + (1.0 - f0.max_element()) * more;
        Schlick { f0, f90 }
    })
}

/// Any scattering whose parts lose no light: coat and reflection alike, so that the base gets what the coat leaves.
fn any_bsdf() -> impl Strategy<Value = Bsdf> {
    let alpha =
        prop_oneof![1 => Just(0.0f64), 1 => Just(1.0f64), 1 => 9e-4..1.1e-3f64, 3 => 0.0..=1.0f64];
    let interface = (
        prop::array::uniform3(0.0..=1.0f64),
        prop_oneof![1 => Just(1.0f64), 4 => 0.4..2.5f64],
        any::<bool>(),
    );
    // Black glass too; one that does not change the index lets light go straight on.
    let interface = (interface, prop_oneof![1 => Just(0.0f64), 4 => Just(1.0f64)]);
    let interface = interface.prop_map(|((tint, ior, is_thin), clear)| Interface {
        tint: DVec3::from_array(tint) * clear,
        ior,
        is_thin: is_thin || ior == 1.0,
    });
    let albedo = prop::array::uniform3(0.0..=1.0f64);
    (albedo, schlick(), alpha, prop::option::of(interface)).prop_map(
        |(albedo, coat, alpha, interface)| Bsdf {
            albedo: DVec3::from_array(albedo),
            coat,
            reflection: coat,
            alpha,
            interface,
        },
    )
}

#[test]
fn every_sample_leads_to_its_side_with_a_weight_that_is_its_value_over_its_density() {
    hold(
        "samples",
        500,
        (any_bsdf(), above(), any::<[u32; 4]>()),
        |(bsdf, wo, key)| {
            let mut random = Random::of(key);
            for _ in 0..8 {
                let Some(sample) = bsdf.sample(DVec3::Z, wo, &mut random) else {
                    continue;
                };
                require(sample.wi.is_normalized(), format!("to {}", sample.wi))?;
                let is_below = sample.wi.z < 0.0;
                require(is_below == sample.is_refracted, "on the wrong side")?;
                let weight = sample.weight;
                require(
                    weight.is_finite() && weight.min_element() >= 0.0,
                    format!("weight {weight}"),
                )?;
                // Its part of wide lobes, or of sharp ones, weighs something too.
                let (part, _) = bsdf.part(DVec3::Z, wo, sample, &mut random);
                require(
                    part.weight.is_finite() && part.weight.min_element() >= 0.0,
                    format!("a part's weight {}", part.weight),
                )?;
                if let Some(density) = sample.density {
                    let again = bsdf.density(DVec3::Z, wo, sample.wi);
                    require(
                        (again / density - 1.0).abs() < 1e-9,
                        format!("{density} is {again}"),
                    )?;
                }
            }
            Ok(())
        },
    );
}

/// Only one of the parts: glTF lets a smooth coat at a grazing angle and the base under it reflect more than all together, as the coat's
/// share is that of the half vector.
fn one_lobe(bsdf: Bsdf, is_base: bool) -> Bsdf {
    let nothing = Schlick {
        f0: DVec3::ZERO,
        f90: 0.0,
    };
    match is_base && bsdf.interface.is_none() {
        true => Bsdf {
            coat: nothing,
            reflection: nothing,
            ..bsdf
        },
        false => Bsdf {
            albedo: DVec3::ZERO,
            ..bsdf
        },
    }
}

#[test]
fn no_lobe_sends_back_more_than_it_gets() {
    let lobe = (any_bsdf(), any::<bool>()).prop_map(|(bsdf, is_base)| one_lobe(bsdf, is_base));
    hold(
        "albedos",
        200,
        (lobe, above(), any::<[u32; 4]>()),
        |(bsdf, wo, key)| {
            const COUNT: u32 = 2000;
            let mut random = Random::of(key);
            let (mut sum, mut squares) = (0.0, 0.0);
            for _ in 0..COUNT {
                let sample = bsdf.sample(DVec3::Z, wo, &mut random);
                // Radiance grows in dense matter by the square of the index, while power does not.
                let weight = sample.map_or(0.0, |sample| {
                    let squeeze = match bsdf.interface {
                        Some(interface) if sample.is_refracted && !interface.is_thin => {
                            interface.ior * interface.ior
                        }
                        _ => 1.0,
                    };
                    sample.weight.max_element() * squeeze
                });
                sum += weight;
                squares += weight * weight;
            }
            let mean = sum / f64::from(COUNT);
            let error =
                ((squares / f64::from(COUNT) - mean * mean).max(0.0) / f64::from(COUNT)).sqrt();
            require(
                mean <= 1.0 + 6.0 * error + 1e-6,
                format!("{mean} +- {error} of 1 comes back"),
            )
        },
    );
}

#[test]
fn reflection_is_the_same_both_ways() {
    hold(
        "reciprocity",
        500,
        (any_bsdf(), above(), above()),
        |(bsdf, one, other)| {
            let [there, back] =
                [(one, other), (other, one)].map(|(wo, wi)| bsdf.evaluate(DVec3::Z, wo, wi));
            let scale = there.max_element().max(1e-12);
            require(
                (there - back).abs().max_element() < 1e-6 * scale,
                format!("{there} and {back}"),
            )
        },
    );
}

#[test]
fn fresnel_reflectance_is_a_share_and_all_beyond_the_critical_angle() {
    hold(
        "reflectances",
        500,
        (0.0..=1.0f64, 0.3..3.0f64),
        |(cosine, ior)| {
            let share = fresnel(cosine, ior);
            require((0.0..=1.0).contains(&share), format!("{share}"))?;
            let is_total = (1.0 - cosine * cosine) >= ior * ior;
            require(
                !is_total || share == 1.0,
                "light leaves beyond the critical angle",
            )
        },
    );
}
