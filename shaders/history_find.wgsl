//! use filter, history
// After a frame's first sample: where each pixel's surface was seen in the frame before, if its light was kept. Such pixels are lit by one
// sample only.
// Source: Shi et al. 2021, Algorithm 2, lines 5 to 12.
// Limits: see history.wgsl.

@group(1) @binding(1) var<storage, read_write> visible_points_: array<VisiblePoint>;
@group(1) @binding(2) var<storage, read_write> seen_emission: array<vec4f>;
@group(1) @binding(12) var<storage, read_write> kept_at: array<u32>;
/// Pixels whose light may be kept; those whose light was found again.
@group(1) @binding(13) var<storage, read_write> history_counts: array<atomic<u32>, 4>;

fn previous_place(band_pixel: u32) -> u32 {
  if (eye.kept_max == 0u || seen_emission[band_pixel].a != SAW_STATIC_DIFFUSE) { return NOT_KEPT; }
  let point = visible_points_[band_pixel];
  let view = affine_point(eye.previous_view_from_scene, point.position);
  if (view.z >= 0.0) { return NOT_KEPT; }
  let place = (view.xy / -view.z - eye.previous_slope_left_top) / eye.previous_slope_extent * vec2f(eye.size);
  if (any(place < vec2f(0.0)) || any(place >= vec2f(eye.size))) { return NOT_KEPT; }
  let index = u32(place.y) * eye.size.x + u32(place.x);
  if (load_previous_smooth(index).w <= 0.0) { return NOT_KEPT; }
  let guide = load_previous_guide(index);
  let normal = unpack_direction(point.packed_normal);
  let reach_m = FILTER_SPREAD_MAX * footprint_m(point.position, normal);
  let is_same = likeness(guide.xyz - point.position, normal, unpack_direction(bitcast<u32>(guide.w)), reach_m) > 0.0;
  return select(NOT_KEPT, index, is_same);
}

@compute @workgroup_size(64)
fn history_find(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
  @builtin(local_invocation_index) local: u32) {
  let band_pixel = eye_thread(group, groups, local);
  if (band_pixel >= band_pixel_count()) { return; }
  let index = previous_place(band_pixel);
  kept_at[band_pixel] = index;
  if (is_shown(band_pixel)) {
    if (seen_emission[band_pixel].a == SAW_STATIC_DIFFUSE) { atomicAdd(&history_counts[0], 1u); }
    if (index != NOT_KEPT) { atomicAdd(&history_counts[1], 1u); }
  }
}
