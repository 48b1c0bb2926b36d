// Shows an eye's image on the headset: mean radiance, exposure, tone curve. The target encodes sRGB.
// Source: `tone_map` in src/image/png.rs has the same curve for files.
// Limits: no more than display white is shown; measure on linear radiance, never on this.

struct PresentUniform {
  size: vec2u,
  exposure: f32,   // display-linear white per W/(m2 sr)
  padding: u32,
}

@group(0) @binding(0) var<uniform> present: PresentUniform;
//! split image: vec4f, read, 0, 1

const SHOULDER: f32 = 0.8;

/// Identity up to the shoulder of the largest channel, then bent smoothly towards white, hue kept.
fn tone_map(rgb: vec3f) -> vec3f {
  let exposed = max(rgb, vec3f(0.0));
  let largest = max(exposed.x, max(exposed.y, exposed.z));
  if (largest <= SHOULDER) { return exposed; }
  let room = 1.0 - SHOULDER;
  return exposed / largest * (SHOULDER + room * (1.0 - exp(-(largest - SHOULDER) / room)));
}

@vertex
fn vertex_main(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
  return vec4f(f32(i32(index & 1u) * 4 - 1), f32(i32(index >> 1u) * 4 - 1), 0.0, 1.0);
}

@fragment
fn fragment_main(@builtin(position) position: vec4f) -> @location(0) vec4f {
  let pixel = min(vec2u(position.xy), present.size - 1u);
  let sum = load_image(pixel.y * present.size.x + pixel.x);
  return vec4f(tone_map(present.exposure * sum.rgb / max(sum.w, 1.0)), 1.0);
}
