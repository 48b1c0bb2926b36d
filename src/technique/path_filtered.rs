//! Path tracing on the GPU with next-event estimation and an edge-avoiding filter: what a person would pick who has no photons.
//!
//! Source: Kajiya, "The Rendering Equation", 1986; Dammertz et al., 2010, for the filter (`gather/filter.rs`).

use super::{FrameSettings, Start, Statistics, Technique};
use crate::gather::{EyeImage, EyePass, EyeSettings, LightPass, eye_pass, filter, light_pass};
use crate::gpu::pass::Recorder;
use crate::gpu::{GpuDevice, GpuError};
use crate::params::Params;
use crate::scene::effects::Effects;

/// Which passes a scene's effects call for.
struct Plan {
    direct_light: bool,
    paths: bool,
}

impl Plan {
    fn of(effects: &Effects, params: &Params) -> Self {
        let is_lit = effects.area_light || effects.has_delta_lights();
        Self {
            direct_light: is_lit,
            paths: is_lit && (effects.indirect || effects.caustics) && has_paths(params),
        }
    }
}

/// Whether any region gets paths.
fn has_paths(params: &Params) -> bool {
    let indirect = &params.indirect;
    indirect.paths + indirect.transition_paths + indirect.periphery_paths > 0
}

/// Names of the passes, in order.
pub fn passes(effects: &Effects, params: &Params) -> Vec<&'static str> {
    let plan = Plan::of(effects, params);
    [
        (true, eye_pass::VISIBLE_POINTS),
        (plan.direct_light, light_pass::DIRECT_LIGHT),
        (plan.paths, light_pass::PATH_LIGHT),
        (plan.paths && params.filter.path_levels > 0, filter::FILTER),
        (true, eye_pass::RESOLVE),
    ]
    .into_iter()
    .filter_map(|(runs, name)| runs.then_some(name))
    .collect()
}

/// `path-filtered`.
pub struct FilteredPaths {
    eyes: EyePass,
}

impl FilteredPaths {
    /// Prepares the technique.
    ///
    /// # Errors
    /// [`GpuError`] when a buffer can't be made.
    pub fn start<'s>(start: &Start<'s, '_>) -> Result<Box<dyn Technique + 's>, GpuError> {
        let params = start.params;
        let plan = Plan::of(&start.effects, params);
        let mut light = Vec::new();
        if plan.direct_light {
            light.push(LightPass::shadow_rays());
        }
        let mut filter_levels = 0;
        if plan.paths {
            light.push(LightPass::paths());
            filter_levels = params.filter.path_levels;
        }
        let constants = start.shader_constants();
        let eyes = EyePass::new(&start.eyes(&light, filter_levels), &constants)?;
        Ok(Box::new(Self { eyes }))
    }
}

impl Technique for FilteredPaths {
    fn prepare(
        &mut self,
        _recorder: &mut Recorder<'_>,
        _frame: &FrameSettings<'_>,
    ) -> Result<(), GpuError> {
        Ok(())
    }

    fn shade(
        &mut self,
        recorder: &mut Recorder<'_>,
        eye: &EyeSettings,
        image: &EyeImage,
    ) -> Result<(), GpuError> {
        self.eyes.record(recorder, eye, image)
    }

    fn has_independent_passes(&self) -> bool {
        true
    }

    fn statistics(&self, _gpu: &GpuDevice) -> Result<Statistics, GpuError> {
        Ok(Statistics::default())
    }
}
