//! From one gaze ray between the eyes to a direction for each eye.
//!
//! The combined gaze ray starts between the eyes, so that an eye that used its direction would be off by up to 3.6° at half a
//! metre (63 mm between the eyes). So the ray is cut with the scene, and each eye aims at the point of the cut.

use glam::Vec3;

use crate::view::Pose;

/// How far away the wearer is taken to look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FixationParams {
    /// Distance where the gaze meets nothing, metres; 0.1 to 1000. Default 2: at 2 m and beyond the eyes differ by less than 1.8°.
    pub default_distance_m: f32,
    /// Nearest distance that a wearer can look at, metres; 0.01 to 1. Default 0.1: the near point of a young eye.
    pub min_distance_m: f32,
}

impl Default for FixationParams {
    fn default() -> Self {
        Self {
            default_distance_m: 2.0,
            min_distance_m: 0.1,
        }
    }
}

/// The point that is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fixation {
    /// The point, metres, in the space of the gaze ray.
    pub point_m: Vec3,
    /// Its distance from the ray's origin, metres.
    pub distance_m: f32,
    /// Whether the scene is there, or only the default distance.
    pub on_scene: bool,
}

impl Fixation {
    /// The fixation point of a gaze ray (`origin_m`, unit `dir`, both in one space, VIEW or the scene's) that meets the scene
    /// at `hit_distance_m`. `None`, a distance that is not finite and one that is not positive are no hit.
    pub fn of_ray(
        origin_m: Vec3,
        dir: Vec3,
        hit_distance_m: Option<f32>,
        params: &FixationParams,
    ) -> Self {
        let hit_distance_m =
            hit_distance_m.filter(|distance| distance.is_finite() && *distance > 0.0);
        let distance_m = hit_distance_m
            .unwrap_or(params.default_distance_m)
            .max(params.min_distance_m);
        Self {
            point_m: origin_m + distance_m * dir,
            distance_m,
            on_scene: hit_distance_m.is_some(),
        }
    }

    /// Unit direction, in the eye's own view space, from an eye towards the fixation point. `space_from_eye` is the eye's pose
    /// in the space of the fixation point. `None` if the point lies in the eye itself.
    pub fn gaze_dir_in_eye(&self, space_from_eye: Pose) -> Option<Vec3> {
        let to_point_m = self.point_m - space_from_eye.position_m;
        // Scaled first, so that a point far away survives the turn and the squaring.
        let dir = to_point_m / to_point_m.abs().max_element();
        (space_from_eye.orientation.inverse() * dir).try_normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fovea::eccentricity_rad;
    use glam::Quat;

    #[test]
    fn a_point_as_far_as_f32_reaches_has_a_direction() {
        let fixation = ahead(Some(f32::MAX));
        let tilted = Pose {
            orientation: Quat::from_rotation_x(0.3),
            ..Pose::IDENTITY
        };
        let dir = fixation.gaze_dir_in_eye(tilted).unwrap();
        assert!(eccentricity_rad(dir, tilted.orientation.inverse() * Vec3::NEG_Z) < 1e-6);
    }

    fn eye(x_m: f32) -> Pose {
        Pose {
            position_m: Vec3::new(x_m, 0.0, 0.0),
            ..Pose::IDENTITY
        }
    }

    fn ahead(hit_distance_m: Option<f32>) -> Fixation {
        Fixation::of_ray(
            Vec3::ZERO,
            Vec3::NEG_Z,
            hit_distance_m,
            &FixationParams::default(),
        )
    }

    #[test]
    fn each_eye_aims_at_the_point_and_the_parallax_at_half_a_metre_is_three_and_a_half_degrees() {
        let near = ahead(Some(0.5));
        let [left, right] = [-0.0315, 0.0315].map(|x| near.gaze_dir_in_eye(eye(x)).unwrap());
        assert!(left.x > 0.0 && right.x < 0.0, "the eyes converge");
        let parallax_deg = eccentricity_rad(left, Vec3::NEG_Z).to_degrees();
        assert!((parallax_deg - 3.6).abs() < 0.05, "{parallax_deg}");
    }

    #[test]
    fn both_spaces_give_the_same_directions() {
        let local_from_head = Pose {
            orientation: Quat::from_rotation_y(0.7) * Quat::from_rotation_x(-0.2),
            position_m: Vec3::new(3.0, 1.6, -2.0),
        };
        let dir = Vec3::new(0.2, -0.1, -1.0).normalize();
        let params = FixationParams::default();
        let in_head = Fixation::of_ray(Vec3::ZERO, dir, Some(1.5), &params);
        let in_local = Fixation::of_ray(
            local_from_head.position_m,
            local_from_head.orientation * dir,
            Some(1.5),
            &params,
        );
        let from_head = in_head.gaze_dir_in_eye(eye(0.03)).unwrap();
        let from_local = in_local
            .gaze_dir_in_eye(local_from_head.compose(eye(0.03)))
            .unwrap();
        assert!(from_head.distance(from_local) < 1e-5);
    }

    #[test]
    fn without_a_hit_the_default_distance_stands_in() {
        for miss in [
            None,
            Some(f32::NAN),
            Some(f32::INFINITY),
            Some(-1.0),
            Some(0.0),
        ] {
            let fixation = ahead(miss);
            assert_eq!(
                (fixation.distance_m, fixation.on_scene),
                (2.0, false),
                "{miss:?}"
            );
        }
        assert_eq!(
            ahead(Some(1e-4)).distance_m,
            0.1,
            "nobody looks at a point in front of the cornea"
        );
        assert_eq!(
            ahead(Some(2.0)).gaze_dir_in_eye(Pose {
                position_m: Vec3::new(0.0, 0.0, -2.0),
                ..Pose::IDENTITY
            }),
            None
        );
    }
}
