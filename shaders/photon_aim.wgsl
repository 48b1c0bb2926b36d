//! use photon_start
// Starts a batch of photon paths at the lights, towards what is specular: no others can make caustics.
// A light's rays that meet a target fill an *extent*: a solid angle around a place on the light, or an area across a directional light.
// A target is picked by importance times extent, and a ray evenly from its extent. The density of a ray adds up what all targets that it
// meets give it, so that no light counts twice where they overlap. Where a target takes more than the light's own rays do (the light lies
// within, for one), those are taken as they are.
// Source: Jensen, "Global Illumination using Photon Maps", 1996, section 2.1, for the aim; density over all ways to make one sample as in
// the balance heuristic of Veach, 1997, section 9.2.
// Limits: a sphere is a poor fit around long or flat pieces, and the rays beside them are lost.

//! size TARGET_COUNT

/// A sphere around specular surfaces (src/scene/specular_targets.rs).
struct SpecularTarget {
  center: vec3f,
  radius_m: f32,
  importance: f32,   // the share of light that they send on at most
  padding0: u32,
  padding1: u32,
  padding2: u32,
}

@group(1) @binding(4) var<storage, read> specular_targets: array<SpecularTarget>;

/// A place on a light that rays start from.
struct Source {
  position: vec3f,   // a directional light has none
  extent: f32,       // of the light's own rays, each counted as strongly as it shines
  axis: vec3f,       // unit: a triangle's normal on the side that shines, or where the light shines
  strength: vec3f,   // W over extent, along the axis
}

fn source_on(light: Light, u: vec2f) -> Source {
  if (HAS_AREA_LIGHTS && light.kind == LIGHT_TRIANGLE) {
    let b = triangle_sample(u);
    let normal = normalize(cross(light.edge1, light.edge2));
    return Source(light.position + b.x * light.edge1 + b.y * light.edge2, PI * select(1.0, 2.0, light.sides == BOTH_SIDES),
                  select(normal, -normal, light.sides == BACK_SIDE), emission_at(light, b) * light.area_m2);
  }
  var extent = 4.0 * PI;
  if (HAS_SPOT_LIGHTS && light.kind == LIGHT_SPOT) { extent = 2.0 * PI * (1.0 - light.spot_cos_outer); }
  if (HAS_DIRECTIONAL_LIGHTS && light.kind == LIGHT_DIRECTIONAL) { extent = PI * scene.bounds_radius_m * scene.bounds_radius_m; }
  return Source(light.position, extent, light.edge1, light.emission);
}

/// How strongly a ray of `light` shines, 1 along the axis.
fn shine(light: Light, axis: vec3f, direction: vec3f) -> f32 {
  let cos_angle = dot(direction, axis);
  if (HAS_AREA_LIGHTS && light.kind == LIGHT_TRIANGLE) { return max(select(cos_angle, abs(cos_angle), light.sides == BOTH_SIDES), 0.0); }
  if (HAS_SPOT_LIGHTS && light.kind == LIGHT_SPOT) { return spot_falloff(light, cos_angle); }
  return 1.0;
}

/// With what rays gain as they leave their surface, and what rounding takes.
fn reach_m(index: u32) -> f32 { return specular_targets[index].radius_m + scene.ray_offset_m; }

/// Extent of the rays that may meet a target; no more than the light's own.
fn extent_of(index: u32, light: Light, source: Source) -> f32 {
  let radius_m = reach_m(index);
  if (HAS_DIRECTIONAL_LIGHTS && light.kind == LIGHT_DIRECTIONAL) { return min(PI * radius_m * radius_m, source.extent); }
  let to_center = specular_targets[index].center - source.position;
  let distance2 = dot(to_center, to_center);
  let sin2 = radius_m * radius_m / max(distance2, 1e-30);
  if (sin2 >= 1.0) { return source.extent; }
  let cos_edge = sqrt(1.0 - sin2);
  let along_m = dot(to_center, source.axis);
  if (HAS_AREA_LIGHTS && light.kind == LIGHT_TRIANGLE && light.sides != BOTH_SIDES && along_m <= -radius_m) { return 0.0; }
  if (HAS_SPOT_LIGHTS && light.kind == LIGHT_SPOT) {
    let sin_outer = sqrt(max(0.0, 1.0 - light.spot_cos_outer * light.spot_cos_outer));
    // Beyond the sum of the two half-angles no ray is in both cones.
    if (along_m * inverseSqrt(distance2) <= light.spot_cos_outer * cos_edge - sin_outer * sqrt(sin2)) { return 0.0; }
  }
  return min(2.0 * PI * sin2 / (1.0 + cos_edge), source.extent);
}

fn meets(center: vec3f, radius_m: f32, origin: vec3f, direction: vec3f) -> bool {
  let to_center = center - origin;
  let along_m = dot(to_center, direction);
  let beside = to_center - along_m * direction;
  return along_m > 0.0 && dot(beside, beside) <= radius_m * radius_m;
}

/// A ray evenly from the extent of a target that is smaller than the light's own.
fn ray_towards(index: u32, light: Light, source: Source, extent: f32, u: vec2f) -> Emitted {
  let center = specular_targets[index].center;
  if (HAS_DIRECTIONAL_LIGHTS && light.kind == LIGHT_DIRECTIONAL) {
    let place = center + frame_around(source.axis) * vec3f(disk_sample(u) * reach_m(index), 0.0);
    let back_m = dot(place - scene.bounds_center, source.axis) + scene.bounds_radius_m;
    return Emitted(place - source.axis * back_m, source.axis, vec3f(0.0));
  }
  // 1 - cos, kept apart from the 1: narrow cones would be lost in its rounding.
  let drop = u.x * extent / (2.0 * PI);
  let side = sqrt(drop * (2.0 - drop));
  let turn = 2.0 * PI * u.y;
  let direction = normalize(frame_around(normalize(center - source.position)) * vec3f(side * cos(turn), side * sin(turn), 1.0 - drop));
  if (HAS_AREA_LIGHTS && light.kind == LIGHT_TRIANGLE) { return Emitted(leave_surface(source.position, source.axis, direction), direction, vec3f(0.0)); }
  return Emitted(source.position, direction, vec3f(0.0));
}

/// Starts a photon at `light` towards a target. It has no flux where the light's rays meet none.
fn aim_photon(light: Light, u_position: vec2f, u_direction: vec2f, u_target: f32, u_side: f32) -> Emitted {
  let source = source_on(light, u_position);
  var total = 0.0;
  for (var i = 0u; i < TARGET_COUNT; i++) { total += specular_targets[i].importance * extent_of(i, light, source); }
  var left = u_target * total;
  var picked = 0u;
  for (var i = 0u; i < TARGET_COUNT; i++) {
    let share = specular_targets[i].importance * extent_of(i, light, source);
    if (left >= 0.0 && share > 0.0) { picked = i; }
    left -= share;
  }
  let extent = extent_of(picked, light, source);
  var emitted = emit_photon(light, u_position, u_direction, u_side);
  if (extent < source.extent) { emitted = ray_towards(picked, light, source, extent, u_direction); }

  let is_directional = HAS_DIRECTIONAL_LIGHTS && light.kind == LIGHT_DIRECTIONAL;
  let origin = select(source.position, emitted.origin, is_directional);
  let strength = shine(light, source.axis, emitted.direction);
  // The density of the light's own rays, in those of a target.
  var own = 1.0;
  if (HAS_AREA_LIGHTS && light.kind == LIGHT_TRIANGLE) { own = strength; }
  if (is_directional) { own = select(0.0, 1.0, meets(scene.bounds_center, scene.bounds_radius_m, origin, emitted.direction)); }
  var density = 0.0;
  for (var i = 0u; i < TARGET_COUNT; i++) {
    let extent_here = extent_of(i, light, source);
    let is_met = i == picked || (extent_here > 0.0 && meets(specular_targets[i].center, reach_m(i), origin, emitted.direction));
    density += specular_targets[i].importance * select(select(0.0, 1.0, is_met), own, extent_here >= source.extent);
  }
  emitted.flux_w = vec3f(0.0);
  if (total > 0.0 && strength > 0.0 && density > 0.0) {
    emitted.flux_w = source.strength * (strength * total / (density * light.pick_probability));
  }
  return emitted;
}

@compute @workgroup_size(64)
fn photon_aim(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
  let index = workgroup_number(group) * 64u + local;
  if (!starts_path(index)) { return; }
  let path = tracing.first_path + index;
  let seeds = start_seeds();
  let pick = sobol2(path, seeds.x);
  let u_position = sobol2(path, seeds.y);
  let u_direction = sobol2(path, seeds.z);
  let u_side = sobol2(path, seeds.w).x;
  start_path(index, aim_photon(lights[pick_light(pick.x)], u_position, u_direction, pick.y, u_side));
}
