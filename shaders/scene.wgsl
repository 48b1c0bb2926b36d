// The scene as every dispatch sees it: geometry, materials, textures, moving objects and lights, in scene space (metres).
// Laid out by src/scene/gpu_scene.rs; tests/shader_layout.rs compares the structs with the host's.

override HAS_OBJECTS: bool = true;
override HAS_TEXCOORDS: bool = true;
override HAS_EMISSION_TEXTURES: bool = true;

struct SceneUniform {
  bounds_center: vec3f,
  bounds_radius_m: f32,
  ray_offset_m: f32,
  light_count: u32,
  object_count: u32,
  delta_light_count: u32,   // lights without extent, of light_count
}

struct Material {
  base_color: vec3f,
  metallic: f32,
  emission: vec3f,          // W/(m2 sr)
  roughness: f32,
  specular_color: vec3f,
  specular_factor: f32,
  absorption: vec3f,        // 1/m, inside a solid
  ior: f32,
  transmission: f32,
  alpha_cutoff: f32,        // negative: opaque
  flags: u32,
  base_color_texture: i32,  // index into texture_uses, or -1
  metallic_roughness_texture: i32,
  emission_texture: i32,
  padding: vec2u,
}
const MATERIAL_DOUBLE_SIDED: u32 = 1u;
const MATERIAL_SOLID: u32 = 2u;

struct TextureUse {
  first_texel: u32,
  width: u32,
  height: u32,
  flags: u32,               // wrap u (2 bits), wrap v (2 bits), bilinear, sRGB
  uv_column0: vec2f,
  uv_column1: vec2f,
  uv_offset: vec2f,
  padding: vec2f,
}
const TEXTURE_BILINEAR: u32 = 16u;
const TEXTURE_SRGB: u32 = 32u;

// Rows of two affine maps; triangles of an object are in its own space.
struct Object {
  scene_from_object: array<vec4f, 3>,
  object_from_scene: array<vec4f, 3>,
  root_node: u32,
  padding0: u32,
  padding1: u32,
  padding2: u32,
}

@group(0) @binding(0) var<uniform> scene: SceneUniform;
@group(0) @binding(1) var<storage, read> materials: array<Material>;
@group(0) @binding(2) var<storage, read> texture_uses: array<TextureUse>;
@group(0) @binding(4) var<storage, read> objects: array<Object>;
@group(0) @binding(5) var<storage, read> object_nodes: array<vec4f>;
//! texel_array bvh_nodes: u32, 0, 16
//! texel_array triangle_positions: f32, 0, 32
//! split triangle_shading: vec4u, read, 0, 48
//! split triangle_texcoords: vec2f, read, 0, 64
//! split texels: u32, read, 0, 80

fn affine_point(rows: array<vec4f, 3>, p: vec3f) -> vec3f {
  let h = vec4f(p, 1.0);
  return vec3f(dot(rows[0], h), dot(rows[1], h), dot(rows[2], h));
}

fn affine_vector(rows: array<vec4f, 3>, v: vec3f) -> vec3f {
  return vec3f(dot(rows[0].xyz, v), dot(rows[1].xyz, v), dot(rows[2].xyz, v));
}

/// Normals map by the inverse transpose: give the rows of the inverse map.
fn affine_normal(inverse_rows: array<vec4f, 3>, n: vec3f) -> vec3f {
  return normalize(n.x * inverse_rows[0].xyz + n.y * inverse_rows[1].xyz + n.z * inverse_rows[2].xyz);
}

fn wrap_texel(coordinate: i32, size: i32, wrap: u32) -> i32 {
  if (wrap == 2u) { return clamp(coordinate, 0, size - 1); }
  let period = select(size, 2 * size, wrap == 1u);
  let inside = ((coordinate % period) + period) % period;
  return select(inside, 2 * size - 1 - inside, inside >= size);
}

fn srgb_to_linear(c: vec3f) -> vec3f {
  return select(pow((c + 0.055) / 1.055, vec3f(2.4)), c / 12.92, c <= vec3f(0.04045));
}

fn texel(use_: TextureUse, x: i32, y: i32) -> vec4f {
  let column = wrap_texel(x, i32(use_.width), use_.flags & 3u);
  let row = wrap_texel(y, i32(use_.height), (use_.flags >> 2u) & 3u);
  let value = unpack4x8unorm(load_texels(use_.first_texel + u32(row) * use_.width + u32(column)));
  if ((use_.flags & TEXTURE_SRGB) != 0u) { return vec4f(srgb_to_linear(value.rgb), value.a); }
  return value;
}

/// Looks a texture up at untransformed coordinates; white where `index` is negative.
fn texture_at(index: i32, texcoord: vec2f) -> vec4f {
  if (index < 0) { return vec4f(1.0); }
  let use_ = texture_uses[index];
  let uv = use_.uv_column0 * texcoord.x + use_.uv_column1 * texcoord.y + use_.uv_offset;
  // Far coordinates would lose all precision, or overflow the integer: one period is as good as any.
  let place = clamp(uv, vec2f(-1e4), vec2f(1e4)) * vec2f(f32(use_.width), f32(use_.height));
  if ((use_.flags & TEXTURE_BILINEAR) == 0u) {
    let nearest = vec2i(floor(place));
    return texel(use_, nearest.x, nearest.y);
  }
  let corner = floor(place - 0.5);
  let f = place - 0.5 - corner;
  let c = vec2i(corner);
  let top = mix(texel(use_, c.x, c.y), texel(use_, c.x + 1, c.y), f.x);
  let bottom = mix(texel(use_, c.x, c.y + 1), texel(use_, c.x + 1, c.y + 1), f.x);
  return mix(top, bottom, f.y);
}
