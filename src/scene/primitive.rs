//! A glTF primitive to a [`Mesh`] in its own space.

use glam::{Vec2, Vec3};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;

use super::accessor::Accessors;
use super::error::SceneProblem;
use super::material::LoadedMaterial;
use super::mesh::Mesh;
use super::warnings::Warnings;

/// What a mesh claims to hold, before any of it is read.
#[derive(Clone, Copy, Default)]
pub(super) struct Claim {
    pub vertices: u64,
    pub triangles: u64,
}

/// Adds up what the primitives of a mesh claim.
pub(super) fn claim_of(mesh: &gltf::json::Mesh, accessors: &Accessors) -> Claim {
    let mut claim = Claim::default();
    for primitive in &mesh.primitives {
        let vertices = attribute(primitive, Semantic::Positions).map_or(0, |a| accessors.count(a));
        let corners = match primitive.indices {
            Some(indices) => accessors.count(indices.value()),
            None => vertices,
        };
        let triangles = match primitive.mode {
            Checked::Valid(Mode::Triangles) => corners / 3,
            Checked::Valid(Mode::TriangleStrip | Mode::TriangleFan) => corners.saturating_sub(2),
            _ => continue,
        };
        claim.vertices = claim.vertices.saturating_add(vertices);
        claim.triangles = claim.triangles.saturating_add(triangles);
    }
    claim
}

/// Reads all triangles of a mesh; `label` names it in messages. Its claim must have been checked against the limits.
pub(super) fn read_mesh(
    mesh: &gltf::json::Mesh,
    label: &str,
    accessors: &Accessors,
    materials: &[LoadedMaterial],
    warnings: &mut Warnings,
) -> Result<Mesh, SceneProblem> {
    let mut merged = Mesh::default();
    if mesh.primitives.iter().any(|p| p.targets.is_some()) {
        warnings.push(format!(
            "{label} has morph targets; it keeps its rest shape"
        ));
    }
    for (index, primitive) in mesh.primitives.iter().enumerate() {
        let label = format!("{label} primitive {index}");
        let Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) =
            primitive.mode
        else {
            warnings.push(format!("{label} is points or lines; it is left out"));
            continue;
        };
        let part = read_primitive(primitive, mode, &label, accessors, materials, warnings)?;
        merged.append(&part, glam::DAffine3::IDENTITY);
    }
    Ok(merged)
}

fn read_primitive(
    primitive: &Primitive,
    mode: Mode,
    label: &str,
    accessors: &Accessors,
    materials: &[LoadedMaterial],
    warnings: &mut Warnings,
) -> Result<Mesh, SceneProblem> {
    let Some(position_accessor) = attribute(primitive, Semantic::Positions) else {
        return Err(SceneProblem::Invalid(format!("{label} has no POSITION")));
    };
    let positions = accessors.read_vectors::<3>(position_accessor, &format!("{label} POSITION"))?;
    let count = positions.len();
    let check_count = |name: &str, found: u64| {
        if found == count as u64 {
            return Ok(());
        }
        Err(SceneProblem::Invalid(format!(
            "{label} has {found} {name} for {count} positions"
        )))
    };

    let normals = match attribute(primitive, Semantic::Normals) {
        Some(accessor) => {
            check_count("normals", accessors.count(accessor))?;
            accessors.read_vectors::<3>(accessor, &format!("{label} NORMAL"))?
        }
        None => vec![[0.0; 3]; count],
    };
    let material_index = primitive
        .material
        .map_or(materials.len() - 1, |m| m.value());
    let texcoord_set = materials[material_index].texcoord_set;
    let texcoord_accessor = attribute(primitive, Semantic::TexCoords(texcoord_set.unwrap_or(0)));
    let texcoords = match texcoord_accessor {
        Some(accessor) => {
            check_count("texture coordinates", accessors.count(accessor))?;
            accessors.read_vectors::<2>(accessor, &format!("{label} TEXCOORD"))?
        }
        None => vec![[0.0; 2]; count],
    };
    if let (Some(set), None) = (texcoord_set, texcoord_accessor) {
        warnings.push(format!(
            "{label} has a textured material and no TEXCOORD_{set}; the texture's corner colours it"
        ));
    }
    if attribute(primitive, Semantic::Colors(0)).is_some() {
        warnings.push(format!("{label} has vertex colours; they are not read"));
    }

    let corners = match primitive.indices {
        Some(indices) => accessors.read_indices(indices.value(), &format!("{label} indices"))?,
        None => (0..count as u32).collect(),
    };
    if let Some(beyond) = corners.iter().find(|&&vertex| vertex as usize >= count) {
        return Err(SceneProblem::Invalid(format!(
            "{label} has index {beyond}, but only {count} vertices"
        )));
    }
    let triangles = triangulate(&corners, mode);
    Ok(Mesh {
        positions: positions.into_iter().map(Vec3::from_array).collect(),
        normals: normals.into_iter().map(Vec3::from_array).collect(),
        texcoords: texcoords.into_iter().map(Vec2::from_array).collect(),
        material_of_triangle: vec![material_index as u32; triangles.len()],
        triangles,
    })
}

fn attribute(primitive: &Primitive, semantic: Semantic) -> Option<usize> {
    let accessor = primitive.attributes.get(&Checked::Valid(semantic))?;
    Some(accessor.value())
}

/// Triangles of a list, strip or fan with the winding of glTF 2.0, section 3.7.2.1.
fn triangulate(corners: &[u32], mode: Mode) -> Vec<[u32; 3]> {
    let windows = corners.windows(3);
    match mode {
        Mode::TriangleStrip => windows
            .enumerate()
            .map(|(i, w)| {
                if i % 2 == 0 {
                    [w[0], w[1], w[2]]
                } else {
                    [w[0], w[2], w[1]]
                }
            })
            .collect(),
        Mode::TriangleFan => windows.map(|w| [w[1], w[2], corners[0]]).collect(),
        _ => corners
            .chunks_exact(3)
            .map(|c| [c[0], c[1], c[2]])
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_the_winding_of_the_specification() {
        let corners = [0, 1, 2, 3, 4];
        let strip = triangulate(&corners, Mode::TriangleStrip);
        assert_eq!(strip, [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
        let fan = triangulate(&corners, Mode::TriangleFan);
        assert_eq!(fan, [[1, 2, 0], [2, 3, 0], [3, 4, 0]]);
        assert_eq!(triangulate(&corners, Mode::Triangles), [[0, 1, 2]]);
    }
}
