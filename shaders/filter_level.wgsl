//! use filter
// One level of the edge-avoiding filter: a 3x3 B-spline whose taps lie `FILTER_STEP` pixels apart.
// Source: Dammertz et al. 2010, equations 2 to 6, with weights of normal, plane and lobe in place of depth; see filter.wgsl. Nine taps in
// place of 25 and one level more: as wide, at half the cost.
// Limits: none of its own.

/// Pixels between two taps: 1, 2, 4, ...
override FILTER_STEP: u32 = 1u;
/// Smallest cosine between two normals across which light is filtered.
override FILTER_NORMAL_COS_MIN: f32 = 0.9;
/// Steepest line between two points, against the tangent plane, along which light is filtered.
override FILTER_SLOPE_MAX: f32 = 0.2;
/// Most that two points may lie apart, in footprints of the pixels between them: beyond it lies an edge, or optics that spread them.
const FILTER_SPREAD_MAX: f32 = 4.0;

@group(1) @binding(7) var<storage, read_write> filtered_light: array<vec4f>;

@compute @workgroup_size(64)
fn filter_level(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
  @builtin(local_invocation_index) local: u32) {
  let slot = eye_thread(group, groups, local);
  if (slot >= slots_a_pixel() * band_pixel_count()) { return; }
  let guide = filter_guide[slot];
  if (guide.x == OUT_OF_REACH) { return; }
  let own_light = filter_light[slot];
  let own_albedo = unpack_albedo(own_light.w);
  let first_of_slot = select(0u, band_pixel_count(), slot >= band_pixel_count());
  let pixel = vec2i(vec2u((slot - first_of_slot) % eye.size.x, (slot - first_of_slot) / eye.size.x));
  let normal = unpack_direction(bitcast<u32>(guide.w));
  let to_eye = vec3f(eye.scene_from_view[0].w, eye.scene_from_view[1].w, eye.scene_from_view[2].w) - guide.xyz;
  let distance_m = length(to_eye);
  let cos_view = max(abs(dot(to_eye, normal)) / max(distance_m, 1e-20), 0.05);
  let footprint_m = distance_m * max(abs(eye.slope_extent.x) / f32(eye.size.x), abs(eye.slope_extent.y) / f32(eye.size.y)) / cos_view;
  let reach_m = FILTER_SPREAD_MAX * footprint_m * f32(FILTER_STEP);

  var light = 0.25 * own_light.rgb;
  var albedo = 0.25 * own_albedo.rgb;
  var weight_sum = 0.25;
  for (var tap = 0; tap < 9; tap++) {
    let offset = vec2i(tap % 3, tap / 3) - 1;
    let place = pixel + offset * i32(FILTER_STEP);
    if (tap == 4 || any(place < vec2i(0)) || place.x >= i32(eye.size.x) || place.y >= i32(eye.row_count)) { continue; }
    let other = first_of_slot + u32(place.y) * eye.size.x + u32(place.x);
    let other_guide = filter_guide[other];
    let other_light = filter_light[other];
    let along = other_guide.xyz - guide.xyz;
    let along_m = length(along);
    let slope = abs(dot(along, normal)) / max(along_m, 1e-20);
    let cos_normals = dot(unpack_direction(bitcast<u32>(other_guide.w)), normal);
    let other_albedo = unpack_albedo(other_light.w);
    let edge_stop = cos_normals * cos_normals * (1.0 - slope / FILTER_SLOPE_MAX) * (1.0 - abs(other_albedo.w - own_albedo.w));
    let is_alike = cos_normals >= FILTER_NORMAL_COS_MIN && slope <= FILTER_SLOPE_MAX && along_m <= reach_m;
    let weight = select(0.0, select(0.0625, 0.125, (tap & 1) == 1) * edge_stop, is_alike);
    weight_sum += weight;
    light += weight * other_light.rgb;
    albedo += weight * other_albedo.rgb;
  }
  filtered_light[slot] = vec4f(light / weight_sum, pack_albedo(vec4f(albedo / weight_sum, own_albedo.w)));
}
