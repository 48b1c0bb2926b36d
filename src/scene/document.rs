//! glTF JSON to a document whose every index is in range.
//!
//! The gltf crate parses and validates, after the cases on which its own validation would panic or refuse a legal file are taken out.

use gltf::json::mesh::Semantic;
use gltf::json::validation::Checked;
use serde::Deserialize;

use super::error::SceneProblem;
use super::limits::LoadLimits;
use super::warnings::Warnings;

/// Extensions that macula reads; others are refused if required and warned of if merely used.
pub const SUPPORTED_EXTENSIONS: [&str; 7] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_volume",
    "KHR_texture_transform",
];

/// A node's transform in the precision of the JSON: the gltf crate would round a position 10 km away to a millimetre.
#[derive(Deserialize)]
pub(super) struct NodeTransform {
    pub matrix: Option<[f64; 16]>,
    pub translation: Option<[f64; 3]>,
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
}

#[derive(Deserialize)]
struct NodeTransforms {
    #[serde(default)]
    nodes: Vec<NodeTransform>,
}

/// Parses and validates the JSON. Every index of the result is in range, and every enumeration valid.
pub(super) fn parse(
    json: &[u8],
    limits: &LoadLimits,
    warnings: &mut Warnings,
) -> Result<(gltf::Document, Vec<NodeTransform>), SceneProblem> {
    let items = super::file::count_json_items(json);
    SceneProblem::check_limit(
        "items in the glTF JSON",
        items,
        limits.json_items,
        "json_items",
    )?;
    let mut root: gltf::json::Root = serde_json::from_slice(json).map_err(SceneProblem::Json)?;
    let transforms: NodeTransforms = serde_json::from_slice(json).map_err(SceneProblem::Json)?;
    check_version(&root.asset)?;
    let nodes = root.nodes.len() as u64;
    SceneProblem::check_limit("nodes", nodes, limits.nodes, "nodes")?;
    check_extensions(&mut root, warnings)?;
    remove_custom_attributes(&mut root)?;
    check_animation_targets(&root)?;
    let document = gltf::Document::from_json(root).map_err(shorten)?;
    Ok((document, transforms.nodes))
}

fn check_version(asset: &gltf::json::Asset) -> Result<(), SceneProblem> {
    if asset.version.starts_with("2.") {
        return Ok(());
    }
    let version: String = asset.version.chars().take(16).collect();
    Err(SceneProblem::Invalid(format!(
        "the file is glTF {version}; only glTF 2.x is read"
    )))
}

/// Judges the extensions here, because the crate's own list lacks some that it reads.
fn check_extensions(
    root: &mut gltf::json::Root,
    warnings: &mut Warnings,
) -> Result<(), SceneProblem> {
    let is_unknown = |name: &&String| !SUPPORTED_EXTENSIONS.contains(&name.as_str());
    let shortened = |name: &String| name.chars().take(80).collect::<String>();
    if let Some(name) = root.extensions_required.iter().find(is_unknown) {
        return Err(SceneProblem::RequiredExtension(shortened(name)));
    }
    for name in root.extensions_used.iter().filter(is_unknown) {
        let name = shortened(name);
        warnings.push(format!("extension {name} is not read and is left out"));
    }
    root.extensions_required.clear();
    Ok(())
}

/// Custom attributes are legal and of no use here, but the crate calls them invalid; and it panics on a POSITION out of range.
fn remove_custom_attributes(root: &mut gltf::json::Root) -> Result<(), SceneProblem> {
    let accessors = root.accessors.len();
    for (mesh_index, mesh) in root.meshes.iter_mut().enumerate() {
        for (index, primitive) in mesh.primitives.iter_mut().enumerate() {
            let attributes = &mut primitive.attributes;
            attributes.retain(|semantic, _| matches!(semantic, Checked::Valid(_)));
            let positions = attributes.get(&Checked::Valid(Semantic::Positions));
            if positions.is_some_and(|accessor| accessor.value() >= accessors) {
                return Err(SceneProblem::Invalid(format!(
                    "mesh {mesh_index} primitive {index}: its POSITION names an accessor that does not exist"
                )));
            }
        }
    }
    Ok(())
}

/// The crate validates an animation's samplers, but not what its channels aim at.
fn check_animation_targets(root: &gltf::json::Root) -> Result<(), SceneProblem> {
    for (index, animation) in root.animations.iter().enumerate() {
        for channel in &animation.channels {
            let is_node = channel.target.node.value() < root.nodes.len();
            let is_path = matches!(channel.target.path, Checked::Valid(_));
            if !(is_node && is_path) {
                return Err(SceneProblem::Invalid(format!(
                    "animation {index}: a channel moves a node or property that does not exist"
                )));
            }
        }
    }
    Ok(())
}

/// The first few of the crate's findings, which can be millions.
fn shorten(error: gltf::Error) -> SceneProblem {
    const SHOWN: usize = 3;
    let gltf::Error::Validation(findings) = error else {
        return SceneProblem::Invalid(error.to_string());
    };
    let mut message = findings
        .iter()
        .take(SHOWN)
        .map(|(path, error)| format!("{}: {error}", path.as_str()))
        .collect::<Vec<_>>()
        .join("; ");
    if findings.len() > SHOWN {
        message += &format!("; and {} more", findings.len() - SHOWN);
    }
    SceneProblem::Invalid(message)
}
