//! A swapchain's images on the application's device.

use std::sync::Arc;

use ash::vk;
use openxr_sys as sys;
use openxr_sys::SwapchainUsageFlags as Usage;

use super::{Graphics, failure};
use crate::XrResult;

/// How many images go round.
const IMAGE_COUNT: u32 = 3;

/// The formats offered where the device has them, best first.
pub(super) const FORMATS: &[vk::Format] = &[
    vk::Format::R8G8B8A8_SRGB,
    vk::Format::B8G8R8A8_SRGB,
    vk::Format::R16G16B16A16_SFLOAT,
    vk::Format::R8G8B8A8_UNORM,
    vk::Format::B8G8R8A8_UNORM,
    vk::Format::D32_SFLOAT,
    vk::Format::D24_UNORM_S8_UINT,
    vk::Format::D32_SFLOAT_S8_UINT,
    vk::Format::D16_UNORM,
];

/// The images of a swapchain, destroyed with it.
pub(crate) struct SwapchainImages {
    graphics: Arc<Graphics>,
    images: Vec<Image>,
    pub(super) format: vk::Format,
    pub(super) is_multisampled: bool,
}

struct Image {
    image: vk::Image,
    memory: vk::DeviceMemory,
    /// Whether it is in the layout that the application is promised.
    is_laid_out: bool,
}

impl SwapchainImages {
    /// Makes the images that the application described; `info` is verified but for what the device has to say.
    pub fn new(
        graphics: Arc<Graphics>,
        info: &sys::SwapchainCreateInfo,
        view_formats: &[vk::Format],
    ) -> XrResult<Self> {
        let format = vk::Format::from_raw(info.format as i32);
        let mut images = Self {
            graphics,
            images: Vec::new(),
            format,
            is_multisampled: info.sample_count > 1,
        };
        let is_static = info
            .create_flags
            .contains(sys::SwapchainCreateFlags::STATIC_IMAGE);
        for _ in 0..if is_static { 1 } else { IMAGE_COUNT } {
            // those made so far are destroyed with `images` where one fails
            let image = images.make(info, view_formats)?;
            images.images.push(image);
        }
        Ok(images)
    }

    fn make(
        &self,
        info: &sys::SwapchainCreateInfo,
        view_formats: &[vk::Format],
    ) -> XrResult<Image> {
        let Graphics {
            device,
            instance,
            physical_device,
            ..
        } = &*self.graphics;
        let mut flags = vk::ImageCreateFlags::empty();
        if info.usage_flags.contains(Usage::MUTABLE_FORMAT) {
            flags |= vk::ImageCreateFlags::MUTABLE_FORMAT;
        }
        if info.face_count == 6 {
            flags |= vk::ImageCreateFlags::CUBE_COMPATIBLE;
        }
        let samples = vk::SampleCountFlags::from_raw(info.sample_count);
        let usage = usage(info.usage_flags, self.format);
        let layers = info.array_size * info.face_count;
        let (ty, tiling) = (vk::ImageType::TYPE_2D, vk::ImageTiling::OPTIMAL);
        // SAFETY: the device lives until the session is destroyed, and this swapchain before it; the image
        // is made within what the device says it can
        unsafe {
            let limits = instance
                .get_physical_device_image_format_properties(
                    *physical_device,
                    self.format,
                    ty,
                    tiling,
                    usage,
                    flags,
                )
                .map_err(|_| sys::Result::ERROR_FEATURE_UNSUPPORTED)?;
            let fits = limits.sample_counts.contains(samples)
                && info.mip_count <= limits.max_mip_levels
                && layers <= limits.max_array_layers
                && info.width <= limits.max_extent.width
                && info.height <= limits.max_extent.height;
            if !fits {
                return Err(sys::Result::ERROR_FEATURE_UNSUPPORTED);
            }
            let mut format_list =
                vk::ImageFormatListCreateInfo::default().view_formats(view_formats);
            let mut image_info = vk::ImageCreateInfo::default()
                .flags(flags)
                .image_type(ty)
                .format(self.format)
                .extent(vk::Extent3D {
                    width: info.width,
                    height: info.height,
                    depth: 1,
                })
                .mip_levels(info.mip_count)
                .array_layers(layers)
                .samples(samples)
                .tiling(tiling)
                .usage(usage)
                .initial_layout(vk::ImageLayout::UNDEFINED);
            if !view_formats.is_empty() {
                image_info = image_info.push_next(&mut format_list);
            }
            let image = device.create_image(&image_info, None).map_err(failure)?;
            let requirements = device.get_image_memory_requirements(image);
            let memory = self
                .graphics
                .allocate(requirements, vk::MemoryPropertyFlags::DEVICE_LOCAL);
            let bound = memory.and_then(|memory| {
                device
                    .bind_image_memory(image, memory, 0)
                    .map_err(|error| {
                        device.free_memory(memory, None);
                        failure(error)
                    })?;
                Ok(memory)
            });
            match bound {
                Ok(memory) => Ok(Image {
                    image,
                    memory,
                    is_laid_out: false,
                }),
                Err(error) => {
                    device.destroy_image(image, None);
                    Err(error)
                }
            }
        }
    }

    pub fn handles(&self) -> impl ExactSizeIterator<Item = vk::Image> {
        self.images.iter().map(|image| image.image)
    }

    pub fn count(&self) -> u32 {
        self.images.len() as u32
    }

    /// Brings an image into the layout in which the application is to find it, the first time that it is
    /// acquired: the queue may be used then, but not when the swapchain is made.
    pub fn lay_out(&mut self, index: u32) -> XrResult<()> {
        let layout = self.layout();
        let image = &mut self.images[index as usize];
        if image.is_laid_out {
            return Ok(());
        }
        let barrier = barrier(image.image, self.format, vk::ImageLayout::UNDEFINED, layout);
        // SAFETY: a new image that nobody uses yet; the application leaves the queue alone during
        // xrAcquireSwapchainImage
        unsafe {
            self.graphics
                .submit(|device, commands| pipeline_barrier(device, commands, barrier))?;
        }
        image.is_laid_out = true;
        Ok(())
    }

    /// The layout in which images change hands (XR_KHR_vulkan_enable2, "Swapchain Image Layout").
    pub(super) fn layout(&self) -> vk::ImageLayout {
        match is_depth(self.format) {
            true => vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
            false => vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
        }
    }

    pub(super) fn image(&self, index: u32) -> vk::Image {
        self.images[index as usize].image
    }

    pub(super) fn graphics(&self) -> &Graphics {
        &self.graphics
    }
}

impl Drop for SwapchainImages {
    fn drop(&mut self) {
        for image in &self.images {
            // SAFETY: the application is done with them when it destroys the swapchain; no work of ours is pending
            unsafe {
                self.graphics.device.destroy_image(image.image, None);
                self.graphics.device.free_memory(image.memory, None);
            }
        }
    }
}

impl Graphics {
    pub(super) fn allocate(
        &self,
        requirements: vk::MemoryRequirements,
        wanted: vk::MemoryPropertyFlags,
    ) -> XrResult<vk::DeviceMemory> {
        let memory_type = self
            .memory_type(requirements.memory_type_bits, wanted)
            .ok_or(sys::Result::ERROR_RUNTIME_FAILURE)?;
        let info = vk::MemoryAllocateInfo::default()
            .allocation_size(requirements.size)
            .memory_type_index(memory_type);
        // SAFETY: the device lives until the session is destroyed
        unsafe { self.device.allocate_memory(&info, None) }.map_err(failure)
    }
}

pub(super) fn is_depth(format: vk::Format) -> bool {
    aspects(format) != vk::ImageAspectFlags::COLOR
}

fn aspects(format: vk::Format) -> vk::ImageAspectFlags {
    match format {
        vk::Format::D16_UNORM | vk::Format::D32_SFLOAT => vk::ImageAspectFlags::DEPTH,
        vk::Format::D24_UNORM_S8_UINT | vk::Format::D32_SFLOAT_S8_UINT => {
            vk::ImageAspectFlags::DEPTH | vk::ImageAspectFlags::STENCIL
        }
        _ => vk::ImageAspectFlags::COLOR,
    }
}

/// The application's usage, and that of its own kind of attachment and of reading back.
fn usage(asked: Usage, format: vk::Format) -> vk::ImageUsageFlags {
    let mut usage = match is_depth(format) {
        true => vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT,
        false => vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC,
    };
    for (wish, flag) in [
        (Usage::UNORDERED_ACCESS, vk::ImageUsageFlags::STORAGE),
        (Usage::TRANSFER_SRC, vk::ImageUsageFlags::TRANSFER_SRC),
        (Usage::TRANSFER_DST, vk::ImageUsageFlags::TRANSFER_DST),
        (Usage::SAMPLED, vk::ImageUsageFlags::SAMPLED),
        (
            Usage::INPUT_ATTACHMENT,
            vk::ImageUsageFlags::INPUT_ATTACHMENT,
        ),
    ] {
        if asked.contains(wish) {
            usage |= flag;
        }
    }
    usage
}

/// All of an image from one layout into another, after all and before all that the queue does with it.
pub(super) fn barrier(
    image: vk::Image,
    format: vk::Format,
    from: vk::ImageLayout,
    to: vk::ImageLayout,
) -> vk::ImageMemoryBarrier<'static> {
    vk::ImageMemoryBarrier::default()
        .src_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)
        .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)
        .old_layout(from)
        .new_layout(to)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .image(image)
        .subresource_range(vk::ImageSubresourceRange {
            aspect_mask: aspects(format),
            base_mip_level: 0,
            level_count: vk::REMAINING_MIP_LEVELS,
            base_array_layer: 0,
            layer_count: vk::REMAINING_ARRAY_LAYERS,
        })
}

/// # Safety
/// The image is one of the device's and in the barrier's old layout.
pub(super) unsafe fn pipeline_barrier(
    device: &ash::Device,
    commands: vk::CommandBuffer,
    barrier: vk::ImageMemoryBarrier,
) {
    // SAFETY: as this function asks of its caller
    unsafe {
        device.cmd_pipeline_barrier(
            commands,
            vk::PipelineStageFlags::ALL_COMMANDS,
            vk::PipelineStageFlags::ALL_COMMANDS,
            vk::DependencyFlags::empty(),
            &[],
            &[],
            &[barrier],
        );
    }
}
