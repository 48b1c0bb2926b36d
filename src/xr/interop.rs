//! The one unsafe file of the room: the loader, the Vulkan device and images that cross between runtime and wgpu
//! (`XR_KHR_vulkan_enable2`), and the few calls that the openxr crate does not wrap whole.

use std::ffi::c_void;
use std::mem::MaybeUninit;

use ash::vk::{self, Handle as _};
use openxr::sys;
use wgpu::hal;
use wgpu::hal::vulkan::Api as Vulkan;

use super::{XrError, failed};
use crate::gpu::device::vulkan_error;
use crate::gpu::{GpuDevice, GpuError, VulkanMaker};

/// Where the OpenXR functions come from. Everything after [`Runtime::entry`] is the same for both.
#[derive(Clone, Copy, Debug)]
pub enum Runtime {
    /// The active runtime of this machine, through the standard loader.
    System,
    /// A runtime linked into this program, by its `xrGetInstanceProcAddr`. It is trusted to be one, as all linked code is.
    InProcess(sys::pfn::GetInstanceProcAddr),
}

impl Runtime {
    /// The entry to the API.
    ///
    /// # Errors
    /// [`XrError::NoLoader`] where the loader is not installed.
    pub fn entry(self) -> Result<openxr::Entry, XrError> {
        match self {
            // SAFETY: the system's OpenXR loader is trusted like a driver.
            Runtime::System => unsafe { openxr::Entry::load(&()) }.map_err(XrError::NoLoader),
            Runtime::InProcess(function) => {
                // SAFETY: the variant promises that this is a runtime's `xrGetInstanceProcAddr`.
                unsafe { openxr::Entry::from_get_instance_proc_addr(function, &()) }
                    .map_err(failed("xrGetInstanceProcAddr"))
            }
        }
    }
}

/// `Ok` with the success code, or the error.
fn checked(call: &'static str, result: sys::Result) -> Result<sys::Result, XrError> {
    if result.into_raw() >= 0 {
        Ok(result)
    } else {
        Err(XrError::Call { call, result })
    }
}

/// Whether the system tracks eyes: `XrSystemEyeGazeInteractionPropertiesEXT`. Needs `XR_EXT_eye_gaze_interaction` to be enabled.
pub(super) fn supports_eye_gaze(
    instance: &openxr::Instance,
    system: openxr::SystemId,
) -> Result<bool, XrError> {
    let mut eye_gaze = sys::SystemEyeGazeInteractionPropertiesEXT {
        ty: sys::SystemEyeGazeInteractionPropertiesEXT::TYPE,
        next: std::ptr::null_mut(),
        supports_eye_gaze_interaction: sys::FALSE,
    };
    let mut properties = sys::SystemProperties::out((&raw mut eye_gaze).cast());
    // SAFETY: instance and system are alive; the chained struct is typed and outlives the call.
    let result = unsafe {
        (instance.fp().get_system_properties)(instance.as_raw(), system, properties.as_mut_ptr())
    };
    checked("xrGetSystemProperties", result)?;
    Ok(eye_gaze.supports_eye_gaze_interaction.into())
}

/// Makes the Vulkan instance and device through the runtime, which adds the extensions that it needs.
pub(super) struct RuntimeVulkan<'a> {
    instance: &'a openxr::Instance,
    system: openxr::SystemId,
    proc_addr: sys::platform::VkGetInstanceProcAddr,
    // `proc_addr` is a function of this library.
    _library: ash::Entry,
}

impl<'a> RuntimeVulkan<'a> {
    /// Prepares to make the device that `system` renders with.
    ///
    /// # Errors
    /// [`GpuError::NoLoader`] without Vulkan; [`XrError::Call`] where the runtime does not answer.
    pub fn new(instance: &'a openxr::Instance, system: openxr::SystemId) -> Result<Self, XrError> {
        // xrCreateVulkanInstanceKHR is only allowed after this call. The versions it gives are those tried by the runtime, no limits.
        instance
            .graphics_requirements::<openxr::Vulkan>(system)
            .map_err(failed("xrGetVulkanGraphicsRequirements2KHR"))?;
        // SAFETY: the system's Vulkan loader is trusted like any driver.
        let library = unsafe { ash::Entry::load() }.map_err(GpuError::NoLoader)?;
        let function = library.static_fn().get_instance_proc_addr;
        // SAFETY: the same C function; ash and openxr only name its handle types differently (a newtype of a pointer, and a pointer).
        let proc_addr = unsafe {
            std::mem::transmute::<vk::PFN_vkGetInstanceProcAddr, sys::platform::VkGetInstanceProcAddr>(
                function,
            )
        };
        Ok(Self {
            instance,
            system,
            proc_addr,
            _library: library,
        })
    }
}

fn refused(call: &'static str) -> impl Fn(sys::Result) -> GpuError {
    move |result| GpuError::Runtime(format!("{call}: {result:?} ({result})"))
}

fn vulkan_refused(call: &'static str) -> impl Fn(i32) -> GpuError {
    move |result| vulkan_error(call)(vk::Result::from_raw(result))
}

impl VulkanMaker for RuntimeVulkan<'_> {
    fn create_instance(
        &self,
        _entry: &ash::Entry,
        info: &vk::InstanceCreateInfo<'_>,
    ) -> Result<vk::Instance, GpuError> {
        // SAFETY: `info` is a VkInstanceCreateInfo that outlives the call.
        let instance = unsafe {
            self.instance.create_vulkan_instance(
                self.system,
                self.proc_addr,
                std::ptr::from_ref(info).cast(),
            )
        }
        .map_err(refused("xrCreateVulkanInstanceKHR"))?
        .map_err(vulkan_refused(
            "vkCreateInstance, called by the OpenXR runtime,",
        ))?;
        Ok(vk::Instance::from_raw(instance as u64))
    }

    fn physical_device(&self, instance: &ash::Instance) -> Result<vk::PhysicalDevice, GpuError> {
        let raw_instance = instance.handle().as_raw() as *const c_void;
        // SAFETY: the instance was made by `create_instance` above and is alive.
        let device = unsafe {
            self.instance
                .vulkan_graphics_device(self.system, raw_instance)
        }
        .map_err(refused("xrGetVulkanGraphicsDevice2KHR"))?;
        Ok(vk::PhysicalDevice::from_raw(device as u64))
    }

    fn create_device(
        &self,
        _instance: &ash::Instance,
        physical_device: vk::PhysicalDevice,
        info: &vk::DeviceCreateInfo<'_>,
    ) -> Result<vk::Device, GpuError> {
        // SAFETY: the physical device is the runtime's own; `info` is a VkDeviceCreateInfo that outlives the call.
        let device = unsafe {
            self.instance.create_vulkan_device(
                self.system,
                self.proc_addr,
                physical_device.as_raw() as *const c_void,
                std::ptr::from_ref(info).cast(),
            )
        }
        .map_err(refused("xrCreateVulkanDeviceKHR"))?
        .map_err(vulkan_refused(
            "vkCreateDevice, called by the OpenXR runtime,",
        ))?;
        Ok(vk::Device::from_raw(device as u64))
    }
}

/// Makes the session on the device.
pub(super) fn create_session(
    instance: &openxr::Instance,
    system: openxr::SystemId,
    gpu: &GpuDevice,
) -> Result<
    (
        openxr::Session<openxr::Vulkan>,
        openxr::FrameWaiter,
        openxr::FrameStream<openxr::Vulkan>,
    ),
    XrError,
> {
    let binding = openxr::vulkan::SessionCreateInfo {
        instance: gpu.raw.instance.as_raw() as *const c_void,
        physical_device: gpu.raw.physical_device.as_raw() as *const c_void,
        device: gpu.raw.device.as_raw() as *const c_void,
        queue_family_index: gpu.raw.queue_family_index,
        queue_index: 0,
    };
    // SAFETY: the handles were made by this runtime for this system, and `XrApp` drops the session before the device.
    unsafe { instance.create_session::<openxr::Vulkan>(system, &binding) }
        .map_err(failed("xrCreateSession"))
}

/// Presents one swapchain image to wgpu as a render target. The runtime keeps owning the image.
///
/// `XR_KHR_vulkan_enable2` hands images over in, and wants them back in, `COLOR_ATTACHMENT_OPTIMAL`: as render target is the only use
/// allowed here, wgpu leaves them so.
pub(super) fn wrap_image(
    gpu: &GpuDevice,
    image: u64,
    format: wgpu::TextureFormat,
    size: wgpu::Extent3d,
) -> Result<wgpu::Texture, XrError> {
    let descriptor = hal::TextureDescriptor {
        label: Some("eye image"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUses::COLOR_TARGET,
        memory_flags: hal::MemoryFlags::empty(),
        view_formats: Vec::new(),
    };
    // Without a callback wgpu would destroy the runtime's image.
    let keep_image = Box::new(|| ());
    // SAFETY: the device is a Vulkan device and is not destroyed through the guard.
    let hal_device =
        unsafe { gpu.device.as_hal::<Vulkan>() }.ok_or_else(|| GpuError::Unsuitable {
            device: gpu.info.name.clone(),
            reason: "it is not driven through Vulkan".into(),
        })?;
    // SAFETY: a live VkImage of this device with the described size, format and usage, as asked for in xrCreateSwapchain.
    let hal_texture = unsafe {
        hal_device.texture_from_raw(
            vk::Image::from_raw(image),
            &descriptor,
            Some(keep_image),
            hal::vulkan::TextureMemory::External,
        )
    };
    drop(hal_device);
    let descriptor = wgpu::TextureDescriptor {
        label: descriptor.label,
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    };
    // SAFETY: made from this device just above, and in the layout of a colour target.
    Ok(unsafe {
        gpu.device.create_texture_from_hal::<Vulkan>(
            hal_texture,
            &descriptor,
            wgpu::TextureUses::COLOR_TARGET,
        )
    })
}

/// `xrWaitSwapchainImage` with an end: `false` if the image was not free in time. The openxr crate takes a time-out for success.
pub(super) fn wait_image(
    swapchain: &openxr::Swapchain<openxr::Vulkan>,
    timeout: openxr::Duration,
) -> Result<bool, XrError> {
    let info = sys::SwapchainImageWaitInfo {
        ty: sys::SwapchainImageWaitInfo::TYPE,
        next: std::ptr::null(),
        timeout,
    };
    // SAFETY: the swapchain is alive and `info` outlives the call.
    let result =
        unsafe { (swapchain.instance().fp().wait_swapchain_image)(swapchain.as_raw(), &info) };
    let code = checked("xrWaitSwapchainImage", result)?;
    Ok(code != sys::Result::TIMEOUT_EXPIRED)
}

/// `xrReleaseSwapchainImage`; the openxr crate's own would panic after [`wait_image`].
pub(super) fn release_image(swapchain: &openxr::Swapchain<openxr::Vulkan>) -> Result<(), XrError> {
    // SAFETY: the swapchain is alive; the release info may be null.
    let result = unsafe {
        (swapchain.instance().fp().release_swapchain_image)(swapchain.as_raw(), std::ptr::null())
    };
    checked("xrReleaseSwapchainImage", result).map(|_| ())
}

/// `xrBeginFrame`: `true` if the runtime discarded a frame that was begun and never ended (`XR_FRAME_DISCARDED`).
pub(super) fn begin_frame(session: &openxr::Session<openxr::Vulkan>) -> Result<bool, XrError> {
    // SAFETY: the session is alive; the begin info may be null.
    let result =
        unsafe { (session.instance().fp().begin_frame)(session.as_raw(), std::ptr::null()) };
    Ok(checked("xrBeginFrame", result)? == sys::Result::FRAME_DISCARDED)
}

/// `xrSyncActions` of one action set: `false` if the session is not focused, so that all actions are inactive.
pub(super) fn sync_actions(
    session: &openxr::Session<openxr::Vulkan>,
    actions: &openxr::ActionSet,
) -> Result<bool, XrError> {
    let active = sys::ActiveActionSet {
        action_set: actions.as_raw(),
        subaction_path: openxr::Path::NULL,
    };
    let info = sys::ActionsSyncInfo {
        ty: sys::ActionsSyncInfo::TYPE,
        next: std::ptr::null(),
        count_active_action_sets: 1,
        active_action_sets: &active,
    };
    // SAFETY: session and action set are alive and `info` outlives the call.
    let result = unsafe { (session.instance().fp().sync_actions)(session.as_raw(), &info) };
    Ok(checked("xrSyncActions", result)? != sys::Result::SESSION_NOT_FOCUSED)
}

/// `xrLocateSpace` of an eye gaze space with the time at which the eyes were sampled (`XrEyeGazeSampleTimeEXT`), if the runtime tells.
pub(super) fn locate_gaze(
    gaze: &openxr::Space,
    base: &openxr::Space,
    time: openxr::Time,
) -> Result<(openxr::SpaceLocation, Option<openxr::Time>), XrError> {
    let mut sample = sys::EyeGazeSampleTimeEXT {
        ty: sys::EyeGazeSampleTimeEXT::TYPE,
        next: std::ptr::null_mut(),
        time: openxr::Time::from_nanos(0),
    };
    let mut location: MaybeUninit<sys::SpaceLocation> =
        sys::SpaceLocation::out((&raw mut sample).cast());
    // The runtime need not write the pose where it is not valid.
    // SAFETY: the pointer is into `location`, properly aligned.
    unsafe { (&raw mut (*location.as_mut_ptr()).pose).write(openxr::Posef::IDENTITY) };
    // SAFETY: both spaces are of one live session; the chained structs are typed and outlive the call.
    let result = unsafe {
        (gaze.instance().fp().locate_space)(
            gaze.as_raw(),
            base.as_raw(),
            time,
            location.as_mut_ptr(),
        )
    };
    checked("xrLocateSpace", result)?;
    // SAFETY: type and next were set at the start, the pose above, and the flags by the successful call.
    let location = unsafe { location.assume_init() };
    let sample_time = (sample.time.as_nanos() != 0).then_some(sample.time);
    Ok((
        openxr::SpaceLocation {
            location_flags: location.location_flags,
            pose: location.pose,
        },
        sample_time,
    ))
}
