//! Swapchains: made, and their images passed to and fro.

use ash::vk::{self, Handle as _};
use openxr_sys as sys;

use super::functions;
use super::pointer::{Out, array, chained};
use crate::XrResult;
use crate::config::MAX_SWAPCHAIN_SIZE;
use crate::runtime::runtime;
use crate::swapchain::{ImageQueue, Swapchain};
use crate::two_call::{two_call, two_call_values};
use crate::vulkan::SwapchainImages;

/// The usage and creation flags that the core of the specification knows.
const USAGE_BITS: u64 = 0xff;
const CREATE_BITS: u64 = 0b11;

/// `VALIDATION_FAILURE` for what can't be an image of any headset.
fn verify(info: &sys::SwapchainCreateInfo) -> XrResult<()> {
    let size = 1..=MAX_SWAPCHAIN_SIZE;
    let longest = info.width.max(info.height).max(1);
    let is_sound = size.contains(&info.width)
        && size.contains(&info.height)
        && (1..=longest.ilog2() + 1).contains(&info.mip_count)
        && info.array_size >= 1
        && matches!(info.face_count, 1 | 6)
        && info.sample_count.is_power_of_two()
        && info.usage_flags.into_raw() & !USAGE_BITS == 0
        && info.create_flags.into_raw() & !CREATE_BITS == 0;
    if !is_sound {
        return Err(sys::Result::ERROR_VALIDATION_FAILURE);
    }
    if info
        .create_flags
        .contains(sys::SwapchainCreateFlags::PROTECTED_CONTENT)
    {
        return Err(sys::Result::ERROR_FEATURE_UNSUPPORTED);
    }
    Ok(())
}

functions! {
    fn enumerate_swapchain_formats(
        session: sys::Session,
        capacity: u32,
        count: *mut u32,
        formats: *mut i64,
    ) {
        let runtime = runtime();
        let (of_session, _) = runtime.peek(session)?;
        let supported = of_session.graphics.as_ref().map(|it| it.formats()).unwrap_or_default();
        let raw: Vec<_> = supported.into_iter().map(|format| i64::from(format.as_raw())).collect();
        two_call_values(capacity, count, formats, &raw)
    }

    fn create_swapchain(
        session: sys::Session,
        create_info: *const sys::SwapchainCreateInfo,
        swapchain: *mut sys::Swapchain,
    ) {
        let mut runtime = runtime();
        let (of_session, _) = runtime.peek(session)?;
        let info = create_info.verified()?;
        if swapchain.is_null() {
            return Err(sys::Result::ERROR_VALIDATION_FAILURE);
        }
        verify(info)?;
        let unsupported = sys::Result::ERROR_SWAPCHAIN_FORMAT_UNSUPPORTED;
        let graphics = of_session.graphics.clone().ok_or(unsupported)?;
        if !graphics.formats().iter().any(|format| i64::from(format.as_raw()) == info.format) {
            return Err(unsupported);
        }
        let list = chained::<sys::VulkanSwapchainFormatListCreateInfoKHR>(info, info.next)?;
        let view_formats: Vec<_> = match list {
            Some(list) => array(list, list.view_formats, list.view_format_count)?
                .iter()
                .map(|&format| vk::Format::from_raw(format as i32))
                .collect(),
            None => Vec::new(),
        };
        let images = SwapchainImages::new(graphics, info, &view_formats)?;
        let is_static = info.create_flags.contains(sys::SwapchainCreateFlags::STATIC_IMAGE);
        let queue = ImageQueue::new(images.count(), is_static);
        let (size, array_size) = ([info.width, info.height], info.array_size);
        let made = Swapchain { session, size, array_size, queue, images };
        swapchain.set(runtime.swapchains.insert(made))
    }

    fn destroy_swapchain(swapchain: sys::Swapchain) {
        runtime().swapchains.remove(swapchain).map(drop)
    }

    fn enumerate_swapchain_images(
        swapchain: sys::Swapchain,
        capacity: u32,
        count: *mut u32,
        images: *mut sys::SwapchainImageBaseHeader,
    ) {
        let runtime = runtime();
        let swapchain = runtime.swapchains.get(swapchain)?;
        let images: Out<sys::SwapchainImageVulkanKHR> = images.cast();
        two_call(capacity, count, images, swapchain.images.handles(), |mut out, image| {
            out.verified()?.image = image.as_raw();
            Ok(())
        })
    }

    fn acquire_swapchain_image(
        swapchain: sys::Swapchain,
        acquire_info: *const sys::SwapchainImageAcquireInfo,
        index: *mut u32,
    ) {
        let mut runtime = runtime();
        let swapchain = runtime.swapchains.get_mut(swapchain)?;
        acquire_info.verified_or_null()?;
        if index.is_null() {
            return Err(sys::Result::ERROR_VALIDATION_FAILURE);
        }
        let acquired = swapchain.queue.acquire()?;
        swapchain.images.lay_out(acquired)?;
        index.set(acquired)
    }

    fn wait_swapchain_image(
        swapchain: sys::Swapchain,
        wait_info: *const sys::SwapchainImageWaitInfo,
    ) {
        let mut runtime = runtime();
        let swapchain = runtime.swapchains.get_mut(swapchain)?;
        wait_info.verified()?;
        swapchain.queue.wait()
    }

    fn release_swapchain_image(
        swapchain: sys::Swapchain,
        release_info: *const sys::SwapchainImageReleaseInfo,
    ) {
        let mut runtime = runtime();
        let swapchain = runtime.swapchains.get_mut(swapchain)?;
        release_info.verified_or_null()?;
        swapchain.queue.release()
    }
}
