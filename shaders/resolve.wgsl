//! use eye
// Adds one sample of every pixel of the band to the image: rgb radiance sums, W/(m2 sr), and in the fourth channel their count.

/// The light of visible points comes later, by the filter (filter_finish.wgsl): here is what was seen shining.
override COLLECTS_LIGHT: bool = false;

@group(1) @binding(2) var<storage, read_write> seen_emission: array<vec4f>;
@group(1) @binding(3) var<storage, read_write> slot_radiance: array<vec4f>;
//! split image: vec4f, read_write, 1, 80

@compute @workgroup_size(64)
fn resolve(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
  @builtin(local_invocation_index) local: u32) {
  let band_pixel = eye_thread(group, groups, local);
  if (!is_shown(band_pixel)) { return; }
  let seen = seen_emission[band_pixel];
  var radiance = seen.rgb;
  for (var slot = 0u; slot < select(slots_a_pixel(), 0u, COLLECTS_LIGHT); slot++) { radiance += slot_radiance[band_pixel + slot * band_pixel_count()].rgb; }
  let index = eye.first_row * eye.size.x + band_pixel;
  store_image(index, load_image(index) + select(vec4f(0.0), vec4f(radiance, 1.0), seen.a > 0.0));
}
