//! use eye, lights
// Light straight from the lights to each visible point, by shadow rays.
// Source: resampled importance sampling (Talbot et al., EGSR 2005): of a few candidates picked by power one is kept in proportion to
// what it would bring if nothing stood between, and one shadow ray tests it.
// Limits: gathered lobes see all lights; sharp GGX sees point, spot and directional lights only, since its rays can meet the others.

/// Whether gathered lobes get direct light here (`pm-direct`) or from photons (`pm`).
override DIRECT_TO_GATHERED: bool = true;

@group(1) @binding(1) var<storage, read_write> visible_points_: array<VisiblePoint>;
@group(1) @binding(3) var<storage, read_write> slot_radiance: array<vec4f>;

fn reflected(bsdf: Bsdf, n: vec3f, wo: vec3f, wi: vec3f, light_kind: u32) -> vec3f {
  let cos_i = dot(n, wi);
  if (cos_i <= 0.0) { return vec3f(0.0); }
  var f = vec3f(0.0);
  if (DIRECT_TO_GATHERED) { f = gathered_bsdf(bsdf, n, wo, wi); }
  if (HAS_DELTA_LIGHTS && HAS_SPECULAR && light_kind != LIGHT_TRIANGLE && bsdf.alpha < GATHERED_ALPHA_MIN) { f += ggx_reflection(bsdf, n, wo, wi); }
  return f * cos_i;
}

@compute @workgroup_size(64)
fn direct_light(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
  @builtin(local_invocation_index) local: u32) {
  let slot = eye_thread(group, groups, local);
  if (slot >= slots_a_pixel() * band_pixel_count()) { return; }
  let point = visible_points_[slot];
  if (!any(point.throughput > vec3f(0.0)) || scene.light_count == 0u) { return; }
  let bsdf = bsdf_of(point);
  let n = unpack_direction(point.packed_normal);
  let geometric_normal = unpack_direction(point.packed_geometric_normal);
  let wo = unpack_direction(point.packed_wo);
  let pixel = eye.first_row * eye.size.x + slot;
  let number = (eye.frame * eye.samples.x + eye.sample) * eye.shadow_rays * eye.light_candidates;
  let seeds = pcg4d(vec4u(pixel, eye.seed, 0x6c696768u, 0u));
  var random = random_start(eye.seed ^ seeds.z, eye.frame, pixel, 0x100u + eye.sample);

  var sum = vec3f(0.0);
  for (var ray = 0u; ray < eye.shadow_rays; ray++) {
    var kept_direction = vec3f(0.0);
    var kept_distance_m = 0.0;
    var kept = vec3f(0.0);
    var kept_target = 0.0;
    var weight_sum = 0.0;
    for (var candidate = 0u; candidate < eye.light_candidates; candidate++) {
      let index = number + ray * eye.light_candidates + candidate;
      let u_pick = sobol2(index, seeds.x);
      let light = lights[pick_light(u_pick.x)];
      let light_sample = sample_light(light, point.position, sobol2(index, seeds.y));
      if (dot(light_sample.direction, geometric_normal) <= 0.0) { continue; }
      let contribution = reflected(bsdf, n, wo, light_sample.direction, light.kind) * light_sample.irradiance;
      let target_ = luminance(contribution);
      if (!(target_ > 0.0)) { continue; }
      let weight = target_ / light.pick_probability;
      weight_sum += weight;
      if (random_next4(&random).x * weight_sum < weight) {
        kept = contribution;
        kept_target = target_;
        kept_direction = light_sample.direction;
        kept_distance_m = light_sample.distance_m;
      }
    }
    if (kept_target <= 0.0) { continue; }
    let start = leave_surface(point.position, geometric_normal, kept_direction);
    // From there to the very point on the light: along the old direction the light's own surface would come up to offset/cos sooner.
    let to_light = point.position + kept_direction * kept_distance_m - start;
    let distance_m = length(to_light);
    // Stop short of the light's own surface.
    let reach_m = distance_m - 2.0 * scene.ray_offset_m - 1e-5 * distance_m;
    if (!is_occluded(start, to_light / distance_m, reach_m)) {
      sum += kept * (weight_sum / (kept_target * f32(eye.light_candidates)));
    }
  }
  slot_radiance[slot] += vec4f(point.throughput * sum / f32(eye.shadow_rays), 0.0);
}
