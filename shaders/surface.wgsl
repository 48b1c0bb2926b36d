//! use traversal, packing
// What a ray found: position, normals, texture coordinates, material. Traces past cut-out texels.
// Limits: at most 64 cut-out layers in a row.

/// How steeply a ray leaves a surface that its interpolated normal would have sent to the wrong side, as a cosine.
const GRAZING_COS = 1e-3;

struct Surface {
  position: vec3f,
  geometric_normal: vec3f,   // on the side that the ray came from
  shading_normal: vec3f,     // interpolated, on the same side: it may turn away from the ray at a silhouette
  texcoord: vec2f,
  material: u32,
  is_front: bool,            // the ray met the counter-clockwise side
}

fn hit_material(hit: Hit) -> u32 { return load_triangle_shading(hit.triangle).w & 0x7fffffffu; }

/// Unit normal of the triangle that was hit, on its counter-clockwise side.
fn hit_normal(hit: Hit) -> vec3f {
  let edge1 = load_triangle_positions(hit.triangle * 3u + 1u).xyz;
  let edge2 = load_triangle_positions(hit.triangle * 3u + 2u).xyz;
  let normal = normalize(cross(edge1, edge2));
  if (HAS_OBJECTS && hit.object != STATIC_OBJECT) { return affine_normal(objects[hit.object].object_from_scene, normal); }
  return normal;
}

/// The direction next to `direction` that only just leaves a surface on the side of `normal`.
fn grazing(direction: vec3f, normal: vec3f) -> vec3f {
  let along = direction - dot(direction, normal) * normal;
  return normalize(along * inverseSqrt(max(dot(along, along), 1e-12)) + GRAZING_COS * normal);
}

/// The normal next to `shading_normal` about which sight from `wo` is mirrored back to its own side of the real surface: about an
/// interpolated normal it may be mirrored into it, as no smooth surface does, and its light would be lost.
fn sighted_normal(shading_normal: vec3f, geometric_normal: vec3f, wo: vec3f) -> vec3f {
  let mirrored = reflect(-wo, shading_normal);
  if (dot(wo, shading_normal) > 0.0 && dot(mirrored, geometric_normal) > 0.0) { return shading_normal; }
  let half_vector = wo + grazing(mirrored, geometric_normal);
  return half_vector * inverseSqrt(max(dot(half_vector, half_vector), 1e-12));
}

fn surface_at(hit: Hit, ray: Ray) -> Surface {
  let index = hit.triangle;
  let v0 = load_triangle_positions(index * 3u).xyz;
  let edge1 = load_triangle_positions(index * 3u + 1u).xyz;
  let edge2 = load_triangle_positions(index * 3u + 2u).xyz;
  let shading = load_triangle_shading(index);
  var origin = ray.origin;
  var direction = ray.direction;
  let is_moving = HAS_OBJECTS && hit.object != STATIC_OBJECT;
  if (is_moving) {
    origin = affine_point(objects[hit.object].object_from_scene, origin);
    direction = affine_vector(objects[hit.object].object_from_scene, direction);
  }
  let p = cross(direction, edge2);
  let inverse = 1.0 / dot(edge1, p);
  let s = origin - v0;
  let b = clamp(vec2f(dot(s, p), dot(direction, cross(s, edge1))) * inverse, vec2f(0.0), vec2f(1.0));

  var surface: Surface;
  surface.position = v0 + b.x * edge1 + b.y * edge2;
  surface.geometric_normal = hit_normal(hit);
  surface.shading_normal = surface.geometric_normal;
  // The high bit of the material word says that the triangle is flat.
  surface.material = hit_material(hit);
  if ((shading.w & 0x80000000u) == 0u) {
    surface.shading_normal = normalize((1.0 - b.x - b.y) * unpack_direction(shading.x)
      + b.x * unpack_direction(shading.y) + b.y * unpack_direction(shading.z));
    if (is_moving) { surface.shading_normal = affine_normal(objects[hit.object].object_from_scene, surface.shading_normal); }
  }
  if (is_moving) { surface.position = affine_point(objects[hit.object].scene_from_object, surface.position); }
  if (HAS_TEXCOORDS) {
    let t0 = load_triangle_texcoords(index * 3u);
    let t1 = load_triangle_texcoords(index * 3u + 1u);
    let t2 = load_triangle_texcoords(index * 3u + 2u);
    surface.texcoord = (1.0 - b.x - b.y) * t0 + b.x * t1 + b.y * t2;
  }
  surface.is_front = dot(ray.direction, surface.geometric_normal) < 0.0;
  if (!surface.is_front) {
    surface.geometric_normal = -surface.geometric_normal;
    surface.shading_normal = -surface.shading_normal;
  }
  return surface;
}

fn is_cut_out(surface: Surface) -> bool {
  let material = materials[surface.material];
  if (material.alpha_cutoff < 0.0) { return false; }
  return texture_at(material.base_color_texture, surface.texcoord).a < material.alpha_cutoff;
}

/// Where a ray that leaves a surface towards `direction` starts: clear of the surface, on the side that it goes to.
fn leave_surface(position: vec3f, geometric_normal: vec3f, direction: vec3f) -> vec3f {
  let side = select(-1.0, 1.0, dot(geometric_normal, direction) >= 0.0);
  return position + geometric_normal * (side * scene.ray_offset_m);
}

/// The nearest hit that counts. `any`: some hit, not the nearest.
fn trace(first_ray: Ray, any: bool) -> Hit {
  if (!HAS_ALPHA) { return trace_geometry(first_ray, any); }
  var ray = first_ray;
  var passed_t = 0.0;
  for (var layer = 0u; layer < 64u; layer++) {
    // The nearest, even for a shadow ray: what lies before a cut-out texel must not be jumped over.
    var hit = trace_geometry(ray, false);
    if (hit.triangle == NO_TRIANGLE) { break; }
    let surface = surface_at(hit, ray);
    if (!is_cut_out(surface)) { hit.t += passed_t; return hit; }
    passed_t += hit.t;
    ray = Ray(leave_surface(surface.position, surface.geometric_normal, ray.direction), ray.t_max - hit.t, ray.direction);
  }
  return Hit(first_ray.t_max, NO_TRIANGLE, STATIC_OBJECT);
}

/// Whether something blocks the segment from `from_point` (already clear of its surface) over `distance_m` along `direction`.
fn is_occluded(from_point: vec3f, direction: vec3f, distance_m: f32) -> bool {
  return trace(Ray(from_point, distance_m, direction), true).triangle != NO_TRIANGLE;
}
