//! `inspect --measure`: what each effect costs in a frame, or would cost.

use std::sync::atomic::Ordering;

use crate::cli::output::interrupt_flag;
use crate::cli::progress::Progress;
use crate::cli::{CliError, Globals, common};
use crate::effect_cost::{EffectCost, Subject};
use crate::gather::EyeSettings;
use crate::params::Params;
use crate::scene::Scene;
use crate::scene::loaded::LoadedScene;
use crate::technique::{self, TechniqueEntry};

/// Pixels of the picture that is timed, across and down: large enough that the passes outweigh their starts.
const SIZE: (u32, u32) = (128, 128);

/// Times frames with and without each effect.
///
/// # Errors
/// A scene without a camera, or a failing device.
pub fn effect_costs(
    scene: Scene,
    params: &Params,
    entry: &TechniqueEntry,
    globals: &Globals,
) -> Result<Vec<EffectCost>, CliError> {
    let Some(camera) = scene.cameras.first() else {
        let mend = "the scene has no camera to measure from; add one to the file";
        return Err(CliError::new(mend));
    };
    let eye = EyeSettings::new(params, camera.view(SIZE.0, SIZE.1), None);
    let interrupted = interrupt_flag()?;
    let gpu = common::headless_device(globals)?;
    let own = technique::effects(&scene, params);
    let loaded = LoadedScene::new(&gpu, scene)?;
    let subject = Subject {
        gpu: &gpu,
        scene: &loaded,
        params,
        technique: entry,
        eye,
        size: SIZE,
    };
    let progress = Progress::new("measuring", own.named().count() as u64, "effects");
    let costs = subject.price(own, &mut || {
        progress.advance(1);
        !interrupted.load(Ordering::SeqCst)
    })?;
    Ok(costs)
}
