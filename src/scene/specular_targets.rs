//! Where light must go to make a caustic: a sphere around each piece of surface that transmits light or whose reflection rays follow.
//!
//! Photons that are aimed at these spheres (`shaders/photon_aim.wgsl`) are all that can become caustic photons.
//! Source: Jensen, "Global Illumination using Photon Maps", 1996, section 2.1, aims caustic photons at specular objects.
//! Limits: alpha masks are not looked at, nor where a texture makes a surface rough.

use std::collections::BTreeMap;

use glam::{Affine3A, Mat3, Vec3};

use super::connected;
use super::{Aabb, Material, Mesh, Scene, ScenePose};
use crate::gpu::layout::SpecularTarget;
use crate::gpu::{GpuDevice, GpuError, resources};

/// Most spheres at a time. Nearby pieces share one where there are more; long and flat pieces get several where there are fewer.
pub const TARGETS_MAX: usize = 64;

/// The halves of a piece have a sphere each where these cover no more than this many times its own sphere's section. A square's halves
/// cover 1.25 times as much, and their halves no more than the square; a cube's and a ball's halves cover 1.5 times and twice as much.
/// Of the rays that a point light aims from 1.7 m above, 5.2 times as many meet a mirror floor of 3.6 m square in 64 spheres as in one,
/// which is around the light too, and 46 times as many a strip of 3.6 m by 0.3 m.
const HALVES_SECTION_MAX: f32 = 1.3;

/// The spheres of a scene, and their buffer on the device.
pub struct SpecularTargets {
    /// Those of the static mesh, in scene space.
    fixed: Vec<SpecularTarget>,
    /// Those of each moving object, in object space.
    of_objects: Vec<Vec<SpecularTarget>>,
    buffer: wgpu::Buffer,
    count: u32,
}

impl SpecularTargets {
    /// Finds them as they stand at `pose`, where reflections with a GGX alpha below `gathered_alpha_min` are followed by rays.
    ///
    /// # Errors
    /// [`GpuError::BufferTooLarge`] never in practice: [`TARGETS_MAX`] spheres fit any device.
    pub fn new(
        gpu: &GpuDevice,
        scene: &Scene,
        gathered_alpha_min: f32,
        pose: &ScenePose,
    ) -> Result<Self, GpuError> {
        let importance: Vec<f32> = scene
            .materials
            .iter()
            .map(|material| importance(material, gathered_alpha_min))
            .collect();
        let of_mesh =
            |mesh: &Mesh| merged(parted(pieces(mesh, &importance), TARGETS_MAX), TARGETS_MAX);
        let fixed = of_mesh(&scene.static_mesh);
        let of_objects: Vec<_> = scene.objects.iter().map(|o| of_mesh(&o.mesh)).collect();
        let all = fixed.len() + of_objects.iter().map(Vec::len).sum::<usize>();
        let this = Self {
            fixed,
            of_objects,
            buffer: resources::storage::<SpecularTarget>(
                gpu,
                "specular_targets",
                TARGETS_MAX as u64,
            )?,
            count: all.min(TARGETS_MAX) as u32,
        };
        this.set_pose(gpu, pose);
        Ok(this)
    }

    /// Moves the spheres of moving objects; takes effect with the next submission.
    pub fn set_pose(&self, gpu: &GpuDevice, pose: &ScenePose) {
        let objects = self.of_objects.iter().zip(&pose.scene_from_object);
        let moving = objects.flat_map(|(targets, map)| targets.iter().map(|t| moved(t, *map)));
        let all = merged(
            self.fixed.iter().copied().chain(moving).collect(),
            TARGETS_MAX,
        );
        gpu.queue
            .write_buffer(&self.buffer, 0, bytemuck::cast_slice(&all));
    }

    /// How many spheres there are, whatever the pose: none where nothing is specular.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// The spheres: `specular_targets` in WGSL.
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }
}

/// The share of light that a material sends on by its traced lobes at most; 0 where it has none.
fn importance(material: &Material, gathered_alpha_min: f32) -> f32 {
    if !material.is_traced(gathered_alpha_min) {
        return 0.0;
    }
    if material.is_transmissive() {
        return 1.0;
    }
    // Schlick's reflectance over a hemisphere of light: f0 + (f90 - f0) / 21.
    let mean_reflectance = |f0: f32, f90: f32| f0 + (f90 - f0) / 21.0;
    let r = (material.ior - 1.0) / (material.ior + 1.0);
    let coat_f0 =
        (r * r * material.specular_color.max_element()).min(1.0) * material.specular_factor;
    let coat = mean_reflectance(coat_f0, material.specular_factor);
    let metal = mean_reflectance(material.base_color.max_element(), 1.0);
    let share = match material.metallic_roughness_texture {
        Some(_) => coat.max(metal),
        None => coat + (metal - coat) * material.metallic,
    };
    share.clamp(IMPORTANCE_MIN, 1.0)
}

/// Keeps the flux of photons bounded that meet a piece by chance, on the way to another.
const IMPORTANCE_MIN: f32 = 0.01;

/// A part of the surface, and the sphere around it.
#[derive(Clone, Debug)]
struct Piece {
    /// Convex.
    polygons: Vec<Vec<Vec3>>,
    target: SpecularTarget,
}

impl Piece {
    fn new(polygons: Vec<Vec<Vec3>>, importance: f32) -> Self {
        let center = bounds_of(polygons.iter().flatten().copied()).center();
        let distances = polygons.iter().flatten().map(|p| p.distance(center));
        let target = SpecularTarget {
            center: center.to_array(),
            radius_m: distances.fold(0.0, f32::max),
            importance,
            ..SpecularTarget::default()
        };
        Self { polygons, target }
    }

    /// Both halves of its longest side, if spheres around them fit better.
    fn halves(&self) -> Option<[Self; 2]> {
        let bounds = bounds_of(self.polygons.iter().flatten().copied());
        let axis = (bounds.max - bounds.min).max_position();
        let at = bounds.center()[axis];
        let halves = [1.0, -1.0].map(|side| {
            let polygons = self.polygons.iter().map(|p| below(p, axis, at, side));
            let polygons = polygons.filter(|polygon| polygon.len() > 2).collect();
            Self::new(polygons, self.target.importance)
        });
        let section = |piece: &Self| piece.target.radius_m * piece.target.radius_m;
        let sections = halves.iter().map(section).sum::<f32>();
        (sections <= HALVES_SECTION_MAX * section(self)).then_some(halves)
    }
}

/// The part of a convex polygon where `side` times the coordinate is at most `side` times `at`.
fn below(polygon: &[Vec3], axis: usize, at: f32, side: f32) -> Vec<Vec3> {
    let mut part = Vec::with_capacity(polygon.len() + 1);
    for (index, &corner) in polygon.iter().enumerate() {
        let next = polygon[(index + 1) % polygon.len()];
        let [here, there] = [corner, next].map(|p| side * (p[axis] - at));
        if here <= 0.0 {
            part.push(corner);
        }
        if here * there < 0.0 {
            part.push(corner.lerp(next, here / (here - there)));
        }
    }
    part
}

/// The connected pieces of a mesh's surfaces whose materials have an importance.
fn pieces(mesh: &Mesh, importance_of_material: &[f32]) -> Vec<Piece> {
    let importance =
        |triangle: usize| importance_of_material[mesh.material_of_triangle[triangle] as usize];
    let specular: Vec<usize> = (0..mesh.triangles.len())
        .filter(|&triangle| importance(triangle) > 0.0)
        .collect();
    let roots = connected::pieces(specular.iter().map(|&triangle| mesh.corners(triangle)));
    let mut parts: BTreeMap<usize, (Vec<Vec<Vec3>>, f32)> = BTreeMap::new();
    for (&root, &triangle) in roots.iter().zip(&specular) {
        let (polygons, most) = parts.entry(root).or_default();
        polygons.push(mesh.corners(triangle).to_vec());
        *most = most.max(importance(triangle));
    }
    let parts = parts.into_values();
    parts
        .map(|(polygons, importance)| Piece::new(polygons, importance))
        .collect()
}

/// Spheres around all pieces, in halves and halves of halves where those fit better, the widest first: as many as `count_max` at most,
/// or one for each piece.
fn parted(mut pieces: Vec<Piece>, count_max: usize) -> Vec<SpecularTarget> {
    let mut whole = Vec::new();
    while pieces.len() + whole.len() < count_max {
        let radius_m = |index: &usize| pieces[*index].target.radius_m;
        let widest = (0..pieces.len()).max_by(|a, b| f32::total_cmp(&radius_m(a), &radius_m(b)));
        let Some(widest) = widest else { break };
        let piece = pieces.swap_remove(widest);
        match piece.halves() {
            Some(halves) => pieces.extend(halves),
            None => whole.push(piece.target),
        }
    }
    whole.extend(pieces.into_iter().map(|piece| piece.target));
    whole
}

/// The sphere in scene space. A map that stretches makes an ellipsoid of it, and the sphere goes around that.
fn moved(target: &SpecularTarget, scene_from_object: Affine3A) -> SpecularTarget {
    let linear = Mat3::from(scene_from_object.matrix3);
    // The largest eigenvalue of MᵀM, by Gershgorin's circles: exact but for shear.
    let squared = linear.transpose() * linear;
    let row_sum = |row: usize| squared.row(row).abs().element_sum();
    let stretch = (0..3).map(row_sum).fold(0.0, f32::max).sqrt();
    let center = scene_from_object.transform_point3(center_of(target));
    SpecularTarget {
        center: center.to_array(),
        radius_m: target.radius_m * stretch,
        ..*target
    }
}

/// No more than `count_max` spheres around the same: halves of the widest group by number, along its longest side, until there are as
/// many groups.
fn merged(mut targets: Vec<SpecularTarget>, count_max: usize) -> Vec<SpecularTarget> {
    if targets.len() <= count_max {
        return targets;
    }
    let mut groups = vec![(around(&targets), targets.as_mut_slice())];
    while groups.len() < count_max {
        // There are more targets than groups: one can be parted.
        let parted = (0..groups.len())
            .filter(|&group| groups[group].1.len() > 1)
            .max_by(|&a, &b| groups[a].0.radius_m.total_cmp(&groups[b].0.radius_m));
        let Some(group) = parted else { break };
        let (_, members) = groups.swap_remove(group);
        let bounds = bounds_of(members.iter().map(center_of));
        let axis = (bounds.max - bounds.min).max_position();
        let half = members.len() / 2;
        members.select_nth_unstable_by(half, |a, b| a.center[axis].total_cmp(&b.center[axis]));
        let (low, high) = members.split_at_mut(half);
        groups.extend([(around(low), low), (around(high), high)]);
    }
    groups.into_iter().map(|(target, _)| target).collect()
}

fn bounds_of(points: impl Iterator<Item = Vec3>) -> Aabb {
    points.fold(Aabb::EMPTY, |mut bounds, point| {
        bounds.include(point);
        bounds
    })
}

fn center_of(target: &SpecularTarget) -> Vec3 {
    Vec3::from_array(target.center)
}

/// A sphere around spheres.
fn around(targets: &[SpecularTarget]) -> SpecularTarget {
    let center = bounds_of(targets.iter().map(center_of)).center();
    let reach_m = |t: &SpecularTarget| center.distance(center_of(t)) + t.radius_m;
    SpecularTarget {
        center: center.to_array(),
        radius_m: targets.iter().map(reach_m).fold(0.0, f32::max),
        importance: targets.iter().map(|t| t.importance).fold(0.0, f32::max),
        ..SpecularTarget::default()
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3Swizzles;

    use super::*;

    /// Two triangles of a square with a corner at `corner` that share no vertex, as at a seam.
    fn square(mesh: &mut Mesh, corner: Vec3, side_m: f32, material: u32) {
        let [u, v] = [Vec3::X, Vec3::Y].map(|axis| axis * side_m);
        for triangle in [
            [corner, corner + u, corner + u + v],
            [corner, corner + u + v, corner + v],
        ] {
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(triangle);
            mesh.triangles.push([first, first + 1, first + 2]);
            mesh.material_of_triangle.push(material);
        }
    }

    fn holds(target: &SpecularTarget, point: Vec3) -> bool {
        point.distance(Vec3::from_array(target.center)) <= target.radius_m * 1.00001
    }

    #[test]
    fn each_connected_piece_of_specular_surface_has_a_sphere_around_it() {
        const DIFFUSE: u32 = 0;
        const GLASS: u32 = 1;
        const GLOSS: u32 = 2;
        let mut mesh = Mesh::default();
        square(&mut mesh, Vec3::ZERO, 1.0, GLASS);
        square(&mut mesh, Vec3::new(1.0, 0.0, 0.0), 1.0, GLOSS);
        square(&mut mesh, Vec3::new(2.0, 0.0, 0.0), 1.0, DIFFUSE);
        square(&mut mesh, Vec3::new(3.0, 0.0, 0.0), 1.0, GLOSS);
        let one_each = |importance| parted(pieces(&mesh, importance), 0);
        let targets = one_each(&[0.0, 1.0, 0.1]);
        // Glass and gloss touch; diffuse parts them from the other.
        let of = |target: &SpecularTarget| (target.center[0], target.radius_m, target.importance);
        let expected = [(1.0, 1.25f32.sqrt(), 1.0), (3.5, 0.5f32.sqrt(), 0.1)];
        assert_eq!(targets.iter().map(of).collect::<Vec<_>>(), expected);
        assert!(one_each(&[0.0; 3]).is_empty());
    }

    #[test]
    fn thousands_of_droplets_share_a_bounded_number_of_spheres_that_hold_them_all() {
        let mut mesh = Mesh::default();
        let places = (0..5000u32).map(|i| {
            let [x, y] = [i.wrapping_mul(2_654_435_761), i.wrapping_mul(40_503) << 12];
            Vec3::new(x as f32, y as f32, i as f32) * 1e-9
        });
        let places: Vec<Vec3> = places.collect();
        for place in &places {
            square(&mut mesh, *place, 1e-6, 0);
        }
        let all = parted(pieces(&mesh, &[1.0]), TARGETS_MAX);
        assert_eq!(all.len(), 5000);
        let targets = merged(all, TARGETS_MAX);
        assert_eq!(targets.len(), TARGETS_MAX);
        let is_held = |place: &Vec3| targets.iter().any(|target| holds(target, *place));
        assert!(places.iter().all(is_held));
        // They part the droplets: one sphere around all would do, and be no use.
        let whole = merged(targets.clone(), 1);
        let widest_m = targets.iter().map(|t| t.radius_m).fold(0.0, f32::max);
        assert!(widest_m < 0.5 * whole[0].radius_m, "{widest_m} {whole:?}");
    }

    #[test]
    fn a_mirror_floor_is_covered_by_many_narrow_spheres_and_a_cube_by_one() {
        let mut floor = Mesh::default();
        square(&mut floor, Vec3::ZERO, 1.0, 0);
        let targets = parted(pieces(&floor, &[1.0]), TARGETS_MAX);
        assert_eq!(targets.len(), TARGETS_MAX);
        let place = |i: u32| Vec3::new((i % 101) as f32, (i / 101) as f32, 0.0) / 100.0;
        let is_held = |i: u32| targets.iter().any(|target| holds(target, place(i)));
        assert!((0..101 * 101).all(is_held));
        let widest_m = targets.iter().map(|t| t.radius_m).fold(0.0, f32::max);
        assert!((widest_m - 0.5f32.sqrt() / 8.0).abs() < 1e-5, "{widest_m}");

        let mut cube = Mesh::default();
        for corner in [Vec3::ZERO, Vec3::Z] {
            square(&mut cube, corner, 1.0, 0);
        }
        let faces = cube.positions.clone();
        for turn in [1, 2] {
            let turned = faces.iter().map(|p| [*p, p.zxy(), p.yzx()][turn]);
            cube.positions.extend(turned);
        }
        cube.triangles = (0..12).map(|t| [0, 1, 2].map(|c| 3 * t + c)).collect();
        cube.material_of_triangle = vec![0; 12];
        assert_eq!(parted(pieces(&cube, &[1.0]), TARGETS_MAX).len(), 1);
    }

    #[test]
    fn a_sphere_holds_its_object_wherever_that_is_moved_and_however_stretched() {
        let target = SpecularTarget {
            center: [0.5, 0.0, -1.0],
            radius_m: 2.0,
            importance: 1.0,
            ..SpecularTarget::default()
        };
        let sheared = Mat3::from_cols(Vec3::X, Vec3::new(0.9, 1.0, 0.2), Vec3::new(0.0, 0.4, -3.0));
        let rotated = Mat3::from_rotation_y(1.0) * 0.5;
        for (linear, is_exact) in [(sheared, false), (rotated, true), (Mat3::ZERO, true)] {
            let map = Affine3A::from_mat3_translation(linear, Vec3::new(7.0, 8.0, 9.0));
            let moved = moved(&target, map);
            let on_sphere = |i: u32| {
                let (z, turn) = (1.0 - (i as f32 + 0.5) / 500.0, i as f32 * 2.399_963);
                let across = (1.0 - z * z).sqrt();
                let dir = Vec3::new(across * turn.cos(), across * turn.sin(), z);
                map.transform_point3(Vec3::from_array(target.center) + 2.0 * dir)
            };
            assert!((0..1000).all(|i| holds(&moved, on_sphere(i))), "{linear}");
            if is_exact {
                let stretch = linear.x_axis.length();
                assert!((moved.radius_m - 2.0 * stretch).abs() < 1e-5, "{linear}");
            }
        }
    }

    #[test]
    fn glass_and_metal_matter_more_than_varnish_and_what_is_gathered_not_at_all() {
        let metal = |roughness| Material {
            roughness,
            ..Material::gltf_default()
        };
        let varnish = Material {
            metallic: 0.0,
            ..metal(0.2)
        };
        let glass = Material {
            transmission: 1.0,
            ..varnish.clone()
        };
        let [of_metal, of_varnish, of_glass, of_rough] =
            [&metal(0.0), &varnish, &glass, &metal(1.0)].map(|m| importance(m, 0.2));
        assert_eq!((of_metal, of_glass, of_rough), (1.0, 1.0, 0.0));
        // 0.04 at normal incidence, 1 at grazing angles.
        assert!((of_varnish - (0.04 + 0.96 / 21.0)).abs() < 1e-4);
    }
}
