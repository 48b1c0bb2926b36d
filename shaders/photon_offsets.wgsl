//! use photon_paths
// Turns the counts of each workgroup of 64 paths into places: an exclusive prefix sum over the wavefront, in path order.
// One workgroup does it all; a batch has at most 2^20 paths.
// Limits: when the batch would outgrow the map it is marked and stores nothing more; photon_commit takes it back whole, so that the
// photons which stay are all the photons of the paths that count.

@group(1) @binding(1) var<storage, read_write> counters: PhotonCounters;
@group(1) @binding(2) var<storage, read_write> group_counts: array<vec2u>;
@group(1) @binding(3) var<storage, read_write> wave: array<u32, 4>;   // paths before, first photon's place, 0, 0
@group(1) @binding(4) var<storage, read_write> next_dispatch: array<u32, 3>;

var<workgroup> partial: array<vec2u, 256>;

@compute @workgroup_size(256)
fn photon_offsets(@builtin(local_invocation_index) local: u32) {
  let group_count = (counters.alive + 63u) / 64u;
  let share = (group_count + 255u) / 256u;
  let first = min(local * share, group_count);
  let last = min(first + share, group_count);
  var sum = vec2u(0u);
  for (var i = first; i < last; i++) { sum += group_counts[i]; }
  partial[local] = sum;
  workgroupBarrier();
  if (local == 0u) {
    var running = vec2u(0u);
    for (var i = 0u; i < 256u; i++) { let own = partial[i]; partial[i] = running; running += own; }
    wave[0] = counters.alive;
    wave[1] = counters.stored + counters.batch_stored;
    if (counters.batch_overflows == 0u && wave[1] + running.y > tracing.capacity) { counters.batch_overflows = 1u; }
    counters.batch_stored += running.y;
    counters.alive = running.x;
    // The next bounce runs no more workgroups than it has paths for.
    next_dispatch[0] = (running.x + 63u) / 64u;
    next_dispatch[1] = 1u;
    next_dispatch[2] = 1u;
  }
  workgroupBarrier();
  var offset = partial[local];
  for (var i = first; i < last; i++) {
    let own = group_counts[i];
    group_counts[i] = offset;
    offset += own;
  }
}
