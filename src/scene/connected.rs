//! Which triangles hang together.

use std::collections::HashMap;

use glam::Vec3;

/// The first triangle of the piece that each of these triangles belongs to. They are of one piece where corners lie in one place, whatever
/// their vertices: meshes split these at seams of their normals and texture coordinates.
pub(super) fn pieces(triangles: impl ExactSizeIterator<Item = [Vec3; 3]>) -> Vec<usize> {
    let mut piece_of: Vec<usize> = (0..triangles.len()).collect();
    let mut at_place: HashMap<[u32; 3], usize> = HashMap::new();
    for (index, corners) in triangles.enumerate() {
        for corner in corners {
            // Adding zero makes one zero of the two.
            let place = (corner + 0.0).to_array().map(f32::to_bits);
            let neighbour = *at_place.entry(place).or_insert(index);
            let (a, b) = (root(&mut piece_of, index), root(&mut piece_of, neighbour));
            piece_of[a.max(b)] = a.min(b);
        }
    }
    (0..piece_of.len())
        .map(|index| root(&mut piece_of, index))
        .collect()
}

/// The first triangle of a piece; shortens the way to it.
fn root(piece_of: &mut [usize], mut index: usize) -> usize {
    while piece_of[index] != index {
        piece_of[index] = piece_of[piece_of[index]];
        index = piece_of[index];
    }
    index
}
