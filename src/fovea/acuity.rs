//! What the eye resolves away from the gaze: the minimum angle of resolution grows linearly with eccentricity.
//!
//! Guenter, Finch, Drucker, Tan and Snyder, "Foveated 3D Graphics", ACM Transactions on Graphics 31(6), 2012, section 4.

/// The linear model w(e) = w0 + m e.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Acuity {
    /// w0, the smallest angle that is resolved at the gaze, radians. Default 1/48 degree (Guenter et al.).
    pub resolved_at_gaze_rad: f32,
    /// m, by how much it grows per radian of eccentricity; 0.022 (careful) to 0.0275 (bold) in Guenter et al. Default 0.022.
    pub slope: f32,
}

impl Default for Acuity {
    fn default() -> Self {
        Self {
            resolved_at_gaze_rad: (1.0_f32 / 48.0).to_radians(),
            slope: 0.022,
        }
    }
}

impl Acuity {
    /// The smallest angle that is resolved at an eccentricity, both in radians.
    pub fn resolved_angle_rad(&self, eccentricity_rad: f32) -> f32 {
        self.resolved_at_gaze_rad + self.slope * eccentricity_rad
    }

    /// Acuity relative to the gaze, 1 there and falling towards 0: the share of the linear resolution that is still seen.
    pub fn relative(&self, eccentricity_rad: f32) -> f32 {
        self.resolved_at_gaze_rad / self.resolved_angle_rad(eccentricity_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_constants_are_those_of_the_paper() {
        let acuity = Acuity::default();
        assert!((acuity.resolved_angle_rad(0.0).to_degrees() - 1.0 / 48.0).abs() < 1e-6);
        let at_20_deg = acuity.resolved_angle_rad(20_f32.to_radians()).to_degrees();
        assert!((at_20_deg - (1.0 / 48.0 + 0.022 * 20.0)).abs() < 1e-5);
    }

    #[test]
    fn acuity_only_falls() {
        let acuity = Acuity::default();
        assert_eq!(acuity.relative(0.0), 1.0);
        let samples = (0..90).map(|deg| acuity.relative((deg as f32).to_radians()));
        assert!(
            samples
                .clone()
                .zip(samples.skip(1))
                .all(|(near, far)| near > far && far > 0.0)
        );
    }
}
