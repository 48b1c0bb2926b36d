//! What there is to light: geometry, materials, lights, cameras and motion, read from a glTF file.
//!
//! Scene space is the file's world space moved to the scene's own centre: metres, right-handed, +Y up. Transforms are composed in
//! f64 at load, so that a scene 10 km from the file's origin loses nothing. This room knows no gaze and no frames.

pub mod animation;

use glam::{Affine3A, DVec3, Vec2, Vec3};

use crate::view::View;

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

/// Indexed triangles. A normal of zero means: flat, use the triangle's own normal.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertex positions, metres.
    pub positions: Vec<Vec3>,
    /// Unit shading normals, one a vertex, or zero for a flat face.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, one a vertex, (0,0) where the file has none.
    pub texcoords: Vec<Vec2>,
    /// Vertex indices, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Material of each triangle.
    pub material_of_triangle: Vec<u32>,
}

/// A mesh moved rigidly (rotation, translation and a fixed scale baked into the vertices) by the animation.
#[derive(Clone, Debug)]
pub struct RigidObject {
    /// Name of the glTF node.
    pub name: String,
    /// Geometry in object space.
    pub mesh: Mesh,
    /// Index of the node that places it, for [`animation::Animation`].
    pub node: usize,
}

/// A metallic-roughness material with the extensions that macula reads; see `method.md`'s units in ARCHITECTURE.md.
#[derive(Clone, Debug)]
pub struct Material {
    /// Name in the file.
    pub name: String,
    /// Linear base colour; Lambert albedo for a non-metal.
    pub base_color: Vec3,
    /// Texture multiplied onto `base_color` (sRGB).
    pub base_color_texture: Option<TextureRef>,
    /// 0 dielectric .. 1 metal.
    pub metallic: f32,
    /// Perceptual roughness; GGX alpha = roughness².
    pub roughness: f32,
    /// Blue = metallic, green = roughness, both multiplied (linear).
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Emitted radiance of the front face, W/(m² sr): emissiveFactor × emissiveStrength.
    pub emission_w_per_m2_sr: Vec3,
    /// Texture multiplied onto the emission (sRGB).
    pub emission_texture: Option<TextureRef>,
    /// Refractive index, at least 1 (KHR_materials_ior, default 1.5).
    pub ior: f32,
    /// KHR_materials_specular: 0 switches the dielectric coat off, leaving exact Lambert.
    pub specular_factor: f32,
    /// KHR_materials_specular: tint of F0.
    pub specular_color: Vec3,
    /// KHR_materials_transmission: share of light that is not metal reflection or coat and passes through.
    pub transmission: f32,
    /// Whether the surface bounds a solid that refracts (KHR_materials_volume thickness > 0) or is thin-walled.
    pub is_solid: bool,
    /// KHR_materials_volume: colour that white light becomes after `attenuation_distance_m`.
    pub attenuation_color: Vec3,
    /// Metres; infinite for no absorption.
    pub attenuation_distance_m: f32,
    /// Whether back faces reflect and emit like front faces.
    pub double_sided: bool,
    /// Alpha below which a hit does not count (alphaMode MASK; BLEND is read as a mask at 0.5 with a warning), or `None` for opaque.
    pub alpha_cutoff: Option<f32>,
}

/// A use of a texture: which one, and how its coordinates are transformed (KHR_texture_transform).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// Index into `Scene::textures`.
    pub texture: u32,
    /// uv' = column0 · u + column1 · v + offset; identity without the extension.
    pub uv_column0: Vec2,
    /// See `uv_column0`.
    pub uv_column1: Vec2,
    /// See `uv_column0`.
    pub uv_offset: Vec2,
}

/// A decoded image, row 0 at the top, as 8-bit RGBA.
#[derive(Clone, Debug)]
pub struct Texture {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// `width × height` texels, row by row.
    pub rgba8: Vec<[u8; 4]>,
    /// Whether RGB is sRGB-encoded (colours) or linear (data).
    pub is_srgb: bool,
    /// How coordinates beyond \[0,1\] wrap in u and v.
    pub wrap: [Wrap; 2],
    /// Bilinear, or nearest.
    pub is_bilinear: bool,
}

/// How a texture coordinate beyond \[0,1\] is brought back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Wrap {
    /// Repeats.
    Repeat = 0,
    /// Repeats mirrored.
    MirroredRepeat = 1,
    /// Keeps the edge texel.
    ClampToEdge = 2,
}

/// A KHR_lights_punctual light, in scene space at time 0.
#[derive(Clone, Debug)]
pub struct PunctualLight {
    /// Name in the file.
    pub name: String,
    /// Node that carries it, for the animation.
    pub node: usize,
    /// Metres.
    pub position: Vec3,
    /// Unit direction in which a spot or directional light shines.
    pub direction: Vec3,
    /// colour × intensity: W/sr for point and spot, W/m² for directional.
    pub intensity: Vec3,
    /// What shape its light has.
    pub kind: PunctualKind,
    /// Distance beyond which it does not shine, metres; infinite by default.
    pub range_m: f32,
}

/// Shapes of punctual lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PunctualKind {
    /// Uniform in all directions.
    Point,
    /// A cone with the extension's reference falloff between the two half-angles, radians.
    Spot {
        /// Full brightness within, radians.
        inner_cone_rad: f32,
        /// Nothing beyond, radians.
        outer_cone_rad: f32,
    },
    /// Parallel light.
    Directional,
}

/// A perspective camera, in scene space at time 0.
#[derive(Clone, Debug)]
pub struct Camera {
    /// Name of the camera (or its node) in the file.
    pub name: String,
    /// Node that carries it, for the animation.
    pub node: usize,
    /// Pose in scene space and vertical field of view; the width follows from the image's aspect (see [`Camera::view`]).
    pub pose: crate::view::Pose,
    /// Vertical opening angle, radians.
    pub yfov_rad: f32,
}

impl Camera {
    /// The camera's eye for an image of `width` × `height` pixels: yfov fits the height.
    pub fn view(&self, width: u32, height: u32) -> View {
        View {
            pose: self.pose,
            fov: crate::view::Fov::symmetric(self.yfov_rad, width as f32 / height as f32),
        }
    }
}

/// Axis-aligned bounds, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Lower corner.
    pub min: Vec3,
    /// Upper corner.
    pub max: Vec3,
}

impl Aabb {
    /// Bounds of nothing.
    pub const EMPTY: Self = Self {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };

    /// Grows to hold `point`.
    pub fn include(&mut self, point: Vec3) {
        self.min = self.min.min(point);
        self.max = self.max.max(point);
    }

    /// Whether anything is inside.
    pub fn is_empty(&self) -> bool {
        self.min.cmpgt(self.max).any()
    }

    /// Centre, metres; the origin for empty bounds.
    pub fn center(&self) -> Vec3 {
        if self.is_empty() {
            Vec3::ZERO
        } else {
            (self.min + self.max) * 0.5
        }
    }

    /// Length of the diagonal, metres; 0 for empty bounds.
    pub fn diagonal_m(&self) -> f32 {
        if self.is_empty() {
            0.0
        } else {
            (self.max - self.min).length()
        }
    }
}

/// Where everything that moves is at one time.
#[derive(Clone, Debug, Default)]
pub struct ScenePose {
    /// Scene from object space, one for each of `Scene::objects`.
    pub scene_from_object: Vec<Affine3A>,
    /// The lights at that time, one for each of `Scene::lights`.
    pub lights: Vec<PunctualLight>,
    /// The cameras at that time, one for each of `Scene::cameras`.
    pub cameras: Vec<Camera>,
}
