//! Actions: defined, bound, attached and read.

use std::collections::HashMap;
use std::ffi::c_char;

use openxr_sys as sys;
use openxr_sys::{ActionType, Handle, Path};

use super::functions;
use super::pointer::{In, array, fixed_text};
use crate::XrResult;
use crate::action::{Action, ActionSet};
use crate::input::{ActionState, ActiveSet, Input, Suggestion};
use crate::instance::Instance;
use crate::path::{TOP_LEVEL_USER_PATHS, is_well_formed_name};
use crate::profile::Profile;
use crate::runtime::{Runtime, runtime};
use crate::two_call::{two_call_string, two_call_values};

const NOT_ATTACHED: sys::Result = sys::Result::ERROR_ACTIONSET_NOT_ATTACHED;

/// The two names of an action or action set, well formed.
fn names<'a>(name: &'a [c_char], localized: &'a [c_char]) -> XrResult<(&'a str, &'a str)> {
    let name = fixed_text(name).filter(|name| !name.is_empty());
    let name = name.ok_or(sys::Result::ERROR_NAME_INVALID)?;
    if !is_well_formed_name(name) {
        return Err(sys::Result::ERROR_PATH_FORMAT_INVALID);
    }
    let localized = fixed_text(localized).filter(|name| !name.is_empty());
    Ok((
        name,
        localized.ok_or(sys::Result::ERROR_LOCALIZED_NAME_INVALID)?,
    ))
}

/// Refuses names that a sibling has.
fn verify_unique<'a>(
    (name, localized): (&str, &str),
    siblings: impl Iterator<Item = (&'a str, &'a str)>,
) -> XrResult<()> {
    for (taken_name, taken_localized) in siblings {
        if taken_name == name {
            return Err(sys::Result::ERROR_NAME_DUPLICATED);
        }
        if taken_localized == localized {
            return Err(sys::Result::ERROR_LOCALIZED_NAME_DUPLICATED);
        }
    }
    Ok(())
}

/// User paths that are known, and named once.
fn verify_subactions(paths: &[Path], instance: &Instance) -> XrResult<()> {
    for (index, path) in paths.iter().enumerate() {
        let string = instance.paths.string(*path)?;
        if !TOP_LEVEL_USER_PATHS.contains(&string) || paths[..index].contains(path) {
            return Err(sys::Result::ERROR_PATH_UNSUPPORTED);
        }
    }
    Ok(())
}

/// The attached actions of a session, for an action of that type and a path that it is told apart by.
fn input_of(
    runtime: &Runtime,
    session: sys::Session,
    action: sys::Action,
    subaction: Path,
    kind: ActionType,
) -> XrResult<&Input> {
    let (of_session, instance) = runtime.peek(session)?;
    let of_action = runtime.actions.get(action)?;
    if subaction != Path::NULL {
        instance.paths.string(subaction)?;
        if !of_action.subactions.contains(&subaction) {
            return Err(sys::Result::ERROR_PATH_UNSUPPORTED);
        }
    }
    if of_action.kind != kind {
        return Err(sys::Result::ERROR_ACTION_TYPE_MISMATCH);
    }
    let input = of_session.input.as_ref().ok_or(NOT_ATTACHED)?;
    input.verify_set(of_action.set)?;
    Ok(input)
}

fn state(
    session: sys::Session,
    get_info: &In<sys::ActionStateGetInfo>,
    kind: ActionType,
) -> XrResult<ActionState> {
    let runtime = runtime();
    runtime.sessions.get(session)?;
    let info = get_info.verified()?;
    input_of(&runtime, session, info.action, info.subaction_path, kind)?
        .state(info.action, info.subaction_path)
}

/// Verifies an output of haptics; the simulated controllers don't buzz.
fn haptics(
    session: sys::Session,
    action_info: &In<sys::HapticActionInfo>,
) -> XrResult<sys::Result> {
    let runtime = runtime();
    let of_session = runtime.sessions.get(session)?;
    let info = action_info.verified()?;
    input_of(
        &runtime,
        session,
        info.action,
        info.subaction_path,
        ActionType::VIBRATION_OUTPUT,
    )?;
    Ok(focused_or_not(of_session.lifecycle.is_focused()))
}

fn focused_or_not(is_focused: bool) -> sys::Result {
    if is_focused {
        sys::Result::SUCCESS
    } else {
        sys::Result::SESSION_NOT_FOCUSED
    }
}

functions! {
    fn create_action_set(
        instance: sys::Instance,
        create_info: *const sys::ActionSetCreateInfo,
        action_set: *mut sys::ActionSet,
    ) {
        let mut runtime = runtime();
        runtime.instances.get(instance)?;
        let info = create_info.verified()?;
        let (name, localized) = names(&info.action_set_name, &info.localized_action_set_name)?;
        let siblings = runtime.action_sets.iter().filter(|(_, set)| set.instance == instance);
        verify_unique(
            (name, localized),
            siblings.map(|(_, set)| (set.name.as_str(), set.localized_name.as_str())),
        )?;
        if action_set.is_null() {
            return Err(sys::Result::ERROR_VALIDATION_FAILURE);
        }
        action_set.set(runtime.action_sets.insert(ActionSet {
            instance,
            name: name.into(),
            localized_name: localized.into(),
            priority: info.priority,
            is_attached: false,
        }))
    }

    fn destroy_action_set(action_set: sys::ActionSet) {
        runtime().destroy_action_set(action_set)
    }

    fn create_action(
        action_set: sys::ActionSet,
        create_info: *const sys::ActionCreateInfo,
        action: *mut sys::Action,
    ) {
        let mut runtime = runtime();
        let set = runtime.action_sets.get(action_set)?;
        let info = create_info.verified()?;
        if set.is_attached {
            return Err(sys::Result::ERROR_ACTIONSETS_ALREADY_ATTACHED);
        }
        let (name, localized) = names(&info.action_name, &info.localized_action_name)?;
        let siblings = runtime.actions.iter().filter(|(_, action)| action.set == action_set);
        verify_unique(
            (name, localized),
            siblings.map(|(_, action)| (action.name.as_str(), action.localized_name.as_str())),
        )?;
        let is_known = matches!(
            info.action_type,
            ActionType::BOOLEAN_INPUT
                | ActionType::FLOAT_INPUT
                | ActionType::VECTOR2F_INPUT
                | ActionType::POSE_INPUT
                | ActionType::VIBRATION_OUTPUT
        );
        if !is_known || action.is_null() {
            return Err(sys::Result::ERROR_VALIDATION_FAILURE);
        }
        let subactions = array(info, info.subaction_paths, info.count_subaction_paths)?.to_vec();
        verify_subactions(&subactions, runtime.instances.get(set.instance)?)?;
        action.set(runtime.actions.insert(Action {
            set: action_set,
            name: name.into(),
            localized_name: localized.into(),
            kind: info.action_type,
            subactions,
        }))
    }

    fn destroy_action(action: sys::Action) {
        runtime().actions.remove(action).map(drop)
    }

    fn suggest_interaction_profile_bindings(
        instance: sys::Instance,
        suggested_bindings: *const sys::InteractionProfileSuggestedBinding,
    ) {
        let mut runtime = runtime();
        let of_instance = runtime.instances.get(instance)?;
        let info = suggested_bindings.verified()?;
        let unsupported = sys::Result::ERROR_PATH_UNSUPPORTED;
        let profile = Profile::named(of_instance.paths.string(info.interaction_profile)?)
            .filter(|it| it.needs.is_none_or(|needed| of_instance.extensions.contains(needed)))
            .ok_or(unsupported)?;
        let bindings = array(info, info.suggested_bindings, info.count_suggested_bindings)?;
        if bindings.is_empty() {
            return Err(sys::Result::ERROR_VALIDATION_FAILURE);
        }
        let mut suggestions = Vec::with_capacity(bindings.len());
        for &sys::ActionSuggestedBinding { action, binding } in bindings {
            let set = runtime.action_sets.get(runtime.actions.get(action)?.set)?;
            if set.instance != instance {
                return Err(sys::Result::ERROR_VALIDATION_FAILURE);
            }
            if set.is_attached {
                return Err(sys::Result::ERROR_ACTIONSETS_ALREADY_ATTACHED);
            }
            if profile.matches(of_instance.paths.string(binding)?).is_empty() {
                return Err(unsupported);
            }
            suggestions.push(Suggestion { action, binding });
        }
        // a later suggestion for the same profile takes the place of an earlier one
        runtime.instances.get_mut(instance)?.suggestions.insert(profile.path, suggestions);
        Ok(())
    }

    fn attach_session_action_sets(
        session: sys::Session,
        attach_info: *const sys::SessionActionSetsAttachInfo,
    ) {
        let mut runtime = runtime();
        let runtime = &mut *runtime;
        let of_session = runtime.sessions.get_mut(session)?;
        let info = attach_info.verified()?;
        let sets = array(info, info.action_sets, info.count_action_sets)?;
        if sets.is_empty() {
            return Err(sys::Result::ERROR_VALIDATION_FAILURE);
        }
        let mut priorities = HashMap::new();
        for &set in sets {
            let of_set = runtime.action_sets.get(set)?;
            if of_set.instance != of_session.instance {
                return Err(sys::Result::ERROR_VALIDATION_FAILURE);
            }
            priorities.insert(set.into_raw(), of_set.priority);
        }
        if of_session.input.is_some() {
            return Err(sys::Result::ERROR_ACTIONSETS_ALREADY_ATTACHED);
        }
        let instance = runtime.instances.get_mut(of_session.instance)?;
        let actions: Vec<_> =
            runtime.actions.iter().filter(|(_, action)| sets.contains(&action.set)).collect();
        let has_eye_gaze = instance.has_eye_gaze();
        let (suggestions, paths) = (&instance.suggestions, &mut instance.paths);
        of_session.input =
            Some(Input::attach(priorities, &actions, suggestions, has_eye_gaze, paths)?);
        for &set in sets {
            runtime.action_sets.get_mut(set)?.is_attached = true;
        }
        Ok(())
    }

    fn get_current_interaction_profile(
        session: sys::Session,
        top_level_user_path: Path,
        interaction_profile: *mut sys::InteractionProfileState,
    ) {
        let mut runtime = runtime();
        let (of_session, instance) = runtime.session(session)?;
        let mut interaction_profile = interaction_profile;
        let out = interaction_profile.verified()?;
        let user = instance.paths.string(top_level_user_path)?.to_owned();
        if !TOP_LEVEL_USER_PATHS.contains(&user.as_str()) {
            return Err(sys::Result::ERROR_PATH_UNSUPPORTED);
        }
        let profile = of_session.input.as_ref().ok_or(NOT_ATTACHED)?.profile(&user);
        out.interaction_profile = match profile {
            Some(profile) => instance.paths.atom(profile.path)?,
            None => Path::NULL,
        };
        Ok(())
    }

    fn sync_actions(session: sys::Session, sync_info: *const sys::ActionsSyncInfo) {
        let mut runtime = runtime();
        let (of_session, instance) = runtime.peek(session)?;
        let info = sync_info.verified()?;
        let sets = array(info, info.active_action_sets, info.count_active_action_sets)?;
        let mut active = Vec::with_capacity(sets.len());
        for &sys::ActiveActionSet { action_set, subaction_path: subaction } in sets {
            runtime.action_sets.get(action_set)?;
            of_session.input.as_ref().ok_or(NOT_ATTACHED)?.verify_set(action_set)?;
            if subaction != Path::NULL {
                instance.paths.string(subaction)?;
                let is_used = |action: &Action| {
                    action.set == action_set && action.subactions.contains(&subaction)
                };
                if !runtime.actions.iter().any(|(_, action)| is_used(action)) {
                    return Err(sys::Result::ERROR_PATH_UNSUPPORTED);
                }
            }
            active.push(ActiveSet { set: action_set, subaction });
        }
        let (of_session, instance) = runtime.session(session)?;
        let is_focused = of_session.lifecycle.is_focused();
        let Some(input) = &mut of_session.input else { return Ok(focused_or_not(is_focused)) };
        if !is_focused {
            input.deactivate();
            return Ok(sys::Result::SESSION_NOT_FOCUSED);
        }
        let now = instance.clock.now();
        let script_time_ns = of_session.pacing.script_time_ns(now);
        if input.sync(&active, &instance.setup.script, script_time_ns, now) {
            instance.events.push(crate::event::Event::InteractionProfileChanged { session });
        }
        Ok(sys::Result::SUCCESS)
    }

    fn get_action_state_boolean(
        session: sys::Session,
        get_info: *const sys::ActionStateGetInfo,
        out: *mut sys::ActionStateBoolean,
    ) {
        let mut out = out;
        let out = out.verified()?;
        let state = state(session, &get_info, ActionType::BOOLEAN_INPUT)?;
        out.current_state = (state.value.x != 0.0).into();
        out.changed_since_last_sync = state.changed.into();
        out.last_change_time = sys::Time::from_nanos(state.last_change_ns);
        out.is_active = state.is_active.into();
        Ok(())
    }

    fn get_action_state_float(
        session: sys::Session,
        get_info: *const sys::ActionStateGetInfo,
        out: *mut sys::ActionStateFloat,
    ) {
        let mut out = out;
        let out = out.verified()?;
        let state = state(session, &get_info, ActionType::FLOAT_INPUT)?;
        out.current_state = state.value.x;
        out.changed_since_last_sync = state.changed.into();
        out.last_change_time = sys::Time::from_nanos(state.last_change_ns);
        out.is_active = state.is_active.into();
        Ok(())
    }

    fn get_action_state_vector2f(
        session: sys::Session,
        get_info: *const sys::ActionStateGetInfo,
        out: *mut sys::ActionStateVector2f,
    ) {
        let mut out = out;
        let out = out.verified()?;
        let state = state(session, &get_info, ActionType::VECTOR2F_INPUT)?;
        out.current_state = sys::Vector2f { x: state.value.x, y: state.value.y };
        out.changed_since_last_sync = state.changed.into();
        out.last_change_time = sys::Time::from_nanos(state.last_change_ns);
        out.is_active = state.is_active.into();
        Ok(())
    }

    fn get_action_state_pose(
        session: sys::Session,
        get_info: *const sys::ActionStateGetInfo,
        out: *mut sys::ActionStatePose,
    ) {
        let mut out = out;
        let out = out.verified()?;
        out.is_active = state(session, &get_info, ActionType::POSE_INPUT)?.is_active.into();
        Ok(())
    }

    fn enumerate_bound_sources_for_action(
        session: sys::Session,
        enumerate_info: *const sys::BoundSourcesForActionEnumerateInfo,
        capacity: u32,
        count: *mut u32,
        sources: *mut Path,
    ) {
        let runtime = runtime();
        let of_session = runtime.sessions.get(session)?;
        let info = enumerate_info.verified()?;
        runtime.actions.get(info.action)?;
        let bound = of_session.input.as_ref().ok_or(NOT_ATTACHED)?.sources(info.action)?;
        let paths: Vec<_> = bound.iter().map(|source| source.path).collect();
        two_call_values(capacity, count, sources, &paths)
    }

    fn get_input_source_localized_name(
        session: sys::Session,
        get_info: *const sys::InputSourceLocalizedNameGetInfo,
        capacity: u32,
        count: *mut u32,
        buffer: *mut c_char,
    ) {
        let runtime = runtime();
        let (of_session, instance) = runtime.peek(session)?;
        let info = get_info.verified()?;
        let wanted = info.which_components;
        use sys::InputSourceLocalizedNameFlags as Part;
        let known = Part::USER_PATH | Part::INTERACTION_PROFILE | Part::COMPONENT;
        if wanted.is_empty() || !known.contains(wanted) {
            return Err(sys::Result::ERROR_VALIDATION_FAILURE);
        }
        let path = instance.paths.string(info.source_path)?;
        let input = of_session.input.as_ref().ok_or(NOT_ATTACHED)?;
        let names = input.source_names(path).ok_or(sys::Result::ERROR_PATH_UNSUPPORTED)?;
        let parts = [Part::USER_PATH, Part::INTERACTION_PROFILE, Part::COMPONENT];
        let chosen: Vec<_> = parts
            .into_iter()
            .zip(names)
            .filter(|(part, name)| wanted.contains(*part) && !name.is_empty())
            .map(|(_, name)| name)
            .collect();
        two_call_string(capacity, count, buffer, &chosen.join(" "))
    }

    fn apply_haptic_feedback(
        session: sys::Session,
        haptic_action_info: *const sys::HapticActionInfo,
        haptic_feedback: *const sys::HapticBaseHeader,
    ) {
        let code = haptics(session, &haptic_action_info)?;
        haptic_feedback.cast::<sys::HapticVibration>().verified()?;
        Ok(code)
    }

    fn stop_haptic_feedback(
        session: sys::Session,
        haptic_action_info: *const sys::HapticActionInfo,
    ) {
        haptics(session, &haptic_action_info)
    }
}
