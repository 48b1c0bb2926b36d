//! use filter, history
// Before the filter: adds to each pixel's samples those that were kept for it, and keeps the sum for the frame that follows. No more than
// `kept_max` are kept: all fade alike, so that the oldest count least.
// Source: Shi et al. 2021, Algorithm 2; see history.wgsl.
// Limits: see history.wgsl.

@group(1) @binding(8) var<storage, read_write> sharp_sum: array<vec4f>;
@group(1) @binding(12) var<storage, read_write> kept_at: array<u32>;
/// In the third place: samples that are kept in all.
@group(1) @binding(13) var<storage, read_write> history_counts: array<atomic<u32>, 4>;
//! split next_smooth: vec4f, read_write, 1, 160
//! split next_sharp: vec4f, read_write, 1, 176
//! split next_albedo: vec4f, read_write, 1, 192
//! split next_guide: vec4f, read_write, 1, 208

@compute @workgroup_size(64)
fn history_join(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
  @builtin(local_invocation_index) local: u32) {
  let band_pixel = eye_thread(group, groups, local);
  if (band_pixel >= band_pixel_count()) { return; }
  let kept = kept_at[band_pixel];
  var light = smooth_sum[band_pixel];
  var sharp = sharp_sum[band_pixel];
  var albedo = albedo_sum[band_pixel];
  if (kept < NOT_FOUND) {
    let previous = load_previous_smooth(kept);
    let scale = min(1.0, f32(eye.kept_max) / previous.w);
    light += scale * previous;
    sharp += scale * load_previous_sharp(kept);
    albedo += scale * load_previous_albedo(kept);
    smooth_sum[band_pixel] = light;
    sharp_sum[band_pixel] = sharp;
    albedo_sum[band_pixel] = albedo;
  }
  if (!is_shown(band_pixel)) { return; }
  let index = eye.first_row * eye.size.x + band_pixel;
  let is_kept = kept != NOT_KEPT && light.w > 0.0;
  store_next_smooth(index, select(vec4f(0.0), light, is_kept));
  store_next_sharp(index, sharp);
  store_next_albedo(index, albedo);
  store_next_guide(index, filter_guide[band_pixel]);
  if (is_kept) { atomicAdd(&history_counts[2], u32(light.w + 0.5)); }
}
