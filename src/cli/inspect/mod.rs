//! `macula inspect`: what a scene file holds, what it will take, and which effects it calls for.

mod measure;
mod price;
mod text;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::DVec3;
use serde::Serialize;

use super::{CliResult, Globals, common};
use crate::effect_cost::EffectCosts;
use crate::frame;
use crate::params::Params;
use crate::scene::bvh::SceneCaster;
use crate::scene::effects::{EffectReport, Effects};
use crate::scene::gpu_geometry::GpuGeometry;
use crate::scene::{Camera, Material, Mesh, PunctualLight, Scene, Texture, Wrap};
use crate::technique::{self, TechniqueEntry};

/// Show what a scene file holds: triangles, lights, materials, motion, bounds, memory, and the effects it calls for with the reasons.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// The glTF 2.0 file (.gltf or .glb).
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// Also time frames with and without each effect on this machine (a few minutes without a GPU): what the scene's own effects cost,
    /// and what leaving out the others saves.
    #[arg(long)]
    pub measure: bool,
    /// How light is transported in the frames of --measure.
    #[arg(
        long,
        value_name = "T",
        default_value = "pm-direct",
        requires = "measure"
    )]
    pub technique: String,
}

/// Runs `macula inspect`.
///
/// # Errors
/// A scene that cannot be loaded.
pub fn run(args: Args, globals: &Globals) -> CliResult {
    let params = common::params(globals)?;
    let entry = common::technique(&args.technique)?;
    let scene = Scene::load(&args.scene)?;
    let mut inspection = Inspection::of(&args.scene, &scene, &params);
    if args.measure {
        inspection.effect_costs = Some(measure::effect_costs(scene, &params, entry, globals)?);
    }
    if globals.json {
        println!("{}", serde_json::to_string_pretty(&inspection)?);
    } else {
        print!("{}", inspection.to_text());
    }
    Ok(())
}

/// What a scene file holds. Serialised, it is what `--json` prints.
#[derive(Clone, Debug, Serialize)]
pub struct Inspection {
    /// The file.
    pub scene: PathBuf,
    /// Of the file and all that it names.
    pub content_sha256: String,
    /// Counts and extent.
    pub geometry: GeometrySummary,
    /// Punctual lights, then emissive materials.
    pub lights: Vec<LightSummary>,
    /// In file order, glTF's default material last if it is used.
    pub materials: Vec<MaterialSummary>,
    /// Decoded images.
    pub textures: Vec<TextureSummary>,
    /// In file order; `render --camera` takes the name or the place in this list, from 0.
    pub cameras: Vec<CameraSummary>,
    /// Motion.
    pub animation: AnimationSummary,
    /// What it takes.
    pub memory: MemorySummary,
    /// What the shaders must be able to do, and why.
    pub effects: Vec<EffectReport>,
    /// The passes that run for a frame, by technique.
    pub passes: BTreeMap<&'static str, Vec<&'static str>>,
    /// What each effect costs, where it was measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub effect_costs: Option<EffectCosts>,
    /// What was left out or repaired.
    pub warnings: Vec<String>,
}

/// Counts and extent of all triangles.
#[derive(Clone, Debug, Serialize)]
pub struct GeometrySummary {
    /// Triangles that never move.
    pub static_triangles: usize,
    /// Triangles of animated objects.
    pub moving_triangles: usize,
    /// Vertices of both.
    pub vertices: usize,
    /// Extent at time 0.
    pub size_m: [f32; 3],
    /// Lower corner at time 0, in the file's own space.
    pub min_in_file_m: [f64; 3],
    /// Upper corner at time 0, in the file's own space.
    pub max_in_file_m: [f64; 3],
    /// Nodes of all bounding volume hierarchies.
    pub bvh_nodes: usize,
    /// Levels of the deepest.
    pub bvh_depth: u32,
}

/// A light.
#[derive(Clone, Debug, Serialize)]
pub struct LightSummary {
    /// Of the light, or of the emissive material.
    pub name: String,
    /// point, spot, directional or area.
    pub kind: &'static str,
    /// What it emits, in the unit of `unit`.
    pub emission: [f32; 3],
    /// W/sr, W/m2 or W/(m2 sr).
    pub unit: &'static str,
    /// Of an area light at time 0.
    pub area_m2: Option<f64>,
    /// Whether an animation moves it.
    pub is_moving: bool,
}

/// A material that some triangle has.
#[derive(Clone, Debug, Serialize)]
pub struct MaterialSummary {
    /// In the file.
    pub name: String,
    /// What kind of surface it is, in words.
    pub surface: String,
    /// Linear.
    pub base_color: [f32; 3],
    /// Triangles that have it.
    pub triangles: usize,
}

/// A decoded texture.
#[derive(Clone, Debug, Serialize)]
pub struct TextureSummary {
    /// Pixels across.
    pub width_px: u32,
    /// Pixels down.
    pub height_px: u32,
    /// sRGB or linear.
    pub color_space: &'static str,
    /// How u and v wrap.
    pub wrap: [&'static str; 2],
    /// Bilinear or nearest.
    pub filter: &'static str,
}

/// A camera.
#[derive(Clone, Debug, Serialize)]
pub struct CameraSummary {
    /// In the file.
    pub name: String,
    /// At time 0, in the file's own space.
    pub position_in_file_m: [f64; 3],
    /// Where it looks.
    pub forward: [f32; 3],
    /// Vertical field of view.
    pub yfov_rad: f32,
    /// Whether an animation moves it.
    pub is_moving: bool,
}

/// Motion.
#[derive(Clone, Debug, Serialize)]
pub struct AnimationSummary {
    /// Length of the loop; 0 for a still scene.
    pub duration_s: f64,
    /// Names of the animated objects.
    pub objects: Vec<String>,
}

/// What the scene takes.
#[derive(Clone, Debug, Serialize)]
pub struct MemorySummary {
    /// Meshes, textures and hierarchies on the host.
    pub host_bytes: usize,
    /// Triangles and hierarchies as they are uploaded.
    pub gpu_geometry_bytes: usize,
    /// Texels as they are uploaded.
    pub gpu_texture_bytes: usize,
}

impl Inspection {
    /// Builds the hierarchies of a scene that was read from `path`, and sums up.
    pub fn of(path: &Path, scene: &Scene, params: &Params) -> Self {
        let caster = SceneCaster::new(scene);
        let origin = scene.file_from_scene_m;
        let effects = technique::effects(scene, params);
        let reports = Effects::report(scene, params.gather.glossy_alpha_min);
        Self {
            scene: path.to_path_buf(),
            content_sha256: scene.content_sha256.clone(),
            geometry: GeometrySummary::of(scene, &caster),
            lights: lights(scene),
            materials: materials(scene),
            textures: scene.textures.iter().map(TextureSummary::of).collect(),
            cameras: scene
                .cameras
                .iter()
                .map(|camera| CameraSummary::of(camera, origin, scene))
                .collect(),
            animation: AnimationSummary {
                duration_s: scene.animation.duration_s(),
                objects: scene.objects.iter().map(|o| o.name.clone()).collect(),
            },
            memory: MemorySummary::of(scene, &caster),
            effects: reports,
            passes: technique::REGISTRY
                .iter()
                .map(|entry| (entry.name, passes(entry, &effects, params)))
                .collect(),
            effect_costs: None,
            warnings: scene.warnings.clone(),
        }
    }
}

/// The passes of a session's frame, with what moves the scene first.
fn passes(entry: &TechniqueEntry, effects: &Effects, params: &Params) -> Vec<&'static str> {
    let motion = effects.has_motion().then_some(frame::MOTION);
    motion
        .into_iter()
        .chain((entry.passes)(effects, params))
        .collect()
}

fn meshes(scene: &Scene) -> impl Iterator<Item = &Mesh> {
    std::iter::once(&scene.static_mesh).chain(scene.objects.iter().map(|object| &object.mesh))
}

impl GeometrySummary {
    fn of(scene: &Scene, caster: &SceneCaster) -> Self {
        let static_triangles = scene.static_mesh.triangles.len();
        let all_triangles: usize = meshes(scene).map(|mesh| mesh.triangles.len()).sum();
        let hierarchies = || std::iter::once(&caster.static_bvh).chain(&caster.object_bvhs);
        let bounds = scene.bounds;
        let (min, max) = if bounds.is_empty() {
            (bounds.center(), bounds.center())
        } else {
            (bounds.min, bounds.max)
        };
        Self {
            static_triangles,
            moving_triangles: all_triangles - static_triangles,
            vertices: meshes(scene).map(|mesh| mesh.positions.len()).sum(),
            size_m: (max - min).to_array(),
            min_in_file_m: (min.as_dvec3() + scene.file_from_scene_m).to_array(),
            max_in_file_m: (max.as_dvec3() + scene.file_from_scene_m).to_array(),
            bvh_nodes: hierarchies().map(|h| h.bvh.nodes.len()).sum(),
            bvh_depth: hierarchies().map(|h| h.depth).max().unwrap_or(0),
        }
    }
}

fn lights(scene: &Scene) -> Vec<LightSummary> {
    let punctual = scene
        .lights
        .iter()
        .map(|light: &PunctualLight| LightSummary {
            name: light.name.clone(),
            kind: light.kind.name(),
            emission: light.intensity.to_array(),
            unit: light.kind.unit(),
            area_m2: None,
            is_moving: scene.animation.moves(light.node),
        });
    punctual.chain(area_lights(scene)).collect()
}

/// One light for each emissive material, with the area of all its triangles at time 0.
fn area_lights(scene: &Scene) -> Vec<LightSummary> {
    let mut area_and_motion: BTreeMap<u32, (f64, bool)> = BTreeMap::new();
    let pose = scene.pose_at(0.0);
    let objects = scene.objects.iter().zip(&pose.scene_from_object);
    let placed = objects.map(|(object, map)| (&object.mesh, *map, true));
    let still = (&scene.static_mesh, glam::Affine3A::IDENTITY, false);
    for (mesh, scene_from_mesh, is_moving) in std::iter::once(still).chain(placed) {
        for (triangle, &material) in mesh.material_of_triangle.iter().enumerate() {
            if !scene.materials[material as usize].is_emissive() {
                continue;
            }
            let corners = mesh
                .corners(triangle)
                .map(|c| scene_from_mesh.transform_point3(c));
            let [a, b, c] = corners.map(|corner| corner.as_dvec3());
            let entry = area_and_motion.entry(material).or_default();
            entry.0 += 0.5 * (b - a).cross(c - a).length();
            entry.1 |= is_moving;
        }
    }
    area_and_motion
        .into_iter()
        .map(|(material, (area_m2, is_moving))| {
            let material = &scene.materials[material as usize];
            LightSummary {
                name: material.name.clone(),
                kind: "area",
                emission: material.emission_w_per_m2_sr.to_array(),
                unit: "W/(m2 sr)",
                area_m2: Some(area_m2),
                is_moving,
            }
        })
        .collect()
}

fn materials(scene: &Scene) -> Vec<MaterialSummary> {
    let mut triangles = vec![0; scene.materials.len()];
    for &material in meshes(scene).flat_map(|mesh| &mesh.material_of_triangle) {
        triangles[material as usize] += 1;
    }
    let used = scene
        .materials
        .iter()
        .zip(triangles)
        .filter(|(_, count)| *count > 0);
    used.map(|(material, triangles)| MaterialSummary {
        name: material.name.clone(),
        surface: surface_in_words(material),
        base_color: material.base_color.to_array(),
        triangles,
    })
    .collect()
}

fn surface_in_words(material: &Material) -> String {
    let roughness = match (
        material.may_be_smooth(),
        material.metallic_roughness_texture,
    ) {
        (_, Some(_)) => "textured roughness".to_owned(),
        (true, None) => "smooth".to_owned(),
        (false, None) => format!("roughness {:.3}", material.roughness),
    };
    let mut words = if material.transmission > 0.0 {
        let wall = if material.is_solid {
            "solid"
        } else {
            "thin wall"
        };
        format!(
            "transmits {}, ior {}, {wall}, {roughness}",
            material.transmission, material.ior
        )
    } else if material.metallic >= 1.0 {
        format!("metal, {roughness}")
    } else if material.metallic > 0.0 {
        format!("metallic {}, {roughness}", material.metallic)
    } else if material.specular_factor > 0.0 {
        format!("coated diffuse, {roughness}")
    } else {
        "diffuse".to_owned()
    };
    if material.is_emissive() {
        words += ", emissive";
    }
    if material.base_color_texture.is_some() {
        words += ", textured";
    }
    if material.alpha_cutoff.is_some() {
        words += ", masked";
    }
    if material.double_sided {
        words += ", double-sided";
    }
    words
}

impl TextureSummary {
    fn of(texture: &Texture) -> Self {
        let wrap = |wrap: Wrap| match wrap {
            Wrap::Repeat => "repeat",
            Wrap::MirroredRepeat => "mirror",
            Wrap::ClampToEdge => "clamp",
        };
        Self {
            width_px: texture.width,
            height_px: texture.height,
            color_space: if texture.is_srgb { "sRGB" } else { "linear" },
            wrap: texture.wrap.map(wrap),
            filter: if texture.is_bilinear {
                "bilinear"
            } else {
                "nearest"
            },
        }
    }
}

impl CameraSummary {
    fn of(camera: &Camera, origin: DVec3, scene: &Scene) -> Self {
        Self {
            name: camera.name.clone(),
            position_in_file_m: (camera.pose.position_m.as_dvec3() + origin).to_array(),
            forward: (camera.pose.orientation * glam::Vec3::NEG_Z).to_array(),
            yfov_rad: camera.yfov_rad,
            is_moving: scene.animation.moves(camera.node),
        }
    }
}

impl MemorySummary {
    fn of(scene: &Scene, caster: &SceneCaster) -> Self {
        let texture_bytes: usize = scene
            .textures
            .iter()
            .map(|texture| size_of_val(texture.rgba8.as_slice()))
            .sum();
        let hierarchies = || std::iter::once(&caster.static_bvh).chain(&caster.object_bvhs);
        let mut geometry = GpuGeometry::default();
        for (mesh, bvh) in meshes(scene).zip(hierarchies()) {
            geometry.append(mesh, bvh);
        }
        Self {
            host_bytes: texture_bytes
                + meshes(scene).map(Mesh::host_bytes).sum::<usize>()
                + hierarchies().map(|h| h.host_bytes()).sum::<usize>(),
            gpu_geometry_bytes: size_of_val(geometry.bvh_nodes.as_slice())
                + size_of_val(geometry.triangle_positions.as_slice())
                + size_of_val(geometry.triangle_shading.as_slice())
                + size_of_val(geometry.triangle_texcoords.as_slice()),
            gpu_texture_bytes: texture_bytes,
        }
    }
}
