//! One eye's pinhole: where it stands, how wide it sees, and which ray a pixel is.
//!
//! Shared by OpenXR views, glTF cameras and tests, so that there is one convention: the eye looks along -Z, +X is right,
//! +Y is up; image row 0 is the top row.

use glam::{Affine3A, Quat, Vec2, Vec3};

/// Half-angles of an asymmetric field of view, in radians, signed as in `XrFovf`: `left` and `down` are usually negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fov {
    /// Angle to the left edge, radians.
    pub left_rad: f32,
    /// Angle to the right edge, radians.
    pub right_rad: f32,
    /// Angle to the top edge, radians.
    pub up_rad: f32,
    /// Angle to the bottom edge, radians.
    pub down_rad: f32,
}

impl Fov {
    /// A symmetric field of view from its vertical opening angle and the image's width over height (glTF `yfov`, `aspectRatio`).
    pub fn symmetric(vertical_rad: f32, aspect: f32) -> Self {
        let half_width_rad = ((vertical_rad * 0.5).tan() * aspect).atan();
        let half_height_rad = vertical_rad * 0.5;
        Self {
            left_rad: -half_width_rad,
            right_rad: half_width_rad,
            up_rad: half_height_rad,
            down_rad: -half_height_rad,
        }
    }

    /// Whether the angles span a picture: finite, within ±89.9°, and right of left, up of down, by a fifth of an arc second at least.
    pub fn is_valid(&self) -> bool {
        const LIMIT_RAD: f32 = 89.9 * std::f32::consts::PI / 180.0;
        const EXTENT_MIN_RAD: f32 = 1e-6;
        let angles = [self.left_rad, self.right_rad, self.up_rad, self.down_rad];
        angles.iter().all(|a| a.is_finite() && a.abs() <= LIMIT_RAD)
            && self.right_rad - self.left_rad >= EXTENT_MIN_RAD
            && self.up_rad - self.down_rad >= EXTENT_MIN_RAD
    }

    /// The slope (x/-z, y/-z) of the view ray through the image point `uv`, where (0,0) is the top left corner and (1,1) the bottom right.
    pub fn slope_at(&self, uv: Vec2) -> Vec2 {
        let (left, right) = (self.left_rad.tan(), self.right_rad.tan());
        let (up, down) = (self.up_rad.tan(), self.down_rad.tan());
        Vec2::new(left + (right - left) * uv.x, up + (down - up) * uv.y)
    }

    /// Unit direction, in view space, of the ray through the image point `uv` ((0,0) top left, (1,1) bottom right).
    pub fn dir_in_view(&self, uv: Vec2) -> Vec3 {
        let slope = self.slope_at(uv);
        Vec3::new(slope.x, slope.y, -1.0).normalize()
    }

    /// The image point of a direction in view space, or `None` if it points behind the eye. The point may lie outside \[0,1\]².
    pub fn project(&self, dir_in_view: Vec3) -> Option<Vec2> {
        if dir_in_view.z >= -1e-6 || !dir_in_view.is_finite() {
            return None;
        }
        let (x, y) = (
            dir_in_view.x / -dir_in_view.z,
            dir_in_view.y / -dir_in_view.z,
        );
        let (left, right) = (self.left_rad.tan(), self.right_rad.tan());
        let (up, down) = (self.up_rad.tan(), self.down_rad.tan());
        Some(Vec2::new(
            (x - left) / (right - left),
            (y - up) / (down - up),
        ))
    }
}

/// A rigid pose: rotation then translation in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Unit quaternion.
    pub orientation: Quat,
    /// Metres.
    pub position_m: Vec3,
}

impl Pose {
    /// No rotation, at the origin.
    pub const IDENTITY: Self = Self {
        orientation: Quat::IDENTITY,
        position_m: Vec3::ZERO,
    };

    /// The affine map that this pose stands for.
    pub fn to_affine(self) -> Affine3A {
        Affine3A::from_rotation_translation(self.orientation, self.position_m)
    }

    /// `self ∘ inner`: first `inner`, then `self`.
    pub fn compose(self, inner: Pose) -> Pose {
        Pose {
            orientation: (self.orientation * inner.orientation).normalize(),
            position_m: self.position_m + self.orientation * inner.position_m,
        }
    }

    /// The pose that undoes this one.
    pub fn inverse(self) -> Pose {
        let orientation = self.orientation.inverse();
        Pose {
            orientation,
            position_m: -(orientation * self.position_m),
        }
    }
}

/// One eye (or one camera): its pose and its field of view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Pose of the eye in the space that the name of the variable says (`*_from_eye`), metres.
    pub pose: Pose,
    /// Field of view.
    pub fov: Fov,
}

impl View {
    /// Whether there is a picture to draw: a place, an orientation (unit quaternion), and a field of view that spans a picture.
    pub fn is_drawable(&self) -> bool {
        self.pose.position_m.is_finite()
            && self.pose.orientation.is_normalized()
            && self.fov.is_valid()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_view_from_somewhere_of_something_is_drawable() {
        let view = View {
            pose: Pose::IDENTITY,
            fov: Fov::symmetric(1.0, 1.0),
        };
        assert!(view.is_drawable());
        let at = |position_m, orientation, fov| View {
            pose: Pose {
                orientation,
                position_m,
            },
            fov,
        };
        let narrow = Fov {
            right_rad: view.fov.left_rad + 1e-8,
            ..view.fov
        };
        for undrawable in [
            at(Vec3::NAN, Quat::IDENTITY, view.fov),
            at(Vec3::ZERO, Quat::from_array([0.0; 4]), view.fov),
            at(Vec3::ZERO, Quat::IDENTITY * 2.0, view.fov),
            at(Vec3::ZERO, Quat::IDENTITY, narrow),
        ] {
            assert!(!undrawable.is_drawable(), "{undrawable:?}");
        }
    }
}
