//! A writer of binary glTF 2.0 files: one JSON chunk, one buffer.

use std::collections::BTreeSet;

use glam::{DQuat, DVec3};
use serde_json::{Map, Value, json};

use super::mesh::Mesh;

const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;
const LINEAR: u32 = 9729;
const LINEAR_MIPMAP_LINEAR: u32 = 9987;

/// A scene being written. Indices that its functions return are glTF's.
pub struct Glb {
    root: Map<String, Value>,
    binary: Vec<u8>,
}

/// Keys of a looped motion: a cubic path with its velocities, and rotations between which the motion turns evenly.
#[derive(Default)]
pub struct Motion {
    /// Times, seconds.
    pub times_s: Vec<f64>,
    /// Positions, metres.
    pub translations: Vec<DVec3>,
    /// Velocities at the keys, m/s.
    pub velocities: Vec<DVec3>,
    /// Orientations.
    pub rotations: Vec<DQuat>,
}

impl Glb {
    /// An empty scene.
    pub fn new(name: &str) -> Self {
        let mut root = Map::new();
        root.insert(
            "asset".into(),
            json!({ "version": "2.0", "generator": "macula make_scenes" }),
        );
        root.insert("scene".into(), json!(0));
        root.insert("scenes".into(), json!([{ "name": name, "nodes": [] }]));
        Self {
            root,
            binary: Vec::new(),
        }
    }

    /// Adds a material made by [`super::material`].
    pub fn material(&mut self, name: &str, mut material: Value) -> usize {
        material["name"] = json!(name);
        self.push("materials", material)
    }

    /// Adds a PNG image as a texture that repeats and is filtered.
    pub fn texture(&mut self, name: &str, png: &[u8]) -> usize {
        if !self.root.contains_key("samplers") {
            self.push(
                "samplers",
                json!({ "magFilter": LINEAR, "minFilter": LINEAR_MIPMAP_LINEAR }),
            );
        }
        let view = self.buffer_view(png, None);
        let image = json!({ "name": name, "mimeType": "image/png", "bufferView": view });
        let image = self.push("images", image);
        self.push(
            "textures",
            json!({ "name": name, "sampler": 0, "source": image }),
        )
    }

    /// Adds a mesh of one primitive per material. Texture coordinates are written where the material has a texture.
    pub fn mesh(&mut self, name: &str, parts: &[(&Mesh, usize)]) -> usize {
        let primitives: Vec<Value> = parts
            .iter()
            .map(|(mesh, material)| self.primitive(mesh, *material))
            .collect();
        self.push("meshes", json!({ "name": name, "primitives": primitives }))
    }

    /// Adds a node at the top of the scene; `node` holds glTF's own fields.
    pub fn node(&mut self, name: &str, mut node: Value) -> usize {
        node["name"] = json!(name);
        let index = self.push("nodes", node);
        if let Some(Value::Array(tops)) = self.root["scenes"].pointer_mut("/0/nodes") {
            tops.push(json!(index));
        }
        index
    }

    /// Adds a mesh of one material that stands where its vertices are.
    pub fn place(&mut self, name: &str, mesh: &Mesh, material: usize) -> usize {
        let mesh = self.mesh(name, &[(mesh, material)]);
        self.node(name, json!({ "mesh": mesh }))
    }

    /// Adds a camera at `position` that looks along `rotation` · -Z.
    pub fn camera(&mut self, name: &str, position: DVec3, rotation: DQuat, yfov_deg: f64) {
        let perspective =
            json!({ "yfov": yfov_deg.to_radians(), "aspectRatio": 1.0, "znear": 0.01 });
        let camera = self.push(
            "cameras",
            json!({ "type": "perspective", "name": name, "perspective": perspective }),
        );
        let (translation, rotation) = (position.to_array(), rotation.to_array());
        self.node(
            name,
            json!({ "camera": camera, "translation": translation, "rotation": rotation }),
        );
    }

    /// Adds a light of KHR_lights_punctual at `position` that shines along `direction`; `light` holds the extension's own fields.
    pub fn light(
        &mut self,
        name: &str,
        mut light: Value,
        position: DVec3,
        direction: DVec3,
    ) -> usize {
        light["name"] = json!(name);
        let extensions = self.root.entry("extensions").or_insert_with(|| json!({}));
        let lights = &mut extensions["KHR_lights_punctual"]["lights"];
        if lights.is_null() {
            *lights = json!([]);
        }
        let index = lights.as_array().map_or(0, Vec::len);
        if let Value::Array(lights) = lights {
            lights.push(light);
        }
        // A light shines along its node's -Z.
        let rotation = DQuat::from_rotation_arc(DVec3::NEG_Z, direction);
        let extension = json!({ "KHR_lights_punctual": { "light": index } });
        let (translation, rotation) = (position.to_array(), rotation.to_array());
        self.node(
            name,
            json!({ "extensions": extension, "translation": translation, "rotation": rotation }),
        )
    }

    /// Gives a node a mesh.
    pub fn attach_mesh(&mut self, node: usize, mesh: usize) {
        self.root["nodes"][node]["mesh"] = json!(mesh);
    }

    /// Moves a node by an animation of its own.
    pub fn animate(&mut self, name: &str, node: usize, motion: &Motion) {
        let times = self.floats(&motion.times_s, "SCALAR", None, true);
        let keys: Vec<f64> = motion
            .translations
            .iter()
            .zip(&motion.velocities)
            // CUBICSPLINE keys are in-tangent, value, out-tangent; a smooth path has one tangent.
            .flat_map(|(p, v)| [v.to_array(), p.to_array(), v.to_array()])
            .flatten()
            .collect();
        let translations = self.floats(&keys, "VEC3", None, false);
        let keys: Vec<f64> = motion.rotations.iter().flat_map(|r| r.to_array()).collect();
        let rotations = self.floats(&keys, "VEC4", None, false);
        self.push(
            "animations",
            json!({
                "name": name,
                "samplers": [
                    { "input": times, "output": translations, "interpolation": "CUBICSPLINE" },
                    { "input": times, "output": rotations, "interpolation": "LINEAR" },
                ],
                "channels": [
                    { "sampler": 0, "target": { "node": node, "path": "translation" } },
                    { "sampler": 1, "target": { "node": node, "path": "rotation" } },
                ],
            }),
        );
    }

    /// The file.
    pub fn finish(mut self) -> Vec<u8> {
        let mut extensions = BTreeSet::new();
        self.root
            .values()
            .for_each(|v| collect_extensions(v, &mut extensions));
        if !extensions.is_empty() {
            self.root.insert("extensionsUsed".into(), json!(extensions));
        }
        self.root.insert(
            "buffers".into(),
            json!([{ "byteLength": self.binary.len() }]),
        );
        let mut text = Value::Object(self.root).to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let total = 12 + 8 + text.len() + 8 + self.binary.len();
        let mut file = Vec::with_capacity(total);
        file.extend(b"glTF");
        file.extend(2u32.to_le_bytes());
        file.extend((total as u32).to_le_bytes());
        for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &self.binary)] {
            file.extend((chunk.len() as u32).to_le_bytes());
            file.extend(kind);
            file.extend(chunk);
        }
        file
    }

    fn primitive(&mut self, mesh: &Mesh, material: usize) -> Value {
        let flatten =
            |vectors: &[DVec3]| -> Vec<f64> { vectors.iter().flat_map(|v| v.to_array()).collect() };
        let position = self.floats(&flatten(&mesh.positions), "VEC3", Some(ARRAY_BUFFER), true);
        let mut attributes = json!({ "POSITION": position });
        if !mesh.normals.is_empty() {
            let normals = flatten(&mesh.normals);
            attributes["NORMAL"] = json!(self.floats(&normals, "VEC3", Some(ARRAY_BUFFER), false));
        }
        let pbr = &self.root["materials"][material]["pbrMetallicRoughness"];
        if pbr.get("baseColorTexture").is_some() {
            let texcoords: Vec<f64> = mesh.texcoords.iter().flat_map(|uv| uv.to_array()).collect();
            let texcoords = self.floats(&texcoords, "VEC2", Some(ARRAY_BUFFER), false);
            attributes["TEXCOORD_0"] = json!(texcoords);
        }
        let indices = self.indices(mesh);
        json!({ "attributes": attributes, "indices": indices, "material": material })
    }

    fn indices(&mut self, mesh: &Mesh) -> usize {
        let indices = mesh.triangles.iter().flatten();
        // The highest index of a type restarts primitives in some programs, so it is not used.
        let is_short = mesh.positions.len() < usize::from(u16::MAX);
        let (component_type, bytes): (u32, Vec<u8>) = if is_short {
            (
                UNSIGNED_SHORT,
                indices.flat_map(|i| (*i as u16).to_le_bytes()).collect(),
            )
        } else {
            (
                UNSIGNED_INT,
                indices.flat_map(|i| i.to_le_bytes()).collect(),
            )
        };
        let view = self.buffer_view(&bytes, Some(ELEMENT_ARRAY_BUFFER));
        let count = mesh.triangles.len() * 3;
        self.push(
            "accessors",
            json!({ "bufferView": view, "componentType": component_type, "count": count, "type": "SCALAR" }),
        )
    }

    fn floats(&mut self, values: &[f64], kind: &str, target: Option<u32>, bounds: bool) -> usize {
        let width = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            _ => 4,
        };
        // Adding zero turns -0 into 0, which has one spelling only.
        let values: Vec<f32> = values.iter().map(|x| *x as f32 + 0.0).collect();
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        let view = self.buffer_view(&bytes, target);
        let mut accessor = json!({
            "bufferView": view, "componentType": FLOAT, "count": values.len() / width, "type": kind,
        });
        if bounds {
            let extreme = |pick: fn(f32, f32) -> f32| -> Vec<f32> {
                let column = |c: usize| values.iter().skip(c).step_by(width).copied().reduce(pick);
                (0..width).filter_map(column).collect()
            };
            accessor["min"] = json!(extreme(f32::min));
            accessor["max"] = json!(extreme(f32::max));
        }
        self.push("accessors", accessor)
    }

    fn buffer_view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        let offset = self.binary.len();
        self.binary.extend(bytes);
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let mut view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.push("bufferViews", view)
    }

    fn push(&mut self, list: &str, item: Value) -> usize {
        let list = self.root.entry(list).or_insert_with(|| json!([]));
        match list {
            Value::Array(items) => {
                items.push(item);
                items.len() - 1
            }
            _ => unreachable!("every top-level entry that items are pushed to is a list"),
        }
    }
}

fn collect_extensions(value: &Value, names: &mut BTreeSet<String>) {
    match value {
        Value::Object(map) => {
            if let Some(Value::Object(extensions)) = map.get("extensions") {
                names.extend(extensions.keys().cloned());
            }
            map.values().for_each(|v| collect_extensions(v, names));
        }
        Value::Array(items) => items.iter().for_each(|v| collect_extensions(v, names)),
        _ => {}
    }
}
