//! What lamps without extent send by way of sharp lobes: photons bring it where paths would have to find it by chance, and bring as much.

use glam::Vec3;
use macula::scene::Scene;
use macula::scene::loaded::LoadedScene;
use serde_json::{Value, json};

use crate::maker::{Recipe, Stage, gpu, lambert};

/// Pictures of other random numbers, from which the noise of their mean is told.
const PICTURES: u32 = 12;
/// Standard errors that two means may be apart.
const STANDARD_ERRORS: f64 = 4.0;

/// A floor before a wall that leans over it, a lamp between them, and a pane under the lamp.
fn corner(floor: Value, wall: Value, pane: Option<Value>) -> Scene {
    let stage = Stage::new(Vec3::new(0.0, 1.6, 2.4), Vec3::new(0.0, 0.4, 0.0))
        .quad(
            Vec3::new(-2.0, 0.0, 2.0),
            4.0 * Vec3::X,
            -3.0 * Vec3::Z,
            floor,
        )
        .quad(
            Vec3::new(-2.0, 0.0, -1.0),
            4.0 * Vec3::X,
            Vec3::new(0.0, 2.0, 0.6),
            wall,
        )
        .point_light(Vec3::new(0.0, 1.1, 0.2), 5.0);
    match pane {
        Some(pane) => stage.cuboid(Vec3::new(0.0, 0.5, 0.3), Vec3::new(0.3, 0.05, 0.3), pane),
        None => stage,
    }
    .load()
}

/// The mean over a picture, and its standard error.
fn mean_and_error(scene: &LoadedScene, caustic_photons: &str) -> (f64, f64) {
    let recipe = Recipe::new("path").size(24, 24);
    let recipe = recipe
        .set("path.samples", "96")
        .set("path.caustic_photons", caustic_photons)
        .set("path.caustic_radius_m", "0.02");
    let mut still = recipe.still(scene);
    let count = f64::from(PICTURES);
    let means: Vec<f64> = (0..PICTURES)
        .map(|_| {
            still.start_over();
            still.add_pass().unwrap();
            crate::maker::mean(&still.read().unwrap())
                .iter()
                .sum::<f64>()
                / 3.0
        })
        .collect();
    let mean = means.iter().sum::<f64>() / count;
    let squares: f64 = means.iter().map(|x| (x - mean).powi(2)).sum();
    (mean, (squares / (count * (count - 1.0))).sqrt())
}

#[test]
fn photons_bring_as_much_light_by_way_of_sharp_lobes_as_paths_find() {
    let of_roughness = |mut material: Value, roughness: f32| {
        material["pbrMetallicRoughness"]["roughnessFactor"] = json!(roughness);
        material
    };
    let mut gold = of_roughness(lambert([0.9, 0.7, 0.4]), 0.4);
    gold["pbrMetallicRoughness"]["metallicFactor"] = json!(1.0);
    let mut lacquer = of_roughness(lambert([0.5; 3]), 0.35);
    lacquer["extensions"] = json!({"KHR_materials_ior": {"ior": 2.4}});
    let mut frosted = of_roughness(lambert([1.0; 3]), 0.44);
    frosted["extensions"] = json!({
        "KHR_materials_transmission": {"transmissionFactor": 1.0},
        "KHR_materials_volume": {"thicknessFactor": 0.1},
    });
    let white = || lambert([0.7; 3]);
    for (name, scene) in [
        ("brushed gold", corner(white(), gold.clone(), None)),
        ("lacquer", corner(lacquer.clone(), lacquer.clone(), None)),
        ("lacquer before gold", corner(lacquer, gold, None)),
        ("frosted glass", corner(white(), white(), Some(frosted))),
    ] {
        let loaded = LoadedScene::new(gpu(), scene).unwrap();
        let (found, found_error) = mean_and_error(&loaded, "0");
        let (brought, brought_error) = mean_and_error(&loaded, "200000");
        let error = found_error.hypot(brought_error);
        println!(
            "{name}: {found:.5} +- {found_error:.5}, by photons {brought:.5} +- {brought_error:.5}"
        );
        let is_off = |brought: f64| (brought - found).abs() > STANDARD_ERRORS * error;
        assert!(!is_off(brought), "{name}");
        assert!(is_off(1.04 * brought), "{name}: the noise hides 4 %");
    }
}
