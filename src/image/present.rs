//! Draws an eye's picture onto a headset's (or a window's) image: mean radiance, exposure, tone curve.

use crate::gather::EyeImage;
use crate::gpu::layout::PresentUniform;
use crate::gpu::shader::{self, ShaderError};
use crate::gpu::{GpuDevice, resources};

/// The pipeline that shows pictures in one texture format.
pub struct Presenter {
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    uniform: wgpu::Buffer,
}

impl Presenter {
    /// Prepares for pictures like `image` on targets of `format`, which must store sRGB and take linear values.
    ///
    /// # Errors
    /// [`ShaderError`] when the embedded shader does not compose.
    pub fn new(
        gpu: &GpuDevice,
        image: &EyeImage,
        format: wgpu::TextureFormat,
    ) -> Result<Self, ShaderError> {
        let chunks = image.sums().chunks();
        let source = shader::compose("present", &|_| chunks)?;
        let module = gpu
            .device
            .create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("present"),
                source: wgpu::ShaderSource::Wgsl(source.into()),
            });
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty: wgpu::BindingType::Buffer {
                ty,
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        let layout = gpu
            .device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some("present"),
                entries: &(0..=chunks)
                    .map(|binding| match binding {
                        0 => entry(0, wgpu::BufferBindingType::Uniform),
                        _ => entry(
                            binding,
                            wgpu::BufferBindingType::Storage { read_only: true },
                        ),
                    })
                    .collect::<Vec<_>>(),
            });
        let pipeline_layout = gpu
            .device
            .create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some("present"),
                bind_group_layouts: &[Some(&layout)],
                immediate_size: 0,
            });
        let pipeline = gpu
            .device
            .create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some("present"),
                layout: Some(&pipeline_layout),
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some("vertex_main"),
                    compilation_options: Default::default(),
                    buffers: &[],
                },
                primitive: Default::default(),
                depth_stencil: None,
                multisample: Default::default(),
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some("fragment_main"),
                    compilation_options: Default::default(),
                    targets: &[Some(format.into())],
                }),
                multiview_mask: None,
                cache: None,
            });
        Ok(Self {
            pipeline,
            layout,
            uniform: resources::uniform::<PresentUniform>(gpu, "present"),
        })
    }

    /// Draws `image` over all of `target`, which has the same size; takes effect with the submission of `encoder`.
    pub fn record(
        &self,
        gpu: &GpuDevice,
        encoder: &mut wgpu::CommandEncoder,
        image: &EyeImage,
        exposure_ev: f32,
        target: &wgpu::TextureView,
    ) {
        let value = PresentUniform {
            size: [image.width(), image.height()],
            exposure: exposure_ev.exp2(),
            padding: 0,
        };
        gpu.queue
            .write_buffer(&self.uniform, 0, bytemuck::bytes_of(&value));
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("present"),
            layout: &self.layout,
            entries: &(0..)
                .zip(std::iter::once(&self.uniform).chain(image.sums().buffers()))
                .map(|(binding, buffer)| wgpu::BindGroupEntry {
                    binding,
                    resource: buffer.as_entire_binding(),
                })
                .collect::<Vec<_>>(),
        });
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("present"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
    }
}
