//! use scene
// Rays against the scene: a software BVH2 in two levels. The static part is one mesh; moving objects are found through a small tree
// over their bounds, and each is traversed with the ray in its own space.
// Source: ordered while-while traversal with a private stack, nodes and triangles in textures (Aila and Laine, HPG 2009; figures in
// ARCHITECTURE.md, "Measured");
// triangles after Möller and Trumbore, 1997.
// Limits: the stack holds as many entries as the deepest of the scene's trees has levels (src/scene/gpu_scene.rs); edges are widened
// by 1e-6 of the triangle, so that rays don't slip between neighbours.
//! size STACK_ENTRIES

override HAS_ALPHA: bool = true;

struct Ray { origin: vec3f, t_max: f32, direction: vec3f }

struct Hit {
  t: f32,
  triangle: u32,   // NO_TRIANGLE: nothing was hit
  object: u32,     // STATIC_OBJECT, or index into `objects`
}

const NO_TRIANGLE: u32 = 0xffffffffu;
const STATIC_OBJECT: u32 = 0xffffffffu;
const NO_NODE: u32 = 0xffffffffu;
const LEAF: u32 = 0x80000000u;
const EDGE: f32 = 1e-6;
// Steps a side of the grid on which a mesh's bounds lie (`BoundsGrid` in src/scene/gpu_geometry.rs).
const GRID_STEPS: f32 = 65535.0;

fn safe_inverse(d: vec3f) -> vec3f {
  return 1.0 / select(d, vec3f(1e-12), abs(d) < vec3f(1e-12));
}

fn hit_triangle(index: u32, ray: Ray, object: u32, best: ptr<function, Hit>) {
  let v0 = load_triangle_positions(index * 3u).xyz;
  let edge1 = load_triangle_positions(index * 3u + 1u).xyz;
  let edge2 = load_triangle_positions(index * 3u + 2u).xyz;
  let p = cross(ray.direction, edge2);
  let inverse = 1.0 / dot(edge1, p);
  let s = ray.origin - v0;
  let u = dot(s, p) * inverse;
  let q = cross(s, edge1);
  let v = dot(ray.direction, q) * inverse;
  let t = dot(edge2, q) * inverse;
  if (u >= -EDGE && v >= -EDGE && u + v <= 1.0 + EDGE && t > 0.0 && t < (*best).t) {
    (*best) = Hit(t, index, object);
  }
}

/// Where a ray is inside a child's bounds: entry and exit, in units of the ray, as the bits of floats. Entry is never negative, and
/// non-negative floats are ordered as their bits; an exit before the ray's start has its sign bit set, however it came about. Integer
/// minima have no NaN to look after: on a CPU they are one instruction in place of three.
fn box_interval(packed: vec3u, step: vec3f, start: vec3f, t_max: f32) -> vec2i {
  let low = bitcast<vec3i>(vec3f(packed & vec3u(0xffffu)) * step + start);
  let high = bitcast<vec3i>(vec3f(packed >> vec3u(16u)) * step + start);
  let near = min(low, high);
  let far = max(low, high);
  return vec2i(max(max(near.x, near.y), max(near.z, 0)),
               min(min(far.x, far.y), min(far.z, bitcast<i32>(t_max))));
}

/// Shrinks `best` to the nearest hit of one mesh's tree; with `any` it stops at the first.
fn traverse_mesh(header: u32, ray: Ray, object: u32, any: bool, best: ptr<function, Hit>) {
  let inverse = safe_inverse(ray.direction);
  let grid_min = bitcast<vec3f>(load_bvh_nodes(header * 2u).xyz);
  let grid_extent = bitcast<vec3f>(load_bvh_nodes(header * 2u + 1u).xyz);
  let step = grid_extent * inverse * (1.0 / GRID_STEPS);
  let start = (grid_min - ray.origin) * inverse;
  var stack_node: array<u32, STACK_ENTRIES>;
  var stack_t: array<f32, STACK_ENTRIES>;
  var stack_size = 0u;
  var node = header + 1u;
  loop {
    // Down to a leaf. Rays of one group wait for each other here, so that they test their triangles together.
    while ((node & LEAF) == 0u) {
      let left_child = load_bvh_nodes(node * 2u);
      let right_child = load_bvh_nodes(node * 2u + 1u);
      let left = box_interval(left_child.xyz, step, start, (*best).t);
      let right = box_interval(right_child.xyz, step, start, (*best).t);
      let left_hit = left.x <= left.y && left_child.w != NO_NODE;
      let right_hit = right.x <= right.y && right_child.w != NO_NODE;
      let right_first = right_hit && (!left_hit || right.x < left.x);
      if (left_hit && right_hit) {
        stack_node[stack_size] = select(right_child.w, left_child.w, right_first);
        stack_t[stack_size] = bitcast<f32>(select(right.x, left.x, right_first));
        stack_size++;
      }
      node = select(left_child.w, right_child.w, right_first);
      if (!left_hit && !right_hit) {
        node = NO_NODE;
        while (stack_size > 0u) {
          stack_size--;
          if (stack_t[stack_size] < (*best).t) { node = stack_node[stack_size]; break; }
        }
      }
    }
    if (node == NO_NODE) { break; }
    let count = ((node >> 27u) & 15u) + 1u;
    let first = node & 0x7ffffffu;
    for (var i = 0u; i < count; i++) { hit_triangle(first + i, ray, object, best); }
    if (any && (*best).triangle != NO_TRIANGLE) { break; }
    node = NO_NODE;
    while (stack_size > 0u) {
      stack_size--;
      if (stack_t[stack_size] < (*best).t) { node = stack_node[stack_size]; break; }
    }
    if (node == NO_NODE) { break; }
  }
}

fn box_is_hit(lower: vec3f, upper: vec3f, origin: vec3f, inverse: vec3f, t_max: f32) -> bool {
  let a = lower * inverse - origin;
  let b = upper * inverse - origin;
  let near = min(a, b);
  let far = max(a, b);
  return max(max(near.x, near.y), max(near.z, 0.0)) <= min(min(far.x, far.y), min(far.z, t_max));
}

fn trace_geometry(ray: Ray, any: bool) -> Hit {
  var best = Hit(ray.t_max, NO_TRIANGLE, STATIC_OBJECT);
  if (!HAS_OBJECTS) {
    traverse_mesh(0u, ray, STATIC_OBJECT, any, &best);
    return best;
  }
  let inverse = safe_inverse(ray.direction);
  let origin = ray.origin * inverse;
  // One loop holds the one copy of the mesh traversal: the static mesh first, then the objects whose bounds the ray meets.
  var stack: array<u32, 32>;
  var stack_size = 0u;
  if (scene.object_count > 0u) { stack[0] = 0u; stack_size = 1u; }
  var object = STATIC_OBJECT;
  var root = 0u;
  var object_ray = ray;
  loop {
    traverse_mesh(root, object_ray, object, any, &best);
    if (any && best.triangle != NO_TRIANGLE) { return best; }
    var found = false;
    while (stack_size > 0u && !found) {
      stack_size--;
      let entry = stack[stack_size];
      if ((entry & LEAF) != 0u) {
        object = entry & 0x7ffffffu;
        found = true;
      } else {
        for (var child = 0u; child < 2u; child++) {
          let lower = object_nodes[entry * 4u + child * 2u];
          let upper = object_nodes[entry * 4u + child * 2u + 1u];
          let reference = bitcast<u32>(lower.w);
          if (reference != NO_NODE && box_is_hit(lower.xyz, upper.xyz, origin, inverse, best.t)) {
            stack[stack_size] = reference;
            stack_size++;
          }
        }
      }
    }
    if (!found) { break; }
    root = objects[object].root_node;
    // The direction keeps its length in scene space, so that t means the same in both spaces.
    object_ray = Ray(affine_point(objects[object].object_from_scene, ray.origin), best.t,
                     affine_vector(objects[object].object_from_scene, ray.direction));
  }
  return best;
}
