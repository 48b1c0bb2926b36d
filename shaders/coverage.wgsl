//! use bsdf, photon_map
// Which part of a gather's disc lies on the receiver's surface, as a polygon around the receiver: cut off where a wall stands on the
// surface, and where the surface ends at an edge. Light from photons is an integral over that part, not over the disc.
// Source: ours (the foveated prototype does the like for its surface records); derivation of the share in ARCHITECTURE.md, "Gather".
// Limits: what lies whole between two rays, or beyond a gap, is not told apart; an edge is placed to within 1/64 of the radius.

/// Rays that look for walls and edges, 3 at least; 0 takes every disc for whole.
override COVERAGE_RAYS: u32 = 12;
const COVERAGE_RAYS_MAX: u32 = 32u;
/// Height of the rays that look for walls over the surface, in radii: clear of the curvature of what they start from.
const COVERAGE_HEIGHT: f32 = 0.1;
/// Halvings of the distance in which an edge is sought.
const EDGE_STEPS: u32 = 5u;

/// How far the surface is free along each coverage ray, metres and up to the global radius, where something cuts the disc.
var<private> free_m: array<f32, COVERAGE_RAYS_MAX>;

fn coverage_ray_count() -> u32 { return max(COVERAGE_RAYS, 3u); }

fn coverage_angle() -> f32 { return 2.0 * PI / f32(coverage_ray_count()); }

/// The ray that looks through the tangent plane at `place` for what photons of this receiver may lie on.
fn probe(place: vec3f, normal: vec3f, radius_m: f32) -> Ray {
  let reach_m = photon_map.flatness * radius_m;
  return Ray(place + normal * reach_m, 2.0 * reach_m, -normal);
}

/// Whether photons that a receiver counts may lie where a probe hit.
fn is_receiver(hit: Hit, normal: vec3f) -> bool {
  if (hit.triangle == NO_TRIANGLE) { return false; }
  return stores_photons(hit_material(hit)) && abs(dot(hit_normal(hit), normal)) >= photon_map.normal_cos_min;
}

/// How far the surface goes on along `direction`, up to `reach_m`.
fn surface_reach_m(position: vec3f, normal: vec3f, direction: vec3f, reach_m: f32, radius_m: f32) -> f32 {
  var near_m = 0.0;
  var far_m = reach_m;
  // Just short of a wall first, since at its foot a probe would graze it.
  var place_m = 0.98 * reach_m;
  for (var step = 0u; step <= EDGE_STEPS; step++) {
    let hit = trace(probe(position + direction * place_m, normal, radius_m), false);
    if (is_receiver(hit, normal)) {
      if (step == 0u) { return reach_m; }
      near_m = place_m;
    } else {
      far_m = place_m;
    }
    place_m = 0.5 * (near_m + far_m);
  }
  return place_m;
}

/// Looks for walls and edges around a receiver: along the diagonals and at the corners of the square around the disc, which every
/// straight wall or edge that crosses the disc crosses or cuts off. If one is met, along rays from the middle.
fn find_cut(position: vec3f, normal: vec3f, radius_m: f32) -> bool {
  if (COVERAGE_RAYS == 0u) { return false; }
  let tangents = frame_around(normal);
  let above = normal * (COVERAGE_HEIGHT * radius_m);
  var is_cut = false;
  for (var test = 0u; test < 6u && !is_cut; test++) {
    let to_corner = (tangents[0] * select(-1.0, 1.0, (test & 1u) == 0u) + tangents[1] * select(-1.0, 1.0, test < 2u)) * radius_m;
    let looks_for_wall = test >= 4u;
    var ray = probe(position + to_corner, normal, radius_m);
    if (looks_for_wall) { ray = Ray(position + above + to_corner, 2.0, -to_corner); }
    let hit = trace(ray, false);
    if (looks_for_wall) { is_cut = hit.triangle != NO_TRIANGLE; } else { is_cut = !is_receiver(hit, normal); }
  }
  // A loop, not a branch: software drivers leave a loop that no receiver of a group needs.
  let ray_count = select(0u, coverage_ray_count(), is_cut);
  for (var ray = 0u; ray < ray_count; ray++) {
    let angle = coverage_angle() * f32(ray);
    let direction = tangents[0] * cos(angle) + tangents[1] * sin(angle);
    let wall_m = trace(Ray(position + above, radius_m, direction), false).t;
    free_m[ray] = surface_reach_m(position, normal, direction, min(wall_m, radius_m), radius_m);
  }
  return is_cut;
}

/// The kernel's integral over the free polygon, as a share of its integral over the whole disc. `radius_m` is at most the one that
/// the polygon was found for.
fn covered_share(radius_m: f32) -> f32 {
  // A triangle with a corner in the middle and edges a, b at angle w holds sin(w)/2 |a||b| (1 - (a² + b² + ab cos(w)) / (6 r²)).
  let w = coverage_angle();
  var sum = 0.0;
  for (var ray = 0u; ray < coverage_ray_count(); ray++) {
    let a = min(free_m[ray] / radius_m, 1.0);
    let b = min(free_m[(ray + 1u) % coverage_ray_count()] / radius_m, 1.0);
    sum += 0.5 * sin(w) * a * b * (1.0 - (a * a + b * b + a * b * cos(w)) / 6.0);
  }
  return sum / (0.5 * PI);
}

/// Whether a point of the disc lies in the free polygon.
fn is_free(offset: vec3f, tangents: mat3x3f, radius_m: f32) -> bool {
  let p = vec2f(dot(offset, tangents[0]), dot(offset, tangents[1]));
  let w = coverage_angle();
  let turn = atan2(p.y, p.x) / w;
  let ray = u32(floor(select(turn, turn + f32(coverage_ray_count()), turn < 0.0))) % coverage_ray_count();
  let a = min(free_m[ray], radius_m) * vec2f(cos(w * f32(ray)), sin(w * f32(ray)));
  let b = min(free_m[(ray + 1u) % coverage_ray_count()], radius_m) * vec2f(cos(w * f32(ray + 1u)), sin(w * f32(ray + 1u)));
  let edge = b - a;
  return edge.x * (p.y - a.y) - edge.y * (p.x - a.x) >= 0.0;
}
