//! use threads, eye, scattered_path
// Places for irradiance records: where paths from the focus region land. Each thread looks into the region, scatters once, and puts its
// record on the surface that is met.
// Source: ours. The prototype spread records evenly by area; where paths land they lie on the sides of surfaces that are asked for, in
// the rooms that are asked for, and closer together the nearer they are asked from.
// Limits: a thread that meets nothing leaves a record that no look-up takes, somewhere in the scene.

/// Records to place.
override RECORD_COUNT: u32 = 1u;

//! split photon_position: vec4f, read_write, 1, 16
//! split photon_flux: vec4f, read_write, 1, 32

/// A direction into the focus region: in the cone around the gaze, or anywhere in the image where that is all of it.
fn focus_dir_in_view(u: vec2f) -> vec3f {
  if (eye.transition_radius_rad >= 0.5 * PI) { return dir_in_view(u * vec2f(eye.size)); }
  return frame_around(eye.gaze_dir_in_view) * cap_sample(u, cos(eye.transition_radius_rad));
}

@compute @workgroup_size(64)
fn record_points(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
  let index = workgroup_number(group) * 64u + local;
  if (index >= RECORD_COUNT) { return; }
  let seeds = pcg4d(vec4u(eye.seed, eye.frame, 0x7265636fu, 0u));
  var random = random_start(seeds.z, eye.frame, index, 0x400u);
  let direction = affine_vector(eye.scene_from_view, focus_dir_in_view(sobol2(index, seeds.x)));
  let origin = vec3f(eye.scene_from_view[0].w, eye.scene_from_view[1].w, eye.scene_from_view[2].w);
  var path = ScatteredPath(Ray(origin, 3.0e38, direction), vec3f(1.0), UNKNOWN_SOLID, eye.chain_max + 1u, false);
  var seen = vec3f(0.0);
  let first = follow(&path, &random, &seen);
  var place = first;
  if (first.is_found) {
    let scatter = sample_gathered(first.bsdf, first.n, first.geometric_normal, first.wo, vec3f(sobol2(index, seeds.y), random_next4(&random).x));
    if (max_component(scatter.weight) > 0.0) {
      leave_vertex(&path, first, scatter, scatter.weight);
      path.surfaces_left = eye.path_depth_max;
      let second = follow(&path, &random, &seen);
      if (second.is_found) { place = second; }
    }
  }
  if (!place.is_found || !any(place.bsdf.diffuse > vec3f(0.0))) {
    let anywhere = scene.bounds_center + scene.bounds_radius_m * 0.5 * (random_next4(&random).xyz * 2.0 - 1.0);
    store_photon_position(index, vec4f(anywhere, 0.0));
    store_photon_flux(index, vec4f(0.0));
    return;
  }
  store_photon_position(index, vec4f(place.position, 0.0));
  store_photon_flux(index, vec4f(0.0, 0.0, 0.0, bitcast<f32>(pack_normal(place.geometric_normal))));
}
