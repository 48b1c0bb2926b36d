//! use filter
// What the samples of a frame are collected in, besides what the filter itself looks at.
// A pixel that an edge crosses keeps the samples on either side apart: the filter starts from the first one's surface, and the others take
// the light of the neighbours that lie where they lie. So edges stay smooth and are no noisier than the rest.
// Source: ours. Limits: a third surface in a pixel counts as the second.

/// Light that is not filtered: the sum of radiances; then, once all samples are there, their mean with what was kept, and its packed albedo.
@group(1) @binding(8) var<storage, read_write> sharp_sum: array<vec4f>;
/// The sum of albedos of all samples, lit or not, and how many they are.
@group(1) @binding(9) var<storage, read_write> shown_sum: array<vec4f>;
/// The same for samples beyond an edge that crosses the pixel.
@group(1) @binding(10) var<storage, read_write> beyond_smooth_sum: array<vec4f>;
@group(1) @binding(11) var<storage, read_write> beyond_albedo_sum: array<vec4f>;
@group(1) @binding(13) var<storage, read_write> beyond_guide: array<vec4f>;
@group(1) @binding(14) var<storage, read_write> beyond_sharp_sum: array<vec4f>;
@group(1) @binding(15) var<storage, read_write> beyond_shown_sum: array<vec4f>;
