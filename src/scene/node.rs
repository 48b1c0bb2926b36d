//! The node hierarchy: a strict tree, with transforms composed in f64.

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};

use super::document::NodeTransform;
use super::error::SceneProblem;
use super::warnings::Warnings;

/// Translation, rotation and scale, applied in the order scale, rotation, translation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trs {
    pub translation: DVec3,
    pub rotation: DQuat,
    pub scale: DVec3,
}

impl Trs {
    pub fn to_affine(self) -> DAffine3 {
        DAffine3::from_scale_rotation_translation(self.scale, self.rotation, self.translation)
    }
}

/// A node's place within its parent.
#[derive(Clone, Copy, Debug)]
pub(super) enum Local {
    Matrix(DAffine3),
    Trs(Trs),
}

impl Local {
    pub fn to_affine(self) -> DAffine3 {
        match self {
            Self::Matrix(affine) => affine,
            Self::Trs(trs) => trs.to_affine(),
        }
    }

    /// The nearest translation, rotation and scale; exact unless a matrix shears.
    pub fn to_trs(self) -> Trs {
        match self {
            Self::Trs(trs) => trs,
            Self::Matrix(affine) => {
                let (scale, rotation, translation) = affine.to_scale_rotation_translation();
                Trs {
                    translation,
                    rotation: normalized(rotation).unwrap_or(DQuat::IDENTITY),
                    scale,
                }
            }
        }
    }
}

/// The nodes that the scene shows.
pub(super) struct NodeTree {
    /// Indices of the shown nodes, parents before children.
    pub order: Vec<usize>,
    /// Parent of each node of the file; `None` for a root and for a node that is not shown.
    pub parent: Vec<Option<usize>>,
    /// Place of each node of the file within its parent.
    pub local: Vec<Local>,
    /// Name of each node of the file, for messages.
    pub names: Vec<String>,
}

impl NodeTree {
    /// Follows the default scene (or the first, or the nodes that are nobody's child) from its roots.
    ///
    /// # Errors
    /// If a node can be reached twice: the file is cyclic, or a node has two parents.
    pub fn build(
        document: &gltf::Document,
        transforms: &[NodeTransform],
        warnings: &mut Warnings,
    ) -> Result<Self, SceneProblem> {
        let root = document.as_json();
        let names: Vec<String> = document
            .nodes()
            .map(|node| display_name("node", node.name(), node.index()))
            .collect();
        let local = transforms
            .iter()
            .zip(&names)
            .map(|(transform, name)| local_transform(transform, name, warnings))
            .collect::<Result<Vec<_>, _>>()?;

        let mut parent = vec![None; names.len()];
        let mut is_reached = vec![false; names.len()];
        let mut order = scene_roots(root, warnings);
        let mut next = 0;
        for &node in &order {
            if std::mem::replace(&mut is_reached[node], true) {
                return Err(reached_twice(&names[node]));
            }
        }
        while let Some(&node) = order.get(next) {
            next += 1;
            for child in root.nodes[node].children.iter().flatten() {
                let child = child.value();
                if std::mem::replace(&mut is_reached[child], true) {
                    return Err(reached_twice(&names[child]));
                }
                parent[child] = Some(node);
                order.push(child);
            }
        }
        Ok(Self {
            order,
            parent,
            local,
            names,
        })
    }
}

fn reached_twice(name: &str) -> SceneProblem {
    SceneProblem::Invalid(format!(
        "{name} can be reached on two ways (a cycle, or two parents); glTF nodes form a strict tree"
    ))
}

fn scene_roots(root: &gltf::json::Root, warnings: &mut Warnings) -> Vec<usize> {
    let shown = root.scene.map_or(0, |scene| scene.value());
    if root.scenes.len() > 1 {
        let others = root.scenes.len() - 1;
        warnings.push(format!(
            "the file holds {others} more scenes; only scene {shown} is loaded"
        ));
    }
    if let Some(scene) = root.scenes.get(shown) {
        return scene.nodes.iter().map(|node| node.value()).collect();
    }
    let mut is_child = vec![false; root.nodes.len()];
    for child in root.nodes.iter().flat_map(|n| n.children.iter().flatten()) {
        is_child[child.value()] = true;
    }
    (0..root.nodes.len()).filter(|&n| !is_child[n]).collect()
}

fn local_transform(
    transform: &NodeTransform,
    name: &str,
    warnings: &mut Warnings,
) -> Result<Local, SceneProblem> {
    let local = if let Some(matrix) = transform.matrix {
        Local::Matrix(DAffine3::from_mat4(DMat4::from_cols_array(&matrix)))
    } else {
        let rotation = transform
            .rotation
            .map_or(DQuat::IDENTITY, DQuat::from_array);
        Local::Trs(Trs {
            translation: transform.translation.map_or(DVec3::ZERO, DVec3::from_array),
            rotation: normalized(rotation).unwrap_or_else(|| {
                warnings.push(format!(
                    "{name} has a zero rotation quaternion; it is not rotated"
                ));
                DQuat::IDENTITY
            }),
            scale: transform.scale.map_or(DVec3::ONE, DVec3::from_array),
        })
    };
    if local.to_affine().is_finite() {
        return Ok(local);
    }
    Err(SceneProblem::NotFinite(format!(
        "{name} has a transform that is not finite"
    )))
}

/// A unit quaternion, or `None` where it has no direction.
pub(super) fn normalized(quaternion: DQuat) -> Option<DQuat> {
    let largest = quaternion
        .to_array()
        .into_iter()
        .fold(0.0, |m: f64, c| m.max(c.abs()));
    if !(largest.is_finite() && largest > 0.0) {
        return None;
    }
    // Divided by the largest component first, so that the squares neither overflow nor vanish.
    let scaled = DQuat::from_array(quaternion.to_array().map(|c| c / largest));
    Some(scaled.normalize())
}

/// Whether a linear map squashes space flat (or is not finite), so that it has no normals and no inverse.
pub(super) fn is_singular(linear: DMat3) -> bool {
    let longest = [linear.x_axis, linear.y_axis, linear.z_axis]
        .into_iter()
        .fold(0.0, |longest: f64, axis| longest.max(axis.length()));
    // Relative to the volume that orthogonal axes of that length would span; f32 vertices hold no more than this.
    const SMALLEST_VOLUME: f64 = 1e-18;
    let volume = (linear * (1.0 / longest)).determinant().abs();
    !(volume > SMALLEST_VOLUME && volume.is_finite())
}

/// `camera "main"`, or `camera 3` for one without a name. Long names are cut.
pub(super) fn display_name(kind: &str, name: Option<&str>, index: usize) -> String {
    match name {
        Some(name) if !name.is_empty() => {
            format!("{kind} `{}`", name.chars().take(80).collect::<String>())
        }
        _ => format!("{kind} {index}"),
    }
}
