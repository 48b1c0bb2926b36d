//! All lights of a scene at one time as one table for the GPU: punctual lights and emissive triangles, with an alias table that
//! picks one in proportion to its power (Vose, "A Linear Algorithm for Generating Random Numbers with a Given Distribution", 1991).

use std::f32::consts::PI;

use glam::{Affine3A, Vec3};

use super::{Material, PunctualKind, PunctualLight, Texture};
use crate::gpu::layout::Light;

const KIND_POINT: u32 = 0;
const KIND_SPOT: u32 = 1;
const KIND_DIRECTIONAL: u32 = 2;
pub(super) const KIND_TRIANGLE: u32 = 3;
/// Sides of a triangle that shine, by the turn of its edges as they stand in the scene: a mirrored one keeps its front, but turns the
/// other way round (shaders/lights.wgsl).
const FRONT_SIDE: u32 = 0;
const BOTH_SIDES: u32 = 1;
const BACK_SIDE: u32 = 2;

/// An emissive triangle as it lies in the GPU's triangle arrays.
#[derive(Clone, Copy, Debug)]
pub struct EmissiveTriangle {
    /// Moving object that it belongs to, or `None` for the static mesh.
    pub object: Option<usize>,
    /// Place in the GPU's triangle arrays.
    pub triangle: u32,
    /// Corners in the space of its mesh, metres.
    pub corners: [Vec3; 3],
    /// Index of its material.
    pub material: u32,
}

/// Mean colour of a texture, linear.
pub fn mean_color(texture: &Texture) -> Vec3 {
    let mut sum = glam::DVec3::ZERO;
    for texel in &texture.rgba8 {
        let channel = |c: u8| {
            let x = f64::from(c) / 255.0;
            if !texture.is_srgb {
                x
            } else if x <= 0.04045 {
                x / 12.92
            } else {
                ((x + 0.055) / 1.055).powf(2.4)
            }
        };
        sum += glam::DVec3::new(channel(texel[0]), channel(texel[1]), channel(texel[2]));
    }
    (sum / texture.rgba8.len().max(1) as f64).as_vec3()
}

fn punctual(light: &PunctualLight, bounds_radius_m: f32) -> (Light, f64) {
    let mut record = Light {
        position: light.position.to_array(),
        edge1: light.direction.to_array(),
        emission: light.intensity.to_array(),
        emission_texture: -1,
        ..Light::default()
    };
    let strength = f64::from(light.intensity.element_sum());
    let power = match light.kind {
        PunctualKind::Point => {
            record.kind = KIND_POINT;
            strength * 4.0 * std::f64::consts::PI
        }
        PunctualKind::Spot {
            inner_cone_rad,
            outer_cone_rad,
        } => {
            record.kind = KIND_SPOT;
            let (cos_inner, cos_outer) = (inner_cone_rad.cos(), outer_cone_rad.cos());
            record.spot_scale = 1.0 / (cos_inner - cos_outer).max(0.001);
            record.spot_offset = -cos_outer * record.spot_scale;
            record.spot_cos_outer = cos_outer;
            strength * std::f64::consts::TAU * f64::from(1.0 - cos_outer)
        }
        PunctualKind::Directional => {
            record.kind = KIND_DIRECTIONAL;
            strength * f64::from(PI * bounds_radius_m * bounds_radius_m)
        }
    };
    (record, power)
}

/// The table at the time of the given places of lights and objects. Lights without power are left out.
///
/// `texture_use_of_material` gives the index of a material's emission texture on the GPU, or -1, and the texture's mean colour.
pub fn build(
    punctual_lights: &[PunctualLight],
    emissive: &[EmissiveTriangle],
    scene_from_object: &[Affine3A],
    materials: &[Material],
    emission_texture_of_material: &[(i32, Vec3)],
    bounds_radius_m: f32,
) -> Vec<Light> {
    let mut records: Vec<(Light, f64)> = punctual_lights
        .iter()
        .map(|light| punctual(light, bounds_radius_m))
        .collect();
    for source in emissive {
        let map = source
            .object
            .map_or(Affine3A::IDENTITY, |object| scene_from_object[object]);
        let [a, b, c] = source.corners.map(|corner| map.transform_point3(corner));
        let (edge1, edge2) = (b - a, c - a);
        let area_m2 = 0.5 * edge1.cross(edge2).length();
        let material = &materials[source.material as usize];
        let (emission_texture, mean) = emission_texture_of_material[source.material as usize];
        let sides = if material.double_sided { 2.0 } else { 1.0 };
        let power =
            f64::from((material.emission_w_per_m2_sr * mean).element_sum() * area_m2 * sides)
                * std::f64::consts::PI;
        let record = Light {
            position: a.to_array(),
            kind: KIND_TRIANGLE,
            edge1: edge1.to_array(),
            edge2: edge2.to_array(),
            emission: material.emission_w_per_m2_sr.to_array(),
            area_m2,
            triangle: source.triangle,
            emission_texture,
            sides: match (material.double_sided, map.matrix3.determinant() < 0.0) {
                (true, _) => BOTH_SIDES,
                (false, false) => FRONT_SIDE,
                (false, true) => BACK_SIDE,
            },
            ..Light::default()
        };
        records.push((record, power));
    }
    records.retain(|(_, power)| power.is_finite() && *power > 0.0);
    with_alias_table(records)
}

fn with_alias_table(records: Vec<(Light, f64)>) -> Vec<Light> {
    let total: f64 = records.iter().map(|(_, power)| power).sum();
    let count = records.len();
    let mut share: Vec<f64> = records
        .iter()
        .map(|(_, power)| power / total * count as f64)
        .collect();
    let mut lights: Vec<Light> = records
        .into_iter()
        .enumerate()
        .map(|(index, (light, power))| Light {
            pick_probability: (power / total) as f32,
            alias_share: 1.0,
            alias_index: index as u32,
            ..light
        })
        .collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) =
        (0..count).partition(|index| share[*index] < 1.0);
    while let (Some(low), Some(high)) = (small.pop(), large.pop()) {
        lights[low].alias_share = share[low] as f32;
        lights[low].alias_index = high as u32;
        share[high] -= 1.0 - share[low];
        if share[high] < 1.0 {
            small.push(high)
        } else {
            large.push(high)
        }
    }
    lights
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(strength: f32) -> PunctualLight {
        PunctualLight {
            name: String::new(),
            node: 0,
            position: Vec3::ZERO,
            direction: Vec3::NEG_Z,
            intensity: Vec3::splat(strength),
            kind: PunctualKind::Point,
            range_m: f32::INFINITY,
        }
    }

    /// The probability with which the table picks each light, as the shader does it.
    fn picked(lights: &[Light]) -> Vec<f64> {
        let mut probability = vec![0.0; lights.len()];
        for (slot, light) in lights.iter().enumerate() {
            probability[slot] += f64::from(light.alias_share) / lights.len() as f64;
            probability[light.alias_index as usize] +=
                f64::from(1.0 - light.alias_share) / lights.len() as f64;
        }
        probability
    }

    #[test]
    fn each_light_is_picked_in_proportion_to_its_power() {
        let lights = build(
            &[point(1.0), point(7.0), point(0.5), point(1e-6)],
            &[],
            &[],
            &[],
            &[],
            1.0,
        );
        for (light, probability) in lights.iter().zip(picked(&lights)) {
            assert!((probability - f64::from(light.pick_probability)).abs() < 1e-6);
        }
        assert!((lights[1].pick_probability - 7.0 / 8.500001).abs() < 1e-5);
    }

    #[test]
    fn dark_lights_are_left_out() {
        assert_eq!(
            build(
                &[point(0.0), point(f32::NAN), point(1.0)],
                &[],
                &[],
                &[],
                &[],
                1.0
            )
            .len(),
            1
        );
        assert!(build(&[], &[], &[], &[], &[], 1.0).is_empty());
    }
}
