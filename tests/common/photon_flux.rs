//! The photons that a scene's lights send out, read back from the device.

use glam::Vec3;
use macula::gpu::layout::PhotonCounters;
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

/// Copies the photons to buffers that the host can read.
const COPY_PHOTONS: &str = "
@group(0) @binding(0) var<storage, read_write> copied_position: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> copied_flux: array<vec4f>;
//! split photon_position: vec4f, read, 1, 16
//! split photon_flux: vec4f, read, 1, 32

@compute @workgroup_size(64)
fn copy_photons(@builtin(global_invocation_id) id: vec3u) {
  if (id.x >= arrayLength(&copied_flux)) { return; }
  copied_position[id.x] = load_photon_position(id.x);
  copied_flux[id.x] = load_photon_flux(id.x);
}
";

/// A stored photon. Over the count of emitted paths its flux is the power that it stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StoredPhoton {
    pub position: Vec3,
    pub flux_w: [f64; 3],
    pub is_caustic: bool,
}

/// Traces a map and reads its photons, in the order in which they are stored.
pub fn trace(
    tracer: &PhotonTracer,
    settings: &TraceSettings,
) -> (Vec<StoredPhoton>, PhotonCounters) {
    let gpu = gpu();
    let capacity = u64::from(tracer.store().capacity());
    let buffer = |name| resources::storage::<[f32; 4]>(gpu, name, capacity).unwrap();
    let (positions, fluxes) = (buffer("copied_position"), buffer("copied_flux"));
    let source = compose_text("copy_photons", COPY_PHOTONS, &|_| tracer.store().chunks()).unwrap();
    let name = "copy_photons";
    let kernel = Kernel::from_source(gpu, Stage { name }, source, &[]).unwrap();
    let bound = tracer.store().resources();
    let bound = bound.with("copied_position", &positions);
    let kernel = kernel
        .bind(gpu, &bound.with("copied_flux", &fluxes))
        .unwrap();
    let mut timer = PassTimer::new(gpu);
    let mut recorder = Recorder::new(gpu, &mut timer);
    tracer.record(&mut recorder, settings);
    recorder.pass("copy", &[(&kernel, tracer.store().capacity())]);
    recorder.finish().unwrap();

    let counters = tracer.store().counters(gpu).unwrap();
    let read = |buffer| -> Vec<[f32; 4]> {
        resources::read_back(gpu, buffer, u64::from(counters.stored)).unwrap()
    };
    let (positions, fluxes) = (read(&positions), read(&fluxes));
    let photon = |(position, flux): (&[f32; 4], &[f32; 4])| StoredPhoton {
        position: Vec3::from_slice(position),
        // The sign tells the class of a photon.
        flux_w: [0, 1, 2].map(|c| f64::from(flux[c].abs())),
        is_caustic: flux[0].is_sign_negative(),
    };
    (
        positions.iter().zip(&fluxes).map(photon).collect(),
        counters,
    )
}

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
    let (photons, counters) = trace(&tracer, &settings);
    assert_eq!((counters.emitted, counters.dropped_photons), (paths, 0));
    photons.iter().map(|photon| photon.flux_w).collect()
}
