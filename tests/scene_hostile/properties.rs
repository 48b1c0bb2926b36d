//! Properties: whatever the bytes, the loader gives a scene that can be used, or an error.

use std::time::{Duration, Instant};

use macula::scene::Scene;
use proptest::prelude::*;
use serde_json::json;

use super::glb::{Glb, Saved};
use super::shared::shared;
use super::untrusted::gltf_scene;
use super::{png, with_image};

/// Loads whatever this is, and uses all of it if it loads, in bounded time.
fn survive(bytes: &[u8], name: &str) {
    let start = Instant::now();
    gltf_scene(bytes, name);
    assert!(start.elapsed() < Duration::from_secs(20));
}

/// A file that uses every part of the loader: hierarchy, texture, light, camera, animation.
fn everything() -> Vec<u8> {
    let mut glb = with_image(&png(4, 4));
    let primitive = &mut glb.json["meshes"][0]["primitives"][0];
    primitive["material"] = json!(0);
    let texcoords = glb.floats(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    let normals = glb.floats(&[[0.0, 0.0, 1.0]; 3]);
    let attributes = &mut glb.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["TEXCOORD_0"] = json!(texcoords);
    attributes["NORMAL"] = json!(normals);
    glb.json["extensions"] =
        json!({"KHR_lights_punctual": {"lights": [{"type": "spot", "spot": {}}]}});
    glb.push(
        "cameras",
        json!({"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}),
    );
    let child = glb.push("nodes", json!({
        "mesh": 0, "camera": 0, "scale": [1.0, -2.0, 1.0], "extensions": {"KHR_lights_punctual": {"light": 0}},
    }));
    let parent = glb.root(json!({"children": [child], "rotation": [0.0, 0.6, 0.0, 0.8]}));
    glb.animate(
        parent,
        "translation",
        "CUBICSPLINE",
        &[0.0, 1.0],
        &[[0.5; 3]; 6],
    );
    glb.bytes()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn no_changed_bytes_make_the_loader_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12),
    ) {
        let mut bytes = everything();
        for (at, value) in changes {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        survive(&bytes, "changed.glb");
    }

    #[test]
    fn no_changed_number_makes_the_loader_panic(
        at in any::<prop::sample::Index>(),
        value in prop_oneof![
            Just("0"), Just("-1"), Just("1"), Just("255"), Just("4294967295"), Just("18446744073709551615"), Just("1e39"),
            Just("-1e300"), Just("1e-300"), Just("0.5"), Just("null"), Just("{}"), Just("[]"), Just("\"\""),
        ],
    ) {
        let bytes = everything();
        let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        let json = std::str::from_utf8(&bytes[20..20 + length]).unwrap();
        // The numbers of the JSON, where a digit follows a separator.
        let starts: Vec<usize> = json
            .as_bytes()
            .windows(2)
            .enumerate()
            .filter(|(_, w)| b":[,".contains(&w[0]) && w[1].is_ascii_digit())
            .map(|(i, _)| i + 1)
            .collect();
        let start = starts[at.index(starts.len())];
        let end = start + json[start..].find([',', '}', ']']).unwrap();
        let changed = format!("{}{value}{}", &json[..start], &json[end..]);
        let mut glb = Glb::new();
        glb.binary = bytes[28 + length..].to_vec();
        let mut out = b"glTF\x02\0\0\0".to_vec();
        let padded = changed.len().next_multiple_of(4);
        out.extend(((28 + padded + glb.binary.len()) as u32).to_le_bytes());
        out.extend((padded as u32).to_le_bytes());
        out.extend(b"JSON");
        out.extend(format!("{changed:padded$}").bytes());
        out.extend((glb.binary.len() as u32).to_le_bytes());
        out.extend(b"BIN\0");
        out.extend(&glb.binary);
        survive(&out, "number.glb");
    }

    #[test]
    fn no_garbage_makes_the_loader_panic(bytes in prop::collection::vec(any::<u8>(), 0..256)) {
        survive(&bytes, "garbage.glb");
    }
}

#[test]
fn the_file_that_the_properties_change_loads_whole() {
    let saved = Saved::new("whole.glb", &everything());
    let scene = Scene::load(&saved.path).unwrap();
    assert_eq!(
        (scene.objects.len(), scene.static_mesh.triangles.len()),
        (1, 1)
    );
    assert_eq!(
        (
            scene.textures.len(),
            scene.lights.len(),
            scene.cameras.len()
        ),
        (1, 1, 1)
    );
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
}

#[test]
fn shared_scenes_with_changed_bytes_do_not_make_the_loader_panic() {
    for file in [
        "scenes/glb/a-cornell-diffuse.glb",
        "scenes/glb/h-nodes.glb",
        "scenes/glb/j-spot.glb",
    ] {
        let Some(path) = shared(file) else {
            continue;
        };
        let whole = std::fs::read(path).unwrap();
        let mut state = 1_u64;
        let mut random = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 33) as usize
        };
        for _ in 0..200 {
            let mut bytes = whole.clone();
            for _ in 0..1 + random() % 8 {
                let at = random() % bytes.len();
                bytes[at] = random() as u8;
            }
            survive(&bytes, "shared.glb");
        }
    }
}
