// The photon map as a sorted grid: photons lie in the order of their cell, cells in x-runs, so that three neighbours in x are one
// contiguous run. Two classes of photons, each with its own grid and radius: global and caustic.
// Source: counting grid with 9 runs, measured against hash grids and boxes (ARCHITECTURE.md, "Gather").
// Limits: 2^22 cells over both grids (`CELLS_MAX` in src/photon/map.rs).

struct PhotonGrid {
  origin: vec3f,
  cells_per_m: f32,
  dimensions: vec3u,
  first_cell: u32,
}

struct PhotonMapUniform {
  grids: array<PhotonGrid, 2>,
  global_radius_m: f32,
  caustic_radius_m: f32,
  cell_count: u32,
  normal_cos_min: f32,
  flatness: f32,
  padding0: u32,
  padding1: u32,
  padding2: u32,
}
const GLOBAL: u32 = 0u;
const CAUSTIC: u32 = 1u;

/// How far apart two sheets of surface must lie, in radii, to be told from one.
const SHEETS_APART: f32 = 0.05;

/// Whether two points, `offset_m` apart, may lie on one surface by its sides there: on a bulge either lies under the tangent plane of the
/// other, in a hollow over it, and in a plane both on it. Where one lies over and the other under, one sheet lies behind the other.
fn is_one_sheet(offset_m: vec3f, normal: vec3f, other_normal: vec3f, radius_m: f32) -> bool {
  let other_over = dot(offset_m, normal);
  let over_other = -dot(offset_m, other_normal);
  return other_over * over_other >= 0.0 || min(abs(other_over), abs(over_other)) <= SHEETS_APART * radius_m;
}

@group(1) @binding(8) var<uniform> photon_map: PhotonMapUniform;

fn grid_cell(class_: u32, position: vec3f) -> vec3i {
  let cell = floor((position - photon_map.grids[class_].origin) * photon_map.grids[class_].cells_per_m);
  return vec3i(clamp(cell, vec3f(-2.0), vec3f(1e6)));
}

fn cell_key(class_: u32, cell: vec3i) -> u32 {
  let dimensions = photon_map.grids[class_].dimensions;
  let c = vec3u(clamp(cell, vec3i(0), vec3i(dimensions) - 1));
  return photon_map.grids[class_].first_cell + (c.z * dimensions.y + c.y) * dimensions.x + c.x;
}
