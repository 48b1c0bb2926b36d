//! Light transport methods, one file each, behind one small trait. A technique composes photon/, gather/ and image/; they know none.

pub mod fpm;
pub mod path;
pub mod path_filtered;
pub mod pm;
pub mod radius;

use crate::gather::{EyeImage, EyeSettings, EyeStart, LightPass};
use crate::gpu::layout::PhotonCounters;
use crate::gpu::pass::Recorder;
use crate::gpu::{GpuDevice, GpuError};
use crate::params::Params;
use crate::scene::bvh::SceneCaster;
use crate::scene::effects::Effects;
use crate::scene::gpu_scene::GpuScene;
use crate::scene::{Scene, ScenePose};

/// A light transport method at work on one scene.
pub trait Technique {
    /// Prepares what all eyes of a frame share, photons above all. `pass` counts frames, or the passes of one picture.
    ///
    /// # Errors
    /// [`GpuError`] when the device fails.
    fn prepare(
        &mut self,
        recorder: &mut Recorder<'_>,
        frame: &FrameSettings<'_>,
    ) -> Result<(), GpuError>;

    /// Adds one pass over an eye's image.
    ///
    /// # Errors
    /// [`GpuError`] when the device fails.
    fn shade(
        &mut self,
        recorder: &mut Recorder<'_>,
        eye: &EyeSettings,
        image: &EyeImage,
    ) -> Result<(), GpuError>;

    /// Whether the passes of a picture are independent estimates of one and the same, so that their scatter tells how sure their mean is.
    /// A technique whose radius shrinks from pass to pass has another bias in each, of which no scatter tells.
    fn has_independent_passes(&self) -> bool {
        false
    }

    /// What happened in the last frame; waits for the device.
    ///
    /// # Errors
    /// [`GpuError`] when the device fails.
    fn statistics(&self, gpu: &GpuDevice) -> Result<Statistics, GpuError>;
}

/// What a technique is told about a frame, besides the eyes.
#[derive(Clone, Copy, Debug)]
pub struct FrameSettings<'a> {
    /// Number of the frame in a session, or of the pass over one picture: another one gives other random numbers.
    pub frame: u32,
    /// Passes that the picture holds already: the gather radius shrinks with them. 0 in a session.
    pub pass: u32,
    /// Where everything is; the scene on the device stands there already.
    pub pose: &'a ScenePose,
    /// The eyes that will be shaded, those that see something.
    pub eyes: &'a [EyeSettings],
}

/// What a technique starts from: the scene (`'s`), which it may keep, and what it works with.
#[derive(Clone, Copy)]
pub struct Start<'s, 'w> {
    /// The device.
    pub gpu: &'w GpuDevice,
    /// The scene as loaded.
    pub scene: &'s Scene,
    /// Its hierarchies on the host.
    pub caster: &'s SceneCaster,
    /// The scene on the device.
    pub on_gpu: &'w GpuScene,
    /// What is simulated.
    pub effects: Effects,
    /// What is set.
    pub params: &'w Params,
    /// Pixels of an eye's image, across and down.
    pub size: (u32, u32),
    /// Frames follow each other as a wearer sees them, so that light may be kept from one to the next; else each is a picture of its own.
    pub is_session: bool,
}

impl<'s, 'w> Start<'s, 'w> {
    /// The constants that all shaders of a technique get.
    fn shader_constants(&self) -> Vec<(&'static str, f64)> {
        let params = self.params;
        let mut constants = self.effects.constants();
        constants.extend(
            [
                ("GATHERED_ALPHA_MIN", params.gather.glossy_alpha_min),
                ("COVERAGE_RAYS", params.gather.coverage_rays as f32),
                ("FILTER_NORMAL_COS_MIN", params.filter.normal_cos_min),
                ("FILTER_SLOPE_MAX", params.filter.slope_max),
            ]
            .map(|(name, value)| (name, f64::from(value))),
        );
        constants
    }

    /// What the eye passes start from when they are lit by `light`, the smooth of it through so many levels of the filter.
    fn eyes<'a>(&self, light: &'a [LightPass<'a>], filter_levels: u32) -> EyeStart<'a>
    where
        'w: 'a,
    {
        let fovea = &self.params.fovea;
        EyeStart {
            gpu: self.gpu,
            scene: self.on_gpu,
            light,
            filter_levels,
            keeping_eyes: 0,
            effects: self.effects,
            size: self.size,
            samples_max: fovea
                .samples
                .max(fovea.transition_samples)
                .max(fovea.periphery_samples),
        }
    }
}

/// Counts of one frame, by name, in a fixed order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Name and value: photons emitted, stored and dropped, radii, ...
    pub counts: Vec<(&'static str, f64)>,
    /// What a user should know: a full map, for one.
    pub warnings: Vec<String>,
}

/// One line a technique: its name on the command line, what it is, and how it starts.
pub struct TechniqueEntry {
    /// Name, as `--technique` takes it.
    pub name: &'static str,
    /// One line for help and reports.
    pub about: &'static str,
    /// Rooms of parameters that change its frames, besides the random numbers.
    pub rooms: &'static [&'static str],
    /// Key of the parameter that buys accuracy for time without a bend: how many paths a frame traces.
    pub effort: &'static str,
    /// Whether it stores photons.
    pub has_photons: bool,
    /// Whether it finds lights without photons: by shadow rays, or by paths.
    pub has_direct_light: bool,
    /// Whether it finds light of lamps without extent that comes by way of mirrors and glass, which no path from the eye can meet.
    pub has_delta_caustics: bool,
    /// The passes of a frame with these effects and parameters as the timings name them, in order.
    pub passes: fn(&Effects, &Params) -> Vec<&'static str>,
    /// Prepares it for a scene and an image size.
    pub start: StartTechnique,
}

/// Prepares a technique for a scene and images of one size.
pub type StartTechnique = for<'s> fn(&Start<'s, '_>) -> Result<Box<dyn Technique + 's>, GpuError>;

/// What photon mapping reads.
const PHOTON_ROOMS: &[&str] = &[
    "photon", "gather", "direct", "filter", "eye", "fovea", "effects",
];

/// Every technique there is. A new one joins by its line.
pub const REGISTRY: &[TechniqueEntry] = &[
    TechniqueEntry {
        name: "pm-direct",
        about: "photon mapping, direct light by shadow rays",
        rooms: PHOTON_ROOMS,
        effort: "photon.count",
        has_photons: true,
        has_direct_light: true,
        has_delta_caustics: true,
        passes: |effects, params| {
            pm::Plan::of(pm::DirectLight::ShadowRays, effects, params).passes()
        },
        start: |start| pm::PhotonMapping::start(start, pm::DirectLight::ShadowRays),
    },
    TechniqueEntry {
        name: "pm",
        about: "photon mapping, all light from photon density, as in the papers",
        rooms: PHOTON_ROOMS,
        effort: "photon.count",
        has_photons: true,
        has_direct_light: false,
        has_delta_caustics: true,
        passes: |effects, params| pm::Plan::of(pm::DirectLight::Photons, effects, params).passes(),
        start: |start| pm::PhotonMapping::start(start, pm::DirectLight::Photons),
    },
    TechniqueEntry {
        name: "fpm",
        about: "foveated photon mapping: photons and paths where the eye looks",
        rooms: &[
            "photon", "aimed", "gather", "record", "indirect", "temporal", "direct", "filter",
            "eye", "fovea", "effects",
        ],
        effort: "photon.count",
        has_photons: true,
        has_direct_light: true,
        has_delta_caustics: true,
        passes: fpm::passes,
        start: fpm::FoveatedPhotonMapping::start,
    },
    TechniqueEntry {
        name: "path-filtered",
        about: "path tracing on the GPU, indirect light through an edge-avoiding filter",
        rooms: &["indirect", "direct", "filter", "eye", "fovea", "effects"],
        effort: "indirect.paths",
        has_photons: false,
        has_direct_light: true,
        has_delta_caustics: false,
        passes: path_filtered::passes,
        start: path_filtered::FilteredPaths::start,
    },
    TechniqueEntry {
        name: "path",
        about: "the oracle: path tracing in f64 on the host, slow and right",
        rooms: &["path"],
        effort: "path.samples",
        has_photons: false,
        has_direct_light: true,
        has_delta_caustics: true,
        passes: |_, _| path::PASSES.to_vec(),
        start: path::PathTracing::start,
    },
];

/// What a user should know of the photons of a frame.
fn photon_warnings(counters: &PhotonCounters) -> Option<String> {
    if counters.dropped_paths == 0 {
        return None;
    }
    Some(match counters.emitted {
        0 => "the photon map was too small for one batch of paths: there is no light from photons; raise photon.stored_per_path".into(),
        emitted => format!(
            "the photon map was full: {} of {} paths were left out and the others weighted up; raise photon.stored_per_path",
            counters.dropped_paths,
            emitted + counters.dropped_paths
        ),
    })
}

/// What is simulated of a scene: what it calls for by these parameters, or everything where they say so.
pub fn effects(scene: &Scene, params: &Params) -> Effects {
    match params.effects.all {
        0 => Effects::of(scene, params.gather.glossy_alpha_min),
        _ => Effects::ALL,
    }
}

/// The technique of that name.
pub fn find(name: &str) -> Option<&'static TechniqueEntry> {
    REGISTRY.iter().find(|entry| entry.name == name)
}
