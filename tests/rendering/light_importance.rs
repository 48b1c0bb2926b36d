//! Lights are picked by what they bring to where the eye looks, and no estimate is bent by it.

use std::time::Duration;

use cpu_time::ThreadTime;
use glam::{Affine3A, Vec3};
use macula::frame::{FrameInput, FrameRenderer, LIGHT_IMPORTANCE};
use macula::gpu::pass::{Kernel, Recorder};
use macula::gpu::shader::{Stage as ShaderStage, compose_text};
use macula::gpu::{resources, timing::PassTimer};
use macula::params::Params;
use macula::scene::bvh::SceneCaster;
use macula::scene::lamps::LAMPS_MAX;
use macula::scene::light_importance::{Focus, LightImportance, Surroundings};
use macula::scene::light_table::PickProbabilities;
use macula::scene::loaded::LoadedScene;
use macula::scene::{Scene, ScenePose};
use macula::technique;
use macula::view::{Fov, Pose, View};

use crate::maker::{
    EYE_FORMAT, Recipe, Stage, eye_target, glowing, gpu, lambert, mean, means_agree,
};

const GREY: [f32; 3] = [0.5; 3];
const SHARE: f32 = 0.75;
/// Inside the dim room of [`two_rooms`], and inside the bright one.
const DIM: Vec3 = Vec3::new(-1.1, 0.0, 0.0);
const BRIGHT: Vec3 = Vec3::new(1.1, 0.0, 0.0);

/// Two closed rooms 2 m wide, 20 cm apart, the first lit by 1 W/sr and the other by 1000.
fn two_rooms() -> Stage {
    Stage::new(DIM + 0.8 * Vec3::Z, DIM - Vec3::Z)
        .cuboid(DIM, Vec3::splat(-1.0), lambert(GREY))
        .cuboid(BRIGHT, Vec3::splat(-1.0), lambert(GREY))
        .point_light(DIM + 0.6 * Vec3::Y, 1.0)
        .point_light(BRIGHT + 0.6 * Vec3::Y, 1000.0)
}

fn loaded(stage: &Stage) -> LoadedScene {
    LoadedScene::new(gpu(), stage.load()).unwrap()
}

/// The whole view of the file's camera, from elsewhere.
fn focus_at(scene: &Scene, position: Vec3) -> Focus {
    let view = scene.cameras[0].view(64, 64);
    let position = position - scene.file_from_scene_m.as_vec3();
    Focus {
        scene_from_view: Affine3A::from_rotation_translation(view.pose.orientation, position),
        fov: view.fov,
        gaze_dir_in_view: Vec3::NEG_Z,
        radius_rad: 7.0,
    }
}

fn look(importance: &mut LightImportance, scene: &LoadedScene, pose: &ScenePose, eyes: &[Focus]) {
    let around = Surroundings {
        scene: &scene.scene,
        caster: &scene.caster,
        pose,
        on_gpu: &scene.on_gpu,
    };
    importance.look(&around, eyes);
}

/// How likely lights are picked after the first look.
fn picked(scene: &LoadedScene, share: f32, eyes: &[Focus]) -> Vec<f64> {
    let mut importance = LightImportance::new(share);
    look(&mut importance, scene, &scene.scene.pose_at(0.0), eyes);
    let lights = scene.on_gpu.placed_lights();
    importance.pick_probabilities(lights).picked
}

#[test]
fn the_lamp_of_the_room_that_the_eye_is_in_gets_most_of_the_picks() {
    let rooms = loaded(&two_rooms());
    let from = |position| picked(&rooms, SHARE, &[focus_at(&rooms.scene, position)]);
    let in_dim = from(DIM);
    assert!((in_dim[0] - 0.75).abs() < 0.001, "{in_dim:?}");
    let in_bright = from(BRIGHT);
    assert!(in_bright[1] > 0.999, "{in_bright:?}");
    // Control: by power alone.
    let by_power = picked(&rooms, 0.0, &[focus_at(&rooms.scene, DIM)]);
    assert!((by_power[0] - 1.0 / 1001.0).abs() < 1e-6, "{by_power:?}");
    for probabilities in [in_dim, in_bright, by_power] {
        assert!((probabilities.iter().sum::<f64>() - 1.0).abs() < 1e-9);
    }
}

#[test]
fn eyes_in_two_rooms_divide_the_picks_and_the_dim_room_is_not_outshone() {
    let rooms = loaded(&two_rooms());
    let eyes = [DIM, BRIGHT].map(|position| focus_at(&rooms.scene, position));
    let divided = picked(&rooms, SHARE, &eyes);
    assert!((divided[0] - 0.375).abs() < 0.01, "{divided:?}");
}

#[test]
fn a_cone_around_the_gaze_counts_more_than_the_rest_of_the_view() {
    // A wall across the view's middle parts two lamps' light.
    let stage = Stage::new(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO)
        .quad(
            Vec3::new(-3.0, -3.0, 0.0),
            6.0 * Vec3::X,
            6.0 * Vec3::Y,
            lambert(GREY),
        )
        .quad(
            Vec3::new(0.0, -3.0, 0.0),
            2.5 * Vec3::Z,
            6.0 * Vec3::Y,
            lambert([0.0; 3]),
        )
        .point_light(Vec3::new(-1.0, 0.0, 1.0), 1.0)
        .point_light(Vec3::new(1.0, 0.0, 1.0), 1.0);
    let scene = loaded(&stage);
    let look_at = |x: f32| {
        let to_target = Vec3::new(x, 0.0, -3.0).normalize();
        let focus = Focus {
            gaze_dir_in_view: to_target,
            radius_rad: 0.1,
            ..focus_at(&scene.scene, Vec3::new(0.0, 0.0, 3.0))
        };
        picked(&scene, SHARE, &[focus])[0]
    };
    // Three rays in four go into the cone, of the rest half to either side; a quarter of the picks goes by power.
    let expected = 0.25 * 0.5 + 0.75 * (0.75 + 0.125);
    assert!((look_at(-1.0) - expected).abs() < 0.03, "{}", look_at(-1.0));
    assert!(
        (look_at(1.0) - (1.0 - expected)).abs() < 0.03,
        "{}",
        look_at(1.0)
    );
    // Out of the picture, on the wall's left: the view counts alone.
    assert!((look_at(-2.5) - 0.5).abs() < 0.03, "{}", look_at(-2.5));
}

/// Writes how often `pick_light` picks each light, of 65 536 even numbers.
const COUNT_PICKS: &str = "
//! use lights
@group(1) @binding(0) var<storage, read_write> picks: array<atomic<u32>>;

@compute @workgroup_size(64)
fn count_picks(@builtin(global_invocation_id) id: vec3u) {
  atomicAdd(&picks[pick_light((f32(id.x) + 0.5) / 65536.0)], 1u);
}
";

#[test]
fn the_shader_picks_each_light_with_its_probability() {
    let scene = loaded(&two_rooms().point_light(DIM, 30.0).point_light(BRIGHT, 0.5));
    let given = vec![0.4, 0.3, 0.25, 0.05];
    let probabilities = PickProbabilities {
        unshadowed: given.clone(),
        picked: given,
    };
    scene.on_gpu.set_pick_probabilities(gpu(), &probabilities);
    let picks = resources::storage::<u32>(gpu(), "picks", 4).unwrap();
    let size = |name: &str| scene.on_gpu.shader_size(name).unwrap_or(1);
    let source = compose_text("count_picks", COUNT_PICKS, &size).unwrap();
    let name = "count_picks";
    let kernel = Kernel::from_source(gpu(), ShaderStage { name }, source, &[]).unwrap();
    let resources = scene.on_gpu.resources().with("picks", &picks);
    let kernel = kernel.bind(gpu(), &resources).unwrap();
    let mut timer = PassTimer::new(gpu());
    let mut recorder = Recorder::new(gpu(), &mut timer);
    recorder.pass("picks", &[(&kernel, 65536)]);
    recorder.finish().unwrap();
    let picks: Vec<u32> = resources::read_back(gpu(), &picks, 4).unwrap();
    for (picks, given) in picks.iter().zip(&probabilities.picked) {
        assert!(
            (f64::from(*picks) / 65536.0 - given).abs() < 1e-3,
            "{picks} for {given}"
        );
    }
}

/// Direct light in the middle of the dim room's picture: the mean over independent pictures, and the variance of one pixel of one of them.
fn direct_light(stage: &Stage, share: &str) -> (f64, f64) {
    const PICTURES: u32 = 24;
    let recipe = Recipe::new("pm-direct")
        .size(16, 16)
        .set("photon.count", "0")
        .set("direct.importance_share", share);
    let scene = loaded(stage);
    let mut still = recipe.still(&scene);
    let mut pixels = vec![Vec::new(); 256];
    for _ in 0..PICTURES {
        still.start_over();
        still.add_pass().unwrap();
        for (of_pixel, rgb) in pixels.iter_mut().zip(still.read().unwrap().rgb) {
            of_pixel.push(f64::from(rgb[1]));
        }
    }
    let mean_of = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let variance = |values: &Vec<f64>| {
        let mean = mean_of(values);
        let squares = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
        squares / f64::from(PICTURES - 1)
    };
    let variances = Vec::from_iter(pixels.iter().map(variance));
    (mean_of(&pixels.concat()), mean_of(&variances))
}

#[test]
fn a_bright_room_next_door_makes_no_noise_and_the_mean_stays() {
    let alone = Stage::new(DIM + 0.8 * Vec3::Z, DIM - Vec3::Z)
        .cuboid(DIM, Vec3::splat(-1.0), lambert(GREY))
        .point_light(DIM + 0.6 * Vec3::Y, 1.0);
    let (expected, _) = direct_light(&alone, "0.75");
    let (mean, variance) = direct_light(&two_rooms(), "0.75");
    let (_, variance_by_power) = direct_light(&two_rooms(), "0");
    println!("variance {variance_by_power} by power, {variance} by importance");
    let standard_error = (variance / (24.0 * 256.0)).sqrt();
    assert!(
        (mean - expected).abs() < 5.0 * standard_error + 0.002 * expected,
        "{mean} ± {standard_error}, not {expected}"
    );
    assert!(variance_by_power > 100.0 * variance);
}

/// A floor lit weakly by a lamp in view, and strongly, by way of the ceiling, by one above a screen.
fn hidden_lamp(has_strong: bool) -> Scene {
    let flat = |stage: Stage, y: f32, half_m: f32, material| {
        let corner = Vec3::new(-half_m, y, half_m);
        stage.quad(
            corner,
            2.0 * half_m * Vec3::X,
            -2.0 * half_m * Vec3::Z,
            material,
        )
    };
    let mut stage = Stage::new(Vec3::new(0.0, 0.3, 2.0), Vec3::new(0.0, -1.0, 0.0));
    stage = flat(stage, -1.0, 2.0, lambert(GREY));
    stage = flat(stage, 1.5, 2.0, lambert(GREY));
    stage = flat(stage, 0.4, 0.4, lambert([0.0; 3]));
    stage = stage.point_light(Vec3::new(0.0, 0.3, 0.0), 0.2);
    if has_strong {
        stage = stage.point_light(Vec3::new(0.0, 0.5, 0.0), 5.0);
    }
    stage.load()
}

#[test]
fn a_lamp_that_is_hidden_keeps_its_indirect_light() {
    let scene = hidden_lamp(true);
    let recipe = |technique| Recipe::new(technique).size(24, 24);
    let truth = recipe("path").set("path.samples", "256");
    let truth = mean(&truth.render_scene(&scene).image);
    for technique in ["pm-direct", "pm"] {
        let recipe = recipe(technique).passes(4).set("photon.count", "100000");
        let picture = recipe.render_scene(&scene);
        means_agree(mean(&picture.image), truth, 0.03)
            .unwrap_or_else(|e| panic!("{technique}: {e}"));
        // Control: without the lamp.
        let without = mean(&recipe.render_scene(&hidden_lamp(false)).image);
        assert!(
            means_agree(without, truth, 0.03).is_err(),
            "{technique}: {without:?}"
        );
    }
}

#[test]
fn a_lamp_that_leaves_the_room_leaves_the_picks() {
    let mut stage = two_rooms();
    let node = stage.glb.json["nodes"].as_array().unwrap().len() - 2;
    let there = BRIGHT + 0.3 * Vec3::Y;
    let places = [(DIM + 0.6 * Vec3::Y).to_array(), there.to_array()];
    stage
        .glb
        .animate(node, "translation", "STEP", &[0.0, 1.0], &places);
    // Something that goes on, so that the loop holds the second place.
    stage.glb.animate(
        0,
        "translation",
        "LINEAR",
        &[0.0, 10.0],
        &[[0.0; 3], [0.0, 0.0, 0.1]],
    );
    let mut scene = loaded(&stage);
    let eye = focus_at(&scene.scene, DIM + 0.3 * Vec3::Z);
    let mut importance = LightImportance::new(SHARE);
    let mut picked_at = |time_s: f64, frames: u32| {
        let pose = scene.scene.pose_at(time_s);
        scene.on_gpu.set_pose(gpu(), &pose);
        for _ in 0..frames {
            look(&mut importance, &scene, &pose, &[eye]);
        }
        importance
            .pick_probabilities(scene.on_gpu.placed_lights())
            .picked[0]
    };
    let here = picked_at(0.0, 1);
    // Nothing lights the room then, and what was seen last holds; in the bright room a look finds it beside the bright lamp.
    let gone = picked_at(5.0, 1);
    let back = picked_at(0.0, 1);
    assert!((here - 0.75).abs() < 0.001 && gone == here && back == here);
    let bright = focus_at(&scene.scene, BRIGHT);
    let pose = scene.scene.pose_at(0.0);
    let shares = Vec::from_iter((0..12).map(|_| {
        look(&mut importance, &scene, &pose, &[bright]);
        importance
            .pick_probabilities(scene.on_gpu.placed_lights())
            .picked[0]
    }));
    assert!(shares.is_sorted_by(|a, b| a > b), "{shares:?}");
    assert!(shares[11] < 0.03, "{shares:?}");
}

#[test]
fn what_there_is_nothing_to_see_of_is_picked_by_power() {
    let rooms = two_rooms();
    let scene = loaded(&rooms);
    let by_power = [1.0 / 1001.0, 1000.0 / 1001.0];
    let is_by_power = |eyes: &[Focus]| {
        let picked = picked(&scene, SHARE, eyes);
        picked
            .iter()
            .zip(by_power)
            .all(|(p, expected)| (p - expected).abs() < 1e-6)
    };
    let eye = focus_at(&scene.scene, DIM);
    let spoilt = |spoil: fn(&mut Focus)| {
        let mut eye = eye;
        spoil(&mut eye);
        eye
    };
    assert!(is_by_power(&[]));
    assert!(is_by_power(&[spoilt(|eye| eye
        .scene_from_view
        .translation
        .x = f32::NAN)]));
    assert!(is_by_power(&[spoilt(
        |eye| eye.scene_from_view.matrix3 = glam::Mat3A::NAN
    )]));
    assert!(is_by_power(&[spoilt(|eye| eye.fov.left_rad = f32::NAN)]));
    assert!(is_by_power(&[spoilt(|eye| eye
        .scene_from_view
        .translation
        .x = 1e30)]));
    // A gaze that is none, or outside the view, leaves the view.
    for gaze in [Vec3::NAN, Vec3::ZERO, Vec3::Z] {
        let eye = Focus {
            gaze_dir_in_view: gaze,
            radius_rad: 0.1,
            ..eye
        };
        assert!(!is_by_power(&[eye]), "{gaze}");
    }
}

#[test]
fn lights_without_power_and_scenes_without_lights_have_no_picks() {
    let dark = two_rooms().point_light(DIM, 0.0);
    let scene = loaded(&dark);
    let eye = focus_at(&scene.scene, DIM);
    assert_eq!(picked(&scene, SHARE, &[eye]).len(), 2);
    let unlit =
        Stage::new(Vec3::Z, Vec3::ZERO).cuboid(Vec3::ZERO, Vec3::splat(-2.0), lambert(GREY));
    let scene = loaded(&unlit);
    assert_eq!(scene.on_gpu.lamp_count(), 0);
    assert!(picked(&scene, SHARE, &[eye]).is_empty());
}

#[test]
fn triangles_of_one_lamp_are_one_and_cost_no_look() {
    let panel = |stage: Stage, x: f32| {
        let corner = Vec3::new(x, 1.5, 0.0);
        stage.quad(corner, 0.5 * Vec3::X, 0.5 * Vec3::Z, glowing([1.0; 3]))
    };
    let one = panel(two_rooms_unlit(), -1.0);
    let two = panel(panel(two_rooms_unlit(), -1.0), 0.0);
    let importance = LightImportance::new(SHARE);
    for (stage, lamps) in [(one, 1), (two, 2)] {
        let scene = loaded(&stage);
        assert_eq!(scene.on_gpu.placed_lights().len(), 2 * lamps);
        assert_eq!(scene.on_gpu.lamp_count(), lamps);
        assert_eq!(importance.matters_to(&scene.on_gpu), lamps > 1);
    }
}

fn two_rooms_unlit() -> Stage {
    Stage::new(DIM, DIM - Vec3::Z).cuboid(Vec3::ZERO, Vec3::splat(-2.0), lambert(GREY))
}

#[test]
fn thousands_of_lights_stay_within_the_bounds_of_a_look() {
    let mut stage = two_rooms_unlit();
    for number in 0..3000 {
        let [x, y, z] =
            [number % 15, number / 15 % 15, number / 225].map(|i| 0.25 * i as f32 - 1.8);
        stage = stage.point_light(Vec3::new(x, y, z), 1.0 + (number % 7) as f32);
    }
    let scene = loaded(&stage);
    assert_eq!(scene.on_gpu.lamp_count(), LAMPS_MAX);
    let eye = focus_at(&scene.scene, Vec3::ZERO);
    let pose = scene.scene.pose_at(0.0);
    let mut importance = LightImportance::new(SHARE);
    look(&mut importance, &scene, &pose, &[eye]);
    let quickest = (0..10).map(|_| {
        let started = ThreadTime::now();
        look(&mut importance, &scene, &pose, &[eye]);
        importance.apply(gpu(), &scene.on_gpu);
        started.elapsed()
    });
    let quickest = quickest.min().unwrap();
    println!("a look at 3000 lights: {quickest:?}");
    assert!(quickest < Duration::from_millis(20), "{quickest:?}");
    let picked = importance
        .pick_probabilities(scene.on_gpu.placed_lights())
        .picked;
    assert!((picked.iter().sum::<f64>() - 1.0).abs() < 1e-9);
    assert!(picked.iter().all(|p| *p > 0.0));
}

#[test]
fn two_pictures_of_one_scene_do_not_disturb_each_other() {
    let scene = loaded(&two_rooms());
    let recipe = |share| {
        let recipe = Recipe::new("pm-direct")
            .size(16, 16)
            .set("photon.count", "2000");
        recipe.set("direct.importance_share", share)
    };
    let alone = |share| {
        let mut still = recipe(share).still(&scene);
        for _ in 0..2 {
            still.add_pass().unwrap();
        }
        still.read().unwrap().rgb
    };
    let (by_importance, by_power) = (alone("0.75"), alone("0"));
    assert_ne!(by_importance, by_power);
    let mut stills = ["0.75", "0"].map(|share| recipe(share).still(&scene));
    for _ in 0..2 {
        for still in &mut stills {
            still.add_pass().unwrap();
        }
    }
    let [a, b] = stills.map(|still| still.read().unwrap().rgb);
    assert!(a == by_importance && b == by_power);
}

/// The second frame of a session in which the eyes are lost: the left eye's picture, and the names of the stages.
fn session_frame(stage: &Stage, share: &str) -> (Vec<[f32; 3]>, Vec<&'static str>) {
    let scene = stage.load();
    let caster = SceneCaster::new(&scene);
    let mut params = Params::default();
    for (key, value) in [("photon.count", "0"), ("direct.importance_share", share)] {
        params.set(key, value).unwrap();
    }
    let entry = technique::find("pm-direct").unwrap();
    let size = [16; 2];
    let mut renderer =
        FrameRenderer::new(gpu(), &scene, &caster, &params, entry, size, EYE_FORMAT).unwrap();
    let targets = [eye_target(size), eye_target(size)];
    let view = View {
        pose: Pose::IDENTITY,
        fov: Fov::symmetric(1.2, 1.0),
    };
    let frames = [0, 1].map(|index| {
        let input = FrameInput {
            index,
            display_time_ns: i64::from(index) * 11_000_000,
            scene_time_s: 0.0,
            local_from_head: Pose::IDENTITY,
            local_from_eye: [view; 2],
            gaze: None,
        };
        renderer.render(&input, &targets).unwrap()
    });
    let stages = frames[1].passes.iter().map(|pass| pass.name).collect();
    (renderer.images()[0].read(gpu()).unwrap().rgb, stages)
}

#[test]
fn a_session_looks_each_frame_where_there_is_more_than_one_lamp() {
    let alone = Stage::new(DIM + 0.8 * Vec3::Z, DIM - Vec3::Z)
        .cuboid(DIM, Vec3::splat(-1.0), lambert(GREY))
        .point_light(DIM + 0.6 * Vec3::Y, 1.0);
    let (quiet, stages) = session_frame(&alone, "0.75");
    assert!(!stages.contains(&LIGHT_IMPORTANCE), "{stages:?}");
    let off_by = |share| {
        let (picture, stages) = session_frame(&two_rooms(), share);
        let pairs = picture.as_flattened().iter().zip(quiet.as_flattened());
        let squares: f32 = pairs.map(|(a, b)| (a - b).powi(2)).sum();
        (squares, stages.contains(&LIGHT_IMPORTANCE))
    };
    let (by_importance, looks) = off_by("0.75");
    let (by_power, looks_by_power) = off_by("0");
    assert!(looks && !looks_by_power);
    assert!(
        by_power > 30.0 * by_importance,
        "{by_power} {by_importance}"
    );
}
