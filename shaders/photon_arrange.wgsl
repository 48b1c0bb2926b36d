//! use threads, photon_paths
// Copies the photons into the order of their cells.

@group(1) @binding(1) var<storage, read_write> counters: PhotonCounters;
//! split order: u32, read_write, 1, 96
//! split photon_position: vec4f, read, 1, 16
//! split photon_flux: vec4f, read, 1, 32
//! split map_position: vec4f, read_write, 1, 48
//! split map_flux: vec4f, read_write, 1, 64

@compute @workgroup_size(256)
fn photon_arrange(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
  let index = workgroup_number(group) * 256u + local;
  if (index >= counters.stored) { return; }
  let source = load_order(index);
  let flux = load_photon_flux(source);
  store_map_position(index, load_photon_position(source));
  store_map_flux(index, vec4f(abs(flux.x), flux.yzw));
}
