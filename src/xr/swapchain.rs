//! The pictures that go to the headset: one sRGB swapchain with a layer for each eye.

use ash::vk;

use super::headset::HeadsetInfo;
use super::{XrError, failed, interop};
use crate::gpu::GpuDevice;

/// How long the compositor may keep an image before the frame goes without, nanoseconds.
const IMAGE_WAIT_NS: i64 = 1_000_000_000;

/// Formats that a picture can have, with sRGB encoding done by the hardware.
const FORMATS: [(vk::Format, wgpu::TextureFormat); 2] = [
    (
        vk::Format::R8G8B8A8_SRGB,
        wgpu::TextureFormat::Rgba8UnormSrgb,
    ),
    (
        vk::Format::B8G8R8A8_SRGB,
        wgpu::TextureFormat::Bgra8UnormSrgb,
    ),
];

/// What has been done with the swapchain in this frame.
#[derive(Clone, Copy)]
enum Image {
    Free,
    /// Acquired, but the compositor still reads it.
    Acquired(usize),
    /// Ours to draw into.
    Ready,
}

/// One swapchain with the left eye in layer 0 and the right eye in layer 1.
pub(super) struct EyeSwapchain {
    // Views of the images; dropped before the images.
    targets: Vec<[wgpu::TextureView; 2]>,
    pub handle: openxr::Swapchain<openxr::Vulkan>,
    pub format: wgpu::TextureFormat,
    /// Width and height of each eye's image, pixels.
    pub size: [u32; 2],
    image: Image,
}

impl EyeSwapchain {
    /// Makes the swapchain: `wanted` is the image size per eye in pixels, else the one that the runtime recommends.
    pub fn new(
        session: &openxr::Session<openxr::Vulkan>,
        gpu: &GpuDevice,
        headset: &HeadsetInfo,
        wanted: Option<[u32; 2]>,
    ) -> Result<Self, XrError> {
        let [width, height] = image_size(wanted, headset)?;
        let offered = session
            .enumerate_swapchain_formats()
            .map_err(failed("xrEnumerateSwapchainFormats"))?;
        let (vulkan_format, format) = offered
            .iter()
            .find_map(|offer| {
                FORMATS
                    .into_iter()
                    .find(|(known, _)| known.as_raw() as u32 == *offer)
            })
            .ok_or_else(|| XrError::Unsuitable {
                runtime: headset.runtime_name.clone(),
                reason: "it offers no 8-bit sRGB swapchain".into(),
            })?;
        let handle = session
            .create_swapchain(&openxr::SwapchainCreateInfo {
                create_flags: openxr::SwapchainCreateFlags::EMPTY,
                usage_flags: openxr::SwapchainUsageFlags::COLOR_ATTACHMENT,
                format: vulkan_format.as_raw() as u32,
                sample_count: 1,
                width,
                height,
                face_count: 1,
                array_size: 2,
                mip_count: 1,
            })
            .map_err(failed("xrCreateSwapchain"))?;
        let size = wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 2,
        };
        let targets = handle
            .enumerate_images()
            .map_err(failed("xrEnumerateSwapchainImages"))?
            .into_iter()
            .map(|image| {
                let texture = interop::wrap_image(gpu, image, format, size)?;
                Ok([eye_view(&texture, 0), eye_view(&texture, 1)])
            })
            .collect::<Result<_, XrError>>()?;
        Ok(Self {
            targets,
            handle,
            format,
            size: [width, height],
            image: Image::Free,
        })
    }

    /// Takes the next image to draw into, left eye first; `None` if the compositor does not give one back in time.
    pub fn acquire(&mut self) -> Result<Option<[wgpu::TextureView; 2]>, XrError> {
        let index = match self.image {
            Image::Acquired(index) => index,
            Image::Free | Image::Ready => {
                self.handle
                    .acquire_image()
                    .map_err(failed("xrAcquireSwapchainImage"))? as usize
            }
        };
        self.image = Image::Acquired(index);
        if !interop::wait_image(&self.handle, openxr::Duration::from_nanos(IMAGE_WAIT_NS))? {
            tracing::warn!(
                "the OpenXR runtime held back its images for a second; skipping a frame"
            );
            return Ok(None);
        }
        self.image = Image::Ready;
        Ok(self.targets.get(index).cloned())
    }

    /// Gives the image back to the compositor, if one was taken. All drawing into it must be submitted.
    pub fn release(&mut self) -> Result<(), XrError> {
        if matches!(self.image, Image::Ready) {
            interop::release_image(&self.handle)?;
            self.image = Image::Free;
        }
        Ok(())
    }
}

fn eye_view(texture: &wgpu::Texture, layer: u32) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        label: Some(["left eye", "right eye"][layer as usize]),
        dimension: Some(wgpu::TextureViewDimension::D2),
        base_array_layer: layer,
        array_layer_count: Some(1),
        ..Default::default()
    })
}

fn image_size(wanted: Option<[u32; 2]>, headset: &HeadsetInfo) -> Result<[u32; 2], XrError> {
    let [width, height] = wanted.unwrap_or(headset.recommended_size);
    let [max_width, max_height] = headset.max_size;
    if (1..=max_width).contains(&width) && (1..=max_height).contains(&height) {
        Ok([width, height])
    } else {
        Err(XrError::ImageSize {
            width,
            height,
            max_width,
            max_height,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headset() -> HeadsetInfo {
        HeadsetInfo {
            runtime_name: "test".into(),
            runtime_version: "1.0.0".into(),
            system_name: "test".into(),
            supports_eye_gaze: false,
            recommended_size: [1000, 900],
            max_size: [2000, 1800],
        }
    }

    #[test]
    fn the_image_size_is_the_recommended_one_unless_asked_for() {
        assert_eq!(image_size(None, &headset()).ok(), Some([1000, 900]));
        assert_eq!(
            image_size(Some([320, 320]), &headset()).ok(),
            Some([320, 320])
        );
    }

    #[test]
    fn an_empty_or_too_large_image_is_refused_with_the_largest_there_is() {
        for size in [[0, 10], [10, 0], [2001, 10], [10, 1801]] {
            let error = image_size(Some(size), &headset()).expect_err("must be refused");
            assert!(error.to_string().contains("2000x1800"), "{error}");
        }
    }
}
