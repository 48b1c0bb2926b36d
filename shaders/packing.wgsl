// Unit vectors in 32 bits, frames around a normal, and sampling of discs and hemispheres.
// Source: octahedral encoding after Cigolle et al., "A Survey of Efficient Representations for Independent Unit Vectors",
// JCGT 3(2), 2014; frame after Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017.
// Limits: octahedral directions are rounded to about 4e-5 rad.

const PI: f32 = 3.14159265;

fn sign_not_zero(v: vec2f) -> vec2f { return select(vec2f(-1.0), vec2f(1.0), v >= vec2f(0.0)); }

fn pack_direction(d: vec3f) -> u32 {
  var p = d.xy / (abs(d.x) + abs(d.y) + abs(d.z));
  if (d.z < 0.0) { p = (1.0 - abs(p.yx)) * sign_not_zero(p); }
  return pack2x16snorm(p);
}

fn unpack_direction(packed: u32) -> vec3f {
  let p = unpack2x16snorm(packed);
  var d = vec3f(p, 1.0 - abs(p.x) - abs(p.y));
  if (d.z < 0.0) { d = vec3f((1.0 - abs(p.yx)) * sign_not_zero(p), d.z); }
  return normalize(d);
}

/// Coarse packing for tests of normals only: within half a degree, and cheap to unpack.
fn pack_normal(n: vec3f) -> u32 { return pack4x8snorm(vec4f(n, 0.0)); }

/// The same with a mark that says yes or no.
fn pack_marked_normal(n: vec3f, mark: bool) -> u32 { return pack4x8snorm(vec4f(n, select(0.0, 1.0, mark))); }

fn is_marked(packed: u32) -> bool { return unpack4x8snorm(packed).w > 0.5; }

fn unpack_normal(packed: u32) -> vec3f { return unpack4x8snorm(packed).xyz; }

/// Columns: tangent, bitangent, normal.
fn frame_around(n: vec3f) -> mat3x3f {
  let s = select(-1.0, 1.0, n.z >= 0.0);
  let a = -1.0 / (s + n.z);
  let b = n.x * n.y * a;
  return mat3x3f(vec3f(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3f(b, s + n.y * n.y * a, -n.y), n);
}

fn disk_sample(u: vec2f) -> vec2f {
  let r = sqrt(u.x);
  let phi = 2.0 * PI * u.y;
  return r * vec2f(cos(phi), sin(phi));
}

/// Cosine-distributed around +Z.
fn cosine_hemisphere_sample(u: vec2f) -> vec3f {
  let p = disk_sample(u);
  return vec3f(p, sqrt(max(0.0, 1.0 - dot(p, p))));
}

/// Uniform on the sphere cap around +Z whose edge has cosine `cos_edge` (-1: whole sphere).
fn cap_sample(u: vec2f, cos_edge: f32) -> vec3f {
  let z = 1.0 - u.x * (1.0 - cos_edge);
  let r = sqrt(max(0.0, 1.0 - z * z));
  let phi = 2.0 * PI * u.y;
  return vec3f(r * cos(phi), r * sin(phi), z);
}

fn luminance(rgb: vec3f) -> f32 { return dot(rgb, vec3f(0.2126, 0.7152, 0.0722)); }

fn max_component(rgb: vec3f) -> f32 { return max(rgb.x, max(rgb.y, rgb.z)); }
