//! The bundled scenes are what their generator makes, and hold what `assets/README.md` says of them.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use glam::{Mat4, Vec3};
use gltf::animation::util::ReadOutputs;
use gltf::khr_lights_punctual::Kind;

#[path = "../examples/make_scenes/bundle/mod.rs"]
mod bundle;

/// One mesh primitive where it stands in the scene.
struct Part {
    node: String,
    material: String,
    is_emissive: bool,
    triangles: Vec<[Vec3; 3]>,
}

struct Loaded {
    document: gltf::Document,
    blob: Vec<u8>,
    parts: Vec<Part>,
    byte_count: usize,
}

impl Loaded {
    fn triangle_count(&self) -> usize {
        self.parts.iter().map(|part| part.triangles.len()).sum()
    }

    fn camera_position(&self, name: &str) -> Vec3 {
        let is_it = |node: &gltf::Node| node.camera().is_some() && node.name() == Some(name);
        let node = self.document.nodes().find(is_it);
        let node = node.unwrap_or_else(|| panic!("no camera is called {name}"));
        node.transform().decomposed().0.into()
    }
}

fn committed(file_name: &str) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes");
    let path = folder.join(file_name);
    fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Reads a bundled file through the gltf crate, which validates it. All nodes stand at the top of these scenes.
fn load(file_name: &str) -> Loaded {
    let bytes = committed(file_name);
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(&bytes).unwrap();
    let blob = blob.unwrap();
    let mut parts = Vec::new();
    for node in document.nodes() {
        let placed = Mat4::from_cols_array_2d(&node.transform().matrix());
        for primitive in node.mesh().iter().flat_map(gltf::Mesh::primitives) {
            let reader = primitive.reader(|_| Some(blob.as_slice()));
            let positions = reader.read_positions().unwrap();
            let positions: Vec<Vec3> = positions
                .map(|position| placed.transform_point3(position.into()))
                .collect();
            let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
            let corners = |t: &[u32]| [0, 1, 2].map(|i| positions[t[i] as usize]);
            parts.push(Part {
                node: node.name().unwrap().to_owned(),
                material: primitive.material().name().unwrap().to_owned(),
                is_emissive: primitive.material().emissive_factor() != [0.0; 3],
                triangles: indices.chunks(3).map(corners).collect(),
            });
        }
    }
    Loaded {
        document,
        blob,
        parts,
        byte_count: bytes.len(),
    }
}

/// What tells two files apart, if anything does.
fn difference(committed: &[u8], made: &[u8]) -> Option<String> {
    if committed == made {
        return None;
    }
    let is_same = |(a, b): &(&u8, &u8)| a == b;
    let at = committed.iter().zip(made).take_while(is_same).count();
    let sizes = (committed.len(), made.len());
    Some(format!("they part at byte {at}; sizes are {sizes:?}"))
}

#[test]
fn the_committed_files_are_to_the_byte_what_the_generator_makes() {
    for (file_name, make) in bundle::SCENES {
        let difference = difference(&committed(file_name), &make());
        let mend = "run `cargo run --example make_scenes` and look at the change";
        assert_eq!(difference, None, "{file_name}: {mend}");
    }
    let (file_name, make) = bundle::SCENES[0];
    let mut changed = committed(file_name);
    *changed.last_mut().unwrap() ^= 1;
    let seen = difference(&changed, &make());
    assert!(seen.is_some(), "a changed bit must be seen");
}

/// The volume, m³, that triangles enclose, or `None` unless every edge is passed as often one way as the other.
fn enclosed_volume_m3(triangles: &[[Vec3; 3]]) -> Option<f64> {
    let mut passes: HashMap<[[u32; 3]; 2], i32> = HashMap::new();
    let mut six_volumes = 0.0;
    // Adding zero makes one zero of the two.
    let bits = |point: &Vec3| (*point + Vec3::ZERO).to_array().map(f32::to_bits);
    for [a, b, c] in triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let (from, to) = (bits(from), bits(to));
            let way = if from < to { 1 } else { -1 };
            *passes.entry([from.min(to), from.max(to)]).or_default() += way;
        }
        six_volumes += a.as_dvec3().dot(b.as_dvec3().cross(c.as_dvec3()));
    }
    let is_closed = passes.values().all(|balance| *balance == 0);
    is_closed.then_some(six_volumes / 6.0)
}

#[test]
fn glass_is_closed_and_wound_outward() {
    for (file_name, solids) in [("cornell.glb", 1), ("room.glb", 1), ("gallery.glb", 2)] {
        let scene = load(file_name);
        let is_glass = |part: &&Part| part.material == "glass";
        let glass: Vec<&Part> = scene.parts.iter().filter(is_glass).collect();
        assert_eq!(glass.len(), solids, "{file_name}");
        for Part {
            node, triangles, ..
        } in glass
        {
            let volume_m3 = enclosed_volume_m3(triangles);
            let is_outward = volume_m3.is_some_and(|v| v > 1e-5);
            assert!(is_outward, "{file_name}, {node}: {volume_m3:?}");
            let hole = enclosed_volume_m3(&triangles[1..]);
            assert_eq!(hole, None, "a hole must be seen");
            let mut turned = triangles.clone();
            turned[0].swap(1, 2);
            let turned = enclosed_volume_m3(&turned);
            assert_eq!(turned, None, "a face the wrong way round must be seen");
        }
    }
}

#[test]
fn the_furnace_is_closed_and_wholly_of_one_glowing_stuff() {
    let furnace = load("furnace.glb");
    assert_eq!(furnace.document.materials().count(), 1);
    let material = furnace.document.materials().next().unwrap();
    let pbr = material.pbr_metallic_roughness();
    assert_eq!(pbr.base_color_factor(), [0.5, 0.5, 0.5, 1.0]);
    assert_eq!(pbr.metallic_factor(), 0.0);
    assert_eq!(material.specular().unwrap().specular_factor(), 0.0);
    assert_eq!(material.emissive_factor(), [1.0; 3]);
    assert_eq!(material.emissive_strength(), None);
    // The shell, a little less than the unit ball, faces in; the cube of 0.4 m in it faces out.
    let volume_m3 = enclosed_volume_m3(&furnace.parts[0].triangles).unwrap() - 0.4f64.powi(3);
    assert!((-4.189..-4.1).contains(&volume_m3), "{volume_m3}");
}

/// How far from `origin` a ray first meets a triangle (Möller and Trumbore's test, both faces).
fn first_hit_m(origin: Vec3, dir: Vec3, parts: &[&Part]) -> Option<f32> {
    const SLACK: f32 = 1e-5;
    let triangles = parts.iter().flat_map(|part| &part.triangles);
    let hits = triangles.filter_map(|[a, b, c]| {
        let (ab, ac, from_a) = (*b - *a, *c - *a, origin - *a);
        let (p, q) = (dir.cross(ac), from_a.cross(ab));
        let determinant = ab.dot(p);
        let (u, v) = (from_a.dot(p) / determinant, dir.dot(q) / determinant);
        let distance_m = ac.dot(q) / determinant;
        let is_inside = u >= -SLACK && v >= -SLACK && u + v <= 1.0 + SLACK;
        (is_inside && distance_m > 0.0).then_some(distance_m)
    });
    hits.reduce(f32::min)
}

/// Directions spread evenly over the sphere.
fn directions(count: u32) -> impl Iterator<Item = Vec3> {
    (0..count).map(move |index| {
        let y = 1.0 - (2.0 * index as f32 + 1.0) / count as f32;
        let azimuth_rad = index as f32 * 2.399_963;
        let radius = (1.0 - y * y).sqrt();
        Vec3::new(radius * azimuth_rad.cos(), y, radius * azimuth_rad.sin())
    })
}

#[test]
fn every_viewer_is_walled_in_all_round_with_room_to_move() {
    const VIEWERS: [(&str, &str, &str); 5] = [
        ("cornell.glb", "viewer", "floor, ceiling and ends"),
        ("furnace.glb", "viewer", "furnace"),
        ("room.glb", "viewer", "walls"),
        ("gallery.glb", "hall", "hall floor"),
        ("gallery.glb", "side-room", "side-room walls"),
    ];
    for (file_name, camera, wall) in VIEWERS {
        let scene = load(file_name);
        let eye = scene.camera_position(camera);
        let escapes = |parts: &[&Part]| {
            directions(150)
                .filter(|dir| first_hit_m(eye, *dir, parts).is_none())
                .count()
        };
        let all: Vec<&Part> = scene.parts.iter().collect();
        assert_eq!(escapes(&all), 0, "{file_name} from {camera}");
        let breached: Vec<&Part> = all.iter().copied().filter(|p| p.node != wall).collect();
        let seen = escapes(&breached) > 0;
        assert!(seen, "{file_name}: a missing {wall} must be seen");
        let corners = scene.parts.iter().flat_map(|p| p.triangles.as_flattened());
        let nearest_m = corners
            .map(|corner| corner.distance(eye))
            .fold(f32::MAX, f32::min);
        assert!(nearest_m > 0.3, "{file_name}: {nearest_m} m from {camera}");
    }
}

#[test]
fn the_gallery_s_rooms_are_seen_through_its_doorways() {
    let gallery = load("gallery.glb");
    let all: Vec<&Part> = gallery.parts.iter().collect();
    // From the hall, 0.5 m before each doorway, straight through to the far wall; and beside it, into the hall's own wall.
    for (before, aside, dir, far_m) in [
        (Vec3::new(4.5, 2.3, 0.4), Vec3::Z, Vec3::X, 5.9),
        (Vec3::new(2.9, 2.3, -3.0), Vec3::X, Vec3::NEG_Z, 5.4),
    ] {
        let through_m = first_hit_m(before, dir, &all).unwrap();
        assert!(
            (through_m - far_m).abs() < 0.1,
            "{through_m} m, not {far_m}"
        );
        let beside_m = first_hit_m(before + aside, dir, &all).unwrap();
        assert!(beside_m < 0.51, "a wall must be seen: {beside_m} m");
    }
}

#[test]
fn the_sliding_block_moves_and_comes_home() {
    let cornell = load("cornell.glb");
    let animation = cornell.document.animations().next().unwrap();
    assert_eq!(animation.channels().count(), 2);
    for channel in animation.channels() {
        assert_eq!(channel.target().node().name(), Some("sliding block"));
        let reader = channel.reader(|_| Some(cornell.blob.as_slice()));
        let times_s: Vec<f32> = reader.read_inputs().unwrap().collect();
        assert_eq!((times_s[0], times_s[times_s.len() - 1]), (0.0, 10.0));
        let keys: Vec<Vec<f32>> = match reader.read_outputs().unwrap() {
            // In-tangent, value, out-tangent.
            ReadOutputs::Translations(keys) => {
                keys.skip(1).step_by(3).map(|key| key.to_vec()).collect()
            }
            ReadOutputs::Rotations(keys) => keys.into_f32().map(|key| key.to_vec()).collect(),
            _ => panic!("only translation and rotation are animated"),
        };
        let apart = |a: &[f32], b: &[f32]| {
            let differences = a.iter().zip(b).map(|(a, b)| (a - b).abs());
            differences.fold(0.0, f32::max)
        };
        assert!(apart(&keys[0], &keys[keys.len() - 1]) < 1e-6);
        assert!(apart(&keys[0], &keys[keys.len() / 2]) > 0.3);
    }
}

#[test]
fn the_room_has_about_a_hundred_thousand_triangles() {
    let room = load("room.glb");
    let count = room.triangle_count();
    assert!((95_000..=110_000).contains(&count), "{count}");
    assert!(room.byte_count < 8_000_000);
    assert!(room.document.textures().count() >= 5);
}

#[test]
fn the_gallery_has_more_than_forty_lights_of_three_kinds() {
    let gallery = load("gallery.glb");
    let lights = || gallery.document.lights().unwrap().map(|light| light.kind());
    let spots = lights().filter(|kind| matches!(kind, Kind::Spot { .. }));
    let points = lights().filter(|kind| matches!(kind, Kind::Point));
    let panels = gallery.parts.iter().filter(|part| part.is_emissive);
    assert_eq!((spots.count(), points.count(), panels.count()), (33, 9, 12));
    assert!(gallery.byte_count < 8_000_000);
}
