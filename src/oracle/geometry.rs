//! What a ray meets, in f64: the triangles of the loaded scene, found through the hierarchies that obvhs built over them.

use glam::{DAffine3, DMat3, DVec2, DVec3};
use obvhs::bvh2::node::Bvh2Node;
use obvhs::triangle::Triangle;

use super::bsdf::{Bsdf, Sample};
use crate::scene::bvh::{MAX_DEPTH, MeshBvh, SceneCaster};
use crate::scene::{Mesh, Scene, ScenePose};

/// How steeply a ray leaves a surface that its interpolated normal would have sent to the wrong side, as a cosine.
const GRAZING_COS: f64 = 1e-3;

/// A half-line in scene space, metres.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Where it starts.
    pub origin: DVec3,
    /// Where it goes, unit.
    pub direction: DVec3,
}

/// A triangle that a ray meets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hit {
    /// Distance in lengths of the ray's direction.
    pub t: f64,
    /// Moving object, or `None` for the static mesh.
    pub object: Option<usize>,
    /// Triangle of its mesh.
    pub triangle: usize,
    /// Shares of the second and third corner.
    pub barycentric: DVec2,
}

/// A point on a surface, seen from the side that a ray came from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    pub position: DVec3,
    pub geometric_normal: DVec3,
    /// Interpolated, on the same side: it may turn away from the ray at a silhouette.
    pub shading_normal: DVec3,
    pub texcoord: DVec2,
    pub material: usize,
    pub is_front: bool,
}

impl Surface {
    /// The normal about which it scatters what is seen from `wo`. A surface that reflects diffusely keeps its own, so that it looks alike
    /// to both eyes; the flat one takes its place where it turns away.
    pub fn scattering_normal(&self, bsdf: &Bsdf, wo: DVec3) -> DVec3 {
        if bsdf.albedo == DVec3::ZERO {
            return sighted_normal(self.shading_normal, self.geometric_normal, wo);
        }
        match wo.dot(self.shading_normal) > 0.0 {
            true => self.shading_normal,
            false => self.geometric_normal,
        }
    }

    /// What is left of a scattering at the real surface. An interpolated normal may tilt a reflection through an opaque wall, and it ends
    /// there; what would be refracted back goes on along the far side, in the one direction that nothing else samples.
    pub fn scattered(&self, sample: Sample) -> Option<Sample> {
        let is_through = sample.wi.dot(self.geometric_normal) < 0.0;
        match sample.is_refracted {
            is_refracted if is_refracted == is_through => Some(sample),
            true => Some(Sample {
                wi: grazing(sample.wi, -self.geometric_normal),
                density: None,
                ..sample
            }),
            false => None,
        }
    }
}

/// The scene's triangles at one time.
pub(super) struct Geometry<'a> {
    pub scene: &'a Scene,
    caster: &'a SceneCaster,
    pub scene_from_object: Vec<DAffine3>,
    object_from_scene: Vec<Option<DAffine3>>,
    /// Distance from a surface, metres, below which a ray that leaves it meets nothing: far above the rounding of f64, even at a
    /// grazing angle, and far below anything that is modelled.
    pub clearance_m: f64,
}

fn to_f64(map: &glam::Affine3A) -> DAffine3 {
    DAffine3 {
        matrix3: DMat3::from_cols(
            map.matrix3.x_axis.as_dvec3(),
            map.matrix3.y_axis.as_dvec3(),
            map.matrix3.z_axis.as_dvec3(),
        ),
        translation: map.translation.as_dvec3(),
    }
}

impl<'a> Geometry<'a> {
    pub fn new(scene: &'a Scene, caster: &'a SceneCaster, pose: &ScenePose) -> Self {
        let scene_from_object: Vec<DAffine3> = pose.scene_from_object.iter().map(to_f64).collect();
        let inverse = |map: &DAffine3| Some(map.inverse()).filter(|inverse| inverse.is_finite());
        let reach_m = f64::from(scene.bounds_over_time().diagonal_m()).max(1e-9);
        Self {
            scene,
            caster,
            object_from_scene: scene_from_object.iter().map(inverse).collect(),
            scene_from_object,
            clearance_m: 1e-10 * reach_m,
        }
    }

    pub fn mesh(&self, object: Option<usize>) -> &Mesh {
        object.map_or(&self.scene.static_mesh, |object| {
            &self.scene.objects[object].mesh
        })
    }

    /// The nearest triangle from `t_min` to `t_max`.
    pub fn first_hit(&self, ray: &Ray, t_min: f64, t_max: f64) -> Option<Hit> {
        let mut nearest = mesh_hit(&self.caster.static_bvh, ray, t_min, t_max);
        let mut object_of_nearest = None;
        for (object, bvh) in self.caster.object_bvhs.iter().enumerate() {
            let Some(to_object) = self.object_from_scene[object] else {
                continue;
            };
            // The direction keeps its length in scene space, so that t means the same in both spaces.
            let in_object = Ray {
                origin: to_object.transform_point3(ray.origin),
                direction: to_object.transform_vector3(ray.direction),
            };
            let t_max = nearest.map_or(t_max, |(t, ..)| t);
            if let Some(hit) = mesh_hit(bvh, &in_object, t_min, t_max) {
                nearest = Some(hit);
                object_of_nearest = Some(object);
            }
        }
        let (t, position, barycentric) = nearest?;
        let bvh = object_of_nearest.map_or(&self.caster.static_bvh, |object| {
            &self.caster.object_bvhs[object]
        });
        Some(Hit {
            t,
            object: object_of_nearest,
            triangle: bvh.triangle_order()[position] as usize,
            barycentric,
        })
    }

    /// The surface that `ray` meets at `hit`.
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let mesh = self.mesh(hit.object);
        let vertices = mesh.triangles[hit.triangle].map(|vertex| vertex as usize);
        let shares = [
            1.0 - hit.barycentric.x - hit.barycentric.y,
            hit.barycentric.x,
            hit.barycentric.y,
        ];
        let mix = |of: &dyn Fn(usize) -> DVec3| -> DVec3 {
            (0..3).map(|i| of(vertices[i]) * shares[i]).sum()
        };
        let [a, b, c] = vertices.map(|vertex| mesh.positions[vertex].as_dvec3());
        let flat = (b - a).cross(c - a);
        let is_flat = vertices
            .iter()
            .any(|v| mesh.normals[*v] == glam::Vec3::ZERO);
        let smooth = mix(&|vertex| mesh.normals[vertex].as_dvec3().normalize_or(DVec3::ZERO));
        // Normals map by the inverse transpose.
        let place = hit.object.map(|object| self.scene_from_object[object]);
        let turn = |normal: DVec3| {
            let turned = place.map_or(normal, |map| map.matrix3.inverse().transpose() * normal);
            turned.normalize_or(DVec3::Z)
        };
        let mut geometric_normal = turn(flat);
        let mut shading_normal = if is_flat {
            geometric_normal
        } else {
            turn(smooth)
        };
        let is_front = ray.direction.dot(geometric_normal) < 0.0;
        if !is_front {
            geometric_normal = -geometric_normal;
            shading_normal = -shading_normal;
        }
        let position = mix(&|vertex| mesh.positions[vertex].as_dvec3());
        let texcoord = mix(&|vertex| mesh.texcoords[vertex].as_dvec2().extend(0.0));
        Surface {
            position: place.map_or(position, |map| map.transform_point3(position)),
            geometric_normal,
            shading_normal,
            texcoord: texcoord.truncate(),
            material: mesh.material_of_triangle[hit.triangle] as usize,
            is_front,
        }
    }
}

/// The direction next to `direction` that only just leaves a surface on the side of `normal`.
fn grazing(direction: DVec3, normal: DVec3) -> DVec3 {
    let along = direction.reject_from_normalized(normal);
    (along.normalize_or(DVec3::ZERO) + GRAZING_COS * normal).normalize_or(normal)
}

/// The normal next to `shading_normal` about which sight from `wo` is mirrored back to its own side of the real surface: about an
/// interpolated normal it may be mirrored into it, as no smooth surface does, and its light would be lost.
fn sighted_normal(shading_normal: DVec3, geometric_normal: DVec3, wo: DVec3) -> DVec3 {
    let cos_o = wo.dot(shading_normal);
    let mirrored = 2.0 * cos_o * shading_normal - wo;
    if cos_o > 0.0 && mirrored.dot(geometric_normal) > 0.0 {
        return shading_normal;
    }
    (wo + grazing(mirrored, geometric_normal)).normalize_or(geometric_normal)
}

/// Distance, place in the leaves' order, and barycentric coordinates of the nearest triangle of one mesh.
fn mesh_hit(bvh: &MeshBvh, ray: &Ray, t_min: f64, t_max: f64) -> Option<(f64, usize, DVec2)> {
    let inverse = DVec3::ONE / ray.direction;
    let nodes = &bvh.bvh.nodes;
    let mut nearest = None;
    let mut t_max = t_max;
    let mut stack = [0usize; MAX_DEPTH as usize + 1];
    let mut size = usize::from(!nodes.is_empty());
    while size > 0 {
        size -= 1;
        let node = &nodes[stack[size]];
        if !meets_box(node, ray.origin, inverse, t_max) {
            continue;
        }
        let first = node.first_index as usize;
        if !node.is_leaf() {
            stack[size] = first;
            stack[size + 1] = first + 1;
            size += 2;
            continue;
        }
        for position in first..first + node.prim_count as usize {
            if let Some((t, barycentric)) = triangle_hit(&bvh.triangles[position], ray)
                && t > t_min
                && t < t_max
            {
                t_max = t;
                nearest = Some((t, position, barycentric));
            }
        }
    }
    nearest
}

fn meets_box(node: &Bvh2Node, origin: DVec3, inverse: DVec3, t_max: f64) -> bool {
    let bounds = node.aabb();
    let low = (bounds.min.as_dvec3() - origin) * inverse;
    let high = (bounds.max.as_dvec3() - origin) * inverse;
    // f64's min and max pass over NaN, which a ray in the plane of a side gives.
    let near = (0..3).fold(0.0f64, |t, i| t.max(low[i].min(high[i])));
    let far = (0..3).fold(t_max, |t, i| t.min(low[i].max(high[i])));
    near <= far * (1.0 + 1e-12)
}

fn triangle_hit(triangle: &Triangle, ray: &Ray) -> Option<(f64, DVec2)> {
    let [a, b, c] = [triangle.v0, triangle.v1, triangle.v2].map(|corner| corner.as_dvec3());
    let (edge1, edge2) = (b - a, c - a);
    let p = ray.direction.cross(edge2);
    let determinant = edge1.dot(p);
    let s = ray.origin - a;
    let q = s.cross(edge1);
    let (u, v) = (s.dot(p) / determinant, ray.direction.dot(q) / determinant);
    let t = edge2.dot(q) / determinant;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t.is_finite()).then_some((t, DVec2::new(u, v)))
}
