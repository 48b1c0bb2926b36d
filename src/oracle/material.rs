//! Materials at a point, by the texts of glTF 2.0 and its extensions.

use std::f64::consts::PI;

use glam::{DVec2, DVec3, DVec4};

use super::bsdf::{Bsdf, Interface, Schlick, is_sharp};
use super::geometry::Surface;
use crate::scene::{Material, SMOOTH_ALPHA, Scene, Texture, TextureRef, Wrap};

/// Red, green, blue (linear) and alpha of a texture at untransformed coordinates; white without one.
pub(super) fn texture_at(scene: &Scene, used: Option<TextureRef>, texcoord: DVec2) -> DVec4 {
    let Some(used) = used else { return DVec4::ONE };
    let texture = &scene.textures[used.texture as usize];
    let uv = used.uv_column0.as_dvec2() * texcoord.x
        + used.uv_column1.as_dvec2() * texcoord.y
        + used.uv_offset.as_dvec2();
    let place = uv * DVec2::new(f64::from(texture.width), f64::from(texture.height));
    if !texture.is_bilinear {
        return texel(texture, place.floor());
    }
    let corner = (place - 0.5).floor();
    let f = place - 0.5 - corner;
    let at = |x: f64, y: f64| texel(texture, corner + DVec2::new(x, y));
    let top = at(0.0, 0.0).lerp(at(1.0, 0.0), f.x);
    let bottom = at(0.0, 1.0).lerp(at(1.0, 1.0), f.x);
    top.lerp(bottom, f.y)
}

fn texel(texture: &Texture, place: DVec2) -> DVec4 {
    let column = wrapped(place.x, texture.width, texture.wrap[0]);
    let row = wrapped(place.y, texture.height, texture.wrap[1]);
    let texel = texture.rgba8[row * texture.width as usize + column];
    let [r, g, b, a] = texel.map(|c| f64::from(c) / 255.0);
    let linear = |c: f64| match (texture.is_srgb, c <= 0.04045) {
        (false, _) => c,
        (true, true) => c / 12.92,
        (true, false) => ((c + 0.055) / 1.055).powf(2.4),
    };
    DVec4::new(linear(r), linear(g), linear(b), a)
}

/// The texel for a coordinate that may lie beyond the texture (glTF 2.0, section 3.8.4.5).
fn wrapped(coordinate: f64, size: u32, wrap: Wrap) -> usize {
    let size = f64::from(size);
    let inside = match wrap {
        Wrap::ClampToEdge => coordinate,
        Wrap::Repeat => coordinate.rem_euclid(size),
        Wrap::MirroredRepeat => {
            let in_period = coordinate.rem_euclid(2.0 * size);
            in_period.min(2.0 * size - 1.0 - in_period)
        }
    };
    inside.clamp(0.0, size - 1.0) as usize
}

/// Whether the surface has a hole there (alphaMode MASK).
pub(super) fn is_cut_out(scene: &Scene, surface: &Surface) -> bool {
    let material = &scene.materials[surface.material];
    material.alpha_cutoff.is_some_and(|cutoff| {
        texture_at(scene, material.base_color_texture, surface.texcoord).w < f64::from(cutoff)
    })
}

/// Radiance that a surface sends out of itself, W/(m² sr), towards the side that it is seen from.
pub(super) fn emission(scene: &Scene, surface: &Surface) -> DVec3 {
    let material = &scene.materials[surface.material];
    if !surface.is_front && !material.double_sided {
        return DVec3::ZERO;
    }
    let tint = texture_at(scene, material.emission_texture, surface.texcoord);
    material.emission_w_per_m2_sr.as_dvec3() * tint.truncate()
}

/// Absorption inside a solid, 1/m: after the attenuation distance white light has the attenuation colour (KHR_materials_volume).
pub(super) fn absorption(material: &Material) -> DVec3 {
    let distance_m = f64::from(material.attenuation_distance_m);
    if !(distance_m > 0.0 && distance_m.is_finite()) {
        return DVec3::ZERO;
    }
    // A black channel absorbs within a hair's breadth.
    let color = material
        .attenuation_color
        .as_dvec3()
        .max(DVec3::splat(1e-6));
    -color.map(f64::ln) / distance_m
}

/// How the surface scatters light, for light and sight on the side of its normals.
pub(super) fn bsdf(scene: &Scene, surface: &Surface) -> Bsdf {
    let material = &scene.materials[surface.material];
    let base = material.base_color.as_dvec3()
        * texture_at(scene, material.base_color_texture, surface.texcoord).truncate();
    let maps = texture_at(scene, material.metallic_roughness_texture, surface.texcoord);
    let roughness = f64::from(material.roughness) * maps.y;
    let metallic = f64::from(material.metallic) * maps.z;
    let transmission = f64::from(material.transmission);
    let ior = f64::from(material.ior);
    let dielectric = base * (1.0 - metallic);
    let normal_reflectance = ((ior - 1.0) / (ior + 1.0)).powi(2);
    let strength = f64::from(material.specular_factor);
    let coat = Schlick {
        f0: (normal_reflectance * material.specular_color.as_dvec3()).min(DVec3::ONE) * strength,
        f90: strength,
    };
    // A metal lets nothing through.
    let interface = (transmission > 0.0 && metallic < 1.0).then(|| Interface {
        tint: dielectric * transmission,
        ior: if surface.is_front || !material.is_solid {
            ior
        } else {
            1.0 / ior
        },
        is_thin: !material.is_solid || ior == 1.0,
    });
    Bsdf {
        albedo: dielectric * (1.0 - transmission),
        coat,
        reflection: Schlick {
            f0: coat.f0.lerp(base, metallic),
            f90: coat.f90 + (1.0 - coat.f90) * metallic,
        },
        alpha: roughness * roughness,
        interface,
    }
}

/// Whether the material may send light on in a single direction, or in few.
pub(super) fn may_focus(material: &Material) -> bool {
    let reflects = material.metallic > 0.0 || material.specular_factor > 0.0;
    let transmits = material.transmission > 0.0;
    // A texture makes a lobe sharper only.
    let solid_ior = (transmits && material.is_solid).then_some(f64::from(material.ior));
    let may_be_sharp = material.metallic_roughness_texture.is_some()
        || is_sharp(f64::from(material.roughness).powi(2), solid_ior);
    // A thin wall passes light straight on, however rough it is.
    (transmits && !material.is_solid) || (may_be_sharp && (reflects || transmits))
}

/// Whether the material's wide lobes, or any but single directions, may send light on: by its factors, as photons that its texels decided
/// about would thin out those that the texels beside them count.
pub(super) fn may_spread(material: &Material) -> MaySpread {
    let reflects = material.metallic > 0.0 || material.specular_factor > 0.0;
    let has_facets = reflects || material.transmission > 0.0;
    let may_be_dielectric =
        material.metallic < 1.0 || material.metallic_roughness_texture.is_some();
    let has_lambert =
        may_be_dielectric && material.transmission < 1.0 && material.base_color.max_element() > 0.0;
    // A texture makes a lobe sharper only, and metal is never sharper than glass.
    let alpha = f64::from(material.roughness).powi(2);
    MaySpread {
        widely: has_lambert || (has_facets && !is_sharp(alpha, None)),
        at_all: has_lambert || (has_facets && alpha >= f64::from(SMOOTH_ALPHA)),
    }
}

/// See [`may_spread`].
pub(super) struct MaySpread {
    /// By wide lobes.
    pub widely: bool,
    /// By any lobe that has a width.
    pub at_all: bool,
}

/// Power that a surface of the material sends out, W/m², all its sides together, with its texture's mean.
pub(super) fn exitance(scene: &Scene, material: &Material) -> f64 {
    let tint = material.emission_texture.map_or(DVec3::ONE, |used| {
        let texture = &scene.textures[used.texture as usize];
        let columns = f64::from(texture.width);
        let count = texture.rgba8.len().max(1) as f64;
        let place = |i: usize| DVec2::new((i as f64) % columns, (i as f64 / columns).floor());
        let sum: DVec4 = (0..texture.rgba8.len())
            .map(|i| texel(texture, place(i)))
            .sum();
        sum.truncate() / count
    });
    let sides = if material.double_sided { 2.0 } else { 1.0 };
    (material.emission_w_per_m2_sr.as_dvec3() * tint).element_sum() * sides * PI
}
