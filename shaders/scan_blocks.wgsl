//! use threads, scan
// First of three: prefix sums within each block, and the block's total.

@compute @workgroup_size(256)
fn scan_blocks(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
  let block = workgroup_number(group);
  let first = block * SCAN_BLOCK + local * SCAN_ITEMS;
  var items: array<u32, 8>;
  var own = 0u;
  for (var i = 0u; i < SCAN_ITEMS; i++) {
    if (first + i < scan.length) { items[i] = scan_values[first + i]; }
    own += items[i];
  }
  var running = workgroup_exclusive_sum(local, own);
  for (var i = 0u; i < SCAN_ITEMS; i++) {
    if (first + i < scan.length) { scan_values[first + i] = running; }
    running += items[i];
  }
  if (local == 255u && block * SCAN_BLOCK < scan.length) { scan_sums[block] = running; }
}
