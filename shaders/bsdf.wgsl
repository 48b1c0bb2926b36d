//! use surface
// How a surface scatters light: the glTF 2.0 metallic-roughness model with KHR specular, ior, transmission and volume.
// Lobes: Lambert (base colour / pi, under the coat's 1 - F), GGX reflection (alpha = roughness^2, separable Smith, Schlick), and
// smooth or rough refraction with the exact unpolarised Fresnel term.
// Source: glTF 2.0 Appendix B and the extensions' texts; visible normals after Heitz, JCGT 7(4), 2018; rough refraction after
// Walter et al., EGSR 2007.
// A lobe is either *gathered* (its reflected light is estimated where it is seen: Lambert, and GGX that is rough enough) or *traced*
// (a ray follows it: mirrors, refraction, and sharp GGX), never both, so that no light is counted twice.
// Limits: single scattering; a thin-walled transmission passes straight on.

// What the scene calls for (src/scene/effects.rs); the rest is not compiled.
override HAS_SPECULAR: bool = true;
override HAS_ROUGH: bool = true;
override HAS_TRANSMISSION: bool = true;
override HAS_ABSORPTION: bool = true;
override HAS_BASE_COLOR_TEXTURES: bool = true;
override HAS_METALLIC_ROUGHNESS_TEXTURES: bool = true;
/// GGX lobes with an alpha from here on are gathered, sharper ones are traced.
override GATHERED_ALPHA_MIN: f32 = 0.2;
/// Below this alpha a reflection is a mirror's: one direction.
const MIRROR_ALPHA_MAX: f32 = 1e-3;

struct Bsdf {
  diffuse: vec3f,        // albedo of the Lambert lobe, before the coat takes its share
  alpha: f32,
  f0: vec3f,             // Schlick at normal incidence, metal and coat mixed
  f90: f32,
  coat_f0: vec3f,        // the coat alone: what it reflects does not reach the Lambert lobe
  coat_f90: f32,         // negative: an interface is in the coat's place, with minus this for its far side's index over the near one's
  transmission: vec3f,   // tint of what passes through
  ior: f32,
  emission: vec3f,       // W/(m2 sr) towards the ray that came
  is_solid: bool,
  absorption: vec3f,     // 1/m, inside
}

fn bsdf_at(surface: Surface) -> Bsdf {
  let material = materials[surface.material];
  var base = material.base_color;
  var metallic = material.metallic;
  var roughness = material.roughness;
  var emission = material.emission;
  if (HAS_BASE_COLOR_TEXTURES) { base *= texture_at(material.base_color_texture, surface.texcoord).rgb; }
  if (HAS_METALLIC_ROUGHNESS_TEXTURES) {
    let metallic_roughness = texture_at(material.metallic_roughness_texture, surface.texcoord);
    roughness *= metallic_roughness.g;
    metallic *= metallic_roughness.b;
  }
  if (HAS_EMISSION_TEXTURES && material.emission_texture >= 0) {
    emission *= texture_at(material.emission_texture, surface.texcoord).rgb;
  }
  let is_double_sided = (material.flags & MATERIAL_DOUBLE_SIDED) != 0u;
  var bsdf: Bsdf;
  bsdf.emission = select(vec3f(0.0), emission, surface.is_front || is_double_sided);
  bsdf.diffuse = base * (1.0 - metallic);
  if (HAS_SPECULAR) {
    let r = (material.ior - 1.0) / (material.ior + 1.0);
    bsdf.coat_f0 = min(vec3f(r * r) * material.specular_color, vec3f(1.0)) * material.specular_factor;
    bsdf.coat_f90 = material.specular_factor;
    bsdf.f0 = mix(bsdf.coat_f0, base, metallic);
    bsdf.f90 = mix(bsdf.coat_f90, 1.0, metallic);
    bsdf.alpha = roughness * roughness;
  }
  if (HAS_TRANSMISSION && material.transmission > 0.0 && metallic < 1.0) {
    bsdf.transmission = base * ((1.0 - metallic) * material.transmission);
    bsdf.diffuse *= 1.0 - material.transmission;
    bsdf.ior = material.ior;
    bsdf.is_solid = (material.flags & MATERIAL_SOLID) != 0u;
    bsdf.absorption = material.absorption;
    bsdf.coat_f0 = vec3f(0.0);
    bsdf.coat_f90 = -select(material.ior, select(1.0 / material.ior, material.ior, surface.is_front), bsdf.is_solid);
  }
  return bsdf;
}

fn transmits(bsdf: Bsdf) -> bool { return HAS_TRANSMISSION && any(bsdf.transmission > vec3f(0.0)); }

fn reflects(bsdf: Bsdf) -> bool { return HAS_SPECULAR && (bsdf.f90 > 0.0 || any(bsdf.f0 > vec3f(0.0))); }

fn gathers_reflection(bsdf: Bsdf) -> bool { return HAS_ROUGH && reflects(bsdf) && bsdf.alpha >= GATHERED_ALPHA_MIN && !transmits(bsdf); }

/// Whether photons are stored on a material, wherever on it: by its factors, as a texture that is black in places must not thin them
/// out there, or estimates across its edges would be too dark.
fn stores_photons(material: u32) -> bool {
  let m = materials[material];
  let may_be_dielectric = m.metallic < 1.0 || m.metallic_roughness_texture >= 0;
  let has_lambert = any(m.base_color > vec3f(0.0)) && may_be_dielectric && m.transmission < 1.0;
  // A texture makes a lobe sharper only.
  let has_rough_reflection = HAS_ROUGH && m.roughness * m.roughness >= GATHERED_ALPHA_MIN
    && (m.transmission == 0.0 || m.metallic == 1.0) && (m.metallic > 0.0 || m.specular_factor > 0.0);
  return has_lambert || has_rough_reflection;
}

/// The normal about which a surface scatters what is seen from `wo`. One that reflects diffusely keeps its own, so that it looks alike to
/// both eyes; the flat one takes its place where it turns away.
fn scattering_normal(surface: Surface, bsdf: Bsdf, wo: vec3f) -> vec3f {
  if (HAS_SPECULAR && !any(bsdf.diffuse > vec3f(0.0))) { return sighted_normal(surface.shading_normal, surface.geometric_normal, wo); }
  return select(surface.geometric_normal, surface.shading_normal, dot(wo, surface.shading_normal) > 0.0);
}

fn schlick(f0: vec3f, f90: f32, cos_theta: f32) -> vec3f {
  let m = clamp(1.0 - cos_theta, 0.0, 1.0);
  let m2 = m * m;
  return f0 + (vec3f(f90) - f0) * (m2 * m2 * m);
}

/// Unpolarised reflectance of a dielectric for light that meets it at `cos_i` from the side with relative index `eta` = n_t / n_i.
fn fresnel_dielectric(cos_i: f32, eta: f32) -> f32 {
  // Not by the sines: at an index of 1 grazing light would be reflected by rounding.
  let cos2_t = (eta * eta - 1.0 + cos_i * cos_i) / (eta * eta);
  if (cos2_t <= 0.0) { return 1.0; }
  let cos_t = sqrt(cos2_t);
  let parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
  let perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
  return 0.5 * (parallel * parallel + perpendicular * perpendicular);
}

fn smith_g1(cos_theta: f32, alpha: f32) -> f32 {
  let c2 = cos_theta * cos_theta;
  return 2.0 * cos_theta / (cos_theta + sqrt(alpha * alpha * (1.0 - c2) + c2));
}

fn ggx_distribution(cos_h: f32, alpha: f32) -> f32 {
  // 1 - c2 is left out of a difference of near-equal numbers: at a small alpha it would lose the peak.
  let a2 = alpha * alpha;
  let d = cos_h * cos_h * (a2 - 1.0) + 1.0;
  return a2 / (PI * d * d);
}

/// GGX reflection with the Fresnel term, 1/sr; `wi`, `wo` away from the surface, both on the normal's side.
fn ggx_reflection(bsdf: Bsdf, n: vec3f, wo: vec3f, wi: vec3f) -> vec3f {
  let cos_o = dot(n, wo);
  let cos_i = dot(n, wi);
  if (cos_o <= 0.0 || cos_i <= 0.0 || !HAS_ROUGH || bsdf.alpha < MIRROR_ALPHA_MAX) { return vec3f(0.0); }
  let h = normalize(wo + wi);
  let d = ggx_distribution(min(dot(n, h), 1.0), bsdf.alpha);
  let g = smith_g1(cos_o, bsdf.alpha) * smith_g1(cos_i, bsdf.alpha);
  return schlick(bsdf.f0, bsdf.f90, dot(wo, h)) * (d * g / (4.0 * cos_o * cos_i));
}

/// Lambert under the coat, 1/sr, or under an interface, which light passes twice: alike both ways, and none where all is reflected.
fn lambert(bsdf: Bsdf, n: vec3f, wo: vec3f, wi: vec3f) -> vec3f {
  if (!HAS_SPECULAR) { return bsdf.diffuse / PI; }
  if (HAS_TRANSMISSION && bsdf.coat_f90 < 0.0) {
    let eta = -bsdf.coat_f90;
    return bsdf.diffuse * ((1.0 - fresnel_dielectric(dot(n, wo), eta)) * (1.0 - fresnel_dielectric(dot(n, wi), eta)) / PI);
  }
  let h = normalize(wo + wi);
  return bsdf.diffuse * ((1.0 - max_component(schlick(bsdf.coat_f0, bsdf.coat_f90, dot(wo, h)))) / PI);
}

/// The gathered lobes' BSDF, 1/sr.
fn gathered_bsdf(bsdf: Bsdf, n: vec3f, wo: vec3f, wi: vec3f) -> vec3f {
  var f = lambert(bsdf, n, wo, wi);
  if (gathers_reflection(bsdf)) { f += ggx_reflection(bsdf, n, wo, wi); }
  return f;
}

/// A half vector among those visible from `wo`, in the frame of the normal.
fn visible_normal_sample(wo: vec3f, alpha: f32, u: vec2f) -> vec3f {
  let v = normalize(vec3f(alpha * wo.x, alpha * wo.y, wo.z));
  let length2 = v.x * v.x + v.y * v.y;
  let t1 = select(vec3f(1.0, 0.0, 0.0), vec3f(-v.y, v.x, 0.0) * inverseSqrt(max(length2, 1e-30)), length2 > 1e-12);
  let t2 = cross(v, t1);
  let p = disk_sample(u);
  let s = 0.5 * (1.0 + v.z);
  let y = (1.0 - s) * sqrt(max(0.0, 1.0 - p.x * p.x)) + s * p.y;
  let z = sqrt(max(0.0, 1.0 - p.x * p.x - y * y));
  let h = p.x * t1 + y * t2 + z * v;
  return normalize(vec3f(alpha * h.x, alpha * h.y, max(1e-6, h.z)));
}

struct Scatter {
  direction: vec3f,
  weight: vec3f,          // BSDF times cosine over density; zero: absorbed
  is_refracted: bool,     // passed to the other side
}

const ABSORBED: Scatter = Scatter(vec3f(0.0), vec3f(0.0), false);

/// What is left of a scattering at the real surface. An interpolated normal may tilt a reflection through an opaque wall, and it ends
/// there; what would be refracted back goes on along the far side.
fn at_real_surface(scatter: Scatter, geometric_normal: vec3f) -> Scatter {
  if ((dot(scatter.direction, geometric_normal) < 0.0) == scatter.is_refracted) { return scatter; }
  if (!scatter.is_refracted) { return ABSORBED; }
  return Scatter(grazing(scatter.direction, -geometric_normal), scatter.weight, true);
}

/// The half vector about which a lobe of sharpness `alpha` reflects or refracts, in scene space.
fn half_vector_sample(n: vec3f, wo: vec3f, alpha: f32, u: vec2f) -> vec3f {
  if (!HAS_ROUGH || alpha < MIRROR_ALPHA_MAX) { return n; }
  let frame = frame_around(n);
  return frame * visible_normal_sample(wo * frame, alpha, u);
}

fn masking(n: vec3f, wi: vec3f, alpha: f32) -> f32 {
  if (!HAS_ROUGH || alpha < MIRROR_ALPHA_MAX) { return 1.0; }
  return smith_g1(max(dot(n, wi), 1e-6), alpha);
}

/// Follows the GGX lobe of a metal or a coat.
fn sample_reflection(bsdf: Bsdf, n: vec3f, wo: vec3f, u: vec2f) -> Scatter {
  let h = half_vector_sample(n, wo, bsdf.alpha, u);
  let wi = reflect(-wo, h);
  if (dot(wi, n) <= 0.0) { return ABSORBED; }
  return Scatter(wi, schlick(bsdf.f0, bsdf.f90, dot(wo, h)) * masking(n, wi, bsdf.alpha), false);
}

/// n_t / n_i for light (or sight) that meets the surface from the side of `surface`'s normals.
fn relative_ior(bsdf: Bsdf, is_front: bool) -> f32 {
  if (!bsdf.is_solid) { return 1.0; }
  return select(1.0 / bsdf.ior, bsdf.ior, is_front);
}

/// Share of light that a dielectric interface reflects at half vector cosine `cos_h`. A thin wall has the reflectance of its ior too.
fn interface_reflectance(bsdf: Bsdf, is_front: bool, cos_h: f32) -> f32 {
  let eta = select(bsdf.ior, select(1.0 / bsdf.ior, bsdf.ior, is_front), bsdf.is_solid);
  return fresnel_dielectric(cos_h, eta);
}

/// Follows what a dielectric interface lets through, given the half vector; flux-weighted (no eta^2, see `radiance_scale`).
fn refract_through(bsdf: Bsdf, n: vec3f, h: vec3f, wo: vec3f, is_front: bool) -> Scatter {
  var wi = -wo;
  if (bsdf.is_solid) {
    let eta = relative_ior(bsdf, is_front);
    let cos_h = dot(wo, h);
    let cos2_t = (eta * eta - 1.0 + cos_h * cos_h) / (eta * eta);
    if (cos2_t <= 0.0) { return ABSORBED; }
    wi = normalize(-wo / eta + h * (cos_h / eta - sqrt(cos2_t)));
    if (dot(wi, n) >= 0.0) { return ABSORBED; }
  }
  return Scatter(wi, bsdf.transmission * masking(-n, wi, bsdf.alpha), true);
}

/// Radiance along an eye path shrinks by (n_i/n_t)^2 where the path enters a denser medium; photons carry flux and need no factor.
fn radiance_scale(bsdf: Bsdf, is_front: bool) -> f32 {
  let eta = relative_ior(bsdf, is_front);
  return 1.0 / (eta * eta);
}
