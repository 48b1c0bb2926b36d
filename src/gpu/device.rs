//! One Vulkan device, whoever made it: macula itself for headless work, or an OpenXR runtime (`XR_KHR_vulkan_enable2`).
//!
//! Both ways run through [`GpuDevice::create`]; a [`VulkanMaker`] answers only who calls `vkCreateInstance` and `vkCreateDevice`
//! and which physical device is taken.

use std::ffi::c_char;
use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;
use wgpu::hal::vulkan::Api as Vulkan;

/// Why no device could be had, or why it failed at its work.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// The Vulkan loader is not installed.
    #[error(
        "no Vulkan loader was found: install it (Debian and Ubuntu: libvulkan1 mesa-vulkan-drivers, Fedora: vulkan-loader mesa-vulkan-drivers, Arch: vulkan-icd-loader vulkan-swrast, Windows: a current graphics driver)"
    )]
    NoLoader(#[source] ash::LoadingError),
    /// A Vulkan call failed.
    #[error("{call} failed on the Vulkan driver: {result}")]
    Vulkan {
        /// Name of the call.
        call: &'static str,
        /// What it returned.
        result: vk::Result,
    },
    /// There is no Vulkan device at all.
    #[error(
        "no Vulkan device was found: install a graphics driver, or Mesa's software driver (Debian and Ubuntu: mesa-vulkan-drivers, Fedora: mesa-vulkan-drivers, Arch: vulkan-swrast)"
    )]
    NoDevice,
    /// The device asked for is not there.
    #[error("no Vulkan device is named or numbered `{wanted}`; there are: {available}")]
    NoSuchDevice {
        /// What was asked for.
        wanted: String,
        /// Index and name of each device.
        available: String,
    },
    /// The device lacks something that macula needs.
    #[error("the Vulkan device {device} cannot be used: {reason}")]
    Unsuitable {
        /// Name of the device.
        device: String,
        /// What it lacks.
        reason: String,
    },
    /// An OpenXR runtime refused to make or name the device.
    #[error("the OpenXR runtime could not provide a Vulkan device: {0}")]
    Runtime(String),
    /// The device was lost or ran out of memory in the middle of work.
    #[error("the Vulkan device failed while {during}: {reason}")]
    Failed {
        /// What was being done.
        during: String,
        /// What the driver said.
        reason: String,
    },
    /// A kernel's resource was not given: a fault of macula's own.
    #[error("stage `{stage}` lacks the buffer `{resource}`")]
    Unbound {
        /// Name of the stage.
        stage: String,
        /// Name of the resource in WGSL.
        resource: String,
    },
    /// A shader of macula's own does not compile.
    #[error(transparent)]
    Shader(#[from] super::shader::ShaderError),
    /// A buffer is larger than the device can hold or bind.
    #[error(
        "the buffer `{buffer}` needs {bytes} bytes, but the device allows {limit}; use fewer photons, a smaller image or a smaller scene"
    )]
    BufferTooLarge {
        /// Name of the buffer.
        buffer: String,
        /// Size asked for.
        bytes: u64,
        /// The device's limit.
        limit: u64,
    },
}

/// What a failed Vulkan call means. A loader that finds no driver makes no instance.
pub(crate) fn vulkan_error(call: &'static str) -> impl Fn(vk::Result) -> GpuError {
    move |result| match result {
        vk::Result::ERROR_INCOMPATIBLE_DRIVER => GpuError::NoDevice,
        _ => GpuError::Vulkan { call, result },
    }
}

/// Who makes the Vulkan instance and device.
pub trait VulkanMaker {
    /// Makes the instance from macula's create info (API version and the extensions that wgpu wants).
    fn create_instance(
        &self,
        entry: &ash::Entry,
        info: &vk::InstanceCreateInfo<'_>,
    ) -> Result<vk::Instance, GpuError>;
    /// Chooses the physical device.
    fn physical_device(&self, instance: &ash::Instance) -> Result<vk::PhysicalDevice, GpuError>;
    /// Makes the device from macula's create info.
    fn create_device(
        &self,
        instance: &ash::Instance,
        physical_device: vk::PhysicalDevice,
        info: &vk::DeviceCreateInfo<'_>,
    ) -> Result<vk::Device, GpuError>;
}

/// The raw handles behind a [`GpuDevice`], for the OpenXR graphics binding. They live as long as it does.
#[derive(Clone, Copy, Debug)]
pub struct RawVulkan {
    /// `VkInstance`.
    pub instance: vk::Instance,
    /// `VkPhysicalDevice`.
    pub physical_device: vk::PhysicalDevice,
    /// `VkDevice`.
    pub device: vk::Device,
    /// Family of the one queue (queue index 0).
    pub queue_family_index: u32,
}

/// A wgpu device and queue on a Vulkan device of known origin.
pub struct GpuDevice {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// Name, driver and kind.
    pub info: wgpu::AdapterInfo,
    /// Raw handles.
    pub raw: RawVulkan,
    /// Nanoseconds a timestamp tick, or `None` where passes can't be timed.
    pub timestamp_period_ns: Option<f32>,
    /// The first error that the device reported out of turn; [`GpuDevice::wait`] passes it on.
    fault: Arc<Mutex<Option<String>>>,
    // Dropped after the device: they own the VkInstance.
    _adapter: wgpu::Adapter,
    _instance: wgpu::Instance,
}

impl std::fmt::Debug for GpuDevice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "GpuDevice({})", self.info.name)
    }
}

/// The highest Vulkan version that macula asks for. With 1.2 wgpu 30 would emit SPIR-V that the instance does not allow.
const API_VERSION: u32 = vk::API_VERSION_1_3;

impl GpuDevice {
    /// Makes instance, device and queue through `maker` and hands them to wgpu.
    ///
    /// # Errors
    /// [`GpuError`] where loader, driver or device are missing or refuse.
    pub fn create(maker: &dyn VulkanMaker) -> Result<Self, GpuError> {
        // SAFETY: loading the system's Vulkan loader runs its initialisation code, which is trusted like any driver.
        let entry = unsafe { ash::Entry::load() }.map_err(GpuError::NoLoader)?;
        let (vulkan_instance, hal_instance) = create_instance(&entry, maker)?;
        let physical_device = maker.physical_device(&vulkan_instance)?;
        let exposed = hal_instance.expose_adapter(physical_device).ok_or_else(|| GpuError::Unsuitable {
            device: physical_device_name(&vulkan_instance, physical_device),
            reason: "it offers too little for compute work (Vulkan 1.1 with storage buffers is needed)".into(),
        })?;
        let info = exposed.info.clone();
        let features = exposed.features & wgpu::Features::TIMESTAMP_QUERY;
        let limits = exposed.capabilities.limits.clone();

        // SAFETY: the physical device was enumerated from this instance.
        let families =
            unsafe { vulkan_instance.get_physical_device_queue_family_properties(physical_device) };
        let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
        let queue_family_index = families
            .iter()
            .position(|f| f.queue_flags.contains(wanted))
            .ok_or_else(|| GpuError::Unsuitable {
                device: info.name.clone(),
                reason: "it has no queue for both graphics and compute".into(),
            })? as u32;

        let device_extensions = exposed.adapter.required_device_extensions(features);
        let mut device_features = exposed
            .adapter
            .physical_device_features(&device_extensions, features);
        let extension_names: Vec<*const c_char> =
            device_extensions.iter().map(|name| name.as_ptr()).collect();
        let queue_info = [vk::DeviceQueueCreateInfo::default()
            .queue_family_index(queue_family_index)
            .queue_priorities(&[1.0])];
        let create_info = device_features.add_to_device_create(
            vk::DeviceCreateInfo::default()
                .queue_create_infos(&queue_info)
                .enabled_extension_names(&extension_names),
        );
        let raw_device = maker.create_device(&vulkan_instance, physical_device, &create_info)?;
        // SAFETY: `raw_device` was just made from `vulkan_instance`.
        let vulkan_device = unsafe { ash::Device::load(vulkan_instance.fp_v1_0(), raw_device) };
        let raw = RawVulkan {
            instance: vulkan_instance.handle(),
            physical_device,
            device: raw_device,
            queue_family_index,
        };

        let device_to_destroy = vulkan_device.clone();
        // SAFETY: wgpu calls this once, after its last use of the device; nobody else destroys it.
        let destroy_device = Box::new(move || unsafe { device_to_destroy.destroy_device(None) });
        // SAFETY: the device was made with exactly these extensions, features and queue; the callback owns it.
        let open = unsafe {
            exposed.adapter.device_from_raw(
                vulkan_device,
                Some(destroy_device),
                &device_extensions,
                features,
                &limits,
                &wgpu::MemoryHints::Performance,
                queue_family_index,
                0,
            )
        }
        .map_err(|error| GpuError::Unsuitable {
            device: info.name.clone(),
            reason: error.to_string(),
        })?;

        // SAFETY: the hal objects belong together and are given away here.
        let (instance, adapter) = unsafe {
            let instance = wgpu::Instance::from_hal::<Vulkan>(hal_instance);
            let adapter = instance.create_adapter_from_hal(exposed);
            (instance, adapter)
        };
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("macula"),
            required_features: features,
            required_limits: limits,
            ..Default::default()
        };
        // SAFETY: `open` was made from this adapter with these features and limits.
        let (device, queue) = unsafe { adapter.create_device_from_hal(open, &descriptor) }
            .map_err(|error| GpuError::Unsuitable {
                device: info.name.clone(),
                reason: error.to_string(),
            })?;
        let fault = Arc::new(Mutex::new(None));
        let noted = Arc::clone(&fault);
        // Without a handler wgpu would panic, out of memory for one.
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            let mut first = noted.lock().unwrap_or_else(PoisonError::into_inner);
            first.get_or_insert_with(|| error.to_string());
        }));
        let timestamp_period_ns = features
            .contains(wgpu::Features::TIMESTAMP_QUERY)
            .then(|| queue.get_timestamp_period());
        Ok(Self {
            device,
            queue,
            info,
            raw,
            timestamp_period_ns,
            fault,
            _adapter: adapter,
            _instance: instance,
        })
    }

    /// Into how many equal runs of workgroups the device parts a dispatch, one for each of its threads: a software driver uses all
    /// processors that way; a GPU hands workgroups out one by one, which counts as 1.
    pub fn equal_runs(&self) -> u32 {
        match self.info.device_type {
            wgpu::DeviceType::Cpu => {
                std::thread::available_parallelism().map_or(1, |count| count.get().min(64) as u32)
            }
            _ => 1,
        }
    }

    /// Waits until all submitted work is done.
    ///
    /// # Errors
    /// [`GpuError::Failed`] when the device is lost, out of memory or refused a call; `during` names the work.
    pub fn wait(&self, during: &str) -> Result<(), GpuError> {
        let failed = |reason: String| GpuError::Failed {
            during: during.into(),
            reason,
        };
        self.device
            .poll(wgpu::PollType::wait_indefinitely())
            .map_err(|error| failed(error.to_string()))?;
        match self
            .fault
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take()
        {
            Some(reason) => Err(failed(reason)),
            None => Ok(()),
        }
    }
}

pub(super) fn create_instance(
    entry: &ash::Entry,
    maker: &dyn VulkanMaker,
) -> Result<(ash::Instance, wgpu::hal::vulkan::Instance), GpuError> {
    let flags = wgpu::InstanceFlags::empty();
    let mut extensions =
        <Vulkan as wgpu::hal::Api>::Instance::desired_extensions(entry, API_VERSION, flags)
            .map_err(|error| GpuError::Failed {
                during: "listing instance extensions".into(),
                reason: error.to_string(),
            })?;
    // macula opens no window. Asked for Wayland's surfaces, a layer of Mesa's looks for a compositor and complains where there is none.
    // (Swapchains, of which wgpu asks each device, need the extension that all surfaces have in common.)
    let common: &[u8] = b"VK_KHR_surface";
    extensions.retain(|name| {
        let name = name.to_bytes();
        name == common || !name.ends_with(b"_surface")
    });
    let extension_names: Vec<*const c_char> = extensions.iter().map(|name| name.as_ptr()).collect();
    let application = vk::ApplicationInfo::default()
        .application_name(c"macula")
        .engine_name(c"macula")
        .api_version(API_VERSION);
    let create_info = vk::InstanceCreateInfo::default()
        .application_info(&application)
        .enabled_extension_names(&extension_names);
    let raw_instance = maker.create_instance(entry, &create_info)?;
    // SAFETY: `raw_instance` was just made through this entry.
    let instance = unsafe { ash::Instance::load(entry.static_fn(), raw_instance) };
    let instance_to_destroy = instance.clone();
    // wgpu drops its own reference to the Vulkan loader before it calls this: the loader must not be gone by then.
    let loader = entry.clone();
    let destroy_instance = Box::new(move || {
        // SAFETY: wgpu calls this once, after its last use of the instance; nobody else destroys it.
        unsafe { instance_to_destroy.destroy_instance(None) };
        drop(loader);
    });
    // SAFETY: the instance was made with exactly these extensions and this API version; the callback owns it.
    let hal_instance = unsafe {
        <Vulkan as wgpu::hal::Api>::Instance::from_raw(
            entry.clone(),
            instance.clone(),
            API_VERSION,
            0,
            None,
            extensions,
            flags,
            Default::default(),
            false,
            Some(destroy_instance),
        )
    }
    .map_err(|error| GpuError::Failed {
        during: "handing the instance to wgpu".into(),
        reason: error.to_string(),
    })?;
    Ok((instance, hal_instance))
}

/// Makes the device without OpenXR; takes a device by name part or index, else the most capable kind there is.
#[derive(Clone, Debug, Default)]
pub struct Headless {
    /// Part of a device's name (any case), or its index; `None` prefers discrete, integrated, virtual, then CPU devices.
    pub wanted: Option<String>,
}

impl VulkanMaker for Headless {
    fn create_instance(
        &self,
        entry: &ash::Entry,
        info: &vk::InstanceCreateInfo<'_>,
    ) -> Result<vk::Instance, GpuError> {
        // SAFETY: `info` and all it points to live through the call.
        unsafe { entry.create_instance(info, None) }
            .map(|instance| instance.handle())
            .map_err(vulkan_error("vkCreateInstance"))
    }

    fn physical_device(&self, instance: &ash::Instance) -> Result<vk::PhysicalDevice, GpuError> {
        // SAFETY: the instance is alive.
        let devices = unsafe { instance.enumerate_physical_devices() }
            .map_err(vulkan_error("vkEnumeratePhysicalDevices"))?;
        let names: Vec<String> = devices
            .iter()
            .map(|device| physical_device_name(instance, *device))
            .collect();
        let Some(wanted) = &self.wanted else {
            return devices
                .into_iter()
                .min_by_key(|device| preference(instance, *device))
                .ok_or(GpuError::NoDevice);
        };
        let by_index = wanted
            .parse::<usize>()
            .ok()
            .filter(|index| *index < devices.len());
        let by_name = || {
            names
                .iter()
                .position(|name| name.to_lowercase().contains(&wanted.to_lowercase()))
        };
        let index = by_index
            .or_else(by_name)
            .ok_or_else(|| GpuError::NoSuchDevice {
                wanted: wanted.clone(),
                available: if names.is_empty() {
                    "none".into()
                } else {
                    names
                        .iter()
                        .enumerate()
                        .map(|(i, name)| format!("{i}: {name}"))
                        .collect::<Vec<_>>()
                        .join(", ")
                },
            })?;
        Ok(devices[index])
    }

    fn create_device(
        &self,
        instance: &ash::Instance,
        physical_device: vk::PhysicalDevice,
        info: &vk::DeviceCreateInfo<'_>,
    ) -> Result<vk::Device, GpuError> {
        // SAFETY: the physical device belongs to the instance; `info` lives through the call.
        unsafe { instance.create_device(physical_device, info, None) }
            .map(|device| device.handle())
            .map_err(vulkan_error("vkCreateDevice"))
    }
}

pub(super) fn properties(
    instance: &ash::Instance,
    device: vk::PhysicalDevice,
) -> vk::PhysicalDeviceProperties {
    // SAFETY: the physical device was enumerated from this instance.
    unsafe { instance.get_physical_device_properties(device) }
}

/// Name of a physical device as its driver gives it.
pub fn physical_device_name(instance: &ash::Instance, device: vk::PhysicalDevice) -> String {
    let name = properties(instance, device).device_name;
    let bytes: Vec<u8> = name
        .iter()
        .take_while(|c| **c != 0)
        .map(|c| *c as u8)
        .collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

fn preference(instance: &ash::Instance, device: vk::PhysicalDevice) -> u32 {
    match properties(instance, device).device_type {
        vk::PhysicalDeviceType::DISCRETE_GPU => 0,
        vk::PhysicalDeviceType::INTEGRATED_GPU => 1,
        vk::PhysicalDeviceType::VIRTUAL_GPU => 2,
        vk::PhysicalDeviceType::CPU => 3,
        _ => 4,
    }
}
