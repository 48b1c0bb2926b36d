//! What a scene file becomes: geometry, transforms, materials, lights, cameras and motion.

#[path = "common/glb.rs"]
mod glb;

use std::f32::consts::{FRAC_1_SQRT_2, FRAC_PI_2, FRAC_PI_4};

use glam::{Vec2, Vec3};
use glb::{Glb, Saved, TRIANGLE, shared_scene};
use macula::scene::effects::Effects;
use macula::scene::{Aabb, Mesh, PunctualKind, Scene, SceneProblem, Wrap};
use serde_json::{Value, json};

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
        ("glb/a-cornell-diffuse.glb", 46, 4, &[], 0, 37.0),
        ("glb/b-cornell-caustic.glb", 163_866, 6, &[], 0, 37.0),
        ("glb/g-thin-wall.glb", 66, 4, &[], 0, 65.0),
        ("glb/j-area.glb", 4, 2, &[], 0, 45.0),
        ("glb/j-point.glb", 2, 1, &["point"], 0, 45.0),
        ("glb/j-spot.glb", 2, 1, &["spot"], 0, 45.0),
        ("glb/j-directional.glb", 2, 1, &["directional"], 0, 45.0),
        ("public/glb/veach-bidir.glb", 11_548, 7, &[], 0, 35.0),
        (
            "public/glb/water-caustic.glb",
            103_483,
            4,
            &["spot"],
            0,
            19.5,
        ),
        ("public/glb/living-room.glb", 787_188, 15, &[], 2, 29.395),
    ];
    for (file, triangles, materials, lights, textures, yfov_deg) in rows {
        let Some(path) = shared_scene(file) else {
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
    let Some(path) = shared_scene("public/glb/living-room.glb") else {
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
    let scene = Scene::load(&shared_scene(file)?).unwrap();
    let camera_from_scene = scene.cameras[0].pose.inverse().to_affine();
    let positions = scene.static_mesh.positions.iter();
    let seen: Vec<Vec3> = positions
        .map(|p| camera_from_scene.transform_point3(*p))
        .collect();
    Some(seen.iter().map(|p| *p / seen[0].length()).collect())
}

#[test]
fn a_scene_far_away_scaled_or_under_a_turned_node_looks_the_same() {
    let Some(reference) = seen_by_camera("glb/a-cornell-diffuse.glb") else {
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
        let Some(seen) = seen_by_camera(&format!("glb/{name}.glb")) else {
            return;
        };
        assert_eq!(seen.len(), reference.len());
        for (a, b) in seen.iter().zip(&reference) {
            assert!((*a - *b).length() < tolerance, "{name}: {a} is not {b}");
        }
    }
    let other = seen_by_camera("glb/g-thin-wall.glb").unwrap();
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
fn a_material_is_read_with_all_its_extensions() {
    let mut glb = triangle_on(json!({"mesh": 0}));
    glb.json["extensionsRequired"] = json!(["KHR_materials_volume", "KHR_materials_specular"]);
    glb.push("materials", json!({
        "name": "glass", "doubleSided": true, "emissiveFactor": [1.0, 0.5, 0.25],
        "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 1.0], "metallicFactor": 0.25, "roughnessFactor": 0.5},
        "extensions": {
            "KHR_materials_emissive_strength": {"emissiveStrength": 100.0},
            "KHR_materials_ior": {"ior": 1.7},
            "KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [1.0, 2.0, 3.0]},
            "KHR_materials_transmission": {"transmissionFactor": 0.75},
            "KHR_materials_volume": {"thicknessFactor": 0.1, "attenuationDistance": 2.0, "attenuationColor": [0.5, 0.6, 0.7]},
        },
    }));
    glb.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    let scene = load(&glb);
    let material = &scene.materials[0];
    assert_eq!(material.name, "glass");
    assert_eq!(material.base_color, Vec3::new(0.1, 0.2, 0.3));
    assert_eq!((material.metallic, material.roughness), (0.25, 0.5));
    assert_eq!(material.emission_w_per_m2_sr, Vec3::new(100.0, 50.0, 25.0));
    assert_eq!(material.ior, 1.7);
    assert_eq!(material.specular_factor, 0.5);
    assert_eq!(material.specular_color, Vec3::new(1.0, 2.0, 3.0));
    assert_eq!(material.transmission, 0.75);
    assert!(material.is_solid && material.double_sided);
    assert_eq!(material.attenuation_distance_m, 2.0);
    assert_eq!(material.attenuation_color, Vec3::new(0.5, 0.6, 0.7));
    assert_eq!(material.alpha_cutoff, None);

    let default = scene.materials.last().unwrap();
    assert_eq!(
        (default.metallic, default.roughness, default.ior),
        (1.0, 1.0, 1.5)
    );
    assert_eq!((default.specular_factor, default.transmission), (1.0, 0.0));
    assert!(!default.is_solid && default.attenuation_distance_m.is_infinite());
}

#[test]
fn factors_out_of_range_are_clamped_with_a_warning() {
    let mut glb = triangle_on(json!({"mesh": 0}));
    glb.push("materials", json!({
        "name": "odd", "pbrMetallicRoughness": {"roughnessFactor": 7.0, "baseColorFactor": [-1.0, 0.5, 2.0, 1.0]},
        "extensions": {"KHR_materials_ior": {"ior": 0.0}},
    }));
    let scene = load(&glb);
    let material = &scene.materials[0];
    assert_eq!(material.base_color, Vec3::new(0.0, 0.5, 1.0));
    assert_eq!((material.roughness, material.ior), (1.0, 1.5));
    assert_eq!(scene.warnings.len(), 3, "{:?}", scene.warnings);
    assert!(scene.warnings.iter().all(|w| w.contains("`odd`")));
}

#[test]
fn alpha_is_a_mask_with_the_factor_divided_out() {
    let cutoff_of = |material: Value| {
        let mut glb = triangle_on(json!({"mesh": 0}));
        glb.push("materials", material);
        load(&glb).materials[0].alpha_cutoff
    };
    let alpha = |a: f32| json!({"baseColorFactor": [1.0, 1.0, 1.0, a]});
    assert_eq!(
        cutoff_of(json!({"alphaMode": "MASK", "pbrMetallicRoughness": alpha(0.8)})),
        None
    );
    let invisible = cutoff_of(json!({"alphaMode": "MASK", "pbrMetallicRoughness": alpha(0.4)}));
    assert_eq!(invisible, Some(0.5 / 0.4));
    assert_eq!(
        cutoff_of(json!({"alphaMode": "MASK", "alphaCutoff": 0.0})),
        None
    );
    let blended = cutoff_of(json!({"alphaMode": "BLEND", "pbrMetallicRoughness": alpha(0.0)}));
    assert_eq!(blended, Some(f32::INFINITY));
    assert_eq!(cutoff_of(json!({"alphaMode": "BLEND"})), None);
}

/// A 2×2 PNG: red, green over blue, and white at half alpha.
fn png() -> Vec<u8> {
    let texels = [
        255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 255, 255, 255, 128,
    ];
    let image = image::RgbaImage::from_raw(2, 2, texels.to_vec()).unwrap();
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// A triangle with one image as base colour, emission and metallic-roughness.
fn textured() -> Glb {
    let mut glb = triangle_on(json!({"mesh": 0}));
    let image = glb.buffer_view(&png());
    glb.push(
        "images",
        json!({"bufferView": image, "mimeType": "image/png"}),
    );
    glb.push(
        "samplers",
        json!({"wrapS": 33071, "wrapT": 33648, "magFilter": 9728}),
    );
    glb.push("textures", json!({"source": 0, "sampler": 0}));
    let transform =
        json!({"offset": [0.25, 0.5], "rotation": FRAC_PI_2, "scale": [2.0, 3.0], "texCoord": 1});
    glb.push("materials", json!({
        "pbrMetallicRoughness": {
            "baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform": transform}},
            "metallicRoughnessTexture": {"index": 0, "texCoord": 1},
        },
        "emissiveTexture": {"index": 0, "texCoord": 0}, "emissiveFactor": [1.0, 1.0, 1.0],
        "normalTexture": {"index": 0},
    }));
    let texcoords = glb.floats(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    let primitive = &mut glb.json["meshes"][0]["primitives"][0];
    primitive["material"] = json!(0);
    primitive["attributes"]["TEXCOORD_1"] = json!(texcoords);
    glb
}

#[test]
fn textures_are_decoded_once_for_each_colour_space() {
    let scene = load(&textured());
    assert_eq!(
        scene.textures.len(),
        2,
        "sRGB for the colours, linear for the data"
    );
    let [color, data] = &scene.textures[..] else {
        unreachable!()
    };
    assert!(color.is_srgb && !data.is_srgb);
    assert_eq!((color.width, color.height), (2, 2));
    assert_eq!(color.rgba8[0], [255, 0, 0, 255], "row 0 is the top");
    assert_eq!(color.rgba8[3], [255, 255, 255, 128]);
    assert_eq!(color.wrap, [Wrap::ClampToEdge, Wrap::MirroredRepeat]);
    assert!(!color.is_bilinear);
    let material = &scene.materials[0];
    assert_eq!(material.base_color_texture.unwrap().texture, 0);
    assert_eq!(material.emission_texture.unwrap().texture, 0);
    assert_eq!(material.metallic_roughness_texture.unwrap().texture, 1);
}

#[test]
fn the_base_colour_chooses_the_coordinate_set_and_its_transform_is_kept() {
    let scene = load(&textured());
    assert_eq!(
        scene.static_mesh.texcoords,
        [Vec2::ZERO, Vec2::X, Vec2::Y],
        "TEXCOORD_1"
    );
    let all = scene.warnings.join("\n");
    assert!(all.contains("TEXCOORD_1 and TEXCOORD_0"), "{all}");
    assert!(all.contains("normal texture"), "{all}");
    let texture = scene.materials[0].base_color_texture.unwrap();
    let at = |uv: Vec2| texture.uv_column0 * uv.x + texture.uv_column1 * uv.y + texture.uv_offset;
    // A quarter turn counter-clockwise, with v down, takes +u to -v and +v to +u.
    assert!((at(Vec2::X) - Vec2::new(0.25, 0.5 - 2.0)).length() < 1e-6);
    assert!((at(Vec2::Y) - Vec2::new(0.25 + 3.0, 0.5)).length() < 1e-6);
}

#[test]
fn external_and_data_uris_load_the_same_scene() {
    use base64::Engine;
    let mut glb = textured();
    let whole = load(&glb);
    let buffer = std::mem::take(&mut glb.binary);
    let encoded = base64::engine::general_purpose::STANDARD.encode(&buffer);
    glb.json["buffers"][0]["uri"] =
        json!(format!("data:application/octet-stream;base64,{encoded}"));
    let inline = Saved::new("scene.gltf", glb.json.to_string().as_bytes());
    let inline = Scene::load(&inline.path).unwrap();

    glb.json["buffers"][0]["uri"] = json!("parts/the%20buffer.bin");
    glb.json["images"][0] = json!({"uri": "image.png"});
    let external = Saved::new("scene.gltf", glb.json.to_string().as_bytes());
    let folder = external.path.parent().unwrap();
    let parts = folder.join("parts");
    std::fs::create_dir(&parts).unwrap();
    std::fs::write(parts.join("the buffer.bin"), &buffer).unwrap();
    std::fs::write(folder.join("image.png"), png()).unwrap();
    let outside = Scene::load(&external.path).unwrap();
    for scene in [&inline, &outside] {
        assert_eq!(scene.static_mesh.positions, whole.static_mesh.positions);
        assert_eq!(scene.textures[0].rgba8, whole.textures[0].rgba8);
    }

    let before = outside.content_sha256;
    std::fs::write(parts.join("the buffer.bin"), [&buffer[..], &[0]].concat()).unwrap();
    let changed = Scene::load(&external.path).unwrap();
    assert_ne!(
        changed.content_sha256, before,
        "the hash covers the buffers"
    );
}

#[test]
fn lights_keep_their_units_and_shine_along_their_node() {
    let mut glb = triangle_on(json!({"mesh": 0}));
    glb.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "spot", "name": "key", "color": [1.0, 0.5, 0.25], "intensity": 8.0, "range": 12.0,
         "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.4}},
        {"type": "point", "intensity": -1.0},
        {"type": "directional"},
    ]}});
    let light = |index: usize| json!({"KHR_lights_punctual": {"light": index}});
    let down = [-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2];
    glb.root(json!({"extensions": light(0), "rotation": down, "scale": [5.0, 5.0, 5.0], "translation": [0.5, 2.5, 0.0]}));
    glb.root(json!({"extensions": light(1)}));
    glb.root(json!({"name": "sun", "extensions": light(2)}));
    let scene = load(&glb);
    assert_eq!(scene.lights.len(), 2, "a negative light is left out");
    let [key, sun] = &scene.lights[..] else {
        unreachable!()
    };
    assert_eq!(key.name, "key");
    assert_eq!(
        key.intensity,
        Vec3::new(8.0, 4.0, 2.0),
        "a scale does not change it"
    );
    assert_near(key.direction, Vec3::NEG_Y);
    assert_near(key.position, Vec3::new(0.0, 2.0, 0.0));
    assert_eq!(key.range_m, 12.0);
    let expected = PunctualKind::Spot {
        inner_cone_rad: 0.1,
        outer_cone_rad: 0.4,
    };
    assert_eq!(key.kind, expected);
    assert_eq!((sun.name.as_str(), sun.intensity), ("sun", Vec3::ONE));
    assert_near(sun.direction, Vec3::NEG_Z);
    assert!(sun.range_m.is_infinite());
}

#[test]
fn a_camera_under_a_scaled_and_mirrored_node_is_upright_and_rigid() {
    let mut glb = triangle_on(json!({"mesh": 0}));
    glb.push(
        "cameras",
        json!({"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}),
    );
    glb.root(json!({"camera": 0, "name": "eye", "scale": [-3.0, 0.5, 2.0], "translation": [0.5, 0.5, 4.0]}));
    let scene = load(&glb);
    let camera = &scene.cameras[0];
    assert_eq!(camera.name, "eye");
    assert_near(camera.pose.position_m, Vec3::new(0.0, 0.0, 4.0));
    assert_near(camera.pose.orientation * Vec3::NEG_Z, Vec3::NEG_Z);
    assert_near(camera.pose.orientation * Vec3::Y, Vec3::Y);
    assert!((camera.pose.orientation.length() - 1.0).abs() < 1e-6);
}

/// A parent that turns a quarter about +Y in 2 s, with a triangle, a light and a camera under it.
fn turning() -> Glb {
    let mut glb = Glb::new();
    let mesh = glb.triangle();
    glb.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "point"}]}});
    glb.push(
        "cameras",
        json!({"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}),
    );
    let child = glb.push(
        "nodes",
        json!({
            "name": "spinner", "mesh": mesh, "camera": 0, "translation": [2.0, 0.0, 0.0],
            "extensions": {"KHR_lights_punctual": {"light": 0}},
        }),
    );
    let parent = glb.root(json!({"children": [child]}));
    let end = [0.0, FRAC_PI_4.sin(), 0.0, FRAC_PI_4.cos()];
    glb.animate(
        parent,
        "rotation",
        "LINEAR",
        &[0.0, 2.0],
        &[[0.0, 0.0, 0.0, 1.0], end],
    );
    glb.root(json!({"mesh": mesh}));
    glb
}

#[test]
fn an_animated_ancestor_moves_mesh_light_and_camera() {
    let scene = load(&turning());
    assert_eq!(
        scene.static_mesh.triangles.len(),
        1,
        "the other triangle stands still"
    );
    assert_eq!(scene.objects.len(), 1);
    assert_eq!(scene.objects[0].name, "spinner");
    assert_eq!(scene.animation.duration_s(), 2.0);
    let origin = scene.file_from_scene_m.as_vec3();
    for (time_s, angle) in [(0.0, 0.0), (1.0, FRAC_PI_4), (1.5, 0.75 * FRAC_PI_2)] {
        let pose = scene.pose_at(time_s);
        let expected = Vec3::new(2.0 * f32::cos(angle), 0.0, -2.0 * f32::sin(angle)) - origin;
        assert_near(
            pose.scene_from_object[0].transform_point3(Vec3::ZERO),
            expected,
        );
        assert_near(pose.lights[0].position, expected);
        assert_near(pose.cameras[0].pose.position_m, expected);
        let forward = Vec3::new(-f32::sin(angle), 0.0, -f32::cos(angle));
        assert_near(pose.cameras[0].pose.orientation * Vec3::NEG_Z, forward);
    }
}

#[test]
fn time_loops_and_any_time_is_allowed() {
    let scene = load(&turning());
    let at = |time_s| scene.pose_at(time_s).lights[0].position;
    assert_near(at(2.0 + 0.5), at(0.5));
    assert_near(at(-0.5), at(1.5));
    assert_near(at(2e9 + 0.5), at(0.5));
    for odd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert_near(at(odd), at(0.0));
    }
    assert!(
        (at(0.5) - at(1.5)).length() > 0.1,
        "the comparison can fail"
    );
    let still = load(&triangle_on(json!({"mesh": 0})));
    assert!(still.pose_at(f64::NAN).scene_from_object.is_empty());
}

#[test]
fn bounds_cover_the_start_and_bounds_over_time_the_whole_motion() {
    let scene = load(&turning());
    let origin = scene.file_from_scene_m.as_vec3();
    assert_near(scene.bounds.max + origin, Vec3::new(3.0, 1.0, 0.0));
    let whole = scene.bounds_over_time();
    // The far corner (3, 0, 0) turns to (0, 0, -3).
    assert!(whole.min.z + origin.z < -2.99 && whole.min.z + origin.z > -3.3);
    assert_eq!(whole.max, scene.bounds.max);
    assert_eq!(
        load(&triangle_on(json!({"mesh": 0})))
            .bounds_over_time()
            .diagonal_m(),
        2.0_f32.sqrt()
    );
}

#[test]
fn translation_and_scale_follow_their_interpolation() {
    let animated = |interpolation: &str, values: &[[f32; 3]], path: &str| {
        let mut glb = triangle_on(json!({"mesh": 0}));
        glb.animate(0, path, interpolation, &[0.0, 1.0, 2.0], values);
        let scene = load(&glb);
        let origin = scene.file_from_scene_m.as_vec3();
        let pose = scene.pose_at(0.25);
        pose.scene_from_object[0].transform_point3(Vec3::X) + origin
    };
    let values = [[0.0; 3], [4.0, 0.0, 0.0], [0.0; 3]];
    assert_near(animated("LINEAR", &values, "translation"), Vec3::X * 2.0);
    assert_near(animated("STEP", &values, "translation"), Vec3::X);
    // Zero tangents: the smoothstep 3t² - 2t³ of the way.
    let splines: Vec<_> = values
        .iter()
        .flat_map(|v| [[0.0; 3], *v, [0.0; 3]])
        .collect();
    let smooth = 4.0 * (3.0 * 0.0625 - 2.0 * 0.015625);
    assert_near(
        animated("CUBICSPLINE", &splines, "translation"),
        Vec3::X * (1.0 + smooth),
    );
    let scales = [[1.0; 3], [5.0; 3], [1.0; 3]];
    assert_near(animated("LINEAR", &scales, "scale"), Vec3::X * 2.0);
}

#[test]
fn of_two_animations_of_one_property_the_later_wins_with_a_warning() {
    let mut glb = triangle_on(json!({"mesh": 0}));
    glb.animate(
        0,
        "translation",
        "LINEAR",
        &[0.0, 8.0],
        &[[0.0; 3], [8.0, 0.0, 0.0]],
    );
    glb.animate(
        0,
        "translation",
        "LINEAR",
        &[0.0, 2.0],
        &[[0.0; 3], [0.0, 2.0, 0.0]],
    );
    let scene = load(&glb);
    let origin = scene.file_from_scene_m.as_vec3();
    let corner = scene.pose_at(1.0).scene_from_object[0].transform_point3(Vec3::ZERO);
    assert_near(corner + origin, Vec3::Y);
    assert_eq!(scene.warnings.len(), 1);
    assert!(
        scene.warnings[0].contains("later one"),
        "{:?}",
        scene.warnings
    );
}

#[test]
fn effects_name_what_calls_for_them() {
    let Some(path) = shared_scene("glb/b-cornell-caustic.glb") else {
        return;
    };
    let scene = Scene::load(&path).unwrap();
    let effects = Effects::of(&scene);
    assert!(effects.mirror && effects.smooth_dielectric && effects.caustics);
    assert!(effects.area_light && effects.indirect);
    assert!(!effects.glossy && !effects.rough_dielectric && !effects.point_light);
    assert!(!effects.base_color_texture && !effects.dynamic_objects && !effects.absorption);
    let reports = Effects::report(&scene);
    let names: Vec<_> = effects.named().map(|(name, _)| name).collect();
    assert_eq!(reports.iter().map(|r| r.effect).collect::<Vec<_>>(), names);
    let glass = reports
        .iter()
        .find(|r| r.effect == "smooth dielectric")
        .unwrap();
    assert!(
        glass.on && glass.why.contains("`glass`") && glass.why.contains("ior 1.5"),
        "{glass:?}"
    );
}

#[test]
fn a_diffuse_scene_calls_for_no_specular_effect() {
    let Some(path) = shared_scene("glb/a-cornell-diffuse.glb") else {
        return;
    };
    let effects = Effects::of(&Scene::load(&path).unwrap());
    let expected = Effects {
        area_light: true,
        indirect: true,
        ..Effects::default()
    };
    assert_eq!(effects, expected);
}

#[test]
fn a_texture_that_may_make_a_surface_smooth_turns_mirrors_on() {
    let effects = Effects::of(&load(&textured()));
    assert!(effects.mirror && effects.glossy && effects.caustics);
    assert!(effects.base_color_texture && effects.metallic_roughness_texture);
    assert!(effects.emission_texture && effects.area_light);
    let moving = Effects::of(&load(&turning()));
    assert!(moving.dynamic_objects && moving.moving_lights && moving.point_light);
}

#[test]
fn a_missing_file_is_named() {
    let error = Scene::load("no/such/scene.glb".as_ref()).unwrap_err();
    assert!(error.to_string().contains("no/such/scene.glb"));
    assert!(matches!(error.problem, SceneProblem::Io { .. }));
}
