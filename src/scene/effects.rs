//! Which effects a scene calls for, so that the shaders compile nothing else, and why.
//!
//! The rule is conservative: where the file cannot tell (a texture may make a surface smooth), the effect is on.
//!
//! Source: ARCHITECTURE.md, "Effects"; that absent code and not a uniform must switch them was measured there.

use super::light::PunctualKind;
use super::{Material, Scene};

/// Declares the effects once: the flags, their names, and their list.
macro_rules! effects {
    ($($(#[$doc:meta])* $field:ident: $name:literal),* $(,)?) => {
        /// Which effects can matter in a scene. They leave out passes, buffers and, by [`Effects::constants`], paths of the shaders.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
        pub struct Effects {
            $($(#[$doc])* pub $field: bool,)*
        }

        impl Effects {
            /// The names of all effects with whether each is on.
            pub fn named(&self) -> impl Iterator<Item = (&'static str, bool)> {
                [$(($name, self.$field)),*].into_iter()
            }

            /// Every effect there is: what a renderer would run that knows nothing of its scene.
            pub const ALL: Self = Self { $($field: true),* };

            /// With one effect, by its name, on or off as told.
            pub fn with(mut self, name: &str, on: bool) -> Self {
                $(if name == $name { self.$field = on; })*
                self
            }

            /// With some effects, by their names, off.
            pub fn without(self, names: &[&str]) -> Self {
                names.iter().fold(self, |effects, name| effects.with(name, false))
            }

            fn from_reports(reports: &[EffectReport]) -> Self {
                let is_on = |name| reports.iter().any(|r| r.effect == name && r.on);
                Self { $($field: is_on($name)),* }
            }
        }
    };
}

effects! {
    /// Rays that follow mirrors, glass, and lobes too sharp to gather photons for.
    specular_chains: "specular chains",
    /// Perfectly smooth refraction and reflection at a transmissive surface.
    smooth_dielectric: "smooth dielectric",
    /// GGX-rough transmissive surface.
    rough_dielectric: "rough dielectric",
    /// Transmissive surface without thickness: light passes undeflected.
    thin_wall: "thin-walled transmission",
    /// Light is absorbed on its way through a solid.
    absorption: "absorption",
    /// GGX-rough reflection by a metal or a dielectric coat.
    glossy: "glossy reflection",
    /// Base colours come from textures.
    base_color_texture: "base colour textures",
    /// Metalness and roughness come from textures.
    metallic_roughness_texture: "metallic-roughness textures",
    /// Emission comes from textures.
    emission_texture: "emission textures",
    /// Hits that do not count where a texture is transparent.
    alpha_mask: "alpha masks",
    /// KHR_lights_punctual point lights.
    point_light: "point lights",
    /// KHR_lights_punctual spot lights.
    spot_light: "spot lights",
    /// KHR_lights_punctual directional lights.
    directional_light: "directional lights",
    /// Emissive triangles.
    area_light: "area lights",
    /// Objects that an animation moves.
    dynamic_objects: "dynamic objects",
    /// Lights, punctual or emissive, that an animation moves.
    moving_lights: "moving lights",
    /// Light gathered by specular surfaces onto others.
    caustics: "caustics",
    /// Light that reaches a surface by way of others.
    indirect: "indirect light",
}

/// Whether a scene calls for an effect, and why, for people to read.
#[derive(Clone, Debug, serde::Serialize)]
pub struct EffectReport {
    /// Name of the effect, as in [`Effects::named`].
    pub effect: &'static str,
    /// Whether it is on.
    pub on: bool,
    /// What in the file calls for it, or that nothing does.
    pub why: String,
}

impl Effects {
    /// What the scene calls for, where lobes of at least `gathered_alpha_min` (GGX alpha) are gathered and sharper ones traced.
    pub fn of(scene: &Scene, gathered_alpha_min: f32) -> Self {
        Self::from_reports(&Self::report(scene, gathered_alpha_min))
    }

    /// What the scene calls for, with reasons, in a fixed order.
    pub fn report(scene: &Scene, gathered_alpha_min: f32) -> Vec<EffectReport> {
        let used = used_materials(scene);
        let mut reports = material_reports(&used, gathered_alpha_min);
        reports.extend(light_reports(scene, &used));
        reports.extend(transport_reports(scene, &used, gathered_alpha_min));
        reports
    }

    /// Whether light passes through some surface.
    fn transmits(&self) -> bool {
        self.smooth_dielectric || self.rough_dielectric || self.thin_wall
    }

    /// Whether eye paths may go on beyond the first surface they meet.
    pub fn has_chains(&self) -> bool {
        self.specular_chains || self.transmits()
    }

    /// Whether some light has no extent.
    pub fn has_delta_lights(&self) -> bool {
        self.point_light || self.spot_light || self.directional_light
    }

    /// Whether anything moves from frame to frame, besides the viewer.
    pub fn has_motion(&self) -> bool {
        self.dynamic_objects || self.moving_lights
    }

    /// The `override` constants that leave out of the shaders what is not among the effects.
    pub fn constants(&self) -> Vec<(&'static str, f64)> {
        let needs_texcoords = self.base_color_texture
            || self.metallic_roughness_texture
            || self.emission_texture
            || self.alpha_mask;
        [
            ("HAS_CHAINS", self.has_chains()),
            ("HAS_SPECULAR", self.has_chains() || self.glossy),
            ("HAS_ROUGH", self.glossy || self.rough_dielectric),
            ("HAS_TRANSMISSION", self.transmits()),
            ("HAS_ABSORPTION", self.absorption),
            ("HAS_TEXCOORDS", needs_texcoords),
            ("HAS_BASE_COLOR_TEXTURES", self.base_color_texture),
            (
                "HAS_METALLIC_ROUGHNESS_TEXTURES",
                self.metallic_roughness_texture,
            ),
            ("HAS_EMISSION_TEXTURES", self.emission_texture),
            ("HAS_ALPHA", self.alpha_mask),
            ("HAS_POINT_LIGHTS", self.point_light),
            ("HAS_SPOT_LIGHTS", self.spot_light),
            ("HAS_DIRECTIONAL_LIGHTS", self.directional_light),
            ("HAS_AREA_LIGHTS", self.area_light),
            ("HAS_DELTA_LIGHTS", self.has_delta_lights()),
            ("HAS_OBJECTS", self.dynamic_objects),
        ]
        .map(|(name, on)| (name, f64::from(u8::from(on))))
        .to_vec()
    }
}

/// The materials that some triangle has; others cannot matter.
fn used_materials(scene: &Scene) -> Vec<&Material> {
    let mut is_used = vec![false; scene.materials.len()];
    let objects = scene.objects.iter().map(|object| &object.mesh);
    for mesh in std::iter::once(&scene.static_mesh).chain(objects) {
        for &material in &mesh.material_of_triangle {
            is_used[material as usize] = true;
        }
    }
    let materials = scene.materials.iter().zip(is_used);
    materials
        .filter(|(_, used)| *used)
        .map(|(m, _)| m)
        .collect()
}

impl Material {
    /// Whether part of it reflects as a metal.
    fn may_be_metal(&self) -> bool {
        self.metallic > 0.0
    }

    /// Whether part of it reflects by a dielectric coat over diffuse light: at grazing angles it does so whatever its ior.
    fn has_coat(&self) -> bool {
        (self.metallic < 1.0 || self.metallic_roughness_texture.is_some())
            && self.transmission < 1.0
            && self.specular_factor > 0.0
    }

    /// Whether light passes into or through it.
    pub(super) fn is_transmissive(&self) -> bool {
        self.transmission > 0.0
            && (self.metallic < 1.0 || self.metallic_roughness_texture.is_some())
    }

    /// Whether it scatters light to all sides.
    fn is_diffuse(&self) -> bool {
        let is_opaque_dielectric = self.metallic < 1.0 && self.transmission < 1.0;
        (is_opaque_dielectric || self.metallic_roughness_texture.is_some())
            && self.base_color.max_element() > 0.0
    }

    /// Whether rays follow some of its reflection: a lobe sharper than those that are gathered, in places at least.
    pub(super) fn is_traced(&self, gathered_alpha_min: f32) -> bool {
        let is_sharp = self.may_be_smooth() || self.roughness * self.roughness < gathered_alpha_min;
        self.is_transmissive() || (is_sharp && (self.may_be_metal() || self.has_coat()))
    }

    fn surface(&self) -> String {
        let from_texture = match self.metallic_roughness_texture {
            Some(_) => " times a texture",
            None => "",
        };
        format!(
            "metallic {}, roughness {}{from_texture}",
            self.metallic, self.roughness
        )
    }
}

/// One report: on if any material passes, named by the first such and the number of others.
fn of_materials(
    effect: &'static str,
    used: &[&Material],
    passes: impl Fn(&Material) -> bool,
    describe: impl Fn(&Material) -> String,
    absent: &str,
) -> EffectReport {
    let mut passing = used.iter().filter(|material| passes(material));
    let Some(first) = passing.next() else {
        return off(effect, absent);
    };
    let others = match passing.count() {
        0 => String::new(),
        1 => " (and 1 more material)".to_owned(),
        count => format!(" (and {count} more materials)"),
    };
    on(
        effect,
        format!("`{}`: {}{others}", first.name, describe(first)),
    )
}

fn on(effect: &'static str, why: String) -> EffectReport {
    EffectReport {
        effect,
        on: true,
        why,
    }
}

fn off(effect: &'static str, why: &str) -> EffectReport {
    EffectReport {
        effect,
        on: false,
        why: why.to_owned(),
    }
}

fn material_reports(used: &[&Material], gathered_alpha_min: f32) -> Vec<EffectReport> {
    let transmission = |m: &Material| {
        format!(
            "transmission {}, ior {}, {}",
            m.transmission,
            m.ior,
            m.surface()
        )
    };
    let no_glass = "no material transmits light";
    vec![
        of_materials(
            "specular chains",
            used,
            |m| m.is_traced(gathered_alpha_min),
            Material::surface,
            "no surface reflects sharply enough for rays to follow, none transmits light",
        ),
        of_materials(
            "smooth dielectric",
            used,
            |m| m.is_transmissive() && m.may_be_smooth(),
            transmission,
            no_glass,
        ),
        of_materials(
            "rough dielectric",
            used,
            |m| m.is_transmissive() && m.may_be_rough(),
            transmission,
            "no material transmits light through a rough surface",
        ),
        of_materials(
            "thin-walled transmission",
            used,
            |m| m.is_transmissive() && !m.is_solid,
            |m| format!("transmission {} without a volume", m.transmission),
            "no transmissive material lacks a volume",
        ),
        of_materials(
            "absorption",
            used,
            |m| m.is_transmissive() && m.is_solid && m.attenuation_distance_m.is_finite(),
            |m| format!("attenuation distance {} m", m.attenuation_distance_m),
            "no solid absorbs light",
        ),
        of_materials(
            "glossy reflection",
            used,
            |m| m.may_be_rough() && (m.may_be_metal() || m.has_coat()),
            Material::surface,
            "no metal or coat is rough",
        ),
        of_materials(
            "base colour textures",
            used,
            |m| m.base_color_texture.is_some(),
            |_| "has a base colour texture".to_owned(),
            "no material has one",
        ),
        of_materials(
            "metallic-roughness textures",
            used,
            |m| m.metallic_roughness_texture.is_some(),
            |_| "has a metallic-roughness texture".to_owned(),
            "no material has one",
        ),
        of_materials(
            "emission textures",
            used,
            |m| m.emission_texture.is_some() && m.is_emissive(),
            |_| "has an emission texture".to_owned(),
            "no emissive material has one",
        ),
        of_materials(
            "alpha masks",
            used,
            |m| m.alpha_cutoff.is_some(),
            |m| format!("alpha cutoff {}", m.alpha_cutoff.unwrap_or_default()),
            "every material is opaque",
        ),
    ]
}

fn light_reports(scene: &Scene, used: &[&Material]) -> Vec<EffectReport> {
    let punctual = |effect, is_kind: fn(&PunctualKind) -> bool| {
        let mut lights = scene.lights.iter().filter(|light| is_kind(&light.kind));
        match (lights.next(), lights.count()) {
            (None, _) => off(effect, "the file has none"),
            (Some(light), 0) => on(effect, format!("`{}`", light.name)),
            (Some(light), others) => on(effect, format!("`{}` (and {others} more)", light.name)),
        }
    };
    vec![
        punctual("point lights", |k| matches!(k, PunctualKind::Point)),
        punctual("spot lights", |k| matches!(k, PunctualKind::Spot { .. })),
        punctual("directional lights", |k| {
            matches!(k, PunctualKind::Directional)
        }),
        of_materials(
            "area lights",
            used,
            Material::is_emissive,
            |m| {
                let [r, g, b] = m.emission_w_per_m2_sr.to_array();
                format!("emits {r:.4} {g:.4} {b:.4} W/(m2 sr)")
            },
            "no triangle emits light",
        ),
        match scene.objects.as_slice() {
            [] => off("dynamic objects", "no animation moves a mesh"),
            [object] => on("dynamic objects", format!("`{}` is animated", object.name)),
            [object, others @ ..] => on(
                "dynamic objects",
                format!("`{}` is animated (and {} more)", object.name, others.len()),
            ),
        },
        moving_light_report(scene),
    ]
}

fn moving_light_report(scene: &Scene) -> EffectReport {
    let effect = "moving lights";
    let is_emissive = |&material: &u32| scene.materials[material as usize].is_emissive();
    if let Some(light) = scene.lights.iter().find(|l| scene.animation.moves(l.node)) {
        return on(effect, format!("`{}` is animated", light.name));
    }
    let mut objects = scene.objects.iter();
    match objects.find(|o| o.mesh.material_of_triangle.iter().any(is_emissive)) {
        Some(object) => on(
            effect,
            format!("`{}` emits light and is animated", object.name),
        ),
        None => off(effect, "no animation moves a light"),
    }
}

fn transport_reports(
    scene: &Scene,
    used: &[&Material],
    gathered_alpha_min: f32,
) -> [EffectReport; 2] {
    let is_lit = !scene.lights.is_empty() || used.iter().any(|m| m.is_emissive());
    if !is_lit {
        let why = "the scene has no light";
        return [off("caustics", why), off("indirect light", why)];
    }
    let has_receiver = used.iter().any(|m| m.is_diffuse() || m.may_be_rough());
    let caustics = of_materials(
        "caustics",
        used,
        |m| has_receiver && m.is_traced(gathered_alpha_min),
        |m| format!("{} gathers light onto other surfaces", m.surface()),
        "no specular surface, or none to receive its light",
    );
    let indirect = of_materials(
        "indirect light",
        used,
        |m| m.is_diffuse() || m.may_be_metal() || m.is_transmissive() || m.has_coat(),
        |m| {
            let [r, g, b] = m.base_color.to_array();
            format!("reflects light (base colour {r:.3} {g:.3} {b:.3})")
        },
        "every surface is black",
    );
    [caustics, indirect]
}
