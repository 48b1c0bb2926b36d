//! use threads, photon_paths
// Counts, for each workgroup of 64 paths, those that go on and the photons that they left behind.

@group(1) @binding(2) var<storage, read_write> counters: PhotonCounters;
@group(1) @binding(4) var<storage, read_write> staged_flags: array<u32>;
@group(1) @binding(5) var<storage, read_write> group_counts: array<vec2u>;

var<workgroup> alive_count: atomic<u32>;
var<workgroup> photon_count_: atomic<u32>;

@compute @workgroup_size(64)
fn photon_count(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
  let group_index = workgroup_number(group);
  let index = group_index * 64u + local;
  if (index < counters.alive) {
    let flags = staged_flags[index];
    if ((flags & GOES_ON) != 0u) { atomicAdd(&alive_count, 1u); }
    if ((flags & LEAVES_PHOTON) != 0u) { atomicAdd(&photon_count_, 1u); }
  }
  workgroupBarrier();
  if (local == 0u && group_index * 64u < tracing.path_count) {
    group_counts[group_index] = vec2u(atomicLoad(&alive_count), atomicLoad(&photon_count_));
  }
}
