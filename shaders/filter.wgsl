//! use eye
// What the passes of the edge-avoiding filter share: what they keep for each visible point.
// Source: Dammertz, Sewtz, Hanika and Lensch, "Edge-Avoiding À-Trous Wavelet Transform for Fast Global Illumination Filtering",
// HPG 2010: a B-spline with holes, its weights stopped at edges.
// Light and albedo are filtered alike and divided at the end, so that textures stay sharp and a channel without albedo brings none of
// its darkness to its neighbours.
// A pixel that an edge crosses keeps the samples on either side apart: the filter starts from the first one's surface, and the others take
// the filtered light of the neighbours that lie where they lie. So edges stay smooth and are no noisier than the rest.
// Limits: it does not reach over the image's edge. An albedo is kept in 8 bits a channel, of its root: mixed albedos are off by 1 % where
// they are near a hundredth.

/// Smallest cosine between two normals across which light is filtered.
override FILTER_NORMAL_COS_MIN: f32 = 0.9;
/// Steepest line between two points, against the tangent plane, along which light is filtered.
override FILTER_SLOPE_MAX: f32 = 0.2;
/// Most that two points may lie apart, in footprints of the pixels between them: beyond it lies an edge, or optics that spread them.
const FILTER_SPREAD_MAX: f32 = 4.0;

/// Samples of a slot that saw the same surface as the first. Smooth light: the sum of radiances to the eye, W/(m2 sr), and how many were
/// lit.
@group(1) @binding(4) var<storage, read_write> smooth_sum: array<vec4f>;
/// The sum of albedos by which that light was reflected, times what the eye paths let through, and of the glossy lobe's share in them.
@group(1) @binding(5) var<storage, read_write> albedo_sum: array<vec4f>;
/// Position of the first one's surface and its packed shading normal; out of reach where there is none.
@group(1) @binding(6) var<storage, read_write> filter_guide: array<vec4f>;

const OUT_OF_REACH: f32 = 3.0e38;

fn pack_albedo(albedo: vec4f) -> f32 { return bitcast<f32>(pack4x8unorm(vec4f(sqrt(albedo.rgb), albedo.a))); }

fn unpack_albedo(packed: f32) -> vec4f {
  let root = unpack4x8unorm(bitcast<u32>(packed));
  // A channel of which nothing is left counts a little, so that there is something to divide by.
  return vec4f(max(root.rgb * root.rgb, vec3f(1e-6)), root.a);
}

/// How far a pixel's sides lie apart on the surface that it shows, metres.
fn footprint_m(position: vec3f, normal: vec3f) -> f32 {
  let to_eye = vec3f(eye.scene_from_view[0].w, eye.scene_from_view[1].w, eye.scene_from_view[2].w) - position;
  let distance_m = length(to_eye);
  let cos_view = max(abs(dot(to_eye, normal)) / max(distance_m, 1e-20), 0.05);
  return distance_m * max(abs(eye.slope_extent.x) / f32(eye.size.x), abs(eye.slope_extent.y) / f32(eye.size.y)) / cos_view;
}

/// How alike the surroundings of two surface points are: 1 for one plane, 0 across an edge.
fn likeness(along: vec3f, normal: vec3f, other_normal: vec3f, reach_m: f32) -> f32 {
  let along_m = length(along);
  let slope = abs(dot(along, normal)) / max(along_m, 1e-20);
  let cos_normals = dot(other_normal, normal);
  let is_alike = cos_normals >= FILTER_NORMAL_COS_MIN && slope <= FILTER_SLOPE_MAX && along_m <= reach_m;
  return select(0.0, cos_normals * cos_normals * (1.0 - slope / FILTER_SLOPE_MAX), is_alike);
}
