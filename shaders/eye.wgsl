//! use threads, random, bsdf
// What the eye passes share: the eye, its gaze, the band of rows at work, and the visible points.
// A visible point is where an eye path meets a surface whose reflected light is gathered. A pixel has two slots: the first vertex at
// which a path could go two ways sends it both ways; later ones choose one way at random. Where nothing is specular one slot does.
// Regions: eccentricity is the true angle between a pixel's ray and the gaze ray (src/fovea/region.rs has the same formula).

struct EyeUniform {
  scene_from_view: array<vec4f, 3>,
  slope_left_top: vec2f,       // tangent-space corner of the image, and its extent
  slope_extent: vec2f,
  gaze_dir_in_view: vec3f,
  fovea_radius_rad: f32,
  size: vec2u,
  first_row: u32,
  row_count: u32,
  samples: vec3u,              // a pixel, in fovea, transition, periphery
  transition_radius_rad: f32,
  radius_scale: vec3f,         // of the gather radius, likewise
  sample: u32,                 // number of the sample at work
  seed: u32,
  frame: u32,
  shadow_rays: u32,
  light_candidates: u32,
  paths: vec3u,                // that bring indirect light to a visible point, in fovea, transition, periphery
  chain_max: u32,
  path_depth_max: u32,
  resolve_first_row: u32,      // of the rows that are shown: those beside them are there for the filter
  resolve_row_count: u32,
  kept_max: u32,               // samples that a pixel keeps of earlier frames
  previous_view_from_scene: array<vec4f, 3>,
  previous_slope_left_top: vec2f,
  previous_slope_extent: vec2f,
  refresh_frames: u32,         // from one lit sample of a pixel outside the fovea to the next, where its light is kept
  padding0: u32,
  padding1: u32,
  padding2: u32,
}

@group(1) @binding(0) var<uniform> eye: EyeUniform;

/// Whether eye paths go on beyond the first surface.
override HAS_CHAINS: bool = true;
/// Sharp highlights of lights without extent are found at visible points, as no ray meets such a light.
override HAS_DELTA_LIGHTS: bool = true;

/// Threads between which the device parts a dispatch in equal runs of workgroups; 1 on a GPU, which hands them out one by one.
override RUNS: u32 = 1;

/// The number of an eye pass' thread. On a software device neighbouring workgroups go to different runs: a bright, crowded lower half
/// of the picture would else keep one core busy while the other waits. The host rounds the dispatch up to whole runs.
fn eye_thread(group: vec3u, groups: vec3u, local: u32) -> u32 {
  let number = workgroup_number(group);
  let run_length = groups.x * groups.y / RUNS;
  return ((number % run_length) * RUNS + number / run_length) * 64u + local;
}

fn band_pixel_count() -> u32 { return eye.size.x * eye.row_count; }

/// Whether a thread stands for a pixel of the band that is shown.
fn is_shown(band_pixel: u32) -> bool {
  let row = eye.first_row + band_pixel / eye.size.x;
  return band_pixel < band_pixel_count() && row >= eye.resolve_first_row && row < eye.resolve_first_row + eye.resolve_row_count;
}

/// Visible points that a pixel may have; those of slot 1 lie behind all of slot 0.
fn slots_a_pixel() -> u32 { return select(1u, 2u, HAS_CHAINS); }

/// Unit direction in view space through the image point `pixel` (in pixels, row 0 at the top).
fn dir_in_view(pixel: vec2f) -> vec3f {
  return normalize(vec3f(eye.slope_left_top + eye.slope_extent * pixel / vec2f(eye.size), -1.0));
}

fn eccentricity_rad(dir: vec3f) -> f32 {
  return atan2(length(cross(dir, eye.gaze_dir_in_view)), dot(dir, eye.gaze_dir_in_view));
}

/// 0 in the fovea, 1 in the periphery, smooth between.
fn periphery_share(e_rad: f32) -> f32 {
  return smoothstep(eye.fovea_radius_rad, max(eye.transition_radius_rad, eye.fovea_radius_rad + 1e-6), e_rad);
}

fn samples_at(e_rad: f32) -> u32 {
  if (e_rad <= eye.fovea_radius_rad) { return eye.samples.x; }
  if (e_rad <= eye.transition_radius_rad) { return eye.samples.y; }
  return eye.samples.z;
}

fn radius_scale_at(e_rad: f32) -> f32 {
  let b = periphery_share(e_rad);
  // Through the transition's own scale at the middle.
  return select(mix(eye.radius_scale.y, eye.radius_scale.z, 2.0 * b - 1.0), mix(eye.radius_scale.x, eye.radius_scale.y, 2.0 * b), b < 0.5);
}

fn pixel_centre_eccentricity_rad(band_pixel: u32) -> f32 {
  let pixel = vec2u(band_pixel % eye.size.x, eye.first_row + band_pixel / eye.size.x);
  return eccentricity_rad(dir_in_view(vec2f(pixel) + 0.5));
}

struct VisiblePoint {
  position: vec3f,
  packed_normal: u32,             // shading
  throughput: vec3f,              // 0: the slot is empty; negative: it gets the light that was kept, and no light of its own
  packed_geometric_normal: u32,
  diffuse: vec3f,
  packed_wo: u32,
  f0: vec3f,
  packed_alpha_f90: u32,
  coat_f0: vec3f,
  coat_f90: f32,
}

/// In `kept_at`: a surface whose light is not kept, and one whose light will be, but was not.
const NOT_KEPT: u32 = 0xffffffffu;
const NOT_FOUND: u32 = 0xfffffffeu;

/// In `seen_emission`: what a pixel's sample saw.
const SAW_NOTHING: f32 = 0.0;          // it is not one of the pixel's samples
const SAW_AND_WENT_ON: f32 = 1.0;      // mirrors or glass
const SAW_AT_FIRST_SIGHT: f32 = 2.0;   // a surface that ends sight

fn bsdf_of(point: VisiblePoint) -> Bsdf {
  var bsdf: Bsdf;
  bsdf.diffuse = point.diffuse;
  if (HAS_SPECULAR) {
    let alpha_f90 = unpack2x16unorm(point.packed_alpha_f90);
    bsdf.alpha = alpha_f90.x;
    bsdf.f90 = alpha_f90.y;
    bsdf.f0 = point.f0;
    bsdf.coat_f0 = point.coat_f0;
    bsdf.coat_f90 = point.coat_f90;
  }
  return bsdf;
}
