//! Photon tracing: wavefronts of paths, batch by batch, into an unsorted store.

use super::store::{PhotonClass, PhotonStore};
use crate::gpu::layout::{Photon, PhotonPath, TraceUniform};
use crate::gpu::pass::{BoundKernel, Constants, Kernel, Recorder, Threads, UniformSequence};
use crate::gpu::resources;
use crate::gpu::shader::stages;
use crate::gpu::{GpuDevice, GpuError};
use crate::params::Params;
use crate::scene::gpu_scene::GpuScene;
use crate::scene::specular_targets::SpecularTargets;

/// Paths in a workgroup of photon_bounce and photon_append.
const GROUP: u32 = 64;

/// Fewest batches in which a map is traced, if they have [`BATCH_MIN`] paths each.
const BATCHES_MIN: u32 = 8;
/// Paths below which a batch takes its time to start kernels and not to trace.
const BATCH_MIN: u32 = 4096;

/// Name of the pass, as the timings give it.
pub const TRACING: &str = "photon tracing";

/// What one map's photons are traced with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TraceSettings {
    /// Paths to emit.
    pub path_count: u32,
    /// Most surfaces that a path meets.
    pub depth_max: u32,
    /// Seed of the random numbers.
    pub seed: u32,
    /// Number of the frame or pass: another one gives other photons.
    pub frame: u32,
}

/// Sets the random numbers of aimed photons apart from those of others.
const AIMED_SEED: u32 = 0x6169_6d65;

/// Traces photons and keeps them in the order of path and bounce.
pub struct PhotonTracer {
    uniforms: UniformSequence,
    store: PhotonStore,
    emit: BoundKernel,
    /// Bounce and append, for even and odd bounces: living paths change sides.
    bounce: [BoundKernel; 2],
    append: [BoundKernel; 2],
    count: BoundKernel,
    offsets: [BoundKernel; 2],
    commit: BoundKernel,
    /// Workgroups of even and odd bounces.
    dispatches: [wgpu::Buffer; 2],
    batch: u32,
    path_count_max: u32,
    depth_max: u32,
    /// Changes the seed of the random numbers.
    seed_mask: u32,
}

impl PhotonTracer {
    /// Room and kernels for up to `params.photon.count` paths a map, which leave photons of all kinds: caustic ones apart from the others
    /// unless `constants` set `HAS_CAUSTICS` to 0, and none of them where they set `STORES_CAUSTIC` to 0, for a map of aimed ones beside it.
    ///
    /// # Errors
    /// [`GpuError::BufferTooLarge`] when the map does not fit the device.
    pub fn new(
        gpu: &GpuDevice,
        scene: &GpuScene,
        params: &Params,
        constants: &Constants,
    ) -> Result<Self, GpuError> {
        Self::start(gpu, scene, params, constants, params.photon.count, None)
    }

    /// Room and kernels for up to `path_count` paths a map that are aimed at `targets` and leave caustic photons alone: those that
    /// [`PhotonTracer::new`]'s would leave, but more of them and fainter. Without targets no path is traced.
    ///
    /// # Errors
    /// As [`PhotonTracer::new`].
    pub fn aimed(
        gpu: &GpuDevice,
        scene: &GpuScene,
        params: &Params,
        constants: &Constants,
        path_count: u32,
        targets: &SpecularTargets,
    ) -> Result<Self, GpuError> {
        let aimed = [
            ("HAS_CAUSTICS", 1.0),
            ("STORES_CAUSTIC", 1.0),
            ("STORES_GLOBAL", 0.0),
        ];
        let others = constants
            .iter()
            .filter(|(name, _)| aimed.iter().all(|(own, _)| own != name));
        let constants: Vec<_> = others.chain(&aimed).copied().collect();
        Self::start(gpu, scene, params, &constants, path_count, Some(targets))
    }

    fn start(
        gpu: &GpuDevice,
        scene: &GpuScene,
        params: &Params,
        constants: &Constants,
        path_count: u32,
        targets: Option<&SpecularTargets>,
    ) -> Result<Self, GpuError> {
        let photon = &params.photon;
        // Some batches: what does not fit the map is then one of them at most, not all.
        let wanted = path_count.div_ceil(BATCHES_MIN);
        let batch = photon
            .batch
            .min(wanted.max(path_count.clamp(GROUP, BATCH_MIN)));
        let capacity_wanted = f64::from(path_count) * f64::from(photon.stored_per_path);
        // One batch always fits: a map that holds nothing would be no use.
        let capacity = capacity_wanted
            .max(f64::from(batch) * 2.0)
            .min(f64::from(1u32 << 28)) as u32;
        // What no constant leaves out is there.
        let has = |name| {
            constants
                .iter()
                .all(|(n, value)| *n != name || *value != 0.0)
        };
        let has_caustics = has("HAS_CAUSTICS") && has("STORES_CAUSTIC");
        let classes: &[PhotonClass] = match (targets.is_some(), has_caustics) {
            (true, _) => &[PhotonClass::Caustic],
            (false, true) => &[PhotonClass::Global, PhotonClass::Caustic],
            (false, false) => &[PhotonClass::Global],
        };
        let store = PhotonStore::new(gpu, capacity, classes)?;
        let target_count = targets.map_or(0, SpecularTargets::count);
        let size_of_name = |array: &str| match array {
            "TARGET_COUNT" => target_count,
            _ => scene.shader_size(array).unwrap_or(store.chunks()),
        };

        let rounds = path_count.div_ceil(batch).max(1);
        let uniforms =
            UniformSequence::new::<TraceUniform>(gpu, "tracing", rounds * photon.depth_max);
        let path_sides = [
            resources::storage::<PhotonPath>(gpu, "paths (even)", u64::from(batch))?,
            resources::storage::<PhotonPath>(gpu, "paths (odd)", u64::from(batch))?,
        ];
        let staged = resources::storage::<Photon>(gpu, "staged", u64::from(batch))?;
        let staged_flags = resources::storage::<u32>(gpu, "staged_flags", u64::from(batch))?;
        let group_counts =
            resources::storage::<[u32; 2]>(gpu, "group_counts", u64::from(batch.div_ceil(GROUP)))?;
        let wave = resources::storage::<[u32; 4]>(gpu, "wave", 1)?;

        let dispatches =
            ["dispatch (even)", "dispatch (odd)"].map(|name| resources::dispatch_counts(gpu, name));
        let shared = scene
            .resources()
            .with("tracing", uniforms.buffer())
            .with("staged", &staged)
            .with("staged_flags", &staged_flags)
            .with("group_counts", &group_counts)
            .with("wave", &wave)
            .with_all(store.resources());
        let on_side = |side: usize| {
            shared
                .clone()
                .with("paths", &path_sides[side])
                .with("next_paths", &path_sides[1 - side])
                .with("next_dispatch", &dispatches[1 - side])
        };
        let at_lights = on_side(0).with("next_dispatch", &dispatches[0]);
        let (emit, at_lights) = match targets {
            None => (stages::photon_emit, at_lights),
            Some(targets) => (
                stages::photon_aim,
                at_lights.with("specular_targets", targets.buffer()),
            ),
        };
        let kernel = |stage| Kernel::new(gpu, stage, constants, &size_of_name);
        let both_sides = |kernel: &Kernel| -> Result<[BoundKernel; 2], GpuError> {
            Ok([
                kernel.bind(gpu, &on_side(0))?,
                kernel.bind(gpu, &on_side(1))?,
            ])
        };
        Ok(Self {
            emit: kernel(emit)?.bind(gpu, &at_lights)?,
            bounce: both_sides(&kernel(stages::photon_bounce)?)?,
            append: both_sides(&kernel(stages::photon_append)?)?,
            count: kernel(stages::photon_count)?.bind(gpu, &shared)?,
            offsets: both_sides(&kernel(stages::photon_offsets)?)?,
            commit: kernel(stages::photon_commit)?.bind(gpu, &shared)?,
            dispatches,
            uniforms,
            store,
            batch,
            // Nothing to aim at: nothing to trace.
            path_count_max: match targets.is_some() && target_count == 0 {
                true => 0,
                false => path_count,
            },
            depth_max: photon.depth_max,
            seed_mask: match targets {
                Some(_) => AIMED_SEED,
                None => 0,
            },
        })
    }

    /// What was traced, unsorted.
    pub fn store(&self) -> &PhotonStore {
        &self.store
    }

    /// Records the tracing of one map. A count of zero gives an empty map.
    pub fn record(&self, recorder: &mut Recorder<'_>, settings: &TraceSettings) {
        self.store.clear(recorder.encoder());
        let path_count = settings.path_count.min(self.path_count_max);
        let depth_max = settings.depth_max.min(self.depth_max);
        let values: Vec<TraceUniform> = (0..path_count.div_ceil(self.batch))
            .flat_map(|round| {
                let first_path = round * self.batch;
                (0..depth_max).map(move |bounce| TraceUniform {
                    seed: settings.seed ^ self.seed_mask,
                    frame: settings.frame,
                    first_path,
                    path_count: (path_count - first_path).min(self.batch),
                    bounce,
                    depth_max,
                    capacity: self.store.capacity(),
                    padding: 0,
                })
            })
            .collect();
        if values.is_empty() {
            return;
        }
        // The values are read by copies of this and later submissions: finish with the old ones first.
        recorder.submit();
        self.uniforms.write(recorder.gpu(), &values);
        for (index, value) in values.iter().enumerate() {
            self.uniforms.select(recorder, index as u32);
            let side = (value.bounce % 2) as usize;
            if value.bounce == 0 {
                recorder.pass(TRACING, &[(&self.emit, value.path_count)]);
            }
            let alive = Threads::OnDevice(&self.dispatches[side]);
            recorder.pass_of(
                TRACING,
                &[
                    (&self.bounce[side], alive),
                    (&self.count, alive),
                    (&self.offsets[side], Threads::Count(1)),
                    (&self.append[side], alive),
                ],
            );
            if value.bounce + 1 == depth_max {
                recorder.pass(TRACING, &[(&self.commit, 1)]);
                recorder.submit();
            }
        }
    }
}
