//! All lights of a scene at one time as one table for the GPU: punctual lights and emissive triangles, with an alias table that
//! picks one with the probability that it is given (Vose, "A Linear Algorithm for Generating Random Numbers with a Given Distribution", 1991).

use std::f32::consts::PI;

use glam::{Affine3A, Vec2, Vec3};

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

/// A light where it stands at one time.
#[derive(Clone, Copy, Debug)]
pub struct PlacedLight {
    /// As the GPU knows it, but for its place in the alias table.
    pub light: Light,
    /// All that it sends out, channels summed, W; above 0.
    pub power_w: f64,
    /// Its emission, textures averaged, channels summed, in the unit of its kind.
    pub strength: f64,
    /// The lamp that it belongs to.
    pub lamp: u32,
}

impl PlacedLight {
    /// One sample of the light as `point` sees it: the way to a place on it (`far_m` long to a directional light), and the irradiance of a
    /// plane that faces it, W/m², channels summed, over the density of the place, if nothing stands between. As `sample_light` in
    /// shaders/lights.wgsl, but for textures.
    pub fn seen_from(&self, point: Vec3, far_m: f32, u: Vec2) -> (Vec3, f64) {
        let light = &self.light;
        let axis = Vec3::from_array(light.edge1);
        let corner = Vec3::from_array(light.position);
        let falls_off = |to_light: Vec3| self.strength / f64::from(to_light.length_squared());
        match light.kind {
            KIND_DIRECTIONAL => (-axis * far_m, self.strength),
            KIND_TRIANGLE => {
                let edge2 = Vec3::from_array(light.edge2);
                let s = u.x.sqrt();
                let to_light = corner + (1.0 - s) * axis + u.y * s * edge2 - point;
                let normal = axis.cross(edge2).normalize_or_zero();
                let cos_light = -to_light.normalize_or_zero().dot(normal);
                let cos_light = match light.sides {
                    BOTH_SIDES => cos_light.abs(),
                    BACK_SIDE => -cos_light,
                    _ => cos_light,
                };
                let facing_m2 = f64::from(cos_light.max(0.0) * light.area_m2);
                (to_light, falls_off(to_light) * facing_m2)
            }
            KIND_SPOT => {
                let to_light = corner - point;
                let cos_angle = -to_light.normalize_or_zero().dot(axis);
                let falloff = (cos_angle * light.spot_scale + light.spot_offset).clamp(0.0, 1.0);
                (to_light, falls_off(to_light) * f64::from(falloff * falloff))
            }
            _ => (corner - point, falls_off(corner - point)),
        }
    }
}

fn punctual(light: &PunctualLight, lamp: u32, bounds_radius_m: f32) -> PlacedLight {
    let mut record = Light {
        position: light.position.to_array(),
        edge1: light.direction.to_array(),
        emission: light.intensity.to_array(),
        emission_texture: -1,
        ..Light::default()
    };
    let strength = f64::from(light.intensity.element_sum());
    let power_w = match light.kind {
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
    PlacedLight {
        light: record,
        power_w,
        strength,
        lamp,
    }
}

/// The lights at the time of the given places of lights and objects. Lights without power are left out.
///
/// `emission_texture_of_material` gives the index of a material's emission texture on the GPU, or -1, and the texture's mean colour;
/// `lamps` the lamp of each light, first of the punctual ones, then of the triangles.
pub fn place(
    punctual_lights: &[PunctualLight],
    emissive: &[EmissiveTriangle],
    scene_from_object: &[Affine3A],
    materials: &[Material],
    emission_texture_of_material: &[(i32, Vec3)],
    lamps: &[u32],
    bounds_radius_m: f32,
) -> Vec<PlacedLight> {
    let mut placed: Vec<PlacedLight> = punctual_lights
        .iter()
        .zip(lamps)
        .map(|(light, lamp)| punctual(light, *lamp, bounds_radius_m))
        .collect();
    for (source, lamp) in emissive.iter().zip(&lamps[placed.len()..]) {
        let map = source
            .object
            .map_or(Affine3A::IDENTITY, |object| scene_from_object[object]);
        let [a, b, c] = source.corners.map(|corner| map.transform_point3(corner));
        let (edge1, edge2) = (b - a, c - a);
        let area_m2 = 0.5 * edge1.cross(edge2).length();
        let material = &materials[source.material as usize];
        let (emission_texture, mean) = emission_texture_of_material[source.material as usize];
        let sides = if material.double_sided { 2.0 } else { 1.0 };
        let strength = f64::from((material.emission_w_per_m2_sr * mean).element_sum());
        let power_w = strength * f64::from(area_m2 * sides) * std::f64::consts::PI;
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
        placed.push(PlacedLight {
            light: record,
            power_w,
            strength,
            lamp: *lamp,
        });
    }
    placed.retain(|light| light.power_w.is_finite() && light.power_w > 0.0);
    placed
}

/// The probabilities of picking each light in proportion to its power.
pub fn by_power(lights: &[PlacedLight]) -> Vec<f64> {
    let total_w: f64 = lights.iter().map(|light| light.power_w).sum();
    lights.iter().map(|l| l.power_w / total_w).collect()
}

/// What the shader divides by stays within the range of f32, whatever the ratio of the lights' powers.
const UNSHADOWED_MIN: f32 = 1e-6;

/// How likely each light is picked; each list adds up to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct PickProbabilities {
    /// As it is.
    pub picked: Vec<f64>,
    /// As it would be if nothing stood between the lights and what is looked at.
    pub unshadowed: Vec<f64>,
}

impl PickProbabilities {
    /// In proportion to power, whatever is looked at.
    pub fn by_power(lights: &[PlacedLight]) -> Self {
        let picked = by_power(lights);
        Self {
            unshadowed: picked.clone(),
            picked,
        }
    }
}

/// The table of lights that are picked with these probabilities.
pub fn build(lights: &[PlacedLight], probabilities: &PickProbabilities) -> Vec<Light> {
    let count = lights.len();
    let PickProbabilities { picked, unshadowed } = probabilities;
    let mut share: Vec<f64> = picked.iter().map(|p| p * count as f64).collect();
    let mut lights: Vec<Light> = lights
        .iter()
        .zip(picked.iter().zip(unshadowed))
        .enumerate()
        .map(|(index, (placed, (picked, unshadowed)))| Light {
            pick_probability: *picked as f32,
            unshadowed_probability: (*unshadowed as f32).max(UNSHADOWED_MIN),
            alias_share: 1.0,
            alias_index: index as u32,
            ..placed.light
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

    fn placed(strengths: &[f32]) -> Vec<PlacedLight> {
        let lights = Vec::from_iter(strengths.iter().map(|strength| point(*strength)));
        let lamps = Vec::from_iter(0..lights.len() as u32);
        place(&lights, &[], &[], &[], &[], &lamps, 1.0)
    }

    #[test]
    fn each_light_is_picked_in_proportion_to_its_power() {
        let placed = placed(&[1.0, 7.0, 0.5, 1e-6]);
        let lights = build(&placed, &PickProbabilities::by_power(&placed));
        for (light, probability) in lights.iter().zip(picked(&lights)) {
            assert!((probability - f64::from(light.pick_probability)).abs() < 1e-6);
        }
        assert!((lights[1].pick_probability - 7.0 / 8.500001).abs() < 1e-5);
    }

    #[test]
    fn each_light_is_picked_with_the_probability_that_it_is_given() {
        let probabilities = PickProbabilities {
            picked: vec![0.01, 0.09, 0.6, 0.3],
            unshadowed: vec![0.25; 4],
        };
        let lights = build(&placed(&[1.0, 7.0, 0.5, 1e-6]), &probabilities);
        let shown = lights.iter().zip(picked(&lights));
        for ((light, picked), given) in shown.zip(probabilities.picked) {
            assert!((picked - given).abs() < 1e-6);
            assert_eq!(light.pick_probability, given as f32);
            assert_eq!(light.unshadowed_probability, 0.25);
        }
    }

    #[test]
    fn dark_lights_are_left_out() {
        let lamps = |lights: &[PlacedLight]| Vec::from_iter(lights.iter().map(|l| l.lamp));
        assert_eq!(lamps(&placed(&[0.0, f32::NAN, 1.0])), [2]);
        let none = placed(&[]);
        assert!(build(&none, &PickProbabilities::by_power(&none)).is_empty());
    }
}
