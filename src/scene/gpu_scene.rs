//! A scene on the GPU: what never changes is uploaded once, what moves once a frame.

use glam::{Affine3A, Vec3};

use super::bvh::SceneCaster;
use super::gpu_geometry::{self, GpuGeometry};
use super::lamps;
use super::light_table::{self, EmissiveTriangle, PickProbabilities, PlacedLight};
use super::{Aabb, Material, Scene, ScenePose, TextureRef};
use crate::gpu::layout;
use crate::gpu::pass::Resources;
use crate::gpu::resources::{self, SplitArray, TexelArray};
use crate::gpu::{GpuDevice, GpuError};

/// Offset of rays from the surface that they leave, as a share of the scene's diagonal: some 40 times the rounding of a position.
const RAY_OFFSET: f32 = 5e-6;

/// The buffers of `@group(0)`.
pub struct GpuScene {
    uniform: wgpu::Buffer,
    materials: wgpu::Buffer,
    texture_uses: wgpu::Buffer,
    objects: wgpu::Buffer,
    object_nodes: wgpu::Buffer,
    lights: wgpu::Buffer,
    bvh_nodes: TexelArray,
    triangle_positions: TexelArray,
    triangle_shading: SplitArray,
    triangle_texcoords: SplitArray,
    texels: SplitArray,
    /// Bounds over the whole animation.
    bounds: Aabb,
    /// Area of all triangles at time 0, m².
    area_m2: f64,
    object_bounds: Vec<Aabb>,
    object_roots: Vec<u32>,
    emissive: Vec<EmissiveTriangle>,
    /// Of the punctual lights, then of the emissive triangles.
    lamp_of_lights: Vec<u32>,
    /// As they stand on the device.
    placed_lights: Vec<PlacedLight>,
    host_materials: Vec<Material>,
    emission_texture_of_material: Vec<(i32, Vec3)>,
    bytes: u64,
    /// Levels of the deepest hierarchy.
    tree_depth: u32,
}

impl GpuScene {
    /// Uploads a scene as it stands at `pose`.
    ///
    /// # Errors
    /// [`GpuError::BufferTooLarge`] when it does not fit the device.
    pub fn new(
        gpu: &GpuDevice,
        scene: &Scene,
        caster: &SceneCaster,
        pose: &ScenePose,
    ) -> Result<Self, GpuError> {
        let mut geometry = GpuGeometry::default();
        geometry.append(&scene.static_mesh, &caster.static_bvh);
        let mut emissive = emissive_triangles(scene, None, caster, 0);
        let mut object_roots = Vec::new();
        for (index, (object, bvh)) in scene.objects.iter().zip(&caster.object_bvhs).enumerate() {
            let first_triangle = geometry.triangle_shading.len() as u32;
            emissive.extend(emissive_triangles(
                scene,
                Some(index),
                caster,
                first_triangle,
            ));
            object_roots.push(geometry.append(&object.mesh, bvh));
        }
        let triangle_count = geometry.triangle_shading.len() as u64;
        if triangle_count > gpu_geometry::MAX_TRIANGLES {
            return Err(GpuError::BufferTooLarge {
                buffer: "triangle_positions".into(),
                bytes: triangle_count * 48,
                limit: gpu_geometry::MAX_TRIANGLES * 48,
            });
        }
        let textures = Textures::of(scene);
        let materials: Vec<layout::Material> = scene
            .materials
            .iter()
            .map(|material| textures.material_record(material))
            .collect();
        let emission_texture_of_material = scene
            .materials
            .iter()
            .map(|material| {
                let mean = material.emission_texture.map_or(Vec3::ONE, |used| {
                    light_table::mean_color(&scene.textures[used.texture as usize])
                });
                (textures.use_index(material.emission_texture), mean)
            })
            .collect();
        let bounds = scene.bounds_over_time();
        let lamp_of_lights =
            lamps::lamp_of_lights(&pose.lights, &emissive, &pose.scene_from_object, bounds);
        let light_capacity = scene.lights.len() + emissive.len();
        let bvh_nodes = TexelArray::new(gpu, "bvh_nodes", &geometry.bvh_nodes)?;
        let triangle_positions =
            TexelArray::new(gpu, "triangle_positions", &geometry.triangle_positions)?;
        let triangle_shading =
            SplitArray::with(gpu, "triangle_shading", &geometry.triangle_shading)?;
        let triangle_texcoords =
            SplitArray::with(gpu, "triangle_texcoords", &geometry.triangle_texcoords)?;
        let mut this = Self {
            uniform: resources::uniform::<layout::SceneUniform>(gpu, "scene"),
            materials: resources::storage_with(gpu, "materials", &materials)?,
            texture_uses: resources::storage_with(gpu, "texture_uses", &textures.uses)?,
            objects: resources::storage::<layout::Object>(
                gpu,
                "objects",
                scene.objects.len() as u64,
            )?,
            object_nodes: resources::storage::<[f32; 4]>(
                gpu,
                "object_nodes",
                4 * scene.objects.len().max(1) as u64,
            )?,
            lights: resources::storage::<layout::Light>(gpu, "lights", light_capacity as u64)?,
            bvh_nodes,
            triangle_positions,
            triangle_shading,
            triangle_texcoords,
            texels: SplitArray::with(gpu, "texels", &textures.texels)?,
            bounds,
            area_m2: scene_area_m2(scene, pose),
            object_bounds: scene
                .objects
                .iter()
                .map(|object| object.mesh.bounds())
                .collect(),
            object_roots,
            emissive,
            lamp_of_lights,
            placed_lights: Vec::new(),
            host_materials: scene.materials.clone(),
            emission_texture_of_material,
            bytes: 0,
            tree_depth: caster
                .object_bvhs
                .iter()
                .map(|bvh| bvh.depth)
                .fold(caster.static_bvh.depth, u32::max)
                .max(1),
        };
        this.bytes = [
            &this.materials,
            &this.texture_uses,
            &this.objects,
            &this.object_nodes,
            &this.lights,
        ]
        .iter()
        .map(|buffer| buffer.size())
        .chain(
            [
                &this.triangle_shading,
                &this.triangle_texcoords,
                &this.texels,
            ]
            .map(SplitArray::bytes),
        )
        .chain([&this.bvh_nodes, &this.triangle_positions].map(TexelArray::bytes))
        .sum();
        this.set_pose(gpu, pose);
        Ok(this)
    }

    /// Moves objects and lights, which are picked by power then; takes effect with the next submission.
    pub fn set_pose(&mut self, gpu: &GpuDevice, pose: &ScenePose) {
        let radius_m = (0.5 * self.bounds.diagonal_m()).max(1e-6);
        let lights = light_table::place(
            &pose.lights,
            &self.emissive,
            &pose.scene_from_object,
            &self.host_materials,
            &self.emission_texture_of_material,
            &self.lamp_of_lights,
            radius_m,
        );
        let has_extent = |placed: &&PlacedLight| placed.light.kind == light_table::KIND_TRIANGLE;
        let delta_light_count = lights.len() - lights.iter().filter(has_extent).count();
        let objects: Vec<layout::Object> = pose
            .scene_from_object
            .iter()
            .zip(&self.object_roots)
            .map(|(map, root_node)| layout::Object {
                scene_from_object: layout::affine_rows(*map),
                object_from_scene: layout::affine_rows(map.inverse()),
                root_node: *root_node,
                ..Default::default()
            })
            .collect();
        gpu.queue
            .write_buffer(&self.objects, 0, bytemuck::cast_slice(&objects));
        let tree = gpu_geometry::object_tree(&self.object_bounds, &pose.scene_from_object);
        gpu.queue
            .write_buffer(&self.object_nodes, 0, bytemuck::cast_slice(&tree));
        let uniform = layout::SceneUniform {
            bounds_center: self.bounds.center().to_array(),
            bounds_radius_m: radius_m,
            ray_offset_m: self.ray_offset_m(),
            light_count: lights.len() as u32,
            object_count: objects.len() as u32,
            delta_light_count: delta_light_count as u32,
        };
        gpu.queue
            .write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
        self.placed_lights = lights;
        self.set_pick_probabilities(gpu, &PickProbabilities::by_power(&self.placed_lights));
    }

    /// Has each of [`GpuScene::placed_lights`] picked with its probability; takes effect with the next submission.
    pub fn set_pick_probabilities(&self, gpu: &GpuDevice, probabilities: &PickProbabilities) {
        let table = light_table::build(&self.placed_lights, probabilities);
        gpu.queue
            .write_buffer(&self.lights, 0, bytemuck::cast_slice(&table));
    }

    /// The lights with power as they stand on the device.
    pub fn placed_lights(&self) -> &[PlacedLight] {
        &self.placed_lights
    }

    /// How many lamps the lights belong to, those without power at the moment too.
    pub fn lamp_count(&self) -> usize {
        self.lamp_of_lights
            .iter()
            .max()
            .map_or(0, |last| *last as usize + 1)
    }

    /// How far rays start from the surface that they leave, metres.
    pub fn ray_offset_m(&self) -> f32 {
        (RAY_OFFSET * self.bounds.diagonal_m()).max(f32::MIN_POSITIVE)
    }

    /// The buffers by their WGSL names.
    pub fn resources(&self) -> Resources<'_> {
        [
            &self.triangle_shading,
            &self.triangle_texcoords,
            &self.texels,
        ]
        .into_iter()
        .fold(Resources::default(), |all, array| {
            all.with_all(array.resources())
        })
        .with_texel_array(&self.bvh_nodes)
        .with_texel_array(&self.triangle_positions)
        .with("scene", &self.uniform)
        .with("materials", &self.materials)
        .with("texture_uses", &self.texture_uses)
        .with("objects", &self.objects)
        .with("object_nodes", &self.object_nodes)
        .with("lights", &self.lights)
    }

    /// The scene's sizes that shaders are composed with (see [`crate::gpu::shader::compose`]); `None` for a name of others.
    pub fn shader_size(&self, name: &str) -> Option<u32> {
        if name == "STACK_ENTRIES" {
            return Some(self.tree_depth);
        }
        let in_textures = [&self.bvh_nodes, &self.triangle_positions];
        let in_buffers = [
            &self.triangle_shading,
            &self.triangle_texcoords,
            &self.texels,
        ];
        in_textures
            .map(|array| (array.name(), array.layers()))
            .into_iter()
            .chain(in_buffers.map(|array| (array.name(), array.chunks())))
            .find(|(array, _)| *array == name)
            .map(|(_, size)| size)
    }

    /// Bounds over the whole animation, metres.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Area of all triangles, m².
    pub fn area_m2(&self) -> f64 {
        self.area_m2
    }

    /// Bytes of all buffers.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }
}

fn emissive_triangles(
    scene: &Scene,
    object: Option<usize>,
    caster: &SceneCaster,
    first_triangle: u32,
) -> Vec<EmissiveTriangle> {
    let (mesh, bvh) = match object {
        None => (&scene.static_mesh, &caster.static_bvh),
        Some(index) => (&scene.objects[index].mesh, &caster.object_bvhs[index]),
    };
    bvh.triangle_order()
        .iter()
        .enumerate()
        .filter_map(|(place, &triangle)| {
            let material = mesh.material_of_triangle[triangle as usize];
            let is_emissive = scene.materials[material as usize]
                .emission_w_per_m2_sr
                .max_element()
                > 0.0;
            is_emissive.then(|| EmissiveTriangle {
                object,
                triangle: first_triangle + place as u32,
                corners: mesh.corners(triangle as usize),
                material,
            })
        })
        .collect()
}

fn scene_area_m2(scene: &Scene, pose: &ScenePose) -> f64 {
    let area = |mesh: &super::Mesh, map: Affine3A| -> f64 {
        (0..mesh.triangles.len())
            .map(|triangle| {
                let [a, b, c] = mesh
                    .corners(triangle)
                    .map(|corner| map.transform_point3(corner));
                0.5 * f64::from((b - a).cross(c - a).length())
            })
            .sum()
    };
    let moving: f64 = scene
        .objects
        .iter()
        .zip(&pose.scene_from_object)
        .map(|(object, map)| area(&object.mesh, *map))
        .sum();
    area(&scene.static_mesh, Affine3A::IDENTITY) + moving
}

/// All textures in one array of texels, and one record for each use of one.
struct Textures {
    texels: Vec<[u8; 4]>,
    uses: Vec<layout::TextureUse>,
    /// What each record stands for.
    keys: Vec<TextureRef>,
}

impl Textures {
    fn of(scene: &Scene) -> Self {
        let mut first_texel = Vec::with_capacity(scene.textures.len());
        let mut texels: Vec<[u8; 4]> = Vec::new();
        for texture in &scene.textures {
            first_texel.push(texels.len() as u32);
            texels.extend_from_slice(&texture.rgba8);
        }
        let (mut uses, mut keys) = (Vec::new(), Vec::new());
        let used = scene
            .materials
            .iter()
            .flat_map(|m| {
                [
                    m.base_color_texture,
                    m.metallic_roughness_texture,
                    m.emission_texture,
                ]
            })
            .flatten();
        for reference in used {
            if keys.contains(&reference) {
                continue;
            }
            let texture = &scene.textures[reference.texture as usize];
            let flags = texture.wrap[0] as u32
                | (texture.wrap[1] as u32) << 2
                | if texture.is_bilinear {
                    layout::TEXTURE_BILINEAR
                } else {
                    0
                }
                | if texture.is_srgb {
                    layout::TEXTURE_SRGB
                } else {
                    0
                };
            keys.push(reference);
            uses.push(layout::TextureUse {
                first_texel: first_texel[reference.texture as usize],
                width: texture.width,
                height: texture.height,
                flags,
                uv_column0: reference.uv_column0.to_array(),
                uv_column1: reference.uv_column1.to_array(),
                uv_offset: reference.uv_offset.to_array(),
                padding: [0.0; 2],
            });
        }
        Self { texels, uses, keys }
    }

    fn use_index(&self, reference: Option<TextureRef>) -> i32 {
        reference
            .and_then(|reference| self.keys.iter().position(|key| *key == reference))
            .map_or(-1, |index| index as i32)
    }

    fn material_record(&self, material: &Material) -> layout::Material {
        let has_absorption =
            material.attenuation_distance_m.is_finite() && material.attenuation_distance_m > 0.0;
        // Beer and Lambert: colour = exp(-absorption · distance). A black channel absorbs within a hair's breadth.
        let absorption = if has_absorption {
            -material
                .attenuation_color
                .max(Vec3::splat(1e-6))
                .map(f32::ln)
                / material.attenuation_distance_m
        } else {
            Vec3::ZERO
        };
        layout::Material {
            base_color: material.base_color.to_array(),
            metallic: material.metallic,
            emission: material.emission_w_per_m2_sr.to_array(),
            roughness: material.roughness,
            specular_color: material.specular_color.to_array(),
            specular_factor: material.specular_factor,
            absorption: absorption.to_array(),
            ior: material.ior,
            transmission: material.transmission,
            alpha_cutoff: material.alpha_cutoff.unwrap_or(-1.0),
            flags: if material.double_sided {
                layout::MATERIAL_DOUBLE_SIDED
            } else {
                0
            } | if material.is_solid {
                layout::MATERIAL_SOLID
            } else {
                0
            },
            base_color_texture: self.use_index(material.base_color_texture),
            metallic_roughness_texture: self.use_index(material.metallic_roughness_texture),
            emission_texture: self.use_index(material.emission_texture),
            padding: [0; 2],
        }
    }
}
