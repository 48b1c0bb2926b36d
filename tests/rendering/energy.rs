//! Photons carry what the lights give off, no more and no less, and what does not fit is told.

use std::f64::consts::PI;

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

use crate::maker::{Recipe, bundled, gpu, mean, means_agree};

/// Copies the photons' flux to a buffer that the host can read.
const COPY_FLUX: &str = "
@group(0) @binding(0) var<storage, read_write> copied: array<vec4f>;
//! split photon_flux: vec4f, read, 0, 1

@compute @workgroup_size(64)
fn copy_flux(@builtin(global_invocation_id) id: vec3u) {
  if (id.x < arrayLength(&copied)) { copied[id.x] = load_photon_flux(id.x); }
}
";

const PATHS: u32 = 50_000;

/// The power, W, that photons bring to surfaces when paths end at surface `depth_max`.
fn power_on_surfaces_w(scene: &Scene, depth_max: u32) -> [f64; 3] {
    let gpu = gpu();
    let (caster, pose) = (SceneCaster::new(scene), scene.pose_at(0.0));
    let on_gpu = GpuScene::new(gpu, scene, &caster, &pose).unwrap();
    let mut params = Params::default();
    params.photon.count = PATHS;
    let mut constants = technique::effects(scene, &params).constants();
    constants.push(("STORE_DIRECT", 1.0));
    let tracer = PhotonTracer::new(gpu, &on_gpu, &params, &constants).unwrap();
    let settings = TraceSettings {
        path_count: PATHS,
        depth_max,
        seed: 1,
        frame: 0,
    };
    let copied =
        resources::storage::<[f32; 4]>(gpu, "copied", u64::from(tracer.capacity())).unwrap();
    let source = compose_text("copy_flux", COPY_FLUX, &|_| tracer.chunks()).unwrap();
    let stage = Stage { name: "copy_flux" };
    let kernel = Kernel::from_source(gpu, stage, source, &[]).unwrap();
    let kernel = kernel
        .bind(gpu, &tracer.resources().with("copied", &copied))
        .unwrap();
    let mut timer = PassTimer::new(gpu);
    let mut recorder = Recorder::new(gpu, &mut timer);
    tracer.record(&mut recorder, &settings);
    recorder.pass("copy", &[(&kernel, tracer.capacity())]);
    recorder.finish().unwrap();

    let counters = tracer.counters(gpu).unwrap();
    assert_eq!((counters.emitted, counters.dropped_photons), (PATHS, 0));
    let fluxes: Vec<[f32; 4]> =
        resources::read_back(gpu, &copied, u64::from(counters.stored)).unwrap();
    [0, 1, 2].map(|channel| {
        // The sign tells the class of a photon.
        let values = fluxes.iter().map(|flux| f64::from(flux[channel].abs()));
        values.sum::<f64>() / f64::from(PATHS)
    })
}

/// Power of all glowing triangles, W: radiance · pi · area.
fn lamp_power_w(scene: &Scene, radiance_w_m2_sr: f64) -> f64 {
    let mesh = &scene.static_mesh;
    let area_m2 = |triangle: usize| {
        let [a, b, c] = mesh.corners(triangle).map(|corner| corner.as_dvec3());
        0.5 * (b - a).cross(c - a).length()
    };
    let area_m2: f64 = (0..mesh.triangles.len()).map(area_m2).sum();
    radiance_w_m2_sr * PI * area_m2
}

#[test]
fn photons_bring_the_lights_whole_power_to_a_closed_room_and_its_geometric_series_over_all_bounces()
{
    let furnace = Scene::load(&bundled("furnace.glb")).unwrap();
    let power_w = lamp_power_w(&furnace, 1.0);
    let first = power_on_surfaces_w(&furnace, 1);
    means_agree(first, [power_w; 3], 0.001).unwrap();
    // Albedo 0.5: 1 + 1/2 + 1/4 + ...
    let all = power_on_surfaces_w(&furnace, 64);
    means_agree(all, [2.0 * power_w; 3], 0.01).unwrap();
    let three = power_on_surfaces_w(&furnace, 3);
    means_agree(three, [1.75 * power_w; 3], 0.01).unwrap();
    assert!(means_agree(three, [2.0 * power_w; 3], 0.01).is_err());
}

#[test]
fn a_map_that_is_too_small_is_told_and_its_picture_stays_as_bright() {
    let cornell = bundled("cornell.glb");
    let recipe = Recipe::new("pm-direct")
        .passes(4)
        .set("photon.count", "60000")
        .set("photon.batch", "2000");
    let whole = recipe.render(&cornell);
    assert_eq!(whole.count("photons_emitted"), 60_000.0);
    assert_eq!(whole.count("photons_dropped"), 0.0);
    assert!(whole.statistics.warnings.is_empty());

    let small = recipe.set("photon.stored_per_path", "0.4").render(&cornell);
    let emitted = small.count("photons_emitted");
    assert!(emitted > 0.0 && emitted < 60_000.0, "{emitted}");
    assert!(small.count("photons_dropped") > 0.0);
    assert!(small.count("photons_stored") <= 24_000.0);
    let warnings = small.statistics.warnings.join("\n");
    assert!(warnings.contains("photon.stored_per_path"), "{warnings}");
    means_agree(mean(&small.image), mean(&whole.image), 0.02).unwrap();

    let dark = recipe_without_photons().render(&cornell);
    assert!(means_agree(mean(&dark.image), mean(&whole.image), 0.02).is_err());
}

/// What the picture would be if a full map lost its light.
fn recipe_without_photons() -> Recipe {
    Recipe::new("pm-direct").passes(4).set("photon.count", "0")
}
