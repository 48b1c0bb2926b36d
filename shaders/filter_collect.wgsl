//! use collected
// Adds one sample of each visible point to what was collected, on its side of the edge where one crosses the pixel.
// Source: demodulation as in Dammertz et al. 2010, section 3; see filter.wgsl.
// Limits: the albedo is that of the direction to the eye; it need not be exact, as the filter divides by what it multiplies with.

@group(1) @binding(1) var<storage, read_write> visible_points_: array<VisiblePoint>;
@group(1) @binding(3) var<storage, read_write> slot_radiance: array<vec4f>;
@group(1) @binding(7) var<storage, read_write> smooth_radiance: array<vec4f>;

fn is_on(guide: vec4f, point: VisiblePoint, normal: vec3f) -> bool {
  let reach_m = FILTER_SPREAD_MAX * footprint_m(guide.xyz, normal);
  return likeness(point.position - guide.xyz, unpack_direction(bitcast<u32>(guide.w)), normal, reach_m) > 0.0;
}

@compute @workgroup_size(64)
fn filter_collect(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
  @builtin(local_invocation_index) local: u32) {
  let slot = eye_thread(group, groups, local);
  if (slot >= slots_a_pixel() * band_pixel_count()) { return; }
  let point = visible_points_[slot];
  if (!any(point.throughput != vec3f(0.0))) { return; }
  let normal = unpack_direction(point.packed_normal);
  let bsdf = bsdf_of(point);
  var glossy = vec3f(0.0);
  if (gathers_reflection(bsdf)) { glossy = schlick(bsdf.f0, bsdf.f90, dot(normal, unpack_direction(point.packed_wo))); }
  let reflected = bsdf.diffuse + glossy;
  let share = luminance(glossy) / max(luminance(reflected), 1e-6);
  let albedo = vec4f(min(abs(point.throughput) * reflected, vec3f(1.0)), share);
  let guide = vec4f(point.position, bitcast<f32>(point.packed_normal));
  let lit = select(0.0, 1.0, any(point.throughput > vec3f(0.0)));
  let smooth_light = lit * vec4f(smooth_radiance[slot].rgb, 1.0);
  let sharp_light = lit * vec4f(slot_radiance[slot].rgb, 0.0);
  let shown = vec4f(albedo.rgb, 1.0);
  let shown_before = shown_sum[slot];
  if (shown_before.w == 0.0 || is_on(filter_guide[slot], point, normal)) {
    if (shown_before.w == 0.0) { filter_guide[slot] = guide; }
    shown_sum[slot] = shown_before + shown;
    smooth_sum[slot] += smooth_light;
    albedo_sum[slot] += lit * albedo;
    sharp_sum[slot] += sharp_light;
    return;
  }
  let beyond_before = beyond_shown_sum[slot];
  if (beyond_before.w == 0.0) { beyond_guide[slot] = guide; }
  beyond_shown_sum[slot] = beyond_before + shown;
  beyond_smooth_sum[slot] += smooth_light;
  beyond_albedo_sum[slot] += lit * albedo;
  beyond_sharp_sum[slot] += sharp_light;
}
