//! Files that are damaged, absurd or malicious: each gets an error that names what is wrong, in bounded time, and never a panic.

#[path = "../common/glb.rs"]
mod glb;
mod properties;
#[path = "../common/shared.rs"]
mod shared;
#[allow(dead_code, reason = "other tests use the rest of it")]
#[path = "../common/untrusted.rs"]
mod untrusted;

use std::path::Path;
use std::time::{Duration, Instant};

use glb::{Glb, Saved, TRIANGLE};
use macula::scene::{LoadLimits, Scene};
use serde_json::json;

/// The whole chain of messages of a refusal.
fn refusal(path: &Path, limits: &LoadLimits) -> String {
    let error = Scene::load_with(path, limits).expect_err("the file must be refused");
    let mut message = error.to_string();
    let mut cause = std::error::Error::source(&error);
    while let Some(deeper) = cause {
        message += &format!(": {deeper}");
        cause = deeper.source();
    }
    message
}

#[track_caller]
fn assert_refused(glb: &Glb, parts: &[&str]) {
    let saved = glb.save();
    let message = refusal(&saved.path, &LoadLimits::default());
    assert!(message.contains("scene.glb"), "{message}");
    for part in parts {
        assert!(message.contains(part), "{part:?} is not in: {message}");
    }
}

fn one_triangle() -> Glb {
    let mut glb = Glb::new();
    let mesh = glb.triangle();
    glb.root(json!({"mesh": mesh, "name": "thing"}));
    glb
}

#[test]
fn a_file_cut_anywhere_is_refused() {
    let bytes = one_triangle().bytes();
    assert!(
        Scene::load(&one_triangle().save().path).is_ok(),
        "whole, it loads"
    );
    for length in 0..bytes.len() {
        let saved = Saved::new("cut.glb", &bytes[..length]);
        let message = refusal(&saved.path, &LoadLimits::default());
        assert!(message.contains("cut.glb"), "{message}");
    }
}

#[test]
fn a_container_that_lies_about_its_lengths_is_refused() {
    let whole = one_triangle().bytes();
    for at in [8, 12] {
        for length in [0, 1, 11, u32::MAX, u32::MAX - 11] {
            let mut bytes = whole.clone();
            bytes[at..at + 4].copy_from_slice(&length.to_le_bytes());
            let saved = Saved::new("lie.glb", &bytes);
            refusal(&saved.path, &LoadLimits::default());
        }
    }
    let mut bytes = whole.clone();
    bytes[4] = 1;
    let message = refusal(&Saved::new("old.glb", &bytes).path, &LoadLimits::default());
    assert!(message.contains("version 1"), "{message}");
}

#[test]
fn what_is_no_gltf_at_all_is_refused() {
    for bytes in [
        &b""[..],
        b"hello",
        b"[]",
        b"{}",
        b"\xff\xfe\x00",
        b"{\"asset\":{\"version\":\"2.0\"}",
    ] {
        refusal(&Saved::new("odd.gltf", bytes).path, &LoadLimits::default());
    }
    let saved = Saved::new("one.gltf", b"{\"asset\":{\"version\":\"1.0\"}}");
    assert!(refusal(&saved.path, &LoadLimits::default()).contains("glTF 1.0"));
    let folder = tempfile::tempdir().unwrap();
    assert!(refusal(folder.path(), &LoadLimits::default()).contains("it is a folder"));
}

#[test]
fn deeply_nested_json_is_refused_without_exhausting_the_stack() {
    let deep = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"x\":{}",
        "[".repeat(500_000)
    );
    refusal(
        &Saved::new("deep.gltf", deep.as_bytes()).path,
        &LoadLimits::default(),
    );
}

#[test]
fn a_required_extension_is_refused_by_name() {
    let mut glb = one_triangle();
    glb.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    assert_refused(&glb, &["requires", "KHR_draco_mesh_compression"]);
}

#[test]
fn cycles_and_second_parents_are_refused() {
    let mut cyclic = one_triangle();
    cyclic.json["nodes"][0]["children"] = json!([0]);
    assert_refused(&cyclic, &["node `thing`", "two ways"]);

    let mut ring = Glb::new();
    let (a, b) = (
        ring.root(json!({})),
        ring.push("nodes", json!({"name": "b"})),
    );
    ring.json["nodes"][a]["children"] = json!([b]);
    ring.json["nodes"][b]["children"] = json!([a]);
    assert_refused(&ring, &["node 0", "two ways"]);

    let mut shared = Glb::new();
    let child = shared.push("nodes", json!({"name": "child"}));
    shared.root(json!({"children": [child]}));
    shared.root(json!({"children": [child]}));
    assert_refused(&shared, &["node `child`", "two parents"]);

    let mut twice = one_triangle();
    twice.json["scenes"][0]["nodes"] = json!([0, 0]);
    assert_refused(&twice, &["node `thing`"]);
}

#[test]
fn a_chain_of_a_hundred_thousand_nodes_loads() {
    let mut glb = Glb::new();
    let mesh = glb.triangle();
    let count = 100_000;
    let mut nodes: Vec<_> = (1..count).map(|next| json!({"children": [next]})).collect();
    nodes.push(json!({"mesh": mesh}));
    glb.json["nodes"] = json!(nodes);
    glb.json["scenes"][0]["nodes"] = json!([0]);
    let scene = Scene::load(&glb.save().path).unwrap();
    assert_eq!(scene.static_mesh.triangles.len(), 1);
}

#[test]
fn vertices_that_are_not_finite_are_refused_with_mesh_and_accessor() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut glb = Glb::new();
        glb.mesh(
            "broken",
            &[TRIANGLE[0], [1.0, bad, 0.0], TRIANGLE[2]],
            &[0, 1, 2],
        );
        glb.root(json!({"mesh": 0}));
        assert_refused(
            &glb,
            &[
                "mesh `broken` primitive 0 POSITION",
                "accessor 0",
                "element 1",
            ],
        );
    }
}

#[test]
fn transforms_that_overflow_are_refused_by_node() {
    let mut glb = one_triangle();
    glb.json["nodes"][0]["translation"] = json!([1e12, 0.0, 0.0]);
    assert!(
        Scene::load(&glb.save().path).is_ok(),
        "far away is fine: the scene is centred"
    );
    glb.root(json!({"mesh": 0, "name": "origin"}));
    assert_refused(&glb, &["node `thing`", "from the scene's centre"]);

    let mut glb = Glb::new();
    glb.triangle();
    let huge = json!([1e38, 1e38, 1e38]);
    let deep = glb.push("nodes", json!({"mesh": 0, "name": "deep", "scale": huge}));
    // Each is a number; the product of nine is none, even in double precision.
    let top = (0..8).fold(deep, |child, _| {
        glb.push("nodes", json!({"children": [child], "scale": huge}))
    });
    glb.root(json!({"children": [top]}));
    assert_refused(&glb, &["node `deep`", "overflows"]);

    // What no single precision number holds is refused where it stands.
    glb.json["nodes"][deep]["scale"] = json!([1e200, 1.0, 1.0]);
    assert_refused(&glb, &["number out of range at line"]);
}

#[test]
fn a_zero_rotation_is_read_as_none_with_a_warning() {
    let mut glb = one_triangle();
    glb.json["nodes"][0]["rotation"] = json!([0.0, 0.0, 0.0, 0.0]);
    let scene = Scene::load(&glb.save().path).unwrap();
    assert!(
        scene.warnings[0].contains("node `thing`"),
        "{:?}",
        scene.warnings
    );
    glb.json["nodes"][0]["rotation"] = json!([0.0, 0.0, 0.0, 1e-300]);
    let scene = Scene::load(&glb.save().path).unwrap();
    assert!(scene.warnings.is_empty() && scene.static_mesh.positions.len() == 3);
}

#[test]
fn indices_out_of_range_are_refused() {
    let mut glb = Glb::new();
    glb.mesh("mesh", &TRIANGLE, &[0, 1, 3]);
    glb.root(json!({"mesh": 0}));
    assert_refused(&glb, &["mesh `mesh` primitive 0", "index 3", "3 vertices"]);

    for (pointer, value) in [
        ("/meshes/0/primitives/0/attributes/POSITION", json!(99)),
        ("/meshes/0/primitives/0/indices", json!(99)),
        ("/meshes/0/primitives/0/material", json!(99)),
        ("/nodes/0/mesh", json!(99)),
        ("/accessors/0/bufferView", json!(99)),
        ("/bufferViews/0/buffer", json!(99)),
        ("/scenes/0/nodes/0", json!(99)),
        ("/scene", json!(99)),
    ] {
        let mut glb = one_triangle();
        glb.json["meshes"][0]["primitives"][0]["material"] = json!(0);
        glb.push("materials", json!({}));
        assert!(Scene::load(&glb.save().path).is_ok());
        *glb.json.pointer_mut(pointer).unwrap() = value;
        assert_refused(&glb, &[]);
    }
    let mut glb = one_triangle();
    glb.animate(0, "translation", "LINEAR", &[0.0], &[[0.0; 3]]);
    glb.json["animations"][0]["channels"][0]["target"]["node"] = json!(99);
    assert_refused(&glb, &["animation 0"]);
}

#[test]
fn accessors_that_reach_beyond_their_buffer_are_refused() {
    let huge = json!(u64::MAX);
    for (pointer, value) in [
        ("/accessors/0/count", json!(4)),
        ("/accessors/0/byteOffset", json!(4)),
        ("/accessors/0/byteOffset", huge.clone()),
        ("/bufferViews/0/byteOffset", json!(1_000_000)),
        ("/bufferViews/0/byteOffset", huge.clone()),
        ("/bufferViews/0/byteLength", huge),
        ("/bufferViews/0/byteStride", json!(252)),
        ("/accessors/0/componentType", json!(5125)),
        ("/accessors/0/type", json!("VEC4")),
        ("/accessors/1/componentType", json!(5126)),
    ] {
        let mut glb = one_triangle();
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        glb.json.pointer_mut(parent).unwrap()[key] = value.clone();
        let loaded = Scene::load(&glb.save().path);
        // A float position read as u32 is a legal number; all else cannot be read.
        let is_harmless = value == json!(5125);
        assert_eq!(
            loaded.is_ok(),
            is_harmless,
            "{pointer} = {value}: {loaded:?}"
        );
    }
    let mut glb = one_triangle();
    glb.json["buffers"][0]["byteLength"] = json!(1_000_000);
    assert_refused(&glb, &["buffer 0", "cut short"]);
}

#[test]
fn sparse_accessors_are_read_and_their_lies_refused() {
    let mut glb = one_triangle();
    let indices = glb.buffer_view(&[2, 0, 0, 0]);
    let values = glb.floats(&[[0.0, 9.0, 0.0]]);
    glb.json["accessors"][0]["sparse"] = json!({
        "count": 1,
        "indices": {"bufferView": indices, "componentType": 5121},
        "values": {"bufferView": glb.json["accessors"][values]["bufferView"]},
    });
    let scene = Scene::load(&glb.save().path).unwrap();
    assert_eq!(scene.bounds.max.y - scene.bounds.min.y, 9.0);
    let sparse = "/accessors/0/sparse";
    for (key, value) in [("count", json!(5)), ("count", json!(u64::MAX))] {
        let mut glb = Glb {
            json: glb.json.clone(),
            binary: glb.binary.clone(),
        };
        glb.json.pointer_mut(sparse).unwrap()[key] = value;
        assert_refused(&glb, &["sparse"]);
    }
    glb.json["bufferViews"][indices]["byteOffset"] = json!(0);
    glb.binary[0] = 200;
    assert_refused(&glb, &["mesh `triangle` primitive 0", "sparse"]);
}

#[test]
fn what_exceeds_a_limit_is_refused_with_the_limit_that_raises_it() {
    let mut glb = one_triangle();
    glb.animate(0, "translation", "LINEAR", &[0.0, 1.0], &[[0.0; 3]; 2]);
    let saved = glb.save();
    let fits = LoadLimits {
        file_bytes: 100_000,
        json_items: 1000,
        nodes: 1,
        vertices: 3,
        triangles: 1,
        texture_pixels: 0,
        animation_keys: 4,
    };
    Scene::load_with(&saved.path, &fits).expect("exactly at the limits");
    let too_small = [
        (
            LoadLimits {
                file_bytes: 100,
                ..fits
            },
            "file_bytes",
        ),
        (
            LoadLimits {
                json_items: 10,
                ..fits
            },
            "json_items",
        ),
        (LoadLimits { nodes: 0, ..fits }, "nodes"),
        (
            LoadLimits {
                vertices: 2,
                ..fits
            },
            "vertices",
        ),
        (
            LoadLimits {
                triangles: 0,
                ..fits
            },
            "triangles",
        ),
        (
            LoadLimits {
                animation_keys: 3,
                ..fits
            },
            "animation_keys",
        ),
    ];
    for (limits, name) in too_small {
        let message = refusal(&saved.path, &limits);
        assert!(
            message.contains(&format!("LoadLimits::{name}")),
            "{message}"
        );
    }
}

#[test]
fn a_small_file_that_claims_a_large_scene_is_refused_at_once() {
    let mut sparse = one_triangle();
    sparse.json["accessors"][0]["count"] = json!(1_u64 << 60);
    let position = sparse.json["accessors"][0].as_object_mut().unwrap();
    position.remove("bufferView");
    position.insert("sparse".to_owned(), json!({
        "count": 0, "indices": {"bufferView": 0, "componentType": 5121}, "values": {"bufferView": 0},
    }));
    let start = Instant::now();
    assert_refused(&sparse, &["LoadLimits::vertices"]);

    // Ten thousand instances of a fan of ten thousand triangles.
    let mut instances = Glb::new();
    let fan: Vec<u32> = (0..10_000).map(|i| i % 3).collect();
    let mesh = instances.mesh("fan", &TRIANGLE, &fan);
    instances.json["meshes"][mesh]["primitives"][0]["mode"] = json!(6);
    for _ in 0..10_000 {
        instances.push("nodes", json!({"mesh": mesh}));
    }
    instances.json["scenes"][0]["nodes"] = json!((0..10_000).collect::<Vec<_>>());
    assert_refused(
        &instances,
        &["triangles: 99980000", "LoadLimits::triangles"],
    );
    assert!(start.elapsed() < Duration::from_secs(5));
}

#[test]
fn json_that_would_unfold_into_gigabytes_is_refused_before_it_is_parsed() {
    let nodes = "{},".repeat(3_000_000);
    let json = format!("{{\"asset\":{{\"version\":\"2.0\"}},\"nodes\":[{nodes}{{}}]}}");
    let saved = Saved::new("bomb.gltf", json.as_bytes());
    let message = refusal(&saved.path, &LoadLimits::default());
    assert!(message.contains("LoadLimits::json_items"), "{message}");
}

#[test]
fn files_outside_the_scene_folder_are_refused() {
    for uri in [
        "../secret.bin",
        "a/../../secret.bin",
        "%2e%2e/secret.bin",
        "/etc/passwd",
        "\\\\server\\share",
        "C:/secret.bin",
        "http://example.org/a.bin",
        "file:///etc/passwd",
        "",
        "%zz",
    ] {
        let mut glb = one_triangle();
        glb.json["buffers"][0]["uri"] = json!(uri);
        let message = refusal(&glb.save().path, &LoadLimits::default());
        assert!(message.contains("buffer 0 names"), "{uri}: {message}");
    }
    let mut glb = one_triangle();
    glb.json["buffers"][0]["uri"] = json!("missing.bin");
    assert_refused(&glb, &["missing.bin"]);
    glb.json["buffers"][0]["uri"] = json!("data:application/octet-stream;base64,!!!!");
    assert_refused(&glb, &["buffer 0", "data: URI"]);
}

fn with_image(bytes: &[u8]) -> Glb {
    let mut glb = one_triangle();
    let view = glb.buffer_view(bytes);
    glb.push(
        "images",
        json!({"bufferView": view, "mimeType": "image/png", "name": "wood"}),
    );
    glb.push("textures", json!({"source": 0}));
    glb.push(
        "materials",
        json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}),
    );
    glb
}

fn png(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let image = image::GrayImage::new(width, height);
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

#[test]
fn damaged_and_oversized_images_are_refused_by_name() {
    let whole = png(64, 64);
    Scene::load(&with_image(&whole).save().path).unwrap();
    assert_refused(&with_image(&whole[..whole.len() / 2]), &["image `wood`"]);
    assert_refused(
        &with_image(b"GIF89a\x01\0\x01\0\0\0\0;"),
        &["image `wood`", "PNG and JPEG"],
    );
    assert_refused(&with_image(b"nothing"), &["image `wood`"]);

    let mut claims = whole;
    // Width and height of the IHDR chunk: 2^20 each, in a file of a few hundred bytes.
    claims[16..24].copy_from_slice(&[0, 16, 0, 0, 0, 16, 0, 0]);
    let message = refusal(&with_image(&claims).save().path, &LoadLimits::default());
    assert!(message.contains("wood"), "{message}");

    let limits = LoadLimits {
        texture_pixels: 64 * 64 - 1,
        ..LoadLimits::default()
    };
    let message = refusal(&with_image(&png(64, 64)).save().path, &limits);
    assert!(message.contains("LoadLimits::texture_pixels"), "{message}");
}

#[test]
fn animation_keys_that_make_no_motion_are_refused() {
    let animated = |times: &[f32], values: &[[f32; 3]]| {
        let mut glb = one_triangle();
        glb.animate(0, "translation", "LINEAR", times, values);
        glb
    };
    let label = ["animation 0 channel 0"];
    assert!(Scene::load(&animated(&[0.0, 1.0], &[[0.0; 3]; 2]).save().path).is_ok());
    assert_refused(&animated(&[1.0, 0.0], &[[0.0; 3]; 2]), &label);
    assert_refused(&animated(&[0.0, 1.0], &[[0.0; 3]]), &label);
    assert_refused(&animated(&[0.0, f32::NAN], &[[0.0; 3]; 2]), &label);
    assert_refused(&animated(&[0.0, 1.0], &[[0.0; 3], [f32::NAN; 3]]), &label);
}

#[test]
fn keys_that_overflow_make_an_object_vanish_instead_of_spreading_infinities() {
    let mut glb = one_triangle();
    let child = glb.push("nodes", json!({"mesh": 0}));
    glb.json["nodes"][0]["children"] = json!([child]);
    for node in [0, child] {
        glb.animate(
            node,
            "scale",
            "LINEAR",
            &[0.0, 1.0, 2.0],
            &[[1.0; 3], [3e38; 3], [1.0; 3]],
        );
    }
    let scene = Scene::load(&glb.save().path).unwrap();
    for step in 0..200 {
        let pose = scene.pose_at(f64::from(step) * 0.01);
        assert!(
            pose.scene_from_object
                .iter()
                .all(|affine| affine.is_finite())
        );
    }
    assert!(scene.bounds_over_time().diagonal_m().is_finite());
}

#[test]
fn warnings_are_bounded() {
    let mut glb = one_triangle();
    for index in 0..5000 {
        glb.root(json!({"mesh": 0, "name": format!("flat {index}"), "scale": [0.0, 1.0, 1.0]}));
    }
    let scene = Scene::load(&glb.save().path).unwrap();
    assert!(scene.warnings.len() < 100);
    assert!(scene.warnings.last().unwrap().contains("more warnings"));
}
