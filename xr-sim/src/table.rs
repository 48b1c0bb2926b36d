//! Every function by its name, and who may call it.

use std::ffi::c_char;
use std::mem;

use openxr_sys as sys;
use openxr_sys::Handle;
use openxr_sys::pfn;

use crate::api::pointer::{Out, Trusted};
use crate::api::{
    actions, boundary, frames, instances, sessions, spaces, swapchains, views, vulkan,
};
use crate::extension::Extension;
use crate::runtime::runtime;

/// The longest function name that is read.
const MAX_NAME: usize = 256;

/// What an instance needs for a function to be there.
enum Needs {
    /// Not even an instance.
    Nothing,
    Instance,
    Version(sys::Version),
    Extension(Extension),
}

/// `"name": type = function`, the type checked by the compiler; without a name it is the type's.
macro_rules! look_up {
    ($wanted:expr; $($needs:expr => { $($($name:literal:)? $ty:ident = $function:path;)* })*) => {
        $($(
            let name = [$($name,)? concat!("xr", stringify!($ty))][0];
            if $wanted == name {
                let function: pfn::$ty = $function;
                // SAFETY: one function pointer for another; the caller casts it back to `$ty`
                let function = unsafe { mem::transmute::<pfn::$ty, pfn::VoidFunction>(function) };
                return Some(($needs, function));
            }
        )*)*
    };
}

fn function(name: &str) -> Option<(Needs, pfn::VoidFunction)> {
    look_up! { name;
        Needs::Nothing => {
            EnumerateApiLayerProperties = instances::enumerate_api_layer_properties;
            EnumerateInstanceExtensionProperties = instances::enumerate_instance_extension_properties;
            CreateInstance = instances::create_instance;
            GetInstanceProcAddr = get_instance_proc_addr;
        }
        Needs::Instance => {
            DestroyInstance = instances::destroy_instance;
            GetInstanceProperties = instances::get_instance_properties;
            PollEvent = instances::poll_event;
            ResultToString = instances::result_to_string;
            StructureTypeToString = instances::structure_type_to_string;
            StringToPath = instances::string_to_path;
            PathToString = instances::path_to_string;
            GetSystem = views::get_system;
            GetSystemProperties = views::get_system_properties;
            EnumerateEnvironmentBlendModes = views::enumerate_environment_blend_modes;
            EnumerateViewConfigurations = views::enumerate_view_configurations;
            GetViewConfigurationProperties = views::get_view_configuration_properties;
            EnumerateViewConfigurationViews = views::enumerate_view_configuration_views;
            LocateViews = views::locate_views;
            CreateSession = sessions::create_session;
            DestroySession = sessions::destroy_session;
            BeginSession = sessions::begin_session;
            EndSession = sessions::end_session;
            RequestExitSession = sessions::request_exit_session;
            WaitFrame = frames::wait_frame;
            BeginFrame = frames::begin_frame;
            EndFrame = frames::end_frame;
            EnumerateReferenceSpaces = spaces::enumerate_reference_spaces;
            CreateReferenceSpace = spaces::create_reference_space;
            GetReferenceSpaceBoundsRect = spaces::get_reference_space_bounds_rect;
            CreateActionSpace = spaces::create_action_space;
            LocateSpace = spaces::locate_space;
            DestroySpace = spaces::destroy_space;
            EnumerateSwapchainFormats = swapchains::enumerate_swapchain_formats;
            CreateSwapchain = swapchains::create_swapchain;
            DestroySwapchain = swapchains::destroy_swapchain;
            EnumerateSwapchainImages = swapchains::enumerate_swapchain_images;
            AcquireSwapchainImage = swapchains::acquire_swapchain_image;
            WaitSwapchainImage = swapchains::wait_swapchain_image;
            ReleaseSwapchainImage = swapchains::release_swapchain_image;
            CreateActionSet = actions::create_action_set;
            DestroyActionSet = actions::destroy_action_set;
            CreateAction = actions::create_action;
            DestroyAction = actions::destroy_action;
            SuggestInteractionProfileBindings = actions::suggest_interaction_profile_bindings;
            AttachSessionActionSets = actions::attach_session_action_sets;
            GetCurrentInteractionProfile = actions::get_current_interaction_profile;
            SyncActions = actions::sync_actions;
            GetActionStateBoolean = actions::get_action_state_boolean;
            GetActionStateFloat = actions::get_action_state_float;
            GetActionStateVector2f = actions::get_action_state_vector2f;
            GetActionStatePose = actions::get_action_state_pose;
            EnumerateBoundSourcesForAction = actions::enumerate_bound_sources_for_action;
            GetInputSourceLocalizedName = actions::get_input_source_localized_name;
            ApplyHapticFeedback = actions::apply_haptic_feedback;
            StopHapticFeedback = actions::stop_haptic_feedback;
        }
        Needs::Version(sys::Version::new(1, 1, 0)) => {
            LocateSpaces = spaces::locate_spaces;
        }
        Needs::Extension(Extension::VulkanEnable) => {
            GetVulkanInstanceExtensionsKHR = vulkan::get_instance_extensions;
            GetVulkanDeviceExtensionsKHR = vulkan::get_device_extensions;
            GetVulkanGraphicsDeviceKHR = vulkan::get_graphics_device;
            GetVulkanGraphicsRequirementsKHR = vulkan::get_graphics_requirements;
        }
        Needs::Extension(Extension::VulkanEnable2) => {
            CreateVulkanInstanceKHR = vulkan::create_instance;
            CreateVulkanDeviceKHR = vulkan::create_device;
            GetVulkanGraphicsDevice2KHR = vulkan::get_graphics_device2;
            "xrGetVulkanGraphicsRequirements2KHR": GetVulkanGraphicsRequirementsKHR = vulkan::get_graphics_requirements;
        }
    }
    None
}

/// The runtime's `xrGetInstanceProcAddr`: the entry point for an application in this process, as
/// `openxr::Entry::from_get_instance_proc_addr` takes it.
///
/// # Safety
/// As the specification has it: `name` ends by a zero, `function` has room for a pointer.
pub unsafe extern "system" fn get_instance_proc_addr(
    instance: sys::Instance,
    name: *const c_char,
    function: *mut Option<pfn::VoidFunction>,
) -> sys::Result {
    // SAFETY: as this function asks of its caller
    let (name, out) = unsafe { (name.trust(), function.trust()) };
    boundary("get_instance_proc_addr", move || {
        let out: Out<Option<pfn::VoidFunction>> = out;
        out.set(None)?;
        let found = self::function(name.text(MAX_NAME)?);
        if instance == sys::Instance::NULL {
            return match found {
                Some((Needs::Nothing, function)) => out.set(Some(function)),
                _ => Err(sys::Result::ERROR_HANDLE_INVALID),
            };
        }
        let runtime = runtime();
        let instance = runtime.instances.get(instance)?;
        let (needs, function) = found.ok_or(sys::Result::ERROR_FUNCTION_UNSUPPORTED)?;
        let is_there = match needs {
            Needs::Nothing | Needs::Instance => true,
            Needs::Version(version) => instance.api_version >= version,
            Needs::Extension(extension) => instance.extensions.contains(extension),
        };
        if !is_there {
            return Err(sys::Result::ERROR_FUNCTION_UNSUPPORTED);
        }
        out.set(Some(function))
    })
}
