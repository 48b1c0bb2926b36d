//! use eye, gather
// Light that photons of one class bring to each visible point, estimated from their density on the surface.
// Source: see gather.wgsl. Where only a part of the disc lies on the surface, photons beyond it don't count, and the kernel is
// normalised over that part (shaders/coverage.wgsl).
// Limits: see gather.wgsl.

/// GLOBAL or CAUSTIC: each class has its own pass.
override CLASS: u32 = 0u;

@group(1) @binding(1) var<storage, read_write> visible_points_: array<VisiblePoint>;
@group(1) @binding(3) var<storage, read_write> slot_radiance: array<vec4f>;
@group(1) @binding(4) var<storage, read> counters: PhotonCounters;
struct Receiver {
  position: vec3f,
  normal: vec3f,
  geometric_normal: vec3f,
  wo: vec3f,
  bsdf: Bsdf,
  is_cut: bool,          // a wall or an edge crosses the disc
}

fn kernel_of(receiver: Receiver, photon: vec3f, packed_normal: u32, inverse_radius2: f32, plane_reach_m: f32) -> f32 {
  return kernel_at(receiver.position, receiver.geometric_normal, photon, packed_normal, inverse_radius2, plane_reach_m);
}

/// Reflected radiance before the division by the count of emitted paths, W/(m2 sr).
fn gather(receiver: Receiver, radius_m: f32) -> vec3f {
  let cell = grid_cell(CLASS, receiver.position);
  let inverse_radius2 = 1.0 / (radius_m * radius_m);
  let plane_reach_m = photon_map.flatness * radius_m;
  let is_lambert = !(HAS_SPECULAR && (reflects(receiver.bsdf) || receiver.bsdf.coat_f90 != 0.0));
  let tangents = frame_around(receiver.geometric_normal);
  var share = 1.0;
  for (var once = 0u; once < select(0u, 1u, receiver.is_cut); once++) { share = set_free_polygon(radius_m); }
  var lambert_sum = vec3f(0.0);
  var sum = vec3f(0.0);
  for (var row = 0; row < 9; row++) {
    let run = run_around(CLASS, cell, row);
    let first = run.x;
    let last = run.y;
    // Bare Lambert reflects all photons alike: its BSDF comes out of the sum. Three loops, two of them empty, because software drivers
    // compute both sides of a branch but leave a loop that nobody needs.
    let whole_last = select(first, last, is_lambert && !receiver.is_cut);
    let cut_last = select(whole_last, last, is_lambert);
    for (var i = first; i < whole_last; i++) {
      let photon = load_map_position(i);
      let flux = load_map_flux(i);
      lambert_sum += flux.xyz * kernel_of(receiver, photon.xyz, bitcast<u32>(flux.w), inverse_radius2, plane_reach_m);
    }
    for (var i = whole_last; i < cut_last; i++) {
      let photon = load_map_position(i);
      let flux = load_map_flux(i);
      let kernel = kernel_of(receiver, photon.xyz, bitcast<u32>(flux.w), inverse_radius2, plane_reach_m);
      lambert_sum += flux.xyz * select(0.0, kernel, is_free(photon.xyz - receiver.position, tangents));
    }
    for (var i = cut_last; i < last; i++) {
      let photon = load_map_position(i);
      let flux = load_map_flux(i);
      var kernel = kernel_of(receiver, photon.xyz, bitcast<u32>(flux.w), inverse_radius2, plane_reach_m);
      if (receiver.is_cut && !is_free(photon.xyz - receiver.position, tangents)) { kernel = 0.0; }
      let wi = unpack_direction(bitcast<u32>(photon.w));
      sum += flux.xyz * gathered_bsdf(receiver.bsdf, receiver.normal, receiver.wo, wi) * kernel;
    }
  }
  sum += lambert_sum * receiver.bsdf.diffuse / PI;
  // A receiver in a corner too tight for any kernel gets nothing rather than a division by nearly nothing.
  return select(vec3f(0.0), sum * (2.0 * inverse_radius2 / (PI * share)), share > 1e-3);
}

@compute @workgroup_size(64)
fn density_estimate(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
  @builtin(local_invocation_index) local: u32) {
  let slot = eye_thread(group, groups, local);
  if (slot >= slots_a_pixel() * band_pixel_count()) { return; }
  let point = visible_points_[slot];
  if (!any(point.throughput > vec3f(0.0)) || counters.emitted == 0u) { return; }
  if (CLASS == CAUSTIC && !has_photons_near(CLASS, point.position)) { return; }
  let scale = radius_scale_at(pixel_centre_eccentricity_rad(slot % band_pixel_count()));
  let geometric_normal = unpack_direction(point.packed_geometric_normal);
  let radius_m = select(photon_map.global_radius_m, photon_map.caustic_radius_m, CLASS == CAUSTIC) * scale;
  let is_cut = find_cut(point.position, geometric_normal, radius_m);
  let receiver = Receiver(point.position, unpack_direction(point.packed_normal), geometric_normal,
                          unpack_direction(point.packed_wo), bsdf_of(point), is_cut);
  let sum = gather(receiver, radius_m);
  slot_radiance[slot] += vec4f(point.throughput * sum / f32(counters.emitted), 0.0);
}
