//! What lamps without extent send by way of sharp lobes: photons bring it where paths would have to find it by chance, and bring as much.

use glam::{Vec2, Vec3, Vec3Swizzles};
use macula::scene::loaded::LoadedScene;
use macula::scene::{Scene, Texture, TextureRef, Wrap};
use serde_json::{Value, json};

use crate::maker::{Recipe, Stage, gpu, lambert, mean};

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

/// The same with a floor of small squares that are each of two texels in turn: of its base colour, or of its metalness and roughness.
fn checkered(mut scene: Scene, texels: [[u8; 4]; 2], is_base_color: bool) -> Scene {
    const SQUARES_A_METRE: f32 = 60.0;
    let [a, b] = texels;
    scene.textures.push(Texture {
        width: 2,
        height: 2,
        rgba8: vec![a, b, b, a],
        is_srgb: false,
        wrap: [Wrap::Repeat; 2],
        is_bilinear: false,
    });
    let used = Some(TextureRef {
        texture: 0,
        uv_column0: Vec2::X,
        uv_column1: Vec2::Y,
        uv_offset: Vec2::ZERO,
    });
    let mesh = &mut scene.static_mesh;
    let positions = mesh.positions.iter();
    mesh.texcoords = positions.map(|p| 0.5 * SQUARES_A_METRE * p.xz()).collect();
    let floor = &mut scene.materials[mesh.material_of_triangle[0] as usize];
    match is_base_color {
        true => floor.base_color_texture = used,
        false => floor.metallic_roughness_texture = used,
    }
    scene
}

/// The mean of each channel over a picture, and its standard error.
fn mean_and_error(scene: &LoadedScene, caustic_photons: &str) -> [(f64, f64); 3] {
    let recipe = Recipe::new("path").size(24, 24);
    let recipe = recipe
        .set("path.samples", "96")
        .set("path.caustic_photons", caustic_photons)
        .set("path.caustic_radius_m", "0.02");
    let mut still = recipe.still(scene);
    let count = f64::from(PICTURES);
    let means: Vec<[f64; 3]> = (0..PICTURES)
        .map(|_| {
            still.start_over();
            still.add_pass().unwrap();
            mean(&still.read().unwrap())
        })
        .collect();
    [0, 1, 2].map(|c| {
        let mean = means.iter().map(|x| x[c]).sum::<f64>() / count;
        let squares: f64 = means.iter().map(|x| (x[c] - mean).powi(2)).sum();
        (mean, (squares / (count * (count - 1.0))).sqrt())
    })
}

#[test]
fn photons_bring_as_much_light_by_way_of_sharp_lobes_as_paths_find() {
    let of_roughness = |mut material: Value, roughness: f32| {
        material["pbrMetallicRoughness"]["roughnessFactor"] = json!(roughness);
        material
    };
    let metal = |color: [f32; 3], roughness| {
        let mut metal = of_roughness(lambert(color), roughness);
        metal["pbrMetallicRoughness"]["metallicFactor"] = json!(1.0);
        metal
    };
    let gold = || metal([0.9, 0.7, 0.4], 0.4);
    let lacquer = || {
        let mut lacquer = of_roughness(lambert([0.8, 0.4, 0.1]), 0.35);
        lacquer["extensions"] = json!({"KHR_materials_ior": {"ior": 2.4}});
        lacquer
    };
    let mut frosted = of_roughness(lambert([1.0; 3]), 0.44);
    frosted["extensions"] = json!({
        "KHR_materials_transmission": {"transmissionFactor": 1.0},
        "KHR_materials_volume": {"thicknessFactor": 0.1},
    });
    let tiles = [[0, 0, 0, 255], [255; 4]];
    // Green is roughness: lobes on either side of what counts as sharp.
    let worn = [[255, 205, 255, 255], [255; 4]];
    let white = || lambert([0.7; 3]);
    for (name, scene) in [
        ("brushed gold", corner(white(), gold(), None)),
        ("lacquer", corner(lacquer(), lacquer(), None)),
        ("lacquer before gold", corner(lacquer(), gold(), None)),
        ("frosted glass", corner(white(), white(), Some(frosted))),
        (
            "black and white tiles before gold",
            checkered(corner(white(), gold(), None), tiles, true),
        ),
        (
            "worn metal before gold",
            checkered(corner(metal([0.9; 3], 0.5), gold(), None), worn, false),
        ),
    ] {
        let loaded = LoadedScene::new(gpu(), scene).unwrap();
        let found = mean_and_error(&loaded, "0");
        let brought = mean_and_error(&loaded, "200000");
        println!(
            "{name}: {found:.5?}, by photons {brought:.5?} (mean and standard error by channel)"
        );
        let is_off = |factor: f64| {
            let mut channels = found.iter().zip(&brought);
            channels.any(|((found, found_error), (brought, brought_error))| {
                let error = found_error.hypot(*brought_error);
                (factor * brought - found).abs() > STANDARD_ERRORS * error
            })
        };
        assert!(!is_off(1.0), "{name}");
        assert!(is_off(1.04), "{name}: the noise hides 4 %");
    }
}
