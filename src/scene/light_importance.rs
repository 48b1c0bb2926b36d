//! How likely each light is picked, by what it brings to where the eyes look.
//!
//! Power alone starves a dim room next to a bright one: nearly all photons and shadow rays go to lamps that bring nothing. So rays go from
//! the eyes to what they look at, and from there, as diffuse light comes, to a second point. At both, each lamp has a shadow ray. What a
//! lamp brings, as a share of what all bring, averaged over the rays, is its part of the picks: a dim place counts as much as a bright one,
//! as it does to the eye. Frames are averaged exponentially.
//!
//! Some picks go by power all the same, so that every estimate stays unbiased and no light's variance grows without bound. Source: Hesterberg,
//! "Weighted Average Importance Sampling and Defensive Mixture Distributions", Technometrics 37(2), 1995; points by Roberts, "The Unreasonable
//! Effectiveness of Quasirandom Sequences", 2018.
//! Limits: all surfaces are taken for grey and matt, glass and cut-outs let all light through; light that comes by three surfaces or more
//! counts as power only.

use std::cmp::Ordering;
use std::f32::consts::{PI, TAU};

use glam::{Affine3A, Vec2, Vec3};

use super::bvh::SceneCaster;
use super::gpu_scene::GpuScene;
use super::light_table::{self, PickProbabilities, PlacedLight};
use super::{Scene, ScenePose};
use crate::gpu::GpuDevice;
use crate::view::Fov;

/// Most rays that leave the eyes in a frame.
const SIGHT_RAYS_MAX: usize = 64;
/// Most rays that a frame casts in all, counted once for each hierarchy that they meet; one sight ray is always cast.
pub const CASTS_MAX: usize = 2048;
/// Frames whose rays the first look takes at once.
const FIRST_LOOK_FRAMES: usize = 16;
/// One sight ray in so many goes to anywhere in the picture.
const PERIPHERY_INTERVAL: u64 = 4;
/// What a new frame weighs in the mean.
const NEWEST_WEIGHT: f64 = 0.25;
/// The share of light that surfaces are taken to reflect.
const REFLECTANCE: f64 = 0.5;
/// Layers of glass and cut-outs that a ray passes; what lies behind more is taken for not there.
const LAYERS_MAX: usize = 8;

/// Where an eye looks.
#[derive(Clone, Copy, Debug)]
pub struct Focus {
    /// Scene space from view space.
    pub scene_from_view: Affine3A,
    /// Field of view.
    pub fov: Fov,
    /// Unit gaze direction in view space.
    pub gaze_dir_in_view: Vec3,
    /// Half-angle of the cone around it that is looked at, radians; π and more: the whole picture.
    pub radius_rad: f32,
}

/// What there is to look at.
#[derive(Clone, Copy)]
pub struct Surroundings<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its hierarchies.
    pub caster: &'a SceneCaster,
    /// Where its objects are.
    pub pose: &'a ScenePose,
    /// Its lights, as they stand at that pose.
    pub on_gpu: &'a GpuScene,
}

/// A lamp's part in the light of what is looked at.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct LampShare {
    shadowed: f64,
    /// If nothing stood between.
    unshadowed: f64,
}

impl LampShare {
    fn approach(&mut self, goal: Self, step: f64) {
        self.shadowed += step * (goal.shadowed - self.shadowed);
        self.unshadowed += step * (goal.unshadowed - self.unshadowed);
    }
}

/// What the lamps bring to where the eyes look, from frame to frame.
#[derive(Clone, Debug)]
pub struct LightImportance {
    /// Of the picks, that go by what lamps bring.
    weight: f64,
    /// What each lamp brings, as a share of all; empty until something lit was seen.
    lamp_shares: Vec<LampShare>,
    sight_rays_cast: u64,
}

impl LightImportance {
    /// Nothing seen yet; `weight` of the picks (0 to 1) will go by importance, the others by power.
    pub fn new(weight: f32) -> Self {
        Self {
            weight: f64::from(weight),
            lamp_shares: Vec::new(),
            sight_rays_cast: 0,
        }
    }

    /// Whether looking can change anything: not with one lamp.
    pub fn matters_to(&self, on_gpu: &GpuScene) -> bool {
        self.weight > 0.0 && on_gpu.lamp_count() > 1
    }

    /// Looks at a frame, from all eyes in turn; at many frames' worth the first time. Costs at most [`CASTS_MAX`] rays a frame where there is
    /// nothing that moves.
    pub fn look(&mut self, around: &Surroundings<'_>, eyes: &[Focus]) {
        let lamps = Lamp::all(around.on_gpu.placed_lights(), around.on_gpu.lamp_count());
        if eyes.is_empty() || lamps.len() < 2 {
            return;
        }
        let casts_a_ray = (2 + 2 * lamps.len()) * (1 + around.pose.scene_from_object.len());
        let a_frame = (CASTS_MAX / casts_a_ray).clamp(1, SIGHT_RAYS_MAX);
        let count = match self.sight_rays_cast {
            0 => a_frame * FIRST_LOOK_FRAMES,
            _ => a_frame,
        };
        let mut mean = vec![LampShare::default(); around.on_gpu.lamp_count()];
        let mut lit_rays = 0.0;
        for ray in self.sight_rays_cast..self.sight_rays_cast + count as u64 {
            let eye = &eyes[(ray % eyes.len() as u64) as usize];
            let numbers = numbers(ray);
            let is_anywhere = (ray / eyes.len() as u64).is_multiple_of(PERIPHERY_INTERVAL);
            let dir = eye.dir_in_scene(is_anywhere, numbers[0], numbers[1]);
            let shares = around.shares_along(&lamps, eye.position_m(), dir, &numbers);
            if let Some(shares) = shares {
                lit_rays += 1.0;
                for (lamp, share) in lamps.iter().zip(shares) {
                    mean[lamp.index].approach(share, 1.0 / lit_rays);
                }
            }
        }
        self.sight_rays_cast += count as u64;
        if lit_rays == 0.0 {
            return;
        }
        if self.lamp_shares.is_empty() {
            self.lamp_shares = mean;
            return;
        }
        for (share, newest) in self.lamp_shares.iter_mut().zip(mean) {
            share.approach(newest, NEWEST_WEIGHT);
        }
    }

    /// Has the scene's lights picked by what was seen so far; takes effect with the next submission.
    pub fn apply(&self, gpu: &GpuDevice, on_gpu: &GpuScene) {
        if on_gpu.lamp_count() < 2 {
            return;
        }
        let probabilities = self.pick_probabilities(on_gpu.placed_lights());
        on_gpu.set_pick_probabilities(gpu, &probabilities);
    }

    /// How likely each of these lights is picked, of the scene that was looked at.
    pub fn pick_probabilities(&self, lights: &[PlacedLight]) -> PickProbabilities {
        PickProbabilities {
            picked: self.mixed(lights, |share| share.shadowed),
            unshadowed: self.mixed(lights, |share| share.unshadowed),
        }
    }

    /// Probabilities by the shares of lamps, within these by power, mixed with probabilities by power.
    fn mixed(&self, lights: &[PlacedLight], share_of: impl Fn(&LampShare) -> f64) -> Vec<f64> {
        let mut probabilities = light_table::by_power(lights);
        let shares = Vec::from_iter(self.lamp_shares.iter().map(share_of));
        let mut power_w = vec![0.0; shares.len()];
        for light in lights.iter().filter(|_| !shares.is_empty()) {
            power_w[light.lamp as usize] += light.power_w;
        }
        // What has lost its power since has no part.
        let with_power = shares.iter().zip(&power_w).filter(|(_, w)| **w > 0.0);
        let total: f64 = with_power.map(|(share, _)| share).sum();
        if total > 0.0 {
            for (light, probability) in lights.iter().zip(&mut probabilities) {
                let lamp = light.lamp as usize;
                let by_importance = shares[lamp] / total * (light.power_w / power_w[lamp]);
                *probability += self.weight * (by_importance - *probability);
            }
        }
        probabilities
    }
}

/// The numbers in [0, 1) of a sight ray, of a sequence that fills them evenly: two for its direction, two for where light comes from there,
/// three for the place on a lamp.
fn numbers(ray: u64) -> [f32; 7] {
    /// The root of x⁸ = x + 1.
    const RATIO: f64 = 1.096_981_557_798_559_8;
    let mut step = 1.0;
    [(); 7].map(|()| {
        step /= RATIO;
        // Below 1 in f32 too.
        ((0.5 + ray as f64 * step).fract() as f32).min(1.0 - f32::EPSILON)
    })
}

/// The unit direction at an angle from `axis` (unit), after so much of a full turn around it.
fn direction_around(axis: Vec3, cos_angle: f32, turn: f32) -> Vec3 {
    let (x, y) = axis.any_orthonormal_pair();
    let sin_angle = (1.0 - cos_angle * cos_angle).max(0.0).sqrt();
    let (sin, cos) = (TAU * turn).sin_cos();
    sin_angle * (cos * x + sin * y) + cos_angle * axis
}

impl Focus {
    fn position_m(&self) -> Vec3 {
        self.scene_from_view.translation.into()
    }

    /// The direction of a sight ray: within the cone, as far as that is in the picture, or anywhere in it.
    fn dir_in_scene(&self, is_anywhere: bool, u: f32, v: f32) -> Vec3 {
        let cos_edge = self.radius_rad.cos();
        let in_cone = direction_around(self.gaze_dir_in_view, 1.0 - u * (1.0 - cos_edge), v);
        let is_in_picture = |uv: Vec2| uv == uv.clamp(Vec2::ZERO, Vec2::ONE);
        let is_aimed = !is_anywhere
            && self.radius_rad < PI
            && self.fov.project(in_cone).is_some_and(is_in_picture);
        let dir_in_view = match is_aimed {
            true => in_cone,
            false => self.fov.dir_in_view(Vec2::new(u, v)),
        };
        self.scene_from_view.transform_vector3(dir_in_view)
    }
}

/// The lights of one lamp that have power.
struct Lamp<'a> {
    index: usize,
    lights: Vec<&'a PlacedLight>,
    /// Of each light and those before it, W.
    power_up_to_w: Vec<f64>,
}

impl<'a> Lamp<'a> {
    /// The lamps that have any.
    fn all(lights: &'a [PlacedLight], lamp_count: usize) -> Vec<Self> {
        let empty = |index| Self {
            index,
            lights: Vec::new(),
            power_up_to_w: Vec::new(),
        };
        let mut lamps = Vec::from_iter((0..lamp_count).map(empty));
        for light in lights {
            let lamp = &mut lamps[light.lamp as usize];
            let before_w = lamp.power_up_to_w.last().unwrap_or(&0.0);
            lamp.power_up_to_w.push(before_w + light.power_w);
            lamp.lights.push(light);
        }
        lamps.retain(|lamp| !lamp.lights.is_empty());
        lamps
    }

    /// A light, picked by its power, and one over the probability of that.
    fn light(&self, u: f32) -> (&'a PlacedLight, f64) {
        let last = self.lights.len() - 1;
        let total_w = self.power_up_to_w[last];
        let sought_w = f64::from(u) * total_w;
        let place = self.power_up_to_w.partition_point(|w| *w <= sought_w);
        let light = self.lights[place.min(last)];
        (light, total_w / light.power_w)
    }
}

/// A place that a ray meets.
struct Surface {
    position: Vec3,
    /// Unit, on the side that the ray came from.
    normal: Vec3,
}

impl Surroundings<'_> {
    /// The part of each lamp in the light of the surface that a sight ray meets, straight and by way of a second surface. `None` where there
    /// is no surface, or no light.
    fn shares_along(
        &self,
        lamps: &[Lamp<'_>],
        origin: Vec3,
        dir: Vec3,
        numbers: &[f32; 7],
    ) -> Option<Vec<LampShare>> {
        let [_, _, u, v, on_lamp @ ..] = *numbers;
        let first = self.first_surface(origin, dir, f32::INFINITY)?;
        let dir = direction_around(first.normal, (1.0 - u).sqrt(), v);
        let second = self.first_surface(self.left(&first), dir, f32::INFINITY);
        let mut brought = vec![LampShare::default(); lamps.len()];
        let surfaces = [(Some(first), 1.0), (second, REFLECTANCE)];
        for (surface, weight) in surfaces.iter().filter_map(|(s, w)| Some((s.as_ref()?, w))) {
            for (lamp, brought) in lamps.iter().zip(&mut brought) {
                let (irradiance, is_shadowed) = self.irradiance(lamp, surface, on_lamp);
                brought.unshadowed += weight * irradiance;
                if !is_shadowed {
                    brought.shadowed += weight * irradiance;
                }
            }
        }
        let sum = brought
            .iter()
            .fold(LampShare::default(), |sum, b| LampShare {
                shadowed: sum.shadowed + b.shadowed,
                unshadowed: sum.unshadowed + b.unshadowed,
            });
        let is_lit = sum.shadowed > 0.0 && sum.unshadowed.is_finite();
        let share = |brought: LampShare| LampShare {
            shadowed: brought.shadowed / sum.shadowed,
            unshadowed: brought.unshadowed / sum.unshadowed,
        };
        is_lit.then(|| brought.into_iter().map(share).collect())
    }

    /// One sample of what a lamp brings straight to a surface if nothing stands between, W/m², channels summed, and whether something does.
    fn irradiance(
        &self,
        lamp: &Lamp<'_>,
        surface: &Surface,
        [pick, u, v]: [f32; 3],
    ) -> (f64, bool) {
        let (light, weight) = lamp.light(pick);
        let far_m = 2.0 * self.on_gpu.bounds().diagonal_m();
        let (to_light, strength) = light.seen_from(surface.position, far_m, Vec2::new(u, v));
        let distance_m = to_light.length();
        let cos_surface = to_light.dot(surface.normal) / distance_m;
        let irradiance = weight * strength * f64::from(cos_surface);
        // Also where it is not a number.
        if irradiance.partial_cmp(&0.0) != Some(Ordering::Greater) {
            return (0.0, false);
        }
        let start = self.left(surface);
        // Stops short of the light's own surface.
        let reach_m = distance_m - 2.0 * self.on_gpu.ray_offset_m() - 1e-5 * distance_m;
        let dir = (surface.position + to_light - start).normalize();
        let is_shadowed = self.first_surface(start, dir, reach_m).is_some();
        (irradiance, is_shadowed)
    }

    /// Where rays start that leave a surface.
    fn left(&self, surface: &Surface) -> Vec3 {
        surface.position + self.on_gpu.ray_offset_m() * surface.normal
    }

    /// What a ray (unit direction) meets first that does not let light through.
    fn first_surface(&self, mut origin: Vec3, dir: Vec3, mut reach_m: f32) -> Option<Surface> {
        for _ in 0..LAYERS_MAX {
            let hit = self.caster.first_hit(origin, dir, reach_m, self.pose)?;
            let (mesh, map) = match hit.object {
                None => (&self.scene.static_mesh, Affine3A::IDENTITY),
                Some(object) => (
                    &self.scene.objects[object].mesh,
                    self.pose.scene_from_object[object],
                ),
            };
            let material = mesh.material_of_triangle[hit.triangle as usize];
            let material = &self.scene.materials[material as usize];
            if !material.is_transmissive() && material.alpha_cutoff.is_none() {
                let [a, b, c] = mesh.corners(hit.triangle as usize);
                let [a, b, c] = [a, b, c].map(|corner| map.transform_point3(corner));
                let normal = (b - a).cross(c - a).normalize_or_zero();
                return Some(Surface {
                    position: origin + hit.t * dir,
                    normal: normal * -normal.dot(dir).signum(),
                });
            }
            let passed_m = hit.t + self.on_gpu.ray_offset_m();
            origin += passed_m * dir;
            reach_m -= passed_m;
        }
        None
    }
}
