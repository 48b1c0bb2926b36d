//! Materials, textures, the files that hold them, and the effects that they call for.

use std::f32::consts::FRAC_PI_2;

use glam::{Vec2, Vec3};
use macula::params::Params;
use macula::scene::effects::Effects;
use macula::scene::{Scene, Wrap};
use macula::technique;
use serde_json::{Value, json};

use super::glb::{Glb, Saved};
use super::motion::turning;
use super::shared::shared;
use super::{load, triangle_on};

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

fn effects_of(scene: &Scene) -> Effects {
    technique::effects(scene, &Params::default())
}

#[test]
fn effects_name_what_calls_for_them() {
    let Some(path) = shared("scenes/glb/b-cornell-caustic.glb") else {
        return;
    };
    let scene = Scene::load(&path).unwrap();
    let effects = effects_of(&scene);
    assert!(effects.specular_chains && effects.smooth_dielectric && effects.caustics);
    assert!(effects.area_light && effects.indirect);
    assert!(!effects.glossy && !effects.rough_dielectric && !effects.point_light);
    assert!(!effects.base_color_texture && !effects.dynamic_objects && !effects.absorption);
    let reports = Effects::report(&scene, Params::default().gather.glossy_alpha_min);
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
    let Some(path) = shared("scenes/glb/a-cornell-diffuse.glb") else {
        return;
    };
    let effects = effects_of(&Scene::load(&path).unwrap());
    let expected = Effects {
        area_light: true,
        indirect: true,
        ..Effects::default()
    };
    assert_eq!(effects, expected);
}

#[test]
fn a_texture_that_may_make_a_surface_smooth_turns_specular_chains_on() {
    let effects = effects_of(&load(&textured()));
    assert!(effects.specular_chains && effects.glossy && effects.caustics);
    assert!(effects.base_color_texture && effects.metallic_roughness_texture);
    assert!(effects.emission_texture && effects.area_light);
    let moving = effects_of(&load(&turning()));
    assert!(moving.dynamic_objects && moving.moving_lights && moving.point_light);
}
