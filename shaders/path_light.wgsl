//! use eye, scattered_path
// Indirect light at each visible point, by paths: a direction out of its gathered lobes, and from there on from surface to surface, with a
// shadow ray at each.
// Source: path tracing with next-event estimation; directions by Owen-scrambled Sobol points along a Morton curve of pixels, so that what
// a filter averages is spread evenly (Ahmed and Wonka, "Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error", 2020).
// Limits: `path_depth_max` surfaces a path.

@group(1) @binding(1) var<storage, read_write> visible_points_: array<VisiblePoint>;
@group(1) @binding(3) var<storage, read_write> slot_radiance: array<vec4f>;

fn paths_at(e_rad: f32) -> u32 {
  if (e_rad <= eye.fovea_radius_rad) { return eye.paths.x; }
  if (e_rad <= eye.transition_radius_rad) { return eye.paths.y; }
  return eye.paths.z;
}

/// Every other bit of a number below 2^16.
fn spread_bits(number: u32) -> u32 {
  var bits = number & 0xffffu;
  bits = (bits | (bits << 8u)) & 0x00ff00ffu;
  bits = (bits | (bits << 4u)) & 0x0f0f0f0fu;
  bits = (bits | (bits << 2u)) & 0x33333333u;
  return (bits | (bits << 1u)) & 0x55555555u;
}

/// Light straight from the lights that a vertex reflects, by one shadow ray.
fn next_event(vertex: GatheredVertex, counts_highlights: bool, random: ptr<function, Random>) -> vec3f {
  if (scene.light_count == 0u) { return vec3f(0.0); }
  var choice: LightChoice;
  for (var candidate = 0u; candidate < eye.light_candidates; candidate++) {
    let u = random_next4(random);
    let light = lights[pick_light(u.x)];
    let light_sample = sample_light(light, vertex.position, u.yz);
    if (dot(light_sample.direction, vertex.geometric_normal) <= 0.0) { continue; }
    let reflected = reflected_from_light(vertex.bsdf, vertex.n, vertex.wo, light_sample.direction, light.kind, counts_highlights);
    consider_light(&choice, light, light_sample, reflected * light_sample.irradiance, u.w);
  }
  return light_of_choice(choice, eye.light_candidates, vertex.position, vertex.geometric_normal);
}

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
    // Russian roulette by what the surface reflects; written so that a weight that is not a number ends the path.
    let survival = min(max_component(scatter.weight), 1.0);
    weight = select(vec3f(0.0), scatter.weight / survival, u_next.w < survival);
  }
  return light;
}

@compute @workgroup_size(64)
fn path_light(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
  @builtin(local_invocation_index) local: u32) {
  let slot = eye_thread(group, groups, local);
  if (slot >= slots_a_pixel() * band_pixel_count()) { return; }
  let point = visible_points_[slot];
  if (!any(point.throughput > vec3f(0.0))) { return; }
  let band_pixel = slot % band_pixel_count();
  let path_count = paths_at(pixel_centre_eccentricity_rad(band_pixel));
  let start = GatheredVertex(true, point.position, unpack_direction(point.packed_geometric_normal), unpack_direction(point.packed_normal),
                             unpack_direction(point.packed_wo), bsdf_of(point));
  let pixel = vec2u(band_pixel % eye.size.x, eye.first_row + band_pixel / eye.size.x);
  let side = select(0u, 1u, slot >= band_pixel_count());
  let seeds = pcg4d(vec4u(eye.seed, eye.frame, eye.sample, 0x70617468u + side));
  var random = random_start(eye.seed ^ seeds.z, eye.frame, pixel.y * eye.size.x + pixel.x, 0x200u + 2u * eye.sample + side);
  var sum = vec3f(0.0);
  for (var path = 0u; path < path_count; path++) {
    let number = (spread_bits(pixel.x) | (spread_bits(pixel.y) << 1u)) * path_count + path;
    let u = vec3f(sobol2(number, seeds.x), random_next4(&random).x);
    sum += light_of_path(start, u, &random);
  }
  if (path_count > 0u) { slot_radiance[slot] += vec4f(point.throughput * sum / f32(path_count), 0.0); }
}
