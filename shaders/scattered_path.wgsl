//! use random, next_event
// Paths that light takes between surfaces, followed backwards: out of a gathered lobe, through mirrors and glass to the next surface
// whose reflected light is gathered.
// Source: path tracing with next-event estimation (Kajiya 1986; Veach 1997, chapter 10), with the lobes parted as in bsdf.wgsl.
// Limits: where a path could go several ways it takes one by chance.

/// A light that a path meets by way of mirrors, glass or sharp lobes, before any gathered one, is a caustic on the surface that the path
/// left; true: photons bring it, paths leave it out.
override CAUSTICS_BY_PHOTONS: bool = false;

const NO_SOLID: u32 = 0xffffffffu;
/// The path may have started inside a solid: nobody knows yet.
const UNKNOWN_SOLID: u32 = 0xfffffffeu;

struct ScatteredPath {
  ray: Ray,
  throughput: vec3f,
  solid: u32,              // material of the solid that the path is in
  surfaces_left: u32,
  counts_caustics: bool,   // light met by way of traced lobes counts
}

/// The next surface of a path whose reflected light is gathered.
struct GatheredVertex {
  is_found: bool,
  position: vec3f,
  geometric_normal: vec3f,
  n: vec3f,
  wo: vec3f,
  bsdf: Bsdf,
}

/// A direction out of the gathered lobes of a surface, with what it lets through: BSDF times cosine over density.
fn sample_gathered(bsdf: Bsdf, n: vec3f, geometric_normal: vec3f, wo: vec3f, u: vec3f) -> Scatter {
  let cos_o = dot(n, wo);
  if (cos_o <= 0.0) { return ABSORBED; }
  var glossy_share = 0.0;
  if (gathers_reflection(bsdf)) {
    let glossy = luminance(schlick(bsdf.f0, bsdf.f90, cos_o));
    glossy_share = glossy / max(glossy + luminance(bsdf.diffuse), 1e-20);
  }
  var wi = vec3f(0.0);
  if (u.z < glossy_share) {
    wi = reflect(-wo, half_vector_sample(n, wo, bsdf.alpha, u.xy));
  } else {
    wi = frame_around(n) * cosine_hemisphere_sample(u.xy);
  }
  let cos_i = dot(n, wi);
  if (cos_i <= 0.0 || dot(wi, geometric_normal) <= 0.0) { return ABSORBED; }
  var density = (1.0 - glossy_share) * cos_i / PI;
  if (glossy_share > 0.0) {
    let h = normalize(wo + wi);
    density += glossy_share * smith_g1(cos_o, bsdf.alpha) * ggx_distribution(min(dot(n, h), 1.0), bsdf.alpha) / (4.0 * cos_o);
  }
  return Scatter(wi, gathered_bsdf(bsdf, n, wo, wi) * (cos_i / max(density, 1e-20)), false);
}

/// Follows a path to the next surface that it is gathered at; `seen` gets the light that it meets on the way.
fn follow(path: ptr<function, ScatteredPath>, random: ptr<function, Random>, seen: ptr<function, vec3f>) -> GatheredVertex {
  var vertex: GatheredVertex;
  var came_by_traced_lobe = false;
  while ((*path).surfaces_left > 0u) {
    (*path).surfaces_left--;
    let hit = trace((*path).ray, false);
    if (hit.triangle == NO_TRIANGLE) { break; }
    let surface = surface_at(hit, (*path).ray);
    let bsdf = bsdf_at(surface);
    let wo = -(*path).ray.direction;
    let n = scattering_normal(surface, bsdf, wo);
    if (HAS_ABSORPTION) {
      // What is left by its inner side was inside.
      let is_left = (*path).solid == UNKNOWN_SOLID && !surface.is_front && transmits(bsdf) && bsdf.is_solid;
      let solid = select((*path).solid, surface.material, is_left);
      if (solid < UNKNOWN_SOLID) { (*path).throughput *= exp(-materials[solid].absorption * hit.t); }
    }
    if (came_by_traced_lobe && (*path).counts_caustics) { (*seen) += (*path).throughput * bsdf.emission; }

    let u = random_next4(random);
    let is_interface = transmits(bsdf);
    let h = half_vector_sample(n, wo, bsdf.alpha, u.xy);
    // How much each way is likely to bring: gathered here, reflected, refracted.
    var likelihood = vec3f(luminance(bsdf.diffuse), 0.0, 0.0);
    var reflectance = 0.0;
    if (is_interface) {
      reflectance = interface_reflectance(bsdf, surface.is_front, dot(wo, h));
      likelihood = vec3f(luminance(bsdf.diffuse) * (1.0 - reflectance), reflectance, (1.0 - reflectance) * luminance(bsdf.transmission));
    } else if (reflects(bsdf)) {
      let reflected = luminance(schlick(bsdf.f0, bsdf.f90, dot(wo, n)));
      if (gathers_reflection(bsdf)) { likelihood.x += reflected; } else {
        likelihood.y = reflected;
        let has_highlight = HAS_DELTA_LIGHTS && (*path).counts_caustics && scene.delta_light_count > 0u && bsdf.alpha >= MIRROR_ALPHA_MAX;
        if (has_highlight) { likelihood.x = max(likelihood.x, 0.1 * reflected); }
      }
    }
    let total = likelihood.x + likelihood.y + likelihood.z;
    if (!(total > 0.0)) { break; }
    if (u.z * total < likelihood.x) {
      (*path).throughput *= total / likelihood.x;
      vertex = GatheredVertex(true, surface.position, surface.geometric_normal, n, wo, bsdf);
      if (is_interface) {
        // Its reflection is traced: only what lies under it is gathered.
        vertex.bsdf.f0 = vec3f(0.0);
        vertex.bsdf.f90 = 0.0;
      }
      break;
    }
    var scatter = ABSORBED;
    var chance = likelihood.y / total;
    if (u.z * total >= likelihood.x + likelihood.y && likelihood.z > 0.0) {
      chance = likelihood.z / total;
      scatter = refract_through(bsdf, n, h, wo, surface.is_front);
      scatter.weight *= (1.0 - reflectance) * radiance_scale(bsdf, surface.is_front);
    } else if (is_interface) {
      let wi = reflect(-wo, h);
      if (dot(wi, n) > 0.0) { scatter = Scatter(wi, vec3f(reflectance * masking(n, wi, bsdf.alpha)), false); }
    } else {
      scatter = sample_reflection(bsdf, n, wo, u.xy);
    }
    scatter = at_real_surface(scatter, surface.geometric_normal);
    (*path).throughput *= scatter.weight / chance;
    if (!(max_component((*path).throughput) > 0.0)) { break; }
    (*path).ray = Ray(leave_surface(surface.position, surface.geometric_normal, scatter.direction), 3.0e38, scatter.direction);
    if (HAS_ABSORPTION && scatter.is_refracted && bsdf.is_solid) { (*path).solid = select(NO_SOLID, surface.material, surface.is_front); }
    came_by_traced_lobe = true;
  }
  return vertex;
}

/// Goes on from a vertex along a direction of its gathered lobes.
fn leave_vertex(path: ptr<function, ScatteredPath>, vertex: GatheredVertex, scatter: Scatter, weight: vec3f) {
  (*path).throughput *= weight;
  (*path).ray = Ray(leave_surface(vertex.position, vertex.geometric_normal, scatter.direction), 3.0e38, scatter.direction);
}
