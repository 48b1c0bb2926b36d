//! use photon_paths
// Ends a batch: its photons count if they all fit, else the whole batch is taken back and counted as dropped.

@group(1) @binding(1) var<storage, read_write> counters: PhotonCounters;

@compute @workgroup_size(1)
fn photon_commit() {
  if (counters.dropped_paths > 0u || counters.batch_overflows != 0u) {
    counters.dropped_paths += tracing.path_count;
    counters.dropped_photons += counters.batch_stored;
  } else {
    counters.stored += counters.batch_stored;
    counters.emitted += tracing.path_count;
  }
}
