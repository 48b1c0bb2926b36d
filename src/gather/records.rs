//! Irradiance records: what photons bring to the places where paths out of the focus region land, sorted for paths to find.
//!
//! Source: Ward, Rubinstein and Clear, "A Ray Tracing Solution for Diffuse Interreflection", 1988; filled from a photon map as in
//! Christensen, "Faster Photon Map Global Illumination", 1999.

use super::EyeSettings;
use crate::gpu::layout::{EyeUniform, PhotonCounters};
use crate::gpu::pass::{BoundKernel, Constants, Kernel, Recorder};
use crate::gpu::resources;
use crate::gpu::shader::stages;
use crate::gpu::{GpuDevice, GpuError};
use crate::photon::{MapSettings, PhotonClass, PhotonMap, PhotonStore};
use crate::scene::gpu_scene::GpuScene;

/// Name of the pass, as the timings give it.
pub const RECORDS: &str = "irradiance records";

/// Records of one frame.
pub struct IrradianceRecords {
    eye: wgpu::Buffer,
    places: BoundKernel,
    irradiance: BoundKernel,
    store: PhotonStore,
    map: PhotonMap,
    count: u32,
    size: (u32, u32),
}

impl IrradianceRecords {
    /// Room and kernels for `count` records, filled from the photons of `map`, which come from `photons`; for images of `size`.
    ///
    /// # Errors
    /// [`GpuError`] when a buffer can't be made.
    pub fn new(
        gpu: &GpuDevice,
        scene: &GpuScene,
        (photons, map): (&PhotonStore, &PhotonMap),
        constants: &Constants,
        count: u32,
        size: (u32, u32),
    ) -> Result<Self, GpuError> {
        let store = PhotonStore::new(gpu, count, &[PhotonClass::Global])?;
        let counters = PhotonCounters {
            stored: count,
            emitted: 1,
            ..Default::default()
        };
        store.set_counters(gpu, &counters);
        let eye = resources::uniform::<EyeUniform>(gpu, "eye");
        let has_caustics = map.classes().contains(&PhotonClass::Caustic);
        let own = [
            ("RECORD_COUNT", f64::from(count)),
            ("HAS_CAUSTICS", f64::from(u8::from(has_caustics))),
        ];
        let shared = constants.iter();
        let shared = shared.filter(|(name, _)| own.iter().all(|(other, _)| name != other));
        let constants: Vec<_> = shared.chain(&own).copied().collect();
        let size_of_name = |array: &str| match array {
            "photon_position" | "photon_flux" => store.chunks(),
            _ => scene.shader_size(array).unwrap_or(photons.chunks()),
        };
        // The counters are those of the photons: they tell how many paths were emitted.
        let bound = scene
            .resources()
            .with("eye", &eye)
            .with_all(store.resources())
            .with_all(map.resources())
            .with_all(photons.counters_resource());
        let kernel = |stage| Kernel::new(gpu, stage, &constants, &size_of_name)?.bind(gpu, &bound);
        Ok(Self {
            places: kernel(stages::record_points)?,
            irradiance: kernel(stages::record_irradiance)?,
            map: PhotonMap::new(gpu, &store, scene.bounds())?,
            store,
            eye,
            count,
            size,
        })
    }

    /// Sets how far a path looks for a record, and how alike their surfaces must be; holds from the next submission on.
    pub fn configure(&mut self, gpu: &GpuDevice, settings: &MapSettings) {
        self.map.configure(gpu, settings);
    }

    /// Records the placing, filling and sorting of the records that `eye` asks for.
    pub fn record(&self, recorder: &mut Recorder<'_>, eye: &EyeSettings) {
        recorder.submit();
        let gpu = recorder.gpu();
        let uniform = eye.uniform(self.size);
        gpu.queue
            .write_buffer(&self.eye, 0, bytemuck::bytes_of(&uniform));
        recorder.pass(
            RECORDS,
            &[(&self.places, self.count), (&self.irradiance, self.count)],
        );
        self.map.record_as(recorder, RECORDS);
    }

    /// The store and the map that hold the records, laid out as photons.
    pub fn map(&self) -> (&PhotonStore, &PhotonMap) {
        (&self.store, &self.map)
    }
}
