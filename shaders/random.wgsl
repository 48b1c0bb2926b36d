// Counter-based random numbers: a function of (seed, frame, path, dimension) and of nothing else, so that the same inputs give the
// same bits whatever the order of threads.
// Source: pcg4d from Jarzynski and Olano, "Hash Functions for GPU Rendering", JCGT 9(3), 2020; Owen-scrambled Sobol points from
// Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020.
// Limits: 24 bits of mantissa; the Sobol sequence has two dimensions a seed, padded by reseeding.

struct Random { key: vec4u }

fn pcg4d(input: vec4u) -> vec4u {
  var v = input * 1664525u + 1013904223u;
  v.x += v.y * v.w; v.y += v.z * v.x; v.z += v.x * v.y; v.w += v.y * v.z;
  v ^= v >> vec4u(16u);
  v.x += v.y * v.w; v.y += v.z * v.x; v.z += v.x * v.y; v.w += v.y * v.z;
  return v;
}

/// In [0, 1).
fn unit_float(bits: u32) -> f32 { return f32(bits >> 8u) * 5.9604645e-8; }

fn random_start(seed: u32, frame: u32, path: u32, dimension: u32) -> Random {
  return Random(vec4u(path, frame, dimension << 8u, seed));
}

fn random_next4(random: ptr<function, Random>) -> vec4f {
  let bits = pcg4d((*random).key);
  (*random).key.z += 1u;
  return vec4f(unit_float(bits.x), unit_float(bits.y), unit_float(bits.z), unit_float(bits.w));
}

fn owen_scramble(input: u32, seed: u32) -> u32 {
  var x = reverseBits(input);
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16u) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return reverseBits(x);
}

/// Point `index` of a shuffled, Owen-scrambled (0,2) sequence in [0,1)²; sequences of different seeds are independent.
fn sobol2(index: u32, seed: u32) -> vec2f {
  let seeds = pcg4d(vec4u(seed, 0x9e3779b9u, 0x85ebca6bu, 0xc2b2ae35u));
  let shuffled = owen_scramble(index, seeds.x);
  var second = 0u;
  var direction = 0x80000000u;
  for (var i = shuffled; i != 0u; i >>= 1u) {
    if ((i & 1u) != 0u) { second ^= direction; }
    direction ^= direction >> 1u;
  }
  return vec2f(unit_float(owen_scramble(reverseBits(shuffled), seeds.y)), unit_float(owen_scramble(second, seeds.z)));
}
