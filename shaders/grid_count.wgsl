//! use threads, photon_paths
// Counts the photons of each cell; a prefix sum over it makes each cell's first photon.

@group(1) @binding(1) var<storage, read_write> counters: PhotonCounters;
//! split keys: u32, read_write, 1, 80
@group(1) @binding(3) var<storage, read_write> cell_counts: array<atomic<u32>>;

@compute @workgroup_size(256)
fn grid_count(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
  let index = workgroup_number(group) * 256u + local;
  if (index < counters.stored) { atomicAdd(&cell_counts[load_keys(index)], 1u); }
}
