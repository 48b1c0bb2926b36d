// An exclusive prefix sum in place, in three dispatches: within blocks of 2048, over the blocks' totals, and back into the blocks.

struct ScanUniform {
  length: u32,
  padding0: u32,
  padding1: u32,
  padding2: u32,
}
const SCAN_BLOCK: u32 = 2048u;
const SCAN_ITEMS: u32 = 8u;   // a thread's share of a block

@group(1) @binding(0) var<uniform> scan: ScanUniform;
@group(1) @binding(1) var<storage, read_write> scan_values: array<u32>;
@group(1) @binding(2) var<storage, read_write> scan_sums: array<u32>;

var<workgroup> scan_shared: array<u32, 256>;

/// Sum over the threads before this one.
fn workgroup_exclusive_sum(local: u32, own: u32) -> u32 {
  scan_shared[local] = own;
  workgroupBarrier();
  for (var reach = 1u; reach < 256u; reach <<= 1u) {
    var before = 0u;
    if (local >= reach) { before = scan_shared[local - reach]; }
    workgroupBarrier();
    scan_shared[local] += before;
    workgroupBarrier();
  }
  return scan_shared[local] - own;
}
