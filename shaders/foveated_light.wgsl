//! use light_path, records
// Indirect light at each visible point of the focus region: paths out of it that end at the first diffuse surface they meet, in what
// photons bring there.
// Source: foveated photon mapping (Shi et al. 2021), section 3.1, by the estimator of final gathering (Jensen 1996), which converges
// where the printed one does not; Eq. 2 for the share of the region. See records.wgsl.
// Limits: glossy lobes and surfaces without a record near go on as paths, as does light straight from the lights.

/// Reflected radiance that a path brings to a surface, by the gathered lobes of that surface.
fn light_of_path(start: GatheredVertex, u: vec3f, random: ptr<function, Random>) -> vec3f {
  var light = vec3f(0.0);
  var path = ScatteredPath(Ray(vec3f(0.0), 0.0, vec3f(0.0)), vec3f(1.0), UNKNOWN_SOLID, eye.path_depth_max, !CAUSTICS_BY_PHOTONS);
  var vertex = start;
  var scatter = sample_gathered(start.bsdf, start.n, start.geometric_normal, start.wo, u);
  var weight = scatter.weight;
  while (max_component(weight) > 0.0) {
    leave_vertex(&path, vertex, scatter, weight);
    vertex = follow(&path, random, &light);
    if (!vertex.is_found) { break; }
    light += path.throughput * next_event(vertex, path.counts_caustics, random);
    path.counts_caustics = true;
    let u_record = random_next4(random);
    let record = find_record(vertex.position, vertex.geometric_normal, u_record.xy);
    if (record.is_found) {
      light += path.throughput * lambert(vertex.bsdf, vertex.n, vertex.wo, record.direction) * record.irradiance;
      vertex.bsdf.diffuse = vec3f(0.0);
    }
    let u_next = random_next4(random);
    scatter = sample_gathered(vertex.bsdf, vertex.n, vertex.geometric_normal, vertex.wo, u_next.xyz);
    weight = surviving(scatter.weight, u_next.w);
  }
  return light;
}

@compute @workgroup_size(64)
fn foveated_light(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
  @builtin(local_invocation_index) local: u32) {
  let slot = eye_thread(group, groups, local);
  if (slot >= slots_a_pixel() * band_pixel_count()) { return; }
  let start = path_start(slot);
  var random = start.random;
  var sum = vec3f(0.0);
  for (var path = 0u; path < start.path_count; path++) {
    let u = vec3f(sobol2(start.first_number + path, start.seed), random_next4(&random).x);
    sum += light_of_path(start.vertex, u, &random);
  }
  if (start.path_count > 0u) { slot_radiance[slot] += vec4f(start.throughput * sum / f32(start.path_count), 0.0); }
}
