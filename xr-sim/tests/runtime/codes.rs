//! Wrong arguments and dead handles get the specification's codes.

use std::ffi::{CStr, c_char};
use std::ptr;

use openxr as xr;
use openxr::sys::{self, Handle as _, Result as Code};
use xr_sim::configure;

use crate::common::codes::*;
use crate::common::headless::Headless;
use crate::common::*;

#[test]
fn instances_are_made_of_sound_information_alone() {
    let _turn = turn();
    configure(config()).unwrap();
    let entry = entry();
    let create = |change: &dyn Fn(&mut sys::InstanceCreateInfo)| {
        let mut info = zeroed!(InstanceCreateInfo);
        info.application_info.application_name = text("codes");
        info.application_info.api_version = V1_0;
        change(&mut info);
        let mut instance = sys::Instance::NULL;
        // SAFETY: a structure of its type and a place for the handle
        let code = unsafe { (entry.fp().create_instance)(&info, &mut instance) };
        if code == SUCCESS {
            assert_eq!(destroy(&entry, instance), SUCCESS);
            assert_eq!(destroy(&entry, instance), BAD_HANDLE);
        }
        code
    };
    let version = |major, minor| {
        create(&move |info| info.application_info.api_version = xr::Version::new(major, minor, 99))
    };
    let named = |name| create(&move |info| info.application_info.application_name = name);
    let unknown = [c"XR_XX_no_such_thing".as_ptr()];
    let extended = |names: *const *const c_char| {
        create(&move |info| {
            (info.enabled_extension_count, info.enabled_extension_names) = (1, names);
        })
    };
    let info = zeroed!(InstanceCreateInfo);
    let raw = entry.fp();
    let layer = c"XR_no_layer".as_ptr();
    // SAFETY: null where the case is about null, else places of the right kind
    unsafe {
        codes! {
            "sound": create(&|_| {}) => SUCCESS;
            "1.0.99": version(1, 0) => SUCCESS;
            "1.1.99": version(1, 1) => SUCCESS;
            "0.9": version(0, 9) => Code::ERROR_API_VERSION_UNSUPPORTED;
            "1.2": version(1, 2) => Code::ERROR_API_VERSION_UNSUPPORTED;
            "2.0": version(2, 0) => Code::ERROR_API_VERSION_UNSUPPORTED;
            "type": create(&|info| info.ty = sys::StructureType::UNKNOWN) => INVALID;
            "no name": named(text("")) => Code::ERROR_NAME_INVALID;
            "endless name": named([65; 128]) => Code::ERROR_NAME_INVALID;
            "unknown extension": extended(unknown.as_ptr()) => Code::ERROR_EXTENSION_NOT_PRESENT;
            "extensions at null": extended(ptr::null()) => INVALID;
            "null information": (raw.create_instance)(ptr::null(), &mut Default::default()) => INVALID;
            "null place": (raw.create_instance)(&info, ptr::null_mut()) => INVALID;
            "a layer's extensions":
                (raw.enumerate_instance_extension_properties)(layer, 0, &mut 0, ptr::null_mut())
                => Code::ERROR_API_LAYER_NOT_PRESENT;
        }
    }
}

fn destroy(entry: &xr::Entry, instance: sys::Instance) -> Code {
    let mut function = None;
    let look_up = entry.fp().get_instance_proc_addr;
    // SAFETY: the function's own type; a dead handle is what some cases are about
    unsafe {
        let found = look_up(instance, c"xrDestroyInstance".as_ptr(), &mut function);
        let Some(function) = function else {
            return found;
        };
        type Destroy = sys::pfn::DestroyInstance;
        std::mem::transmute::<sys::pfn::VoidFunction, Destroy>(function)(instance)
    }
}

#[test]
fn functions_are_found_by_who_may_call_them() {
    let _turn = turn();
    configure(config()).unwrap();
    let entry = entry();
    let (old, _) = instance(&entry, V1_0);
    let (new, _) = instance(&entry, V1_1);
    let look_up = |instance: sys::Instance, name: &CStr| {
        let mut function = None;
        let look_up = entry.fp().get_instance_proc_addr;
        // SAFETY: a name and a place for the function
        let code = unsafe { look_up(instance, name.as_ptr(), &mut function) };
        assert_eq!(function.is_some(), code == SUCCESS, "{name:?}");
        code
    };
    let (none, made_up) = (sys::Instance::NULL, sys::Instance::from_raw(77));
    let unsupported = Code::ERROR_FUNCTION_UNSUPPORTED;
    codes! {
        "create without an instance": look_up(none, c"xrCreateInstance") => SUCCESS;
        "get system without one": look_up(none, c"xrGetSystem") => BAD_HANDLE;
        "unknown without one": look_up(none, c"xrNoSuchThing") => BAD_HANDLE;
        "get system": look_up(old.as_raw(), c"xrGetSystem") => SUCCESS;
        "unknown": look_up(old.as_raw(), c"xrNoSuchThing") => unsupported;
        "1.1 of 1.0": look_up(old.as_raw(), c"xrLocateSpaces") => unsupported;
        "1.1 of 1.1": look_up(new.as_raw(), c"xrLocateSpaces") => SUCCESS;
        "of an extension": look_up(old.as_raw(), c"xrCreateVulkanDeviceKHR") => SUCCESS;
        "of another": look_up(old.as_raw(), c"xrGetVulkanGraphicsDeviceKHR") => unsupported;
        "made-up instance": look_up(made_up, c"xrGetSystem") => BAD_HANDLE;
    }
}

#[test]
fn every_kind_of_call_refuses_handles_that_are_none() {
    let _turn = turn();
    configure(config()).unwrap();
    let app = Headless::new(V1_0);
    let fp = app.instance.fp();
    let (time, null) = (xr::Time::from_nanos(1), ptr::null());
    // none, one never given, a living one of another kind, a neighbour
    for raw in [0, u64::MAX, app.raw() ^ 1 << 56, app.raw() + 1] {
        let (session, instance) = (sys::Session::from_raw(raw), sys::Instance::from_raw(raw));
        let (space, swapchain) = (sys::Space::from_raw(raw), sys::Swapchain::from_raw(raw));
        let (action, set) = (sys::Action::from_raw(raw), sys::ActionSet::from_raw(raw));
        let (view, count) = (app.view.as_raw(), &mut 0);
        let location = &mut zeroed!(SpaceLocation);
        // SAFETY: no handle is a living one, so nothing behind the pointers is used
        unsafe {
            codes! {
                "poll": (fp.poll_event)(instance, &mut zeroed!(EventDataBuffer)) => BAD_HANDLE;
                "properties":
                    (fp.get_instance_properties)(instance, &mut zeroed!(InstanceProperties))
                    => BAD_HANDLE;
                "system":
                    (fp.get_system)(instance, &zeroed!(SystemGetInfo), &mut Default::default())
                    => BAD_HANDLE;
                "begin": (fp.begin_session)(session, &zeroed!(SessionBeginInfo)) => BAD_HANDLE;
                "end": (fp.end_session)(session) => BAD_HANDLE;
                "request exit": (fp.request_exit_session)(session) => BAD_HANDLE;
                "destroy session": (fp.destroy_session)(session) => BAD_HANDLE;
                "wait frame": (fp.wait_frame)(session, null, &mut zeroed!(FrameState)) => BAD_HANDLE;
                "begin frame": (fp.begin_frame)(session, ptr::null()) => BAD_HANDLE;
                "end frame": (fp.end_frame)(session, &zeroed!(FrameEndInfo)) => BAD_HANDLE;
                "formats":
                    (fp.enumerate_swapchain_formats)(session, 0, count, ptr::null_mut())
                    => BAD_HANDLE;
                "spaces":
                    (fp.enumerate_reference_spaces)(session, 0, count, ptr::null_mut())
                    => BAD_HANDLE;
                "locate": (fp.locate_space)(space, view, time, location) => BAD_HANDLE;
                "locate in": (fp.locate_space)(view, space, time, location) => BAD_HANDLE;
                "destroy space": (fp.destroy_space)(space) => BAD_HANDLE;
                "acquire": (fp.acquire_swapchain_image)(swapchain, ptr::null(), count) => BAD_HANDLE;
                "wait image":
                    (fp.wait_swapchain_image)(swapchain, &zeroed!(SwapchainImageWaitInfo))
                    => BAD_HANDLE;
                "release": (fp.release_swapchain_image)(swapchain, ptr::null()) => BAD_HANDLE;
                "destroy swapchain": (fp.destroy_swapchain)(swapchain) => BAD_HANDLE;
                "sync": (fp.sync_actions)(session, &zeroed!(ActionsSyncInfo)) => BAD_HANDLE;
                "destroy action": (fp.destroy_action)(action) => BAD_HANDLE;
                "destroy set": (fp.destroy_action_set)(set) => BAD_HANDLE;
            }
        }
    }
}

#[test]
fn wrong_arguments_get_their_codes() {
    let _turn = turn();
    configure(config()).unwrap();
    let mut app = Headless::new(V1_0);
    let (time, no_time) = (app.frame(), xr::Time::from_nanos(0));
    let (fp, session, instance) = (
        app.instance.fp(),
        app.session.as_raw(),
        app.instance.as_raw(),
    );
    let (view, local) = (app.view.as_raw(), app.local.as_raw());
    let path = |text: &CStr| {
        // SAFETY: a text and a place for the path
        unsafe { (fp.string_to_path)(instance, text.as_ptr(), &mut Default::default()) }
    };
    let form_factor = |form_factor| {
        let info = sys::SystemGetInfo {
            form_factor,
            ..zeroed!(SystemGetInfo)
        };
        // SAFETY: structures of their types
        unsafe { (fp.get_system)(instance, &info, &mut Default::default()) }
    };
    let views = |configuration, display_time, space| {
        let mut info = sys::ViewLocateInfo {
            display_time,
            space,
            ..zeroed!(ViewLocateInfo)
        };
        info.view_configuration_type = configuration;
        let (mut state, mut views) = (zeroed!(ViewState), [zeroed!(View); 1]);
        // SAFETY: structures of their types, room for one view
        unsafe { (fp.locate_views)(session, &info, &mut state, 1, &mut 0, views.as_mut_ptr()) }
    };
    let reference = |ty, w| {
        let mut info = zeroed!(ReferenceSpaceCreateInfo);
        info.reference_space_type = ty;
        info.pose_in_reference_space.orientation.w = w;
        // SAFETY: structures of their types
        unsafe { (fp.create_reference_space)(session, &info, &mut Default::default()) }
    };
    let system = |id| {
        let id = sys::SystemId::from_raw(id);
        // SAFETY: structures of their types
        unsafe { (fp.get_system_properties)(instance, id, &mut zeroed!(SystemProperties)) }
    };
    let string = |path, buffer: &mut [c_char]| {
        let (capacity, buffer) = (buffer.len() as u32, buffer.as_mut_ptr());
        // SAFETY: the buffer has its capacity
        unsafe { (fp.path_to_string)(instance, path, capacity, &mut 0, buffer) }
    };
    let locate = |time, location: &mut sys::SpaceLocation| {
        // SAFETY: living handles, a structure
        unsafe { (fp.locate_space)(view, local, time, location) }
    };
    let known_path = app.instance.string_to_path("/user/hand/left").unwrap();
    use sys::{FormFactor, ReferenceSpaceType as Space, ViewConfigurationType as Views};
    let size_insufficient = Code::ERROR_SIZE_INSUFFICIENT;
    codes! {
        "a path": path(c"/user/hand/left") => SUCCESS;
        "no path": path(c"user hand") => Code::ERROR_PATH_FORMAT_INVALID;
        "no atom": string(sys::Path::from_raw(999), &mut []) => Code::ERROR_PATH_INVALID;
        "short buffer": string(known_path, &mut [0; 4]) => size_insufficient;
        "head-mounted": form_factor(FormFactor::HEAD_MOUNTED_DISPLAY) => SUCCESS;
        "handheld":
            form_factor(FormFactor::HANDHELD_DISPLAY) => Code::ERROR_FORM_FACTOR_UNSUPPORTED;
        "no form factor": form_factor(FormFactor::from_raw(99)) => INVALID;
        "no system": system(7) => Code::ERROR_SYSTEM_INVALID;
        "two views in a place for one":
            views(Views::PRIMARY_STEREO, time, local) => size_insufficient;
        "one view":
            views(Views::PRIMARY_MONO, time, local)
            => Code::ERROR_VIEW_CONFIGURATION_TYPE_UNSUPPORTED;
        "no configuration": views(Views::from_raw(99), time, local) => INVALID;
        "views at no time":
            views(Views::PRIMARY_STEREO, no_time, local) => Code::ERROR_TIME_INVALID;
        "views in no space":
            views(Views::PRIMARY_STEREO, time, sys::Space::NULL) => BAD_HANDLE;
        "a reference space": reference(Space::LOCAL, 1.0) => SUCCESS;
        "one of 1.1 in 1.0":
            reference(Space::LOCAL_FLOOR, 1.0) => Code::ERROR_REFERENCE_SPACE_UNSUPPORTED;
        "no reference space": reference(Space::from_raw(99), 1.0) => INVALID;
        "no rotation": reference(Space::LOCAL, 0.5) => Code::ERROR_POSE_INVALID;
        "not a number": reference(Space::LOCAL, f32::NAN) => Code::ERROR_POSE_INVALID;
        "located": locate(time, &mut zeroed!(SpaceLocation)) => SUCCESS;
        "located at no time":
            locate(no_time, &mut zeroed!(SpaceLocation)) => Code::ERROR_TIME_INVALID;
        "wrong type": locate(time, &mut mistyped!(SpaceLocation)) => INVALID;
    }
    // SAFETY: structures of their types; null only where the case is about it
    unsafe {
        let (stage, bounds) = (Space::STAGE, &mut sys::Extent2Df::default());
        codes! {
            "null": (fp.locate_space)(view, local, time, ptr::null_mut()) => INVALID;
            "mistyped event":
                (fp.poll_event)(instance, &mut mistyped!(EventDataBuffer)) => INVALID;
            "no bounds":
                (fp.get_reference_space_bounds_rect)(session, stage, bounds)
                => Code::SPACE_BOUNDS_UNAVAILABLE;
        }
    }
}

#[test]
fn codes_and_types_have_their_names() {
    let _turn = turn();
    configure(config()).unwrap();
    let (instance, _) = instance(&entry(), V1_0);
    let result = |raw| instance.result_to_string(Code::from_raw(raw)).unwrap();
    assert_eq!(result(0), "XR_SUCCESS");
    assert_eq!(result(-12), "XR_ERROR_HANDLE_INVALID");
    assert_eq!(result(4711), "XR_UNKNOWN_SUCCESS_4711");
    assert_eq!(result(-4711), "XR_UNKNOWN_FAILURE_-4711");
    let ty = |raw| {
        instance
            .structure_type_to_string(sys::StructureType::from_raw(raw))
            .unwrap()
    };
    assert_eq!(ty(44), "XR_TYPE_FRAME_STATE");
    assert_eq!(ty(4711), "XR_UNKNOWN_STRUCTURE_TYPE_4711");
}

#[test]
fn handles_die_with_their_parents() {
    let _turn = turn();
    configure(config()).unwrap();
    let app = Headless::new(V1_0);
    let fp = *app.instance.fp();
    let (session, instance) = (app.session.as_raw(), app.instance.as_raw());
    let (view, set, select) = (app.view.as_raw(), app.set.as_raw(), app.select.as_raw());
    let time = xr::Time::from_nanos(1);
    // SAFETY: the handles are living ones, or dead as the case has it
    unsafe {
        let locate = || (fp.locate_space)(view, view, time, &mut zeroed!(SpaceLocation));
        let poll = || (fp.poll_event)(instance, &mut zeroed!(EventDataBuffer));
        codes! {
            "a living space": locate() => SUCCESS;
            "its session's end": (fp.destroy_session)(session) => SUCCESS;
            "the session": (fp.end_session)(session) => BAD_HANDLE;
            "the space": locate() => BAD_HANDLE;
            "the space's end": (fp.destroy_space)(view) => BAD_HANDLE;
            "no event of the session": poll() => Code::EVENT_UNAVAILABLE;
            "the set's end": (fp.destroy_action_set)(set) => SUCCESS;
            "its action": (fp.destroy_action)(select) => BAD_HANDLE;
            "the instance's end": (fp.destroy_instance)(instance) => SUCCESS;
            "the instance": poll() => BAD_HANDLE;
        }
    }
}
