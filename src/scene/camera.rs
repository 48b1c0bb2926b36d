//! Perspective cameras.

use std::f32::consts::PI;

use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::node::display_name;
use super::warnings::Warnings;
use crate::view::{Fov, Pose, View};

/// A perspective camera, in scene space at time 0.
#[derive(Clone, Debug)]
pub struct Camera {
    /// Name of the camera (or its node) in the file.
    pub name: String,
    /// Node that carries it, for the animation.
    pub node: usize,
    /// Pose in scene space and vertical field of view; the width follows from the image's aspect (see [`Camera::view`]).
    pub pose: Pose,
    /// Vertical opening angle, radians.
    pub yfov_rad: f32,
}

impl Camera {
    /// The camera's eye for an image of `width` × `height` pixels: yfov fits the height.
    pub fn view(&self, width: u32, height: u32) -> View {
        View {
            pose: self.pose,
            fov: Fov::symmetric(self.yfov_rad, width as f32 / height as f32),
        }
    }

    /// Reads the camera of a node, at its default place; `None` (with a warning) if macula cannot look through it.
    pub(super) fn read(
        camera: &gltf::Camera,
        node: usize,
        node_name: &str,
        warnings: &mut Warnings,
    ) -> Option<Self> {
        let name = display_name("camera", camera.name(), camera.index());
        let gltf::camera::Projection::Perspective(perspective) = camera.projection() else {
            warnings.push(format!("{name} is orthographic; it is left out"));
            return None;
        };
        let yfov_rad = perspective.yfov();
        if !(yfov_rad > 0.0 && yfov_rad < PI) {
            warnings.push(format!(
                "{name} has a vertical field of view outside 0 to 180 degrees; it is left out"
            ));
            return None;
        }
        Some(Self {
            name: camera.name().unwrap_or(node_name).to_owned(),
            node,
            pose: Pose::IDENTITY,
            yfov_rad,
        })
    }

    /// The camera where its node is. Scale and mirror are stripped: it keeps its direction and its upright.
    pub(super) fn placed(&self, scene_from_node: DAffine3) -> Self {
        let orientation = upright(scene_from_node.matrix3);
        Self {
            pose: Pose {
                orientation: orientation.map_or(self.pose.orientation, |q| q.as_quat()),
                position_m: scene_from_node.translation.as_vec3(),
            },
            ..self.clone()
        }
    }
}

/// The rotation that looks along the map's -Z with its +Y as near to up as can be, or `None` if it squashes them.
fn upright(linear: DMat3) -> Option<DQuat> {
    let back = linear.z_axis.try_normalize()?;
    let right = linear.y_axis.cross(back).try_normalize()?;
    let up: DVec3 = back.cross(right);
    Some(DQuat::from_mat3(&DMat3::from_cols(right, up, back)).normalize())
}
