//! use threads, scan
// Third of three: each block gets the sum of the blocks before it.

@compute @workgroup_size(256)
fn scan_add(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
  let block = workgroup_number(group);
  for (var i = 0u; i < SCAN_ITEMS; i++) {
    let index = block * SCAN_BLOCK + i * 256u + local;
    if (index < scan.length) { scan_values[index] += scan_sums[block]; }
  }
}
