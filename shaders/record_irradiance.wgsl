//! use threads, random, bsdf, gather
// Fills irradiance records from the photon map: the density of both classes around each, over the part of the disc that lies on the
// surface.
// Source: see gather.wgsl and coverage.wgsl; the direction is drawn by a reservoir (Chao 1982).
// Limits: a place too tight for any kernel becomes a record that no look-up takes.

/// Records to fill.
override RECORD_COUNT: u32 = 1u;
/// Whether the map has a class for caustics.
override HAS_CAUSTICS: bool = true;

@group(1) @binding(4) var<storage, read> counters: PhotonCounters;
//! split photon_position: vec4f, read_write, 1, 16
//! split photon_flux: vec4f, read_write, 1, 32

struct Arrival {
  irradiance: vec3f,     // before the division by the count of emitted paths
  packed_direction: u32, // of one photon
  weight_sum: f32,
  random: u32,
}

/// Adds what the photons of one class bring.
fn add_class(class_: u32, place: vec3f, normal: vec3f, radius_m: f32, is_cut: bool, tangents: mat3x3f, arrival: ptr<function, Arrival>) -> bool {
  var share = 1.0;
  for (var once = 0u; once < select(0u, 1u, is_cut); once++) { share = set_free_polygon(radius_m); }
  if (share <= 1e-3) { return false; }
  let inverse_radius2 = 1.0 / (radius_m * radius_m);
  let scale = 2.0 * inverse_radius2 / (PI * share);
  let cell = grid_cell(class_, place);
  for (var row = 0; row < 9; row++) {
    let run = run_around(class_, cell, row);
    for (var i = run.x; i < run.y; i++) {
      let photon = load_map_position(i);
      let flux = load_map_flux(i);
      var kernel = kernel_at(place, normal, photon.xyz, bitcast<u32>(flux.w), inverse_radius2, photon_map.flatness * radius_m);
      if (is_cut && !is_free(photon.xyz - place, tangents)) { kernel = 0.0; }
      let irradiance = flux.xyz * (kernel * scale);
      let weight = luminance(irradiance);
      (*arrival).irradiance += irradiance;
      (*arrival).weight_sum += weight;
      (*arrival).random = (*arrival).random * 747796405u + 2891336453u;
      if (weight > 0.0 && unit_float((*arrival).random) * (*arrival).weight_sum < weight) { (*arrival).packed_direction = bitcast<u32>(photon.w); }
    }
  }
  return true;
}

@compute @workgroup_size(64)
fn record_irradiance(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
  let index = workgroup_number(group) * 64u + local;
  if (index >= RECORD_COUNT) { return; }
  let packed_normal = bitcast<u32>(load_photon_flux(index).w);
  if (packed_normal == 0u) { return; }
  let place = load_photon_position(index).xyz;
  let normal = normalize(unpack_normal(packed_normal));
  let is_cut = find_cut(place, normal, photon_map.global_radius_m);
  let tangents = frame_around(normal);
  var arrival = Arrival(vec3f(0.0), pack_direction(normal), 0.0, pcg4d(vec4u(index, 0x6172u, 0u, 0u)).x);
  var is_sound = add_class(GLOBAL, place, normal, photon_map.global_radius_m, is_cut, tangents, &arrival);
  if (HAS_CAUSTICS && has_photons_near(CAUSTIC, place)) {
    is_sound = add_class(CAUSTIC, place, normal, photon_map.caustic_radius_m, is_cut, tangents, &arrival) && is_sound;
  }
  let irradiance = arrival.irradiance / f32(max(counters.emitted, 1u));
  store_photon_position(index, vec4f(place, bitcast<f32>(arrival.packed_direction)));
  store_photon_flux(index, vec4f(irradiance, select(0.0, bitcast<f32>(pack_marked_normal(normal, is_cut)), is_sound)));
}
