//! Textures: decoding within bounds, sampling rules, and how a material refers to them.

use std::borrow::Cow;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::io::Cursor;

use glam::Vec2;
use gltf::texture::{MagFilter, WrappingMode};
use image::{ImageFormat, ImageReader};
use rayon::prelude::*;

use super::error::SceneProblem;
use super::file::SceneFiles;
use super::limits::LoadLimits;
use super::node::display_name;

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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum Wrap {
    /// Repeats.
    Repeat = 0,
    /// Repeats mirrored.
    MirroredRepeat = 1,
    /// Keeps the edge texel.
    ClampToEdge = 2,
}

impl From<WrappingMode> for Wrap {
    fn from(mode: WrappingMode) -> Self {
        match mode {
            WrappingMode::Repeat => Self::Repeat,
            WrappingMode::MirroredRepeat => Self::MirroredRepeat,
            WrappingMode::ClampToEdge => Self::ClampToEdge,
        }
    }
}

/// One image, seen through one sampler in one colour space: what becomes one [`Texture`].
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct TextureKey {
    image: usize,
    is_srgb: bool,
    wrap: [Wrap; 2],
    is_bilinear: bool,
}

/// The textures that the materials ask for, each once.
#[derive(Default)]
pub(super) struct TextureTable {
    keys: Vec<TextureKey>,
    index_of: HashMap<TextureKey, u32>,
}

impl TextureTable {
    /// The reference for a material's use of a texture, and the coordinate set that it reads.
    pub fn refer(&mut self, info: &gltf::texture::Info, is_srgb: bool) -> (TextureRef, u32) {
        let sampler = info.texture().sampler();
        let key = TextureKey {
            image: info.texture().source().index(),
            is_srgb,
            wrap: [sampler.wrap_s().into(), sampler.wrap_t().into()],
            is_bilinear: sampler.mag_filter() != Some(MagFilter::Nearest),
        };
        let texture = *self.index_of.entry(key).or_insert_with(|| {
            self.keys.push(key);
            self.keys.len() as u32 - 1
        });
        let mut reference = TextureRef {
            texture,
            uv_column0: Vec2::X,
            uv_column1: Vec2::Y,
            uv_offset: Vec2::ZERO,
        };
        let Some(transform) = info.texture_transform() else {
            return (reference, info.tex_coord());
        };
        // KHR_texture_transform: translation × rotation × scale, where the rotation turns counter-clockwise with v down.
        let (sin, cos) = transform.rotation().sin_cos();
        let [scale_u, scale_v] = transform.scale();
        reference.uv_column0 = Vec2::new(cos, -sin) * scale_u;
        reference.uv_column1 = Vec2::new(sin, cos) * scale_v;
        reference.uv_offset = Vec2::from_array(transform.offset());
        let set = transform.tex_coord().unwrap_or(info.tex_coord());
        (reference, set)
    }

    /// Decodes the images of all textures asked for.
    pub fn decode(
        &self,
        document: &gltf::Document,
        buffers: &[Cow<[u8]>],
        files: &mut SceneFiles,
        limits: &LoadLimits,
    ) -> Result<Vec<Texture>, SceneProblem> {
        let mut encoded: HashMap<usize, (String, Cow<[u8]>)> = HashMap::new();
        let mut pixels_left = limits.texture_pixels;
        for key in &self.keys {
            let (name, bytes) = match encoded.entry(key.image) {
                Entry::Occupied(entry) => entry.into_mut(),
                Entry::Vacant(entry) => {
                    entry.insert(image_bytes(document, buffers, files, key.image)?)
                }
            };
            let (width, height) = reader(bytes, name)?
                .into_dimensions()
                .map_err(|source| image_problem(name, source))?;
            let pixels = u64::from(width) * u64::from(height);
            let what = format!("texture pixels up to {name} ({width}x{height})");
            let claimed = (limits.texture_pixels - pixels_left).saturating_add(pixels);
            SceneProblem::check_limit(what, claimed, limits.texture_pixels, "texture_pixels")?;
            pixels_left -= pixels;
        }
        self.keys
            .par_iter()
            .map(|key| {
                let (name, bytes) = &encoded[&key.image];
                decode(bytes, name, limits, *key)
            })
            .collect()
    }
}

fn image_bytes<'a>(
    document: &gltf::Document,
    buffers: &'a [Cow<[u8]>],
    files: &mut SceneFiles,
    index: usize,
) -> Result<(String, Cow<'a, [u8]>), SceneProblem> {
    let json = &document.as_json().images[index];
    let name = display_name("image", json.name.as_deref(), index);
    if let Some(uri) = &json.uri {
        let bytes = files.fetch(uri, &name)?;
        return Ok((name, Cow::Owned(bytes)));
    }
    let bytes = json.buffer_view.and_then(|view| {
        let view = &document.as_json().buffer_views[view.value()];
        let start = usize::try_from(view.byte_offset.unwrap_or_default().0).ok()?;
        let length = usize::try_from(view.byte_length.0).ok()?;
        buffers[view.buffer.value()].get(start..start.checked_add(length)?)
    });
    match bytes {
        Some(bytes) => Ok((name, Cow::Borrowed(bytes))),
        None => Err(SceneProblem::Invalid(format!(
            "{name} has neither a URI nor a buffer view within its buffer"
        ))),
    }
}

fn image_problem(name: &str, source: image::ImageError) -> SceneProblem {
    SceneProblem::Image {
        what: name.to_owned(),
        source,
    }
}

/// A reader for PNG or JPEG, told by the bytes and not by the file's word.
fn reader<'a>(bytes: &'a [u8], name: &str) -> Result<ImageReader<Cursor<&'a [u8]>>, SceneProblem> {
    let format = image::guess_format(bytes).map_err(|source| image_problem(name, source))?;
    if !matches!(format, ImageFormat::Png | ImageFormat::Jpeg) {
        return Err(SceneProblem::Invalid(format!(
            "{name} is {format:?}; only PNG and JPEG are read"
        )));
    }
    Ok(ImageReader::with_format(Cursor::new(bytes), format))
}

fn decode(
    bytes: &[u8],
    name: &str,
    limits: &LoadLimits,
    key: TextureKey,
) -> Result<Texture, SceneProblem> {
    // 16-bit RGBA is the widest that PNG decodes to; as much again for the decoder's own buffers.
    const DECODER_BYTES_PER_PIXEL: u64 = 16;
    let mut image_limits = image::Limits::default();
    image_limits.max_alloc = Some(
        limits
            .texture_pixels
            .saturating_mul(DECODER_BYTES_PER_PIXEL),
    );
    let mut reader = reader(bytes, name)?;
    reader.limits(image_limits);
    let image = reader
        .decode()
        .map_err(|source| image_problem(name, source))?
        .into_rgba8();
    Ok(Texture {
        width: image.width(),
        height: image.height(),
        rgba8: image.pixels().map(|pixel| pixel.0).collect(),
        is_srgb: key.is_srgb,
        wrap: key.wrap,
        is_bilinear: key.is_bilinear,
    })
}
