//! use filter
// One level of the edge-avoiding filter: a 5x5 B-spline whose taps lie `FILTER_STEP` pixels apart.
// Source: Dammertz et al. 2010, equations 2 to 6, with weights of normal, plane and lobe in place of depth; see filter.wgsl.
// Limits: none of its own.

/// Pixels between two taps: 1, 2, 4, ...
override FILTER_STEP: u32 = 1u;

@group(1) @binding(7) var<storage, read_write> filtered_light: array<vec4f>;
@group(1) @binding(8) var<storage, read_write> filtered_albedo: array<vec4f>;

@compute @workgroup_size(64)
fn filter_level(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
  @builtin(local_invocation_index) local: u32) {
  let slot = eye_thread(group, groups, local);
  if (slot >= slots_a_pixel() * band_pixel_count()) { return; }
  let share = filter_albedo[slot].w;
  if (share == NO_POINT) {
    filtered_light[slot] = vec4f(0.0);
    filtered_albedo[slot] = vec4f(0.0, 0.0, 0.0, NO_POINT);
    return;
  }
  let first_of_slot = select(0u, band_pixel_count(), slot >= band_pixel_count());
  let pixel = vec2i(vec2u((slot - first_of_slot) % eye.size.x, (slot - first_of_slot) / eye.size.x));
  let guide = filter_guide[slot];
  let normal = unpack_direction(bitcast<u32>(guide.w));
  let to_eye = vec3f(eye.scene_from_view[0].w, eye.scene_from_view[1].w, eye.scene_from_view[2].w) - guide.xyz;
  let distance_m = length(to_eye);
  let cos_view = max(abs(dot(to_eye, normal)) / max(distance_m, 1e-20), 0.05);
  let footprint_m = distance_m * max(abs(eye.slope_extent.x) / f32(eye.size.x), abs(eye.slope_extent.y) / f32(eye.size.y)) / cos_view;

  var light = vec3f(0.0);
  var albedo = vec3f(0.0);
  var weight_sum = 0.0;
  var known_sum = 0.0;
  for (var tap = 0; tap < 25; tap++) {
    let offset = vec2i(tap % 5, tap / 5) - 2;
    let place = pixel + offset * i32(FILTER_STEP);
    if (any(place < vec2i(0)) || place.x >= i32(eye.size.x) || place.y >= i32(eye.row_count)) { continue; }
    let other = first_of_slot + u32(place.y) * eye.size.x + u32(place.x);
    let other_albedo = filter_albedo[other];
    let other_light = filter_light[other];
    let other_guide = filter_guide[other];
    let along = other_guide.xyz - guide.xyz;
    let along_m = length(along);
    let reach_m = FILTER_SPREAD_MAX * footprint_m * f32(FILTER_STEP) * max(length(vec2f(offset)), 0.5);
    let cos_normals = dot(unpack_direction(bitcast<u32>(other_guide.w)), normal);
    let slope = abs(dot(along, normal)) / max(along_m, 1e-20);
    let is_alike = cos_normals >= FILTER_NORMAL_COS_MIN && slope <= FILTER_SLOPE_MAX && along_m <= reach_m && other_albedo.w != NO_POINT;
    let b_spline = vec3f(0.375, 0.25, 0.0625);
    let kernel = b_spline[abs(offset.x)] * b_spline[abs(offset.y)];
    let edge_stop = cos_normals * cos_normals * (1.0 - slope / FILTER_SLOPE_MAX) * max(1.0 - abs(other_albedo.w - share), 0.0);
    let weight = select(0.0, kernel * edge_stop, is_alike || all(offset == vec2i(0)));
    weight_sum += weight;
    known_sum += weight * other_light.w;
    light += weight * other_light.w * other_light.rgb;
    albedo += weight * other_light.w * other_albedo.rgb;
  }
  let known = max(known_sum, 1e-30);
  filtered_light[slot] = vec4f(light / known, known_sum / max(weight_sum, 1e-30));
  filtered_albedo[slot] = vec4f(albedo / known, share);
}
