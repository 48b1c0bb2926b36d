//! How wide the gather over the global map is: from the parameters and the scene's size, before any pass and as passes go by.
//!
//! Source: Knaus and Zwicker, "Progressive Photon Mapping: A Probabilistic Approach", 2011, for the passes.

use crate::params::Params;
use crate::scene::gpu_scene::GpuScene;

/// The widest radius that is made from photon counts, as a share of the scene's diagonal: beyond it nothing but a blur is left.
pub const AUTOMATIC_CAP: f64 = 0.05;
/// The widest radius that can be set, likewise: whatever the receiver, a wider disc holds no more of the scene.
const CAP: f32 = 0.5;
/// The narrowest radius that is made from photon counts, likewise.
const AUTOMATIC_LEAST: f64 = 1e-6;

/// What the radius of a scene is derived from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadiusRule {
    /// Area of the scene's surfaces, m².
    pub area_m2: f64,
    /// Diagonal of its bounds, metres.
    pub diagonal_m: f32,
}

impl RadiusRule {
    /// That of a scene.
    pub fn of(scene: &GpuScene) -> Self {
        Self {
            area_m2: scene.area_m2(),
            diagonal_m: scene.bounds().diagonal_m(),
        }
    }

    /// The radius before any pass, metres: as set, or such that the wanted photons fall into it when all are spread evenly.
    pub fn first_m(&self, params: &Params) -> f32 {
        if params.gather.radius_m > 0.0 {
            return params.gather.radius_m.min(self.cap_m());
        }
        let per_estimate = f64::from(params.gather.photons_per_estimate);
        let photons = f64::from(params.photon.count.max(1));
        let radius_m = (per_estimate * self.area_m2 / (std::f64::consts::PI * photons)).sqrt();
        let least_m = AUTOMATIC_LEAST * f64::from(self.diagonal_m);
        let radius_m = radius_m.max(least_m).max(f64::from(f32::MIN_POSITIVE)) as f32;
        radius_m.min(self.automatic_cap_m())
    }

    /// The widest radius that is made from photon counts, metres.
    pub fn automatic_cap_m(&self) -> f32 {
        ((AUTOMATIC_CAP * f64::from(self.diagonal_m)) as f32).max(f32::MIN_POSITIVE)
    }

    /// Whether `gather.photons_per_estimate` asks for a wider radius than is made from photon counts, so that more of it changes nothing.
    pub fn is_capped(&self, params: &Params) -> bool {
        params.gather.radius_m == 0.0 && self.first_m(params) >= self.automatic_cap_m()
    }

    /// What a user should know of the radius.
    pub fn warning(&self, params: &Params) -> Option<String> {
        let radius_m = params.gather.radius_m;
        (radius_m > self.cap_m()).then(|| {
            format!(
                "gather.radius_m = {radius_m} is wider than the scene: {} m is used",
                self.cap_m()
            )
        })
    }

    /// The widest radius that can be set, metres.
    pub fn cap_m(&self) -> f32 {
        (CAP * self.diagonal_m).max(f32::MIN_POSITIVE)
    }
}

/// Factor on the first radius after `pass` passes: r²(i+1) = r²(i) (i + alpha)/(i + 1), i from 1 (Knaus and Zwicker, equation 15).
pub fn shrink_factor(pass: u32, alpha: f32) -> f32 {
    let squared: f64 = (1..=pass)
        .map(|i| (f64::from(i) + f64::from(alpha)) / (f64::from(i) + 1.0))
        .product();
    squared.sqrt() as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_radius_shrinks_as_the_cube_root_of_the_passes_for_alpha_two_thirds() {
        // r(i)/r(1) ~ i^((alpha - 1)/2) = i^(-1/6)
        let ratio = f64::from(shrink_factor(63_999, 2.0 / 3.0) / shrink_factor(999, 2.0 / 3.0));
        assert!((ratio - 64f64.powf(-1.0 / 6.0)).abs() < 1e-3, "{ratio}");
        assert_eq!(shrink_factor(0, 2.0 / 3.0), 1.0);
    }

    #[test]
    fn photons_per_estimate_widen_the_radius_to_a_twentieth_of_the_diagonal_and_no_further() {
        let rule = RadiusRule {
            area_m2: 24.0,
            diagonal_m: 3.5,
        };
        let with = |photons: u32, per_estimate: f32| {
            let mut params = Params::default();
            params.photon.count = photons;
            params.gather.photons_per_estimate = per_estimate;
            params
        };
        let radius_m = |photons, per_estimate| rule.first_m(&with(photons, per_estimate));
        assert_eq!(radius_m(1000, 40.0), radius_m(1000, 160.0));
        assert!((radius_m(1000, 40.0) - 0.175).abs() < 1e-6);
        assert!(rule.is_capped(&with(1000, 40.0)));
        // With photons enough four times as many an estimate is twice the radius.
        let ratio = radius_m(1_000_000, 40.0) / radius_m(1_000_000, 10.0);
        assert!((ratio - 2.0).abs() < 1e-5, "{ratio}");
        assert!(!rule.is_capped(&with(1_000_000, 40.0)));
        // A radius that is set is held to half the diagonal alone.
        let mut set = with(1000, 40.0);
        set.gather.radius_m = 1.0;
        assert_eq!(rule.first_m(&set), 1.0);
        assert!(!rule.is_capped(&set));
        set.gather.radius_m = 9.0;
        assert_eq!(rule.first_m(&set), 1.75);
    }
}
