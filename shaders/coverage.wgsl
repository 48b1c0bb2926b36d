//! use bsdf, photon_map
// Which part of a gather's disc lies on the receiver's surface, as a polygon around the receiver: cut off where a wall stands on the
// surface, and where the surface ends at an edge. Light from photons is an integral over that part, not over the disc.
// Source: ours (the foveated prototype does the like for its surface records); derivation of the share in ARCHITECTURE.md, "Gather".
// Limits: slits, holes and inlays that miss the corners of the square around the disc are not seen, nor is what lies whole between two
// rays or beyond a gap; an edge is placed to within 1/64 of the radius. Moving objects are looked at one by one, not through their tree.

/// Rays that look for walls and edges, 3 at least; 0 takes every disc for whole.
override COVERAGE_RAYS: u32 = 8;
const COVERAGE_RAYS_MAX: u32 = 32u;
/// Height of the rays that look for walls over the surface, in radii: clear of the curvature of what they start from.
const COVERAGE_HEIGHT: f32 = 0.1;
/// Halvings of the distance in which an edge is sought.
const EDGE_STEPS: u32 = 5u;

/// How far the surface is free along each coverage ray, metres and up to the disc's radius, where something cuts it.
var<private> free_m: array<f32, COVERAGE_RAYS_MAX>;
/// Corners of the free polygon of one radius, metres from the middle in the tangent plane; the first one again at the end.
var<private> free_corners: array<vec2f, COVERAGE_RAYS_MAX + 1u>;

fn coverage_ray_count() -> u32 { return max(COVERAGE_RAYS, 3u); }

/// Direction of a coverage ray in the tangent plane. The rays part the square |x| + |y| = 1 evenly, not the circle: so the two rays
/// around a photon are found without an arctangent (`is_free`).
fn coverage_direction(ray: u32) -> vec2f {
  let t = 4.0 * f32(ray % coverage_ray_count()) / f32(coverage_ray_count());
  return normalize(vec2f(abs(t - 2.0) - 1.0, max(1.0 - abs(t - 1.0), t - 4.0)));
}

/// The ray that looks through the tangent plane at `place` for what photons of this receiver may lie on.
fn probe(place: vec3f, normal: vec3f, radius_m: f32) -> Ray {
  let reach_m = photon_map.flatness * radius_m;
  return Ray(place + normal * reach_m, 2.0 * reach_m, -normal);
}

/// Whether photons that a receiver counts may lie where a probe hit, `offset_m` from it.
fn is_receiver(hit: Hit, normal: vec3f, offset_m: vec3f, radius_m: f32) -> bool {
  if (hit.triangle == NO_TRIANGLE || !stores_photons(hit_material(hit))) { return false; }
  let found_normal = hit_normal(hit);
  let cos_normals = dot(found_normal, normal);
  // Surfaces have two sides: the one that looks as the receiver does.
  return abs(cos_normals) >= photon_map.normal_cos_min && is_one_sheet(offset_m, normal, found_normal * sign(cos_normals), radius_m);
}

/// How far the surface goes on along `direction`, up to `reach_m`.
fn surface_reach_m(position: vec3f, normal: vec3f, direction: vec3f, reach_m: f32, radius_m: f32) -> f32 {
  var near_m = 0.0;
  var far_m = reach_m;
  // Just short of a wall first, since at its foot a probe would graze it.
  var place_m = 0.98 * reach_m;
  for (var step = 0u; step <= EDGE_STEPS; step++) {
    let looks = probe(position + direction * place_m, normal, radius_m);
    let hit = trace(looks, false);
    if (is_receiver(hit, normal, looks.origin + looks.direction * hit.t - position, radius_m)) {
      if (step == 0u) { return reach_m; }
      near_m = place_m;
    } else {
      far_m = place_m;
    }
    place_m = 0.5 * (near_m + far_m);
  }
  return place_m;
}

/// The square around a receiver's disc, and what was found in it.
struct Patch {
  centre: vec3f,
  axes: mat3x3f,         // two tangents and the normal
  radius_m: f32,
  corners_held: vec4<bool>,
  triangle_count: u32,
  is_cut: bool,          // a wall stands in it, or more is there than is worth looking at
}

/// Triangles of the surface that are looked at before the rays take over.
const PATCH_TRIANGLES_MAX: u32 = 24u;

fn look_at_triangle(index: u32, object: u32, square: ptr<function, Patch>) {
  var corner = load_triangle_positions(index * 3u).xyz;
  var edge1 = load_triangle_positions(index * 3u + 1u).xyz;
  var edge2 = load_triangle_positions(index * 3u + 2u).xyz;
  if (HAS_OBJECTS && object != STATIC_OBJECT) {
    corner = affine_point(objects[object].scene_from_object, corner);
    edge1 = affine_vector(objects[object].scene_from_object, edge1);
    edge2 = affine_vector(objects[object].scene_from_object, edge2);
  }
  let radius_m = (*square).radius_m;
  // In the square's own axes, radii.
  let a = (corner - (*square).centre) * (*square).axes / radius_m;
  let b = a + edge1 * (*square).axes / radius_m;
  let c = a + edge2 * (*square).axes / radius_m;
  let low = min(a, min(b, c));
  let high = max(a, max(b, c));
  if (any(low.xy > vec2f(1.0)) || any(high.xy < vec2f(-1.0))) { return; }
  let normal = normalize(cross(b - a, c - a));
  let material = hit_material(Hit(0.0, index, object));
  let is_surface = abs(normal.z) >= photon_map.normal_cos_min && stores_photons(material);
  if (!is_surface || (HAS_ALPHA && materials[material].alpha_cutoff >= 0.0)) {
    // What lies lower than the rays that look for walls is none; cut-outs are left to them.
    let is_wall = low.z <= COVERAGE_HEIGHT && high.z >= COVERAGE_HEIGHT;
    (*square).is_cut = (*square).is_cut || is_wall || is_surface;
    return;
  }
  (*square).triangle_count++;
  (*square).is_cut = (*square).is_cut || (*square).triangle_count > PATCH_TRIANGLES_MAX;
  let x = vec4f(-1.0, 1.0, -1.0, 1.0);
  let y = vec4f(-1.0, -1.0, 1.0, 1.0);
  let height = a.z - ((x - a.x) * normal.x + (y - a.y) * normal.y) / normal.z;
  // In radii, so that one is the radius; over the triangle's plane the middle lies wherever the corner is.
  let over_triangle = -dot(a, normal) * sign(normal.z);
  let is_behind = (height * over_triangle < vec4f(0.0)) & (min(abs(height), vec4f(abs(over_triangle))) > vec4f(SHEETS_APART));
  let holds = vec4f((abs(height) <= vec4f(photon_map.flatness)) & !is_behind);
  let inside = holds * corners_left_of(a, b, x, y, normal.z) * corners_left_of(b, c, x, y, normal.z)
    * corners_left_of(c, a, x, y, normal.z);
  (*square).corners_held = (*square).corners_held | (inside > vec4f(0.0));
}

/// 1 for the corners on the inner side of the edge from `p` to `q` of a triangle that turns by `side`; the edge itself counts.
fn corners_left_of(p: vec3f, q: vec3f, x: vec4f, y: vec4f, side: f32) -> vec4f {
  let edge = q.xy - p.xy;
  let area = (edge.x * (y - p.y) - edge.y * (x - p.x)) * sign(side);
  return vec4f(area >= vec4f(-1e-4 * (abs(edge.x) + abs(edge.y))));
}

/// Looks at the triangles of one mesh whose bounds meet the box around the square, given in the mesh's space.
fn look_through_mesh(header: u32, object: u32, box_min: vec3f, box_max: vec3f, square: ptr<function, Patch>) {
  let grid_min = bitcast<vec3f>(load_bvh_nodes(header * 2u).xyz);
  let steps_per_m = GRID_STEPS / bitcast<vec3f>(load_bvh_nodes(header * 2u + 1u).xyz);
  let low = (box_min - grid_min) * steps_per_m;
  let high = (box_max - grid_min) * steps_per_m;
  var stack: array<u32, STACK_ENTRIES>;
  var stack_size = 0u;
  var node = header + 1u;
  loop {
    while ((node & LEAF) == 0u) {
      let left_child = load_bvh_nodes(node * 2u);
      let right_child = load_bvh_nodes(node * 2u + 1u);
      let left_met = boxes_meet(left_child.xyz, low, high) && left_child.w != NO_NODE;
      let right_met = boxes_meet(right_child.xyz, low, high) && right_child.w != NO_NODE;
      if (left_met && right_met) { stack[stack_size] = right_child.w; stack_size++; }
      node = select(right_child.w, left_child.w, left_met);
      if (!left_met && !right_met) {
        node = NO_NODE;
        if (stack_size > 0u) { stack_size--; node = stack[stack_size]; }
      }
    }
    if (node == NO_NODE) { break; }
    let count = ((node >> 27u) & 15u) + 1u;
    let first = node & 0x7ffffffu;
    for (var i = 0u; i < count; i++) { look_at_triangle(first + i, object, square); }
    if ((*square).is_cut || stack_size == 0u) { break; }
    stack_size--;
    node = stack[stack_size];
  }
}

fn boxes_meet(packed: vec3u, low: vec3f, high: vec3f) -> bool {
  return all(vec3f(packed & vec3u(0xffffu)) <= high) && all(vec3f(packed >> vec3u(16u)) >= low);
}

/// Whether the square around a disc is more than a piece of one surface: something stands on it, or a corner of it is not there. Every
/// straight wall is told, and every straight edge with nothing beyond it; what is told wrongly costs rays, no more.
fn is_square_cut(position: vec3f, tangents: mat3x3f, radius_m: f32) -> bool {
  var square = Patch(position, tangents, radius_m, vec4<bool>(false), 0u, false);
  let height_m = max(COVERAGE_HEIGHT, photon_map.flatness) * radius_m;
  let reach = (abs(tangents[0]) + abs(tangents[1])) * radius_m + abs(tangents[2]) * height_m;
  look_through_mesh(0u, STATIC_OBJECT, position - reach, position + reach, &square);
  if (HAS_OBJECTS) {
    for (var object = 0u; object < scene.object_count && !square.is_cut; object++) {
      let rows = objects[object].object_from_scene;
      let centre = affine_point(rows, position);
      let reach_in_object = (abs(affine_vector(rows, tangents[0])) + abs(affine_vector(rows, tangents[1]))) * radius_m
        + abs(affine_vector(rows, tangents[2])) * height_m;
      look_through_mesh(objects[object].root_node, object, centre - reach_in_object, centre + reach_in_object, &square);
    }
  }
  return square.is_cut || !all(square.corners_held);
}

/// Looks for walls and edges around a receiver; where there are any, sets how far the surface is free along rays from the middle.
fn find_cut(position: vec3f, normal: vec3f, radius_m: f32) -> bool {
  if (COVERAGE_RAYS == 0u) { return false; }
  let tangents = frame_around(normal);
  let above = normal * (COVERAGE_HEIGHT * radius_m);
  let is_cut = is_square_cut(position, tangents, radius_m);
  // A loop, not a branch: software drivers leave a loop that no receiver of a group needs.
  let ray_count = select(0u, coverage_ray_count(), is_cut);
  for (var ray = 0u; ray < ray_count; ray++) {
    let along = coverage_direction(ray);
    let direction = tangents[0] * along.x + tangents[1] * along.y;
    let wall_m = trace(Ray(position + above, radius_m, direction), false).t;
    free_m[ray] = surface_reach_m(position, normal, direction, min(wall_m, radius_m), radius_m);
  }
  return is_cut;
}

/// Sets the corners of the free polygon in a disc no wider than the one that `find_cut` looked at. Returns the kernel's integral over it,
/// as a share of its integral over the whole disc.
fn set_free_polygon(radius_m: f32) -> f32 {
  // A triangle with a corner in the middle and edges a, b holds (a x b)/2 (1 - (a² + b² + a·b) / (6 r²)).
  var sum = 0.0;
  var a = vec2f(0.0);
  for (var ray = 0u; ray <= coverage_ray_count(); ray++) {
    let b = min(free_m[ray % coverage_ray_count()] / radius_m, 1.0) * coverage_direction(ray);
    sum += 0.5 * (a.x * b.y - a.y * b.x) * (1.0 - (dot(a, a) + dot(b, b) + dot(a, b)) / 6.0);
    free_corners[ray] = b * radius_m;
    a = b;
  }
  return sum / (0.5 * PI);
}

/// Whether a point of the disc lies in the free polygon.
fn is_free(offset: vec3f, tangents: mat3x3f) -> bool {
  let p = vec2f(dot(offset, tangents[0]), dot(offset, tangents[1]));
  // How far around the square the point is, 0 to 4 as in `coverage_direction`.
  let y = p.y / max(abs(p.x) + abs(p.y), 1e-30);
  let t = select(2.0 - y, select(y, 4.0 + y, y < 0.0), p.x >= 0.0);
  let ray = min(u32(t * (0.25 * f32(coverage_ray_count()))), coverage_ray_count() - 1u);
  let a = free_corners[ray];
  let edge = free_corners[ray + 1u] - a;
  return edge.x * (p.y - a.y) - edge.y * (p.x - a.x) >= 0.0;
}
