//! use threads, photon_paths
// Moves what a bounce left behind to its place: living paths close up in the other path array, photons join the map, both in order.
// Ranks within a workgroup come from one bit a thread in shared memory: no order of threads can change them.

@group(1) @binding(1) var<storage, read_write> paths: array<PhotonPath>;
@group(1) @binding(2) var<storage, read_write> counters: PhotonCounters;
@group(1) @binding(3) var<storage, read_write> staged: array<Photon>;
@group(1) @binding(4) var<storage, read_write> staged_flags: array<u32>;
@group(1) @binding(5) var<storage, read_write> group_counts: array<vec2u>;
@group(1) @binding(6) var<storage, read_write> wave: array<u32, 4>;
@group(1) @binding(7) var<storage, read_write> next_paths: array<PhotonPath>;
//! split photon_position: vec4f, read_write, 1, 16
//! split photon_flux: vec4f, read_write, 1, 32

var<workgroup> alive_bits: array<atomic<u32>, 2>;
var<workgroup> photon_bits: array<atomic<u32>, 2>;

fn rank_below(low: u32, high: u32, local: u32) -> u32 {
  if (local < 32u) { return countOneBits(low & ((1u << local) - 1u)); }
  return countOneBits(low) + countOneBits(high & ((1u << (local - 32u)) - 1u));
}

@compute @workgroup_size(64)
fn photon_append(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
  let group_index = workgroup_number(group);
  let index = group_index * 64u + local;
  var flags = 0u;
  if (index < wave[0]) {
    flags = staged_flags[index];
    if ((flags & GOES_ON) != 0u) { atomicOr(&alive_bits[local / 32u], 1u << (local % 32u)); }
    if ((flags & LEAVES_PHOTON) != 0u) { atomicOr(&photon_bits[local / 32u], 1u << (local % 32u)); }
  }
  workgroupBarrier();
  if (flags == 0u) { return; }
  let offset = group_counts[group_index];
  if ((flags & GOES_ON) != 0u) {
    next_paths[offset.x + rank_below(atomicLoad(&alive_bits[0]), atomicLoad(&alive_bits[1]), local)] = paths[index];
  }
  if ((flags & LEAVES_PHOTON) != 0u && counters.batch_overflows == 0u) {
    let photon = staged[index];
    let place = wave[1] + offset.y + rank_below(atomicLoad(&photon_bits[0]), atomicLoad(&photon_bits[1]), local);
    // A caustic photon carries its class in the sign bit of its flux' red channel: flux is never negative here.
    let red = bitcast<f32>(bitcast<u32>(photon.flux_w.x) | select(0u, 0x80000000u, (flags & IS_CAUSTIC) != 0u));
    store_photon_position(place, vec4f(photon.position, bitcast<f32>(photon.packed_incident)));
    store_photon_flux(place, vec4f(red, photon.flux_w.yz, bitcast<f32>(photon.packed_normal)));
  }
}
