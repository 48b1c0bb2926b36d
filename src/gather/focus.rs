//! Where an eye looks, as the choice of lights wants to know it.

use super::EyeSettings;
use crate::scene::light_importance::Focus;

impl EyeSettings {
    /// The cone of the fovea.
    pub fn focus(&self) -> Focus {
        Focus {
            scene_from_view: self.scene_from_view,
            fov: self.fov,
            gaze_dir_in_view: self.gaze_dir_in_view,
            radius_rad: self.fovea_radius_rad,
        }
    }
}
