//! Kernels (a compiled entry point), what they bind, and the recording of timed passes.

use std::collections::BTreeMap;
use std::time::Instant;

use bytemuck::Pod;

use super::device::{GpuDevice, GpuError};
use super::resources::TexelArray;
use super::shader::{self, BindingKind, Reflection, ShaderError, Stage};
use super::timing::{PassTime, PassTimer};

/// A compute pipeline with the names of what it binds.
#[derive(Debug)]
pub struct Kernel {
    stage: Stage,
    pipeline: wgpu::ComputePipeline,
    group_layouts: Vec<wgpu::BindGroupLayout>,
    reflection: Reflection,
}

/// `override` constants of a kernel, by name. Constants that a shader does not declare are left out for it.
pub type Constants = [(&'static str, f64)];

impl Kernel {
    /// Compiles `stage` with the given constants and array splits.
    ///
    /// # Errors
    /// [`ShaderError`] when the embedded source does not compose or validate, or needs too many buffers.
    pub fn new(
        gpu: &GpuDevice,
        stage: Stage,
        constants: &Constants,
        size_of_name: &dyn Fn(&str) -> u32,
    ) -> Result<Self, ShaderError> {
        Self::from_source(
            gpu,
            stage,
            shader::compose(stage.name, size_of_name)?,
            constants,
        )
    }

    /// Compiles a composed source that is not in the registry, a test's or a benchmark's; its entry point has the stage's name.
    ///
    /// # Errors
    /// [`ShaderError`] when the source does not validate or needs too many buffers.
    pub fn from_source(
        gpu: &GpuDevice,
        stage: Stage,
        source: String,
        constants: &Constants,
    ) -> Result<Self, ShaderError> {
        let reflection = shader::reflect(stage.name, &source, stage.name)?;
        let is_storage = |kind| {
            matches!(
                kind,
                BindingKind::StorageRead | BindingKind::StorageReadWrite
            )
        };
        let storage = reflection.bindings.iter().filter(|b| is_storage(b.kind));
        let needed = storage.count() as u32;
        let allowed = gpu.device.limits().max_storage_buffers_per_shader_stage;
        if needed > allowed {
            return Err(ShaderError::TooManyBuffers {
                stage: stage.name.into(),
                needed,
                allowed,
            });
        }
        let descriptor = wgpu::ShaderModuleDescriptor {
            label: Some(stage.name),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        };
        // SAFETY: bounds checks and loop bounding cost a third of the traversal's speed. Every index in our shaders is either below
        // a count that the host wrote together with the buffer, or compared with the array's length; every loop is bounded by a
        // count or by the depth of a BVH that the host measured.
        let module = unsafe {
            gpu.device
                .create_shader_module_trusted(descriptor, wgpu::ShaderRuntimeChecks::unchecked())
        };
        let group_count = reflection
            .bindings
            .iter()
            .map(|b| b.group + 1)
            .max()
            .unwrap_or(0);
        let group_layouts: Vec<wgpu::BindGroupLayout> = (0..group_count)
            .map(|group| {
                let entries: Vec<wgpu::BindGroupLayoutEntry> = reflection
                    .bindings
                    .iter()
                    .filter(|binding| binding.group == group)
                    .map(|binding| layout_entry(binding.binding, binding.kind))
                    .collect();
                gpu.device
                    .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                        label: Some(stage.name),
                        entries: &entries,
                    })
            })
            .collect();
        let layout_refs: Vec<Option<&wgpu::BindGroupLayout>> =
            group_layouts.iter().map(Some).collect();
        let layout = gpu
            .device
            .create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(stage.name),
                bind_group_layouts: &layout_refs,
                immediate_size: 0,
            });
        let known: Vec<(&str, f64)> = constants
            .iter()
            .copied()
            .filter(|(name, _)| reflection.overrides.iter().any(|declared| declared == name))
            .collect();
        let pipeline = gpu
            .device
            .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(stage.name),
                layout: Some(&layout),
                module: &module,
                entry_point: Some(stage.name),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants: &known,
                    ..Default::default()
                },
                cache: None,
            });
        Ok(Self {
            stage,
            pipeline,
            group_layouts,
            reflection,
        })
    }

    /// Binds the kernel's resources by their names in WGSL.
    ///
    /// # Errors
    /// [`GpuError::Unbound`] names the resource that `resources` lacks.
    pub fn bind(
        &self,
        gpu: &GpuDevice,
        resources: &Resources<'_>,
    ) -> Result<BoundKernel, GpuError> {
        let mut groups = Vec::with_capacity(self.group_layouts.len());
        for (group, layout) in self.group_layouts.iter().enumerate() {
            let mut entries = Vec::new();
            for binding in self
                .reflection
                .bindings
                .iter()
                .filter(|b| b.group as usize == group)
            {
                let resource = resources
                    .get(&binding.name)
                    .ok_or_else(|| GpuError::Unbound {
                        stage: self.stage.name.into(),
                        resource: binding.name.clone(),
                    })?;
                entries.push(wgpu::BindGroupEntry {
                    binding: binding.binding,
                    resource,
                });
            }
            groups.push(gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(self.stage.name),
                layout,
                entries: &entries,
            }));
        }
        Ok(BoundKernel {
            stage: self.stage,
            pipeline: self.pipeline.clone(),
            groups,
            workgroup_size: self.reflection.workgroup_size,
        })
    }
}

fn layout_entry(binding: u32, kind: BindingKind) -> wgpu::BindGroupLayoutEntry {
    let buffer = |ty| wgpu::BindingType::Buffer {
        ty,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let ty = match kind {
        BindingKind::Uniform => buffer(wgpu::BufferBindingType::Uniform),
        BindingKind::StorageRead => buffer(wgpu::BufferBindingType::Storage { read_only: true }),
        BindingKind::StorageReadWrite => {
            buffer(wgpu::BufferBindingType::Storage { read_only: false })
        }
        BindingKind::TexelArray {
            is_float,
            is_layered,
        } => wgpu::BindingType::StorageTexture {
            access: wgpu::StorageTextureAccess::ReadOnly,
            format: if is_float {
                wgpu::TextureFormat::Rgba32Float
            } else {
                wgpu::TextureFormat::Rgba32Uint
            },
            view_dimension: if is_layered {
                wgpu::TextureViewDimension::D2Array
            } else {
                wgpu::TextureViewDimension::D2
            },
        },
    };
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty,
        count: None,
    }
}

/// Buffers and textures by their names in WGSL.
#[derive(Clone, Default)]
pub struct Resources<'a> {
    by_name: BTreeMap<String, wgpu::BindingResource<'a>>,
}

impl<'a> Resources<'a> {
    /// Adds a whole buffer under a name; a later one replaces an earlier one.
    pub fn with(mut self, name: &str, buffer: &'a wgpu::Buffer) -> Self {
        self.by_name
            .insert(name.to_owned(), buffer.as_entire_binding());
        self
    }

    /// Adds an array in a texture under its name.
    pub fn with_texel_array(mut self, array: &'a TexelArray) -> Self {
        let view = wgpu::BindingResource::TextureView(array.view());
        self.by_name.insert(array.name().to_owned(), view);
        self
    }

    /// Adds all of `other`.
    pub fn with_all(mut self, other: Resources<'a>) -> Self {
        self.by_name.extend(other.by_name);
        self
    }

    fn get(&self, name: &str) -> Option<wgpu::BindingResource<'a>> {
        self.by_name.get(name).cloned()
    }
}

/// A kernel with its buffers, ready to dispatch.
#[derive(Clone, Debug)]
pub struct BoundKernel {
    stage: Stage,
    pipeline: wgpu::ComputePipeline,
    groups: Vec<wgpu::BindGroup>,
    workgroup_size: [u32; 3],
}

/// Most workgroups in one dimension of a dispatch (WebGPU's default limit, the smallest that Vulkan guarantees).
pub const WORKGROUPS_PER_DIMENSION: u32 = 65_535;

/// How many threads a dispatch has.
#[derive(Clone, Copy, Debug)]
pub enum Threads<'a> {
    /// As many, rounded up to whole workgroups.
    Count(u32),
    /// As many workgroups as the device wrote into this buffer (three counts, made by [`super::resources::dispatch_counts`]).
    OnDevice(&'a wgpu::Buffer),
}

/// Records work for the device, each group of dispatches under a name that shows in the timings, and submits it in portions: a
/// submission that takes seconds would freeze a desktop, or be taken for a hang.
pub struct Recorder<'a> {
    gpu: &'a GpuDevice,
    encoder: wgpu::CommandEncoder,
    timer: &'a mut PassTimer,
    failed: Option<GpuError>,
}

impl<'a> Recorder<'a> {
    /// Starts recording; passes are timed by `timer`.
    pub fn new(gpu: &'a GpuDevice, timer: &'a mut PassTimer) -> Self {
        let encoder = gpu.device.create_command_encoder(&Default::default());
        Self {
            gpu,
            encoder,
            timer,
            failed: None,
        }
    }

    /// The device recorded for.
    pub fn gpu(&self) -> &'a GpuDevice {
        self.gpu
    }

    /// The encoder, for copies and clears between passes.
    pub fn encoder(&mut self) -> &mut wgpu::CommandEncoder {
        &mut self.encoder
    }

    /// One timed pass of several dispatches, each with its count of threads. Dispatches see the writes of those before them.
    pub fn pass(&mut self, name: &'static str, dispatches: &[(&BoundKernel, u32)]) {
        let dispatches: Vec<_> = dispatches
            .iter()
            .map(|(kernel, threads)| (*kernel, Threads::Count(*threads)))
            .collect();
        self.pass_of(name, &dispatches);
    }

    /// As [`Recorder::pass`], with counts that may be known to the device only.
    pub fn pass_of(&mut self, name: &'static str, dispatches: &[(&BoundKernel, Threads<'_>)]) {
        if self.timer.waits_before(name) {
            self.submit();
            // What fails here is kept for `finish`.
            self.failed = self.failed.take().or(self.gpu.wait("rendering").err());
            self.timer.starts(name);
        }
        self.record_pass(name, dispatches);
    }

    fn record_pass(&mut self, name: &'static str, dispatches: &[(&BoundKernel, Threads<'_>)]) {
        let timestamp_writes = self.timer.compute_writes(name);
        let mut pass = self
            .encoder
            .begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some(name),
                timestamp_writes,
            });
        for (kernel, threads) in dispatches {
            pass.set_pipeline(&kernel.pipeline);
            for (index, group) in kernel.groups.iter().enumerate() {
                pass.set_bind_group(index as u32, group, &[]);
            }
            match threads {
                Threads::Count(0) => {}
                Threads::Count(threads) => {
                    let groups = threads.div_ceil(kernel.workgroup_size[0]);
                    // Shaders number their workgroups row by row (shaders/threads.wgsl).
                    let rows = groups.div_ceil(WORKGROUPS_PER_DIMENSION);
                    pass.dispatch_workgroups(groups.min(WORKGROUPS_PER_DIMENSION), rows, 1);
                }
                Threads::OnDevice(workgroups) => pass.dispatch_workgroups_indirect(workgroups, 0),
            }
        }
    }

    /// Runs work of the host as a timed pass; what was recorded before goes to the device first.
    pub fn on_host<T>(&mut self, name: &'static str, work: impl FnOnce() -> T) -> T {
        self.submit();
        self.failed = self.failed.take().or(self.gpu.wait("rendering").err());
        let started = Instant::now();
        let done = work();
        self.timer.add_host_pass(name, started);
        done
    }

    /// Submits what was recorded so far and goes on.
    pub fn submit(&mut self) {
        let next = self.gpu.device.create_command_encoder(&Default::default());
        self.gpu
            .queue
            .submit([std::mem::replace(&mut self.encoder, next).finish()]);
    }

    /// Submits the rest, waits for all of it and reads the times of the passes.
    ///
    /// # Errors
    /// [`GpuError::Failed`] when the device is lost.
    pub fn finish(mut self) -> Result<Vec<PassTime>, GpuError> {
        self.timer.resolve(&mut self.encoder);
        self.gpu.queue.submit([self.encoder.finish()]);
        self.gpu.wait("rendering")?;
        if let Some(error) = self.failed.take() {
            return Err(error);
        }
        self.timer.read(self.gpu)
    }
}

/// Values that one uniform buffer takes on, one after the other, within a submission.
#[derive(Debug)]
pub struct UniformSequence {
    uniform: wgpu::Buffer,
    values: wgpu::Buffer,
    stride: u64,
}

impl UniformSequence {
    /// Room for `count` values of `T`.
    pub fn new<T: Pod>(gpu: &GpuDevice, name: &str, count: u32) -> Self {
        let stride = (size_of::<T>() as u64).next_multiple_of(16);
        let values = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(name),
            size: stride * u64::from(count.max(1)),
            usage: wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self {
            uniform: super::resources::uniform::<T>(gpu, name),
            values,
            stride,
        }
    }

    /// The uniform buffer to bind.
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.uniform
    }

    /// Writes all values; they hold from the next submission on.
    pub fn write<T: Pod>(&self, gpu: &GpuDevice, values: &[T]) {
        let mut bytes = vec![0u8; self.stride as usize * values.len()];
        for (slot, value) in bytes.chunks_exact_mut(self.stride as usize).zip(values) {
            slot[..size_of::<T>()].copy_from_slice(bytemuck::bytes_of(value));
        }
        gpu.queue.write_buffer(&self.values, 0, &bytes);
    }

    /// Lets the uniform hold value `index` for the passes recorded from here on.
    pub fn select(&self, recorder: &mut Recorder<'_>, index: u32) {
        let offset = self.stride * u64::from(index);
        recorder.encoder().copy_buffer_to_buffer(
            &self.values,
            offset,
            &self.uniform,
            0,
            self.stride,
        );
    }
}

impl BoundKernel {
    /// The stage that this kernel runs.
    pub fn stage(&self) -> Stage {
        self.stage
    }
}
