//! use photon_start
// Starts a batch of photon paths at the lights.
// Source: Jensen, "Global Illumination using Photon Maps", 1996, section 2; light picked from the table of lights.wgsl.

@compute @workgroup_size(64)
fn photon_emit(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
  let index = workgroup_number(group) * 64u + local;
  if (!starts_path(index)) { return; }
  let path = tracing.first_path + index;
  let seeds = start_seeds();
  let pick = sobol2(path, seeds.x);
  let u_position = sobol2(path, seeds.y);
  let u_direction = sobol2(path, seeds.z);
  start_path(index, emit_photon(lights[pick_light(pick.x)], u_position, u_direction, pick.y));
}
