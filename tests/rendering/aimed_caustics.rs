//! Photons that are aimed at specular surfaces bring the caustic light that ordinary photons bring, from fewer paths.

use glam::Vec3;
use macula::gather::{EyeImage, EyePass, EyeSettings, EyeStart, LightPass};
use macula::gpu::layout::PhotonCounters;
use macula::gpu::pass::Recorder;
use macula::gpu::timing::PassTimer;
use macula::image::LinearImage;
use macula::params::Params;
use macula::photon::{MapSettings, PhotonMap, PhotonTracer, TraceSettings, trace};
use macula::scene::loaded::LoadedScene;
use macula::scene::specular_targets::SpecularTargets;
use macula::scene::{Scene, ScenePose};
use macula::technique;
use serde_json::{Value, json};

use crate::maker::{Stage, glowing, gpu, lambert, mean, means_agree, mirror};
use crate::photon_flux::{self, StoredPhoton};

/// Ordinary and aimed paths of a map, and the maps of which the scatter tells how sure their mean is.
const ORDINARY: u32 = 60_000;
const AIMED: u32 = 6_000;
const MAPS: u32 = 12;
/// Standard errors by which means may differ.
const SIGMAS: f64 = 5.0;

/// A scene at work, with its effects.
struct Subject {
    loaded: LoadedScene,
    params: Params,
}

impl Subject {
    fn new(scene: Scene) -> Self {
        let mut params = Params::default();
        params.photon.count = ORDINARY;
        let loaded = LoadedScene::new(gpu(), scene).unwrap();
        Self { loaded, params }
    }

    fn constants(&self) -> Vec<(&'static str, f64)> {
        let mut constants = technique::effects(&self.loaded.scene, &self.params).constants();
        constants.push((
            "GATHERED_ALPHA_MIN",
            f64::from(self.params.gather.glossy_alpha_min),
        ));
        constants
    }

    /// The targets of a scene, this one or another with the same places.
    fn targets_of(&self, scene: &Scene) -> SpecularTargets {
        let alpha_min = self.params.gather.glossy_alpha_min;
        SpecularTargets::new(gpu(), scene, alpha_min, &scene.pose_at(0.0)).unwrap()
    }

    fn ordinary(&self) -> PhotonTracer {
        let scene = &self.loaded.on_gpu;
        PhotonTracer::new(gpu(), scene, &self.params, &self.constants()).unwrap()
    }

    fn aimed_at(&self, targets: &SpecularTargets) -> PhotonTracer {
        let (scene, constants) = (&self.loaded.on_gpu, self.constants());
        PhotonTracer::aimed(gpu(), scene, &self.params, &constants, AIMED, targets).unwrap()
    }

    fn aimed(&self) -> PhotonTracer {
        self.aimed_at(&self.targets_of(&self.loaded.scene))
    }
}

fn map(tracer: &PhotonTracer, frame: u32) -> (Vec<StoredPhoton>, PhotonCounters) {
    let settings = TraceSettings {
        path_count: ORDINARY,
        depth_max: 16,
        seed: 1,
        frame,
    };
    photon_flux::trace(tracer, &settings)
}

/// Quarters of the scene, by the signs of x and z, in which light is summed up.
const QUARTERS: usize = 4;

/// Caustic power that comes to surfaces in each quarter and its standard error, W.
#[derive(Clone, Debug)]
struct Power {
    mean_w: [f64; QUARTERS],
    error_w: [f64; QUARTERS],
}

impl Power {
    fn of(tracer: &PhotonTracer) -> Self {
        let maps = (0..MAPS).map(|frame| {
            let (photons, counters) = map(tracer, frame);
            assert_eq!(counters.dropped_photons, 0);
            let mut sums = [0.0; QUARTERS];
            for photon in photons.iter().filter(|photon| photon.is_caustic) {
                let Vec3 { x, z, .. } = photon.position;
                let quarter = usize::from(x > 0.0) + 2 * usize::from(z > 0.0);
                sums[quarter] += photon.flux_w.iter().sum::<f64>() / f64::from(counters.emitted);
            }
            sums
        });
        let maps: Vec<[f64; QUARTERS]> = maps.collect();
        let count = f64::from(MAPS);
        let mean_w = [0, 1, 2, 3].map(|q| maps.iter().map(|map| map[q]).sum::<f64>() / count);
        let error_w = [0, 1, 2, 3].map(|q| {
            let squares = maps.iter().map(|map| (map[q] - mean_w[q]).powi(2));
            (squares.sum::<f64>() / (count * (count - 1.0))).sqrt()
        });
        Self { mean_w, error_w }
    }

    fn total_w(&self) -> f64 {
        self.mean_w.iter().sum()
    }

    fn scaled(&self, factor: f64) -> Self {
        Self {
            mean_w: self.mean_w.map(|mean_w| mean_w * factor),
            ..self.clone()
        }
    }

    fn plus(&self, other: &Self) -> Self {
        Self {
            mean_w: [0, 1, 2, 3].map(|q| self.mean_w[q] + other.mean_w[q]),
            error_w: [0, 1, 2, 3].map(|q| self.error_w[q].hypot(other.error_w[q])),
        }
    }

    /// Whether both are one within their errors, in each quarter.
    fn agrees_with(&self, other: &Self) -> bool {
        (0..QUARTERS).all(|q| {
            let error_w = self.error_w[q].hypot(other.error_w[q]);
            // A quarter that hardly any photon meets has no scatter to speak of.
            let least_w = 1e-3 * other.total_w();
            (self.mean_w[q] - other.mean_w[q]).abs() <= SIGMAS * error_w + least_w
        })
    }
}

fn glass() -> Value {
    json!({
        "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.0},
        "extensions": {
            "KHR_materials_transmission": {"transmissionFactor": 1.0},
            "KHR_materials_volume": {"thicknessFactor": 1.0},
        },
    })
}

/// A ball of flat faces.
fn ball(stage: Stage, center: Vec3, radius_m: f32, material: Value) -> Stage {
    const ROWS: u32 = 12;
    const COLUMNS: u32 = 24;
    let corner = |row: u32, column: u32| {
        let polar = std::f32::consts::PI * row as f32 / ROWS as f32;
        let turn = std::f32::consts::TAU * (column % COLUMNS) as f32 / COLUMNS as f32;
        let (sin, cos) = polar.sin_cos();
        center + radius_m * Vec3::new(sin * turn.cos(), cos, -sin * turn.sin())
    };
    let positions: Vec<Vec3> = (0..=ROWS)
        .flat_map(|row| (0..COLUMNS).map(move |column| corner(row, column)))
        .collect();
    let place = |row: u32, column: u32| row * COLUMNS + column % COLUMNS;
    let corners: Vec<u32> = (0..ROWS)
        .flat_map(|row| (0..COLUMNS).map(move |column| (row, column)))
        .flat_map(|(row, column)| {
            let [a, b] = [0, 1].map(|next| place(row, column + next));
            let [c, d] = [0, 1].map(|next| place(row + 1, column + next));
            [a, c, d, a, d, b]
        })
        .collect();
    stage.triangles(&positions, &corners, material)
}

/// Diffuse, under a coat whose reflection rays follow.
fn varnished() -> Value {
    json!({"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.2}, "doubleSided": true})
}

/// A room four metres wide and two high, with a glass ball, a mirror that stands and a varnished table.
fn room() -> Stage {
    let stage = empty_room();
    let (corner, u, v) = (
        Vec3::new(0.4, 0.1, -0.9),
        Vec3::new(0.5, 0.0, 0.3),
        Vec3::new(0.0, 0.7, 0.0),
    );
    let stage = stage.quad(corner, u, v, mirror());
    let (corner, u, v) = (Vec3::new(0.8, 0.3, 0.3), 0.8 * Vec3::Z, 0.6 * Vec3::X);
    let stage = stage.quad(corner, u, v, varnished());
    ball(stage, Vec3::new(-0.5, 0.4, 0.3), 0.3, glass())
}

fn empty_room() -> Stage {
    let stage = with_glass(Stage::new(Vec3::new(0.0, 1.5, 1.9), Vec3::ZERO));
    stage.cuboid(Vec3::Y, -Vec3::new(2.0, 1.0, 2.0), lambert([0.5; 3]))
}

fn with_glass(mut stage: Stage) -> Stage {
    let used = stage.glb.json["extensionsUsed"].as_array_mut().unwrap();
    used.extend(["KHR_materials_transmission", "KHR_materials_volume"].map(|name| json!(name)));
    stage
}

/// Fails unless aimed photons bring what ordinary ones bring, by a check that a tenth more does not pass.
fn assert_as_ordinary(scene: Scene, what: &str) {
    let subject = Subject::new(scene);
    let ordinary = Power::of(&subject.ordinary());
    let aimed = Power::of(&subject.aimed());
    assert!(aimed.total_w() > 0.0, "{what}");
    assert!(
        aimed.agrees_with(&ordinary),
        "{what}: {aimed:?}, {ordinary:?}"
    );
    let more = ordinary.scaled(1.1);
    assert!(!aimed.agrees_with(&more), "{what}: {aimed:?}, {more:?}");
}

/// Its front is towards the floor.
fn lamp(stage: Stage, corner: Vec3, material: Value) -> Stage {
    stage.quad(corner, 0.6 * Vec3::X, 0.5 * Vec3::Z, material)
}

fn one_sided() -> Value {
    let mut material = glowing([2.0, 1.0, 0.5]);
    material["doubleSided"] = json!(false);
    material
}

fn spot(stage: Stage, position_m: Vec3) -> Stage {
    let light = json!({"type": "spot", "intensity": 5.0, "spot": {"innerConeAngle": 0.3, "outerConeAngle": 0.6}});
    stage.light(light, looking_down(position_m))
}

/// A node that stands at a place and looks down.
fn looking_down(position_m: Vec3) -> Value {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    json!({"translation": position_m.to_array(), "rotation": [-half, 0.0, 0.0, half]})
}

#[test]
fn aimed_photons_bring_the_caustic_light_of_triangles_that_shine_to_either_side_or_both() {
    let corner = Vec3::new(-0.4, 1.6, -0.2);
    assert_as_ordinary(lamp(room(), corner, one_sided()).load(), "front");
    assert_as_ordinary(lamp(room(), corner, glowing([1.0; 3])).load(), "both");

    let mut mirrored = lamp(room(), corner, one_sided());
    let node = mirrored.glb.json["nodes"].as_array().unwrap().len() - 1;
    let scales = [[-1.0f32, 1.0, 1.0]; 2];
    mirrored
        .glb
        .animate(node, "scale", "LINEAR", &[0.0, 1.0], &scales);
    assert_as_ordinary(mirrored.load(), "back");
}

#[test]
fn aimed_photons_bring_the_caustic_light_of_point_spot_and_directional_lights() {
    let above = Vec3::new(0.1, 1.7, 0.2);
    assert_as_ordinary(room().point_light(above, 3.0).load(), "point");
    let above = Vec3::new(-0.3, 1.7, 0.2);
    assert_as_ordinary(spot(room(), above).load(), "spot");

    let sun = json!({"type": "directional", "intensity": 3.0});
    let slanted = json!({"rotation": [-0.6, 0.1, 0.2, 0.76811457]});
    // No room around it: the sun would not shine in.
    let floor = open_floor();
    let floor = ball(floor, Vec3::new(-0.5, 0.5, 0.3), 0.3, glass());
    let floor = ball(floor, Vec3::new(-0.2, 0.5, 0.1), 0.2, mirror());
    assert_as_ordinary(floor.light(sun, slanted).load(), "directional");
}

fn open_floor() -> Stage {
    let (u, v) = (4.0 * Vec3::Z, 4.0 * Vec3::X);
    with_glass(Stage::new(Vec3::new(0.0, 1.5, 1.9), Vec3::ZERO)).quad(
        Vec3::new(-2.0, 0.0, -2.0),
        u,
        v,
        lambert([0.5; 3]),
    )
}

#[test]
fn aimed_photons_bring_the_caustic_light_of_lights_within_a_target() {
    let within = Vec3::new(-0.5, 0.4, 0.3);
    assert_as_ordinary(room().point_light(within, 3.0).load(), "point");
    assert_as_ordinary(spot(room(), within).load(), "spot");
    let around = room().cuboid(Vec3::new(0.0, 1.3, 0.0), Vec3::splat(0.45), glass());
    let corner = Vec3::new(-0.3, 1.4, -0.25);
    assert_as_ordinary(lamp(around, corner, glowing([1.0; 3])).load(), "area");
}

#[test]
fn rays_that_meet_two_targets_count_once() {
    let two_balls = |first, second| {
        let stage = ball(empty_room(), Vec3::new(-0.2, 0.6, 0.0), 0.3, first);
        let stage = ball(stage, Vec3::new(0.1, 0.7, 0.1), 0.3, second);
        stage.point_light(Vec3::new(-0.6, 1.8, 0.2), 3.0).load()
    };
    let subject = Subject::new(two_balls(glass(), glass()));
    let ordinary = Power::of(&subject.ordinary());
    let aimed = Power::of(&subject.aimed());
    assert!(aimed.agrees_with(&ordinary), "{aimed:?}, {ordinary:?}");

    // As if each ball were alone: what meets both spheres counts for each.
    let diffuse = || lambert([0.5; 3]);
    let [first, second] = [two_balls(glass(), diffuse()), two_balls(diffuse(), glass())]
        .map(|scene| Power::of(&subject.aimed_at(&subject.targets_of(&scene))));
    let each = first.plus(&second);
    assert!(!each.agrees_with(&ordinary), "{each:?}, {ordinary:?}");
}

#[test]
fn caustics_follow_a_glass_ball_that_moves() {
    let mut stage = ball(empty_room(), Vec3::ZERO, 0.3, glass());
    let node = stage.glb.json["nodes"].as_array().unwrap().len() - 1;
    let places = [[-0.9f32, 0.6, -0.8], [0.9, 0.6, 0.8]];
    // Of another size along each axis, and mirrored.
    let scales = [[1.2f32, -0.6, 1.0]; 2];
    for (path, values) in [("translation", places), ("scale", scales)] {
        stage
            .glb
            .animate(node, path, "LINEAR", &[0.0, 1.0], &values);
    }
    let scene = stage.point_light(Vec3::new(0.0, 1.8, 0.0), 3.0).load();
    let (early, late) = (scene.pose_at(0.0), scene.pose_at(0.9));
    let mut subject = Subject::new(scene);
    let targets = subject.targets_of(&subject.loaded.scene);
    let mut powers = |pose: &ScenePose, aim: &ScenePose| {
        subject.loaded.on_gpu.set_pose(gpu(), pose);
        targets.set_pose(gpu(), aim);
        [subject.ordinary(), subject.aimed_at(&targets)].map(|tracer| Power::of(&tracer))
    };
    let quarter_of_most = |power: &Power| {
        let most_w = power.mean_w.into_iter().fold(0.0, f64::max);
        power.mean_w.iter().position(|mean_w| *mean_w == most_w)
    };
    for (pose, quarter) in [(&early, 0), (&late, 3)] {
        let [ordinary, aimed] = powers(pose, pose);
        assert!(aimed.agrees_with(&ordinary), "{aimed:?}, {ordinary:?}");
        assert_eq!(quarter_of_most(&aimed), Some(quarter), "{aimed:?}");
    }
    let [ordinary, astray] = powers(&late, &early);
    assert!(!astray.agrees_with(&ordinary), "{astray:?}, {ordinary:?}");
}

/// The names of the passes that tracing a map takes.
fn passes_of(tracer: &PhotonTracer) -> Vec<&'static str> {
    let mut timer = PassTimer::new(gpu());
    let mut recorder = Recorder::new(gpu(), &mut timer);
    let settings = TraceSettings {
        path_count: AIMED,
        depth_max: 16,
        seed: 1,
        frame: 0,
    };
    tracer.record(&mut recorder, &settings);
    let passes = recorder.finish().unwrap();
    passes.iter().map(|pass| pass.name).collect()
}

#[test]
fn without_specular_surfaces_or_without_light_no_photon_is_aimed() {
    let above = Vec3::new(0.1, 1.7, 0.2);
    let lit = |stage: Stage| Subject::new(stage.point_light(above, 3.0).load()).aimed();
    let diffuse = lit(empty_room());
    assert!(passes_of(&diffuse).is_empty());
    assert_eq!(map(&diffuse, 0).0, []);
    assert_eq!(map(&Subject::new(room().load()).aimed(), 0).0, []);

    let specular = lit(room());
    assert_eq!(passes_of(&specular), [trace::TRACING]);
    assert!(!map(&specular, 0).0.is_empty());
}

#[test]
fn aimed_photons_are_caustic_ones_and_ordinary_ones_can_leave_those_out() {
    let subject = Subject::new(room().point_light(Vec3::new(0.1, 1.7, 0.2), 3.0).load());
    let aimed = map(&subject.aimed(), 0).0;
    assert!(aimed.iter().all(|photon| photon.is_caustic));

    let ordinary = map(&subject.ordinary(), 0).0;
    let constants = [subject.constants(), vec![("STORES_CAUSTIC", 0.0)]].concat();
    let scene = &subject.loaded.on_gpu;
    let others = PhotonTracer::new(gpu(), scene, &subject.params, &constants).unwrap();
    let is_global = |photon: &&StoredPhoton| !photon.is_caustic;
    let expected: Vec<StoredPhoton> = ordinary.iter().filter(is_global).copied().collect();
    assert!(expected.len() < ordinary.len());
    assert!(map(&others, 0).0 == expected);
}

const SIZE: (u32, u32) = (48, 48);

/// What the camera sees by the photons of the tracers, in the mean of some.
fn picture(subject: &Subject, tracers: &[PhotonTracer]) -> LinearImage {
    let scene = &subject.loaded.on_gpu;
    let effects = technique::effects(&subject.loaded.scene, &subject.params);
    let settings = MapSettings {
        global_radius_m: 0.1,
        caustic_radius_m: 0.05,
        radius_scale_max: 1.0,
        normal_cos_min: subject.params.gather.normal_cos_min,
        flatness: subject.params.gather.flatness,
    };
    let sorted = |tracer: &PhotonTracer| {
        let mut map = PhotonMap::new(gpu(), tracer.store(), scene.bounds()).unwrap();
        map.configure(gpu(), &settings);
        map
    };
    let sorted: Vec<PhotonMap> = tracers.iter().map(sorted).collect();
    let photons: Vec<_> = tracers.iter().zip(&sorted).collect();
    let light = photons.iter().flat_map(|(tracer, map)| {
        let classes = map.classes().iter();
        classes.map(|class| LightPass::photons(tracer.store(), map, *class))
    });
    let start = EyeStart {
        gpu: gpu(),
        scene,
        light: &Vec::from_iter(light),
        filter_levels: 0,
        keeping_eyes: 0,
        effects,
        size: SIZE,
        samples_max: 4,
    };
    let mut eyes = EyePass::new(&start, &subject.constants()).unwrap();
    let view = subject.loaded.scene.cameras[0].view(SIZE.0, SIZE.1);
    let image = EyeImage::new(gpu(), SIZE.0, SIZE.1).unwrap();
    let mut timer = PassTimer::new(gpu());
    let mut recorder = Recorder::new(gpu(), &mut timer);
    for frame in 0..4 {
        for (tracer, map) in &photons {
            let settings = TraceSettings {
                path_count: ORDINARY,
                depth_max: 16,
                seed: 1,
                frame,
            };
            tracer.record(&mut recorder, &settings);
            map.record(&mut recorder);
        }
        let eye = EyeSettings {
            frame,
            ..EyeSettings::new(&subject.params, view, None)
        };
        eyes.record(&mut recorder, &eye, &image).unwrap();
    }
    recorder.finish().unwrap();
    image.read(gpu()).unwrap()
}

#[test]
fn a_map_of_aimed_photons_takes_the_place_of_the_ordinary_map_s_caustic_class() {
    let subject = Subject::new(spot(room(), Vec3::new(-0.3, 1.7, 0.2)).load());
    let scene = &subject.loaded.on_gpu;
    let constants = [subject.constants(), vec![("STORES_CAUSTIC", 0.0)]].concat();
    let others = || PhotonTracer::new(gpu(), scene, &subject.params, &constants).unwrap();
    let ordinary = picture(&subject, &[subject.ordinary()]);
    let both = picture(&subject, &[others(), subject.aimed()]);
    means_agree(mean(&both), mean(&ordinary), 0.01).unwrap();
    let without = picture(&subject, &[others()]);
    assert!(means_agree(mean(&without), mean(&ordinary), 0.01).is_err());
}
