//! The plainest BVH: halves by number along the longest axis. Its depth and time are bounded for any input.

use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::triangle::Triangle;

/// A hierarchy, and a measure of how badly its triangles overlap.
pub(super) struct MedianSplit {
    pub bvh: Bvh2,
    /// The most triangles under one node that each fill a quarter of its surface or more. A few in any sensible mesh, because they would
    /// have to lie on top of each other.
    pub largest_overlap: usize,
}

/// A triangle's bounds, with its index.
#[derive(Clone, Copy)]
struct Item {
    bounds: Aabb,
    triangle: u32,
}

impl MedianSplit {
    /// Builds with at most `max_leaf` triangles in a leaf.
    pub fn build(triangles: &[Triangle], max_leaf: usize) -> Self {
        let mut items: Vec<Item> = triangles
            .iter()
            .zip(0..)
            .map(|(triangle, index)| Item {
                bounds: triangle.aabb(),
                triangle: index,
            })
            .collect();
        let mut nodes = Vec::new();
        let mut largest_overlap = 0;
        // Nodes to fill, each with its part of the items.
        let mut pending = Vec::new();
        if !items.is_empty() {
            nodes.push(Bvh2Node::default());
            pending.push((0, 0..items.len()));
        }
        while let Some((node, range)) = pending.pop() {
            let part = &mut items[range.clone()];
            let bounds = union(part);
            largest_overlap = largest_overlap.max(count_large(part, &bounds));
            if part.len() <= max_leaf {
                nodes[node] = Bvh2Node::new(bounds, part.len() as u32, range.start as u32);
                continue;
            }
            let half = part.len() / 2;
            let axis = longest_axis(part);
            part.select_nth_unstable_by(half, |a, b| {
                a.bounds.center()[axis].total_cmp(&b.bounds.center()[axis])
            });
            let child = nodes.len();
            nodes.extend([Bvh2Node::default(); 2]);
            nodes[node] = Bvh2Node::new(bounds, 0, child as u32);
            let middle = range.start + half;
            pending.push((child, range.start..middle));
            pending.push((child + 1, middle..range.end));
        }
        let bvh = Bvh2 {
            nodes,
            primitive_indices: items.iter().map(|item| item.triangle).collect(),
            ..Bvh2::default()
        };
        Self {
            bvh,
            largest_overlap,
        }
    }
}

fn union(items: &[Item]) -> Aabb {
    items
        .iter()
        .fold(Aabb::empty(), |sum, item| sum.union(&item.bounds))
}

/// The axis along which the centres spread most.
fn longest_axis(items: &[Item]) -> usize {
    let mut spread = Aabb::empty();
    for item in items {
        spread.extend(item.bounds.center());
    }
    spread.largest_axis()
}

fn count_large(items: &[Item], whole: &Aabb) -> usize {
    let large = 0.25 * whole.half_area();
    items
        .iter()
        .filter(|item| item.bounds.half_area() >= large)
        .count()
}
