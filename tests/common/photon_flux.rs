//! The flux of the photons that a scene's lights send out, read back from the device.

use macula::gpu::pass::{Kernel, Recorder};
use macula::gpu::resources;
use macula::gpu::shader::{Stage, compose_text};
use macula::gpu::timing::PassTimer;
use macula::params::Params;
use macula::photon::{PhotonTracer, TraceSettings};
use macula::scene::Scene;
use macula::scene::bvh::SceneCaster;
use macula::scene::gpu_scene::GpuScene;
use macula::technique;

use crate::maker::gpu;

/// Copies the photons' flux to a buffer that the host can read.
const COPY_FLUX: &str = "
@group(0) @binding(0) var<storage, read_write> copied: array<vec4f>;
//! split photon_flux: vec4f, read, 0, 1

@compute @workgroup_size(64)
fn copy_flux(@builtin(global_invocation_id) id: vec3u) {
  if (id.x < arrayLength(&copied)) { copied[id.x] = load_photon_flux(id.x); }
}
";

/// The flux, W, of every photon of `paths` paths that end at surface `depth_max`; divided by the paths, their sum is the power that comes to
/// surfaces. All paths fit the map.
pub fn photon_fluxes_w(scene: &Scene, paths: u32, depth_max: u32) -> Vec<[f64; 3]> {
    let gpu = gpu();
    let (caster, pose) = (SceneCaster::new(scene), scene.pose_at(0.0));
    let on_gpu = GpuScene::new(gpu, scene, &caster, &pose).unwrap();
    let mut params = Params::default();
    params.photon.count = paths;
    let mut constants = technique::effects(scene, &params).constants();
    constants.push(("STORE_DIRECT", 1.0));
    let tracer = PhotonTracer::new(gpu, &on_gpu, &params, &constants).unwrap();
    let settings = TraceSettings {
        path_count: paths,
        depth_max,
        seed: 1,
        frame: 0,
    };
    let capacity = u64::from(tracer.capacity());
    let copied = resources::storage::<[f32; 4]>(gpu, "copied", capacity).unwrap();
    let source = compose_text("copy_flux", COPY_FLUX, &|_| tracer.chunks()).unwrap();
    let stage = Stage { name: "copy_flux" };
    let kernel = Kernel::from_source(gpu, stage, source, &[]).unwrap();
    let bound = tracer.resources().with("copied", &copied);
    let kernel = kernel.bind(gpu, &bound).unwrap();
    let mut timer = PassTimer::new(gpu);
    let mut recorder = Recorder::new(gpu, &mut timer);
    tracer.record(&mut recorder, &settings);
    recorder.pass("copy", &[(&kernel, tracer.capacity())]);
    recorder.finish().unwrap();

    let counters = tracer.counters(gpu).unwrap();
    assert_eq!((counters.emitted, counters.dropped_photons), (paths, 0));
    let fluxes: Vec<[f32; 4]> =
        resources::read_back(gpu, &copied, u64::from(counters.stored)).unwrap();
    // The sign tells the class of a photon.
    let flux = |[r, g, b, _]: &[f32; 4]| [*r, *g, *b].map(|x| f64::from(x.abs()));
    fluxes.iter().map(flux).collect()
}
