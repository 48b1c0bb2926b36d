//! use photon_map
// Irradiance records: what photons bring to places on surfaces, kept there for paths to find.
// Source: irradiance caching (Ward, Rubinstein and Clear 1988) with records where paths land, filled from a photon map (Christensen,
// "Faster Photon Map Global Illumination", 1999).
// A record is laid out as a photon: its flux is irradiance, W/m2, its incident direction one of those that light came from, drawn in
// proportion to what each brought.
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
/// Nearest records that are tried.
const RECORDS_TRIED: u32 = 4u;

struct FoundRecord {
  is_found: bool,
  irradiance: vec3f,
  direction: vec3f,
}

/// The nearest record that can stand for a point of a surface.
fn find_record(position: vec3f, normal: vec3f) -> FoundRecord {
  let cell = grid_cell(GLOBAL, position);
  let dimensions = vec3i(photon_map.grids[GLOBAL].dimensions);
  let radius_m = photon_map.global_radius_m;
  // The nearest so far, in order.
  var distances2 = array<f32, RECORDS_TRIED>(radius_m * radius_m, radius_m * radius_m, radius_m * radius_m, radius_m * radius_m);
  var places = array<u32, RECORDS_TRIED>(0u, 0u, 0u, 0u);
  var count = 0u;
  for (var neighbour = 0; neighbour < 27; neighbour++) {
    let place = cell + vec3i(neighbour % 3, (neighbour / 3) % 3, neighbour / 9) - 1;
    if (any(place < vec3i(0)) || any(place >= dimensions)) { continue; }
    let key = cell_key(GLOBAL, place);
    let first = cell_counts[key];
    let last = min(cell_counts[key + 1u], first + RECORDS_A_CELL);
    for (var i = first; i < last; i++) {
      let offset = load_map_position(i).xyz - position;
      let distance2 = dot(offset, offset);
      if (distance2 >= distances2[RECORDS_TRIED - 1u] || abs(dot(offset, normal)) > RECORD_FLATNESS * radius_m) { continue; }
      if (dot(unpack_normal(bitcast<u32>(load_map_flux(i).w)), normal) < photon_map.normal_cos_min) { continue; }
      var candidate_distance2 = distance2;
      var candidate = i;
      for (var rank = 0u; rank < RECORDS_TRIED; rank++) {
        if (candidate_distance2 < distances2[rank]) {
          let displaced_distance2 = distances2[rank];
          let displaced = places[rank];
          distances2[rank] = candidate_distance2;
          places[rank] = candidate;
          candidate_distance2 = displaced_distance2;
          candidate = displaced;
        }
      }
      count++;
    }
  }
  for (var rank = 0u; rank < min(count, RECORDS_TRIED); rank++) {
    let record = load_map_position(places[rank]);
    let height_m = max(RECORD_SIGHT_HEIGHT * sqrt(distances2[rank]), scene.ray_offset_m);
    let start = position + normal * height_m;
    let to_record = record.xyz + normal * height_m - start;
    let distance_m = length(to_record);
    if (distance_m <= scene.ray_offset_m || !is_occluded(start, to_record / distance_m, distance_m)) {
      let flux = load_map_flux(places[rank]);
      return FoundRecord(true, flux.xyz, unpack_direction(bitcast<u32>(record.w)));
    }
  }
  return FoundRecord(false, vec3f(0.0), normal);
}
