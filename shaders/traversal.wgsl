//! use scene
// Rays against the scene: a software BVH2 in two levels. The static part is one mesh; moving objects are found through a small tree
// over their bounds, and each is traversed with the ray in its own space.
// Source: ordered traversal with a private stack (figures in ARCHITECTURE.md, "Traversal"); triangles after Möller and Trumbore, 1997.
// Limits: stack of 64 entries, which src/scene/bvh.rs guarantees; edges are widened by 1e-6 of the triangle, so that rays don't slip
// between neighbours.

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

/// Shrinks `best` to the nearest hit of one mesh's tree; with `any` it stops at the first.
fn traverse_mesh(root: u32, ray: Ray, object: u32, any: bool, best: ptr<function, Hit>) {
  let inverse = safe_inverse(ray.direction);
  let origin = ray.origin * inverse;
  var stack_node: array<u32, 64>;
  var stack_t: array<f32, 64>;
  var stack_size = 0u;
  var node = root;
  loop {
    let left0 = load_bvh_nodes(node * 4u);
    let left1 = load_bvh_nodes(node * 4u + 1u);
    let right0 = load_bvh_nodes(node * 4u + 2u);
    let right1 = load_bvh_nodes(node * 4u + 3u);
    let la = left0.xyz * inverse - origin;
    let lb = left1.xyz * inverse - origin;
    let ra = right0.xyz * inverse - origin;
    let rb = right1.xyz * inverse - origin;
    let lmin = min(la, lb); let lmax = max(la, lb);
    let rmin = min(ra, rb); let rmax = max(ra, rb);
    let left_t = max(max(lmin.x, lmin.y), max(lmin.z, 0.0));
    let right_t = max(max(rmin.x, rmin.y), max(rmin.z, 0.0));
    var left_hit = left_t <= min(min(lmax.x, lmax.y), min(lmax.z, (*best).t));
    var right_hit = right_t <= min(min(rmax.x, rmax.y), min(rmax.z, (*best).t));
    let left = bitcast<u32>(left0.w);
    let right = bitcast<u32>(right0.w);
    if (left_hit && (left & LEAF) != 0u) {
      left_hit = false;
      if (left != NO_NODE) {
        let count = ((left >> 27u) & 15u) + 1u;
        for (var i = 0u; i < count; i++) { hit_triangle((left & 0x7ffffffu) + i, ray, object, best); }
      }
    }
    if (right_hit && (right & LEAF) != 0u) {
      right_hit = false;
      if (right != NO_NODE) {
        let count = ((right >> 27u) & 15u) + 1u;
        for (var i = 0u; i < count; i++) { hit_triangle((right & 0x7ffffffu) + i, ray, object, best); }
      }
    }
    if (any && (*best).triangle != NO_TRIANGLE) { return; }
    if (left_hit && right_hit) {
      let right_first = right_t < left_t;
      stack_node[stack_size] = select(right, left, right_first);
      stack_t[stack_size] = select(right_t, left_t, right_first);
      stack_size++;
      node = select(left, right, right_first);
    } else if (left_hit) {
      node = left;
    } else if (right_hit) {
      node = right;
    } else {
      var found = false;
      while (stack_size > 0u) {
        stack_size--;
        if (stack_t[stack_size] < (*best).t) { node = stack_node[stack_size]; found = true; break; }
      }
      if (!found) { return; }
    }
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
