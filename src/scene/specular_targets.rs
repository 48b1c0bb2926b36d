//! Where light must go to make a caustic: a sphere around each piece of surface that transmits light or whose reflection rays follow.
//!
//! Photons that are aimed at these spheres (`shaders/photon_aim.wgsl`) are all that can become caustic photons.
//! Source: Jensen, "Global Illumination using Photon Maps", 1996, section 2.1, aims caustic photons at specular objects.
//! Limits: a piece has one sphere, however long or flat it is. Tiles would not narrow a mirror floor: their spheres overlap, and half as
//! wide and four times as many they fill the same angle.

use std::collections::HashMap;

use glam::{Affine3A, Mat3, Vec3};

use super::{Aabb, Material, Mesh, Scene, ScenePose};
use crate::gpu::layout::SpecularTarget;
use crate::gpu::{GpuDevice, GpuError, resources};

/// Most spheres at a time; nearby pieces share one where there are more.
pub const TARGETS_MAX: usize = 64;

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
        let of_mesh = |mesh: &Mesh| merged(pieces(mesh, &importance), TARGETS_MAX);
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

/// A sphere around each connected piece of a mesh whose materials have an importance.
fn pieces(mesh: &Mesh, importance_of_material: &[f32]) -> Vec<SpecularTarget> {
    let importance =
        |triangle: usize| importance_of_material[mesh.material_of_triangle[triangle] as usize];
    let specular: Vec<usize> = (0..mesh.triangles.len())
        .filter(|&triangle| importance(triangle) > 0.0)
        .collect();
    // Triangles are one piece where corners lie in one place: meshes split vertices at seams of their normals and texture coordinates.
    let mut piece_of: Vec<usize> = (0..specular.len()).collect();
    let mut at_place: HashMap<[u32; 3], usize> = HashMap::new();
    for (index, &triangle) in specular.iter().enumerate() {
        for corner in mesh.corners(triangle) {
            // Adding zero makes one zero of the two.
            let place = (corner + 0.0).to_array().map(f32::to_bits);
            let neighbour = *at_place.entry(place).or_insert(index);
            let (a, b) = (root(&mut piece_of, index), root(&mut piece_of, neighbour));
            piece_of[a.max(b)] = a.min(b);
        }
    }
    let roots: Vec<usize> = (0..specular.len())
        .map(|index| root(&mut piece_of, index))
        .collect();
    let mut bounds = vec![Aabb::EMPTY; specular.len()];
    for (&root, &triangle) in roots.iter().zip(&specular) {
        for corner in mesh.corners(triangle) {
            bounds[root].include(corner);
        }
    }
    let mut targets: Vec<SpecularTarget> = bounds
        .iter()
        .map(|bounds| SpecularTarget {
            center: bounds.center().to_array(),
            ..SpecularTarget::default()
        })
        .collect();
    for (&root, &triangle) in roots.iter().zip(&specular) {
        let target = &mut targets[root];
        let center = Vec3::from_array(target.center);
        for corner in mesh.corners(triangle) {
            target.radius_m = target.radius_m.max(corner.distance(center));
        }
        target.importance = target.importance.max(importance(triangle));
    }
    // Only the root of a piece has an importance.
    targets.retain(|target| target.importance > 0.0);
    targets
}

/// The first triangle of a piece; shortens the way to it.
fn root(piece_of: &mut [usize], mut index: usize) -> usize {
    while piece_of[index] != index {
        piece_of[index] = piece_of[piece_of[index]];
        index = piece_of[index];
    }
    index
}

/// The sphere in scene space. A map that stretches makes an ellipsoid of it, and the sphere goes around that.
fn moved(target: &SpecularTarget, scene_from_object: Affine3A) -> SpecularTarget {
    let linear = Mat3::from(scene_from_object.matrix3);
    // The largest eigenvalue of MᵀM, by Gershgorin's circles: exact but for shear.
    let squared = linear.transpose() * linear;
    let row_sum = |row: usize| squared.row(row).abs().element_sum();
    let stretch = (0..3).map(row_sum).fold(0.0, f32::max).sqrt();
    let center = scene_from_object.transform_point3(Vec3::from_array(target.center));
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
        let bounds = bounds_of_centers(members);
        let axis = (bounds.max - bounds.min).max_position();
        let half = members.len() / 2;
        members.select_nth_unstable_by(half, |a, b| a.center[axis].total_cmp(&b.center[axis]));
        let (low, high) = members.split_at_mut(half);
        groups.extend([(around(low), low), (around(high), high)]);
    }
    groups.into_iter().map(|(target, _)| target).collect()
}

fn bounds_of_centers(targets: &[SpecularTarget]) -> Aabb {
    let mut bounds = Aabb::EMPTY;
    for target in targets {
        bounds.include(Vec3::from_array(target.center));
    }
    bounds
}

/// A sphere around spheres.
fn around(targets: &[SpecularTarget]) -> SpecularTarget {
    let center = bounds_of_centers(targets).center();
    let reach_m = |t: &SpecularTarget| center.distance(Vec3::from_array(t.center)) + t.radius_m;
    SpecularTarget {
        center: center.to_array(),
        radius_m: targets.iter().map(reach_m).fold(0.0, f32::max),
        importance: targets.iter().map(|t| t.importance).fold(0.0, f32::max),
        ..SpecularTarget::default()
    }
}
