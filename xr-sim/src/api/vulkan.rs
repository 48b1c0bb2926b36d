//! XR_KHR_vulkan_enable and XR_KHR_vulkan_enable2: the way to a Vulkan device that the headset hangs on.

use std::ffi::{c_char, c_void};

use ash::vk::{self, Handle as _};
use openxr_sys as sys;
use openxr_sys::platform::{VkDevice, VkInstance, VkPhysicalDevice, VkResult};

use super::functions;
use super::pointer::Out;
use crate::XrResult;
use crate::runtime::{Runtime, runtime};
use crate::two_call::two_call_string;
use crate::vulkan;

/// The versions of Vulkan that an application may use.
const MIN_VULKAN: sys::Version = sys::Version::new(1, 0, 0);
const MAX_VULKAN: sys::Version = sys::Version::new(1, 4, 0);

/// The application's way into Vulkan.
fn loader(address: Option<sys::platform::VkGetInstanceProcAddr>) -> XrResult<ash::StaticFn> {
    let address = address.ok_or(sys::Result::ERROR_VALIDATION_FAILURE)?;
    // SAFETY: two bindings' types of the one function vkGetInstanceProcAddr
    let get_instance_proc_addr = unsafe {
        std::mem::transmute::<sys::platform::VkGetInstanceProcAddr, vk::PFN_vkGetInstanceProcAddr>(
            address,
        )
    };
    Ok(ash::StaticFn {
        get_instance_proc_addr,
    })
}

/// Chooses the device for an application's Vulkan instance, and remembers that it was told.
fn tell_device(
    runtime: &mut Runtime,
    instance: sys::Instance,
    system: sys::SystemId,
    vk_instance: VkInstance,
) -> XrResult<VkPhysicalDevice> {
    let instance = runtime.instances.get_mut(instance)?;
    instance.verify_system(system)?;
    if vk_instance.is_null() {
        return Err(sys::Result::ERROR_VALIDATION_FAILURE);
    }
    let vk_instance = vk::Instance::from_raw(vk_instance as u64);
    let choice = instance.setup.config.device.as_ref();
    // SAFETY: the application vouches for its Vulkan instance
    let device =
        unsafe { vulkan::choose_device(instance.driver.loader.as_ref(), vk_instance, choice)? };
    instance.driver.told = Some((vk_instance, device));
    Ok(device.as_raw() as VkPhysicalDevice)
}

/// Hands over what Vulkan made, or its refusal.
fn tell(
    created: Result<u64, vk::Result>,
    handle: Out<*const c_void>,
    result: Out<VkResult>,
) -> XrResult<()> {
    if let Ok(created) = created {
        handle.set(created as *const c_void)?;
    }
    result.set(created.err().unwrap_or(vk::Result::SUCCESS).as_raw())
}

functions! {
    /// Of both extensions.
    fn get_graphics_requirements(
        instance: sys::Instance,
        system_id: sys::SystemId,
        requirements: *mut sys::GraphicsRequirementsVulkanKHR,
    ) {
        let mut runtime = runtime();
        let instance = runtime.instances.get_mut(instance)?;
        let mut requirements = requirements;
        let requirements = requirements.verified()?;
        instance.verify_system(system_id)?;
        requirements.min_api_version_supported = MIN_VULKAN;
        requirements.max_api_version_supported = MAX_VULKAN;
        instance.driver.requirements_told = true;
        Ok(())
    }

    fn create_instance(
        instance: sys::Instance,
        create_info: *const sys::VulkanInstanceCreateInfoKHR,
        vulkan_instance: *mut VkInstance,
        vulkan_result: *mut VkResult,
    ) {
        let mut runtime = runtime();
        let of_instance = runtime.instances.get_mut(instance)?;
        let info = create_info.verified()?;
        of_instance.verify_system(info.system_id)?;
        let loader = loader(info.pfn_get_instance_proc_addr)?;
        if vulkan_instance.is_null() || vulkan_result.is_null() || info.vulkan_create_info.is_null() {
            return Err(sys::Result::ERROR_VALIDATION_FAILURE);
        }
        let (create, allocator) = (info.vulkan_create_info.cast(), info.vulkan_allocator.cast());
        // SAFETY: the application vouches for its create information and allocator
        let created = unsafe { vulkan::create_instance(&loader, create, allocator)? };
        of_instance.driver.loader = Some(loader);
        tell(created.map(vk::Instance::as_raw), vulkan_instance, vulkan_result)
    }

    fn create_device(
        instance: sys::Instance,
        create_info: *const sys::VulkanDeviceCreateInfoKHR,
        vulkan_device: *mut VkDevice,
        vulkan_result: *mut VkResult,
    ) {
        let runtime = runtime();
        let of_instance = runtime.instances.get(instance)?;
        let info = create_info.verified()?;
        of_instance.verify_system(info.system_id)?;
        let loader = loader(info.pfn_get_instance_proc_addr)?;
        let physical_device = vk::PhysicalDevice::from_raw(info.vulkan_physical_device as u64);
        let told = of_instance.driver.told.filter(|(_, told)| *told == physical_device);
        let (Some((vk_instance, _)), false) = (told, info.vulkan_create_info.is_null()) else {
            return Err(sys::Result::ERROR_VALIDATION_FAILURE);
        };
        if vulkan_device.is_null() || vulkan_result.is_null() {
            return Err(sys::Result::ERROR_VALIDATION_FAILURE);
        }
        let (create, allocator) = (info.vulkan_create_info.cast(), info.vulkan_allocator.cast());
        // SAFETY: the device is one that this runtime told; the application vouches for the rest
        let created = unsafe {
            vulkan::create_device(&loader, vk_instance, physical_device, create, allocator)
        };
        tell(created.map(vk::Device::as_raw), vulkan_device, vulkan_result)
    }

    fn get_graphics_device2(
        instance: sys::Instance,
        get_info: *const sys::VulkanGraphicsDeviceGetInfoKHR,
        device: *mut VkPhysicalDevice,
    ) {
        let mut runtime = runtime();
        runtime.instances.get(instance)?;
        let info = get_info.verified()?;
        device.set(tell_device(&mut runtime, instance, info.system_id, info.vulkan_instance)?)
    }

    fn get_graphics_device(
        instance: sys::Instance,
        system_id: sys::SystemId,
        vulkan_instance: VkInstance,
        device: *mut VkPhysicalDevice,
    ) {
        let vulkan_instance = vulkan_instance.address().cast();
        device.set(tell_device(&mut runtime(), instance, system_id, vulkan_instance)?)
    }

    /// The runtime needs no extension: images never leave the application's device.
    fn get_instance_extensions(
        instance: sys::Instance,
        system_id: sys::SystemId,
        capacity: u32,
        count: *mut u32,
        buffer: *mut c_char,
    ) {
        runtime().instances.get(instance)?.verify_system(system_id)?;
        two_call_string(capacity, count, buffer, "")
    }

    /// As for the instance.
    fn get_device_extensions(
        instance: sys::Instance,
        system_id: sys::SystemId,
        capacity: u32,
        count: *mut u32,
        buffer: *mut c_char,
    ) {
        runtime().instances.get(instance)?.verify_system(system_id)?;
        two_call_string(capacity, count, buffer, "")
    }
}
