//! use collected
// The mean light of each slot's samples, with the mean albedo, where the filter starts from.
// Source: see filter.wgsl.
// Limits: none of its own.

@group(1) @binding(7) var<storage, read_write> filter_light: array<vec4f>;

@compute @workgroup_size(64)
fn filter_prepare(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
  @builtin(local_invocation_index) local: u32) {
  let slot = eye_thread(group, groups, local);
  if (slot >= slots_a_pixel() * band_pixel_count()) { return; }
  let sum = smooth_sum[slot];
  if (sum.w == 0.0) {
    filter_guide[slot] = vec4f(OUT_OF_REACH);
    return;
  }
  let albedo = pack_albedo(albedo_sum[slot] / sum.w);
  filter_light[slot] = vec4f(sum.rgb / sum.w, albedo);
  sharp_sum[slot] = vec4f(sharp_sum[slot].rgb / sum.w, albedo);
}
