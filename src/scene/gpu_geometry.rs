//! Triangles and hierarchies in the layout of shaders/scene.wgsl and shaders/traversal.wgsl.

use glam::{Affine3A, Vec2, Vec3};

use super::bvh::MeshBvh;
use super::{Aabb, Mesh};

/// A child reference that leads nowhere (`NO_NODE` in traversal.wgsl).
const NO_NODE: u32 = 0xffff_ffff;
/// Marks a reference to a leaf: bits 27..30 hold its triangles less one, the rest its first triangle.
const LEAF: u32 = 0x8000_0000;
/// Marks a triangle without shading normals.
const FLAT: u32 = 0x8000_0000;
/// Most triangles that a leaf reference can point to.
pub const MAX_TRIANGLES: u64 = 1 << 27;

/// All meshes of a scene, one after the other: node references and triangle numbers count over the whole arrays.
#[derive(Default)]
pub struct GpuGeometry {
    /// Two vectors a node, one for each child: its bounds in 16 bits a side (low half: lower end) and the reference. A mesh's
    /// hierarchy starts with a header, the bounds' grid: lower corner and extent, metres.
    pub bvh_nodes: Vec<[u32; 4]>,
    /// Three vectors a triangle, in leaf order: first corner and the two edges from it.
    pub triangle_positions: Vec<[f32; 4]>,
    /// Three packed normals and the material with the flat bit.
    pub triangle_shading: Vec<[u32; 4]>,
    /// Three texture coordinates a triangle.
    pub triangle_texcoords: Vec<[f32; 2]>,
}

/// Octahedral packing of a unit vector, as `pack_direction` in shaders/packing.wgsl.
pub fn pack_direction(direction: Vec3) -> u32 {
    let mut p = Vec2::new(direction.x, direction.y) / direction.abs().element_sum();
    if direction.z < 0.0 {
        let sign = Vec2::new(1f32.copysign(p.x), 1f32.copysign(p.y));
        p = (Vec2::ONE - Vec2::new(p.y.abs(), p.x.abs())) * sign;
    }
    let snorm = |x: f32| u32::from(((x.clamp(-1.0, 1.0) * 32767.0).round() as i16) as u16);
    snorm(p.x) | snorm(p.y) << 16
}

impl GpuGeometry {
    /// Appends a mesh and returns the place of its hierarchy's header.
    pub fn append(&mut self, mesh: &Mesh, bvh: &MeshBvh) -> u32 {
        let first_triangle = (self.triangle_shading.len()) as u32;
        for &triangle in bvh.triangle_order() {
            self.append_triangle(mesh, triangle as usize);
        }
        self.append_nodes(bvh, first_triangle)
    }

    fn append_triangle(&mut self, mesh: &Mesh, triangle: usize) {
        let [a, b, c] = mesh.corners(triangle);
        for corner in [a, b - a, c - a] {
            self.triangle_positions
                .push([corner.x, corner.y, corner.z, 0.0]);
        }
        let vertices = mesh.triangles[triangle].map(|vertex| vertex as usize);
        let normals = vertices.map(|vertex| mesh.normals[vertex]);
        let is_flat = normals.contains(&Vec3::ZERO);
        let material = mesh.material_of_triangle[triangle] | if is_flat { FLAT } else { 0 };
        let packed = normals.map(|normal| if is_flat { 0 } else { pack_direction(normal) });
        self.triangle_shading
            .push([packed[0], packed[1], packed[2], material]);
        self.triangle_texcoords
            .extend(vertices.map(|vertex| mesh.texcoords[vertex].to_array()));
    }

    /// Lays the hierarchy out so that a node holds its children's bounds: one fetch decides about both. The first record is the
    /// header with the mesh's bounds, on whose 16-bit grid all others lie, rounded outwards.
    fn append_nodes(&mut self, bvh: &MeshBvh, first_triangle: u32) -> u32 {
        let header = self.bvh_nodes.len() as u32 / 2;
        let nodes = &bvh.bvh.nodes;
        let grid = BoundsGrid::over(nodes.first().map_or(Aabb::EMPTY, bounds_of));
        self.bvh_nodes.extend(grid.header());
        self.bvh_nodes.extend([[0; 4]; 2]);
        if nodes.is_empty() {
            self.write_children(header + 1, &grid, [None, None]);
            return header;
        }
        // (source node, place of the node that holds its children)
        let mut waiting = vec![(0usize, header + 1)];
        while let Some((source, place)) = waiting.pop() {
            let node = &nodes[source];
            let sources: [Option<usize>; 2] = if node.is_leaf() {
                [Some(source), None]
            } else {
                [
                    Some(node.first_index as usize),
                    Some(node.first_index as usize + 1),
                ]
            };
            let children = sources.map(|child| {
                child.map(|child| {
                    let node = &nodes[child];
                    let reference = if node.is_leaf() {
                        LEAF | (node.prim_count - 1) << 27 | (first_triangle + node.first_index)
                    } else {
                        let place = self.bvh_nodes.len() as u32 / 2;
                        self.bvh_nodes.extend([[0; 4]; 2]);
                        waiting.push((child, place));
                        place
                    };
                    (bounds_of(node), reference)
                })
            });
            self.write_children(place, &grid, children);
        }
        header
    }

    fn write_children(
        &mut self,
        place: u32,
        grid: &BoundsGrid,
        children: [Option<(Aabb, u32)>; 2],
    ) {
        for (side, child) in children.into_iter().enumerate() {
            self.bvh_nodes[place as usize * 2 + side] = child
                .map_or([0, 0, 0, NO_NODE], |(bounds, reference)| {
                    grid.child(bounds, reference)
                });
        }
    }
}

fn bounds_of(node: &obvhs::bvh2::node::Bvh2Node) -> Aabb {
    let bounds = node.aabb();
    Aabb {
        min: bounds.min.into(),
        max: bounds.max.into(),
    }
}

/// The grid of 65 536 steps a side on which a mesh's bounds are rounded outwards.
struct BoundsGrid {
    min: Vec3,
    extent: Vec3,
}

impl BoundsGrid {
    const STEPS: f32 = 65_535.0;

    fn over(bounds: Aabb) -> Self {
        if bounds.is_empty() {
            return Self {
                min: Vec3::ZERO,
                extent: Vec3::ONE,
            };
        }
        // A flat mesh gets some thickness, and every mesh a margin that outdoes the rounding of min and extent.
        let extent = bounds.max - bounds.min;
        let margin = extent
            .max_element()
            .max(bounds.max.abs().max(bounds.min.abs()).max_element() * 1e-3)
            .max(1e-30)
            * 1e-5;
        Self {
            min: bounds.min - margin,
            extent: extent + 2.0 * margin,
        }
    }

    fn header(&self) -> [[u32; 4]; 2] {
        let bits = |v: Vec3| [v.x.to_bits(), v.y.to_bits(), v.z.to_bits(), 0];
        [bits(self.min), bits(self.extent)]
    }

    fn child(&self, bounds: Aabb, reference: u32) -> [u32; 4] {
        let steps = |point: Vec3| (point - self.min) / self.extent * Self::STEPS;
        // One step more on each side than exact arithmetic needs.
        let low = (steps(bounds.min).floor() - 1.0)
            .clamp(Vec3::ZERO, Vec3::splat(Self::STEPS))
            .as_uvec3();
        let high = (steps(bounds.max).ceil() + 1.0)
            .clamp(Vec3::ZERO, Vec3::splat(Self::STEPS))
            .as_uvec3();
        let packed = low | high << glam::UVec3::splat(16);
        [packed.x, packed.y, packed.z, reference]
    }
}

fn child_vectors(child: Option<(Aabb, u32)>) -> [[f32; 4]; 2] {
    let (bounds, reference) = child.unwrap_or((Aabb::EMPTY, NO_NODE));
    let (min, max) = (bounds.min, bounds.max);
    [
        [min.x, min.y, min.z, f32::from_bits(reference)],
        [max.x, max.y, max.z, 0.0],
    ]
}

/// The tree over the moving objects' bounds in scene space, halved by count along its longest side: at most 28 levels, so that its
/// stack in traversal.wgsl holds. An object whose place is singular is left out.
pub fn object_tree(object_bounds: &[Aabb], scene_from_object: &[Affine3A]) -> Vec<[f32; 4]> {
    let mut placed: Vec<(Aabb, u32)> = object_bounds
        .iter()
        .zip(scene_from_object)
        .enumerate()
        .filter(|(_, (bounds, map))| !bounds.is_empty() && map.inverse().is_finite())
        .map(|(index, (bounds, map))| {
            let mut in_scene = Aabb::EMPTY;
            for corner in bounds.corners() {
                in_scene.include(map.transform_point3(corner));
            }
            (in_scene, LEAF | index as u32)
        })
        .collect();
    let mut nodes = vec![[0.0; 4]; 4];
    let children = match placed.len() {
        0 => [None, None],
        1 => [Some(placed[0]), None],
        _ => split(&mut placed, &mut nodes),
    };
    write_node(&mut nodes, 0, children);
    nodes
}

fn write_node(nodes: &mut [[f32; 4]], place: usize, children: [Option<(Aabb, u32)>; 2]) {
    for (side, child) in children.into_iter().enumerate() {
        nodes[place * 4 + side * 2..][..2].copy_from_slice(&child_vectors(child));
    }
}

fn split(objects: &mut [(Aabb, u32)], nodes: &mut Vec<[f32; 4]>) -> [Option<(Aabb, u32)>; 2] {
    let bounds = union(objects);
    let axis = (bounds.max - bounds.min).max_position();
    objects.sort_by(|a, b| a.0.center()[axis].total_cmp(&b.0.center()[axis]));
    let middle = objects.len() / 2;
    let (low, high) = objects.split_at_mut(middle);
    [low, high].map(|half| {
        if let [only] = half {
            return Some(*only);
        }
        let place = nodes.len() / 4;
        nodes.extend([[0.0; 4]; 4]);
        let children = split(half, nodes);
        write_node(nodes, place, children);
        Some((union(half), place as u32))
    })
}

fn union(objects: &[(Aabb, u32)]) -> Aabb {
    let mut all = Aabb::EMPTY;
    for (bounds, _) in objects {
        all.include(bounds.min);
        all.include(bounds.max);
    }
    all
}
