//! Writes small glTF files for tests.

use std::path::PathBuf;

use serde_json::{Value, json};
use tempfile::TempDir;

/// A glTF document under construction, with its binary chunk. The JSON is open, so that tests can spoil it.
pub struct Glb {
    pub json: Value,
    pub binary: Vec<u8>,
}

impl Glb {
    /// An empty scene.
    pub fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": [], "meshes": [],
            "accessors": [], "bufferViews": [], "buffers": [{"byteLength": 0}], "materials": [],
        });
        Self {
            json,
            binary: Vec::new(),
        }
    }

    /// Appends to a top-level array and returns the index.
    pub fn push(&mut self, array: &str, value: Value) -> usize {
        if self.json[array].is_null() {
            self.json[array] = json!([]);
        }
        let items = self.json[array].as_array_mut().unwrap();
        items.push(value);
        items.len() - 1
    }

    /// Adds a node to the scene's roots.
    pub fn root(&mut self, node: Value) -> usize {
        let index = self.push("nodes", node);
        let roots = &mut self.json["scenes"][0]["nodes"];
        roots.as_array_mut().unwrap().push(json!(index));
        index
    }

    pub fn buffer_view(&mut self, bytes: &[u8]) -> usize {
        let offset = self.binary.len();
        self.binary.extend_from_slice(bytes);
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        self.json["buffers"][0]["byteLength"] = json!(self.binary.len());
        let view = json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()});
        self.push("bufferViews", view)
    }

    /// An accessor of vectors with `N` float components.
    pub fn floats<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = values
            .iter()
            .flatten()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        let view = self.buffer_view(&bytes);
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1];
        let bound = |fold: fn(f32, f32) -> f32| -> Vec<f32> {
            (0..N)
                .map(|c| values.iter().map(|v| v[c]).fold(values[0][c], fold))
                .map(|v| if v.is_finite() { v } else { 0.0 })
                .collect()
        };
        let accessor = json!({
            "bufferView": view, "componentType": 5126, "count": values.len(), "type": kind,
            "min": bound(f32::min), "max": bound(f32::max),
        });
        self.push("accessors", accessor)
    }

    /// An accessor of u32 indices.
    pub fn indices(&mut self, values: &[u32]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.buffer_view(&bytes);
        let accessor = json!({"bufferView": view, "componentType": 5125, "count": values.len(), "type": "SCALAR"});
        self.push("accessors", accessor)
    }

    /// A mesh of indexed triangles with only positions.
    pub fn mesh(&mut self, name: &str, positions: &[[f32; 3]], corners: &[u32]) -> usize {
        let (positions, indices) = (self.floats(positions), self.indices(corners));
        let primitive = json!({"attributes": {"POSITION": positions}, "indices": indices});
        self.push("meshes", json!({"name": name, "primitives": [primitive]}))
    }

    /// The right triangle (0,0,0), (1,0,0), (0,1,0): front towards +Z.
    pub fn triangle(&mut self) -> usize {
        self.mesh("triangle", &TRIANGLE, &[0, 1, 2])
    }

    /// An animation of one property of one node.
    pub fn animate<const N: usize>(
        &mut self,
        node: usize,
        path: &str,
        interpolation: &str,
        times: &[f32],
        values: &[[f32; N]],
    ) -> usize {
        let times: Vec<[f32; 1]> = times.iter().map(|t| [*t]).collect();
        let (input, output) = (self.floats(&times), self.floats(values));
        let animation = json!({
            "samplers": [{"input": input, "output": output, "interpolation": interpolation}],
            "channels": [{"sampler": 0, "target": {"node": node, "path": path}}],
        });
        self.push("animations", animation)
    }

    /// The bytes of a .glb.
    pub fn bytes(&self) -> Vec<u8> {
        let mut json = self.json.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut bytes = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
        for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &self.binary)] {
            bytes.extend((chunk.len() as u32).to_le_bytes());
            bytes.extend(kind);
            bytes.extend(chunk);
        }
        let length = bytes.len() as u32;
        bytes[8..12].copy_from_slice(&length.to_le_bytes());
        bytes
    }

    /// Writes `scene.glb` into a fresh folder, which lives as long as what is returned.
    pub fn save(&self) -> Saved {
        Saved::new("scene.glb", &self.bytes())
    }
}

/// The positions of [`Glb::triangle`].
pub const TRIANGLE: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

/// A file in a folder of its own, which goes when this does.
pub struct Saved {
    pub path: PathBuf,
    _folder: TempDir,
}

impl Saved {
    pub fn new(name: &str, bytes: &[u8]) -> Self {
        let folder = TempDir::new().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        Self {
            path,
            _folder: folder,
        }
    }
}
