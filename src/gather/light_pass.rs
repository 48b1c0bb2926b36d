//! What can bring light to visible points: one kernel each, told by a technique to the eye pass.

use super::IrradianceRecords;
use crate::gpu::pass::Resources;
use crate::gpu::shader::{Stage, stages};
use crate::photon::{PhotonClass, PhotonMap, PhotonStore};

/// Name of the pass, as the timings give it.
pub const DIRECT_LIGHT: &str = "direct light";

/// Name of the pass, as the timings give it.
pub const PATH_LIGHT: &str = "path light";

/// The name of the pass that gathers a class of photons.
pub fn estimate_of(class: PhotonClass) -> &'static str {
    match class {
        PhotonClass::Global => "density estimate",
        PhotonClass::Caustic => "caustic estimate",
    }
}

/// Whether light is filtered before it is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// Shown as it was found: shadows, caustics.
    Sharp,
    /// Through the edge-avoiding filter, where there is one.
    Smooth,
}

/// A kernel that adds light at each visible point.
#[derive(Clone)]
pub struct LightPass<'a> {
    /// Name of the pass.
    pub(super) name: &'static str,
    pub(super) stage: Stage,
    /// Its constants, besides those of all eye passes.
    pub(super) constants: Vec<(&'static str, f64)>,
    /// What it binds, besides scene and visible points.
    pub(super) resources: Resources<'a>,
    /// Into how many chunks its arrays are cut.
    pub(super) chunks: u32,
    pub(super) layer: Layer,
}

impl<'a> LightPass<'a> {
    /// Shadow rays to the lights.
    pub fn shadow_rays() -> Self {
        Self {
            name: DIRECT_LIGHT,
            stage: stages::direct_light,
            constants: Vec::new(),
            resources: Resources::default(),
            chunks: 1,
            layer: Layer::Sharp,
        }
    }

    /// Paths that bring indirect light.
    pub fn paths() -> Self {
        Self {
            name: PATH_LIGHT,
            stage: stages::path_light,
            layer: Layer::Smooth,
            ..Self::shadow_rays()
        }
    }

    /// Paths out of the focus region that end in irradiance records; caustics on what they start from are left to photons.
    pub fn foveated(records: &'a IrradianceRecords) -> Self {
        let (store, map) = records.map();
        Self {
            stage: stages::foveated_light,
            constants: vec![("CAUSTICS_BY_PHOTONS", 1.0)],
            resources: store.resources().with_all(map.resources()),
            chunks: store.chunks(),
            ..Self::paths()
        }
    }

    /// The density of one class of photons.
    pub fn photons(store: &'a PhotonStore, map: &'a PhotonMap, class: PhotonClass) -> Self {
        Self {
            name: estimate_of(class),
            stage: stages::density_estimate,
            constants: vec![("CLASS", class.number())],
            resources: store.resources().with_all(map.resources()),
            chunks: store.chunks(),
            layer: match class {
                PhotonClass::Global => Layer::Smooth,
                PhotonClass::Caustic => Layer::Sharp,
            },
        }
    }
}
