//! Instances, their events, and the strings that stand for things.

use std::ffi::c_char;

use openxr_sys as sys;

use super::functions;
use super::pointer::{Out, array, fixed_array, fixed_text};
use crate::config::Setup;
use crate::event::Event;
use crate::extension::{Extension, ExtensionSet};
use crate::instance::Instance;
use crate::runtime::runtime;
use crate::two_call::{two_call, two_call_string};

const RUNTIME_NAME: &str = "xr-sim";

functions! {
    fn enumerate_api_layer_properties(
        capacity: u32,
        count: *mut u32,
        properties: *mut sys::ApiLayerProperties,
    ) {
        two_call(capacity, count, properties, std::iter::empty(), Out::set)
    }

    fn enumerate_instance_extension_properties(
        layer_name: *const c_char,
        capacity: u32,
        count: *mut u32,
        properties: *mut sys::ExtensionProperties,
    ) {
        if !layer_name.address().is_null() {
            return Err(sys::Result::ERROR_API_LAYER_NOT_PRESENT);
        }
        two_call(capacity, count, properties, Extension::ALL.iter(), |mut out, extension| {
            let out = out.verified()?;
            let (name, version) = extension.name_and_version();
            out.extension_name = fixed_array(&String::from_utf8_lossy(name));
            out.extension_version = version;
            Ok(())
        })
    }

    fn create_instance(create_info: *const sys::InstanceCreateInfo, instance: *mut sys::Instance) {
        let info = create_info.verified()?;
        if instance.is_null() || info.create_flags != sys::InstanceCreateFlags::EMPTY {
            return Err(sys::Result::ERROR_VALIDATION_FAILURE);
        }
        let application = &info.application_info;
        let version = application.api_version;
        let current = sys::CURRENT_API_VERSION;
        if version.major() != current.major() || version.minor() > current.minor() {
            return Err(sys::Result::ERROR_API_VERSION_UNSUPPORTED);
        }
        if fixed_text(&application.application_name).is_none_or(str::is_empty)
            || fixed_text(&application.engine_name).is_none()
        {
            return Err(sys::Result::ERROR_NAME_INVALID);
        }
        let mut extensions = ExtensionSet::default();
        for name in array(info, info.enabled_extension_names, info.enabled_extension_count)? {
            let name = super::pointer::text(info, *name, sys::MAX_EXTENSION_NAME_SIZE)?;
            let known = Extension::named(&name);
            extensions.insert(known.ok_or(sys::Result::ERROR_EXTENSION_NOT_PRESENT)?);
        }
        let setup = Setup::current().map_err(|error| {
            crate::report(&error);
            sys::Result::ERROR_INITIALIZATION_FAILED
        })?;
        let handle = runtime().instances.insert(Instance::new(version, extensions, setup));
        instance.set(handle)
    }

    fn destroy_instance(instance: sys::Instance) {
        runtime().destroy_instance(instance)
    }

    fn get_instance_properties(instance: sys::Instance, properties: *mut sys::InstanceProperties) {
        runtime().instances.get(instance)?;
        let mut properties = properties;
        let properties = properties.verified()?;
        let part = |text: &str| text.parse().unwrap_or(0);
        properties.runtime_version = sys::Version::new(
            part(env!("CARGO_PKG_VERSION_MAJOR")) as u16,
            part(env!("CARGO_PKG_VERSION_MINOR")) as u16,
            part(env!("CARGO_PKG_VERSION_PATCH")),
        );
        properties.runtime_name = fixed_array(RUNTIME_NAME);
        Ok(())
    }

    fn poll_event(instance: sys::Instance, event_data: *mut sys::EventDataBuffer) {
        let mut runtime = runtime();
        let instance = runtime.instances.get_mut(instance)?;
        let mut buffer = event_data;
        buffer.verified()?;
        let next = std::ptr::null();
        match instance.events.pop() {
            None => return Ok(sys::Result::EVENT_UNAVAILABLE),
            Some(Event::SessionState { session, state, time }) => {
                let ty = sys::EventDataSessionStateChanged::TYPE;
                let event = sys::EventDataSessionStateChanged { ty, next, session, state, time };
                buffer.cast().set(event)?;
            }
            Some(Event::InteractionProfileChanged { session }) => {
                let ty = sys::EventDataInteractionProfileChanged::TYPE;
                buffer.cast().set(sys::EventDataInteractionProfileChanged { ty, next, session })?;
            }
            Some(Event::EventsLost { count: lost_event_count }) => {
                let ty = sys::EventDataEventsLost::TYPE;
                buffer.cast().set(sys::EventDataEventsLost { ty, next, lost_event_count })?;
            }
        }
        Ok(sys::Result::SUCCESS)
    }

    fn result_to_string(instance: sys::Instance, value: sys::Result, buffer: *mut c_char) {
        runtime().instances.get(instance)?;
        let raw = value.into_raw();
        // the bindings print a value that they know by its name, others as a number
        let text = match format!("{value:?}") {
            name if name != raw.to_string() => format!("XR_{name}"),
            _ if raw < 0 => format!("XR_UNKNOWN_FAILURE_{raw}"),
            _ => format!("XR_UNKNOWN_SUCCESS_{raw}"),
        };
        buffer.cast().set(fixed_array::<{ sys::MAX_RESULT_STRING_SIZE }>(&text))
    }

    fn structure_type_to_string(
        instance: sys::Instance,
        value: sys::StructureType,
        buffer: *mut c_char,
    ) {
        runtime().instances.get(instance)?;
        let raw = value.into_raw();
        let text = match format!("{value:?}") {
            name if name != raw.to_string() => format!("XR_TYPE_{name}"),
            _ => format!("XR_UNKNOWN_STRUCTURE_TYPE_{raw}"),
        };
        buffer.cast().set(fixed_array::<{ sys::MAX_STRUCTURE_NAME_SIZE }>(&text))
    }

    fn string_to_path(instance: sys::Instance, string: *const c_char, path: *mut sys::Path) {
        let mut runtime = runtime();
        let instance = runtime.instances.get_mut(instance)?;
        if string.address().is_null() || path.is_null() {
            return Err(sys::Result::ERROR_VALIDATION_FAILURE);
        }
        let malformed = sys::Result::ERROR_PATH_FORMAT_INVALID;
        let string = string.text(sys::MAX_PATH_LENGTH).map_err(|_| malformed)?;
        path.set(instance.paths.atom(string)?)
    }

    fn path_to_string(
        instance: sys::Instance,
        path: sys::Path,
        capacity: u32,
        count: *mut u32,
        buffer: *mut c_char,
    ) {
        let runtime = runtime();
        let string = runtime.instances.get(instance)?.paths.string(path)?;
        two_call_string(capacity, count, buffer, string)
    }
}
