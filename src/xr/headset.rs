//! Which runtime and which headset there is: the OpenXR instance and its system.

use super::{XrError, failed, interop};
use openxr::sys;

/// What runtime and headset say of themselves.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HeadsetInfo {
    /// Name of the runtime.
    pub runtime_name: String,
    /// Version of the runtime, `major.minor.patch`.
    pub runtime_version: String,
    /// Name of the headset.
    pub system_name: String,
    /// Whether it tracks eyes (`XR_EXT_eye_gaze_interaction`).
    pub supports_eye_gaze: bool,
    /// Recommended width and height of the image of each eye, pixels (the larger where the eyes differ).
    pub recommended_size: [u32; 2],
    /// Largest width and height of the image of each eye, pixels.
    pub max_size: [u32; 2],
}

/// A connected runtime and its headset.
pub struct Headset {
    /// What they say of themselves.
    pub info: HeadsetInfo,
    /// Extensions that macula knows and the runtime offers, sorted.
    pub extensions: Vec<String>,
    pub(super) instance: openxr::Instance,
    pub(super) system: openxr::SystemId,
    /// `XR_EXT_eye_gaze_interaction` is enabled: its binding must be suggested, tracker or not.
    pub(super) eye_gaze_enabled: bool,
}

impl Headset {
    /// Makes the instance and finds the headset.
    ///
    /// # Errors
    /// [`XrError`]: no active runtime, no headset, no Vulkan through `XR_KHR_vulkan_enable2`, no stereo.
    pub fn open(entry: &openxr::Entry) -> Result<Self, XrError> {
        let offered = entry
            .enumerate_extensions()
            .map_err(no_runtime("xrEnumerateInstanceExtensionProperties"))?;
        let mut enabled = openxr::ExtensionSet::default();
        enabled.khr_vulkan_enable2 = offered.khr_vulkan_enable2;
        enabled.ext_eye_gaze_interaction = offered.ext_eye_gaze_interaction;
        let application = openxr::ApplicationInfo {
            application_name: "macula",
            application_version: 0,
            engine_name: "macula",
            engine_version: 0,
            // What the oldest loaders take; nothing newer is used.
            api_version: openxr::Version::new(1, 0, 0),
        };
        let instance = entry
            .create_instance(&application, &enabled, &[], &())
            .map_err(no_runtime("xrCreateInstance"))?;
        let properties = instance
            .properties()
            .map_err(failed("xrGetInstanceProperties"))?;
        let runtime = properties.runtime_name;
        if !offered.khr_vulkan_enable2 {
            return Err(unsuitable(
                &runtime,
                "it does not offer XR_KHR_vulkan_enable2; use a runtime with Vulkan",
            ));
        }
        let system = find_system(&instance, &runtime)?;
        let (recommended_size, max_size) = eye_sizes(&instance, system, &runtime)?;
        let info = HeadsetInfo {
            runtime_name: runtime,
            runtime_version: properties.runtime_version.to_string(),
            system_name: instance
                .system_properties(system)
                .map_err(failed("xrGetSystemProperties"))?
                .system_name,
            supports_eye_gaze: enabled.ext_eye_gaze_interaction
                && interop::supports_eye_gaze(&instance, system)?,
            recommended_size,
            max_size,
        };
        Ok(Self {
            info,
            extensions: extension_names(&offered),
            instance,
            system,
            eye_gaze_enabled: enabled.ext_eye_gaze_interaction,
        })
    }

    /// How pictures are laid over the world: opaque where the headset can.
    pub(super) fn blend_mode(&self) -> Result<openxr::EnvironmentBlendMode, XrError> {
        let modes = self
            .instance
            .enumerate_environment_blend_modes(self.system, STEREO)
            .map_err(failed("xrEnumerateEnvironmentBlendModes"))?;
        let opaque = openxr::EnvironmentBlendMode::OPAQUE;
        if modes.contains(&opaque) {
            return Ok(opaque);
        }
        modes
            .first()
            .copied()
            .ok_or_else(|| unsuitable(&self.info.runtime_name, "it offers no blend mode"))
    }
}

/// The one view configuration that macula renders.
pub(super) const STEREO: openxr::ViewConfigurationType =
    openxr::ViewConfigurationType::PRIMARY_STEREO;

fn unsuitable(runtime: &str, reason: &str) -> XrError {
    XrError::Unsuitable {
        runtime: runtime.into(),
        reason: reason.into(),
    }
}

/// A missing runtime shows in several ways: older loaders tell of a missing or broken file, Monado without its service of a failure.
fn no_runtime(call: &'static str) -> impl Fn(sys::Result) -> XrError {
    move |result| match result {
        sys::Result::ERROR_RUNTIME_UNAVAILABLE
        | sys::Result::ERROR_FILE_ACCESS_ERROR
        | sys::Result::ERROR_FILE_CONTENTS_INVALID
        | sys::Result::ERROR_INITIALIZATION_FAILED
        | sys::Result::ERROR_RUNTIME_FAILURE => XrError::NoRuntime(result),
        result => XrError::Call { call, result },
    }
}

fn find_system(instance: &openxr::Instance, runtime: &str) -> Result<openxr::SystemId, XrError> {
    instance
        .system(openxr::FormFactor::HEAD_MOUNTED_DISPLAY)
        .map_err(|result| match result {
            sys::Result::ERROR_FORM_FACTOR_UNAVAILABLE
            | sys::Result::ERROR_FORM_FACTOR_UNSUPPORTED => XrError::NoHeadset {
                runtime: runtime.into(),
                result,
            },
            result => XrError::Call {
                call: "xrGetSystem",
                result,
            },
        })
}

/// Recommended and largest image size that fits both eyes.
fn eye_sizes(
    instance: &openxr::Instance,
    system: openxr::SystemId,
    runtime: &str,
) -> Result<([u32; 2], [u32; 2]), XrError> {
    let configurations = instance
        .enumerate_view_configurations(system)
        .map_err(failed("xrEnumerateViewConfigurations"))?;
    if !configurations.contains(&STEREO) {
        return Err(unsuitable(runtime, "its headset is not stereoscopic"));
    }
    let eyes = instance
        .enumerate_view_configuration_views(system, STEREO)
        .map_err(failed("xrEnumerateViewConfigurationViews"))?;
    let [left, right] = eyes[..] else {
        return Err(unsuitable(
            runtime,
            "its stereo view configuration has not two views",
        ));
    };
    let recommended = [
        left.recommended_image_rect_width
            .max(right.recommended_image_rect_width),
        left.recommended_image_rect_height
            .max(right.recommended_image_rect_height),
    ];
    let max = [
        left.max_image_rect_width.min(right.max_image_rect_width),
        left.max_image_rect_height.min(right.max_image_rect_height),
    ];
    Ok((recommended, max))
}

fn extension_names(set: &openxr::ExtensionSet) -> Vec<String> {
    let mut names: Vec<String> = set
        .names()
        .into_iter()
        .map(|name| {
            String::from_utf8_lossy(name)
                .trim_end_matches('\0')
                .to_owned()
        })
        .collect();
    names.sort();
    names
}
