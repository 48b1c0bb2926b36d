//! The system and its views.

use openxr_sys as sys;

use super::functions;
use super::pointer::{chained_out, fixed_array};
use crate::XrResult;
use crate::config::{MAX_IMAGE_SIZE, MAX_SWAPCHAIN_SIZE};
use crate::extension::Extension;
use crate::runtime::runtime;
use crate::space::{self, Resolved};
use crate::two_call::{two_call, two_call_values};

/// How many layers a frame may have.
pub(crate) const MAX_LAYERS: u32 = 16;

/// The most samples of a view's swapchain that are recommended at all.
const MAX_SAMPLES: u32 = 4;

/// The only view configuration: two eyes.
const STEREO: sys::ViewConfigurationType = sys::ViewConfigurationType::PRIMARY_STEREO;

/// `VIEW_CONFIGURATION_TYPE_UNSUPPORTED` for any but stereo, `VALIDATION_FAILURE` for what is none at all.
pub(super) fn verify_configuration(ty: sys::ViewConfigurationType) -> XrResult<()> {
    use sys::ViewConfigurationType as Type;
    match ty {
        STEREO => Ok(()),
        Type::PRIMARY_MONO | Type::PRIMARY_STEREO_WITH_FOVEATED_INSET => {
            Err(sys::Result::ERROR_VIEW_CONFIGURATION_TYPE_UNSUPPORTED)
        }
        _ => Err(sys::Result::ERROR_VALIDATION_FAILURE),
    }
}

functions! {
    fn get_system(
        instance: sys::Instance,
        get_info: *const sys::SystemGetInfo,
        system_id: *mut sys::SystemId,
    ) {
        let runtime = runtime();
        let instance = runtime.instances.get(instance)?;
        match get_info.verified()?.form_factor {
            sys::FormFactor::HEAD_MOUNTED_DISPLAY => system_id.set(instance.system()),
            sys::FormFactor::HANDHELD_DISPLAY => Err(sys::Result::ERROR_FORM_FACTOR_UNSUPPORTED),
            _ => Err(sys::Result::ERROR_VALIDATION_FAILURE),
        }
    }

    fn get_system_properties(
        instance: sys::Instance,
        system_id: sys::SystemId,
        properties: *mut sys::SystemProperties,
    ) {
        let runtime = runtime();
        let instance = runtime.instances.get(instance)?;
        let mut properties = properties;
        let properties = properties.verified()?;
        instance.verify_system(system_id)?;
        properties.system_id = system_id;
        properties.vendor_id = 0;
        properties.system_name = fixed_array("xr-sim headset");
        properties.graphics_properties = sys::SystemGraphicsProperties {
            max_swapchain_image_height: MAX_SWAPCHAIN_SIZE,
            max_swapchain_image_width: MAX_SWAPCHAIN_SIZE,
            max_layer_count: MAX_LAYERS,
        };
        properties.tracking_properties = sys::SystemTrackingProperties {
            orientation_tracking: sys::TRUE,
            position_tracking: sys::TRUE,
        };
        if instance.extensions.contains(Extension::EyeGazeInteraction) {
            let gaze = chained_out::<sys::SystemEyeGazeInteractionPropertiesEXT>(properties.next)?;
            if let Some(mut gaze) = gaze {
                gaze.verified()?.supports_eye_gaze_interaction = instance.has_eye_gaze().into();
            }
        }
        Ok(())
    }

    fn enumerate_environment_blend_modes(
        instance: sys::Instance,
        system_id: sys::SystemId,
        view_configuration_type: sys::ViewConfigurationType,
        capacity: u32,
        count: *mut u32,
        modes: *mut sys::EnvironmentBlendMode,
    ) {
        runtime().instances.get(instance)?.verify_system(system_id)?;
        verify_configuration(view_configuration_type)?;
        two_call_values(capacity, count, modes, &[sys::EnvironmentBlendMode::OPAQUE])
    }

    fn enumerate_view_configurations(
        instance: sys::Instance,
        system_id: sys::SystemId,
        capacity: u32,
        count: *mut u32,
        types: *mut sys::ViewConfigurationType,
    ) {
        runtime().instances.get(instance)?.verify_system(system_id)?;
        two_call_values(capacity, count, types, &[STEREO])
    }

    fn get_view_configuration_properties(
        instance: sys::Instance,
        system_id: sys::SystemId,
        view_configuration_type: sys::ViewConfigurationType,
        properties: *mut sys::ViewConfigurationProperties,
    ) {
        runtime().instances.get(instance)?.verify_system(system_id)?;
        let mut properties = properties;
        let properties = properties.verified()?;
        verify_configuration(view_configuration_type)?;
        properties.view_configuration_type = view_configuration_type;
        properties.fov_mutable = sys::FALSE;
        Ok(())
    }

    fn enumerate_view_configuration_views(
        instance: sys::Instance,
        system_id: sys::SystemId,
        view_configuration_type: sys::ViewConfigurationType,
        capacity: u32,
        count: *mut u32,
        views: *mut sys::ViewConfigurationView,
    ) {
        let runtime = runtime();
        let instance = runtime.instances.get(instance)?;
        instance.verify_system(system_id)?;
        verify_configuration(view_configuration_type)?;
        let config = &instance.setup.config;
        two_call(capacity, count, views, 0..2, |mut out, _| {
            let view = out.verified()?;
            view.recommended_image_rect_width = config.eye_width;
            view.max_image_rect_width = MAX_IMAGE_SIZE;
            view.recommended_image_rect_height = config.eye_height;
            view.max_image_rect_height = MAX_IMAGE_SIZE;
            view.recommended_swapchain_sample_count = 1;
            view.max_swapchain_sample_count = MAX_SAMPLES;
            Ok(())
        })
    }

    fn locate_views(
        session: sys::Session,
        view_locate_info: *const sys::ViewLocateInfo,
        view_state: *mut sys::ViewState,
        capacity: u32,
        count: *mut u32,
        views: *mut sys::View,
    ) {
        let runtime = runtime();
        let info = view_locate_info.verified()?;
        let mut view_state = view_state;
        let view_state = view_state.verified()?;
        let (of_session, instance) = runtime.peek(session)?;
        verify_configuration(info.view_configuration_type)?;
        super::verify_time(info.display_time)?;
        let base = runtime.resolve(info.space, session)?;
        let head = Resolved::of(sys::ReferenceSpaceType::VIEW);
        let time_ns = of_session.pacing.script_time_ns(info.display_time);
        let script = &instance.setup.script;
        let located = space::locate(script, head, base, time_ns, false);
        // the flags of views and of spaces have the same bits
        view_state.view_state_flags = sys::ViewStateFlags::from_raw(located.flags);
        two_call(capacity, count, views, script.eyes(time_ns).iter(), |mut out, eye| {
            let view = out.verified()?;
            let [angle_left, angle_right, angle_up, angle_down] = eye.fov;
            view.pose = located.base_from_space.then(eye.head_from_eye).into();
            view.fov = sys::Fovf { angle_left, angle_right, angle_up, angle_down };
            Ok(())
        })
    }
}
