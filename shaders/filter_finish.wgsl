//! use collected
// Gives each slot its light by its own albedo, filtered and not, and adds it to the image for as many samples as the slot has.
// Source: see filter.wgsl and collected.wgsl.
// Limits: what lies beyond an edge and has no neighbour of its kind within two pixels stays as it was found.

@group(1) @binding(7) var<storage, read_write> filter_light: array<vec4f>;
//! split image: vec4f, read_write, 1, 80

/// Light by the albedo of what reflects it, where it was averaged together with another's, `packed`.
fn by_albedo(light: vec3f, packed: f32, albedo: vec3f) -> vec3f {
  // Rounded as it was for the mean: where all albedos are alike nothing is left of the rounding.
  return light * unpack_albedo(pack_albedo(vec4f(albedo, 0.0))).rgb / unpack_albedo(packed).rgb;
}

/// The light of samples beyond the edge: that of the neighbours which lie where they lie; light that is not filtered is their own, if any of
/// them was lit.
fn light_beyond(slot: u32, first_of_slot: u32) -> vec3f {
  let shown = beyond_shown_sum[slot];
  let albedo = shown.rgb / shown.w;
  let lit = max(beyond_smooth_sum[slot].w, 1e-30);
  let guide = beyond_guide[slot];
  let normal = unpack_direction(bitcast<u32>(guide.w));
  let reach_m = 2.0 * FILTER_SPREAD_MAX * footprint_m(guide.xyz, normal);
  let pixel = vec2i(vec2u((slot - first_of_slot) % eye.size.x, (slot - first_of_slot) / eye.size.x));
  var smooth_light = vec3f(0.0);
  var sharp_light = vec3f(0.0);
  var weight_sum = 0.0;
  for (var tap = 0; tap < 25; tap++) {
    let offset = vec2i(tap % 5, tap / 5) - 2;
    let place = pixel + offset;
    if (any(place < vec2i(0)) || place.x >= i32(eye.size.x) || place.y >= i32(eye.row_count)) { continue; }
    let other = first_of_slot + u32(place.y) * eye.size.x + u32(place.x);
    let other_guide = filter_guide[other];
    let weight = likeness(other_guide.xyz - guide.xyz, normal, unpack_direction(bitcast<u32>(other_guide.w)), reach_m)
      / f32(1 + dot(offset, offset));
    // A loop, not a branch: what is out of reach holds no light.
    for (var once = 0u; once < select(0u, 1u, weight > 0.0); once++) {
      smooth_light += weight * by_albedo(filter_light[other].rgb, filter_light[other].w, albedo);
      sharp_light += weight * by_albedo(sharp_sum[other].rgb, sharp_sum[other].w, albedo);
      weight_sum += weight;
    }
  }
  let own_albedo = pack_albedo(beyond_albedo_sum[slot] / lit);
  let own_smooth = by_albedo(beyond_smooth_sum[slot].rgb / lit, own_albedo, albedo);
  let own_sharp = by_albedo(beyond_sharp_sum[slot].rgb / lit, own_albedo, albedo);
  let is_alone = weight_sum == 0.0;
  return select(smooth_light / max(weight_sum, 1e-30), own_smooth, is_alone)
    + select(sharp_light / max(weight_sum, 1e-30), own_sharp, is_alone || beyond_smooth_sum[slot].w > 0.0);
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
    let shown = shown_sum[slot];
    if (shown.w > 0.0) {
      let albedo = shown.rgb / shown.w;
      let light = filter_light[slot];
      let sharp = sharp_sum[slot];
      radiance += shown.w * (by_albedo(light.rgb, light.w, albedo) + by_albedo(sharp.rgb, sharp.w, albedo));
    }
    for (var once = 0u; once < select(0u, 1u, beyond_shown_sum[slot].w > 0.0); once++) {
      radiance += beyond_shown_sum[slot].w * light_beyond(slot, first_of_slot);
    }
  }
  let index = eye.first_row * eye.size.x + band_pixel;
  store_image(index, load_image(index) + vec4f(radiance, 0.0));
}
