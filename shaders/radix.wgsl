// A stable radix sort of (key, value) pairs by eight bits a pass, in tiles of 4096. Stable, so that photons of one cell keep the
// order in which they were stored and sums over them are the same bits every time.
// Source: Merrill and Grimshaw, "High Performance and Scalable Radix Sorting", 2011, without its fused scan.

struct RadixUniform {
  shift: u32,
  tile_count: u32,   // tiles that the arrays hold, full or not
  padding: vec2u,
}
const TILE: u32 = 4096u;
const ROUNDS: u32 = 16u;

@group(1) @binding(9) var<uniform> radix: RadixUniform;
