//! use eye
// What the passes of the edge-avoiding filter share: what they keep for each visible point, and how alike two of them are.
// Source: Dammertz, Sewtz, Hanika and Lensch, "Edge-Avoiding À-Trous Wavelet Transform for Fast Global Illumination Filtering",
// HPG 2010: a cubic B-spline with holes, its weights stopped at edges.
// Light and albedo are filtered alike and divided at the end, so that textures stay sharp and a channel without albedo brings none of
// its darkness to its neighbours.
// Limits: a filter looks at the points of one sample and one slot; it does not reach over the image's edge.

/// The light to filter: mean radiance to the eye, W/(m2 sr), and how much of it was measured (0: nothing is known here).
@group(1) @binding(4) var<storage, read_write> filter_light: array<vec4f>;
/// The albedo by which that light was reflected, times what the eye path lets through; and the share of the glossy lobe in it, or
/// `NO_POINT` where there is no visible point.
@group(1) @binding(5) var<storage, read_write> filter_albedo: array<vec4f>;
/// Position, and packed shading normal.
@group(1) @binding(6) var<storage, read_write> filter_guide: array<vec4f>;

const NO_POINT: f32 = -1.0;

/// Smallest cosine between two normals across which light is filtered.
override FILTER_NORMAL_COS_MIN: f32 = 0.9;
/// Steepest line between two points, against the tangent plane, along which light is filtered.
override FILTER_SLOPE_MAX: f32 = 0.2;
/// Most that two points may lie apart, in footprints of the pixels between them: beyond it lies an edge, or optics that spread them.
const FILTER_SPREAD_MAX: f32 = 4.0;

/// The albedo by which a visible point reflects light to the eye, times what the eye path lets through, and the glossy lobe's share in it.
fn albedo_of(point: VisiblePoint) -> vec4f {
  let bsdf = bsdf_of(point);
  var glossy = vec3f(0.0);
  if (gathers_reflection(bsdf)) {
    glossy = schlick(bsdf.f0, bsdf.f90, dot(unpack_direction(point.packed_normal), unpack_direction(point.packed_wo)));
  }
  let albedo = bsdf.diffuse + glossy;
  return vec4f(point.throughput * albedo, luminance(glossy) / max(luminance(albedo), 1e-6));
}
