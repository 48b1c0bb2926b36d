//! use eye, next_event
// Light straight from the lights to each visible point, by shadow rays.
// Source: see next_event.wgsl; candidates by Owen-scrambled Sobol points.
// Limits: see next_event.wgsl.

@group(1) @binding(1) var<storage, read_write> visible_points_: array<VisiblePoint>;
@group(1) @binding(3) var<storage, read_write> slot_radiance: array<vec4f>;

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
    var choice: LightChoice;
    for (var candidate = 0u; candidate < eye.light_candidates; candidate++) {
      let index = number + ray * eye.light_candidates + candidate;
      let light = lights[pick_light(sobol2(index, seeds.x).x)];
      let light_sample = sample_light(light, point.position, sobol2(index, seeds.y));
      if (dot(light_sample.direction, geometric_normal) <= 0.0) { continue; }
      let contribution = reflected_from_light(bsdf, n, wo, light_sample.direction, light.kind, true) * light_sample.irradiance;
      consider_light(&choice, light, light_sample, contribution, random_next4(&random).x);
    }
    sum += light_of_choice(choice, eye.light_candidates, point.position, geometric_normal);
  }
  slot_radiance[slot] += vec4f(point.throughput * sum / f32(eye.shadow_rays), 0.0);
}
