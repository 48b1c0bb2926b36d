//! The plainest BVH: halves by number along the longest axis. Its depth and time are bounded for any input.

use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::triangle::Triangle;

/// A hierarchy, and a measure of how badly its triangles overlap.
pub(super) struct MedianSplit {
    pub bvh: Bvh2,
    /// About how many steps PLOC loses on triangles that lie on top of each other: it merges one pair of such a crowd a round, and each
    /// round visits all that are in a crowd.
    pub ploc_steps: u64,
}

/// This many triangles that each fill a quarter of their node's surface lie on top of each other, and make a crowd.
const CROWD: usize = 64;

/// A triangle's bounds, with its index.
#[derive(Clone, Copy)]
struct Item {
    bounds: Aabb,
    triangle: u32,
    is_in_crowd: bool,
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
                is_in_crowd: false,
            })
            .collect();
        let mut nodes = Vec::new();
        let mut largest_crowd = 0;
        // Nodes to fill, each with its part of the items.
        let mut pending = Vec::new();
        if !items.is_empty() {
            nodes.push(Bvh2Node::default());
            pending.push((0, 0..items.len()));
        }
        while let Some((node, range)) = pending.pop() {
            let part = &mut items[range.clone()];
            let bounds = union(part);
            largest_crowd = largest_crowd.max(mark_crowd(part, &bounds));
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
        let crowded = items.iter().filter(|item| item.is_in_crowd).count();
        Self {
            bvh,
            ploc_steps: largest_crowd as u64 * crowded as u64,
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

/// Marks the triangles that lie on top of each other in a node, and returns how many there are.
fn mark_crowd(items: &mut [Item], whole: &Aabb) -> usize {
    let large = 0.25 * whole.half_area();
    let is_large = |item: &Item| item.bounds.half_area() >= large;
    let count = items.iter().filter(|item| is_large(item)).count();
    if count < CROWD {
        return 0;
    }
    for item in items.iter_mut().filter(|item| is_large(item)) {
        item.is_in_crowd = true;
    }
    count
}
