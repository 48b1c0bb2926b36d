//! Photons in the order in which they were left, with their counters: what a tracer fills and a map sorts.

use crate::gpu::layout::PhotonCounters;
use crate::gpu::pass::Resources;
use crate::gpu::resources::{self, SplitArray};
use crate::gpu::{GpuDevice, GpuError};

/// Photons that are gathered with a radius of their own (shaders/photon_map.wgsl).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PhotonClass {
    /// All that is not caustic.
    Global,
    /// Light that met nothing but mirrors and glass before.
    Caustic,
}

impl PhotonClass {
    /// Its number in the shaders.
    pub fn number(self) -> f64 {
        match self {
            Self::Global => 0.0,
            Self::Caustic => 1.0,
        }
    }
}

/// Room for photons.
pub struct PhotonStore {
    counters: wgpu::Buffer,
    positions: SplitArray,
    fluxes: SplitArray,
    capacity: u32,
    classes: &'static [PhotonClass],
}

impl PhotonStore {
    /// Room for `capacity` photons of some classes, each once, and none in it.
    ///
    /// # Errors
    /// [`GpuError::BufferTooLarge`] when they do not fit the device.
    pub fn new(
        gpu: &GpuDevice,
        capacity: u32,
        classes: &'static [PhotonClass],
    ) -> Result<Self, GpuError> {
        let count = u64::from(capacity);
        Ok(Self {
            counters: resources::storage::<PhotonCounters>(gpu, "counters", 1)?,
            positions: SplitArray::new::<[f32; 4]>(gpu, "photon_position", count)?,
            fluxes: SplitArray::new::<[f32; 4]>(gpu, "photon_flux", count)?,
            capacity,
            classes,
        })
    }

    /// Photons that it holds at most.
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    /// The classes that its photons are told apart in.
    pub fn classes(&self) -> &'static [PhotonClass] {
        self.classes
    }

    /// Into how many chunks the photon arrays are cut.
    pub fn chunks(&self) -> u32 {
        self.positions.chunks()
    }

    /// The counters by their WGSL name.
    pub fn counters_resource(&self) -> Resources<'_> {
        Resources::default().with("counters", &self.counters)
    }

    /// The counters and the photons by their WGSL names.
    pub fn resources(&self) -> Resources<'_> {
        self.counters_resource()
            .with_all(self.positions.resources())
            .with_all(self.fluxes.resources())
    }

    /// Forgets the photons.
    pub fn clear(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.clear_buffer(&self.counters, 0, None);
    }

    /// Sets the counters; holds from the next submission on.
    pub fn set_counters(&self, gpu: &GpuDevice, counters: &PhotonCounters) {
        gpu.queue
            .write_buffer(&self.counters, 0, bytemuck::bytes_of(counters));
    }

    /// Reads the counters; waits for the device.
    ///
    /// # Errors
    /// [`GpuError::Failed`] when the device is lost.
    pub fn counters(&self, gpu: &GpuDevice) -> Result<PhotonCounters, GpuError> {
        resources::read_back::<PhotonCounters>(gpu, &self.counters, 1)?
            .first()
            .copied()
            .ok_or_else(|| GpuError::Failed {
                during: "reading the photon counters".into(),
                reason: "no data".into(),
            })
    }
}
