//! Paths from the eye: light is sampled at every surface, and met by chance; both count by the power heuristic.

use glam::{Affine3A, DVec2, DVec3};
use rayon::prelude::*;

use super::caustics::Caustics;
use super::geometry::{Geometry, Hit, Ray, Surface};
use super::light::Lights;
use super::material;
use super::random::Random;
use crate::scene::bvh::SceneCaster;
use crate::scene::{Scene, ScenePose};
use crate::view::Fov;

/// Surfaces that a path meets before chance may end it.
const SURE_SURFACES: u32 = 4;
/// Most cut-out layers that a ray passes.
const MAX_CUT_OUTS: u32 = 4096;

/// The radius of [`PathSettings::caustic_radius_m`] where it is left open, as a share of the scene's diagonal.
const CAUSTIC_RADIUS: f64 = 1e-3;

/// How paths are traced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathSettings {
    /// Paths a pixel.
    pub samples: u32,
    /// Most surfaces that scatter light on its way from lamp to eye; 0: as many as chance allows.
    pub depth_max: u32,
    /// Photons for light from lamps without extent by way of mirrors, glass and sharp lobes, where the scene has both.
    pub caustic_photons: u32,
    /// Radius over which these are counted, metres; 0: a thousandth of the scene's diagonal.
    pub caustic_radius_m: f64,
    /// Seed of the random numbers.
    pub seed: u32,
    /// Number of the frame or pass.
    pub frame: u32,
}

/// A scene at one time, ready to be asked for radiance.
pub struct Oracle<'a> {
    pub(super) geometry: Geometry<'a>,
    pub(super) lights: Lights,
    /// 1/m, by material.
    absorption: Vec<DVec3>,
}

/// How the last vertex chose the direction of a ray, for the weight of light that it meets.
struct Chosen {
    from: DVec3,
    density: f64,
}

fn power_heuristic(this: f64, other: f64) -> f64 {
    let ratio = other / this;
    1.0 / (1.0 + ratio * ratio)
}

impl<'a> Oracle<'a> {
    /// The scene as it stands at `pose`.
    pub fn new(scene: &'a Scene, caster: &'a SceneCaster, pose: &ScenePose) -> Self {
        let geometry = Geometry::new(scene, caster, pose);
        Self {
            lights: Lights::new(&geometry, pose),
            absorption: scene.materials.iter().map(material::absorption).collect(),
            geometry,
        }
    }

    /// Sums of `settings.samples` estimates of radiance for each pixel, W/(m² sr), rows from the top; the same numbers give the same sums.
    pub fn sums(
        &self,
        scene_from_view: Affine3A,
        fov: Fov,
        size: (u32, u32),
        settings: &PathSettings,
    ) -> Vec<[f64; 3]> {
        let &PathSettings {
            samples,
            seed,
            frame,
            ..
        } = settings;
        let caustics = self.caustics(settings);
        let (width, height) = size;
        let origin = scene_from_view.translation.as_dvec3();
        let axes = [
            scene_from_view.matrix3.x_axis,
            scene_from_view.matrix3.y_axis,
            scene_from_view.matrix3.z_axis,
        ]
        .map(|axis| axis.as_dvec3());
        let slope = |angle_rad: f32| f64::from(angle_rad).tan();
        let left_top = DVec2::new(slope(fov.left_rad), slope(fov.up_rad));
        let right_bottom = DVec2::new(slope(fov.right_rad), slope(fov.down_rad));
        let pixels = DVec2::new(f64::from(width), f64::from(height));
        (0..width * height)
            .into_par_iter()
            .map(|pixel| {
                let corner = DVec2::new(f64::from(pixel % width), f64::from(pixel / width));
                let sum: DVec3 = (0..samples)
                    .map(|sample| {
                        let mut random = Random::of([seed, frame, pixel, sample]);
                        let place = (corner + DVec2::from(random.uniform2())) / pixels;
                        let slopes = left_top + (right_bottom - left_top) * place;
                        let direction = axes[0] * slopes.x + axes[1] * slopes.y - axes[2];
                        let direction = direction.normalize();
                        let ray = Ray { origin, direction };
                        self.radiance(ray, settings.depth_max, caustics.as_ref(), &mut random)
                    })
                    .sum();
                sum.to_array()
            })
            .collect()
    }

    /// Photons for what paths can't meet, where the scene has such light.
    fn caustics(&self, settings: &PathSettings) -> Option<Caustics> {
        let scene = self.geometry.scene;
        let is_needed =
            self.lights.has_punctual() && scene.materials.iter().any(material::may_focus);
        (is_needed && settings.caustic_photons > 0).then(|| {
            let diagonal_m = f64::from(scene.bounds_over_time().diagonal_m()).max(1e-9);
            let radius_m = match settings.caustic_radius_m {
                0.0 => CAUSTIC_RADIUS * diagonal_m,
                radius_m => radius_m,
            };
            let &PathSettings {
                caustic_photons,
                seed,
                frame,
                ..
            } = settings;
            Caustics::trace(self, caustic_photons, radius_m, seed, frame)
        })
    }

    /// One estimate of the radiance that comes back along `ray`, W/(m² sr), by way of `depth_max` surfaces at most (0: any number).
    fn radiance(
        &self,
        mut ray: Ray,
        depth_max: u32,
        caustics: Option<&Caustics>,
        random: &mut Random,
    ) -> DVec3 {
        let scene = self.geometry.scene;
        let mut radiance = DVec3::ZERO;
        let mut throughput = DVec3::ONE;
        // Radiance is squeezed inside glass and widens again outside: no reason to end a path.
        let mut squeeze = 1.0;
        let mut medium: Option<usize> = None;
        let mut chosen: Option<Chosen> = None;
        // Beyond a wide lobe photons bring what lamps without extent send by way of sharp ones.
        let mut is_left_to_photons = false;
        for depth in 0.. {
            let Some((hit, surface)) = self.first_surface(&ray, f64::INFINITY) else {
                break;
            };
            let distance_m = surface.position.distance(ray.origin);
            throughput *= self.transmittance(medium, distance_m);
            let emission = material::emission(scene, &surface);
            if emission != DVec3::ZERO {
                let share = chosen.as_ref().map_or(1.0, |chosen| {
                    let lights = &self.lights;
                    let other = lights.density(hit.object, hit.triangle, chosen.from, &surface);
                    power_heuristic(chosen.density, other)
                });
                radiance += throughput * emission * share;
            }
            if depth_max > 0 && depth >= depth_max {
                break;
            }
            let bsdf = material::bsdf(scene, &surface);
            let wo = -ray.direction;
            let n = surface.scattering_normal(&bsdf, wo);
            if let Some(caustics) = caustics.filter(|_| bsdf.is_spread()) {
                // This surface scatters too, as did those before it.
                let others = match depth_max {
                    0 => u32::MAX,
                    most => most - depth - 1,
                };
                let seen = caustics.radiance(&surface, &bsdf, wo, others, is_left_to_photons);
                radiance += throughput * seen;
            }
            if bsdf.is_spread()
                && let Some(light) = self.lights.sample(&self.geometry, surface.position, random)
            {
                let wi = light.direction;
                let f = match light.density {
                    None if is_left_to_photons => bsdf.evaluate_wide(n, wo, wi),
                    _ => bsdf.evaluate(n, wo, wi),
                };
                let is_reflected = n.dot(wi) > 0.0;
                if f != DVec3::ZERO
                    && is_reflected == (surface.geometric_normal.dot(wi) > 0.0)
                    && self.is_free(surface.position, wi, light.distance_m)
                {
                    let share = light.density.map_or(1.0, |density| {
                        power_heuristic(density, bsdf.density(n, wo, wi))
                    });
                    let through = self.medium_beyond(medium, &surface, !is_reflected);
                    let left = self.transmittance(through, light.distance_m);
                    radiance +=
                        throughput * f * light.irradiance * left * (n.dot(wi).abs() * share);
                }
            }
            let mut sample = bsdf.sample(n, wo, random);
            if caustics.is_some() && !is_left_to_photons {
                let parted = sample.map(|sample| bsdf.part(n, wo, sample, random));
                is_left_to_photons = parted.is_some_and(|(_, is_wide)| is_wide);
                sample = parted.map(|(sample, _)| sample);
            }
            let Some(sample) = sample.and_then(|sample| surface.scattered(sample)) else {
                break;
            };
            throughput *= sample.weight;
            medium = self.medium_beyond(medium, &surface, sample.is_refracted);
            if let Some(interface) = bsdf.interface.filter(|i| sample.is_refracted && !i.is_thin) {
                squeeze *= interface.ior * interface.ior;
            }
            chosen = sample.density.map(|density| Chosen {
                from: surface.position,
                density,
            });
            if depth >= SURE_SURFACES {
                let survival = (throughput.max_element() * squeeze).clamp(0.0, 0.95);
                // Written so that a survival that is not a number, which clamping keeps, ends the path.
                let survives = random.uniform() < survival;
                if !survives {
                    break;
                }
                throughput /= survival;
            }
            ray = Ray {
                origin: surface.position,
                direction: sample.wi,
            };
        }
        radiance
    }

    /// Share of light that is left after a way through a solid, or through air.
    pub(super) fn transmittance(&self, medium: Option<usize>, distance_m: f64) -> DVec3 {
        medium.map_or(DVec3::ONE, |medium| {
            (-self.absorption[medium] * distance_m).map(f64::exp)
        })
    }

    /// What a ray is in after a surface.
    pub(super) fn medium_beyond(
        &self,
        before: Option<usize>,
        surface: &Surface,
        is_refracted: bool,
    ) -> Option<usize> {
        let material = &self.geometry.scene.materials[surface.material];
        match (is_refracted && material.is_solid, surface.is_front) {
            (false, _) => before,
            (true, true) => Some(surface.material),
            (true, false) => None,
        }
    }

    /// The nearest surface that is not cut out there.
    pub(super) fn first_surface(&self, ray: &Ray, t_max: f64) -> Option<(Hit, Surface)> {
        let mut t_min = self.geometry.clearance_m;
        for _ in 0..MAX_CUT_OUTS {
            let hit = self.geometry.first_hit(ray, t_min, t_max)?;
            let surface = self.geometry.surface(ray, &hit);
            if !material::is_cut_out(self.geometry.scene, &surface) {
                return Some((hit, surface));
            }
            t_min = hit.t + self.geometry.clearance_m;
        }
        None
    }

    fn is_free(&self, from: DVec3, direction: DVec3, distance_m: f64) -> bool {
        let ray = Ray {
            origin: from,
            direction,
        };
        let t_max = distance_m - self.geometry.clearance_m;
        self.first_surface(&ray, t_max).is_none()
    }
}
