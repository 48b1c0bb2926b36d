//! Every call into the graphics driver: the device offered, the images handed out, their pictures read back.

mod images;
mod readback;

use std::ffi::CStr;
use std::sync::Arc;

use ash::vk;
use openxr_sys as sys;

use crate::XrResult;
use crate::config::DeviceChoice;

pub(crate) use images::SwapchainImages;
pub(crate) use readback::Texels;

/// What an application has asked of Vulkan so far, as the order of its calls matters.
#[derive(Default)]
pub(crate) struct DriverChoice {
    /// Whether the graphics requirements were asked for.
    pub requirements_told: bool,
    /// How the application's Vulkan is reached, where it said so.
    pub loader: Option<ash::StaticFn>,
    /// The device that it was told to use, and the Vulkan instance that it was told it of.
    pub told: Option<(vk::Instance, vk::PhysicalDevice)>,
}

/// The Vulkan loader: the application's where it named one, else the system's.
fn entry(loader: Option<&ash::StaticFn>) -> XrResult<ash::Entry> {
    let entry = match loader {
        // SAFETY: the application says that this is its vkGetInstanceProcAddr
        Some(loader) => unsafe { ash::Entry::from_static_fn(loader.clone()) },
        // SAFETY: the system's Vulkan loader is what its name says
        None => unsafe { ash::Entry::load() }.map_err(|error| {
            tracing::error!("no Vulkan loader: {error}");
            sys::Result::ERROR_RUNTIME_FAILURE
        })?,
    };
    Ok(entry)
}

/// Makes the application's Vulkan instance, as it wishes: this runtime needs nothing beyond Vulkan 1.0.
///
/// # Safety
/// The create information and allocator are valid for `vkCreateInstance`.
pub(crate) unsafe fn create_instance(
    loader: &ash::StaticFn,
    info: *const vk::InstanceCreateInfo,
    allocator: *const vk::AllocationCallbacks,
) -> XrResult<Result<vk::Instance, vk::Result>> {
    let entry = entry(Some(loader))?;
    let mut instance = vk::Instance::null();
    // SAFETY: as this function asks of its caller
    let result = unsafe { (entry.fp_v1_0().create_instance)(info, allocator, &mut instance) };
    Ok(result.result_with_success(instance))
}

/// Makes the application's device, as it wishes.
///
/// # Safety
/// The create information and allocator are valid for `vkCreateDevice` of that physical device, and this
/// is one of that instance.
pub(crate) unsafe fn create_device(
    loader: &ash::StaticFn,
    instance: vk::Instance,
    physical_device: vk::PhysicalDevice,
    info: *const vk::DeviceCreateInfo,
    allocator: *const vk::AllocationCallbacks,
) -> Result<vk::Device, vk::Result> {
    let mut device = vk::Device::null();
    // SAFETY: as this function asks of its caller
    let result = unsafe {
        let instance = ash::Instance::load(loader, instance);
        (instance.fp_v1_0().create_device)(physical_device, info, allocator, &mut device)
    };
    result.result_with_success(device)
}

/// The device that the headset hangs on: the chosen one, else the best.
///
/// # Safety
/// The instance is a living one of that loader.
pub(crate) unsafe fn choose_device(
    loader: Option<&ash::StaticFn>,
    instance: vk::Instance,
    choice: Option<&DeviceChoice>,
) -> XrResult<vk::PhysicalDevice> {
    let entry = entry(loader)?;
    // SAFETY: as this function asks of its caller
    let devices: Vec<_> = unsafe {
        let instance = ash::Instance::load(entry.static_fn(), instance);
        let devices = instance.enumerate_physical_devices().map_err(failure)?;
        devices
            .into_iter()
            .map(|device| (device, instance.get_physical_device_properties(device)))
            .map(|(device, properties)| (device, name_of(&properties), properties.device_type))
            .collect()
    };
    let chosen = match choice {
        Some(DeviceChoice::Index(index)) => devices.get(*index),
        Some(DeviceChoice::Name(part)) => {
            let part = part.to_lowercase();
            devices
                .iter()
                .find(|(_, name, _)| name.to_lowercase().contains(&part))
        }
        None => devices.iter().min_by_key(|(.., ty)| rank(*ty)),
    };
    let Some((device, name, _)) = chosen else {
        let names: Vec<_> = devices.iter().map(|(_, name, _)| name.as_str()).collect();
        tracing::error!("no Vulkan device {choice:?}; there are {names:?}");
        return Err(sys::Result::ERROR_RUNTIME_FAILURE);
    };
    tracing::info!("the headset hangs on {name}");
    Ok(*device)
}

fn name_of(properties: &vk::PhysicalDeviceProperties) -> String {
    properties
        .device_name_as_c_str()
        .map(CStr::to_string_lossy)
        .unwrap_or_default()
        .into_owned()
}

fn rank(ty: vk::PhysicalDeviceType) -> usize {
    const BEST_FIRST: [vk::PhysicalDeviceType; 4] = [
        vk::PhysicalDeviceType::DISCRETE_GPU,
        vk::PhysicalDeviceType::INTEGRATED_GPU,
        vk::PhysicalDeviceType::VIRTUAL_GPU,
        vk::PhysicalDeviceType::CPU,
    ];
    BEST_FIRST
        .iter()
        .position(|known| *known == ty)
        .unwrap_or(BEST_FIRST.len())
}

/// The application's device as a session uses it. It is touched under the runtime's lock alone.
pub(crate) struct Graphics {
    instance: ash::Instance,
    physical_device: vk::PhysicalDevice,
    device: ash::Device,
    queue: vk::Queue,
    pool: vk::CommandPool,
    fence: vk::Fence,
}

impl Graphics {
    /// # Safety
    /// The handles are living ones that belong together, the queue is one that the device was made with.
    pub unsafe fn new(
        loader: Option<&ash::StaticFn>,
        instance: vk::Instance,
        physical_device: vk::PhysicalDevice,
        device: vk::Device,
        (queue_family, queue_index): (u32, u32),
    ) -> XrResult<Arc<Self>> {
        let entry = entry(loader)?;
        // SAFETY: as this function asks of its caller
        unsafe {
            let instance = ash::Instance::load(entry.static_fn(), instance);
            let families = instance.get_physical_device_queue_family_properties(physical_device);
            let has_queue = families
                .get(queue_family as usize)
                .is_some_and(|family| queue_index < family.queue_count);
            if !has_queue {
                return Err(sys::Result::ERROR_GRAPHICS_DEVICE_INVALID);
            }
            let device = ash::Device::load(instance.fp_v1_0(), device);
            let queue = device.get_device_queue(queue_family, queue_index);
            let pool_info = vk::CommandPoolCreateInfo::default()
                .flags(vk::CommandPoolCreateFlags::TRANSIENT)
                .queue_family_index(queue_family);
            let pool = device
                .create_command_pool(&pool_info, None)
                .map_err(failure)?;
            let fence = device
                .create_fence(&vk::FenceCreateInfo::default(), None)
                .map_err(|error| {
                    device.destroy_command_pool(pool, None);
                    failure(error)
                })?;
            Ok(Arc::new(Self {
                instance,
                physical_device,
                device,
                queue,
                pool,
                fence,
            }))
        }
    }

    /// The swapchain formats, best first.
    pub fn formats(&self) -> Vec<vk::Format> {
        images::FORMATS
            .iter()
            .copied()
            .filter(|format| self.supports(*format))
            .collect()
    }

    fn supports(&self, format: vk::Format) -> bool {
        let needed = match images::is_depth(format) {
            true => vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT,
            false => {
                vk::FormatFeatureFlags::COLOR_ATTACHMENT | vk::FormatFeatureFlags::TRANSFER_SRC
            }
        };
        // SAFETY: the physical device lives as long as the application's instance, which outlives the session
        let properties = unsafe {
            self.instance
                .get_physical_device_format_properties(self.physical_device, format)
        };
        properties
            .optimal_tiling_features
            .contains(needed | vk::FormatFeatureFlags::SAMPLED_IMAGE)
    }

    /// Records commands, submits them and waits until they are done.
    ///
    /// # Safety
    /// The commands are valid, and the application leaves the queue alone during the call.
    unsafe fn submit(&self, record: impl FnOnce(&ash::Device, vk::CommandBuffer)) -> XrResult<()> {
        let device = &self.device;
        let allocate_info = vk::CommandBufferAllocateInfo::default()
            .command_pool(self.pool)
            .command_buffer_count(1);
        // SAFETY: as this function asks of its caller; the buffer is freed when its work is done
        unsafe {
            let buffers = device
                .allocate_command_buffers(&allocate_info)
                .map_err(failure)?;
            let submitted = (|| {
                let begin_info = vk::CommandBufferBeginInfo::default()
                    .flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
                device.begin_command_buffer(buffers[0], &begin_info)?;
                record(device, buffers[0]);
                device.end_command_buffer(buffers[0])?;
                let submit_info = vk::SubmitInfo::default().command_buffers(&buffers);
                device.queue_submit(self.queue, &[submit_info], self.fence)?;
                device.wait_for_fences(&[self.fence], true, u64::MAX)?;
                device.reset_fences(&[self.fence])
            })();
            device.free_command_buffers(self.pool, &buffers);
            submitted.map_err(failure)
        }
    }

    /// The memory type of these bits that has the properties, the first where none does.
    fn memory_type(&self, bits: u32, wanted: vk::MemoryPropertyFlags) -> Option<u32> {
        // SAFETY: as in `supports`
        let memory = unsafe {
            self.instance
                .get_physical_device_memory_properties(self.physical_device)
        };
        let allowed = || (0..memory.memory_type_count).filter(|index| bits & 1 << index != 0);
        let has = |index: &u32| {
            memory.memory_types[*index as usize]
                .property_flags
                .contains(wanted)
        };
        allowed().find(has).or_else(|| allowed().next())
    }
}

impl Drop for Graphics {
    fn drop(&mut self) {
        // SAFETY: the application keeps its device until the session is destroyed; no work is pending
        unsafe {
            self.device.destroy_fence(self.fence, None);
            self.device.destroy_command_pool(self.pool, None);
        }
    }
}

/// What the driver's refusals are to the application.
fn failure(error: vk::Result) -> sys::Result {
    tracing::error!("Vulkan: {error}");
    match error {
        vk::Result::ERROR_OUT_OF_HOST_MEMORY | vk::Result::ERROR_OUT_OF_DEVICE_MEMORY => {
            sys::Result::ERROR_OUT_OF_MEMORY
        }
        _ => sys::Result::ERROR_RUNTIME_FAILURE,
    }
}
