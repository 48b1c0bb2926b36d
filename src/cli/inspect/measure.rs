//! `inspect --measure`: what each effect costs in a frame, or would cost.

use std::sync::atomic::Ordering;

use crate::cli::common::ImageSize;
use crate::cli::output::interrupt_flag;
use crate::cli::progress::Progress;
use crate::cli::{CliError, Globals, common};
use crate::effect_cost::{EffectCosts, Subject};
use crate::gather::EyeSettings;
use crate::params::Params;
use crate::scene::Scene;
use crate::scene::loaded::LoadedScene;
use crate::technique::{self, TechniqueEntry};

/// By how much a software device's picture is less wide and high than the default one: a frame then takes a fraction of a second.
const SOFTWARE_SCALE: u32 = 8;

/// Times frames with and without each effect.
///
/// # Errors
/// A scene without a camera, or a failing device.
pub fn effect_costs(
    scene: Scene,
    params: &Params,
    entry: &TechniqueEntry,
    globals: &Globals,
) -> Result<EffectCosts, CliError> {
    let Some(camera) = scene.cameras.first() else {
        let mend = "the scene has no camera to measure from; add one to the file";
        return Err(CliError::new(mend));
    };
    let interrupted = interrupt_flag()?;
    let gpu = common::headless_device(globals)?;
    let scale = match gpu.info.device_type {
        wgpu::DeviceType::Cpu => SOFTWARE_SCALE,
        _ => 1,
    };
    let ImageSize { width, height } = common::DEFAULT_SIZE;
    let size = (width / scale, height / scale);
    // As many photons for each pixel as in the default picture.
    let mut params = params.clone();
    params.photon.count /= scale * scale;
    let params = &params;
    let eye = EyeSettings::new(params, camera.view(size.0, size.1), None);
    let own = technique::effects(&scene, params);
    let loaded = LoadedScene::new(&gpu, scene)?;
    let subject = Subject {
        gpu: &gpu,
        scene: &loaded,
        params,
        technique: entry,
        eye,
        size,
    };
    let progress = Progress::new("measuring", own.named().count() as u64, "effects");
    let costs = subject.price(own, &mut || {
        progress.advance(1);
        !interrupted.load(Ordering::SeqCst)
    })?;
    Ok(costs)
}
