//! use surface
// Lights: point, spot, directional, and emissive triangles. One table, picked from by the alias method, by power and by what each light
// brings to where the eye looks (src/scene/light_importance.rs).
// Units: W/sr (point, spot), W/m2 (directional), W/(m2 sr) (triangles).
// Source: KHR_lights_punctual's reference falloff; alias method after Vose, 1991; built by src/scene/light_table.rs.

override HAS_AREA_LIGHTS: bool = true;
override HAS_POINT_LIGHTS: bool = true;
override HAS_SPOT_LIGHTS: bool = true;
override HAS_DIRECTIONAL_LIGHTS: bool = true;

struct Light {
  position: vec3f,          // triangle: first corner
  kind: u32,
  edge1: vec3f,             // triangle; else the direction that a spot or directional light shines in
  alias_share: f32,
  edge2: vec3f,
  alias_index: u32,
  emission: vec3f,
  pick_probability: f32,
  spot_scale: f32,          // falloff = clamp(cos * scale + offset)^2
  spot_offset: f32,
  spot_cos_outer: f32,
  area_m2: f32,
  triangle: u32,            // for the texture coordinates of an emission texture
  emission_texture: i32,    // or -1
  sides: u32,               // that shine
  unshadowed_probability: f32,   // of picking it if nothing stood between lights and what the eye looks at
}
const LIGHT_POINT: u32 = 0u;
const LIGHT_SPOT: u32 = 1u;
const LIGHT_DIRECTIONAL: u32 = 2u;
const LIGHT_TRIANGLE: u32 = 3u;
// Sides of a triangle that shine, by the turn of its edges in the scene; the front is one: 0.
const BOTH_SIDES: u32 = 1u;
const BACK_SIDE: u32 = 2u;

@group(0) @binding(6) var<storage, read> lights: array<Light>;

fn pick_light(u: f32) -> u32 {
  let scaled = u * f32(scene.light_count);
  let slot = min(u32(scaled), scene.light_count - 1u);
  return select(lights[slot].alias_index, slot, scaled - f32(slot) < lights[slot].alias_share);
}

fn spot_falloff(light: Light, cos_angle: f32) -> f32 {
  let f = clamp(cos_angle * light.spot_scale + light.spot_offset, 0.0, 1.0);
  return f * f;
}

fn triangle_sample(u: vec2f) -> vec2f {
  let s = sqrt(u.x);
  return vec2f(1.0 - s, u.y * s);
}

fn emission_at(light: Light, b: vec2f) -> vec3f {
  if (!HAS_EMISSION_TEXTURES || light.emission_texture < 0) { return light.emission; }
  let t0 = load_triangle_texcoords(light.triangle * 3u);
  let t1 = load_triangle_texcoords(light.triangle * 3u + 1u);
  let t2 = load_triangle_texcoords(light.triangle * 3u + 2u);
  return light.emission * texture_at(light.emission_texture, (1.0 - b.x - b.y) * t0 + b.x * t1 + b.y * t2).rgb;
}

struct LightSample {
  direction: vec3f,      // unit, from the lit point
  distance_m: f32,
  irradiance: vec3f,     // W/m2 on a plane that faces the light, over the density of the sample on the light
}

/// One sample of `light` seen from `point`, without visibility.
fn sample_light(light: Light, point: vec3f, u: vec2f) -> LightSample {
  if (HAS_DIRECTIONAL_LIGHTS && light.kind == LIGHT_DIRECTIONAL) {
    return LightSample(-light.edge1, 4.0 * scene.bounds_radius_m, light.emission);
  }
  if (HAS_AREA_LIGHTS && light.kind == LIGHT_TRIANGLE) {
    let b = triangle_sample(u);
    let to_light = light.position + b.x * light.edge1 + b.y * light.edge2 - point;
    let distance2 = dot(to_light, to_light);
    let distance_m = sqrt(distance2);
    let direction = to_light / max(distance_m, 1e-20);
    var cos_light = -dot(direction, normalize(cross(light.edge1, light.edge2)));
    if (light.sides == BOTH_SIDES) { cos_light = abs(cos_light); }
    if (light.sides == BACK_SIDE) { cos_light = -cos_light; }
    let irradiance = emission_at(light, b) * (max(cos_light, 0.0) * light.area_m2 / max(distance2, 1e-20));
    return LightSample(direction, distance_m, irradiance);
  }
  if (!HAS_POINT_LIGHTS && !HAS_SPOT_LIGHTS) { return LightSample(vec3f(0.0, 0.0, 1.0), 1.0, vec3f(0.0)); }
  let to_light = light.position - point;
  let distance2 = max(dot(to_light, to_light), 1e-20);
  let direction = to_light * inverseSqrt(distance2);
  var irradiance = light.emission / distance2;
  if (HAS_SPOT_LIGHTS && light.kind == LIGHT_SPOT) { irradiance *= spot_falloff(light, -dot(direction, light.edge1)); }
  return LightSample(direction, sqrt(distance2), irradiance);
}

struct Emitted {
  origin: vec3f,
  direction: vec3f,
  flux_w: vec3f,     // power that the photon stands for, if it were the only one
}

/// Starts a photon at `light`.
fn emit_photon(light: Light, u_position: vec2f, u_direction: vec2f, u_side: f32) -> Emitted {
  let weight = 1.0 / light.pick_probability;
  if (HAS_AREA_LIGHTS && light.kind == LIGHT_TRIANGLE) {
    let b = triangle_sample(u_position);
    var normal = normalize(cross(light.edge1, light.edge2));
    var sides = 1.0;
    if (light.sides == BOTH_SIDES) { sides = 2.0; normal *= select(-1.0, 1.0, u_side < 0.5); }
    if (light.sides == BACK_SIDE) { normal = -normal; }
    let direction = frame_around(normal) * cosine_hemisphere_sample(u_direction);
    let position = light.position + b.x * light.edge1 + b.y * light.edge2;
    return Emitted(leave_surface(position, normal, direction), direction,
                   emission_at(light, b) * (PI * light.area_m2 * sides * weight));
  }
  if (HAS_DIRECTIONAL_LIGHTS && light.kind == LIGHT_DIRECTIONAL) {
    let frame = frame_around(light.edge1);
    let p = disk_sample(u_position) * scene.bounds_radius_m;
    let origin = scene.bounds_center + frame[0] * p.x + frame[1] * p.y - light.edge1 * scene.bounds_radius_m;
    return Emitted(origin, light.edge1, light.emission * (PI * scene.bounds_radius_m * scene.bounds_radius_m * weight));
  }
  if (HAS_SPOT_LIGHTS && light.kind == LIGHT_SPOT) {
    let local = cap_sample(u_direction, light.spot_cos_outer);
    let solid_angle = 2.0 * PI * (1.0 - light.spot_cos_outer);
    return Emitted(light.position, frame_around(light.edge1) * local,
                   light.emission * (spot_falloff(light, local.z) * solid_angle * weight));
  }
  return Emitted(light.position, cap_sample(u_direction, -1.0), light.emission * (4.0 * PI * weight));
}
