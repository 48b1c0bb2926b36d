//! use threads, photon_paths, radix
// Moves each pair of a tile to its place. Among equal digits of one round a pair's rank is the count of set bits below its own in a
// bit mask of the digit: every thread sets its bit, nobody's order matters.

@group(1) @binding(1) var<storage, read_write> counters: PhotonCounters;
//! split keys: u32, read_write, 1, 80
//! split order: u32, read_write, 1, 96
@group(1) @binding(4) var<storage, read_write> digit_counts: array<u32>;
//! split sorted_keys: u32, read_write, 1, 112
//! split sorted_order: u32, read_write, 1, 128

var<workgroup> masks: array<atomic<u32>, 2048>;   // 8 words a digit
var<workgroup> places: array<u32, 256>;

@compute @workgroup_size(256)
fn radix_scatter(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
  let tile = workgroup_number(group);
  if (tile >= radix.tile_count || tile * TILE >= counters.stored) { return; }
  places[local] = digit_counts[local * radix.tile_count + tile];
  for (var round = 0u; round < ROUNDS; round++) {
    for (var word = 0u; word < 8u; word++) { atomicStore(&masks[word * 256u + local], 0u); }
    workgroupBarrier();
    let index = tile * TILE + round * 256u + local;
    let is_inside = index < counters.stored;
    var key = 0u;
    var digit = 0u;
    if (is_inside) {
      key = load_keys(index);
      digit = (key >> radix.shift) & 255u;
      atomicOr(&masks[digit * 8u + local / 32u], 1u << (local % 32u));
    }
    workgroupBarrier();
    var rank = 0u;
    var total = 0u;
    if (is_inside) {
      for (var word = 0u; word < 8u; word++) {
        let bits = atomicLoad(&masks[digit * 8u + word]);
        total += countOneBits(bits);
        if (word < local / 32u) { rank += countOneBits(bits); }
        if (word == local / 32u) { rank += countOneBits(bits & ((1u << (local % 32u)) - 1u)); }
      }
      let place = places[digit] + rank;
      store_sorted_keys(place, key);
      store_sorted_order(place, load_order(index));
    }
    workgroupBarrier();
    if (is_inside && rank + 1u == total) { places[digit] += total; }
  }
}
