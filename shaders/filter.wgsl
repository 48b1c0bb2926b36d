//! use eye
// What the passes of the edge-avoiding filter share: what they keep for each visible point.
// Source: Dammertz, Sewtz, Hanika and Lensch, "Edge-Avoiding À-Trous Wavelet Transform for Fast Global Illumination Filtering",
// HPG 2010: a B-spline with holes, its weights stopped at edges.
// Light and albedo are filtered alike and divided at the end, so that textures stay sharp and a channel without albedo brings none of
// its darkness to its neighbours.
// Limits: a filter looks at the points of one sample and one slot; it does not reach over the image's edge. An albedo is kept in 8 bits
// a channel, of its root: mixed albedos are off by 1 % where they are near a hundredth.

/// The light to filter: mean radiance to the eye, W/(m2 sr); and, packed, the albedo by which it was reflected, times what the eye path
/// lets through, with the share of the glossy lobe in it.
@group(1) @binding(4) var<storage, read_write> filter_light: array<vec4f>;
/// Position, and packed shading normal; far out of reach where there is no visible point.
@group(1) @binding(6) var<storage, read_write> filter_guide: array<vec4f>;

const OUT_OF_REACH: f32 = 3.0e38;

fn pack_albedo(albedo: vec4f) -> f32 { return bitcast<f32>(pack4x8unorm(vec4f(sqrt(albedo.rgb), albedo.a))); }

fn unpack_albedo(packed: f32) -> vec4f {
  let root = unpack4x8unorm(bitcast<u32>(packed));
  // A channel of which nothing is left counts a little, so that there is something to divide by.
  return vec4f(max(root.rgb * root.rgb, vec3f(1e-6)), root.a);
}

/// The albedo by which a visible point reflects light to the eye, times what the eye path lets through, and the glossy lobe's share in it.
fn albedo_of(point: VisiblePoint) -> vec4f {
  let bsdf = bsdf_of(point);
  var glossy = vec3f(0.0);
  if (gathers_reflection(bsdf)) {
    glossy = schlick(bsdf.f0, bsdf.f90, dot(unpack_direction(point.packed_normal), unpack_direction(point.packed_wo)));
  }
  let albedo = bsdf.diffuse + glossy;
  return vec4f(min(point.throughput * albedo, vec3f(1.0)), luminance(glossy) / max(luminance(albedo), 1e-6));
}
