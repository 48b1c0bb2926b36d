//! Materials as glTF JSON, by what they are physically. Colours are linear.

use serde_json::{Value, json};

/// Exactly `albedo / π`: no coat (KHR_materials_specular at 0).
pub fn lambert(albedo: [f64; 3]) -> Value {
    json!({
        "pbrMetallicRoughness": {
            "baseColorFactor": rgba(albedo), "metallicFactor": 0.0, "roughnessFactor": 1.0,
        },
        "extensions": { "KHR_materials_specular": { "specularFactor": 0.0 } },
        "doubleSided": true,
    })
}

/// A black Lambert surface whose front emits `radiance`, in W/(m² sr).
pub fn lamp(radiance: [f64; 3]) -> Value {
    let mut material = lambert([0.0; 3]);
    material["doubleSided"] = json!(false);
    emit(&mut material, radiance);
    material
}

/// Makes a material's front emit `radiance`, in W/(m² sr).
pub fn emit(material: &mut Value, radiance: [f64; 3]) {
    let strength = radiance.into_iter().fold(0.0, f64::max);
    material["emissiveFactor"] = json!(radiance.map(|channel| channel / strength));
    // A strength of 1 is core glTF.
    if strength != 1.0 {
        material["extensions"]["KHR_materials_emissive_strength"] =
            json!({ "emissiveStrength": strength });
    }
}

/// A metal with GGX roughness; 0 is a mirror.
pub fn metal(reflectance: [f64; 3], roughness: f64) -> Value {
    json!({
        "pbrMetallicRoughness": {
            "baseColorFactor": rgba(reflectance), "metallicFactor": 1.0, "roughnessFactor": roughness,
        },
        "doubleSided": true,
    })
}

/// Paint, lacquer or glaze: a diffuse ground under a GGX coat of index 1.5.
pub fn glossy(albedo: [f64; 3], roughness: f64) -> Value {
    json!({
        "pbrMetallicRoughness": {
            "baseColorFactor": rgba(albedo), "metallicFactor": 0.0, "roughnessFactor": roughness,
        },
        "doubleSided": true,
    })
}

/// Multiplies a texture onto a material's base colour.
pub fn textured(mut material: Value, texture: usize) -> Value {
    material["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": texture });
    material
}

/// Clear glass: a smooth solid of index `ior`, about `thickness_m` thick (which only says that it is solid).
pub fn glass(ior: f64, thickness_m: f64) -> Value {
    json!({
        "pbrMetallicRoughness": {
            "baseColorFactor": rgba([1.0; 3]), "metallicFactor": 0.0, "roughnessFactor": 0.0,
        },
        "extensions": {
            "KHR_materials_transmission": { "transmissionFactor": 1.0 },
            "KHR_materials_ior": { "ior": ior },
            "KHR_materials_volume": { "thicknessFactor": thickness_m },
        },
    })
}

fn rgba([red, green, blue]: [f64; 3]) -> [f64; 4] {
    [red, green, blue, 1.0]
}
