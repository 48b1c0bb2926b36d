//! Triangle meshes and the few shapes that the scenes are made of.
//!
//! A shape starts as positions, texture coordinates and triangles, counter-clockwise seen from outside; [`Mesh::shaded`] then gives
//! it normals. Without them it is written without NORMAL, which glTF shades flat.

use std::collections::HashMap;
use std::f64::consts::TAU;

use glam::{DQuat, DVec2, DVec3};

use super::math::sin_cos;

/// Indexed triangles in metres.
#[derive(Clone, Default)]
pub struct Mesh {
    /// Vertex positions, metres.
    pub positions: Vec<DVec3>,
    /// Unit normals, one a vertex, or empty for a flat mesh.
    pub normals: Vec<DVec3>,
    /// Texture coordinates, one a vertex.
    pub texcoords: Vec<DVec2>,
    /// Vertex indices.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// A sheet `point(u, v)` over \[0,1\]², with `columns` × `rows` cells; its front is where ∂u × ∂v points.
    /// Triangles that a pole closes to a line are left out.
    pub fn sheet(columns: u32, rows: u32, point: impl Fn(f64, f64) -> DVec3) -> Self {
        let mut mesh = Self::default();
        for row in 0..=rows {
            for column in 0..=columns {
                let (u, v) = (column as f64 / columns as f64, row as f64 / rows as f64);
                mesh.positions.push(point(u, v));
                mesh.texcoords.push(DVec2::new(u, v));
            }
        }
        for row in 0..rows {
            for column in 0..columns {
                let first = row * (columns + 1) + column;
                let (right, above) = (first + 1, first + columns + 1);
                mesh.push_unless_degenerate([first, right, above + 1]);
                mesh.push_unless_degenerate([first, above + 1, above]);
            }
        }
        mesh
    }

    /// A rectangle with rectangular holes `[u0, v0, u1, v1]`, in metres along `u_axis` and `v_axis` (unit vectors) from `corner`.
    /// Texture coordinates are metres as well. Its front is where `u_axis` × `v_axis` points.
    pub fn wall(
        corner: DVec3,
        (u_axis, u_length_m): (DVec3, f64),
        (v_axis, v_length_m): (DVec3, f64),
        holes: &[[f64; 4]],
    ) -> Self {
        let cuts = |length_m: f64, low: usize, high: usize| {
            let mut cuts = vec![0.0, length_m];
            cuts.extend(holes.iter().flat_map(|hole| [hole[low], hole[high]]));
            cuts.sort_by(f64::total_cmp);
            cuts.dedup();
            cuts
        };
        let (u_cuts, v_cuts) = (cuts(u_length_m, 0, 2), cuts(v_length_m, 1, 3));
        let mut mesh = Self::default();
        for v in &v_cuts {
            for u in &u_cuts {
                mesh.positions.push(corner + u_axis * *u + v_axis * *v);
                mesh.texcoords.push(DVec2::new(*u, *v));
            }
        }
        for (row, v) in v_cuts.windows(2).enumerate() {
            for (column, u) in u_cuts.windows(2).enumerate() {
                let is_in = |hole: &[f64; 4]| {
                    hole[0] <= u[0] && u[1] <= hole[2] && hole[1] <= v[0] && v[1] <= hole[3]
                };
                if !holes.iter().any(is_in) {
                    let first = (row * u_cuts.len() + column) as u32;
                    let above = first + u_cuts.len() as u32;
                    mesh.triangles.push([first, first + 1, above + 1]);
                    mesh.triangles.push([first, above + 1, above]);
                }
            }
        }
        mesh
    }

    /// An axis-aligned box, its front outside.
    pub fn cuboid(min: DVec3, max: DVec3) -> Self {
        let size = max - min;
        let (x, y, z) = ((DVec3::X, size.x), (DVec3::Y, size.y), (DVec3::Z, size.z));
        let mut mesh = Self::default();
        for (corner, u, v) in [(min, y, x), (min, z, y), (min, x, z)] {
            mesh.append(Self::wall(corner, u, v, &[]));
            let opposite = corner + size * (DVec3::ONE - u.0 - v.0);
            mesh.append(Self::wall(opposite, v, u, &[]));
        }
        mesh
    }

    /// A surface of revolution about +Y through `profile` (radius, height), bottom to top along the outside.
    pub fn lathe(profile: &[DVec2], segments: u32) -> Self {
        let rows = profile.len() as u32 - 1;
        Self::sheet(segments, rows, |u, v| {
            let point = profile[(v * rows as f64).round() as usize];
            let (sin, cos) = sin_cos(u * TAU);
            DVec3::new(point.x * cos, point.y, -point.x * sin)
        })
    }

    /// A sphere about the origin by `subdivisions` of the icosahedron (20 · 4ⁿ triangles of nearly one size), flat until shaded.
    pub fn icosphere(radius_m: f64, subdivisions: u32) -> Self {
        let golden = (1.0 + 5f64.sqrt()) * 0.5;
        let mut positions: Vec<DVec3> = [
            (1.0, golden),
            (-1.0, golden),
            (1.0, -golden),
            (-1.0, -golden),
        ]
        .iter()
        .flat_map(|&(one, long)| {
            [
                DVec3::new(0.0, one, long),
                DVec3::new(one, long, 0.0),
                DVec3::new(long, 0.0, one),
            ]
        })
        .map(DVec3::normalize)
        .collect();
        // Faces are the triples of nearest neighbours, turned outward.
        let edge2 = 4.0 / (1.0 + golden * golden) + 1e-9;
        let is_edge = |a: usize, b: usize| positions[a].distance_squared(positions[b]) < edge2;
        let mut triangles = Vec::new();
        for a in 0..12 {
            for b in a + 1..12 {
                for c in b + 1..12 {
                    if is_edge(a, b) && is_edge(b, c) && is_edge(a, c) {
                        let outward = positions[a].cross(positions[b]).dot(positions[c]) > 0.0;
                        let (b, c) = if outward { (b, c) } else { (c, b) };
                        triangles.push([a as u32, b as u32, c as u32]);
                    }
                }
            }
        }
        for _ in 0..subdivisions {
            let mut middles = HashMap::new();
            let mut middle_of = |a: u32, b: u32| {
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    let middle = positions[a as usize] + positions[b as usize];
                    positions.push(middle.normalize());
                    positions.len() as u32 - 1
                })
            };
            triangles = triangles
                .iter()
                .flat_map(|&[a, b, c]| {
                    let (ab, bc, ca) = (middle_of(a, b), middle_of(b, c), middle_of(c, a));
                    [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
                })
                .collect();
        }
        Self {
            texcoords: vec![DVec2::ZERO; positions.len()],
            positions: positions.iter().map(|p| *p * radius_m).collect(),
            normals: Vec::new(),
            triangles,
        }
    }

    /// Smooth normals where neighbouring faces meet at less than `crease_deg`, sharp edges elsewhere: each corner takes the
    /// area-weighted mean over those faces around its position. Vertices are split and merged as that asks.
    pub fn shaded(&self, crease_deg: f64) -> Self {
        let crease_cos = sin_cos(crease_deg.to_radians()).1;
        let doubled_areas: Vec<DVec3> = self
            .triangles
            .iter()
            .map(|t| self.doubled_area(*t))
            .collect();
        let mut faces_at: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
        for (face, triangle) in self.triangles.iter().enumerate() {
            for vertex in triangle {
                let place = grid_place(self.positions[*vertex as usize]);
                faces_at.entry(place).or_default().push(face);
            }
        }
        let mut shaded = Self::default();
        let mut index_of = HashMap::new();
        for (face, triangle) in self.triangles.iter().enumerate() {
            let face_normal = doubled_areas[face].normalize();
            let corners = triangle.map(|vertex| {
                let position = self.positions[vertex as usize];
                let texcoord = self.texcoords[vertex as usize];
                let place = grid_place(position);
                let normal = faces_at[&place]
                    .iter()
                    .map(|neighbour| doubled_areas[*neighbour])
                    .filter(|area| area.normalize().dot(face_normal) >= crease_cos)
                    .sum::<DVec3>()
                    .normalize();
                let key = (place, grid_place(normal), grid_place(texcoord.extend(0.0)));
                *index_of.entry(key).or_insert_with(|| {
                    shaded.positions.push(position);
                    shaded.normals.push(normal);
                    shaded.texcoords.push(texcoord);
                    shaded.positions.len() as u32 - 1
                })
            });
            shaded.triangles.push(corners);
        }
        shaded
    }

    /// A sphere about the origin with its exact normals.
    pub fn sphere(radius_m: f64, subdivisions: u32) -> Self {
        let mut sphere = Self::icosphere(radius_m, subdivisions);
        sphere.normals = sphere.positions.iter().map(|p| p.normalize()).collect();
        sphere
    }

    /// The same, moved by `offset` metres.
    pub fn moved(mut self, offset: DVec3) -> Self {
        self.positions.iter_mut().for_each(|p| *p += offset);
        self
    }

    /// The same, turned about the origin.
    pub fn turned(mut self, rotation: DQuat) -> Self {
        let vectors = self.positions.iter_mut().chain(&mut self.normals);
        vectors.for_each(|v| *v = rotation * *v);
        self
    }

    /// The same with every position moved by `place`; to be done before it is shaded.
    pub fn deformed(mut self, place: impl Fn(DVec3) -> DVec3) -> Self {
        self.positions.iter_mut().for_each(|p| *p = place(*p));
        self
    }

    /// The same with texture coordinates from positions and the old coordinates.
    pub fn textured(mut self, place: impl Fn(DVec3, DVec2) -> DVec2) -> Self {
        for (texcoord, position) in self.texcoords.iter_mut().zip(&self.positions) {
            *texcoord = place(*position, *texcoord);
        }
        self
    }

    /// The same, inside out.
    pub fn flipped(mut self) -> Self {
        self.normals.iter_mut().for_each(|n| *n = -*n);
        self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        self
    }

    /// Adds another mesh's triangles.
    pub fn append(&mut self, other: Self) {
        let base = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.normals.extend(other.normals);
        self.texcoords.extend(other.texcoords);
        let shifted = other.triangles.iter().map(|t| t.map(|i| i + base));
        self.triangles.extend(shifted);
    }

    fn push_unless_degenerate(&mut self, triangle: [u32; 3]) {
        if self.doubled_area(triangle).length_squared() > 1e-20 {
            self.triangles.push(triangle);
        }
    }

    fn doubled_area(&self, triangle: [u32; 3]) -> DVec3 {
        let [a, b, c] = triangle.map(|vertex| self.positions[vertex as usize]);
        (b - a).cross(c - a)
    }
}

/// Joins meshes into one.
pub fn joined(meshes: impl IntoIterator<Item = Mesh>) -> Mesh {
    let mut all = Mesh::default();
    meshes.into_iter().for_each(|mesh| all.append(mesh));
    all
}

/// A vector on a grid of 0.1 µm, so that points that only rounding parts are one.
fn grid_place(vector: DVec3) -> [i64; 3] {
    (vector * 1e7).to_array().map(|x| x.round() as i64)
}
