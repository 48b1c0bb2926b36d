//! use photon_paths, photon_map, coverage
// Photons around a receiver: which of them count, and how much.
// Source: Jensen 1996, section 3.2, with an Epanechnikov kernel of two dimensions; normals are tested before a photon counts, so
// that the far side of a thin wall stays dark.
// Limits: a photon counts only within `flatness` radii of the tangent plane, and where its sheet is not behind the receiver's.

@group(1) @binding(5) var<storage, read> cell_counts: array<u32>;
//! split map_position: vec4f, read, 1, 48
//! split map_flux: vec4f, read, 1, 64

/// The kernel's value for a photon, 0 where it does not count.
fn kernel_at(place: vec3f, geometric_normal: vec3f, photon: vec3f, packed_normal: u32, inverse_radius2: f32, plane_reach_m: f32) -> f32 {
  let offset = photon - place;
  let kernel = 1.0 - dot(offset, offset) * inverse_radius2;
  let normal = unpack_normal(packed_normal);
  let counts = kernel > 0.0 && abs(dot(offset, geometric_normal)) <= plane_reach_m
    && dot(normal, geometric_normal) >= photon_map.normal_cos_min
    && is_one_sheet(offset, geometric_normal, normal, plane_reach_m / photon_map.flatness);
  return select(0.0, kernel, counts);
}

/// The photons of neighbouring cells along x: the first, and the one after the last.
fn run_of_cells(class_: u32, x_first: i32, x_last: i32, y: i32, z: i32) -> vec2u {
  let dimensions = vec3i(photon_map.grids[class_].dimensions);
  if (x_first > x_last || y < 0 || z < 0 || y >= dimensions.y || z >= dimensions.z) { return vec2u(0u); }
  return vec2u(cell_counts[cell_key(class_, vec3i(x_first, y, z))], cell_counts[cell_key(class_, vec3i(x_last, y, z)) + 1u]);
}

/// One of the nine runs of three cells around a cell.
fn run_around(class_: u32, cell: vec3i, row: i32) -> vec2u {
  let x_last = min(cell.x + 1, i32(photon_map.grids[class_].dimensions.x) - 1);
  return run_of_cells(class_, max(cell.x - 1, 0), x_last, cell.y + row % 3 - 1, cell.z + row / 3 - 1);
}

/// Whether any photon lies in the cells around a point: most points see no caustic, and need no look at their surroundings for it.
fn has_photons_near(class_: u32, position: vec3f) -> bool {
  let cell = grid_cell(class_, position);
  var count = 0u;
  for (var row = 0; row < 9; row++) {
    let run = run_around(class_, cell, row);
    count += run.y - run.x;
  }
  return count > 0u;
}
