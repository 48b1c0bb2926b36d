//! Photons that are aimed at specular surfaces bring the caustic light that ordinary photons bring, from fewer paths.

use glam::Vec3;
use macula::gpu::layout::PhotonCounters;
use macula::params::Params;
use macula::photon::{PhotonTracer, TraceSettings};
use macula::scene::Scene;
use macula::scene::loaded::LoadedScene;
use macula::scene::specular_targets::SpecularTargets;
use macula::technique;
use serde_json::{Value, json};

use crate::maker::{Stage, glowing, gpu, lambert, mirror};
use crate::photon_flux::{StoredPhoton, trace};

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

    /// Ordinary paths that end as aimed ones do, so that they take less time.
    fn ordinary_caustics(&self) -> PhotonTracer {
        let constants = [self.constants(), vec![("STORES_GLOBAL", 0.0)]].concat();
        PhotonTracer::new(gpu(), &self.loaded.on_gpu, &self.params, &constants).unwrap()
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
    trace(tracer, &settings)
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

/// A room four metres wide and two high, with a glass ball and a mirror that stands.
fn room() -> Stage {
    let stage = empty_room();
    let (corner, u, v) = (
        Vec3::new(0.4, 0.1, -0.9),
        Vec3::new(0.5, 0.0, 0.3),
        Vec3::new(0.0, 0.7, 0.0),
    );
    let stage = stage.quad(corner, u, v, mirror());
    ball(stage, Vec3::new(-0.5, 0.4, 0.3), 0.3, glass())
}

fn empty_room() -> Stage {
    let mut stage = Stage::new(Vec3::new(0.0, 1.5, 1.9), Vec3::ZERO);
    let used = stage.glb.json["extensionsUsed"].as_array_mut().unwrap();
    used.extend(["KHR_materials_transmission", "KHR_materials_volume"].map(|name| json!(name)));
    let half_m = -Vec3::new(2.0, 1.0, 2.0);
    stage.cuboid(Vec3::Y, half_m, lambert([0.5; 3]))
}

/// Fails unless aimed photons bring what ordinary ones bring, by a check that a tenth more does not pass.
fn assert_as_ordinary(scene: Scene, what: &str) {
    let subject = Subject::new(scene);
    let ordinary = Power::of(&subject.ordinary_caustics());
    let aimed = Power::of(&subject.aimed());
    println!("{what}: {aimed:?}, ordinary {ordinary:?}");
    assert!(aimed.total_w() > 0.0, "{what}");
    assert!(
        aimed.agrees_with(&ordinary),
        "{what}: {aimed:?}, {ordinary:?}"
    );
    assert!(
        !aimed.agrees_with(&ordinary.scaled(1.1)),
        "{what} tells nothing"
    );
}

fn spot() -> Value {
    json!({"type": "spot", "intensity": 5.0, "spot": {"innerConeAngle": 0.3, "outerConeAngle": 0.6}})
}

/// A node that stands at a place and looks down.
fn looking_down(position_m: Vec3) -> Value {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    json!({"translation": position_m.to_array(), "rotation": [-half, 0.0, 0.0, half]})
}

#[test]
fn aimed_photons_bring_the_caustic_light_of_every_kind_of_light() {
    let corner = Vec3::new(-0.4, 1.6, -0.2);
    // Its front is towards the floor.
    let (u, v) = (Vec3::new(0.6, 0.0, 0.0), Vec3::new(0.0, 0.0, 0.5));
    let mut one_sided = glowing([2.0, 1.0, 0.5]);
    one_sided["doubleSided"] = json!(false);
    let area = |stage: Stage, material| stage.quad(corner, u, v, material);
    assert_as_ordinary(area(room(), one_sided.clone()).load(), "area, one side");
    assert_as_ordinary(area(room(), glowing([1.0; 3])).load(), "area, two sides");

    let above = Vec3::new(0.1, 1.7, 0.2);
    assert_as_ordinary(room().point_light(above, 3.0).load(), "point");
    let lit = room().light(spot(), looking_down(Vec3::new(-0.3, 1.7, 0.2)));
    assert_as_ordinary(lit.load(), "spot");
}
