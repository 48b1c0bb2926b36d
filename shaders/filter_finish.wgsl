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
  if (slot >= slots_a_pixel() * band_pixel_count() || filter_light[slot].w <= 0.0) { return; }
  let own = albedo_of(visible_points_[slot]).rgb;
  let mean = filter_albedo[slot].rgb;
  // Where none of the points that were looked at reflects a colour there is none of it to divide.
  let ratio = select(vec3f(0.0), own / max(mean, vec3f(1e-30)), mean > vec3f(1e-30));
  slot_radiance[slot] += vec4f(filter_light[slot].rgb * ratio, 0.0);
}
