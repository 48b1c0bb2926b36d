//! A scene ready for work: as read, with its hierarchies, and on the device.

use super::Scene;
use super::bvh::SceneCaster;
use super::gpu_scene::GpuScene;
use crate::gpu::{GpuDevice, GpuError};

/// A scene with its hierarchies, on the host and on the device.
pub struct LoadedScene {
    /// As read.
    pub scene: Scene,
    /// For single rays on the host.
    pub caster: SceneCaster,
    /// Uploaded.
    pub on_gpu: GpuScene,
}

impl LoadedScene {
    /// Builds the hierarchies and uploads.
    ///
    /// # Errors
    /// [`GpuError`] when the scene does not fit the device.
    pub fn new(gpu: &GpuDevice, scene: Scene) -> Result<Self, GpuError> {
        let caster = SceneCaster::new(&scene);
        let on_gpu = GpuScene::new(gpu, &scene, &caster, &scene.pose_at(0.0))?;
        Ok(Self {
            scene,
            caster,
            on_gpu,
        })
    }
}
