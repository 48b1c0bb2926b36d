//! use filter
// Gives each visible point its filtered light by its own albedo, beside the light that was not filtered.
// Source: see filter.wgsl.
// Limits: none of its own.

@group(1) @binding(1) var<storage, read_write> visible_points_: array<VisiblePoint>;
@group(1) @binding(3) var<storage, read_write> slot_radiance: array<vec4f>;

@compute @workgroup_size(64)
fn filter_finish(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
  @builtin(local_invocation_index) local: u32) {
  let slot = eye_thread(group, groups, local);
  if (slot >= slots_a_pixel() * band_pixel_count() || filter_guide[slot].x == OUT_OF_REACH) { return; }
  // Rounded as it was for the filter: where all albedos are alike nothing is left of the rounding.
  let own = unpack_albedo(pack_albedo(albedo_of(visible_points_[slot])));
  let light = filter_light[slot];
  slot_radiance[slot] += vec4f(light.rgb * own.rgb / unpack_albedo(light.w).rgb, 0.0);
}
