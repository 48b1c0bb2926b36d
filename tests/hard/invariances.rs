//! What must not change a picture: where the scene stands, how large it is, which way it is turned, in which order it is written down,
//! and into how many pieces it is cut.
//!
//! A variant differs from the plain room as another seed does, no more; and with more photons and samples the difference shrinks, as
//! noise does and no error would.

use glam::{Quat, Vec3};
use macula::image::LinearImage;
use macula::metrics::{self, error::ImagePair};
use macula::scene::Scene;
use serde_json::{Value, json};

use crate::maker::{
    Recipe, Stage, glowing, lambert, largest_relative_difference, mean, mirror, reduced,
};
use crate::runner::techniques;
use crate::shared::shared;

/// A room's corner: two walls, a floor and a block, under three lamps.
struct Room {
    /// Corner, two sides, albedo.
    quads: Vec<(Vec3, Vec3, Vec3, [f32; 3])>,
    lamps: Vec<(Vec3, f32)>,
    eye: Vec3,
    target: Vec3,
}

fn room() -> Room {
    let mut quads = vec![
        (Vec3::ZERO, 2.0 * Vec3::Z, 2.0 * Vec3::X, [0.8; 3]),
        (Vec3::ZERO, 2.0 * Vec3::Y, 2.0 * Vec3::Z, [0.8, 0.2, 0.1]),
        (Vec3::ZERO, 2.0 * Vec3::X, 2.0 * Vec3::Y, [0.1, 0.2, 0.8]),
    ];
    let (low, side) = (Vec3::new(0.4, 0.0, 0.4), 0.4);
    let [x, y, z] = Vec3::AXES.map(|axis| side * axis);
    quads.push((low + y, z, x, [0.6; 3]));
    quads.push((low + x, y, z, [0.6; 3]));
    quads.push((low + z, x, y, [0.6; 3]));
    Room {
        quads,
        lamps: vec![
            (Vec3::new(0.9, 1.4, 0.8), 2.0),
            (Vec3::new(1.6, 1.0, 0.3), 0.5),
            (Vec3::new(0.3, 1.2, 1.7), 1.0),
        ],
        eye: Vec3::new(1.7, 1.3, 1.7),
        target: Vec3::new(0.3, 0.4, 0.3),
    }
}

impl Room {
    /// Every point and side moved.
    fn moved(mut self, scale: f32, turn: Quat, by: Vec3) -> Self {
        let point = |p: Vec3| turn * (scale * p) + by;
        for (corner, u, v, _) in &mut self.quads {
            *corner = point(*corner);
            [*u, *v] = [*u, *v].map(|side| turn * (scale * side));
        }
        for (place, intensity) in &mut self.lamps {
            *place = point(*place);
            *intensity *= scale * scale;
        }
        [self.eye, self.target] = [self.eye, self.target].map(point);
        self
    }

    fn lamps_reversed(mut self) -> Self {
        self.lamps.reverse();
        self
    }

    fn quads_reversed(mut self) -> Self {
        self.quads.reverse();
        self
    }

    fn stage(&self) -> Stage {
        let quads = self.quads.iter();
        quads.fold(self.lit(), |stage, (corner, u, v, albedo)| {
            stage.quad(*corner, *u, *v, lambert(*albedo))
        })
    }

    fn lit(&self) -> Stage {
        let stage = Stage::new(self.eye, self.target);
        let lamps = self.lamps.iter();
        lamps.fold(stage, |stage, (place, intensity)| {
            stage.point_light(*place, *intensity)
        })
    }

    /// Each quad as its two triangles, every triangle a mesh of its own; with `is_reversed` from the last to the first.
    fn in_pieces(&self, is_reversed: bool) -> Stage {
        let mut pieces: Vec<([Vec3; 3], Value)> = Vec::new();
        for (corner, u, v, albedo) in &self.quads {
            let [a, b, c, d] = [*corner, corner + u, corner + u + v, corner + v];
            for piece in [[a, b, c], [a, c, d]] {
                pieces.push((piece, lambert(*albedo)));
            }
        }
        if is_reversed {
            pieces.reverse();
        }
        let pieces = pieces.into_iter();
        pieces.fold(self.lit(), |stage, (corners, material)| {
            stage.triangles(&corners, &[0, 1, 2], material)
        })
    }

    /// One mesh, whose three instances are the block's faces.
    fn instances(&self) -> Stage {
        let (walls, faces) = self.quads.split_at(3);
        let rest = Room {
            quads: walls.to_vec(),
            lamps: self.lamps.clone(),
            ..*self
        };
        let mut stage = rest.stage();
        let unit = [Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y].map(|p| p.to_array());
        stage.glb.mesh("face", &unit, &[0, 1, 2, 0, 2, 3]);
        let mesh = stage.glb.json["meshes"].as_array().unwrap().len() - 1;
        let (.., albedo) = faces[0];
        let material = stage.glb.push("materials", lambert(albedo));
        stage.glb.json["meshes"][mesh]["primitives"][0]["material"] = json!(material);
        for (corner, u, v, of_face) in faces {
            assert_eq!(*of_face, albedo, "instances share their material");
            let turn = glam::Mat3::from_cols(u.normalize(), v.normalize(), u.cross(*v).normalize());
            stage.glb.root(json!({
                "mesh": mesh, "translation": corner.to_array(), "rotation": Quat::from_mat3(&turn).to_array(),
                "scale": [u.length(), v.length(), 1.0],
            }));
        }
        stage
    }
}

/// The name of each variant and its scene.
pub fn variants() -> Vec<(&'static str, Scene)> {
    let turn = Quat::from_euler(glam::EulerRot::YXZ, 0.7, 0.3, -0.4).to_array();
    let turned = room().stage().under_node(json!({"rotation": turn}));
    let far = Vec3::new(6000.0, -5000.0, 6000.0);
    let moved = |scale, turn, by| room().moved(scale, turn, by).stage().load();
    vec![
        ("10 km away", moved(1.0, Quat::IDENTITY, far)),
        ("a thousandth", moved(1e-3, Quat::IDENTITY, Vec3::ZERO)),
        ("a thousand times", moved(1e3, Quat::IDENTITY, Vec3::ZERO)),
        (
            "turned upright",
            moved(1.0, Quat::from_rotation_y(0.7), Vec3::ZERO),
        ),
        ("turned with its eye", turned.load()),
        (
            "lamps in another order",
            room().lamps_reversed().stage().load(),
        ),
        (
            "meshes in another order",
            room().quads_reversed().stage().load(),
        ),
        ("every triangle a mesh", room().in_pieces(false).load()),
        ("triangles in another order", room().in_pieces(true).load()),
        ("faces as instances of one mesh", room().instances().load()),
    ]
}

/// The relative squared difference of two pictures, by blocks of 8x8 pixels.
fn difference(candidate: &LinearImage, reference: &LinearImage) -> f64 {
    let pair = ImagePair {
        width: reference.width as usize,
        candidate: &candidate.rgb,
        reference: &reference.rgb,
        reference_standard_error: None,
    };
    metrics::compare(pair, None).unwrap().block8.unwrap().relmse
}

fn picture(technique: &'static str, scene: &Scene, seed: &str, passes: u32) -> LinearImage {
    let recipe = Recipe::new(technique).size(32, 32).passes(passes);
    let recipe = recipe.set("random.seed", seed).set("photon.count", "10000");
    recipe.set("path.samples", "4").render_scene(scene).image
}

/// Passes of the noisy and of the calm pictures.
const PASSES: [u32; 2] = [1, 8];

#[test]
fn place_size_turn_order_and_cuts_change_no_picture() {
    let plain = room().stage().load();
    let variants = variants();
    for entry in techniques() {
        let [few, many] = PASSES.map(|passes| {
            let reference = picture(entry.name, &plain, "1", passes);
            let noise = difference(&picture(entry.name, &plain, "2", passes), &reference);
            let of_variant = |(_, scene): &(_, Scene)| {
                difference(&picture(entry.name, scene, "3", passes), &reference)
            };
            (noise, variants.iter().map(of_variant).collect::<Vec<f64>>())
        });
        for (i, (name, _)) in variants.iter().enumerate() {
            let (noisy, calm) = (few.1[i], many.1[i]);
            let told = format!(
                "{name}, {}: {noisy:.2e} and {calm:.2e} where noise makes {:.2e} and {:.2e}",
                entry.name, few.0, many.0
            );
            println!("{told}");
            assert!(calm < 3.0 * many.0, "{told}");
            assert!(calm < 0.5 * noisy, "{told}");
        }
        // Control: a lamp that is a tenth brighter is no noise.
        let mut brighter = room();
        brighter.lamps[0].1 *= 1.1;
        let image = picture(entry.name, &brighter.stage().load(), "3", PASSES[1]);
        let reference = picture(entry.name, &plain, "1", PASSES[1]);
        assert!(
            difference(&image, &reference) > 3.0 * many.0,
            "{}",
            entry.name
        );
    }
    println!("invariances: {} variants", variants.len());
}

#[test]
fn a_shared_room_far_away_tiny_huge_or_under_nodes_looks_the_same() {
    let Some(plain) = shared("scenes/glb/a-cornell-diffuse.glb") else {
        return;
    };
    let plain = Scene::load(&plain).unwrap();
    for entry in techniques() {
        let take = |scene: &Scene, seed| picture(entry.name, scene, seed, PASSES[1]);
        let reference = take(&plain, "1");
        let noise = difference(&take(&plain, "2"), &reference);
        let report = |name: &str, scene: &Scene| {
            let image = take(scene, "1");
            let ratios = [0, 1, 2].map(|c| mean(&image)[c] / mean(&reference)[c]);
            let difference = difference(&image, &reference);
            println!(
                "{name}, {}: mean ratios {ratios:?}, blocks {difference:.2e} where noise makes {noise:.2e}",
                entry.name
            );
            ratios.iter().all(|ratio| (ratio - 1.0).abs() < 0.005) && difference < 2.0 * noise
        };
        for name in ["h-far-baked", "h-far-node", "h-small", "h-large", "h-nodes"] {
            let Some(path) = shared(&format!("scenes/glb/{name}.glb")) else {
                return;
            };
            assert!(
                report(name, &Scene::load(&path).unwrap()),
                "{name}, {}",
                entry.name
            );
        }
        let Some(other) = shared("scenes/glb/b-cornell-caustic.glb") else {
            return;
        };
        assert!(!report("another room", &Scene::load(&other).unwrap()));
    }
}

#[test]
fn twice_the_light_is_twice_the_radiance_in_every_pixel() {
    let lit = |factor: f32| {
        let mut room = room();
        room.lamps.iter_mut().for_each(|lamp| lamp.1 *= factor);
        room.stage().load()
    };
    for entry in techniques() {
        let [once, twice] = [1.0, 2.0].map(|factor| picture(entry.name, &lit(factor), "1", 1));
        let doubled = LinearImage {
            rgb: once.rgb.iter().map(|p| p.map(|x| 2.0 * x)).collect(),
            ..once.clone()
        };
        let worst = largest_relative_difference(&twice, &doubled, 1e-3);
        assert!(worst < 1e-4, "{}: {worst}", entry.name);
        assert!(mean(&once)[0] > 0.0);
        assert!(largest_relative_difference(&twice, &once, 1e-3) > 0.9);
    }
}

/// Three glowing panels of different colour, place and size, seen or mirrored, at x = 3.
fn panels(stage: Stage) -> Stage {
    let panel = |stage: Stage, y: f32, z: f32, side: f32, radiance| {
        let (u, v) = (side * Vec3::Z, side * Vec3::Y);
        stage.quad(Vec3::new(3.0, y, z), u, v, glowing(radiance))
    };
    let stage = panel(stage, -0.9, -1.1, 0.8, [1.0, 0.1, 0.1]);
    let stage = panel(stage, 0.1, -0.2, 0.5, [0.1, 0.9, 0.2]);
    panel(stage, -0.7, 0.4, 0.6, [0.2, 0.3, 2.0])
}

#[test]
fn a_mirror_shows_what_the_mirrored_eye_sees_the_wrong_way_round() {
    let eye = Vec3::new(2.0, 0.0, 0.0);
    let mirrored_eye = Vec3::new(-2.0, 0.0, 0.0);
    let glass = |stage: Stage| {
        let corner = Vec3::new(0.0, -4.0, -4.0);
        stage.quad(corner, 8.0 * Vec3::Y, 8.0 * Vec3::Z, mirror())
    };
    let in_mirror = glass(panels(Stage::new(eye, Vec3::ZERO))).load();
    let straight = panels(Stage::new(mirrored_eye, Vec3::ZERO)).load();
    for entry in techniques() {
        let recipe = Recipe::new(entry.name).passes(8).set("photon.count", "0");
        let recipe = recipe.set("path.samples", "16");
        let in_mirror = recipe.render_scene(&in_mirror).image;
        shows_it_turned(&in_mirror, &recipe.render_scene(&straight).image);
    }
}

/// Judges a mirror's picture by what the mirrored eye sees.
fn shows_it_turned(in_mirror: &LinearImage, straight: &LinearImage) {
    let rows = straight.rgb.chunks(straight.width as usize);
    let turned = LinearImage {
        rgb: rows.flat_map(|row| row.iter().rev().copied()).collect(),
        ..straight.clone()
    };
    // Blocks average over where samples fall in the pixels of an edge.
    let agree = |a: &LinearImage, b: &LinearImage| {
        largest_relative_difference(&reduced(a, 8), &reduced(b, 8), 0.5)
    };
    assert!(mean(straight).iter().all(|x| *x > 0.002));
    assert!(
        agree(in_mirror, &turned) < 0.03,
        "{}",
        agree(in_mirror, &turned)
    );
    assert!(agree(in_mirror, straight) > 0.3, "the way round is noticed");
}
