//! Bounding volume hierarchies on the host: what the GPU's traversal data is flattened from, and the caster of the gaze ray.

use std::time::Duration;

use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;
use rayon::prelude::*;

use super::median_split::MedianSplit;
use super::{Mesh, Scene, ScenePose};

/// Deepest hierarchy that is handed out: traversal stacks on the GPU have this many entries at most.
pub const MAX_DEPTH: u32 = 60;

/// Most triangles in a leaf.
pub const MAX_LEAF_TRIANGLES: u32 = 4;

/// A binary BVH over the triangles of one mesh.
#[derive(Clone)]
pub struct MeshBvh {
    /// The hierarchy: `nodes[0]` is the root, a leaf's `first_index..first_index + prim_count` indexes [`MeshBvh::triangle_order`], an inner
    /// node's children are `first_index` and the next. Without nodes for a mesh without triangles.
    pub bvh: Bvh2,
    /// Corners of the triangles in the order of the leaves.
    pub triangles: Vec<Triangle>,
    /// Nodes on the longest way from the root to a leaf: 0 for an empty mesh, at most [`MAX_DEPTH`].
    pub depth: u32,
}

impl MeshBvh {
    /// Builds the hierarchy of a mesh; an empty one is allowed.
    pub fn build(mesh: &Mesh) -> Self {
        let triangles: Vec<Triangle> = (0..mesh.triangles.len())
            .map(|triangle| {
                let [v0, v1, v2] = mesh.corners(triangle).map(Vec3A::from);
                Triangle { v0, v1, v2 }
            })
            .collect();
        let bvh = build_bvh2(&triangles);
        Self {
            triangles: bvh
                .primitive_indices
                .iter()
                .map(|&triangle| triangles[triangle as usize])
                .collect(),
            depth: depth_of(&bvh),
            bvh,
        }
    }

    /// Index in the mesh of each triangle, in the order of the leaves.
    pub fn triangle_order(&self) -> &[u32] {
        &self.bvh.primitive_indices
    }

    /// Distance (in lengths of `dir`) and mesh index of the first triangle that a ray meets before `t_max`, from either side.
    /// Alpha masks are not looked at. A ray that is not finite, or has no direction, meets nothing.
    pub fn first_hit(&self, origin: Vec3, dir: Vec3, t_max: f32) -> Option<(f32, u32)> {
        // obvhs wants a direction of about unit length: it takes components below 1e-7 for zero.
        let length = dir.length();
        let unit_dir = dir / length;
        if !(origin.is_finite() && unit_dir.is_finite() && length > 0.0) {
            return None;
        }
        let ray = Ray::new(origin.into(), unit_dir.into(), 0.0, t_max * length);
        let mut hit = RayHit::none();
        self.bvh.ray_traverse(ray, &mut hit, |ray, position| {
            self.triangles[position].intersect(ray)
        });
        let triangle = *self.bvh.primitive_indices.get(hit.primitive_id as usize)?;
        Some((hit.t / length, triangle))
    }

    /// Bytes that the hierarchy takes on the host.
    pub fn host_bytes(&self) -> usize {
        size_of_val(self.bvh.nodes.as_slice())
            + size_of_val(self.bvh.primitive_indices.as_slice())
            + size_of_val(self.triangles.as_slice())
    }
}

/// Most steps that PLOC may lose on triangles that lie on top of each other: about five seconds.
const MAX_PLOC_STEPS: u64 = 1 << 26;

/// obvhs's hierarchy (PLOC and reinsertion), or a plain median split where obvhs would take forever or go too deep.
fn build_bvh2(triangles: &[Triangle]) -> Bvh2 {
    let median_split = MedianSplit::build(triangles, MAX_LEAF_TRIANGLES as usize);
    if median_split.ploc_steps > MAX_PLOC_STEPS {
        return median_split.bvh;
    }
    let params = BvhBuildParams {
        max_prims_per_leaf: MAX_LEAF_TRIANGLES,
        ..BvhBuildParams::medium_build()
    };
    let bvh = build_bvh2_from_tris(triangles, params, &mut Duration::default());
    if depth_of(&bvh) > MAX_DEPTH {
        return median_split.bvh;
    }
    bvh
}

fn depth_of(bvh: &Bvh2) -> u32 {
    let mut deepest = 0;
    let mut pending = Vec::new();
    if !bvh.nodes.is_empty() {
        pending.push((0, 1));
    }
    while let Some((index, depth)) = pending.pop() {
        deepest = deepest.max(depth);
        let node = &bvh.nodes[index];
        if !node.is_leaf() {
            let child = node.first_index as usize;
            pending.extend([(child, depth + 1), (child + 1, depth + 1)]);
        }
    }
    deepest
}

/// Casts single rays into a scene, moving objects included: for the gaze, not for pictures.
#[derive(Clone)]
pub struct SceneCaster {
    /// Hierarchy of `Scene::static_mesh`.
    pub static_bvh: MeshBvh,
    /// Hierarchies of `Scene::objects`, each in its object space.
    pub object_bvhs: Vec<MeshBvh>,
}

/// The first surface that a ray meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in lengths of the ray's direction: metres for a unit direction.
    pub t: f32,
    /// Index into `Scene::objects`, or `None` for the static mesh.
    pub object: Option<usize>,
    /// Index into the mesh's `triangles`.
    pub triangle: u32,
}

impl SceneCaster {
    /// Builds the hierarchies of all meshes of a scene.
    pub fn new(scene: &Scene) -> Self {
        let (static_bvh, object_bvhs) = rayon::join(
            || MeshBvh::build(&scene.static_mesh),
            || {
                let objects = scene.objects.par_iter();
                objects.map(|object| MeshBvh::build(&object.mesh)).collect()
            },
        );
        Self {
            static_bvh,
            object_bvhs,
        }
    }

    /// The first surface that a ray in scene space meets before `t_max`, from either side, with the objects as `pose` has them.
    /// `None` also for a ray that is not finite or has no direction.
    pub fn first_hit(&self, origin: Vec3, dir: Vec3, t_max: f32, pose: &ScenePose) -> Option<Hit> {
        let static_hit = self.static_bvh.first_hit(origin, dir, t_max);
        let mut nearest = static_hit.map(|(t, triangle)| Hit {
            t,
            object: None,
            triangle,
        });
        for (object, (bvh, scene_from_object)) in self
            .object_bvhs
            .iter()
            .zip(&pose.scene_from_object)
            .enumerate()
        {
            // A singular pose gives an infinite inverse, and such a ray meets nothing.
            let object_from_scene = scene_from_object.inverse();
            let hit = bvh.first_hit(
                object_from_scene.transform_point3(origin),
                object_from_scene.transform_vector3(dir),
                nearest.map_or(t_max, |hit| hit.t),
            );
            if let Some((t, triangle)) = hit {
                nearest = Some(Hit {
                    t,
                    object: Some(object),
                    triangle,
                });
            }
        }
        nearest
    }
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use glam::{Affine3A, Quat, Vec2};

    use super::*;

    fn mesh_of(triangles: impl IntoIterator<Item = [Vec3; 3]>) -> Mesh {
        let positions: Vec<Vec3> = triangles.into_iter().flatten().collect();
        let count = positions.len() as u32;
        Mesh {
            normals: vec![Vec3::ZERO; positions.len()],
            texcoords: vec![Vec2::ZERO; positions.len()],
            triangles: (0..count / 3)
                .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
                .collect(),
            material_of_triangle: vec![0; positions.len() / 3],
            positions,
        }
    }

    /// Triangles scattered in a box, the same ones every time.
    fn scattered(count: u32) -> Mesh {
        let mut state = 12345_u32;
        let mut random = move || {
            state = state.wrapping_mul(747796405).wrapping_add(2891336453);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let mut point = move || Vec3::new(random(), random(), random());
        mesh_of((0..count).map(|_| {
            let center = point() * 10.0;
            [center + point(), center + point(), center + point()]
        }))
    }

    fn assert_is_whole(bvh: &MeshBvh, mesh: &Mesh) {
        let mut order = bvh.triangle_order().to_vec();
        order.sort_unstable();
        assert!(order.into_iter().eq(0..mesh.triangles.len() as u32));
        assert!((1..=MAX_DEPTH).contains(&bvh.depth));
        for node in bvh.bvh.nodes.iter().filter(|node| node.is_leaf()) {
            assert!(node.prim_count <= MAX_LEAF_TRIANGLES);
        }
    }

    /// Compares with testing every triangle, in f64.
    fn brute_force(mesh: &Mesh, origin: Vec3, dir: Vec3) -> Option<f64> {
        let (origin, dir) = (origin.as_dvec3(), dir.as_dvec3());
        let hit = |[a, b, c]: [Vec3; 3]| {
            let [a, b, c] = [a, b, c].map(|v| v.as_dvec3());
            let (e1, e2) = (b - a, c - a);
            let p = dir.cross(e2);
            let determinant = e1.dot(p);
            let s = origin - a;
            let u = s.dot(p) / determinant;
            let q = s.cross(e1);
            let v = dir.dot(q) / determinant;
            let t = e2.dot(q) / determinant;
            (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0).then_some(t)
        };
        (0..mesh.triangles.len())
            .filter_map(|i| hit(mesh.corners(i)))
            .min_by(f64::total_cmp)
    }

    #[test]
    fn first_hits_agree_with_testing_every_triangle() {
        let mesh = scattered(3000);
        let bvh = MeshBvh::build(&mesh);
        assert_is_whole(&bvh, &mesh);
        let (mut hits, mut misses) = (0, 0);
        for i in 0..500 {
            let angle = i as f32 * 0.37;
            let origin = Vec3::new(5.0, 5.0, 5.0) + Vec3::new(angle.cos(), 0.3, angle.sin()) * 12.0;
            let dir = Vec3::new(5.0, 0.02 * i as f32, 5.0) - origin;
            let found = bvh.first_hit(origin, dir, f32::INFINITY);
            match brute_force(&mesh, origin, dir) {
                Some(t) => {
                    hits += 1;
                    assert!((f64::from(found.unwrap().0) - t).abs() < 1e-4, "ray {i}");
                }
                None => {
                    misses += 1;
                    assert_eq!(found, None, "ray {i}");
                }
            }
        }
        assert!(
            hits > 100 && misses > 10,
            "{hits} hits, {misses} misses test both"
        );
    }

    #[test]
    fn an_empty_mesh_is_hit_by_nothing() {
        let bvh = MeshBvh::build(&Mesh::default());
        assert_eq!(bvh.depth, 0);
        assert_eq!(bvh.first_hit(Vec3::ZERO, Vec3::Z, f32::INFINITY), None);
    }

    #[test]
    fn a_ray_that_means_nothing_hits_nothing() {
        let bvh = MeshBvh::build(&scattered(100));
        for bad in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY] {
            assert_eq!(bvh.first_hit(Vec3::splat(5.0), bad, f32::INFINITY), None);
        }
        assert_eq!(bvh.first_hit(Vec3::NAN, Vec3::Z, f32::INFINITY), None);
        assert_eq!(bvh.first_hit(Vec3::NEG_Z, Vec3::Z, f32::NAN), None);
    }

    #[test]
    fn coincident_and_nested_triangles_build_in_bounded_time_and_depth() {
        let corner = [Vec3::X, Vec3::Y, Vec3::Z];
        let count = 20_000;
        let coincident = mesh_of((0..count).map(|_| corner));
        let nested = mesh_of((0..count).map(|i| corner.map(|v| v * (i + 1) as f32)));
        for mesh in [coincident, nested] {
            let start = Instant::now();
            let bvh = MeshBvh::build(&mesh);
            assert_is_whole(&bvh, &mesh);
            assert!(start.elapsed().as_secs() < 20);
        }
    }

    #[test]
    fn only_triangles_on_top_of_each_other_are_kept_from_obvhs() {
        let steps = |mesh: &Mesh| {
            let triangles = MeshBvh::build(mesh).triangles;
            MedianSplit::build(&triangles, MAX_LEAF_TRIANGLES as usize).ploc_steps
        };
        assert_eq!(steps(&scattered(20_000)), 0);
        let corner = [Vec3::X, Vec3::Y, Vec3::Z];
        assert_eq!(steps(&mesh_of([corner; 100])), 100 * 100);
    }

    fn square(z: f32) -> Mesh {
        let [a, b] = [Vec3::new(-1.0, -1.0, z), Vec3::new(1.0, -1.0, z)];
        let [c, d] = [Vec3::new(1.0, 1.0, z), Vec3::new(-1.0, 1.0, z)];
        mesh_of([[a, b, c], [a, c, d]])
    }

    #[test]
    fn a_moving_object_hides_what_is_behind_it_only_while_it_is_in_front() {
        let caster = SceneCaster {
            static_bvh: MeshBvh::build(&square(-5.0)),
            object_bvhs: vec![MeshBvh::build(&square(0.0))],
        };
        let cast = |scene_from_object| {
            let pose = ScenePose {
                scene_from_object: vec![scene_from_object],
                ..ScenePose::default()
            };
            caster.first_hit(
                Vec3::new(0.1, 0.2, 0.0),
                Vec3::NEG_Z * 2.0,
                f32::INFINITY,
                &pose,
            )
        };
        let rotation = Quat::from_rotation_y(0.7);
        let translation = Vec3::new(0.1, 0.2, -3.0);
        let scale = Vec3::new(0.5, -1.0, 0.25);
        let in_front = cast(Affine3A::from_scale_rotation_translation(
            scale,
            rotation,
            translation,
        ));
        assert!(matches!(in_front, Some(Hit { t, object: Some(0), .. }) if (t - 1.5).abs() < 1e-6));
        let aside = cast(Affine3A::from_translation(Vec3::X * 9.0));
        assert!(matches!(aside, Some(Hit { t, object: None, .. }) if (t - 2.5).abs() < 1e-6));
        let vanished = cast(Affine3A::from_scale(Vec3::ZERO));
        assert_eq!(vanished, aside);
    }
}
