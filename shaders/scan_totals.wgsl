//! use scan
// Second of three: prefix sums over the blocks' totals, in one workgroup.

@compute @workgroup_size(256)
fn scan_totals(@builtin(local_invocation_index) local: u32) {
  let count = (scan.length + SCAN_BLOCK - 1u) / SCAN_BLOCK;
  let share = (count + 255u) / 256u;
  let first = min(local * share, count);
  let last = min(first + share, count);
  var own = 0u;
  for (var i = first; i < last; i++) { own += scan_sums[i]; }
  var running = workgroup_exclusive_sum(local, own);
  for (var i = first; i < last; i++) {
    let value = scan_sums[i];
    scan_sums[i] = running;
    running += value;
  }
}
