//! A frame runs what its scene calls for and nothing else, and shows what it would show with everything on.

use std::path::PathBuf;

use glam::Vec3;
use macula::effect_cost::Subject;
use macula::gather::EyeSettings;
use macula::gpu::{GpuDevice, Headless};
use macula::image::LinearImage;
use macula::params::Params;
use macula::scene::Scene;
use macula::scene::effects::Effects;
use macula::scene::loaded::LoadedScene;
use macula::still::Still;
use macula::technique;
use serde_json::json;

use crate::maker::{Stage, bundled, gpu, lambert, largest_relative_difference, mean, mirror};
use crate::shared::shared;

const SIZE: (u32, u32) = (48, 48);

/// Every scene at hand: the bundled ones, and the shared ones where they are.
fn scenes() -> Vec<PathBuf> {
    let own = ["cornell", "furnace", "gallery", "room"].map(|name| bundled(&format!("{name}.glb")));
    let folders = ["scenes/glb", "scenes/public/glb"].map(shared);
    let files = folders.into_iter().flatten().flat_map(|folder| {
        let entries = std::fs::read_dir(folder).unwrap();
        entries.map(|entry| entry.unwrap().path())
    });
    let is_scene = |path: &PathBuf| path.extension().is_some_and(|kind| kind == "glb");
    let mut all: Vec<PathBuf> = own.into_iter().chain(files.filter(is_scene)).collect();
    all.sort();
    all
}

fn params() -> Params {
    let mut params = Params::default();
    params.set("photon.count", "20000").unwrap();
    params
}

/// Hands a scene's picture in the making to `judge`, with the effects that the scene calls for.
fn with_subject<T>(
    scene: Scene,
    technique: &str,
    judge: impl FnOnce(&Subject<'_>, Effects) -> T,
) -> T {
    with_subject_on(gpu(), scene, technique, judge)
}

fn with_subject_on<T>(
    gpu: &GpuDevice,
    scene: Scene,
    technique: &str,
    judge: impl FnOnce(&Subject<'_>, Effects) -> T,
) -> T {
    let params = params();
    let own = technique::effects(&scene, &params);
    let loaded = LoadedScene::new(gpu, scene).unwrap();
    let view = loaded.scene.cameras[0].view(SIZE.0, SIZE.1);
    let subject = Subject {
        gpu,
        scene: &loaded,
        params: &params,
        technique: technique::find(technique).unwrap(),
        eye: EyeSettings::new(&params, view, None),
        size: SIZE,
    };
    judge(&subject, own)
}

fn picture(subject: &Subject<'_>, effects: Effects) -> LinearImage {
    let (mut still, _) = subject.start(effects).unwrap();
    still.add_pass().unwrap();
    still.read().unwrap()
}

/// Pairs of frames that are timed for each scene, one with its own effects and one with all.
const PAIRS: usize = 5;
/// How many times a scene is timed before it counts as slower: other work on the machine may fall on one of its pictures.
const ROUNDS: usize = 4;
/// How much longer the best of the medians may take for noise alone.
const TIME_TOLERANCE: f64 = 0.05;

#[test]
fn every_scene_looks_the_same_with_its_own_effects_as_with_all_and_takes_no_longer() {
    let mut shares: Vec<f64> = Vec::new();
    for path in scenes() {
        let scene = Scene::load(&path).unwrap();
        let what = path.file_name().unwrap().to_string_lossy().into_owned();
        for technique in ["pm-direct", "pm", "fpm"] {
            with_subject(scene.clone(), technique, |subject, own| {
                let [mut alone, mut all] =
                    [own, Effects::ALL].map(|effects| subject.start(effects).unwrap().0);
                let passes = alone.add_pass().unwrap();
                let passes: Vec<&str> = passes.iter().map(|pass| pass.name).collect();
                assert_eq!(
                    passes,
                    (subject.technique.passes)(&own, subject.params),
                    "{what}"
                );
                all.add_pass().unwrap();
                let pictures = [&alone, &all].map(|still| still.read().unwrap());
                assert_same(&pictures[0], &pictures[1], &format!("{technique} {what}"));

                let frame_ms = |still: &mut Still<'_>| {
                    let passes = still.add_pass().unwrap();
                    passes.iter().map(|pass| pass.ms).sum::<f64>()
                };
                let mut median = || {
                    let mut ratios = [0; PAIRS].map(|_| frame_ms(&mut alone) / frame_ms(&mut all));
                    ratios.sort_by(f64::total_cmp);
                    ratios[PAIRS / 2]
                };
                let share = median();
                println!("{what}, {technique}: {share:.2} of the time with all effects");
                let is_no_slower = |share: f64| share < 1.0 + TIME_TOLERANCE;
                let is_faster = is_no_slower(share) || (1..ROUNDS).any(|_| is_no_slower(median()));
                assert!(is_faster, "{technique} {what}: {share}");
                shares.push(share);
            });
        }
    }
    let logarithms = shares.iter().map(|share| share.ln()).sum::<f64>();
    let mean = (logarithms / shares.len() as f64).exp();
    println!("all scenes: {mean:.2} of the time with all effects, in the geometric mean");
    assert!(mean < 1.0, "{mean}");
}

/// Fails unless two pictures are the same but for rounding.
fn assert_same(a: &LinearImage, b: &LinearImage, what: &str) {
    let channels = a.rgb.as_flattened().iter().zip(b.rgb.as_flattened());
    let is_close = |(a, b): &(&f32, &f32)| (*a - *b).abs() <= 1e-4 * b.abs() + 1e-7;
    let others = channels.filter(|pair| !is_close(pair)).count();
    // Rounding may turn a photon or a path another way: rarely, and the mean does not tell.
    assert!(
        others * 100 <= a.rgb.len() * 3,
        "{what}: {others} values differ"
    );
    let (a, b) = (mean(a), mean(b));
    // One photon in 20 000 is 5e-5 of the light.
    let is_close = |channel: usize| (a[channel] - b[channel]).abs() <= 1e-3 * b[channel];
    assert!((0..3).all(is_close), "{what}: {a:?} {b:?}");
}

#[test]
fn a_scene_without_the_effects_that_it_calls_for_looks_otherwise() {
    for (effect, name) in [
        ("specular chains", "cornell"),
        ("smooth dielectric", "cornell"),
        ("area lights", "cornell"),
        ("base colour textures", "room"),
    ] {
        let scene = Scene::load(&bundled(&format!("{name}.glb"))).unwrap();
        with_subject(scene, "pm-direct", |subject, own| {
            let was_on = own.named().any(|(named, on)| named == effect && on);
            assert!(was_on, "{name} calls for {effect}");
            // Transmission implies chains: both go.
            let without = own.with(effect, false).with("smooth dielectric", false);
            let right = picture(subject, own);
            let wrong = picture(subject, without);
            let worst = largest_relative_difference(&wrong, &right, 0.1);
            assert!(worst > 0.1, "{name} without {effect}: {worst}");
        });
    }
}

#[test]
fn a_diffuse_scene_runs_no_pass_for_specular_light_caustics_or_motion() {
    let scene = Scene::load(&bundled("furnace.glb")).unwrap();
    // A device of its own: others would allocate on the shared one meanwhile.
    let gpu = GpuDevice::create(&Headless::default()).unwrap();
    with_subject_on(&gpu, scene, "pm-direct", |subject, own| {
        let diffuse = Effects {
            area_light: true,
            indirect: true,
            ..Effects::default()
        };
        assert_eq!(own, diffuse);
        let passes_of = |effects| {
            let passes = subject.start(effects).unwrap().0.add_pass().unwrap();
            Vec::from_iter(passes.iter().map(|pass| pass.name))
        };
        let passes = passes_of(own);
        let expected = [
            "photon tracing",
            "photon sorting",
            "visible points",
            "direct light",
            "density estimate",
            "resolve",
        ];
        assert_eq!(passes, expected);
        let all = passes_of(Effects::ALL);
        assert!(all.contains(&"caustic estimate"), "{all:?}");
        // Visible points, photon classes and their cells are buffers that it does not have.
        let memory = |effects| subject.start(effects).unwrap().1;
        let saved = memory(Effects::ALL).zip(memory(own));
        let (all, own) = saved.expect("Vulkan's allocator tells what it holds");
        assert!(own + (8 << 20) <= all, "{own} of {all} bytes");
    });
}

/// A grey floor, and a rough metal plate whose highlights are gathered from photons unless told otherwise.
fn floor_and_plate(plate: serde_json::Value) -> Stage {
    Stage::new(Vec3::new(0.0, 1.5, 2.0), Vec3::ZERO)
        .quad(
            Vec3::new(-1.0, 0.0, 1.0),
            2.0 * Vec3::X,
            -2.0 * Vec3::Z,
            lambert([0.5; 3]),
        )
        .quad(Vec3::new(-0.5, 0.1, 0.0), Vec3::X, 0.6 * Vec3::Y, plate)
        .point_light(Vec3::new(0.0, 2.0, 1.0), 5.0)
}

#[test]
fn a_scene_that_gains_its_first_mirror_by_animation_has_specular_chains_from_the_start() {
    let mut stage = floor_and_plate(mirror());
    let node = stage.glb.json["nodes"].as_array().unwrap().len() - 2;
    // Nothing of it is there at first.
    let scales = [[0.0f32; 3], [1.0; 3]];
    stage
        .glb
        .animate(node, "scale", "LINEAR", &[0.0, 1.0], &scales);
    let effects = technique::effects(&stage.load(), &params());
    assert!(effects.specular_chains && effects.caustics && effects.dynamic_objects);
    let without = technique::effects(&floor_and_plate(lambert([0.5; 3])).load(), &params());
    assert!(!without.specular_chains && !without.caustics && !without.dynamic_objects);
}

#[test]
fn a_scene_that_gains_its_first_traced_reflection_by_a_parameter_gets_the_effect() {
    let metal = json!({
        "pbrMetallicRoughness": {"metallicFactor": 1.0, "roughnessFactor": 0.6},
        "doubleSided": true,
    });
    let scene = floor_and_plate(metal).load();
    // Alpha 0.36: gathered by the default of 0.2, traced beneath 0.5.
    let mut params = params();
    assert!(!technique::effects(&scene, &params).has_chains());
    params.set("gather.glossy_alpha_min", "0.5").unwrap();
    assert!(technique::effects(&scene, &params).has_chains());
    params.set("gather.glossy_alpha_min", "0.2").unwrap();
    params.set("effects.all", "1").unwrap();
    assert_eq!(technique::effects(&scene, &params), Effects::ALL);
}
