//! use photon_map
// Irradiance records: what photons bring to places on surfaces, kept there for paths to find.
// Source: irradiance caching (Ward, Rubinstein and Clear 1988) with records where paths land, filled from a photon map (Christensen,
// "Faster Photon Map Global Illumination", 1999).
// A record is laid out as a photon: its flux is irradiance, W/m2, its incident direction one of those that light came from, drawn in
// proportion to what each brought. Its normal is marked where walls or edges are near, so that sight of it is not a matter of course.
// Limits: a path finds a record within a radius, in its plane, with a like normal, and in sight; without one it goes on by itself.

@group(1) @binding(5) var<storage, read> cell_counts: array<u32>;
//! split map_position: vec4f, read, 1, 48
//! split map_flux: vec4f, read, 1, 64

/// Records of a cell that are looked at: where paths crowd there are more than need be.
override RECORDS_A_CELL: u32 = 4u;
/// Farthest that a record may lie from the tangent plane, in radii.
const RECORD_FLATNESS: f32 = 0.1;
/// How high over the surface the ray runs that looks for the record, as a share of its distance.
const RECORD_SIGHT_HEIGHT: f32 = 0.1;

struct FoundRecord {
  is_found: bool,
  irradiance: vec3f,
  direction: vec3f,
}

/// A record that can stand for a point of a surface: of the cell around a place nearby that `u` picks, the nearest to that place. Chance
/// in place of a blend of neighbours: it costs one look, and what it averages is the same.
fn find_record(position: vec3f, normal: vec3f, u: vec2f) -> FoundRecord {
  let radius_m = photon_map.global_radius_m;
  let tangents = frame_around(normal);
  let near = (u - 0.5) / photon_map.grids[GLOBAL].cells_per_m;
  let target_ = position + tangents[0] * near.x + tangents[1] * near.y;
  let key = cell_key(GLOBAL, grid_cell(GLOBAL, target_));
  let first = cell_counts[key];
  let last = min(cell_counts[key + 1u], first + RECORDS_A_CELL);
  var found = first;
  var found_distance2 = 3.0e38;
  for (var i = first; i < last; i++) {
    let place = load_map_position(i).xyz;
    let offset = place - position;
    let is_alike = dot(unpack_normal(bitcast<u32>(load_map_flux(i).w)), normal) >= photon_map.normal_cos_min
      && abs(dot(offset, normal)) <= RECORD_FLATNESS * radius_m && dot(offset, offset) <= radius_m * radius_m;
    let distance2 = dot(place - target_, place - target_);
    if (is_alike && distance2 < found_distance2) {
      found = i;
      found_distance2 = distance2;
    }
  }
  if (found_distance2 > 1.0e38) { return FoundRecord(false, vec3f(0.0), normal); }
  let record = load_map_position(found);
  let flux = load_map_flux(found);
  var is_seen = true;
  for (var once = 0u; once < select(0u, 1u, is_marked(bitcast<u32>(flux.w))); once++) {
    let height_m = max(RECORD_SIGHT_HEIGHT * distance(record.xyz, position), scene.ray_offset_m);
    let along = record.xyz - position;
    let distance_m = length(along);
    is_seen = distance_m <= scene.ray_offset_m || !is_occluded(position + normal * height_m, along / distance_m, distance_m);
  }
  return FoundRecord(is_seen, flux.xyz, unpack_direction(bitcast<u32>(record.w)));
}
