//! use eye
// Follows one eye path a pixel, jittered in the pixel, through mirrors and glass to where light is gathered.
// Source: Jensen 1996, section 3.1; visible points as in Hachisuka et al., "Progressive Photon Mapping", 2008.
// Limits: `chain_max` mirrors and glass faces; what lies beyond the next one is black.

@group(1) @binding(1) var<storage, read_write> visible_points_: array<VisiblePoint>;
@group(1) @binding(2) var<storage, read_write> seen_emission: array<vec4f>;
@group(1) @binding(3) var<storage, read_write> slot_radiance: array<vec4f>;

struct Chain {
  ray: Ray,
  throughput: vec3f,
  medium: u32,
  depth: u32,
}

/// One way on from a vertex: 0 gather here, 1 follow the reflection, 2 follow the refraction.
fn pick_way(likelihood: vec3f, u: f32) -> u32 {
  let target_ = u * (likelihood.x + likelihood.y + likelihood.z);
  if (target_ < likelihood.x) { return 0u; }
  if (target_ < likelihood.x + likelihood.y || likelihood.z <= 0.0) { return 1u; }
  return 2u;
}

@compute @workgroup_size(64)
fn visible_points(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
  @builtin(local_invocation_index) local: u32) {
  let band_pixel = eye_thread(group, groups, local);
  if (band_pixel >= band_pixel_count()) { return; }
  let pixel = vec2u(band_pixel % eye.size.x, eye.first_row + band_pixel / eye.size.x);
  for (var slot = 0u; slot < slots_a_pixel(); slot++) {
    visible_points_[band_pixel + slot * band_pixel_count()].throughput = vec3f(0.0);
    slot_radiance[band_pixel + slot * band_pixel_count()] = vec4f(0.0);
  }
  seen_emission[band_pixel] = vec4f(0.0);
  if (eye.sample >= samples_at(pixel_centre_eccentricity_rad(band_pixel))) { return; }

  let pixel_seed = pcg4d(vec4u(pixel, eye.seed, 0x65796573u));
  let number = eye.frame * eye.samples.x + eye.sample;
  let direction = dir_in_view(vec2f(pixel) + sobol2(number, pixel_seed.x));
  let ray = Ray(vec3f(eye.scene_from_view[0].w, eye.scene_from_view[1].w, eye.scene_from_view[2].w), 3.0e38,
                affine_vector(eye.scene_from_view, direction));
  var random = random_start(eye.seed ^ pixel_seed.y, eye.frame, pixel.y * eye.size.x + pixel.x, eye.sample);

  var emission = vec3f(0.0);
  var chain = Chain(ray, vec3f(1.0), NO_SOLID, 0u);
  var other_way = chain;
  var has_other_way = false;
  var has_branched = false;
  for (var slot = 0u; slot < slots_a_pixel(); slot++) {
    if (slot == 1u) {
      if (!has_other_way) { break; }
      chain = other_way;
    }
    // A path ends at the surface after the last one that it passes.
    while (chain.depth <= eye.chain_max) {
      let hit = trace(chain.ray, false);
      if (hit.triangle == NO_TRIANGLE) { break; }
      let surface = surface_at(hit, chain.ray);
      let bsdf = bsdf_at(surface);
      let wo = -chain.ray.direction;
      let n = scattering_normal(surface, bsdf, wo);
      if (HAS_ABSORPTION && chain.medium != NO_SOLID) { chain.throughput *= exp(-materials[chain.medium].absorption * hit.t); }
      emission += chain.throughput * bsdf.emission;

      let u = random_next4(&random);
      let cos_o = dot(wo, n);
      let is_interface = transmits(bsdf);
      let h = half_vector_sample(n, wo, bsdf.alpha, u.xy);
      var reflectance = 0.0;
      if (is_interface) { reflectance = interface_reflectance(bsdf, surface.is_front, dot(wo, h)); }
      // How much each way is likely to bring; what is gathered includes the rough reflection.
      var likelihood = vec3f(luminance(bsdf.diffuse) * (1.0 - reflectance), 0.0, 0.0);
      if (is_interface) {
        likelihood.y = reflectance;
        likelihood.z = (1.0 - reflectance) * luminance(bsdf.transmission);
      } else if (reflects(bsdf)) {
        let reflected = luminance(schlick(bsdf.f0, bsdf.f90, cos_o));
        if (gathers_reflection(bsdf)) { likelihood.x += reflected; } else {
          likelihood.y = reflected;
          if (HAS_DELTA_LIGHTS && scene.delta_light_count > 0u && bsdf.alpha >= MIRROR_ALPHA_MAX) { likelihood.x = max(likelihood.x, 0.1 * reflected); }
        }
      }
      let way_count = dot(vec3u(likelihood > vec3f(0.0)), vec3u(1u));
      if (way_count == 0u) { break; }

      var way = pick_way(likelihood, u.z);
      var way_weight = (likelihood.x + likelihood.y + likelihood.z) / likelihood[way];
      var second_way = 3u;
      var second_weight = 0.0;
      if (way_count > 1u && !has_branched) {
        // Go the likeliest way, and keep one of the others for the second slot.
        has_branched = true;
        way = select(select(2u, 1u, likelihood.y >= likelihood.z), 0u, likelihood.x > 0.0);
        way_weight = 1.0;
        var rest = likelihood;
        rest[way] = 0.0;
        second_way = pick_way(rest, u.z);
        second_weight = (rest.x + rest.y + rest.z) / rest[second_way];
      }
      // The second way is followed first in program order, because it needs this vertex; its chain waits for slot 1.
      var goes_on = false;
      for (var turn = 0u; turn < 2u; turn++) {
        let turn_way = select(way, second_way, turn == 0u);
        if (turn_way == 3u) { continue; }
        let weight = chain.throughput * select(way_weight, second_weight, turn == 0u);
        if (turn_way == 0u) {
          // An interface's reflection is traced: only what lies under it is gathered.
          let gathered_f0 = select(bsdf.f0, vec3f(0.0), is_interface);
          let gathered_f90 = select(bsdf.f90, 0.0, is_interface);
          visible_points_[band_pixel + slot * band_pixel_count()] = VisiblePoint(
            surface.position, pack_direction(n), weight, pack_direction(surface.geometric_normal),
            bsdf.diffuse, pack_direction(wo), gathered_f0, pack2x16unorm(vec2f(bsdf.alpha, gathered_f90)), bsdf.coat_f0, bsdf.coat_f90);
          continue;
        }
        var scatter = ABSORBED;
        if (turn_way == 2u) {
          scatter = refract_through(bsdf, n, h, wo, surface.is_front);
          scatter.weight *= (1.0 - reflectance) * radiance_scale(bsdf, surface.is_front);
        } else if (is_interface) {
          let wi = reflect(-wo, h);
          if (dot(wi, n) > 0.0) { scatter = Scatter(wi, vec3f(reflectance * masking(n, wi, bsdf.alpha)), false); }
        } else {
          scatter = sample_reflection(bsdf, n, wo, u.xy);
        }
        scatter = at_real_surface(scatter, surface.geometric_normal);
        if (!any(scatter.weight > vec3f(0.0))) { continue; }
        var next = chain;
        next.ray = Ray(leave_surface(surface.position, surface.geometric_normal, scatter.direction), 3.0e38, scatter.direction);
        next.throughput = weight * scatter.weight;
        next.depth++;
        if (scatter.is_refracted && bsdf.is_solid) { next.medium = select(NO_SOLID, surface.material, surface.is_front); }
        if (turn == 0u) { other_way = next; has_other_way = true; } else { chain = next; goes_on = true; }
      }
      if (!goes_on) { break; }
    }
  }
  seen_emission[band_pixel] = vec4f(emission, select(SAW_AND_WENT_ON, SAW_AT_FIRST_SIGHT, chain.depth == 0u && !has_branched));
}

const NO_SOLID: u32 = 0xffffffffu;
