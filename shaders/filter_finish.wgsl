//! use filter
// Gives each slot its filtered light by its own albedo, and adds it to the image, for as many samples as it is the mean of.
// Source: see filter.wgsl.
// Limits: what lies beyond an edge and has no neighbour of its kind within two pixels stays as it was found.

@group(1) @binding(7) var<storage, read_write> filter_light: array<vec4f>;
//! split image: vec4f, read_write, 1, 80

/// Light by the albedo of what reflects it, where it was filtered together with another's.
fn by_albedo(light: vec4f, albedo: vec4f) -> vec3f {
  // Rounded as it was for the filter: where all albedos are alike nothing is left of the rounding.
  return light.rgb * unpack_albedo(pack_albedo(albedo)).rgb / unpack_albedo(light.w).rgb;
}

/// The mean light of samples beyond the edge: that of the neighbours which lie where they lie.
fn light_beyond(slot: u32, first_of_slot: u32) -> vec3f {
  let samples = beyond_sum[slot].w;
  let guide = beyond_guide[slot];
  let albedo = beyond_albedo_sum[slot] / samples;
  let normal = unpack_direction(bitcast<u32>(guide.w));
  let footprint = footprint_m(guide.xyz, normal);
  let pixel = vec2i(vec2u((slot - first_of_slot) % eye.size.x, (slot - first_of_slot) / eye.size.x));
  var light = vec3f(0.0);
  var weight_sum = 0.0;
  for (var tap = 0; tap < 25; tap++) {
    let offset = vec2i(tap % 5, tap / 5) - 2;
    let place = pixel + offset;
    if (any(place < vec2i(0)) || place.x >= i32(eye.size.x) || place.y >= i32(eye.row_count)) { continue; }
    let other = first_of_slot + u32(place.y) * eye.size.x + u32(place.x);
    let other_guide = filter_guide[other];
    let weight = likeness(other_guide.xyz - guide.xyz, normal, unpack_direction(bitcast<u32>(other_guide.w)), 2.0 * FILTER_SPREAD_MAX * footprint)
      / f32(1 + dot(offset, offset));
    // A loop, not a branch: what is out of reach holds no light.
    for (var once = 0u; once < select(0u, 1u, weight > 0.0); once++) {
      light += weight * by_albedo(filter_light[other], albedo);
      weight_sum += weight;
    }
  }
  return select(beyond_sum[slot].rgb / samples, light / max(weight_sum, 1e-30), weight_sum > 0.0);
}

@compute @workgroup_size(64)
fn filter_finish(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
  @builtin(local_invocation_index) local: u32) {
  let band_pixel = eye_thread(group, groups, local);
  if (!is_shown(band_pixel)) { return; }
  var radiance = vec3f(0.0);
  for (var number = 0u; number < slots_a_pixel(); number++) {
    let first_of_slot = number * band_pixel_count();
    let slot = first_of_slot + band_pixel;
    let samples = smooth_sum[slot].w;
    if (samples > 0.0) { radiance += samples * by_albedo(filter_light[slot], albedo_sum[slot] / samples); }
    for (var once = 0u; once < select(0u, 1u, beyond_sum[slot].w > 0.0); once++) {
      radiance += beyond_sum[slot].w * light_beyond(slot, first_of_slot);
    }
  }
  let index = eye.first_row * eye.size.x + band_pixel;
  store_image(index, load_image(index) + vec4f(radiance, 0.0));
}
