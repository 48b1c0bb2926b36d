//! Punctual lights (KHR_lights_punctual), in radiometric units as they stand in the file.

use std::f32::consts::FRAC_PI_2;

use glam::{DAffine3, DVec3, Vec3};
use gltf::khr_lights_punctual::Kind;

use super::node::display_name;
use super::warnings::Warnings;

/// A KHR_lights_punctual light, in scene space at time 0.
#[derive(Clone, Debug)]
pub struct PunctualLight {
    /// Name in the file.
    pub name: String,
    /// Node that carries it, for the animation.
    pub node: usize,
    /// Metres.
    pub position: Vec3,
    /// Unit direction in which a spot or directional light shines.
    pub direction: Vec3,
    /// colour × intensity: W/sr for point and spot, W/m² for directional.
    pub intensity: Vec3,
    /// What shape its light has.
    pub kind: PunctualKind,
    /// Distance beyond which it does not shine, metres; infinite by default.
    pub range_m: f32,
}

/// Shapes of punctual lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PunctualKind {
    /// Uniform in all directions.
    Point,
    /// A cone with the extension's reference falloff between the two half-angles, radians.
    Spot {
        /// Full brightness within, radians.
        inner_cone_rad: f32,
        /// Nothing beyond, radians.
        outer_cone_rad: f32,
    },
    /// Parallel light.
    Directional,
}

impl PunctualKind {
    /// `point`, `spot` or `directional`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Spot { .. } => "spot",
            Self::Directional => "directional",
        }
    }

    /// Unit of [`PunctualLight::intensity`].
    pub fn unit(&self) -> &'static str {
        match self {
            Self::Point | Self::Spot { .. } => "W/sr",
            Self::Directional => "W/m2",
        }
    }
}

/// The strongest that a light or an emissive surface may be, in its unit: sums over lights, solid angles and areas of scenes that are
/// kilometres wide stay within single precision (3e38).
pub(super) const STRONGEST: f32 = 1e30;

impl PunctualLight {
    /// Reads the light of a node, at its default place; `None` (with a warning) if its numbers mean nothing.
    pub(super) fn read(
        light: &gltf::khr_lights_punctual::Light,
        node: usize,
        node_name: &str,
        warnings: &mut Warnings,
    ) -> Option<Self> {
        let name = display_name("light", light.name(), light.index());
        let intensity = Vec3::from_array(light.color()) * light.intensity();
        let is_sensible = Vec3::ZERO.cmple(intensity) & intensity.cmple(Vec3::splat(STRONGEST));
        if !is_sensible.all() {
            warnings.push(format!(
                "{name} has an intensity that is negative or above {STRONGEST:e}; it is left out"
            ));
            return None;
        }
        let kind = match light.kind() {
            Kind::Point => PunctualKind::Point,
            Kind::Directional => PunctualKind::Directional,
            Kind::Spot {
                inner_cone_angle,
                outer_cone_angle,
            } => {
                let outer_cone_rad = outer_cone_angle.clamp(0.0, FRAC_PI_2);
                let inner_cone_rad = inner_cone_angle.clamp(0.0, outer_cone_rad);
                if (inner_cone_rad, outer_cone_rad) != (inner_cone_angle, outer_cone_angle) {
                    warnings.push(format!(
                        "{name} has cone angles beyond 0 <= inner <= outer <= 90 degrees; they are clamped"
                    ));
                }
                PunctualKind::Spot {
                    inner_cone_rad,
                    outer_cone_rad,
                }
            }
        };
        let range_m = light.range().filter(|range| *range > 0.0);
        if range_m.is_some() {
            warnings.push(format!("{name} has a range; its light falls with the square of the distance all the way instead"));
        }
        Some(Self {
            name: light.name().unwrap_or(node_name).to_owned(),
            node,
            position: Vec3::ZERO,
            direction: Vec3::NEG_Z,
            intensity,
            kind,
            range_m: range_m.unwrap_or(f32::INFINITY),
        })
    }

    /// The light where its node is: it shines along the node's -Z, and a scale does not change it.
    pub(super) fn placed(&self, scene_from_node: DAffine3) -> Self {
        let direction = scene_from_node.transform_vector3(DVec3::NEG_Z);
        Self {
            position: scene_from_node.translation.as_vec3(),
            direction: direction.normalize_or(self.direction.as_dvec3()).as_vec3(),
            ..self.clone()
        }
    }
}
