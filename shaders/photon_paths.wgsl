// The state of photon paths between bounces, one wavefront of a batch at a time, and the counters of a map.
// Paths stay in the order of their index and photons in the order (bounce, path), so that the map is the same bits every time.

struct TraceUniform {
  seed: u32,
  frame: u32,
  first_path: u32,       // of this batch
  path_count: u32,       // in this batch
  bounce: u32,
  depth_max: u32,
  capacity: u32,         // photons that the map holds
  padding: u32,
}

struct PhotonCounters {
  alive: u32,            // paths of this batch that go on
  stored: u32,           // photons in the map, whole batches only
  batch_stored: u32,     // photons of the running batch
  batch_overflows: u32,  // 1: the running batch does not fit and will be taken back
  emitted: u32,          // paths whose photons are in the map: their count divides the flux
  dropped_paths: u32,    // paths of batches that were taken back
  dropped_photons: u32,
  padding: u32,
}

// What a bounce did, in `staged_flags`.
const GOES_ON: u32 = 1u;
const LEAVES_PHOTON: u32 = 2u;
const IS_CAUSTIC: u32 = 4u;

// What a path remembers besides origin, direction and flux.
const PATH_DIFFUSED: u32 = 0x80000000u;   // it has left a gathered lobe: no longer a caustic path
const NO_MEDIUM: u32 = 0x7fffffffu;       // the other bits: the solid's material that the path is in

struct PhotonPath {
  origin: vec3f,
  state: u32,
  direction: vec3f,
  path: u32,
  flux_w: vec3f,
  padding: u32,
}

// A photon where it met a surface. `packed_incident` points to where it came from.
struct Photon {
  position: vec3f,
  packed_incident: u32,
  flux_w: vec3f,
  packed_normal: u32,
}

@group(1) @binding(0) var<uniform> tracing: TraceUniform;
