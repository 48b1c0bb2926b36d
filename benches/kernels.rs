//! How the device's kernels stand beside native code on the same processor: traversal against obvhs' BVH2, and the photon gather
//! against a counting-sort grid, in rays and queries per CPU-second, side by side in one run.
//!
//!     cargo bench --bench kernels [-- SCENE.glb]
//!
//! Meant for a software Vulkan device, where both run on the same cores; on a GPU the ratio says how much faster the GPU is than one
//! core. Rates are per CPU-second of the whole process, so that a busy machine does not decide the result; the best of five runs counts.

use std::path::{Path, PathBuf};

use cpu_time::ProcessTime;
use glam::{Vec3, Vec3A};
use macula::gpu::pass::{BoundKernel, Kernel, Recorder, Resources};
use macula::gpu::shader::{self, Stage};
use macula::gpu::timing::PassTimer;
use macula::gpu::{GpuDevice, Headless, resources};
use macula::scene::Scene;
use macula::scene::bvh::SceneCaster;
use macula::scene::gpu_scene::GpuScene;
use rayon::prelude::*;

const RAYS: usize = 1 << 20;
const PHOTONS: usize = 500_000;
const QUERIES: usize = 1 << 18;
/// Photons that a query finds on average.
const FOUND: f32 = 50.0;
const RUNS: usize = 5;

type Error = Box<dyn std::error::Error>;

fn main() -> Result<(), Error> {
    let scene_argument = std::env::args()
        .skip(1)
        .find(|argument| !argument.starts_with("--"));
    let bundled = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/room.glb");
    let path = scene_argument.map_or(bundled, PathBuf::from);
    let scene = Scene::load(&path)?;
    let caster = SceneCaster::new(&scene);
    let gpu = GpuDevice::create(&Headless::default())?;
    println!(
        "device: {}; scene: {}, {} static triangles",
        gpu.info.name,
        scene.name,
        scene.static_mesh.triangles.len()
    );
    traversal(&gpu, &scene, &caster)?;
    gather(&gpu)?;
    Ok(())
}

/// The same splitmix sequence for both sides.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    }

    fn direction(&mut self) -> Vec3 {
        let z = 1.0 - 2.0 * self.next();
        let phi = std::f32::consts::TAU * self.next();
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * phi.cos(), r * phi.sin(), z)
    }
}

/// Best CPU seconds of the runs, after one to warm up.
fn best_cpu_s(mut run: impl FnMut() -> Result<(), Error>) -> Result<f64, Error> {
    run()?;
    let mut best = f64::INFINITY;
    for _ in 0..RUNS {
        let start = ProcessTime::now();
        run()?;
        best = best.min(start.elapsed().as_secs_f64());
    }
    Ok(best)
}

fn report(what: &str, count: usize, native_s: f64, device_s: f64) {
    let rate = |seconds: f64| count as f64 / seconds * 1e-6;
    println!(
        "{what}: native {:.2} M per CPU-second, WGSL {:.2} M per CPU-second, ratio {:.2}",
        rate(native_s),
        rate(device_s),
        native_s / device_s
    );
}

/// Rays of diffuse bounces in wavefront order: neighbours in the array belong to unrelated paths.
fn bounce_rays(scene: &Scene, caster: &SceneCaster) -> Vec<[[f32; 4]; 2]> {
    let mut random = Random(7);
    let pose = scene.pose_at(0.0);
    let mut starts: Vec<(Vec3, Vec3)> = Vec::new();
    let mut rays = Vec::with_capacity(RAYS);
    let eye = scene
        .cameras
        .first()
        .map_or(scene.bounds.center(), |camera| camera.pose.position_m);
    while rays.len() < RAYS {
        if starts.is_empty() {
            starts = (0..RAYS / 4).map(|_| (eye, random.direction())).collect();
        }
        let next: Vec<Option<(Vec3, f32, Vec3)>> = starts
            .par_iter()
            .map(|(origin, direction)| {
                let hit = caster.first_hit(*origin, *direction, f32::INFINITY, &pose)?;
                if hit.object.is_some() {
                    return None;
                }
                let [a, b, c] = scene.static_mesh.corners(hit.triangle as usize);
                let normal = (b - a).cross(c - a).normalize_or_zero();
                let facing = if normal.dot(*direction) > 0.0 {
                    -normal
                } else {
                    normal
                };
                Some((*origin + *direction * hit.t + facing * 1e-4, hit.t, facing))
            })
            .collect();
        starts = next
            .into_iter()
            .flatten()
            .map(|(origin, _, normal)| {
                (
                    origin,
                    (normal + random.direction() * 0.999).normalize_or(normal),
                )
            })
            .collect();
        rays.extend(
            starts
                .iter()
                .map(|(o, d)| [[o.x, o.y, o.z, 0.0], [d.x, d.y, d.z, 0.0]]),
        );
    }
    rays.truncate(RAYS);
    rays
}

const TRAVERSAL: &str = "//! use threads, traversal
// Nearest hits of given rays.
@group(1) @binding(0) var<storage, read> rays: array<vec4f>;
@group(1) @binding(1) var<storage, read_write> hits: array<vec2f>;
@compute @workgroup_size(64)
fn bench_traversal(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
  let index = workgroup_number(group) * 64u + local;
  if (index >= arrayLength(&hits)) { return; }
  let hit = trace_geometry(Ray(rays[index * 2u].xyz, 3.0e38, rays[index * 2u + 1u].xyz), false);
  hits[index] = vec2f(hit.t, f32(hit.triangle));
}
";

fn run_on_device(gpu: &GpuDevice, dispatches: &[(&BoundKernel, u32)]) -> Result<(), Error> {
    let mut timer = PassTimer::new(gpu);
    let mut recorder = Recorder::new(gpu, &mut timer);
    recorder.pass("bench", dispatches);
    recorder.finish()?;
    Ok(())
}

fn traversal(gpu: &GpuDevice, scene: &Scene, caster: &SceneCaster) -> Result<(), Error> {
    let rays = bounce_rays(scene, caster);
    let mut native_t = vec![0f32; RAYS];
    let bvh = &caster.static_bvh;
    let native_s = best_cpu_s(|| {
        native_t.par_iter_mut().zip(&rays).for_each(|(t, [o, d])| {
            let origin = Vec3A::from_slice(o);
            let ray = obvhs::ray::Ray::new(origin, Vec3A::from_slice(d), 0.0, f32::INFINITY);
            let mut hit = obvhs::ray::RayHit::none();
            bvh.bvh.ray_traverse(ray, &mut hit, |ray, position| {
                bvh.triangles[position].intersect(ray)
            });
            *t = hit.t;
        });
        Ok(())
    })?;

    let on_gpu = GpuScene::new(gpu, scene, caster, &scene.pose_at(0.0))?;
    let ray_buffer = resources::storage_with(gpu, "rays", &rays)?;
    let hits = resources::storage::<[f32; 2]>(gpu, "hits", RAYS as u64)?;
    let stage = Stage {
        name: "bench_traversal",
    };
    let source = shader::compose_text(stage.name, TRAVERSAL, &|array| {
        on_gpu.shader_size(array).unwrap_or(1)
    })?;
    let kernel = Kernel::from_source(gpu, stage, source, &[("HAS_OBJECTS", 0.0)])?;
    let bound = kernel.bind(
        gpu,
        &on_gpu
            .resources()
            .with("rays", &ray_buffer)
            .with("hits", &hits),
    )?;
    let device_s = best_cpu_s(|| run_on_device(gpu, &[(&bound, RAYS as u32)]))?;

    let device_hits: Vec<[f32; 2]> = resources::read_back(gpu, &hits, RAYS as u64)?;
    let agreeing = native_t
        .iter()
        .zip(&device_hits)
        .filter(|(native, device)| (*native - device[0]).abs() <= 1e-4 * native.max(1.0))
        .count();
    println!(
        "traversal: {:.3} % of the hits agree",
        100.0 * agreeing as f64 / RAYS as f64
    );
    report("traversal (rays)", RAYS, native_s, device_s);
    Ok(())
}

const GATHER: &str = "//! use threads
// The counting grid of the photon map, bare: 9 runs of 3 cells and an Epanechnikov kernel.
struct Grid { origin: vec3f, cells_per_m: f32, dimensions: vec3u, radius2: f32 }
@group(0) @binding(0) var<uniform> grid: Grid;
@group(0) @binding(1) var<storage, read> starts: array<u32>;
@group(0) @binding(2) var<storage, read> positions: array<vec4f>;
@group(0) @binding(3) var<storage, read> queries: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> sums: array<f32>;
@compute @workgroup_size(64)
fn bench_gather(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
  let index = workgroup_number(group) * 64u + local;
  if (index >= arrayLength(&sums)) { return; }
  let x = queries[index].xyz;
  let cell = vec3i(floor((x - grid.origin) * grid.cells_per_m));
  let dimensions = vec3i(grid.dimensions);
  let first_x = u32(max(cell.x - 1, 0));
  let last_x = u32(min(cell.x + 1, dimensions.x - 1));
  let inverse = 1.0 / grid.radius2;
  var sum = 0.0;
  for (var dz = -1; dz <= 1; dz++) { for (var dy = -1; dy <= 1; dy++) {
    let y = cell.y + dy; let z = cell.z + dz;
    if (y < 0 || z < 0 || y >= dimensions.y || z >= dimensions.z) { continue; }
    let row = (u32(z) * grid.dimensions.y + u32(y)) * grid.dimensions.x;
    let end = starts[row + last_x + 1u];
    for (var i = starts[row + first_x]; i < end; i++) {
      let photon = positions[i];
      let d = photon.xyz - x;
      let distance2 = dot(d, d);
      if (distance2 < grid.radius2) { sum += photon.w * (1.0 - distance2 * inverse); }
    }
  } }
  sums[index] = sum;
}
";

struct NativeGrid {
    dimensions: [usize; 3],
    cells_per_m: f32,
    starts: Vec<u32>,
    positions: Vec<[f32; 4]>,
}

impl NativeGrid {
    /// Counting sort of photons in the unit cube.
    fn build(photons: &[[f32; 4]], radius_m: f32) -> Self {
        let cells_per_m = 1.0 / radius_m;
        let side = (1.0 / radius_m) as usize + 1;
        let cell = |p: &[f32; 4]| {
            let at = |x: f32| ((x * cells_per_m) as usize).min(side - 1);
            (at(p[2]) * side + at(p[1])) * side + at(p[0])
        };
        let mut starts = vec![0u32; side * side * side + 1];
        photons.iter().for_each(|p| starts[cell(p) + 1] += 1);
        for index in 1..starts.len() {
            starts[index] += starts[index - 1];
        }
        let mut next = starts.clone();
        let mut positions = vec![[0f32; 4]; photons.len()];
        for photon in photons {
            let slot = &mut next[cell(photon)];
            positions[*slot as usize] = *photon;
            *slot += 1;
        }
        Self {
            dimensions: [side; 3],
            cells_per_m,
            starts,
            positions,
        }
    }

    fn gather(&self, x: &[f32; 4], radius2: f32) -> f32 {
        let [width, height, depth] = self.dimensions;
        let at = |x: f32, size: usize| ((x * self.cells_per_m) as usize).min(size - 1);
        let (cx, cy, cz) = (at(x[0], width), at(x[1], height), at(x[2], depth));
        let mut sum = 0.0;
        for z in cz.saturating_sub(1)..=(cz + 1).min(depth - 1) {
            for y in cy.saturating_sub(1)..=(cy + 1).min(height - 1) {
                let row = (z * height + y) * width;
                let run = self.starts[row + cx.saturating_sub(1)] as usize
                    ..self.starts[row + (cx + 1).min(width - 1) + 1] as usize;
                for photon in &self.positions[run] {
                    let d = [photon[0] - x[0], photon[1] - x[1], photon[2] - x[2]];
                    let distance2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
                    if distance2 < radius2 {
                        sum += photon[3] * (1.0 - distance2 / radius2);
                    }
                }
            }
        }
        sum
    }
}

/// Photons on the walls of the unit cube, queries on the same walls in the order of an image's rows.
fn gather(gpu: &GpuDevice) -> Result<(), Error> {
    let mut random = Random(11);
    let on_wall = |u: f32, v: f32, wall: u32| {
        let near = (wall % 2) as f32 * 0.999_9;
        match wall / 2 {
            0 => [near, u, v, 1.0],
            1 => [u, near, v, 1.0],
            _ => [u, v, near, 1.0],
        }
    };
    let photons: Vec<[f32; 4]> = (0..PHOTONS)
        .map(|_| on_wall(random.next(), random.next(), (random.next() * 6.0) as u32))
        .collect();
    let rows = 512;
    let queries: Vec<[f32; 4]> = (0..QUERIES)
        .map(|index| {
            on_wall(
                (index % rows) as f32 / rows as f32,
                (index / rows) as f32 / rows as f32,
                (index * 6 / QUERIES) as u32,
            )
        })
        .collect();
    let radius_m = (6.0 * FOUND / (std::f32::consts::PI * PHOTONS as f32)).sqrt();
    let grid = NativeGrid::build(&photons, radius_m);
    let mut native = vec![0f32; QUERIES];
    let native_s = best_cpu_s(|| {
        native
            .par_iter_mut()
            .zip(&queries)
            .for_each(|(sum, x)| *sum = grid.gather(x, radius_m * radius_m));
        Ok(())
    })?;

    let uniform = resources::uniform::<[f32; 8]>(gpu, "grid");
    let side = f32::from_bits(grid.dimensions[0] as u32);
    let value = [
        0.0,
        0.0,
        0.0,
        grid.cells_per_m,
        side,
        side,
        side,
        radius_m * radius_m,
    ];
    gpu.queue
        .write_buffer(&uniform, 0, bytemuck::cast_slice(&value));
    let starts = resources::storage_with(gpu, "starts", &grid.starts)?;
    let positions = resources::storage_with(gpu, "positions", &grid.positions)?;
    let query_buffer = resources::storage_with(gpu, "queries", &queries)?;
    let sums = resources::storage::<f32>(gpu, "sums", QUERIES as u64)?;
    let stage = Stage {
        name: "bench_gather",
    };
    let kernel = Kernel::from_source(
        gpu,
        stage,
        shader::compose_text(stage.name, GATHER, &|_| 1)?,
        &[],
    )?;
    let bound = kernel.bind(
        gpu,
        &Resources::default()
            .with("grid", &uniform)
            .with("starts", &starts)
            .with("positions", &positions)
            .with("queries", &query_buffer)
            .with("sums", &sums),
    )?;
    let device_s = best_cpu_s(|| run_on_device(gpu, &[(&bound, QUERIES as u32)]))?;
    let device: Vec<f32> = resources::read_back(gpu, &sums, QUERIES as u64)?;
    let agreeing = native
        .iter()
        .zip(&device)
        .filter(|(a, b)| (*a - *b).abs() <= 1e-3 * a.max(1.0))
        .count();
    println!(
        "gather: {:.3} % of the sums agree",
        100.0 * agreeing as f64 / QUERIES as f64
    );
    report("gather (queries)", QUERIES, native_s, device_s);
    Ok(())
}
