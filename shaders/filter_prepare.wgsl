//! use filter
// Lays out what the filter looks at: light, albedo and guides of each visible point.
// Source: demodulation as in Dammertz et al. 2010, section 3; see filter.wgsl.
// Limits: the albedo is that of the direction to the eye; it need not be exact, as the filter divides by what it multiplies with.

@group(1) @binding(1) var<storage, read_write> visible_points_: array<VisiblePoint>;
@group(1) @binding(3) var<storage, read_write> smooth_radiance: array<vec4f>;

@compute @workgroup_size(64)
fn filter_prepare(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
  @builtin(local_invocation_index) local: u32) {
  let slot = eye_thread(group, groups, local);
  if (slot >= slots_a_pixel() * band_pixel_count()) { return; }
  let point = visible_points_[slot];
  if (!any(point.throughput > vec3f(0.0))) {
    filter_guide[slot] = vec4f(OUT_OF_REACH);
    return;
  }
  filter_light[slot] = vec4f(smooth_radiance[slot].rgb, pack_albedo(albedo_of(point)));
  filter_guide[slot] = vec4f(point.position, bitcast<f32>(point.packed_normal));
}
