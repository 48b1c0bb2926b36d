//! use threads
// Adds what the host computed to an eye's image: rgb radiance sums, W/(m2 sr), and in the fourth channel their count.
// Source: none, plain addition. Limits: sums are kept in f32.

override COUNT: u32 = 0;

//! split samples: vec4f, read, 0, 0
//! split image: vec4f, read_write, 0, 16

@compute @workgroup_size(64)
fn add_samples(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
  let index = workgroup_number(group) * 64u + local;
  if (index < COUNT) { store_image(index, load_image(index) + load_samples(index)); }
}
