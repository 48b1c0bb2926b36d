//! How much a scene file may ask for.

/// Bounds on what a scene file may claim, so that an absurd file is refused before it costs memory or time.
///
/// The defaults are some twenty times what the largest of the shared reference scenes needs (787 k triangles).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoadLimits {
    /// Bytes of the file and of all buffers and images that it names, together. Default 2 GiB.
    pub file_bytes: u64,
    /// Objects, arrays and elements in the JSON, counted before it is parsed. Default 4 Mi (100 k nodes need about 1 Mi).
    pub json_items: u64,
    /// Nodes in the file. Default 256 Ki.
    pub nodes: u64,
    /// Vertices after every instance of a mesh is placed. Default 32 Mi.
    pub vertices: u64,
    /// Triangles after every instance of a mesh is placed. Default 16 Mi.
    pub triangles: u64,
    /// Pixels of all decoded textures together. Default 128 Mi (512 MiB of RGBA).
    pub texture_pixels: u64,
    /// Key frames of all animation channels together. Default 4 Mi.
    pub animation_keys: u64,
}

impl Default for LoadLimits {
    fn default() -> Self {
        const MI: u64 = 1 << 20;
        Self {
            file_bytes: 2048 * MI,
            json_items: 4 * MI,
            nodes: MI / 4,
            vertices: 32 * MI,
            triangles: 16 * MI,
            texture_pixels: 128 * MI,
            animation_keys: 4 * MI,
        }
    }
}
