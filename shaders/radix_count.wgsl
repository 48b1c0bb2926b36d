//! use threads, photon_paths, radix
// Counts each digit in each tile; laid out digit by digit, so that one prefix sum gives every tile its place.

@group(1) @binding(1) var<storage, read_write> counters: PhotonCounters;
//! split keys: u32, read_write, 1, 80
@group(1) @binding(4) var<storage, read_write> digit_counts: array<u32>;

var<workgroup> bins: array<atomic<u32>, 256>;

@compute @workgroup_size(256)
fn radix_count(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
  let tile = workgroup_number(group);
  for (var round = 0u; round < ROUNDS; round++) {
    let index = tile * TILE + round * 256u + local;
    if (index < counters.stored) { atomicAdd(&bins[(load_keys(index) >> radix.shift) & 255u], 1u); }
  }
  workgroupBarrier();
  if (tile < radix.tile_count) { digit_counts[local * radix.tile_count + tile] = atomicLoad(&bins[local]); }
}
