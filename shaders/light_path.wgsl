//! use eye, scattered_path
// What the passes share that send paths out of visible points: how many, which way, and light straight from the lights where they go.
// Source: directions by Owen-scrambled Sobol points along a Morton curve of pixels, so that what a filter averages is spread evenly
// (Ahmed and Wonka, "Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error", 2020).
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

/// Where the paths of a visible point start.
struct PathStart {
  vertex: GatheredVertex,
  throughput: vec3f,      // 0: no paths
  path_count: u32,
  first_number: u32,      // of its Sobol points
  seed: u32,
  random: Random,
}

fn path_start(slot: u32) -> PathStart {
  var start: PathStart;
  let point = visible_points_[slot];
  if (!any(point.throughput > vec3f(0.0))) { return start; }
  let band_pixel = slot % band_pixel_count();
  start.path_count = paths_at(pixel_centre_eccentricity_rad(band_pixel));
  start.throughput = point.throughput;
  start.vertex = GatheredVertex(true, point.position, unpack_direction(point.packed_geometric_normal),
                                unpack_direction(point.packed_normal), unpack_direction(point.packed_wo), bsdf_of(point));
  let pixel = vec2u(band_pixel % eye.size.x, eye.first_row + band_pixel / eye.size.x);
  let side = select(0u, 1u, slot >= band_pixel_count());
  let seeds = pcg4d(vec4u(eye.seed, eye.frame, eye.sample, 0x70617468u + side));
  start.seed = seeds.x;
  start.first_number = (spread_bits(pixel.x) | (spread_bits(pixel.y) << 1u)) * start.path_count;
  start.random = random_start(eye.seed ^ seeds.z, eye.frame, pixel.y * eye.size.x + pixel.x, 0x200u + 2u * eye.sample + side);
  return start;
}

/// What chance leaves of a weight: Russian roulette by what the surface reflects. Written so that a weight that is not a number ends
/// the path.
fn surviving(weight: vec3f, u: f32) -> vec3f {
  let survival = min(max_component(weight), 1.0);
  return select(vec3f(0.0), weight / survival, u < survival);
}
