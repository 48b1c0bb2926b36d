//! use filter
// One level of the edge-avoiding filter: a 3x3 B-spline whose taps lie `FILTER_STEP` pixels apart.
// Source: Dammertz et al. 2010, equations 2 to 6, with weights of normal, plane and lobe in place of depth; see filter.wgsl. Nine taps in
// place of 25 and one level more: as wide, at half the cost.
// Limits: none of its own.

/// Pixels between two taps: 1, 2, 4, ...
override FILTER_STEP: u32 = 1u;

/// Mean radiance to the eye, and the packed mean albedo by which it was reflected, with the share of the glossy lobe in it.
@group(1) @binding(7) var<storage, read_write> filter_light: array<vec4f>;
@group(1) @binding(8) var<storage, read_write> filtered_light: array<vec4f>;

@compute @workgroup_size(64)
fn filter_level(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
  @builtin(local_invocation_index) local: u32) {
  let slot = eye_thread(group, groups, local);
  if (slot >= slots_a_pixel() * band_pixel_count()) { return; }
  let guide = filter_guide[slot];
  let own_light = filter_light[slot];
  if (guide.x == OUT_OF_REACH) { return; }
  let own_albedo = unpack_albedo(own_light.w);
  let first_of_slot = select(0u, band_pixel_count(), slot >= band_pixel_count());
  let pixel = vec2i(vec2u((slot - first_of_slot) % eye.size.x, (slot - first_of_slot) / eye.size.x));
  let normal = unpack_direction(bitcast<u32>(guide.w));
  let reach_m = FILTER_SPREAD_MAX * footprint_m(guide.xyz, normal) * f32(FILTER_STEP);

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
    let other_albedo = unpack_albedo(other_light.w);
    let edge_stop = likeness(other_guide.xyz - guide.xyz, normal, unpack_direction(bitcast<u32>(other_guide.w)), reach_m)
      * (1.0 - abs(other_albedo.w - own_albedo.w));
    let weight = select(0.0625, 0.125, (tap & 1) == 1) * edge_stop;
    weight_sum += weight;
    light += weight * other_light.rgb;
    albedo += weight * other_albedo.rgb;
  }
  filtered_light[slot] = vec4f(light / weight_sum, pack_albedo(vec4f(albedo / weight_sum, own_albedo.w)));
}
