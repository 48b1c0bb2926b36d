//! A part of a submitted image, brought to host memory.

use ash::vk;
use openxr_sys as sys;

use super::images::{SwapchainImages, barrier, is_depth, pipeline_barrier};
use super::{Graphics, failure};
use crate::XrResult;

/// The texels of a rectangle, row by row from the top, as the format lays them out.
pub(crate) struct Texels {
    pub width: u32,
    pub height: u32,
    pub format: vk::Format,
    pub bytes: Vec<u8>,
}

impl SwapchainImages {
    /// Copies a rectangle, which lies within the image, of one array layer of a released image.
    pub fn read(&self, index: u32, rect: sys::Rect2Di, layer: u32) -> XrResult<Texels> {
        let graphics = self.graphics();
        let device = &graphics.device;
        let bytes_per_texel = match self.format {
            vk::Format::R16G16B16A16_SFLOAT => 8,
            format if is_depth(format) => return Err(sys::Result::ERROR_LAYER_INVALID),
            _ => 4,
        };
        let (width, height) = (rect.extent.width as u32, rect.extent.height as u32);
        let size = vk::DeviceSize::from(width) * vk::DeviceSize::from(height) * bytes_per_texel;
        let staging = Staging::new(graphics, size)?;
        let resolved = match self.is_multisampled {
            true => Some(Resolved::new(graphics, self.format, width, height)?),
            false => None,
        };
        let (image, held) = (self.image(index), self.layout());
        let readable = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        let subresource = |base_array_layer| vk::ImageSubresourceLayers {
            aspect_mask: vk::ImageAspectFlags::COLOR,
            mip_level: 0,
            base_array_layer,
            layer_count: 1,
        };
        let offset = vk::Offset3D {
            x: rect.offset.x,
            y: rect.offset.y,
            z: 0,
        };
        let extent = vk::Extent3D {
            width,
            height,
            depth: 1,
        };
        // SAFETY: the image was released in its layout and goes back to it; the rectangle and the layer lie
        // within it, the buffer has room for them; the application leaves the queue alone during xrEndFrame
        unsafe {
            graphics.submit(|device, commands| {
                pipeline_barrier(
                    device,
                    commands,
                    barrier(image, self.format, held, readable),
                );
                let (source, source_offset, source_layer) = match &resolved {
                    None => (image, offset, layer),
                    Some(resolved) => {
                        let writable = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
                        let layouts = [vk::ImageLayout::UNDEFINED, writable, readable];
                        let step = |from, to| barrier(resolved.image, self.format, from, to);
                        pipeline_barrier(device, commands, step(layouts[0], layouts[1]));
                        let region = vk::ImageResolve::default()
                            .src_subresource(subresource(layer))
                            .src_offset(offset)
                            .dst_subresource(subresource(0))
                            .extent(extent);
                        device.cmd_resolve_image(
                            commands,
                            image,
                            readable,
                            resolved.image,
                            writable,
                            &[region],
                        );
                        pipeline_barrier(device, commands, step(layouts[1], layouts[2]));
                        (resolved.image, vk::Offset3D::default(), 0)
                    }
                };
                let region = vk::BufferImageCopy::default()
                    .image_subresource(subresource(source_layer))
                    .image_offset(source_offset)
                    .image_extent(extent);
                device.cmd_copy_image_to_buffer(
                    commands,
                    source,
                    readable,
                    staging.buffer,
                    &[region],
                );
                pipeline_barrier(
                    device,
                    commands,
                    barrier(image, self.format, readable, held),
                );
                let for_host = vk::MemoryBarrier::default()
                    .src_access_mask(vk::AccessFlags::TRANSFER_WRITE)
                    .dst_access_mask(vk::AccessFlags::HOST_READ);
                device.cmd_pipeline_barrier(
                    commands,
                    vk::PipelineStageFlags::TRANSFER,
                    vk::PipelineStageFlags::HOST,
                    vk::DependencyFlags::empty(),
                    &[for_host],
                    &[],
                    &[],
                );
            })?;
            let mapped = device
                .map_memory(staging.memory, 0, size, vk::MemoryMapFlags::empty())
                .map_err(failure)?;
            let bytes = std::slice::from_raw_parts(mapped.cast::<u8>(), size as usize).to_vec();
            device.unmap_memory(staging.memory);
            Ok(Texels {
                width,
                height,
                format: self.format,
                bytes,
            })
        }
    }
}

/// A buffer that the host can read.
struct Staging<'a> {
    graphics: &'a Graphics,
    buffer: vk::Buffer,
    memory: vk::DeviceMemory,
}

impl<'a> Staging<'a> {
    fn new(graphics: &'a Graphics, size: vk::DeviceSize) -> XrResult<Self> {
        let info = vk::BufferCreateInfo::default()
            .size(size)
            .usage(vk::BufferUsageFlags::TRANSFER_DST);
        // every Vulkan device has memory of this kind for buffers (specification, "Device Memory")
        let visible =
            vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
        // SAFETY: the device lives until the session is destroyed
        unsafe {
            let buffer = graphics
                .device
                .create_buffer(&info, None)
                .map_err(failure)?;
            let requirements = graphics.device.get_buffer_memory_requirements(buffer);
            let mut staging = Self {
                graphics,
                buffer,
                memory: vk::DeviceMemory::null(),
            };
            staging.memory = graphics.allocate(requirements, visible)?;
            graphics
                .device
                .bind_buffer_memory(buffer, staging.memory, 0)
                .map_err(failure)?;
            Ok(staging)
        }
    }
}

impl Drop for Staging<'_> {
    fn drop(&mut self) {
        // SAFETY: made by this device; its work is done; null memory is let be
        unsafe {
            self.graphics.device.destroy_buffer(self.buffer, None);
            self.graphics.device.free_memory(self.memory, None);
        }
    }
}

/// An image with one sample a texel, into which one with several is resolved.
struct Resolved<'a> {
    graphics: &'a Graphics,
    image: vk::Image,
    memory: vk::DeviceMemory,
}

impl<'a> Resolved<'a> {
    fn new(graphics: &'a Graphics, format: vk::Format, width: u32, height: u32) -> XrResult<Self> {
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(vk::Extent3D {
                width,
                height,
                depth: 1,
            })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST);
        // SAFETY: the device lives until the session is destroyed
        unsafe {
            let image = graphics.device.create_image(&info, None).map_err(failure)?;
            let requirements = graphics.device.get_image_memory_requirements(image);
            let mut resolved = Self {
                graphics,
                image,
                memory: vk::DeviceMemory::null(),
            };
            resolved.memory =
                graphics.allocate(requirements, vk::MemoryPropertyFlags::DEVICE_LOCAL)?;
            graphics
                .device
                .bind_image_memory(image, resolved.memory, 0)
                .map_err(failure)?;
            Ok(resolved)
        }
    }
}

impl Drop for Resolved<'_> {
    fn drop(&mut self) {
        // SAFETY: made by this device; its work is done; null memory is let be
        unsafe {
            self.graphics.device.destroy_image(self.image, None);
            self.graphics.device.free_memory(self.memory, None);
        }
    }
}
