//! Rigid poses, between the API's structures and glam's arithmetic.

use glam::{Quat, Vec3};
use openxr_sys as sys;

/// How far from 1 the length of an application's quaternion may be: the specification asks that 1 % be accepted.
const UNIT_TOLERANCE: f32 = 0.01;

/// A rotation, then a translation in metres: `parent_from_child`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pose {
    pub position: Vec3,
    pub orientation: Quat,
}

impl Pose {
    pub const IDENTITY: Self = Self {
        position: Vec3::ZERO,
        orientation: Quat::IDENTITY,
    };

    pub const fn from_position(position: Vec3) -> Self {
        Self {
            position,
            orientation: Quat::IDENTITY,
        }
    }

    /// `a_from_c` of `self` = `a_from_b` and `b_from_c`.
    pub fn then(self, b_from_c: Self) -> Self {
        Self {
            position: self.transform(b_from_c.position),
            orientation: (self.orientation * b_from_c.orientation).normalize(),
        }
    }

    pub fn inverse(self) -> Self {
        let orientation = self.orientation.inverse();
        Self {
            position: -(orientation * self.position),
            orientation,
        }
    }

    pub fn transform(self, point: Vec3) -> Vec3 {
        self.position + self.orientation * point
    }

    /// Between `self` (0) and `other` (1): lerp of position, slerp of orientation.
    pub fn interpolate(self, other: Self, fraction: f32) -> Self {
        Self {
            position: self.position.lerp(other.position, fraction),
            orientation: self.orientation.slerp(other.orientation, fraction),
        }
    }

    /// The application's pose, or `POSE_INVALID` where it isn't rigid.
    pub fn verified(pose: &sys::Posef) -> crate::XrResult<Self> {
        let sys::Quaternionf { x, y, z, w } = pose.orientation;
        let orientation = Quat::from_xyzw(x, y, z, w);
        let position = vec3(pose.position);
        // a NaN length compares false, so the condition is written to refuse it
        let is_unit = (orientation.length() - 1.0).abs() <= UNIT_TOLERANCE;
        if !is_unit || !position.is_finite() {
            return Err(sys::Result::ERROR_POSE_INVALID);
        }
        Ok(Self {
            position,
            orientation: orientation.normalize(),
        })
    }
}

impl From<Pose> for sys::Posef {
    fn from(pose: Pose) -> Self {
        let [x, y, z, w] = pose.orientation.to_array();
        Self {
            orientation: sys::Quaternionf { x, y, z, w },
            position: vector3f(pose.position),
        }
    }
}

pub(crate) fn vec3(v: sys::Vector3f) -> Vec3 {
    Vec3::new(v.x, v.y, v.z)
}

pub(crate) fn vector3f(v: Vec3) -> sys::Vector3f {
    sys::Vector3f {
        x: v.x,
        y: v.y,
        z: v.z,
    }
}
