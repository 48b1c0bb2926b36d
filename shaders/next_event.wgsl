//! use lights
// Light straight from the lights to a surface, one of several candidates tested by one shadow ray.
// Source: resampled importance sampling (Talbot et al., EGSR 2005): of a few candidates one is kept in proportion to what it would bring
// if nothing stood between, times how much more or less likely shadows make its light: or else a bright lamp behind a wall, once among
// the candidates, would always be kept.
// Limits: gathered lobes see all lights; sharp GGX sees point, spot and directional lights only, since its rays can meet the others.

/// Whether gathered lobes get direct light here (`pm-direct`) or from photons (`pm`).
override DIRECT_TO_GATHERED: bool = true;

/// `counts_highlights`: whether sharp lobes show lights without extent.
fn reflected_from_light(bsdf: Bsdf, n: vec3f, wo: vec3f, wi: vec3f, light_kind: u32, counts_highlights: bool) -> vec3f {
  let cos_i = dot(n, wi);
  if (cos_i <= 0.0) { return vec3f(0.0); }
  var f = vec3f(0.0);
  if (DIRECT_TO_GATHERED) { f = gathered_bsdf(bsdf, n, wo, wi); }
  let is_delta_light = HAS_DELTA_LIGHTS && light_kind != LIGHT_TRIANGLE;
  if (is_delta_light && counts_highlights && HAS_SPECULAR && bsdf.alpha < GATHERED_ALPHA_MIN) { f += ggx_reflection(bsdf, n, wo, wi); }
  return f * cos_i;
}

/// The candidate kept so far.
struct LightChoice {
  contribution: vec3f,   // reflected radiance if nothing stands between, over the density of the sample on the light
  target_: f32,
  direction: vec3f,
  distance_m: f32,
  weight_sum: f32,       // of all candidates looked at
}

/// Looks at one more candidate.
fn consider_light(choice: ptr<function, LightChoice>, light: Light, light_sample: LightSample, contribution: vec3f, u: f32) {
  let target_ = luminance(contribution) * light.pick_probability / light.unshadowed_probability;
  if (!(target_ > 0.0)) { return; }
  let weight = target_ / light.pick_probability;
  (*choice).weight_sum += weight;
  if (u * (*choice).weight_sum < weight) {
    (*choice).contribution = contribution;
    (*choice).target_ = target_;
    (*choice).direction = light_sample.direction;
    (*choice).distance_m = light_sample.distance_m;
  }
}

/// What the kept candidate brings by the shadow ray, as an estimate for all lights.
fn light_of_choice(choice: LightChoice, candidates: u32, position: vec3f, geometric_normal: vec3f) -> vec3f {
  if (choice.target_ <= 0.0) { return vec3f(0.0); }
  let start = leave_surface(position, geometric_normal, choice.direction);
  // From there to the very point on the light: along the old direction the light's own surface would come up to offset/cos sooner.
  let to_light = position + choice.direction * choice.distance_m - start;
  let distance_m = length(to_light);
  // Stop short of the light's own surface.
  let reach_m = distance_m - 2.0 * scene.ray_offset_m - 1e-5 * distance_m;
  if (is_occluded(start, to_light / distance_m, reach_m)) { return vec3f(0.0); }
  return choice.contribution * (choice.weight_sum / (choice.target_ * f32(candidates)));
}
