//! use threads, random, lights, photon_paths
// What starts a batch of photon paths, wherever they are sent.
// Limits: a batch that finds the map full starts nothing, and the host sees it in the counters; so does one while no light shines.

@group(1) @binding(1) var<storage, read_write> paths: array<PhotonPath>;
@group(1) @binding(2) var<storage, read_write> counters: PhotonCounters;
@group(1) @binding(3) var<storage, read_write> next_dispatch: array<u32, 3>;

/// Whether the thread `index` starts a path; the first one opens the batch.
fn starts_path(index: u32) -> bool {
  let starts_nothing = counters.dropped_paths > 0u || scene.light_count == 0u;
  if (index == 0u) {
    counters.alive = select(tracing.path_count, 0u, starts_nothing);
    counters.batch_stored = 0u;
    counters.batch_overflows = 0u;
    next_dispatch[0] = (counters.alive + 63u) / 64u;
    next_dispatch[1] = 1u;
    next_dispatch[2] = 1u;
  }
  return index < tracing.path_count && !starts_nothing;
}

/// The seeds of a path's random points at its light; those of all paths together are spread evenly.
fn start_seeds() -> vec4u { return pcg4d(vec4u(tracing.seed, tracing.frame, 0x70686f74u, 0u)); }

fn start_path(index: u32, emitted: Emitted) {
  paths[index] = PhotonPath(emitted.origin, NO_MEDIUM, emitted.direction, tracing.first_path + index, emitted.flux_w, 0u);
}
