//! What there is to light: geometry, materials, lights, cameras and motion, read from a glTF file.
//!
//! Scene space is the file's world space moved to the scene's own centre: metres, right-handed, +Y up. Transforms are composed in
//! f64 at load, so that a scene 10 km from the file's origin loses nothing. This room knows no gaze and no frames.

mod accessor;
pub mod animation;
mod animation_read;
pub mod bvh;
mod camera;
mod connected;
mod document;
pub mod effects;
mod error;
mod file;
pub mod gpu_geometry;
pub mod gpu_scene;
pub mod lamps;
mod light;
pub mod light_importance;
pub mod light_table;
mod limits;
mod load;
pub mod loaded;
mod material;
mod median_split;
mod mesh;
mod node;
mod primitive;
pub mod specular_targets;
mod texture;
mod track;
mod warnings;

use glam::DVec3;

pub use animation::ScenePose;
pub use camera::Camera;
pub use document::SUPPORTED_EXTENSIONS;
pub use error::{SceneError, SceneProblem};
pub use light::{PunctualKind, PunctualLight};
pub use limits::LoadLimits;
pub use load::MAX_COORDINATE_M;
pub use material::{Material, SMOOTH_ALPHA};
pub use mesh::{Aabb, Mesh, RigidObject};
pub use texture::{Texture, TextureRef, Wrap};

/// A loaded scene, in scene space.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The file's stem, for titles and outputs.
    pub name: String,
    /// SHA-256 of the file (and of the buffers and images that it names), as lower-case hex.
    pub content_sha256: String,
    /// Position of scene space's origin in the file's world space, metres.
    pub file_from_scene_m: DVec3,
    /// All triangles that never move, in scene space.
    pub static_mesh: Mesh,
    /// Meshes that an animation moves rigidly, each in its own object space.
    pub objects: Vec<RigidObject>,
    /// Materials, by `Mesh::material_of_triangle`. Never empty: the last one is glTF's default material.
    pub materials: Vec<Material>,
    /// Textures, by `TextureRef::texture`.
    pub textures: Vec<Texture>,
    /// Point, spot and directional lights (emissive triangles are found through the materials).
    pub lights: Vec<PunctualLight>,
    /// Cameras of the file, in file order; an orthographic camera is left out with a warning.
    pub cameras: Vec<Camera>,
    /// How objects, lights and cameras move.
    pub animation: animation::Animation,
    /// Bounds of all geometry at time 0, scene space, metres. `min > max` where there is none.
    pub bounds: Aabb,
    /// What the file holds that is left out or repaired, one sentence each.
    pub warnings: Vec<String>,
}
