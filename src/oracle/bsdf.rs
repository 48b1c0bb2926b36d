//! How a surface scatters light: values, densities and samples of glTF's metallic-roughness model with its specular, ior, transmission
//! and volume extensions.
//!
//! Directions point away from the surface, `wo` to the eye, `wi` to the light; `n` is the normal on the eye's side. Source: glTF 2.0,
//! appendix B; Walter et al., "Microfacet Models for Refraction", EGSR 2007; Heitz, JCGT 7(4), 2018 for visible normals.
//! Limits: single scattering; the masking of eye and light is separable; a thin wall passes light straight on.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

use super::random::Random;
use crate::scene::SMOOTH_ALPHA;

/// Spread (GGX alpha, or the part of it that refraction leaves) below which lobes are sharp: what comes from a lamp without extent they send
/// on into few directions, which paths from a wide lobe seldom take.
const SHARP_SPREAD: f64 = 0.2;

/// Whether a material's lobes are sharp, `ior` being that of its solid, if it is one. A facet turns what it refracts by as much less as the
/// index is near 1; the same from either side, as both are one surface to light that goes through.
pub fn is_sharp(alpha: f64, ior: Option<f64>) -> bool {
    let turned = ior.map_or(1.0, |ior| (ior.max(ior.recip()) - 1.0).min(1.0));
    alpha * turned < SHARP_SPREAD
}

/// Fresnel reflectance by Schlick's formula, from normal incidence to grazing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Schlick {
    /// At normal incidence.
    pub f0: DVec3,
    /// At grazing incidence.
    pub f90: f64,
}

impl Schlick {
    fn at(&self, cos_theta: f64) -> DVec3 {
        let m = (1.0 - cos_theta).clamp(0.0, 1.0).powi(5);
        self.f0 + (DVec3::splat(self.f90) - self.f0) * m
    }
}

/// A boundary that light passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interface {
    /// Colour of what passes.
    pub tint: DVec3,
    /// Refractive index of the far side over the near side.
    pub ior: f64,
    /// Light goes straight on: two boundaries with nothing between, or one that does not change the index.
    pub is_thin: bool,
}

/// A surface's scattering at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bsdf {
    /// Albedo of the Lambert part, before coat or interface take their share.
    pub albedo: DVec3,
    /// Reflectance of the dielectric coat, which the Lambert part does not get; an interface takes its place.
    pub coat: Schlick,
    /// Reflectance of coat and metal.
    pub reflection: Schlick,
    /// GGX alpha; a mirror below [`SMOOTH_ALPHA`].
    pub alpha: f64,
    /// Where light passes, in place of coat and metal.
    pub interface: Option<Interface>,
}

/// A scattered direction.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Unit.
    pub wi: DVec3,
    /// BSDF times cosine over the density.
    pub weight: DVec3,
    /// Density that [`Bsdf::density`] gives, 1/sr; `None` for a single direction (mirrors and smooth glass).
    pub density: Option<f64>,
    /// Whether it went through the surface.
    pub is_refracted: bool,
}

/// Unpolarised Fresnel reflectance of a dielectric with the far side's index over the near side's; 1 beyond total reflection.
pub fn fresnel(cos_theta: f64, ior: f64) -> f64 {
    let cos_i = cos_theta.clamp(0.0, 1.0);
    // Not by the sines: at an index of 1 grazing light would be reflected by rounding.
    let cos2_t = (ior * ior - 1.0 + cos_i * cos_i) / (ior * ior);
    if cos2_t <= 0.0 {
        return 1.0;
    }
    let cos_t = cos2_t.sqrt();
    let s = (cos_i - ior * cos_t) / (cos_i + ior * cos_t);
    let p = (ior * cos_i - cos_t) / (ior * cos_i + cos_t);
    0.5 * (s * s + p * p)
}

/// GGX's density of microfacet normals, 1/sr.
fn distribution(cos_h: f64, alpha: f64) -> f64 {
    let a2 = alpha * alpha;
    // cos² a² + sin²: the sine from the cosine keeps its digits in f64 down to alpha = 1e-3.
    let d = cos_h * cos_h * a2 + (1.0 - cos_h * cos_h);
    a2 / (PI * d * d)
}

/// Smith's share of microfacets that is seen.
fn visible_share(cos_theta: f64, alpha: f64) -> f64 {
    let tan2 = (1.0 - cos_theta * cos_theta).max(0.0) / (cos_theta * cos_theta);
    2.0 / (1.0 + (1.0 + alpha * alpha * tan2).sqrt())
}

fn frame(n: DVec3) -> DMat3 {
    let (t, b) = n.any_orthonormal_pair();
    DMat3::from_cols(t, b, n)
}

/// A microfacet normal among those that `wo` sees: stretch, sample the visible half disc, project, unstretch (Heitz 2018).
fn microfacet_normal(n: DVec3, wo: DVec3, alpha: f64, u: [f64; 2]) -> DVec3 {
    let to_scene = frame(n);
    let wo = to_scene.transpose() * wo;
    let v = DVec3::new(alpha * wo.x, alpha * wo.y, wo.z).normalize();
    let across = DVec3::Z.cross(v).try_normalize().unwrap_or(DVec3::X);
    let along = v.cross(across);
    let (r, phi) = (u[0].sqrt(), 2.0 * PI * u[1]);
    let x = r * phi.cos();
    let bent = 0.5 * (1.0 + v.z);
    let y = (1.0 - bent) * (1.0 - x * x).sqrt() + bent * r * phi.sin();
    let z = (1.0 - x * x - y * y).max(0.0).sqrt();
    let h = across * x + along * y + v * z;
    to_scene * DVec3::new(alpha * h.x, alpha * h.y, h.z.max(1e-12)).normalize()
}

fn luminance(c: DVec3) -> f64 {
    c.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

impl Bsdf {
    fn is_smooth(&self) -> bool {
        self.alpha < f64::from(SMOOTH_ALPHA)
    }

    /// Whether some of the light goes in more than single directions.
    pub fn is_spread(&self) -> bool {
        self.albedo.max_element() > 0.0 || (!self.is_smooth() && self.reflects())
    }

    fn is_sharp(&self) -> bool {
        let solid = self.interface.filter(|interface| !interface.is_thin);
        is_sharp(self.alpha, solid.map(|interface| interface.ior))
    }

    fn reflects(&self) -> bool {
        self.interface.is_some() || self.reflection.f90 > 0.0 || self.reflection.f0 != DVec3::ZERO
    }

    /// Reflectance of the microfacets about `h`.
    fn reflectance(&self, cos_h: f64) -> DVec3 {
        match self.interface {
            Some(interface) => DVec3::splat(fresnel(cos_h, interface.ior)),
            None => self.reflection.at(cos_h),
        }
    }

    /// The Lambert part, 1/sr.
    fn lambert(&self, n: DVec3, wo: DVec3, wi: DVec3) -> DVec3 {
        let share = match &self.interface {
            // Light passes twice: alike both ways, and none where all is reflected.
            Some(interface) => {
                let passed = |direction: DVec3| 1.0 - fresnel(direction.dot(n), interface.ior);
                passed(wo) * passed(wi)
            }
            None => 1.0 - self.coat.at(wo.dot((wo + wi).normalize())).max_element(),
        };
        self.albedo * (share / PI)
    }

    /// The half vector of refraction on the eye's side, and its cosines with `wo` and `wi`; `None` where no facet refracts so.
    fn refracting_normal(interface: &Interface, n: DVec3, wo: DVec3, wi: DVec3) -> Option<DVec3> {
        let h = (wo + wi * interface.ior).try_normalize()?;
        let h = if h.dot(n) < 0.0 { -h } else { h };
        (h.dot(wo) > 0.0 && h.dot(wi) < 0.0).then_some(h)
    }

    /// The BSDF without its single directions, 1/sr: radiance towards `wo` per irradiance from `wi`.
    pub fn evaluate(&self, n: DVec3, wo: DVec3, wi: DVec3) -> DVec3 {
        let (cos_o, cos_i) = (n.dot(wo), n.dot(wi));
        if cos_o <= 0.0 || cos_i == 0.0 {
            return DVec3::ZERO;
        }
        let masking = visible_share(cos_o, self.alpha) * visible_share(cos_i.abs(), self.alpha);
        if cos_i > 0.0 {
            let mut f = self.lambert(n, wo, wi);
            if !self.is_smooth() && self.reflects() {
                let h = (wo + wi).normalize();
                let facets = distribution(n.dot(h), self.alpha) * masking;
                f += self.reflectance(wo.dot(h)) * (facets / (4.0 * cos_o * cos_i));
            }
            return f;
        }
        let Some(interface) = self.interface.filter(|i| !i.is_thin && !self.is_smooth()) else {
            return DVec3::ZERO;
        };
        let Some(h) = Self::refracting_normal(&interface, n, wo, wi) else {
            return DVec3::ZERO;
        };
        // Walter et al., equation 21, with the eye's side as the unit of index.
        let (h_o, h_i) = (h.dot(wo), h.dot(wi));
        let bend = (h_o + interface.ior * h_i).powi(2);
        let facets = distribution(n.dot(h), self.alpha) * masking;
        let passed = 1.0 - fresnel(h_o, interface.ior);
        interface.tint * (passed * facets * (h_o * h_i / (cos_o * cos_i)).abs() / bend)
    }

    /// The share of [`Bsdf::evaluate`] that wide lobes have: the Lambert part, and microfacets unless they are sharp.
    pub fn evaluate_wide(&self, n: DVec3, wo: DVec3, wi: DVec3) -> DVec3 {
        if !self.is_sharp() {
            self.evaluate(n, wo, wi)
        } else if n.dot(wo) > 0.0 && n.dot(wi) > 0.0 {
            self.lambert(n, wo, wi)
        } else {
            DVec3::ZERO
        }
    }

    /// Takes a sample of all lobes for one of the wide ones (true) or of the others, by chance and as much as these have of it.
    pub fn part(&self, n: DVec3, wo: DVec3, sample: Sample, random: &mut Random) -> (Sample, bool) {
        if sample.density.is_none() {
            return (sample, false);
        }
        let all = self.evaluate(n, wo, sample.wi);
        let wide = self.evaluate_wide(n, wo, sample.wi);
        // Beyond total reflection all may be nothing.
        let wide_chance = match luminance(all) {
            0.0 => 0.0,
            all => luminance(wide) / all,
        };
        if wide_chance <= 0.0 || wide_chance >= 1.0 {
            return (sample, wide_chance > 0.0);
        }
        let is_wide = random.uniform() < wide_chance;
        let part = match is_wide {
            true => wide / wide_chance,
            false => (all - wide) / (1.0 - wide_chance),
        };
        // A channel that reflects nothing has nothing to part.
        let share = part / all.max(DVec3::splat(f64::MIN_POSITIVE));
        let weight = sample.weight * share;
        (Sample { weight, ..sample }, is_wide)
    }

    /// Probability of following the Lambert part.
    fn lambert_chance(&self, n: DVec3, wo: DVec3) -> f64 {
        let lambert = luminance(self.albedo);
        if lambert <= 0.0 || !self.reflects() {
            return if lambert > 0.0 { 1.0 } else { 0.0 };
        }
        let rest = match &self.interface {
            Some(interface) => 0.2 + luminance(interface.tint),
            None => luminance(self.reflection.at(n.dot(wo))),
        };
        (lambert / (lambert + rest)).clamp(0.1, 0.9)
    }

    /// Probability of reflecting, not refracting, at a microfacet.
    fn reflect_chance(&self, cos_h: f64) -> f64 {
        let Some(interface) = &self.interface else {
            return 1.0;
        };
        let reflected = fresnel(cos_h, interface.ior);
        let all = reflected + (1.0 - reflected) * luminance(interface.tint);
        // Black glass of index 1 does neither.
        if all > 0.0 { reflected / all } else { 1.0 }
    }

    /// Density of [`Bsdf::sample`] without its single directions, 1/sr.
    pub fn density(&self, n: DVec3, wo: DVec3, wi: DVec3) -> f64 {
        let (cos_o, cos_i) = (n.dot(wo), n.dot(wi));
        if cos_o <= 0.0 {
            return 0.0;
        }
        let lambert_chance = self.lambert_chance(n, wo);
        let has_facets = !self.is_smooth() && self.reflects();
        let seen = |h: DVec3| {
            visible_share(cos_o, self.alpha) * distribution(n.dot(h), self.alpha) * wo.dot(h)
                / cos_o
        };
        if cos_i > 0.0 {
            let mut density = lambert_chance * cos_i / PI;
            if has_facets {
                let h = (wo + wi).normalize();
                let cos_h = wo.dot(h);
                density +=
                    (1.0 - lambert_chance) * self.reflect_chance(cos_h) * seen(h) / (4.0 * cos_h);
            }
            return density;
        }
        let Some(interface) = self.interface.filter(|i| !i.is_thin && has_facets) else {
            return 0.0;
        };
        let Some(h) = Self::refracting_normal(&interface, n, wo, wi) else {
            return 0.0;
        };
        let (h_o, h_i) = (h.dot(wo), h.dot(wi));
        let jacobian = interface.ior.powi(2) * h_i.abs() / (h_o + interface.ior * h_i).powi(2);
        (1.0 - lambert_chance) * (1.0 - self.reflect_chance(h_o)) * seen(h) * jacobian
    }

    /// Follows the light: a direction with a density near the BSDF's shape; `None` where it is absorbed.
    pub fn sample(&self, n: DVec3, wo: DVec3, random: &mut Random) -> Option<Sample> {
        let lambert_chance = self.lambert_chance(n, wo);
        if random.uniform() < lambert_chance {
            let [u, v] = random.uniform2();
            let (r, phi) = (u.sqrt(), 2.0 * PI * v);
            let local = DVec3::new(r * phi.cos(), r * phi.sin(), (1.0 - u).sqrt());
            return self.spread_sample(n, wo, frame(n) * local);
        }
        if !self.reflects() {
            return None;
        }
        let h = match self.is_smooth() {
            true => n,
            false => microfacet_normal(n, wo, self.alpha, random.uniform2()),
        };
        let cos_h = wo.dot(h);
        let reflect_chance = self.reflect_chance(cos_h);
        let chance = 1.0 - lambert_chance;
        if random.uniform() < reflect_chance {
            let wi = (2.0 * cos_h * h - wo).normalize();
            if !self.is_smooth() {
                return (n.dot(wi) > 0.0).then(|| self.spread_sample(n, wo, wi))?;
            }
            let weight = self.reflectance(cos_h) / (chance * reflect_chance);
            return Some(Sample {
                wi,
                weight,
                density: None,
                is_refracted: false,
            });
        }
        let interface = self.interface?;
        let chance = chance * (1.0 - reflect_chance);
        let passed = 1.0 - fresnel(cos_h, interface.ior);
        if interface.is_thin {
            let masking = if self.is_smooth() {
                1.0
            } else {
                visible_share(n.dot(wo), self.alpha)
            };
            return Some(Sample {
                wi: -wo,
                weight: interface.tint * (passed * masking / chance),
                density: None,
                is_refracted: true,
            });
        }
        let ior2 = interface.ior * interface.ior;
        let cos_t = ((ior2 - 1.0 + cos_h * cos_h) / ior2).max(0.0).sqrt();
        let wi = (-wo / interface.ior + h * (cos_h / interface.ior - cos_t)).normalize();
        if n.dot(wi) >= 0.0 {
            return None;
        }
        if !self.is_smooth() {
            return self.spread_sample(n, wo, wi);
        }
        // Radiance shrinks with the square of the index, as its cone widens.
        let weight = interface.tint * (passed / (chance * interface.ior * interface.ior));
        Some(Sample {
            wi,
            weight,
            density: None,
            is_refracted: true,
        })
    }

    fn spread_sample(&self, n: DVec3, wo: DVec3, wi: DVec3) -> Option<Sample> {
        let density = self.density(n, wo, wi);
        let weight = self.evaluate(n, wo, wi) * (n.dot(wi).abs() / density);
        (density > 0.0 && weight.is_finite()).then_some(Sample {
            wi,
            weight,
            density: Some(density),
            is_refracted: n.dot(wi) < 0.0,
        })
    }
}
