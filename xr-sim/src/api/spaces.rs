//! Spaces: made and located.

use openxr_sys as sys;
use openxr_sys::ReferenceSpaceType;

use super::functions;
use super::pointer::{Out, array, chained_out};
use crate::XrResult;
use crate::extension::Extension;
use crate::pose::{Pose, vector3f};
use crate::runtime::{Runtime, runtime};
use crate::space::{self, Location, Origin, Space};
use crate::two_call::two_call_values;

/// `REFERENCE_SPACE_UNSUPPORTED` for a space that the headset hasn't got, `VALIDATION_FAILURE` for what is none at all.
fn verify_reference(ty: ReferenceSpaceType, is_1_1: bool) -> XrResult<()> {
    use ReferenceSpaceType as Type;
    if space::reference_spaces(is_1_1).contains(&ty) {
        return Ok(());
    }
    match ty {
        Type::LOCAL_FLOOR
        | Type::UNBOUNDED_MSFT
        | Type::COMBINED_EYE_VARJO
        | Type::LOCALIZATION_MAP_ML
        | Type::UNBOUNDED_ANDROID => Err(sys::Result::ERROR_REFERENCE_SPACE_UNSUPPORTED),
        _ => Err(sys::Result::ERROR_VALIDATION_FAILURE),
    }
}

/// Locates one space in another of the same session.
fn locate(
    runtime: &Runtime,
    space: sys::Space,
    base: sys::Space,
    time: sys::Time,
    wants_velocity: bool,
) -> XrResult<Location> {
    let session = runtime.spaces.get(space)?.session;
    let (space, base) = (
        runtime.resolve(space, session)?,
        runtime.resolve(base, session)?,
    );
    super::verify_time(time)?;
    let (of_session, instance) = runtime.peek(session)?;
    let time_ns = of_session.pacing.script_time_ns(time);
    Ok(space::locate(
        &instance.setup.script,
        space,
        base,
        time_ns,
        wants_velocity,
    ))
}

functions! {
    fn enumerate_reference_spaces(
        session: sys::Session,
        capacity: u32,
        count: *mut u32,
        spaces: *mut ReferenceSpaceType,
    ) {
        let runtime = runtime();
        let (_, instance) = runtime.peek(session)?;
        two_call_values(capacity, count, spaces, space::reference_spaces(instance.is_1_1()))
    }

    fn create_reference_space(
        session: sys::Session,
        create_info: *const sys::ReferenceSpaceCreateInfo,
        space: *mut sys::Space,
    ) {
        let mut runtime = runtime();
        let (_, instance) = runtime.session(session)?;
        let info = create_info.verified()?;
        verify_reference(info.reference_space_type, instance.is_1_1())?;
        let origin_from_space = Pose::verified(&info.pose_in_reference_space)?;
        let origin = Origin::Reference(info.reference_space_type);
        if space.is_null() {
            return Err(sys::Result::ERROR_VALIDATION_FAILURE);
        }
        space.set(runtime.spaces.insert(Space { session, origin, origin_from_space }))
    }

    fn get_reference_space_bounds_rect(
        session: sys::Session,
        reference_space_type: ReferenceSpaceType,
        bounds: *mut sys::Extent2Df,
    ) {
        let runtime = runtime();
        let (_, instance) = runtime.peek(session)?;
        bounds.set(sys::Extent2Df { width: 0.0, height: 0.0 })?;
        verify_reference(reference_space_type, instance.is_1_1())?;
        Ok(sys::Result::SPACE_BOUNDS_UNAVAILABLE)
    }

    fn create_action_space(
        session: sys::Session,
        create_info: *const sys::ActionSpaceCreateInfo,
        space: *mut sys::Space,
    ) {
        let mut runtime = runtime();
        let (_, instance) = runtime.peek(session)?;
        let info = create_info.verified()?;
        let action = runtime.actions.get(info.action)?;
        let origin_from_space = Pose::verified(&info.pose_in_action_space)?;
        if action.kind != sys::ActionType::POSE_INPUT {
            return Err(sys::Result::ERROR_ACTION_TYPE_MISMATCH);
        }
        if info.subaction_path != sys::Path::NULL {
            instance.paths.string(info.subaction_path)?;
            if !action.subactions.contains(&info.subaction_path) {
                return Err(sys::Result::ERROR_PATH_UNSUPPORTED);
            }
        }
        if space.is_null() {
            return Err(sys::Result::ERROR_VALIDATION_FAILURE);
        }
        let origin = Origin::Action { action: info.action, subaction: info.subaction_path };
        space.set(runtime.spaces.insert(Space { session, origin, origin_from_space }))
    }

    fn locate_space(
        space: sys::Space,
        base_space: sys::Space,
        time: sys::Time,
        location: *mut sys::SpaceLocation,
    ) {
        let runtime = runtime();
        let session = runtime.spaces.get(space)?.session;
        let mut location = location;
        let out = location.verified()?;
        let velocity = chained_out::<sys::SpaceVelocity>(out.next)?;
        let found = locate(&runtime, space, base_space, time, velocity.is_some())?;
        out.location_flags = sys::SpaceLocationFlags::from_raw(found.flags);
        out.pose = found.base_from_space.into();
        if let Some(mut velocity) = velocity {
            let velocity = velocity.verified()?;
            velocity.velocity_flags = sys::SpaceVelocityFlags::from_raw(found.velocity_flags);
            velocity.linear_velocity = vector3f(found.linear_velocity);
            velocity.angular_velocity = vector3f(found.angular_velocity);
        }
        let (of_session, instance) = runtime.peek(session)?;
        if instance.extensions.contains(Extension::EyeGazeInteraction)
            && let Some(mut sample) = chained_out::<sys::EyeGazeSampleTimeEXT>(out.next)?
        {
            let unknown = sys::Time::from_nanos(0);
            let time = found.gaze_time_ns.map(|time_ns| of_session.pacing.time(time_ns));
            sample.verified()?.time = time.unwrap_or(unknown);
        }
        Ok(())
    }

    fn locate_spaces(
        session: sys::Session,
        locate_info: *const sys::SpacesLocateInfo,
        space_locations: *mut sys::SpaceLocations,
    ) {
        let runtime = runtime();
        runtime.peek(session)?;
        let info = locate_info.verified()?;
        let mut space_locations = space_locations;
        let out = space_locations.verified()?;
        let spaces = array(info, info.spaces, info.space_count)?;
        let mut velocities = chained_out::<sys::SpaceVelocities>(out.next)?;
        let velocities = velocities.as_mut().map(Out::verified).transpose()?;
        let counts = [Some(out.location_count), velocities.as_ref().map(|it| it.velocity_count)];
        if spaces.is_empty() || counts.into_iter().flatten().any(|count| count != info.space_count) {
            return Err(sys::Result::ERROR_VALIDATION_FAILURE);
        }
        let wants_velocity = velocities.is_some();
        let mut found = Vec::with_capacity(spaces.len());
        runtime.resolve(info.base_space, session)?;
        for &space in spaces {
            runtime.resolve(space, session)?;
            found.push(locate(&runtime, space, info.base_space, info.time, wants_velocity)?);
        }
        for (index, location) in found.iter().enumerate() {
            super::pointer::element(out.locations, index)?.set(sys::SpaceLocationData {
                location_flags: sys::SpaceLocationFlags::from_raw(location.flags),
                pose: location.base_from_space.into(),
            })?;
            if let Some(velocities) = &velocities {
                super::pointer::element(velocities.velocities, index)?.set(sys::SpaceVelocityData {
                    velocity_flags: sys::SpaceVelocityFlags::from_raw(location.velocity_flags),
                    linear_velocity: vector3f(location.linear_velocity),
                    angular_velocity: vector3f(location.angular_velocity),
                })?;
            }
        }
        Ok(())
    }

    fn destroy_space(space: sys::Space) {
        runtime().spaces.remove(space).map(drop)
    }
}
