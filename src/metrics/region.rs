//! Which region of the retina each pixel falls on, by true eccentricity: the angle between the pixel's ray and the gaze, whatever the lens
//! or the asymmetry of the view.

use glam::{DVec3, Vec2};
use serde::Serialize;

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

/// The angle between a ray and the gaze, in radians: atan2(|r x g|, r . g), exact at 0 and beyond 90 degrees, whatever their lengths.
pub fn eccentricity_rad(ray: DVec3, gaze: DVec3) -> f64 {
    ray.cross(gaze).length().atan2(ray.dot(gaze))
}

/// The angle of every pixel's centre from the gaze, in radians, row by row.
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
        eccentricity_rad(fov.dir_in_view(uv).as_dvec3(), gaze_dir_in_view)
    };
    (0..width * height).map(angle).collect()
}

/// How an eye saw its picture, and where it looked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EyeView {
    /// The picture's field of view.
    pub fov: Fov,
    /// Direction of the gaze in the eye's view space; need not be of unit length.
    pub gaze_dir_in_view: DVec3,
}

/// One value for the whole picture and one for each region; a region without a pixel has none.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ByRegion<T> {
    /// All pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub whole: Option<T>,
    /// Pixels within the fovea's eccentricity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fovea: Option<T>,
    /// Pixels between the fovea's and the transition's eccentricity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub transition: Option<T>,
    /// Pixels beyond.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub periphery: Option<T>,
}

impl<T> ByRegion<T> {
    /// What `value` makes of the numbers (of pixels, or of whatever `region` knows the region of) below `count`: of all, and of each
    /// region's, where `region` tells it.
    pub fn of(
        count: usize,
        region: impl Fn(usize) -> Option<Region>,
        value: impl Fn(&[usize]) -> Option<T>,
    ) -> Self {
        let within = |wanted: Region| -> Option<T> {
            let inside = |&number: &usize| region(number) == Some(wanted);
            value(&Vec::from_iter((0..count).filter(inside)))
        };
        Self {
            whole: value(&Vec::from_iter(0..count)),
            fovea: within(Region::Fovea),
            transition: within(Region::Transition),
            periphery: within(Region::Periphery),
        }
    }

    /// What `value` makes of the values that many have for the whole and for each region, e.g. their mean.
    pub fn combine<U>(many: &[ByRegion<U>], value: impl Fn(&[U]) -> Option<T>) -> Self
    where
        U: Clone,
    {
        let each = |part: fn(&ByRegion<U>) -> &Option<U>| {
            value(&Vec::from_iter(
                many.iter().filter_map(|one| part(one).clone()),
            ))
        };
        Self {
            whole: each(|one| &one.whole),
            fovea: each(|one| &one.fovea),
            transition: each(|one| &one.transition),
            periphery: each(|one| &one.periphery),
        }
    }

    /// Both values of the whole and of each region put together, where there is either.
    pub fn zip<U, V>(
        self,
        other: ByRegion<U>,
        together: impl Fn(Option<T>, Option<U>) -> V,
    ) -> ByRegion<V> {
        let each = |one: Option<T>, other: Option<U>| {
            (one.is_some() || other.is_some()).then(|| together(one, other))
        };
        ByRegion {
            whole: each(self.whole, other.whole),
            fovea: each(self.fovea, other.fovea),
            transition: each(self.transition, other.transition),
            periphery: each(self.periphery, other.periphery),
        }
    }

    /// The values with their names.
    pub fn named(&self) -> impl Iterator<Item = (&'static str, &T)> {
        let all = [
            ("whole", &self.whole),
            ("fovea", &self.fovea),
            ("transition", &self.transition),
            ("periphery", &self.periphery),
        ];
        all.into_iter()
            .filter_map(|(name, value)| Some((name, value.as_ref()?)))
    }
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
