//! use light_path
// Indirect light at each visible point, by paths: a direction out of its gathered lobes, and from there on from surface to surface, with a
// shadow ray at each.
// Source: path tracing with next-event estimation; see light_path.wgsl.
// Limits: see light_path.wgsl.

/// Reflected radiance that a path brings to a surface, by the gathered lobes of that surface.
fn light_of_path(start: GatheredVertex, u: vec3f, random: ptr<function, Random>) -> vec3f {
  var light = vec3f(0.0);
  var path = ScatteredPath(Ray(vec3f(0.0), 0.0, vec3f(0.0)), vec3f(1.0), UNKNOWN_SOLID, eye.path_depth_max, !CAUSTICS_BY_PHOTONS);
  var vertex = start;
  // The first surface asks for all its paths: chance would make dark ones noisier than bright ones.
  var scatter = sample_gathered(start.bsdf, start.n, start.geometric_normal, start.wo, u);
  var weight = scatter.weight;
  while (max_component(weight) > 0.0) {
    leave_vertex(&path, vertex, scatter, weight);
    vertex = follow(&path, random, &light);
    if (!vertex.is_found) { break; }
    light += path.throughput * next_event(vertex, path.counts_caustics, random);
    path.counts_caustics = true;
    let u_next = random_next4(random);
    scatter = sample_gathered(vertex.bsdf, vertex.n, vertex.geometric_normal, vertex.wo, u_next.xyz);
    weight = surviving(scatter.weight, u_next.w);
  }
  return light;
}

@compute @workgroup_size(64)
fn path_light(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
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
