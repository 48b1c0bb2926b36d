//! use threads, photon_paths, photon_map
// The grid cell of every photon, as the key to sort by.

@group(1) @binding(1) var<storage, read_write> counters: PhotonCounters;
//! split keys: u32, read_write, 1, 80
//! split order: u32, read_write, 1, 96
//! split photon_position: vec4f, read, 1, 16
//! split photon_flux: vec4f, read, 1, 32

@compute @workgroup_size(256)
fn photon_keys(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
  let index = workgroup_number(group) * 256u + local;
  if (index >= counters.stored) { return; }
  let class_ = select(GLOBAL, CAUSTIC, (bitcast<u32>(load_photon_flux(index).x) & 0x80000000u) != 0u);
  store_keys(index, cell_key(class_, grid_cell(class_, load_photon_position(index).xyz)));
  store_order(index, index);
}
