// Threads of a dispatch are numbered row by row, because one dimension of a dispatch holds at most 65 535 workgroups
// (`WORKGROUPS_PER_DIMENSION` in src/gpu/pass.rs).

const WORKGROUPS_PER_DIMENSION: u32 = 65535u;

fn workgroup_number(workgroup_id: vec3u) -> u32 {
  return workgroup_id.y * WORKGROUPS_PER_DIMENSION + workgroup_id.x;
}
