//! Lights by their definitions: KHR_lights_punctual, and every triangle that emits.

use std::collections::HashMap;
use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::geometry::{Geometry, Ray, Surface};
use super::material;
use super::random::Random;
use crate::scene::{PunctualKind, PunctualLight, ScenePose};

/// A light that [`Lights`] picks from.
enum Light {
    Punctual(PunctualLight),
    Triangle {
        corners: [DVec3; 3],
        texcoords: [DVec2; 3],
        material: usize,
    },
}

/// All lights at one time, picked in proportion to their power.
pub(super) struct Lights {
    lights: Vec<Light>,
    /// Running sums of the powers.
    cumulative_w: Vec<f64>,
    /// Lights by moving object and triangle.
    of_triangle: HashMap<(Option<usize>, usize), usize>,
    /// Middle of the scene over time, and a radius around it that holds all of it.
    center: DVec3,
    reach_m: f64,
}

/// One point of a light, seen from a point.
pub(super) struct LightSample {
    /// Unit, to the light.
    pub direction: DVec3,
    pub distance_m: f64,
    /// Irradiance on a plane that faces it over the probability of the sample, W/m².
    pub irradiance: DVec3,
    /// Density of the direction, 1/sr; `None` for a light without extent.
    pub density: Option<f64>,
}

/// Share of the intensity that a light sends out at an angle of this cosine from its axis (KHR_lights_punctual, "Inner and Outer Cone
/// Angles").
fn spot_falloff(kind: &PunctualKind, cos_angle: f64) -> f64 {
    let PunctualKind::Spot {
        inner_cone_rad,
        outer_cone_rad,
    } = kind
    else {
        return 1.0;
    };
    let (inner, outer) = (
        f64::from(*inner_cone_rad).cos(),
        f64::from(*outer_cone_rad).cos(),
    );
    let share = (cos_angle - outer) / (inner - outer).max(1e-3);
    share.clamp(0.0, 1.0).powi(2)
}

fn area_m2([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

impl Lights {
    pub fn new(geometry: &Geometry<'_>, pose: &ScenePose) -> Self {
        let scene = geometry.scene;
        let reach_m = f64::from(scene.bounds_over_time().diagonal_m()).max(1e-9);
        let mut all = Self {
            lights: Vec::new(),
            cumulative_w: Vec::new(),
            of_triangle: HashMap::new(),
            center: scene.bounds_over_time().center().as_dvec3(),
            reach_m,
        };
        for light in &pose.lights {
            let solid_angle_or_area = match light.kind {
                PunctualKind::Point => 4.0 * PI,
                PunctualKind::Spot { outer_cone_rad, .. } => {
                    2.0 * PI * (1.0 - f64::from(outer_cone_rad).cos())
                }
                PunctualKind::Directional => PI * reach_m * reach_m / 4.0,
            };
            let power_w = f64::from(light.intensity.element_sum()) * solid_angle_or_area;
            all.add(Light::Punctual(light.clone()), power_w);
        }
        let exitances: Vec<f64> = scene
            .materials
            .iter()
            .map(|of| material::exitance(scene, of))
            .collect();
        let objects = (0..scene.objects.len()).map(Some);
        for object in std::iter::once(None).chain(objects) {
            let mesh = geometry.mesh(object);
            let place = object.map(|object| geometry.scene_from_object[object]);
            for (triangle, material) in mesh.material_of_triangle.iter().enumerate() {
                let exitance = exitances[*material as usize];
                if exitance.is_nan() || exitance <= 0.0 {
                    continue;
                }
                let mut corners = mesh.corners(triangle).map(|corner| {
                    let corner = corner.as_dvec3();
                    place.map_or(corner, |map| map.transform_point3(corner))
                });
                let mut texcoords = mesh.triangles[triangle]
                    .map(|vertex| mesh.texcoords[vertex as usize].as_dvec2());
                if place.is_some_and(|map| map.matrix3.determinant() < 0.0) {
                    // A mirrored triangle turns the other way round, and keeps its front.
                    corners.swap(1, 2);
                    texcoords.swap(1, 2);
                }
                let light = Light::Triangle {
                    corners,
                    texcoords,
                    material: *material as usize,
                };
                if all.add(light, exitance * area_m2(corners)) {
                    let index = all.lights.len() - 1;
                    all.of_triangle.insert((object, triangle), index);
                }
            }
        }
        all
    }

    /// Adds a light unless it is dark.
    fn add(&mut self, light: Light, power_w: f64) -> bool {
        let counts = power_w.is_finite() && power_w > 0.0;
        if counts {
            let before = self.cumulative_w.last().copied().unwrap_or(0.0);
            self.lights.push(light);
            self.cumulative_w.push(before + power_w);
        }
        counts
    }

    fn pick_probability(&self, light: usize) -> f64 {
        let before = if light == 0 {
            0.0
        } else {
            self.cumulative_w[light - 1]
        };
        (self.cumulative_w[light] - before) / self.cumulative_w[self.lights.len() - 1]
    }

    /// Whether some light has no extent.
    pub fn has_punctual(&self) -> bool {
        matches!(self.lights.first(), Some(Light::Punctual(_)))
    }

    /// A ray that leaves a light without extent, with its power over the probability of the ray, W; `None` where there is no such
    /// light. They come first in the list.
    pub fn emit(&self, random: &mut Random) -> Option<(Ray, DVec3)> {
        let is_punctual = |light: &Light| matches!(light, Light::Punctual(_));
        let count = self.lights.partition_point(is_punctual);
        let total_w = *self.cumulative_w[..count].last()?;
        let wanted_w = random.uniform() * total_w;
        let index = self.cumulative_w[..count].partition_point(|sum| *sum <= wanted_w);
        let index = index.min(count - 1);
        let Light::Punctual(light) = &self.lights[index] else {
            return None;
        };
        let all_w = self.cumulative_w[self.lights.len() - 1];
        let intensity =
            light.intensity.as_dvec3() * (total_w / (all_w * self.pick_probability(index)));
        let axis = light.direction.as_dvec3().normalize_or(DVec3::NEG_Z);
        let around_axis = |cos: f64, turn: f64| {
            let (t, b) = axis.any_orthonormal_pair();
            let sin = (1.0 - cos * cos).max(0.0).sqrt();
            (t * turn.cos() + b * turn.sin()) * sin + axis * cos
        };
        let [u, v] = random.uniform2();
        let turn = 2.0 * PI * v;
        let position = light.position.as_dvec3();
        Some(match light.kind {
            PunctualKind::Point => {
                let direction = around_axis(1.0 - 2.0 * u, turn);
                let origin = position;
                (Ray { origin, direction }, intensity * (4.0 * PI))
            }
            PunctualKind::Spot { outer_cone_rad, .. } => {
                let height = 1.0 - f64::from(outer_cone_rad).cos();
                let cos = 1.0 - u * height;
                let direction = around_axis(cos, turn);
                let falloff = spot_falloff(&light.kind, cos);
                let origin = position;
                (
                    Ray { origin, direction },
                    intensity * (falloff * 2.0 * PI * height),
                )
            }
            PunctualKind::Directional => {
                let (t, b) = axis.any_orthonormal_pair();
                let r = self.reach_m * u.sqrt();
                let aside = (t * turn.cos() + b * turn.sin()) * r;
                let origin = self.center + aside - axis * self.reach_m;
                let area_m2 = PI * self.reach_m * self.reach_m;
                let direction = axis;
                (Ray { origin, direction }, intensity * area_m2)
            }
        })
    }

    /// Density, 1/sr, with which [`Lights::sample`] at `from` finds the point of an emissive triangle that is seen at `surface`.
    pub fn density(
        &self,
        object: Option<usize>,
        triangle: usize,
        from: DVec3,
        surface: &Surface,
    ) -> f64 {
        let Some(&light) = self.of_triangle.get(&(object, triangle)) else {
            return 0.0;
        };
        let Light::Triangle { corners, .. } = &self.lights[light] else {
            return 0.0;
        };
        let to_light = surface.position - from;
        let cos_light = surface
            .geometric_normal
            .dot(to_light.normalize_or(DVec3::ZERO))
            .abs();
        self.pick_probability(light) * to_light.length_squared() / (cos_light * area_m2(*corners))
    }

    /// A point on a light, seen from `point`, whatever lies between; `None` where it does not shine there.
    pub fn sample(
        &self,
        geometry: &Geometry<'_>,
        point: DVec3,
        random: &mut Random,
    ) -> Option<LightSample> {
        let total_w = *self.cumulative_w.last()?;
        let wanted_w = random.uniform() * total_w;
        let index = self.cumulative_w.partition_point(|sum| *sum <= wanted_w);
        let index = index.min(self.lights.len() - 1);
        let probability = self.pick_probability(index);
        match &self.lights[index] {
            Light::Punctual(light) => self.punctual(light, point, probability),
            Light::Triangle {
                corners: corners @ [a, b, c],
                texcoords,
                material,
            } => {
                let [u, v] = random.uniform2();
                let s = u.sqrt();
                let shares = [1.0 - s, s * (1.0 - v), s * v];
                let place = *a * shares[0] + *b * shares[1] + *c * shares[2];
                let normal = (*b - *a).cross(*c - *a).normalize();
                let to_light = place - point;
                let distance_m = to_light.length();
                let direction = to_light / distance_m;
                let is_front = normal.dot(direction) < 0.0;
                let cos_light = normal.dot(direction).abs();
                let surface = Surface {
                    position: place,
                    geometric_normal: normal,
                    shading_normal: normal,
                    texcoord: (0..3).map(|i| texcoords[i] * shares[i]).sum(),
                    material: *material,
                    is_front,
                };
                if material::is_cut_out(geometry.scene, &surface) {
                    return None;
                }
                let radiance = material::emission(geometry.scene, &surface);
                let density =
                    probability * distance_m * distance_m / (cos_light * area_m2(*corners));
                let is_seen = radiance != DVec3::ZERO && density.is_finite() && density > 0.0;
                is_seen.then(|| LightSample {
                    direction,
                    distance_m,
                    irradiance: radiance / density,
                    density: Some(density),
                })
            }
        }
    }

    fn punctual(
        &self,
        light: &PunctualLight,
        point: DVec3,
        probability: f64,
    ) -> Option<LightSample> {
        let axis = light.direction.as_dvec3();
        let intensity = light.intensity.as_dvec3() / probability;
        if light.kind == PunctualKind::Directional {
            return Some(LightSample {
                direction: -axis,
                distance_m: 4.0 * self.reach_m,
                irradiance: intensity,
                density: None,
            });
        }
        let to_light = light.position.as_dvec3() - point;
        let distance_m = to_light.length();
        let direction = to_light / distance_m;
        let falloff = spot_falloff(&light.kind, -direction.dot(axis));
        (falloff > 0.0 && distance_m > 0.0).then(|| LightSample {
            direction,
            distance_m,
            irradiance: intensity * (falloff / (distance_m * distance_m)),
            density: None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::chi_squared::{SIGMAS, sigmas};
    use super::*;
    use glam::Vec3;

    const SAMPLES: usize = 100_000;
    const RINGS: usize = 16;
    const SECTORS: usize = 16;

    fn lights(kind: PunctualKind) -> Lights {
        let light = PunctualLight {
            name: "lamp".into(),
            node: 0,
            kind,
            position: Vec3::ZERO,
            direction: Vec3::new(0.6, 0.0, -0.8),
            intensity: Vec3::ONE,
            range_m: f32::INFINITY,
        };
        Lights {
            lights: vec![Light::Punctual(light)],
            cumulative_w: vec![1.0],
            of_triangle: HashMap::new(),
            center: DVec3::ZERO,
            reach_m: 2.0,
        }
    }

    /// Counts by ring (a share from 0 to 1) and by turn about the axis.
    fn counts(places: impl Iterator<Item = (f64, DVec3)>) -> Vec<f64> {
        let axis = DVec3::new(0.6, 0.0, -0.8);
        let (t, b) = axis.any_orthonormal_pair();
        let mut counts = vec![0.0; RINGS * SECTORS];
        for (share, aside) in places {
            let turn = aside.dot(b).atan2(aside.dot(t)).rem_euclid(2.0 * PI) / (2.0 * PI);
            let ring = ((share * RINGS as f64) as usize).min(RINGS - 1);
            let sector = ((turn * SECTORS as f64) as usize).min(SECTORS - 1);
            counts[ring * SECTORS + sector] += 1.0;
        }
        counts
    }

    fn emitted(lights: &Lights) -> Vec<(Ray, DVec3)> {
        let mut random = Random::of([3, 1, 4, 1]);
        (0..SAMPLES)
            .map(|_| lights.emit(&mut random).expect("there is a lamp"))
            .collect()
    }

    /// Judges rays by how evenly they fill rings of equal measure, and controls that rings of another are noticed.
    fn fill_evenly(places: impl Iterator<Item = (f64, DVec3)> + Clone) {
        let even = vec![SAMPLES as f64 / (RINGS * SECTORS) as f64; RINGS * SECTORS];
        let above = sigmas(&counts(places.clone()), &even);
        assert!(above < SIGMAS, "{above} sigmas");
        let bent = places.map(|(share, aside)| (share.powf(1.05), aside));
        assert!(sigmas(&counts(bent), &even) > SIGMAS);
    }

    #[test]
    fn photons_leave_a_lamp_evenly_over_its_cone_with_its_falloff_as_their_power() {
        let axis = DVec3::new(0.6, 0.0, -0.8);
        let (inner_cone_rad, outer_cone_rad) = (0.3, 0.7);
        let spot = PunctualKind::Spot {
            inner_cone_rad,
            outer_cone_rad,
        };
        for (kind, cone_rad) in [(PunctualKind::Point, PI), (spot, f64::from(outer_cone_rad))] {
            let rays = emitted(&lights(kind));
            let height = 1.0 - cone_rad.cos();
            let place = |(ray, _): &(Ray, DVec3)| {
                let share = (1.0 - ray.direction.dot(axis)) / height;
                (share, ray.direction)
            };
            fill_evenly(rays.iter().map(place));
            // The definition's power, by parts of equal solid angle.
            let parts = 10_000;
            let falloff = |i: i32| {
                let cos = 1.0 - height * (f64::from(i) + 0.5) / f64::from(parts);
                spot_falloff(&kind, cos)
            };
            let solid_angle = 2.0 * PI * height / f64::from(parts);
            let power_w: f64 = (0..parts).map(falloff).sum::<f64>() * solid_angle;
            let mean_w = rays.iter().map(|(_, flux_w)| flux_w.x).sum::<f64>() / SAMPLES as f64;
            assert!(
                (mean_w / power_w - 1.0).abs() < 0.01,
                "{mean_w} for {power_w}"
            );
        }
    }

    #[test]
    fn photons_of_a_directional_light_fill_a_disc_around_the_scene() {
        let rays = emitted(&lights(PunctualKind::Directional));
        let axis = DVec3::new(0.6, 0.0, -0.8);
        let place = |(ray, _): &(Ray, DVec3)| {
            let aside = ray.origin - axis * ray.origin.dot(axis);
            (aside.length_squared() / 4.0, aside)
        };
        fill_evenly(rays.iter().map(place));
        assert!(
            rays.iter()
                .all(|(ray, _)| (ray.direction - axis).length() < 1e-7)
        );
    }

    #[test]
    fn lights_are_picked_in_proportion_to_their_power() {
        let mut both = lights(PunctualKind::Point);
        let Light::Punctual(lamp) = &both.lights[0] else {
            unreachable!()
        };
        let other = PunctualLight {
            position: Vec3::new(5.0, 0.0, 0.0),
            ..lamp.clone()
        };
        both.lights.push(Light::Punctual(other));
        both.cumulative_w = vec![1.0, 4.0];
        let at_first = |(ray, _): &&(Ray, DVec3)| ray.origin == DVec3::ZERO;
        let first = emitted(&both).iter().filter(at_first).count() as f64;
        let observed = [first, SAMPLES as f64 - first];
        let expected = |share: f64| [share, 1.0 - share].map(|x| x * SAMPLES as f64);
        assert!(sigmas(&observed, &expected(0.25)) < SIGMAS);
        assert!(sigmas(&observed, &expected(0.27)) > SIGMAS);
    }
}

#[cfg(test)]
#[path = "../../tests/common/chi_squared.rs"]
mod chi_squared;
