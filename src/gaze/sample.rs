//! One sample of an eye tracker.

use glam::{Quat, Vec3};

/// A vector whose squared length is this close to 1 is a unit vector: what is left of one after rounding to six decimals.
const UNIT_TOLERANCE: f32 = 4e-6;

/// `vector` as a unit vector: unchanged if it is one already (so that a file reads back bit for bit), normalised if it has
/// a direction, `None` if it is zero or not finite.
pub(crate) fn unit(vector: Vec3) -> Option<Vec3> {
    if (vector.length_squared() - 1.0).abs() <= UNIT_TOLERANCE {
        return Some(vector);
    }
    // Scaled first, so that huge and tiny vectors survive the squaring.
    let scale = vector.abs().max_element();
    if !vector.is_finite() || scale < f32::MIN_POSITIVE {
        return None;
    }
    Some((vector / scale).normalize())
}

/// `rotation` as a unit quaternion, as [`unit`] does it for vectors.
pub(crate) fn unit_rotation(rotation: Quat) -> Option<Quat> {
    if (rotation.length_squared() - 1.0).abs() <= UNIT_TOLERANCE {
        return Some(rotation);
    }
    let length = rotation.length();
    (length.is_normal() && rotation.is_finite()).then(|| rotation / length)
}

/// A gaze ray in VIEW (head) space. Always finite, its direction always a unit vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GazeRay {
    origin_m: Vec3,
    dir: Vec3,
}

impl GazeRay {
    /// Straight ahead from the middle between the eyes.
    pub const FORWARD: Self = Self {
        origin_m: Vec3::ZERO,
        dir: Vec3::NEG_Z,
    };

    /// A ray from `origin_m` (metres, VIEW space) along `dir`, or `None` if either is not finite or `dir` is zero.
    pub fn new(origin_m: Vec3, dir: Vec3) -> Option<Self> {
        let dir = unit(dir)?;
        origin_m.is_finite().then_some(Self { origin_m, dir })
    }

    /// A ray from the middle between the eyes, `azimuth_rad` to the right and `elevation_rad` up of straight ahead
    /// (longitude and latitude); `None` if either is not finite.
    pub fn from_angles(azimuth_rad: f32, elevation_rad: f32) -> Option<Self> {
        let (sin_azimuth, cos_azimuth) = azimuth_rad.sin_cos();
        let (sin_elevation, cos_elevation) = elevation_rad.sin_cos();
        let dir = Vec3::new(
            sin_azimuth * cos_elevation,
            sin_elevation,
            -cos_azimuth * cos_elevation,
        );
        Self::new(Vec3::ZERO, dir)
    }

    /// Where the ray starts, metres in VIEW space.
    pub fn origin_m(&self) -> Vec3 {
        self.origin_m
    }

    /// Unit direction in VIEW space.
    pub fn dir(&self) -> Vec3 {
        self.dir
    }

    /// Whether the ray leads forward out of the head, where a picture can be.
    pub fn is_ahead(&self) -> bool {
        self.dir.z < 0.0
    }

    /// The same ray with another direction; unchanged if `dir` is none.
    pub(crate) fn with_dir(self, dir: Vec3) -> Self {
        Self::new(self.origin_m, dir).unwrap_or(self)
    }
}

/// What the tracker says about one eye.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EyeSample {
    /// The eye's own gaze ray in VIEW space; `None` where the tracker calls it invalid.
    pub ray: Option<GazeRay>,
    /// Lid openness, 0 (shut) to 1 (open).
    pub openness: Option<f32>,
    /// Pupil diameter, millimetres.
    pub pupil_mm: Option<f32>,
}

/// One sample: both eyes together, and each.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GazeSample {
    /// When the eyes were seen, nanoseconds of `XrTime`.
    pub time_ns: i64,
    /// When the application got the sample, nanoseconds of `XrTime`.
    pub recv_ns: Option<i64>,
    /// The combined gaze ray in VIEW space; `None` during blinks and loss of tracking.
    pub combined: Option<GazeRay>,
    /// The tracker's own confidence, 0 to 1.
    pub confidence: Option<f32>,
    /// Left eye, right eye.
    pub eyes: [EyeSample; 2],
}

impl GazeSample {
    /// A sample that holds only a combined ray, as `XR_EXT_eye_gaze_interaction` gives it (`None`: not tracked).
    pub fn combined(time_ns: i64, ray: Option<GazeRay>) -> Self {
        Self {
            time_ns,
            combined: ray,
            ..Self::default()
        }
    }

    /// Openness of the lid that is further shut, if the tracker tells any.
    pub fn min_openness(&self) -> Option<f32> {
        self.eyes
            .iter()
            .filter_map(|eye| eye.openness)
            .min_by(f32::total_cmp)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_ray_without_a_direction_is_refused() {
        for dir in [Vec3::ZERO, Vec3::NAN, Vec3::new(f32::INFINITY, 0.0, -1.0)] {
            assert_eq!(GazeRay::new(Vec3::ZERO, dir), None, "{dir}");
        }
        assert_eq!(GazeRay::new(Vec3::NAN, Vec3::NEG_Z), None);
        assert_eq!(GazeRay::from_angles(f32::NAN, 0.0), None);
    }

    #[test]
    fn angles_lead_right_and_up() {
        let ray = GazeRay::from_angles(0.3, 0.2).unwrap();
        assert!(ray.dir().x > 0.0 && ray.dir().y > 0.0 && ray.is_ahead());
        assert!((ray.dir().y.asin() - 0.2).abs() < 1e-6);
    }

    proptest! {
        #[test]
        fn every_finite_direction_becomes_a_unit_vector(x: f32, y: f32, z: f32) {
            if let Some(ray) = GazeRay::new(Vec3::ZERO, Vec3::new(x, y, z)) {
                prop_assert!((ray.dir().length() - 1.0).abs() < 1e-5);
            }
        }
    }
}
