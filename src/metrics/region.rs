//! Which region of the retina each pixel falls on, by true eccentricity: the angle between the pixel's ray and the gaze, whatever the lens
//! or the asymmetry of the view.

use glam::{DVec3, Vec2};

use crate::view::Fov;

/// A region of the picture by eccentricity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Region {
    /// At most the fovea's limit.
    Fovea,
    /// Beyond it, at most the transition's limit.
    Transition,
    /// Beyond that.
    Periphery,
}

/// Where the regions end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EccentricityLimits {
    /// The fovea's limit, radians.
    pub fovea_rad: f64,
    /// The transition's limit, radians.
    pub transition_rad: f64,
}

impl EccentricityLimits {
    /// The region of an eccentricity.
    pub fn region(&self, eccentricity_rad: f64) -> Region {
        if eccentricity_rad <= self.fovea_rad {
            Region::Fovea
        } else if eccentricity_rad <= self.transition_rad {
            Region::Transition
        } else {
            Region::Periphery
        }
    }
}

/// The angle of every pixel's centre from the gaze, in radians, row by row: atan2(|r x g|, r . g), exact at 0 and beyond 90 degrees.
/// `gaze_dir_in_view` need not be of unit length.
pub fn eccentricities_rad(
    fov: Fov,
    width: usize,
    height: usize,
    gaze_dir_in_view: DVec3,
) -> Vec<f64> {
    let angle = |pixel: usize| {
        let center = Vec2::new((pixel % width) as f32 + 0.5, (pixel / width) as f32 + 0.5);
        let uv = center / Vec2::new(width as f32, height as f32);
        let ray = fov.dir_in_view(uv).as_dvec3();
        ray.cross(gaze_dir_in_view)
            .length()
            .atan2(ray.dot(gaze_dir_in_view))
    };
    (0..width * height).map(angle).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eccentricity_is_zero_at_the_gaze_and_the_angle_elsewhere() {
        let fov = Fov::symmetric(90_f32.to_radians(), 1.0);
        let forward = eccentricities_rad(fov, 101, 101, DVec3::NEG_Z);
        assert!(forward[50 * 101 + 50] < 1e-6);
        // The centre of the last pixel of the middle row has the slope 100/101.
        let expected = (100.0_f64 / 101.0).atan();
        assert!((forward[50 * 101 + 100] - expected).abs() < 1e-6);
        assert!((forward[50 * 101] - expected).abs() < 1e-6);
        let aside = eccentricities_rad(fov, 101, 101, DVec3::new(2.0, 0.0, -2.0));
        assert!(aside[50 * 101 + 100] < 0.01 && aside[50 * 101] > 1.5);
    }

    #[test]
    fn a_gaze_behind_the_eye_is_far_from_every_pixel() {
        let fov = Fov::symmetric(60_f32.to_radians(), 1.0);
        let behind = eccentricities_rad(fov, 8, 8, DVec3::Z);
        assert!(behind.iter().all(|&angle| angle > 2.0));
    }

    #[test]
    fn limits_belong_to_the_inner_region() {
        let limits = EccentricityLimits {
            fovea_rad: 0.1,
            transition_rad: 0.2,
        };
        assert_eq!(limits.region(0.1), Region::Fovea);
        assert_eq!(limits.region(0.100_001), Region::Transition);
        assert_eq!(limits.region(0.2), Region::Transition);
        assert_eq!(limits.region(0.3), Region::Periphery);
    }
}
