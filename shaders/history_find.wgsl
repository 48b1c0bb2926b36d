//! use filter, history
// After a frame's first sample: where each pixel's surface was seen in the frame before, if its light was kept. After the others: those of
// such pixels are marked as not to be lit, one is enough.
// Source: Shi et al. 2021, Algorithm 2, lines 5 to 12.
// Limits: see history.wgsl.

@group(1) @binding(1) var<storage, read_write> visible_points_: array<VisiblePoint>;
@group(1) @binding(2) var<storage, read_write> seen_emission: array<vec4f>;
@group(1) @binding(12) var<storage, read_write> kept_at: array<u32>;
/// Pixels whose light may be kept; those whose light was found again.
@group(1) @binding(13) var<storage, read_write> history_counts: array<atomic<u32>, 4>;

/// Most of a surface's reflection that may be glossy if its light is kept, since that part changes with the eye.
const GLOSSY_KEPT_MAX: f32 = 0.2;

fn is_diffuse(point: VisiblePoint) -> bool {
  let bsdf = bsdf_of(point);
  if (!any(point.throughput > vec3f(0.0)) || !any(bsdf.diffuse > vec3f(0.0))) { return false; }
  if (!gathers_reflection(bsdf)) { return true; }
  let cos_o = dot(unpack_direction(point.packed_normal), unpack_direction(point.packed_wo));
  let glossy = luminance(schlick(bsdf.f0, bsdf.f90, cos_o));
  return glossy <= GLOSSY_KEPT_MAX * (glossy + luminance(bsdf.diffuse));
}

fn previous_place(band_pixel: u32) -> u32 {
  let point = visible_points_[band_pixel];
  if (seen_emission[band_pixel].a != SAW_AT_FIRST_SIGHT || !is_diffuse(point)) { return NOT_KEPT; }
  if (eye.kept_max == 0u) { return NOT_FOUND; }
  let view = affine_point(eye.previous_view_from_scene, point.position);
  if (view.z >= 0.0) { return NOT_FOUND; }
  let place = (view.xy / -view.z - eye.previous_slope_left_top) / eye.previous_slope_extent * vec2f(eye.size);
  if (any(place < vec2f(0.0)) || any(place >= vec2f(eye.size))) { return NOT_FOUND; }
  let index = u32(place.y) * eye.size.x + u32(place.x);
  if (load_previous_smooth(index).w <= 0.0) { return NOT_FOUND; }
  let guide = load_previous_guide(index);
  let normal = unpack_direction(point.packed_normal);
  let reach_m = FILTER_SPREAD_MAX * footprint_m(point.position, normal);
  let is_same = likeness(guide.xyz - point.position, normal, unpack_direction(bitcast<u32>(guide.w)), reach_m) > 0.0;
  return select(NOT_FOUND, index, is_same);
}

/// Samples that a pixel must have kept to go without a new one.
const SAMPLES_TO_REST: f32 = 4.0;
/// Pixels that rest together: as wide as threads that go together on a GPU.
const RESTING_BLOCK = vec2u(32u, 8u);

/// Whether a pixel gets no new light in this frame: outside the fovea, blocks of pixels take turns.
fn rests(band_pixel: u32, kept_samples: f32) -> bool {
  if (pixel_centre_eccentricity_rad(band_pixel) <= eye.fovea_radius_rad || kept_samples < SAMPLES_TO_REST) { return false; }
  let block = vec2u(band_pixel % eye.size.x, eye.first_row + band_pixel / eye.size.x) / RESTING_BLOCK;
  return (block.x + 2u * block.y + eye.frame) % max(eye.refresh_frames, 1u) != 0u;
}

@compute @workgroup_size(64)
fn history_find(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
  @builtin(local_invocation_index) local: u32) {
  let band_pixel = eye_thread(group, groups, local);
  if (band_pixel >= band_pixel_count()) { return; }
  if (eye.sample > 0u) {
    if (kept_at[band_pixel] < NOT_FOUND && seen_emission[band_pixel].a == SAW_AT_FIRST_SIGHT) {
      visible_points_[band_pixel].throughput *= -1.0;
    }
    return;
  }
  let index = previous_place(band_pixel);
  kept_at[band_pixel] = index;
  if (index < NOT_FOUND && rests(band_pixel, load_previous_smooth(index).w)) { visible_points_[band_pixel].throughput *= -1.0; }
  if (is_shown(band_pixel)) {
    if (index != NOT_KEPT) { atomicAdd(&history_counts[0], 1u); }
    if (index < NOT_FOUND) { atomicAdd(&history_counts[1], 1u); }
  }
}
