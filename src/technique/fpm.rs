//! Foveated photon mapping: photons from the lights everywhere, and paths where the eye looks that end in what photons bring.
//!
//! Source: Shi, Wang, Wei and Yan, "Foveated Photon Mapping", TVCG 2021, Algorithm 1 and Eq. 2. Foveated photons are estimated by final
//! gathering, which converges to the right picture; the printed estimator does not.

use super::radius::{RadiusRule, shrink_factor};
use super::{FrameSettings, Start, Statistics, Technique, photon_warnings};
use crate::gather::{
    EyeImage, EyePass, EyeSettings, EyeStart, IrradianceRecords, LightPass, eye_pass, filter,
    light_pass, records,
};
use crate::gpu::pass::Recorder;
use crate::gpu::{GpuDevice, GpuError};
use crate::params::Params;
use crate::photon::{MapSettings, PhotonClass, PhotonMap, PhotonTracer, TraceSettings, map, trace};
use crate::scene::effects::Effects;
use crate::scene::specular_targets::SpecularTargets;

/// Which passes a scene's effects call for.
struct Plan {
    /// Shadow rays.
    direct_light: bool,
    /// Photons, the records filled from them, and the paths that end in these.
    photons: bool,
    /// Photons aimed at what makes caustics.
    caustics: bool,
}

impl Plan {
    fn of(effects: &Effects, params: &Params) -> Self {
        let is_lit = effects.area_light || effects.has_delta_lights();
        Self {
            direct_light: is_lit,
            photons: is_lit && params.photon.count > 0 && (effects.indirect || effects.caustics),
            caustics: is_lit && effects.caustics && params.aimed.count > 0,
        }
    }

    /// Whether pixels keep light from frame to frame: not where something moves, as nothing yet tells which light that changes.
    fn keeps(start: &Start<'_, '_>) -> bool {
        let is_asked = start.is_session && start.params.temporal.kept_samples > 0;
        is_asked && !start.effects.has_motion()
    }

    /// The classes that photons which are not aimed are told apart in.
    fn classes(effects: &Effects) -> &'static [PhotonClass] {
        match effects.caustics {
            true => &[PhotonClass::Global, PhotonClass::Caustic],
            false => &[PhotonClass::Global],
        }
    }
}

/// Names of the passes, in order.
pub fn passes(effects: &Effects, params: &Params) -> Vec<&'static str> {
    let plan = Plan::of(effects, params);
    [
        (plan.photons || plan.caustics, trace::TRACING),
        (plan.photons || plan.caustics, map::SORTING),
        (plan.photons, records::RECORDS),
        (true, eye_pass::VISIBLE_POINTS),
        (plan.direct_light, light_pass::DIRECT_LIGHT),
        (plan.photons, light_pass::PATH_LIGHT),
        (plan.caustics, light_pass::estimate_of(PhotonClass::Caustic)),
        (
            plan.photons && params.filter.path_levels > 0,
            filter::FILTER,
        ),
        (true, eye_pass::RESOLVE),
    ]
    .into_iter()
    .filter_map(|(runs, name)| runs.then_some(name))
    .collect()
}

/// `fpm`.
pub struct FoveatedPhotonMapping {
    photons: Option<(PhotonTracer, PhotonMap, IrradianceRecords)>,
    caustics: Option<(SpecularTargets, PhotonTracer, PhotonMap)>,
    eyes: EyePass,
    params: Params,
    radius: RadiusRule,
    radius_m: f32,
}

impl FoveatedPhotonMapping {
    /// Prepares the technique.
    ///
    /// # Errors
    /// [`GpuError`] when a buffer can't be made.
    pub fn start<'s>(start: &Start<'s, '_>) -> Result<Box<dyn Technique + 's>, GpuError> {
        let &Start {
            gpu,
            on_gpu: scene,
            params,
            size,
            ..
        } = start;
        let plan = Plan::of(&start.effects, params);
        let classes = Plan::classes(&start.effects);
        let mut constants = start.shader_constants();
        constants.extend([
            ("STORE_DIRECT", 0.0),
            ("HAS_CAUSTICS", (classes.len() - 1) as f64),
            ("RECORDS_A_CELL", f64::from(params.record.per_cell)),
        ]);
        let photons = match plan.photons {
            false => None,
            true => {
                let tracer = PhotonTracer::new(gpu, scene, params, &constants)?;
                let map = PhotonMap::new(gpu, tracer.store(), scene.bounds())?;
                let filled_from = (tracer.store(), &map);
                let count = params.record.count;
                let records =
                    IrradianceRecords::new(gpu, scene, filled_from, &constants, count, size)?;
                Some((tracer, map, records))
            }
        };
        let caustics = match plan.caustics {
            false => None,
            true => {
                let targets = SpecularTargets::new(
                    gpu,
                    start.scene,
                    params.gather.glossy_alpha_min,
                    &start.scene.pose_at(0.0),
                )?;
                let count = params.aimed.count;
                let tracer = PhotonTracer::aimed(gpu, scene, params, &constants, count, &targets)?;
                let map = PhotonMap::new(gpu, tracer.store(), scene.bounds())?;
                Some((targets, tracer, map))
            }
        };
        let mut light = Vec::new();
        if plan.direct_light {
            light.push(LightPass::shadow_rays());
        }
        let mut filter_levels = 0;
        if let Some((.., records)) = &photons {
            light.push(LightPass::foveated(records));
            filter_levels = params.filter.path_levels;
        }
        if let Some((_, tracer, map)) = &caustics {
            let class = PhotonClass::Caustic;
            light.push(LightPass::photons(tracer.store(), map, class));
        }
        let keeps = Plan::keeps(start);
        let eyes = EyeStart {
            keeping_eyes: if keeps { 2 } else { 0 },
            ..start.eyes(&light, filter_levels)
        };
        let eyes = EyePass::new(&eyes, &constants)?;
        let radius = RadiusRule::of(scene);
        Ok(Box::new(Self {
            photons,
            caustics,
            eyes,
            params: params.clone(),
            radius,
            radius_m: radius.first_m(params),
        }))
    }

    fn map_settings(&self) -> MapSettings {
        let gather = &self.params.gather;
        let fovea = &self.params.fovea;
        let scale_max = fovea
            .transition_radius_scale
            .max(fovea.periphery_radius_scale);
        MapSettings {
            global_radius_m: self.radius_m,
            caustic_radius_m: self.radius_m * gather.caustic_radius_scale,
            radius_scale_max: scale_max.max(1.0),
            normal_cos_min: gather.normal_cos_min,
            flatness: gather.flatness,
        }
    }
}

impl Technique for FoveatedPhotonMapping {
    fn prepare(
        &mut self,
        recorder: &mut Recorder<'_>,
        frame: &FrameSettings<'_>,
    ) -> Result<(), GpuError> {
        let params = &self.params;
        let shrink = shrink_factor(frame.pass, params.gather.radius_alpha);
        self.radius_m = self.radius.first_m(params) * shrink;
        let settings = self.map_settings();
        let gpu = recorder.gpu();
        self.eyes.start_counting(recorder);
        // What was recorded before still counts on the old radii.
        recorder.submit();
        let tracing = |path_count| TraceSettings {
            path_count,
            depth_max: self.params.photon.depth_max,
            seed: self.params.random.seed,
            frame: frame.frame,
        };
        if let Some((tracer, map, records)) = &mut self.photons {
            map.configure(gpu, &settings);
            let scale = self.params.record.radius_scale;
            records.configure(
                gpu,
                &MapSettings {
                    global_radius_m: settings.global_radius_m * scale,
                    radius_scale_max: 1.0,
                    ..settings
                },
            );
            tracer.record(recorder, &tracing(self.params.photon.count));
        }
        if let Some((targets, tracer, map)) = &mut self.caustics {
            targets.set_pose(gpu, frame.pose);
            map.configure(gpu, &settings);
            tracer.record(recorder, &tracing(self.params.aimed.count));
        }
        if let Some((_, map, _)) = &self.photons {
            map.record(recorder);
        }
        if let Some((_, _, map)) = &self.caustics {
            map.record(recorder);
        }
        if let (Some((_, _, records)), Some(eye)) = (&self.photons, frame.eyes.first()) {
            records.record(recorder, eye);
        }
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
        let tracers = [
            self.photons.as_ref().map(|(tracer, ..)| tracer),
            self.caustics.as_ref().map(|(_, tracer, _)| tracer),
        ];
        let mut counts = Vec::new();
        let mut warnings = Vec::new();
        let names = [
            ["photons_emitted", "photons_stored", "photons_dropped"],
            [
                "caustic_photons_emitted",
                "caustic_photons_stored",
                "caustic_photons_dropped",
            ],
        ];
        for (tracer, [emitted, stored, dropped]) in tracers.into_iter().zip(names) {
            let counters = match tracer {
                Some(tracer) => tracer.store().counters(gpu)?,
                None => Default::default(),
            };
            warnings.extend(photon_warnings(&counters));
            counts.extend([
                (emitted, f64::from(counters.emitted)),
                (stored, f64::from(counters.stored)),
                (dropped, f64::from(counters.dropped_photons)),
            ]);
        }
        warnings.extend(self.radius.warning(&self.params));
        if let Some(kept) = self.eyes.kept_light(gpu)? {
            counts.extend([
                ("pixels_keeping_light", f64::from(kept.pixels)),
                ("pixels_with_kept_light", f64::from(kept.found)),
                ("samples_kept", f64::from(kept.samples)),
            ]);
        }
        counts.push(("gather_radius_m", f64::from(self.radius_m)));
        Ok(Statistics { counts, warnings })
    }
}
