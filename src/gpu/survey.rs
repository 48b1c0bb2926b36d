//! Which Vulkan devices there are and what they can do, for people choosing one.

use ash::vk;
use wgpu::hal::vulkan as hal;

use super::device::{self, GpuError, Headless};

/// A Vulkan device of this machine.
#[derive(Clone, Debug)]
pub struct SurveyedDevice {
    /// Its place in the list, as taken by [`Headless::wanted`].
    pub index: usize,
    /// Name, as its driver gives it.
    pub name: String,
    /// Vulkan version, `major.minor.patch`.
    pub vulkan_version: String,
    /// The largest memory that is local to the device, bytes. A CPU device counts all of the machine's.
    pub memory_bytes: u64,
    /// What macula can do on it; `None` where it offers too little to run at all.
    pub capabilities: Option<Capabilities>,
}

/// What a device offers of what matters here.
#[derive(Clone, Debug)]
pub struct Capabilities {
    /// Discrete, integrated, CPU, ...
    pub kind: wgpu::DeviceType,
    /// Driver name and version.
    pub driver: String,
    /// Passes can be timed on the device.
    pub timestamps: bool,
    /// Shader threads of a subgroup can talk to each other.
    pub subgroups: bool,
    /// Shaders can compute in 16-bit floats.
    pub shader_f16: bool,
    /// Rays can be traced by the hardware.
    pub ray_query: bool,
    /// Largest storage buffer that a shader can see in one binding, bytes.
    pub max_storage_binding_bytes: u64,
    /// Largest buffer, bytes.
    pub max_buffer_bytes: u64,
    /// Most threads in a work group.
    pub max_workgroup_threads: u32,
    /// Most memory shared by a work group, bytes.
    pub max_workgroup_memory_bytes: u32,
}

/// Lists the Vulkan devices, in the driver's order.
///
/// # Errors
/// [`GpuError::NoLoader`] without Vulkan, [`GpuError::Vulkan`] where the driver fails. No device at all is an empty list.
pub fn survey() -> Result<Vec<SurveyedDevice>, GpuError> {
    // SAFETY: loading the system's Vulkan loader runs its initialisation code, which is trusted like any driver.
    let entry = unsafe { ash::Entry::load() }.map_err(GpuError::NoLoader)?;
    let (instance, hal_instance) = device::create_instance(&entry, &Headless::default())?;
    // SAFETY: the instance is alive.
    let devices = unsafe { instance.enumerate_physical_devices() }
        .map_err(device::vulkan_error("vkEnumeratePhysicalDevices"))?;
    Ok(devices
        .into_iter()
        .enumerate()
        .map(|(index, physical)| look_at(&instance, &hal_instance, index, physical))
        .collect())
}

fn look_at(
    instance: &ash::Instance,
    hal_instance: &hal::Instance,
    index: usize,
    physical: vk::PhysicalDevice,
) -> SurveyedDevice {
    let version = device::properties(instance, physical).api_version;
    // SAFETY: the physical device was enumerated from this instance.
    let memory = unsafe { instance.get_physical_device_memory_properties(physical) };
    let memory_bytes = memory
        .memory_heaps_as_slice()
        .iter()
        .filter(|heap| heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL))
        .map(|heap| heap.size)
        .max()
        .unwrap_or(0);
    SurveyedDevice {
        index,
        name: device::physical_device_name(instance, physical),
        vulkan_version: format!(
            "{}.{}.{}",
            vk::api_version_major(version),
            vk::api_version_minor(version),
            vk::api_version_patch(version)
        ),
        memory_bytes,
        capabilities: hal_instance.expose_adapter(physical).map(|exposed| {
            let features = exposed.features;
            let limits = exposed.capabilities.limits;
            Capabilities {
                kind: exposed.info.device_type,
                driver: format!("{} {}", exposed.info.driver, exposed.info.driver_info),
                timestamps: features.contains(wgpu::Features::TIMESTAMP_QUERY),
                subgroups: features.contains(wgpu::Features::SUBGROUP),
                shader_f16: features.contains(wgpu::Features::SHADER_F16),
                ray_query: features.contains(wgpu::Features::EXPERIMENTAL_RAY_QUERY),
                max_storage_binding_bytes: limits.max_storage_buffer_binding_size,
                max_buffer_bytes: limits.max_buffer_size,
                max_workgroup_threads: limits.max_compute_invocations_per_workgroup,
                max_workgroup_memory_bytes: limits.max_compute_workgroup_storage_size,
            }
        }),
    }
}
