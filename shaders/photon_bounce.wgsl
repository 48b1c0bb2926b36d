//! use threads, random, bsdf, photon_paths
// One bounce of every path of the wavefront: find the surface, leave a photon there, scatter.
// Source: Jensen 1996; Russian roulette by the ratio of throughputs, so that photons keep about equal flux.
// Limits: no barriers here: on software drivers they would turn every live value of the traversal into memory traffic.

/// Whether light gathered by mirrors and glass is told from the rest, to be estimated more sharply.
override HAS_CAUSTICS: bool = true;
/// All light from photon density: photons straight from a light are stored too.
override STORE_DIRECT: bool = false;
/// The classes that are stored. Where only caustic photons are, paths follow traced lobes alone.
override STORES_GLOBAL: bool = true;
override STORES_CAUSTIC: bool = true;

@group(1) @binding(1) var<storage, read_write> paths: array<PhotonPath>;
@group(1) @binding(2) var<storage, read_write> counters: PhotonCounters;
@group(1) @binding(3) var<storage, read_write> staged: array<Photon>;
@group(1) @binding(4) var<storage, read_write> staged_flags: array<u32>;

/// How much more light an interpolated normal makes of a direction than the real surface, or the other way round: 1 where they are one.
/// With it photons bring to diffuse surfaces, and from them, what sight finds (Veach 1997, equation 5.19).
fn cosine_ratio(cos_of_one: f32, cos_of_other: f32) -> f32 {
  return max(cos_of_one, 1e-6) / max(cos_of_other, 1e-6);
}

fn bounce(index: u32) -> u32 {
  var path = paths[index];
  // Aimed at nothing that its light reaches.
  if (!STORES_GLOBAL && !any(path.flux_w > vec3f(0.0))) { return 0u; }
  let ray = Ray(path.origin, 3.0e38, path.direction);
  let hit = trace(ray, false);
  if (hit.triangle == NO_TRIANGLE) { return 0u; }
  let surface = surface_at(hit, ray);
  let bsdf = bsdf_at(surface);
  let wo = -path.direction;
  let n = scattering_normal(surface, bsdf, wo);
  var medium = path.state & NO_MEDIUM;
  if (HAS_ABSORPTION && medium != NO_MEDIUM) {
    path.flux_w *= exp(-materials[medium].absorption * hit.t);
  }
  let arrived_w = path.flux_w * cosine_ratio(dot(wo, surface.shading_normal), dot(wo, surface.geometric_normal));
  let has_diffused = (path.state & PATH_DIFFUSED) != 0u;
  var flags = 0u;
  if (stores_photons(surface.material) && (STORE_DIRECT || tracing.bounce > 0u)) {
    let is_caustic = HAS_CAUSTICS && tracing.bounce > 0u && !has_diffused;
    if (select(STORES_GLOBAL, STORES_CAUSTIC, is_caustic)) {
      staged[index] = Photon(surface.position, pack_direction(wo), arrived_w, pack_normal(surface.geometric_normal));
      flags = LEAVES_PHOTON | select(0u, IS_CAUSTIC, is_caustic);
    }
  }
  if (tracing.bounce + 1u >= tracing.depth_max) { return flags; }

  // Pick a lobe by what it is likely to carry on.
  var random = random_start(tracing.seed, tracing.frame, path.path, tracing.bounce);
  let u = random_next4(&random);
  var scatter = ABSORBED;
  var chance = 1.0;
  var leaves_gathered_lobe = false;
  var is_diffused = false;
  if (transmits(bsdf)) {
    let h = half_vector_sample(n, wo, bsdf.alpha, u.xy);
    let reflectance = interface_reflectance(bsdf, surface.is_front, dot(wo, h));
    let through = (1.0 - reflectance) * luminance(bsdf.transmission);
    let diffused = select(0.0, (1.0 - reflectance) * luminance(bsdf.diffuse), STORES_GLOBAL);
    let total = reflectance + through + diffused;
    if (u.z * total < reflectance) {
      let wi = reflect(-wo, h);
      if (dot(wi, n) > 0.0) { scatter = Scatter(wi, vec3f(masking(n, wi, bsdf.alpha) * total), false); }
    } else if (u.z * total < reflectance + through) {
      scatter = refract_through(bsdf, n, h, wo, surface.is_front);
      scatter.weight *= (1.0 - reflectance) * total / through;
    } else {
      leaves_gathered_lobe = true;
      is_diffused = true;
      let wi = frame_around(n) * cosine_hemisphere_sample(random_next4(&random).xy);
      scatter = Scatter(wi, lambert(bsdf, n, wo, wi) * (PI * total / diffused), false);
    }
  } else {
    let reflected = select(0.0, luminance(schlick(bsdf.f0, bsdf.f90, dot(wo, n))), reflects(bsdf));
    let coat = select(0.0, max_component(schlick(bsdf.coat_f0, bsdf.coat_f90, dot(wo, n))), HAS_SPECULAR);
    let diffused = select(0.0, luminance(bsdf.diffuse) * (1.0 - coat), STORES_GLOBAL);
    let total = reflected + diffused;
    if (total <= 0.0) { return flags; }
    chance = reflected / total;
    if (u.z < chance) {
      scatter = sample_reflection(bsdf, n, wo, u.xy);
      scatter.weight /= chance;
      leaves_gathered_lobe = gathers_reflection(bsdf);
    } else {
      leaves_gathered_lobe = true;
      is_diffused = true;
      let wi = frame_around(n) * cosine_hemisphere_sample(u.xy);
      scatter = Scatter(wi, lambert(bsdf, n, wo, wi) * (PI / (1.0 - chance)), false);
    }
  }
  if (!STORES_GLOBAL && leaves_gathered_lobe) { return flags; }
  scatter = at_real_surface(scatter, surface.geometric_normal);
  // What is mirrored or refracted keeps all its flux.
  let left = select(1.0, cosine_ratio(abs(dot(scatter.direction, surface.geometric_normal)), abs(dot(scatter.direction, n))), is_diffused);
  let flux_w = select(path.flux_w, arrived_w, is_diffused) * scatter.weight * left;
  var survival = min(1.0, max_component(flux_w) / max_component(path.flux_w));
  // Aimed paths are as many, and as faint, as their first surface is worth.
  if (!STORES_GLOBAL && tracing.bounce == 0u) { survival = 1.0; }
  // Written so that a survival that is not a number ends the path.
  if (!(u.w < survival)) { return flags; }
  if (scatter.is_refracted && bsdf.is_solid) { medium = select(NO_MEDIUM, surface.material, surface.is_front); }
  paths[index] = PhotonPath(leave_surface(surface.position, surface.geometric_normal, scatter.direction),
                            medium | select(0u, PATH_DIFFUSED, has_diffused || leaves_gathered_lobe),
                            scatter.direction, path.path, flux_w / survival, 0u);
  return flags | GOES_ON;
}

@compute @workgroup_size(64)
fn photon_bounce(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
  let index = workgroup_number(group) * 64u + local;
  if (index < counters.alive) { staged_flags[index] = bounce(index); }
}
