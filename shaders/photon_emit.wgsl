//! use threads, random, lights, photon_paths
// Starts a batch of photon paths at the lights.
// Source: Jensen, "Global Illumination using Photon Maps", 1996, section 2; light picked by power.
// Limits: a batch that finds the map full starts nothing, and the host sees it in the counters; so does one while no light shines.

@group(1) @binding(1) var<storage, read_write> paths: array<PhotonPath>;
@group(1) @binding(2) var<storage, read_write> counters: PhotonCounters;

@group(1) @binding(3) var<storage, read_write> next_dispatch: array<u32, 3>;

@compute @workgroup_size(64)
fn photon_emit(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
  let index = workgroup_number(group) * 64u + local;
  let starts_nothing = counters.dropped_paths > 0u || scene.light_count == 0u;
  if (index == 0u) {
    counters.alive = select(tracing.path_count, 0u, starts_nothing);
    counters.batch_stored = 0u;
    counters.batch_overflows = 0u;
    next_dispatch[0] = (counters.alive + 63u) / 64u;
    next_dispatch[1] = 1u;
    next_dispatch[2] = 1u;
  }
  if (index >= tracing.path_count || starts_nothing) { return; }
  let path = tracing.first_path + index;
  let seed = pcg4d(vec4u(tracing.seed, tracing.frame, 0x70686f74u, 0u));
  let pick = sobol2(path, seed.x);
  let u_position = sobol2(path, seed.y);
  let u_direction = sobol2(path, seed.z);
  let emitted = emit_photon(lights[pick_light(pick.x)], u_position, u_direction, pick.y);
  paths[index] = PhotonPath(emitted.origin, NO_MEDIUM, emitted.direction, path, emitted.flux_w, 0u);
}
