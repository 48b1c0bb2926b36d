//! Random scenes: triangles with area and without, boxes, lights of each kind over twelve orders of magnitude, and materials all over the
//! model's ranges. A scene is plain data first, so that a failure shrinks and can be read.

use glam::{Quat, Vec3};
use macula::scene::Scene;
use proptest::prelude::*;
use serde_json::{Value, json};

use crate::maker::{Stage, lambert};

/// A number from 0 to 1, its ends often.
fn share() -> impl Strategy<Value = f32> {
    prop_oneof![1 => Just(0.0f32), 1 => Just(1.0f32), 3 => 0.0..=1.0f32]
}

/// A positive number over twelve orders of magnitude.
fn magnitude() -> impl Strategy<Value = f32> {
    (-6.0..=6.0f32).prop_map(|exponent| 10f32.powf(exponent))
}

fn place() -> impl Strategy<Value = Vec3> {
    let coordinate = || prop_oneof![4 => -1.5..1.5f32, 1 => Just(0.0f32), 1 => Just(1.0f32)];
    [coordinate(), coordinate(), coordinate()].prop_map(Vec3::from_array)
}

#[derive(Clone, Debug)]
pub struct RandomMaterial {
    base: [f32; 3],
    metallic: f32,
    roughness: f32,
    specular: f32,
    transmission: f32,
    ior: f32,
    is_solid: bool,
    attenuation: (f32, f32),
    emission: Option<f32>,
    is_double_sided: bool,
}

impl RandomMaterial {
    fn gltf(&self) -> Value {
        let [r, g, b] = self.base;
        let mut material = json!({
            "pbrMetallicRoughness": {
                "baseColorFactor": [r, g, b, 1.0], "metallicFactor": self.metallic, "roughnessFactor": self.roughness,
            },
            "doubleSided": self.is_double_sided,
            "extensions": {
                "KHR_materials_specular": {"specularFactor": self.specular},
                "KHR_materials_transmission": {"transmissionFactor": self.transmission},
                "KHR_materials_ior": {"ior": self.ior},
            },
        });
        if self.is_solid {
            let (color, distance_m) = self.attenuation;
            material["extensions"]["KHR_materials_volume"] = json!({
                "thicknessFactor": 1.0, "attenuationDistance": distance_m, "attenuationColor": [color, 1.0, color],
            });
        }
        if let Some(strength) = self.emission {
            material["emissiveFactor"] = json!([1.0, 0.5, 0.25]);
            material["extensions"]["KHR_materials_emissive_strength"] =
                json!({"emissiveStrength": strength});
        }
        material
    }
}

fn material() -> impl Strategy<Value = RandomMaterial> {
    let surface = (prop::array::uniform3(share()), share(), share(), share());
    let transmission = prop_oneof![3 => Just(0.0f32), 1 => share()];
    let inside = (
        transmission,
        1.0..3.0f32,
        any::<bool>(),
        (share(), magnitude()),
    );
    let emission = prop::option::weighted(0.2, magnitude());
    // Half of the materials are Lambertian: of those the largest radiance is known.
    let is_plain = any::<bool>();
    (surface, inside, emission, any::<bool>(), is_plain).prop_map(
        |((base, metallic, roughness, specular), inside, emission, is_double_sided, is_plain)| {
            let (transmission, ior, is_solid, attenuation) = inside;
            let unless_plain = |x: f32| if is_plain { 0.0 } else { x };
            RandomMaterial {
                base,
                metallic: unless_plain(metallic),
                roughness,
                specular: unless_plain(specular),
                transmission: unless_plain(transmission),
                ior,
                is_solid: is_solid && !is_plain,
                attenuation,
                emission,
                is_double_sided,
            }
        },
    )
}

#[derive(Clone, Debug)]
pub enum RandomShape {
    Triangle([Vec3; 3]),
    /// Two corners in one place.
    Line(Vec3, Vec3),
    /// All corners in one place.
    Point(Vec3),
    Quad(Vec3, Vec3, Vec3),
    Box(Vec3, Vec3),
}

fn shape() -> impl Strategy<Value = RandomShape> {
    prop_oneof![
        3 => [place(), place(), place()].prop_map(RandomShape::Triangle),
        1 => (place(), place()).prop_map(|(a, b)| RandomShape::Line(a, b)),
        1 => place().prop_map(RandomShape::Point),
        4 => (place(), place(), place()).prop_map(|(corner, u, v)| RandomShape::Quad(corner, u, v)),
        2 => (place(), prop::array::uniform3(1e-3..1.0f32))
            .prop_map(|(center, half)| RandomShape::Box(center, Vec3::from_array(half))),
    ]
}

#[derive(Clone, Debug)]
pub struct RandomLight {
    kind: &'static str,
    intensity: f32,
    place: Vec3,
    turn: [f32; 2],
}

fn light() -> impl Strategy<Value = RandomLight> {
    let kind = prop::sample::select(vec!["point", "spot", "directional"]);
    (
        kind,
        magnitude(),
        place(),
        prop::array::uniform2(-3.0..3.0f32),
    )
        .prop_map(|(kind, intensity, place, turn)| RandomLight {
            kind,
            intensity,
            place,
            turn,
        })
}

/// A scene as plain data.
#[derive(Clone, Debug)]
pub struct RandomScene {
    /// Radiance, W/(m² sr), and albedo of the walls of a glowing room around all, if there is one: most pictures there are nearly as bright
    /// as lights and surfaces allow.
    room: Option<(f32, f32)>,
    shapes: Vec<(RandomShape, RandomMaterial)>,
    lights: Vec<RandomLight>,
}

/// Half of a side of the glowing room, metres: it holds every shape, and heads near the camera.
const ROOM_HALF_M: f32 = 8.0;

/// Up to five shapes and three lights.
pub fn any_scene() -> impl Strategy<Value = RandomScene> {
    let shapes = prop::collection::vec((shape(), material()), 0..5);
    let lights = prop::collection::vec(light(), 0..3);
    (shapes, lights).prop_map(|(shapes, lights)| RandomScene {
        room: None,
        shapes,
        lights,
    })
}

/// Up to five shapes that emit nothing, each of Lambert, metal or glass, in a glowing room.
pub fn any_furnace() -> impl Strategy<Value = RandomScene> {
    let room = (magnitude(), 0.0..0.9f32);
    let shapes = prop::collection::vec((shape(), material()), 0..5);
    (room, shapes).prop_map(|(room, mut shapes)| {
        for (shape, material) in &mut shapes {
            material.emission = None;
            material.metallic = material.metallic.ceil();
            material.specular = 0.0;
            material.transmission = material.transmission.ceil();
            // What bounds a solid closes it.
            material.is_solid &= matches!(shape, RandomShape::Box(..));
        }
        let (room, lights) = (Some(room), Vec::new());
        RandomScene {
            room,
            shapes,
            lights,
        }
    })
}

impl RandomScene {
    /// Written as a file and loaded, seen from outside.
    pub fn load(&self) -> Scene {
        let mut stage = Stage::new(Vec3::new(0.5, 0.7, 3.0), Vec3::ZERO);
        if let Some((radiance, albedo)) = self.room {
            let mut wall = lambert([albedo; 3]);
            wall["emissiveFactor"] = json!([1.0, 1.0, 1.0]);
            wall["extensions"]["KHR_materials_emissive_strength"] =
                json!({"emissiveStrength": radiance});
            wall["doubleSided"] = json!(false);
            stage = stage.cuboid(Vec3::ZERO, Vec3::splat(-ROOM_HALF_M), wall);
        }
        let stage = self.shapes.iter().fold(stage, |stage, (shape, material)| {
            let material = material.gltf();
            match shape {
                RandomShape::Triangle(corners) => stage.triangles(corners, &[0, 1, 2], material),
                RandomShape::Line(a, b) => stage.triangles(&[*a, *b, *b], &[0, 1, 2], material),
                RandomShape::Point(a) => stage.triangles(&[*a; 3], &[0, 1, 2], material),
                RandomShape::Quad(corner, u, v) => stage.quad(*corner, *u, *v, material),
                RandomShape::Box(center, half) => stage.cuboid(*center, *half, material),
            }
        });
        let stage = self.lights.iter().fold(stage, |stage, light| {
            let mut gltf = json!({"type": light.kind, "intensity": light.intensity});
            if light.kind == "spot" {
                gltf["spot"] = json!({"innerConeAngle": 0.2, "outerConeAngle": 0.7});
            }
            let [yaw, pitch] = light.turn;
            let turn = Quat::from_rotation_y(yaw) * Quat::from_rotation_x(pitch);
            stage.light(
                gltf,
                json!({"translation": light.place.to_array(), "rotation": turn.to_array()}),
            )
        });
        stage.load()
    }
}
