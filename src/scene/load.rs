//! From a path to a [`Scene`]: each stage checks what it takes, so that no later one has to.

use std::path::Path;

use glam::{DAffine3, DVec3};

use super::accessor::Accessors;
use super::animation::{Animation, to_f32};
use super::animation_read::read_animation;
use super::document;
use super::error::{SceneError, SceneProblem};
use super::file::{Container, SceneFiles, read_buffers};
use super::limits::LoadLimits;
use super::material::{LoadedMaterial, read_materials};
use super::node::{NodeTree, display_name, is_singular};
use super::primitive::{claim_of, read_mesh};
use super::texture::TextureTable;
use super::warnings::Warnings;
use super::{Aabb, Camera, Mesh, PunctualLight, RigidObject, Scene};

/// Farthest that anything may be from the scene's centre, metres: beyond, areas overflow in f32 (their squares reach 1e36).
pub const MAX_COORDINATE_M: f64 = 1e9;

impl Scene {
    /// Loads a .gltf or .glb file with the default limits.
    ///
    /// # Errors
    /// Names the file, what is wrong with it, and where. No file makes it panic, hang, or take more memory than the limits allow.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        Self::load_with(path, &LoadLimits::default())
    }

    /// Loads a .gltf or .glb file within limits.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn load_with(path: &Path, limits: &LoadLimits) -> Result<Self, SceneError> {
        load(path, limits).map_err(|problem| SceneError {
            path: path.to_path_buf(),
            problem,
        })
    }
}

fn load(path: &Path, limits: &LoadLimits) -> Result<Scene, SceneProblem> {
    let mut warnings = Warnings::default();
    let (mut files, bytes) = SceneFiles::open(path, limits)?;
    let container = Container::split(&bytes)?;
    let (document, transforms) = document::parse(container.json, limits, &mut warnings)?;
    let root = document.as_json();
    let buffers = read_buffers(root, container.binary, &mut files)?;
    let accessors = Accessors {
        root,
        buffers: &buffers,
    };
    let tree = NodeTree::build(&document, &transforms, &mut warnings)?;

    let mut texture_table = TextureTable::default();
    let loaded_materials = read_materials(&document, &mut texture_table, &mut warnings)?;
    let textures = texture_table.decode(&document, &buffers, &mut files, limits)?;
    let mut animation = read_animation(&document, &tree, &accessors, limits, &mut warnings)?;

    let placed = place_nodes(&tree, &animation)?;
    let meshes = read_meshes(
        &document,
        &tree,
        &accessors,
        &loaded_materials,
        limits,
        &mut warnings,
    )?;
    let instances = instances(&document, &tree, &placed, &animation, &mut warnings);
    let file_from_scene_m = center(&instances, &meshes);
    animation.recenter(file_from_scene_m);
    let (static_mesh, objects) = bake(&instances, &meshes, file_from_scene_m, &mut warnings)?;
    let (lights, cameras) =
        lights_and_cameras(&document, &tree, &placed, file_from_scene_m, &mut warnings)?;

    let mut scene = Scene {
        name: path
            .file_stem()
            .map_or_else(String::new, |stem| stem.to_string_lossy().into_owned()),
        content_sha256: files.into_sha256(),
        file_from_scene_m,
        bounds: static_mesh.bounds(),
        static_mesh,
        objects,
        materials: loaded_materials.into_iter().map(|m| m.material).collect(),
        textures,
        lights,
        cameras,
        animation,
        warnings: Vec::new(),
    };
    include_objects(&mut scene);
    if scene.bounds.is_empty() {
        warnings.push("there is no triangle to see");
    }
    scene.warnings = warnings.into_sentences();
    Ok(scene)
}

/// World space of the file from each shown node at time 0, by node; the identity for a node that is not shown.
fn place_nodes(tree: &NodeTree, animation: &Animation) -> Result<Vec<DAffine3>, SceneProblem> {
    let moving = animation.scene_from_moving(0.0);
    let mut placed = vec![DAffine3::IDENTITY; tree.local.len()];
    for &node in &tree.order {
        placed[node] = match (animation.moving_of_node.get(&node), tree.parent[node]) {
            (Some(&position), _) => moving[position],
            (None, Some(parent)) => placed[parent] * tree.local[node].to_affine(),
            (None, None) => tree.local[node].to_affine(),
        };
        if !placed[node].is_finite() {
            return Err(SceneProblem::NotFinite(format!(
                "{}: with the nodes above it, its transform overflows",
                tree.names[node]
            )));
        }
    }
    Ok(placed)
}

/// The meshes that shown nodes use, by index, after their claims are checked; empty for a mesh that is not used.
fn read_meshes(
    document: &gltf::Document,
    tree: &NodeTree,
    accessors: &Accessors,
    materials: &[LoadedMaterial],
    limits: &LoadLimits,
    warnings: &mut Warnings,
) -> Result<Vec<Mesh>, SceneProblem> {
    let root = document.as_json();
    let mut uses = vec![0_u64; root.meshes.len()];
    for mesh in tree.order.iter().filter_map(|&node| root.nodes[node].mesh) {
        uses[mesh.value()] += 1;
    }
    let (mut vertices, mut triangles) = (0_u64, 0_u64);
    for (json, uses) in root.meshes.iter().zip(&uses) {
        let claim = claim_of(json, accessors);
        vertices = vertices.saturating_add(claim.vertices.saturating_mul(*uses));
        triangles = triangles.saturating_add(claim.triangles.saturating_mul(*uses));
    }
    SceneProblem::check_limit("vertices", vertices, limits.vertices, "vertices")?;
    SceneProblem::check_limit("triangles", triangles, limits.triangles, "triangles")?;
    let read = |(index, json): (usize, &gltf::json::Mesh)| {
        if uses[index] == 0 {
            return Ok(Mesh::default());
        }
        let label = display_name("mesh", json.name.as_deref(), index);
        read_mesh(json, &label, accessors, materials, warnings)
    };
    root.meshes.iter().enumerate().map(read).collect()
}

/// A mesh that a node shows.
struct Instance {
    node: usize,
    mesh: usize,
    world_from_node: DAffine3,
    /// Name of the node, as the file has it.
    name: String,
    /// For messages.
    label: String,
    is_moving: bool,
}

fn instances(
    document: &gltf::Document,
    tree: &NodeTree,
    placed: &[DAffine3],
    animation: &Animation,
    warnings: &mut Warnings,
) -> Vec<Instance> {
    let root = document.as_json();
    let mut instances = Vec::new();
    for &node in &tree.order {
        let json = &root.nodes[node];
        let Some(mesh) = json.mesh else { continue };
        let label = &tree.names[node];
        if json.skin.is_some() {
            warnings.push(format!("{label} has a skin; its mesh keeps its rest shape"));
        }
        let is_moving = animation.moves(node);
        if !is_moving && is_singular(placed[node].matrix3) {
            warnings.push(format!(
                "{label} is squashed flat by its transform; its mesh is left out"
            ));
            continue;
        }
        instances.push(Instance {
            node,
            mesh: mesh.value(),
            world_from_node: placed[node],
            name: plain_name(json.name.as_deref(), node),
            label: label.clone(),
            is_moving,
        });
    }
    instances
}

fn plain_name(name: Option<&str>, node: usize) -> String {
    name.map_or_else(|| format!("node {node}"), str::to_owned)
}

/// Centre of all triangles in the file's world space.
fn center(instances: &[Instance], meshes: &[Mesh]) -> DVec3 {
    let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for instance in instances {
        let mesh = &meshes[instance.mesh];
        for &vertex in mesh.triangles.iter().flatten() {
            let local = mesh.positions[vertex as usize].as_dvec3();
            let world = instance.world_from_node.transform_point3(local);
            min = min.min(world);
            max = max.max(world);
        }
    }
    let center = min * 0.5 + max * 0.5;
    if center.is_finite() {
        center
    } else {
        DVec3::ZERO
    }
}

/// Static triangles in scene space, and moving ones each in its own.
fn bake(
    instances: &[Instance],
    meshes: &[Mesh],
    origin: DVec3,
    warnings: &mut Warnings,
) -> Result<(Mesh, Vec<RigidObject>), SceneProblem> {
    let mut static_mesh = Mesh::default();
    let mut objects = Vec::new();
    let mut dropped = 0;
    for instance in instances {
        let mesh = &meshes[instance.mesh];
        let first = static_mesh.positions.len();
        let mut scene_from_node = instance.world_from_node;
        scene_from_node.translation -= origin;
        let is_near = |point: &glam::Vec3| {
            point.is_finite() && f64::from(point.abs().max_element()) <= MAX_COORDINATE_M
        };
        let all_near = if instance.is_moving {
            let mut mesh = mesh.clone();
            dropped += mesh.drop_degenerate();
            let placed = |p: &glam::Vec3| scene_from_node.transform_point3(p.as_dvec3()).as_vec3();
            let all_near = mesh
                .positions
                .iter()
                .all(|p| is_near(p) && is_near(&placed(p)));
            objects.push(RigidObject {
                name: instance.name.clone(),
                mesh,
                node: instance.node,
            });
            all_near
        } else {
            static_mesh.append(mesh, scene_from_node);
            static_mesh.positions[first..].iter().all(is_near)
        };
        if !all_near {
            return Err(SceneProblem::NotFinite(format!(
                "{}: a vertex is more than {MAX_COORDINATE_M:e} m from the scene's centre",
                instance.label
            )));
        }
    }
    dropped += static_mesh.drop_degenerate();
    if dropped > 0 {
        warnings.push(format!("{dropped} triangles without area are dropped"));
    }
    Ok((static_mesh, objects))
}

fn lights_and_cameras(
    document: &gltf::Document,
    tree: &NodeTree,
    placed: &[DAffine3],
    origin: DVec3,
    warnings: &mut Warnings,
) -> Result<(Vec<PunctualLight>, Vec<Camera>), SceneProblem> {
    let nodes: Vec<gltf::Node> = document.nodes().collect();
    let (mut lights, mut cameras) = (Vec::new(), Vec::new());
    for &index in &tree.order {
        let node = &nodes[index];
        if node.light().is_none() && node.camera().is_none() {
            continue;
        }
        let mut scene_from_node = placed[index];
        scene_from_node.translation -= origin;
        if scene_from_node.translation.abs().max_element() > MAX_COORDINATE_M {
            return Err(SceneProblem::NotFinite(format!(
                "{} is more than {MAX_COORDINATE_M:e} m from the scene's centre",
                tree.names[index]
            )));
        }
        let name = plain_name(node.name(), index);
        if let Some(light) = node.light()
            && let Some(light) = PunctualLight::read(&light, index, &name, warnings)
        {
            lights.push(light.placed(scene_from_node));
        }
        if let Some(camera) = node.camera()
            && let Some(camera) = Camera::read(&camera, index, &name, warnings)
        {
            cameras.push(camera.placed(scene_from_node));
        }
    }
    Ok((lights, cameras))
}

/// Grows the bounds by the moving objects where they are at time 0.
fn include_objects(scene: &mut Scene) {
    let placed = scene.animation.scene_from_moving(0.0);
    let mut bounds: Aabb = scene.bounds;
    for object in &scene.objects {
        let Some(&position) = scene.animation.moving_of_node.get(&object.node) else {
            continue;
        };
        let scene_from_object = to_f32(placed[position]);
        for &vertex in object.mesh.triangles.iter().flatten() {
            let local = object.mesh.positions[vertex as usize];
            bounds.include(scene_from_object.transform_point3(local));
        }
    }
    scene.bounds = bounds;
}
