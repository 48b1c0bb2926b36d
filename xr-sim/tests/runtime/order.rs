//! Calls out of their order get the specification's codes.

use std::ptr;

use openxr as xr;
use openxr::sys::{self, Result as Code};
use xr_sim::configure;

use crate::common::codes::*;
use crate::common::*;

#[test]
fn sessions_and_frames_are_begun_and_ended_in_order() {
    let _turn = turn();
    configure(config()).unwrap();
    let (instance, system) = instance(&entry(), V1_0);
    // SAFETY: a session without graphics needs no handles
    let (owner, ..) = unsafe {
        instance.create_session::<xr::Headless>(system, &xr::headless::SessionCreateInfo {})
    }
    .unwrap();
    let (fp, session) = (instance.fp(), owner.as_raw());
    let wait = || {
        // SAFETY: a structure of its type
        unsafe { (fp.wait_frame)(session, ptr::null(), &mut zeroed!(FrameState)) }
    };
    let begin_frame = || {
        // SAFETY: null is allowed
        unsafe { (fp.begin_frame)(session, ptr::null()) }
    };
    let end_frame = |layer_count, ns, environment_blend_mode| {
        let display_time = xr::Time::from_nanos(ns);
        let info = zeroed!(FrameEndInfo);
        let info = sys::FrameEndInfo {
            display_time,
            environment_blend_mode,
            layer_count,
            ..info
        };
        // SAFETY: a structure of its type
        unsafe { (fp.end_frame)(session, &info) }
    };
    let opaque = xr::EnvironmentBlendMode::OPAQUE;
    let additive = xr::EnvironmentBlendMode::ADDITIVE;
    let begin_info = zeroed!(SessionBeginInfo);
    let (not_running, order) = (
        Code::ERROR_SESSION_NOT_RUNNING,
        Code::ERROR_CALL_ORDER_INVALID,
    );
    // SAFETY: structures of their types
    unsafe {
        codes! {
            "wait before begin": wait() => not_running;
            "begin a frame before": begin_frame() => not_running;
            "end a frame before": end_frame(0, 1, opaque) => not_running;
            "exit before": (fp.request_exit_session)(session) => not_running;
            "end before": (fp.end_session)(session) => not_running;
            "begin": (fp.begin_session)(session, &begin_info) => SUCCESS;
            "begin twice": (fp.begin_session)(session, &begin_info) => Code::ERROR_SESSION_RUNNING;
            "end in focus": (fp.end_session)(session) => Code::ERROR_SESSION_NOT_STOPPING;
            "begin a frame not waited for": begin_frame() => order;
            "end a frame not begun": end_frame(0, 1, opaque) => order;
            "wait": wait() => SUCCESS;
            "end a frame only waited for": end_frame(0, 1, opaque) => order;
            "begin a frame": begin_frame() => SUCCESS;
            "begin it twice": begin_frame() => order;
            "wait for the next": wait() => SUCCESS;
            "begin the next": begin_frame() => Code::FRAME_DISCARDED;
            "end at no time": end_frame(0, 0, opaque) => Code::ERROR_TIME_INVALID;
            "end additively":
                end_frame(0, 1, additive) => Code::ERROR_ENVIRONMENT_BLEND_MODE_UNSUPPORTED;
            "end in no mode": end_frame(0, 1, xr::EnvironmentBlendMode::from_raw(9)) => INVALID;
            "too many layers": end_frame(17, 1, opaque) => Code::ERROR_LAYER_LIMIT_EXCEEDED;
            "layers at null": end_frame(1, 1, opaque) => INVALID;
            "end": end_frame(0, 1, opaque) => SUCCESS;
            "end twice": end_frame(0, 1, opaque) => order;
            "exit": (fp.request_exit_session)(session) => SUCCESS;
            "end the session": (fp.end_session)(session) => SUCCESS;
            "begin once more":
                (fp.begin_session)(session, &begin_info) => Code::ERROR_SESSION_NOT_READY;
        }
    }
}

#[test]
fn a_session_needs_a_device_that_the_runtime_told() {
    let _turn = turn();
    configure(config()).unwrap();
    let mut extensions = xr::ExtensionSet::default();
    extensions.khr_vulkan_enable2 = true;
    let application = xr::ApplicationInfo {
        application_name: "test",
        ..Default::default()
    };
    let instance = entry()
        .create_instance(&application, &extensions, &[], &())
        .unwrap();
    let system = instance
        .system(xr::FormFactor::HEAD_MOUNTED_DISPLAY)
        .unwrap();
    let create = |binding: Option<&sys::GraphicsBindingVulkanKHR>| {
        let mut info = zeroed!(SessionCreateInfo);
        info.system_id = system;
        info.next = binding.map_or(ptr::null(), |binding| ptr::from_ref(binding).cast());
        let create = instance.fp().create_session;
        // SAFETY: structures of their types
        unsafe { create(instance.as_raw(), &info, &mut Default::default()) }
    };
    let binding = zeroed!(GraphicsBindingVulkanKHR);
    let no_device = Code::ERROR_GRAPHICS_DEVICE_INVALID;
    assert_eq!(create(None), no_device, "headless isn't enabled");
    assert_eq!(
        create(Some(&binding)),
        Code::ERROR_GRAPHICS_REQUIREMENTS_CALL_MISSING
    );
    instance
        .graphics_requirements::<xr::Vulkan>(system)
        .unwrap();
    assert_eq!(create(Some(&binding)), no_device);
}
