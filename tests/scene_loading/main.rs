//! What a scene file becomes: geometry and transforms here, materials and motion in their own files.

#[path = "../common/glb.rs"]
mod glb;
mod inspection;
mod materials;
mod motion;
#[path = "../common/shared.rs"]
mod shared;

use std::f32::consts::FRAC_1_SQRT_2;

use glam::Vec3;
use glb::{Glb, TRIANGLE};
use macula::scene::{Aabb, Mesh, Scene, SceneProblem};
use serde_json::{Value, json};
use shared::shared;

fn load(glb: &Glb) -> Scene {
    Scene::load(&glb.save().path).unwrap()
}

/// The scene with one triangle on a node.
fn triangle_on(node: Value) -> Glb {
    let mut glb = Glb::new();
    glb.triangle();
    glb.root(node);
    glb
}

fn assert_near(a: Vec3, b: Vec3) {
    assert!(
        (a - b).length() < 1e-5 * (1.0 + b.length()),
        "{a} is not {b}"
    );
}

/// Position of a triangle's corner in the file's own world space.
fn in_file(scene: &Scene, mesh: &Mesh, triangle: usize) -> [Vec3; 3] {
    mesh.corners(triangle)
        .map(|corner| corner + scene.file_from_scene_m.as_vec3())
}

fn front_normal(mesh: &Mesh, triangle: usize) -> Vec3 {
    let [a, b, c] = mesh.corners(triangle);
    (b - a).cross(c - a).normalize()
}

#[test]
fn shared_scenes_hold_what_their_tables_say() {
    // Name, triangles, materials in the file, kinds of punctual lights, textures, vertical field of view in degrees.
    type Row = (
        &'static str,
        usize,
        usize,
        &'static [&'static str],
        usize,
        f32,
    );
    let rows: [Row; 10] = [
        ("scenes/glb/a-cornell-diffuse.glb", 46, 4, &[], 0, 37.0),
        ("scenes/glb/b-cornell-caustic.glb", 163_866, 6, &[], 0, 37.0),
        ("scenes/glb/g-thin-wall.glb", 66, 4, &[], 0, 65.0),
        ("scenes/glb/j-area.glb", 4, 2, &[], 0, 45.0),
        ("scenes/glb/j-point.glb", 2, 1, &["point"], 0, 45.0),
        ("scenes/glb/j-spot.glb", 2, 1, &["spot"], 0, 45.0),
        (
            "scenes/glb/j-directional.glb",
            2,
            1,
            &["directional"],
            0,
            45.0,
        ),
        ("scenes/public/glb/veach-bidir.glb", 11_548, 7, &[], 0, 35.0),
        (
            "scenes/public/glb/water-caustic.glb",
            103_483,
            4,
            &["spot"],
            0,
            19.5,
        ),
        (
            "scenes/public/glb/living-room.glb",
            787_188,
            15,
            &[],
            2,
            29.395,
        ),
    ];
    for (file, triangles, materials, lights, textures, yfov_deg) in rows {
        let Some(path) = shared(file) else {
            continue;
        };
        let scene = Scene::load(&path).unwrap();
        let kinds: Vec<_> = scene.lights.iter().map(|light| light.kind.name()).collect();
        assert_eq!(scene.static_mesh.triangles.len(), triangles, "{file}");
        assert_eq!(
            scene.materials.len(),
            materials + 1,
            "{file}: with the default one"
        );
        assert_eq!(kinds, lights, "{file}");
        assert_eq!(scene.textures.len(), textures, "{file}");
        assert_eq!(scene.cameras.len(), 1, "{file}");
        assert!(
            (scene.cameras[0].yfov_rad.to_degrees() - yfov_deg).abs() < 0.01,
            "{file}"
        );
        assert_eq!(scene.warnings, [""; 0], "{file}");
        assert_eq!(scene.content_sha256.len(), 64);
    }
}

#[test]
fn the_living_room_camera_stands_where_its_table_says() {
    let Some(path) = shared("scenes/public/glb/living-room.glb") else {
        return;
    };
    let scene = Scene::load(&path).unwrap();
    let camera = &scene.cameras[0];
    let position = camera.pose.position_m + scene.file_from_scene_m.as_vec3();
    assert!((position - Vec3::new(0.27697, 1.01795, -5.19292)).length() < 1e-4);
    let forward = camera.pose.orientation * Vec3::NEG_Z;
    assert!((forward - Vec3::new(-0.43771, -0.0287, 0.89866)).length() < 1e-4);
    let up = camera.pose.orientation * Vec3::Y;
    assert!((up - Vec3::new(-0.01257, 0.99959, 0.0258)).length() < 1e-4);
}

/// All vertices as the scene's camera sees them, in units of the distance to the first: the same for similar scenes.
fn seen_by_camera(file: &str) -> Option<Vec<Vec3>> {
    let scene = Scene::load(&shared(file)?).unwrap();
    let camera_from_scene = scene.cameras[0].pose.inverse().to_affine();
    let positions = scene.static_mesh.positions.iter();
    let seen: Vec<Vec3> = positions
        .map(|p| camera_from_scene.transform_point3(*p))
        .collect();
    Some(seen.iter().map(|p| *p / seen[0].length()).collect())
}

#[test]
fn a_scene_far_away_scaled_or_under_a_turned_node_looks_the_same() {
    let Some(reference) = seen_by_camera("scenes/glb/a-cornell-diffuse.glb") else {
        return;
    };
    // The baked one is rounded to f32 at 10 km within the file itself: half a millimetre.
    for (name, tolerance) in [
        ("h-far-node", 2e-6),
        ("h-far-baked", 5e-4),
        ("h-small", 2e-6),
        ("h-large", 2e-6),
        ("h-nodes", 2e-6),
    ] {
        let Some(seen) = seen_by_camera(&format!("scenes/glb/{name}.glb")) else {
            return;
        };
        assert_eq!(seen.len(), reference.len());
        for (a, b) in seen.iter().zip(&reference) {
            assert!((*a - *b).length() < tolerance, "{name}: {a} is not {b}");
        }
    }
    let other = seen_by_camera("scenes/glb/g-thin-wall.glb").unwrap();
    let differs = |(a, b): (&Vec3, &Vec3)| (*a - *b).length() > 1e-2;
    assert!(
        other.iter().zip(&reference).any(differs),
        "the comparison can fail"
    );
}

#[test]
fn transforms_compose_from_parent_to_child() {
    let mut glb = Glb::new();
    let mesh = glb.triangle();
    let child = glb.push("nodes", json!({"mesh": mesh, "scale": [2.0, 3.0, 1.0]}));
    let quarter_about_z = [0.0, 0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2];
    glb.root(
        json!({"children": [child], "rotation": quarter_about_z, "translation": [10.0, 0.0, 0.0]}),
    );
    let scene = load(&glb);
    let [a, b, c] = in_file(&scene, &scene.static_mesh, 0);
    assert_near(a, Vec3::new(10.0, 0.0, 0.0));
    assert_near(b, Vec3::new(10.0, 2.0, 0.0));
    assert_near(c, Vec3::new(7.0, 0.0, 0.0));
}

#[test]
fn a_node_matrix_is_read_column_by_column() {
    let glb = triangle_on(json!({
        "mesh": 0,
        "matrix": [0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 5.0, 6.0, 7.0, 1.0],
    }));
    let scene = load(&glb);
    let corners = in_file(&scene, &scene.static_mesh, 0);
    assert_near(corners[0], Vec3::new(5.0, 6.0, 7.0));
    assert_near(corners[1], Vec3::new(5.0, 7.0, 7.0));
}

#[test]
fn a_position_ten_kilometres_away_keeps_a_micrometre() {
    let mut glb = Glb::new();
    let mesh = glb.triangle();
    let far = [10_000.0, 10_000.0, 10_000.0];
    glb.root(json!({"mesh": mesh, "translation": far}));
    glb.root(json!({"mesh": mesh, "translation": [10_000.000_25, 10_000.0, 10_000.0]}));
    let scene = load(&glb);
    let [first, second] = [0, 1].map(|triangle| scene.static_mesh.corners(triangle)[0]);
    assert!(
        (second.x - first.x - 0.000_25).abs() < 1e-6,
        "{}",
        second.x - first.x
    );
}

#[test]
fn a_mirrored_node_keeps_its_front() {
    let plain = load(&triangle_on(json!({"mesh": 0})));
    let mirrored = load(&triangle_on(json!({"mesh": 0, "scale": [-1.0, 1.0, 1.0]})));
    assert_near(front_normal(&plain.static_mesh, 0), Vec3::Z);
    assert_near(front_normal(&mirrored.static_mesh, 0), Vec3::Z);
    let inverted = load(&triangle_on(json!({"mesh": 0, "scale": [1.0, 1.0, -1.0]})));
    assert_near(front_normal(&inverted.static_mesh, 0), Vec3::NEG_Z);
}

#[test]
fn normals_follow_the_inverse_transpose_and_missing_ones_mean_flat() {
    let slope = Vec3::new(1.0, 1.0, 0.0).normalize().to_array();
    let mut glb = triangle_on(json!({"mesh": 0, "scale": [1.0, 4.0, 1.0]}));
    let flat = load(&glb);
    assert_eq!(flat.static_mesh.normals, [Vec3::ZERO; 3]);
    let normals = glb.floats(&[slope, slope, slope]);
    glb.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normals);
    let scene = load(&glb);
    // The surface x + y = c becomes x + y/4 = c.
    let expected = Vec3::new(1.0, 0.25, 0.0).normalize();
    assert_near(scene.static_mesh.normals[0], expected);
}

#[test]
fn the_scene_is_centred_on_its_own_bounds() {
    let scene = load(&triangle_on(
        json!({"mesh": 0, "translation": [100.0, 0.0, -7.0]}),
    ));
    assert_eq!(scene.file_from_scene_m.to_array(), [100.5, 0.5, -7.0]);
    let expected = Aabb {
        min: Vec3::new(-0.5, -0.5, 0.0),
        max: Vec3::new(0.5, 0.5, 0.0),
    };
    assert_eq!(scene.bounds, expected);
}

#[test]
fn triangles_without_area_are_dropped_and_counted() {
    let mut glb = Glb::new();
    let positions = [TRIANGLE[0], TRIANGLE[1], TRIANGLE[2], [2.0, 0.0, 0.0]];
    glb.mesh("mesh", &positions, &[0, 1, 2, 0, 1, 3, 1, 1, 2]);
    glb.root(json!({"mesh": 0}));
    let scene = load(&glb);
    assert_eq!(scene.static_mesh.triangles, [[0, 1, 2]]);
    assert_eq!(scene.static_mesh.material_of_triangle.len(), 1);
    assert_eq!(scene.warnings, ["2 triangles without area are dropped"]);
}

#[test]
fn what_is_left_out_is_warned_of() {
    let mut glb = triangle_on(json!({"mesh": 0}));
    glb.json["meshes"][0]["primitives"][0]["targets"] = json!([{}]);
    glb.json["extensionsUsed"] = json!(["EXT_example", "KHR_materials_ior"]);
    let colors = glb.floats(&TRIANGLE);
    glb.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colors);
    glb.json["meshes"][0]["primitives"][0]["attributes"]["_CUSTOM"] = json!(colors);
    let lines = glb.mesh("lines", &TRIANGLE, &[0, 1]);
    glb.json["meshes"][lines]["primitives"][0]["mode"] = json!(1);
    glb.root(json!({"mesh": lines}));
    glb.root(json!({"mesh": 0, "name": "flat", "scale": [1.0, 0.0, 1.0]}));
    glb.push(
        "cameras",
        json!({"type": "orthographic",
        "orthographic": {"xmag": 1.0, "ymag": 1.0, "znear": 0.1, "zfar": 1.0}}),
    );
    glb.root(json!({"camera": 0}));
    glb.push("scenes", json!({"nodes": []}));
    let scene = load(&glb);
    let all = scene.warnings.join("\n");
    for part in [
        "extension EXT_example",
        "morph targets",
        "vertex colours",
        "points or lines",
        "node `flat` is squashed flat",
        "orthographic",
        "1 more scenes",
    ] {
        assert!(all.contains(part), "{part:?} is not in:\n{all}");
    }
    assert!(!all.contains("KHR_materials_ior"));
    assert_eq!(scene.static_mesh.triangles.len(), 1);
}

#[test]
fn a_missing_file_is_named() {
    let error = Scene::load("no/such/scene.glb".as_ref()).unwrap_err();
    assert!(error.to_string().contains("no/such/scene.glb"));
    assert!(matches!(error.problem, SceneProblem::NotAScene(_)));
}
