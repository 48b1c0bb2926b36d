//! Triangles, and the box around them.

use glam::{DAffine3, DVec3, Vec2, Vec3};

/// Indexed triangles. A normal of zero means: flat, use the triangle's own normal.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertex positions, metres.
    pub positions: Vec<Vec3>,
    /// Unit shading normals, one a vertex, or zero for a flat face.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, one a vertex, (0,0) where the file has none.
    pub texcoords: Vec<Vec2>,
    /// Vertex indices, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Material of each triangle.
    pub material_of_triangle: Vec<u32>,
}

impl Mesh {
    /// Corners of a triangle, metres.
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|vertex| self.positions[vertex as usize])
    }

    /// Bounds of the vertices that triangles use.
    pub fn bounds(&self) -> Aabb {
        let mut bounds = Aabb::EMPTY;
        for &vertex in self.triangles.iter().flatten() {
            bounds.include(self.positions[vertex as usize]);
        }
        bounds
    }

    /// Bytes that the mesh takes on the host.
    pub fn host_bytes(&self) -> usize {
        size_of_val(self.positions.as_slice())
            + size_of_val(self.normals.as_slice())
            + size_of_val(self.texcoords.as_slice())
            + size_of_val(self.triangles.as_slice())
            + size_of_val(self.material_of_triangle.as_slice())
    }

    /// Adds the triangles of `part`, placed by `to_self`: normals by the inverse transpose, and the winding turned if it mirrors.
    /// `to_self` must not be singular.
    pub(super) fn append(&mut self, part: &Mesh, to_self: DAffine3) {
        let first_vertex = self.positions.len() as u32;
        let normal_map = to_self.matrix3.inverse().transpose();
        let position = |p: &Vec3| to_self.transform_point3(p.as_dvec3()).as_vec3();
        let normal = |n: &Vec3| {
            (normal_map * n.as_dvec3())
                .normalize_or(DVec3::ZERO)
                .as_vec3()
        };
        self.positions.extend(part.positions.iter().map(position));
        self.normals.extend(part.normals.iter().map(normal));
        self.texcoords.extend_from_slice(&part.texcoords);
        let is_mirrored = to_self.matrix3.determinant() < 0.0;
        self.triangles.extend(part.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|vertex| vertex + first_vertex);
            if is_mirrored { [a, c, b] } else { [a, b, c] }
        }));
        self.material_of_triangle
            .extend_from_slice(&part.material_of_triangle);
    }

    /// Drops the triangles whose normal f32 arithmetic cannot compute (no area, or less than about 1e-19 m²), and returns how many.
    pub(super) fn drop_degenerate(&mut self) -> usize {
        let before = self.triangles.len();
        let has_normal: Vec<bool> = (0..before)
            .map(|triangle| {
                let [a, b, c] = self.corners(triangle);
                (b - a).cross(c - a).length_squared() >= f32::MIN_POSITIVE
            })
            .collect();
        let mut keep = has_normal.iter();
        self.triangles.retain(|_| keep.next() == Some(&true));
        let mut keep = has_normal.iter();
        self.material_of_triangle
            .retain(|_| keep.next() == Some(&true));
        before - self.triangles.len()
    }
}

/// A mesh that the animation moves, in the space of the node that carries it.
#[derive(Clone, Debug)]
pub struct RigidObject {
    /// Name of the glTF node.
    pub name: String,
    /// Geometry in object space, as the file has it; [`super::ScenePose::scene_from_object`] places it, scale and mirror included.
    pub mesh: Mesh,
    /// Index of the node that places it, for [`super::animation::Animation`].
    pub node: usize,
}

/// Axis-aligned bounds, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Lower corner.
    pub min: Vec3,
    /// Upper corner.
    pub max: Vec3,
}

impl Aabb {
    /// Bounds of nothing.
    pub const EMPTY: Self = Self {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };

    /// Grows to hold `point`.
    pub fn include(&mut self, point: Vec3) {
        self.min = self.min.min(point);
        self.max = self.max.max(point);
    }

    /// Whether anything is inside.
    pub fn is_empty(&self) -> bool {
        self.min.cmpgt(self.max).any()
    }

    /// Centre, metres; the origin for empty bounds.
    pub fn center(&self) -> Vec3 {
        if self.is_empty() {
            Vec3::ZERO
        } else {
            (self.min + self.max) * 0.5
        }
    }

    /// Length of the diagonal, metres; 0 for empty bounds.
    pub fn diagonal_m(&self) -> f32 {
        if self.is_empty() {
            0.0
        } else {
            (self.max - self.min).length()
        }
    }

    /// The eight corners; none for empty bounds.
    pub fn corners(&self) -> impl Iterator<Item = Vec3> + use<> {
        let Self { min, max } = *self;
        let count = if self.is_empty() { 0 } else { 8 };
        (0..count).map(move |corner: u32| {
            let high = |axis: u32| corner >> axis & 1 == 1;
            Vec3::select(glam::BVec3::new(high(0), high(1), high(2)), max, min)
        })
    }
}
