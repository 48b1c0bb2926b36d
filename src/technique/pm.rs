//! Plain photon mapping: a fresh map each frame, gathered at visible points. The baseline of all that follows the eye.
//!
//! Source: Jensen, "Global Illumination using Photon Maps", 1996; over several passes, Knaus and Zwicker, "Progressive Photon
//! Mapping: A Probabilistic Approach", 2011 (`radius.rs`).

use super::radius::{RadiusRule, shrink_factor};
use super::{FrameSettings, Start, Statistics, Technique, photon_warnings};
use crate::gather::{EyeImage, EyePass, EyeSettings, LightPass, eye_pass, filter, light_pass};
use crate::gpu::layout::PhotonCounters;
use crate::gpu::pass::Recorder;
use crate::gpu::{GpuDevice, GpuError};
use crate::params::Params;
use crate::photon::{MapSettings, PhotonClass, PhotonMap, PhotonTracer, TraceSettings, map, trace};
use crate::scene::effects::Effects;

/// Where light that comes straight from a lamp is taken from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DirectLight {
    /// Photons, like all other light.
    Photons,
    /// Shadow rays.
    ShadowRays,
}

/// Which passes a scene's effects call for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Shadow rays: for all light straight from the lamps, or only for the sharp highlights of those without extent.
    pub direct_light: bool,
    /// Photons: traced, sorted and gathered.
    pub photons: bool,
    /// A class of photons for caustics.
    pub caustics: bool,
    /// The filter over what photons of the other class bring.
    pub filter: bool,
}

impl Plan {
    /// What a frame needs.
    pub fn of(direct: DirectLight, effects: &Effects, params: &Params) -> Self {
        let is_lit = effects.area_light || effects.has_delta_lights();
        let has_sharp_highlights =
            effects.has_delta_lights() && effects.has_chains() && effects.glossy;
        let photons = params.photon.count > 0
            && match direct {
                DirectLight::Photons => is_lit,
                DirectLight::ShadowRays => is_lit && (effects.indirect || effects.caustics),
            };
        Self {
            direct_light: has_sharp_highlights || (is_lit && direct == DirectLight::ShadowRays),
            photons,
            caustics: photons && effects.caustics,
            filter: photons && params.filter.photon_levels > 0,
        }
    }

    /// Names of the passes, in order.
    pub fn passes(&self) -> Vec<&'static str> {
        [
            (self.photons, trace::TRACING),
            (self.photons, map::SORTING),
            (true, eye_pass::VISIBLE_POINTS),
            (self.direct_light, light_pass::DIRECT_LIGHT),
            (self.photons, light_pass::estimate_of(PhotonClass::Global)),
            (self.caustics, light_pass::estimate_of(PhotonClass::Caustic)),
            (self.filter, filter::FILTER),
            (true, eye_pass::RESOLVE),
        ]
        .into_iter()
        .filter_map(|(runs, name)| runs.then_some(name))
        .collect()
    }
}

/// `pm` and `pm-direct`.
pub struct PhotonMapping {
    photons: Option<(PhotonTracer, PhotonMap)>,
    eyes: EyePass,
    params: Params,
    radius: RadiusRule,
    radius_m: f32,
}

impl PhotonMapping {
    /// Prepares the technique.
    ///
    /// # Errors
    /// [`GpuError`] when a buffer can't be made.
    pub fn start<'s>(
        start: &Start<'s, '_>,
        direct: DirectLight,
    ) -> Result<Box<dyn Technique + 's>, GpuError> {
        let &Start {
            gpu,
            on_gpu: scene,
            params,
            ..
        } = start;
        let plan = Plan::of(direct, &start.effects, params);
        let by_photons = direct == DirectLight::Photons;
        let flag = |on: bool| f64::from(u8::from(on));
        let mut constants = start.shader_constants();
        constants.extend([
            ("STORE_DIRECT", flag(by_photons)),
            ("DIRECT_TO_GATHERED", flag(!by_photons)),
            ("HAS_CAUSTICS", flag(plan.caustics)),
        ]);
        let photons = match plan.photons {
            false => None,
            true => {
                let tracer = PhotonTracer::new(gpu, scene, params, &constants)?;
                let map = PhotonMap::new(gpu, tracer.store(), scene.bounds())?;
                Some((tracer, map))
            }
        };
        let mut light = Vec::new();
        if plan.direct_light {
            light.push(LightPass::shadow_rays());
        }
        if let Some((tracer, map)) = &photons {
            let classes = map.classes().iter();
            light.extend(classes.map(|class| LightPass::photons(tracer.store(), map, *class)));
        }
        let levels = match plan.filter {
            true => params.filter.photon_levels,
            false => 0,
        };
        let eyes = EyePass::new(&start.eyes(&light, levels), &constants)?;
        let radius = RadiusRule::of(scene);
        Ok(Box::new(Self {
            photons,
            eyes,
            params: params.clone(),
            radius,
            radius_m: radius.first_m(params),
        }))
    }
}

impl Technique for PhotonMapping {
    fn prepare(
        &mut self,
        recorder: &mut Recorder<'_>,
        frame: &FrameSettings<'_>,
    ) -> Result<(), GpuError> {
        let params = &self.params;
        let shrink = shrink_factor(frame.pass, params.gather.radius_alpha);
        self.radius_m = self.radius.first_m(params) * shrink;
        let Some((tracer, map)) = &mut self.photons else {
            return Ok(());
        };
        let scale_max = params
            .fovea
            .transition_radius_scale
            .max(params.fovea.periphery_radius_scale);
        let settings = MapSettings {
            global_radius_m: self.radius_m,
            caustic_radius_m: self.radius_m * params.gather.caustic_radius_scale,
            radius_scale_max: scale_max.max(1.0),
            normal_cos_min: params.gather.normal_cos_min,
            flatness: params.gather.flatness,
        };
        // What was recorded before still counts on the old radii.
        recorder.submit();
        map.configure(recorder.gpu(), &settings);
        let tracing = TraceSettings {
            path_count: params.photon.count,
            depth_max: params.photon.depth_max,
            seed: params.random.seed,
            frame: frame.frame,
        };
        tracer.record(recorder, &tracing);
        map.record(recorder);
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

    fn statistics(&self, gpu: &GpuDevice) -> Result<Statistics, GpuError> {
        let counters = match &self.photons {
            Some((tracer, _)) => tracer.store().counters(gpu)?,
            None => PhotonCounters::default(),
        };
        let mut warnings = Vec::from_iter(self.radius.warning(&self.params));
        warnings.extend(photon_warnings(&counters));
        Ok(Statistics {
            counts: vec![
                ("photons_emitted", f64::from(counters.emitted)),
                ("photons_stored", f64::from(counters.stored)),
                ("photons_dropped", f64::from(counters.dropped_photons)),
                ("gather_radius_m", f64::from(self.radius_m)),
            ],
            warnings,
        })
    }
}
