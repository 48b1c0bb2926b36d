//! Materials: metallic-roughness and the extensions that macula reads, with every factor brought into its range.

use glam::{Vec3, Vec4};
use gltf::material::AlphaMode;

use super::error::SceneProblem;
use super::light::STRONGEST;
use super::node::display_name;
use super::texture::{TextureRef, TextureTable};
use super::warnings::Warnings;

/// GGX alpha (roughness²) below which a lobe counts as perfectly smooth: narrower than any pixel's view of it, and beyond f32's reach.
pub const SMOOTH_ALPHA: f32 = 1e-3;

/// A metallic-roughness material with the extensions that macula reads (units: ARCHITECTURE.md, "Conventions").
#[derive(Clone, Debug)]
pub struct Material {
    /// Name in the file.
    pub name: String,
    /// Linear base colour; Lambert albedo for a non-metal.
    pub base_color: Vec3,
    /// Texture multiplied onto `base_color` (sRGB).
    pub base_color_texture: Option<TextureRef>,
    /// 0 dielectric .. 1 metal.
    pub metallic: f32,
    /// Perceptual roughness; GGX alpha = roughness².
    pub roughness: f32,
    /// Blue = metallic, green = roughness, both multiplied (linear).
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Emitted radiance of the front face, W/(m² sr): emissiveFactor × emissiveStrength.
    pub emission_w_per_m2_sr: Vec3,
    /// Texture multiplied onto the emission (sRGB).
    pub emission_texture: Option<TextureRef>,
    /// Refractive index, at least 1 (KHR_materials_ior, default 1.5).
    pub ior: f32,
    /// KHR_materials_specular: 0 switches the dielectric coat off, leaving exact Lambert.
    pub specular_factor: f32,
    /// KHR_materials_specular: tint of F0.
    pub specular_color: Vec3,
    /// KHR_materials_transmission: share of light that is not metal reflection or coat and passes through.
    pub transmission: f32,
    /// Whether the surface bounds a solid that refracts (KHR_materials_volume thickness > 0) or is thin-walled.
    pub is_solid: bool,
    /// KHR_materials_volume: colour that white light becomes after `attenuation_distance_m`.
    pub attenuation_color: Vec3,
    /// Metres; infinite for no absorption.
    pub attenuation_distance_m: f32,
    /// Whether back faces reflect and emit like front faces.
    pub double_sided: bool,
    /// Alpha of the base colour texture (1 without one) below which a hit does not count, or `None` for opaque. The factor's alpha is
    /// already divided out, so it can exceed 1: then no hit counts. alphaMode BLEND is read as a mask at 0.5 with a warning.
    pub alpha_cutoff: Option<f32>,
}

impl Material {
    /// glTF's default material.
    pub(super) fn gltf_default() -> Self {
        Self {
            name: "default".to_owned(),
            base_color: Vec3::ONE,
            base_color_texture: None,
            metallic: 1.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            emission_w_per_m2_sr: Vec3::ZERO,
            emission_texture: None,
            ior: 1.5,
            specular_factor: 1.0,
            specular_color: Vec3::ONE,
            transmission: 0.0,
            is_solid: false,
            attenuation_color: Vec3::ONE,
            attenuation_distance_m: f32::INFINITY,
            double_sided: false,
            alpha_cutoff: None,
        }
    }

    /// Whether its lobes may be perfectly smooth somewhere: by its factor, or because a texture may say so.
    pub fn may_be_smooth(&self) -> bool {
        self.metallic_roughness_texture.is_some() || self.is_smooth()
    }

    /// Whether its lobes may be rough somewhere.
    pub fn may_be_rough(&self) -> bool {
        !self.is_smooth()
    }

    /// Whether its lobes are perfectly smooth wherever a texture does not say otherwise (a texture only makes them smoother).
    fn is_smooth(&self) -> bool {
        self.roughness * self.roughness < SMOOTH_ALPHA
    }

    /// Whether it emits light.
    pub fn is_emissive(&self) -> bool {
        self.emission_w_per_m2_sr.max_element() > 0.0
    }
}

/// A material, and the set of texture coordinates that it reads.
pub(super) struct LoadedMaterial {
    pub material: Material,
    /// `TEXCOORD_n`, or `None` if it has no texture.
    pub texcoord_set: Option<u32>,
}

/// Reads all materials, and glTF's default one after them.
pub(super) fn read_materials(
    document: &gltf::Document,
    textures: &mut TextureTable,
    warnings: &mut Warnings,
) -> Result<Vec<LoadedMaterial>, SceneProblem> {
    let mut materials = document
        .materials()
        .map(|material| {
            let index = material.index().unwrap_or(0);
            let reader = Reader {
                label: display_name("material", material.name(), index),
                texcoord_set: None,
                textures,
                warnings,
            };
            reader.read(&material, index)
        })
        .collect::<Result<Vec<_>, _>>()?;
    materials.push(LoadedMaterial {
        material: Material::gltf_default(),
        texcoord_set: None,
    });
    Ok(materials)
}

/// Reads one material.
struct Reader<'a> {
    /// For messages.
    label: String,
    texcoord_set: Option<u32>,
    textures: &'a mut TextureTable,
    warnings: &'a mut Warnings,
}

impl Reader<'_> {
    fn read(mut self, json: &gltf::Material, index: usize) -> Result<LoadedMaterial, SceneProblem> {
        let pbr = json.pbr_metallic_roughness();
        let base_color = self.colors("baseColorFactor", pbr.base_color_factor().into())?;
        // The base colour's set comes first: it is the one that is read.
        let base_color_texture = self.texture(pbr.base_color_texture(), true);
        let metallic_roughness_texture = self.texture(pbr.metallic_roughness_texture(), false);
        let emission_texture = self.texture(json.emissive_texture(), true);
        self.warn_of_unread_textures(json);

        let emissive_strength = json.emissive_strength().unwrap_or(1.0);
        let emission = Vec3::from_array(json.emissive_factor()) * emissive_strength;
        let specular = json.specular();
        let specular_color = specular.as_ref().map_or(Vec3::ONE, |specular| {
            Vec3::from_array(specular.specular_color_factor())
        });
        let volume = json.volume();
        let attenuation_distance_m = volume
            .as_ref()
            .map_or(f32::INFINITY, |volume| volume.attenuation_distance());
        let attenuation_color = volume
            .as_ref()
            .map_or([1.0; 3], |volume| volume.attenuation_color());
        let material = Material {
            name: json
                .name()
                .map_or_else(|| format!("material {index}"), str::to_owned),
            base_color: base_color.truncate(),
            base_color_texture,
            metallic: self.share("metallicFactor", pbr.metallic_factor())?,
            roughness: self.share("roughnessFactor", pbr.roughness_factor())?,
            metallic_roughness_texture,
            emission_w_per_m2_sr: self.emission(emission)?,
            emission_texture,
            ior: self.ior(json.ior().unwrap_or(1.5))?,
            specular_factor: match &specular {
                Some(specular) => self.share("specularFactor", specular.specular_factor())?,
                None => 1.0,
            },
            specular_color: self.not_negative("specularColorFactor", specular_color)?,
            transmission: match json.transmission() {
                Some(lobe) => self.share("transmissionFactor", lobe.transmission_factor())?,
                None => 0.0,
            },
            is_solid: volume.is_some_and(|volume| volume.thickness_factor() > 0.0),
            attenuation_color: self
                .colors(
                    "attenuationColor",
                    Vec3::from_array(attenuation_color).extend(1.0),
                )?
                .truncate(),
            attenuation_distance_m: if attenuation_distance_m > 0.0 {
                attenuation_distance_m
            } else {
                f32::INFINITY
            },
            double_sided: json.double_sided(),
            alpha_cutoff: self.alpha_cutoff(json, base_color.w, base_color_texture.is_some()),
        };
        Ok(LoadedMaterial {
            material,
            texcoord_set: self.texcoord_set,
        })
    }

    /// Registers a texture that macula reads.
    fn texture(&mut self, info: Option<gltf::texture::Info>, is_srgb: bool) -> Option<TextureRef> {
        let (reference, set) = self.textures.refer(&info?, is_srgb);
        let used = *self.texcoord_set.get_or_insert(set);
        if set != used {
            self.warnings.push(format!(
                "{} has textures on TEXCOORD_{used} and TEXCOORD_{set}; all are read from TEXCOORD_{used}",
                self.label
            ));
        }
        Some(reference)
    }

    /// Occlusion is passed over in silence: the light it stands for is computed here.
    fn warn_of_unread_textures(&mut self, json: &gltf::Material) {
        let specular = json.specular();
        let unread = [
            ("normal", json.normal_texture().is_some()),
            (
                "transmission",
                json.transmission()
                    .is_some_and(|t| t.transmission_texture().is_some()),
            ),
            (
                "thickness",
                json.volume()
                    .is_some_and(|v| v.thickness_texture().is_some()),
            ),
            (
                "specular",
                specular
                    .as_ref()
                    .is_some_and(|s| s.specular_texture().is_some()),
            ),
            (
                "specular colour",
                specular.is_some_and(|s| s.specular_color_texture().is_some()),
            ),
        ];
        for (name, _) in unread.into_iter().filter(|(_, is_present)| *is_present) {
            self.warnings.push(format!(
                "{} has a {name} texture; it is not read",
                self.label
            ));
        }
    }

    fn alpha_cutoff(
        &mut self,
        json: &gltf::Material,
        factor: f32,
        has_texture: bool,
    ) -> Option<f32> {
        let cutoff = match json.alpha_mode() {
            AlphaMode::Opaque => return None,
            AlphaMode::Mask => json.alpha_cutoff().unwrap_or(0.5),
            AlphaMode::Blend => 0.5,
        };
        let cutoff = if cutoff > 0.0 { cutoff / factor } else { 0.0 };
        let is_opaque = cutoff <= 0.0 || (!has_texture && cutoff <= 1.0);
        let blends = json.alpha_mode() == AlphaMode::Blend;
        if blends && (factor != 1.0 || has_texture) {
            self.warnings.push(format!(
                "{} blends by alpha; it is read as a mask at 0.5 (use KHR_materials_transmission for glass)",
                self.label
            ));
        }
        (!is_opaque).then_some(cutoff)
    }

    /// 0 is the extension's own mark for a material converted from specular-glossiness.
    fn ior(&mut self, ior: f32) -> Result<f32, SceneProblem> {
        if !ior.is_finite() {
            return Err(self.not_finite("ior"));
        }
        if ior >= 1.0 {
            return Ok(ior);
        }
        self.warnings.push(format!(
            "{} has ior {ior}, below that of vacuum; it is read as 1.5",
            self.label
        ));
        Ok(1.5)
    }

    /// A number in 0..1.
    fn share(&mut self, factor: &str, value: f32) -> Result<f32, SceneProblem> {
        Ok(self.colors(factor, Vec4::splat(value))?.x)
    }

    /// Numbers in 0..1.
    fn colors(&mut self, factor: &str, value: Vec4) -> Result<Vec4, SceneProblem> {
        if !value.is_finite() {
            return Err(self.not_finite(factor));
        }
        let clamped = value.clamp(Vec4::ZERO, Vec4::ONE);
        if clamped != value {
            self.warnings.push(format!(
                "{} has a {factor} outside 0 to 1; it is clamped",
                self.label
            ));
        }
        Ok(clamped)
    }

    fn emission(&mut self, emission: Vec3) -> Result<Vec3, SceneProblem> {
        let emission = self.not_negative("emission", emission)?;
        let clamped = emission.min(Vec3::splat(STRONGEST));
        if clamped != emission {
            self.warnings.push(format!(
                "{} has an emission above {STRONGEST:e}; it is clamped",
                self.label
            ));
        }
        Ok(clamped)
    }

    fn not_negative(&mut self, factor: &str, value: Vec3) -> Result<Vec3, SceneProblem> {
        if !value.is_finite() {
            return Err(self.not_finite(factor));
        }
        if value.cmplt(Vec3::ZERO).any() {
            self.warnings.push(format!(
                "{} has a negative {factor}; it is clamped",
                self.label
            ));
        }
        Ok(value.max(Vec3::ZERO))
    }

    fn not_finite(&self, factor: &str) -> SceneProblem {
        SceneProblem::NotFinite(format!("{}: its {factor} is not finite", self.label))
    }
}
