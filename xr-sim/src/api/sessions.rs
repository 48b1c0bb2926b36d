//! Sessions: from their creation to their end.

use ash::vk::{self, Handle as _};
use openxr_sys as sys;

use super::functions;
use super::pointer::chained;
use crate::extension::Extension;
use crate::pacing::Pacing;
use crate::runtime::{runtime, wake_waiting_frames};
use crate::session::{Lifecycle, Session};
use crate::sink::Sink;
use crate::vulkan::Graphics;

functions! {
    fn create_session(
        instance: sys::Instance,
        create_info: *const sys::SessionCreateInfo,
        session: *mut sys::Session,
    ) {
        let mut runtime = runtime();
        let of_instance = runtime.instances.get(instance)?;
        let info = create_info.verified()?;
        if session.is_null() || info.create_flags != sys::SessionCreateFlags::EMPTY {
            return Err(sys::Result::ERROR_VALIDATION_FAILURE);
        }
        of_instance.verify_system(info.system_id)?;
        let has = |extension| of_instance.extensions.contains(extension);
        let has_vulkan = has(Extension::VulkanEnable) || has(Extension::VulkanEnable2);
        let binding = chained::<sys::GraphicsBindingVulkanKHR>(info, info.next)?;
        let graphics = match binding.filter(|_| has_vulkan) {
            Some(binding) => {
                let driver = &of_instance.driver;
                if !driver.requirements_told {
                    return Err(sys::Result::ERROR_GRAPHICS_REQUIREMENTS_CALL_MISSING);
                }
                let vk_instance = vk::Instance::from_raw(binding.instance as u64);
                let physical_device = vk::PhysicalDevice::from_raw(binding.physical_device as u64);
                let device = vk::Device::from_raw(binding.device as u64);
                if driver.told != Some((vk_instance, physical_device)) || device.is_null() {
                    return Err(sys::Result::ERROR_GRAPHICS_DEVICE_INVALID);
                }
                let queue = (binding.queue_family_index, binding.queue_index);
                let loader = driver.loader.as_ref();
                // SAFETY: instance and physical device are those that this runtime told; the application
                // vouches for its device and queue
                let graphics = unsafe {
                    Graphics::new(loader, vk_instance, physical_device, device, queue)
                };
                Some(graphics?)
            }
            None if has(Extension::Headless) => None,
            None => return Err(sys::Result::ERROR_GRAPHICS_DEVICE_INVALID),
        };
        let setup = of_instance.setup.clone();
        let handle = runtime.sessions.insert(Session {
            instance,
            graphics,
            lifecycle: Lifecycle::new(),
            sink: Sink::new(&setup.config),
            pacing: Pacing::new(setup),
            input: None,
        });
        runtime.announce(handle, Lifecycle::STARTING)?;
        session.set(handle)
    }

    fn destroy_session(session: sys::Session) {
        runtime().destroy_session(session)
    }

    fn begin_session(session: sys::Session, begin_info: *const sys::SessionBeginInfo) {
        let mut runtime = runtime();
        let (of_session, _) = runtime.session(session)?;
        let configuration = begin_info.verified()?.primary_view_configuration_type;
        // without views their configuration says nothing (XR_MND_headless)
        if of_session.graphics.is_some() {
            super::views::verify_configuration(configuration)?;
        }
        let states = of_session.lifecycle.begin()?;
        runtime.announce(session, states)
    }

    fn end_session(session: sys::Session) {
        let mut runtime = runtime();
        let states = runtime.session(session)?.0.lifecycle.end()?;
        wake_waiting_frames();
        runtime.announce(session, states)
    }

    fn request_exit_session(session: sys::Session) {
        let mut runtime = runtime();
        let states = runtime.session(session)?.0.lifecycle.request_exit()?;
        runtime.announce(session, states)
    }
}
