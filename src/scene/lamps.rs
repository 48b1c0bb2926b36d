//! Lamps: lights that belong together, so that a choice among them all stays short however many there are.
//!
//! Each point, spot and directional light is a lamp, and so is each connected piece of a surface that shines. Where that makes too many,
//! neighbours share one.
//! Limits: neighbours are found at time 0; a piece is one lamp however large it is.

use glam::{Affine3A, Vec3};

use super::connected;
use super::light_table::EmissiveTriangle;
use super::{Aabb, PunctualKind, PunctualLight};

/// Most lamps of a scene.
pub const LAMPS_MAX: usize = 64;

/// The lamp of each light, counted from 0 without gaps: of the punctual lights, then of the triangles. Triangles of one object follow each
/// other.
pub(super) fn lamp_of_lights(
    punctual: &[PunctualLight],
    emissive: &[EmissiveTriangle],
    scene_from_object: &[Affine3A],
    scene_bounds: Aabb,
) -> Vec<u32> {
    let mut centers: Vec<Vec3> = punctual
        .iter()
        .map(|light| match light.kind {
            // Where it comes from: outside the scene, so that it shares with none while there are other neighbours.
            PunctualKind::Directional => {
                scene_bounds.center() - light.direction * scene_bounds.diagonal_m()
            }
            PunctualKind::Point | PunctualKind::Spot { .. } => light.position,
        })
        .collect();
    let mut lamps: Vec<u32> = (0..centers.len() as u32).collect();
    for of_object in emissive.chunk_by(|a, b| a.object == b.object) {
        let map = of_object[0]
            .object
            .map_or(Affine3A::IDENTITY, |object| scene_from_object[object]);
        let roots = connected::pieces(of_object.iter().map(|source| source.corners));
        let mut lamp_of_root = vec![0; roots.len()];
        let mut bounds = vec![Aabb::EMPTY; roots.len()];
        for (&root, source) in roots.iter().zip(of_object) {
            for corner in source.corners {
                bounds[root].include(map.transform_point3(corner));
            }
        }
        for (index, &root) in roots.iter().enumerate() {
            if index == root {
                lamp_of_root[root] = centers.len() as u32;
                centers.push(bounds[root].center());
            }
            lamps.push(lamp_of_root[root]);
        }
    }
    let group_of_lamp = grouped(&centers);
    lamps.iter().map(|l| group_of_lamp[*l as usize]).collect()
}

/// The group of each place: halves of the widest group by number, along its longest side, until there are [`LAMPS_MAX`].
fn grouped(places: &[Vec3]) -> Vec<u32> {
    let mut group_of: Vec<u32> = (0..places.len() as u32).collect();
    if places.len() <= LAMPS_MAX {
        return group_of;
    }
    let mut order: Vec<usize> = (0..places.len()).collect();
    let bounds_of = |members: &[usize]| {
        let mut bounds = Aabb::EMPTY;
        members.iter().for_each(|&m| bounds.include(places[m]));
        bounds
    };
    let mut groups = vec![(bounds_of(&order), order.as_mut_slice())];
    while groups.len() < LAMPS_MAX {
        // There are more places than groups: one can be parted.
        let parted = (0..groups.len())
            .filter(|&group| groups[group].1.len() > 1)
            .max_by(|&a, &b| {
                let diagonal_m = |group: usize| groups[group].0.diagonal_m();
                diagonal_m(a).total_cmp(&diagonal_m(b))
            });
        let Some(parted) = parted else { break };
        let (bounds, members) = groups.swap_remove(parted);
        let axis = (bounds.max - bounds.min).max_position();
        let half = members.len() / 2;
        members.select_nth_unstable_by(half, |&a, &b| places[a][axis].total_cmp(&places[b][axis]));
        let (low, high) = members.split_at_mut(half);
        groups.extend([(bounds_of(low), low), (bounds_of(high), high)]);
    }
    for (group, (_, members)) in groups.iter().enumerate() {
        members.iter().for_each(|&m| group_of[m] = group as u32);
    }
    group_of
}
