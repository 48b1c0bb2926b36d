//! Actions are defined, bound, attached and read by the rules.

use openxr as xr;
use openxr::sys::{self, Result as Code};
use xr_sim::configure;

use crate::common::codes::*;
use crate::common::headless::Headless;
use crate::common::*;

const SIMPLE: &str = "/interaction_profiles/khr/simple_controller";
const SELECT: &str = "/user/hand/left/input/select/click";

#[test]
fn wrong_definitions_get_their_codes() {
    let _turn = turn();
    configure(config()).unwrap();
    let app = Headless::new(V1_0);
    let (fp, instance) = (app.instance.fp(), app.instance.as_raw());
    let set = |name: &str, localized: &str| {
        let mut info = zeroed!(ActionSetCreateInfo);
        info.action_set_name = text(name);
        info.localized_action_set_name = text(localized);
        // SAFETY: structures of their types
        unsafe { (fp.create_action_set)(instance, &info, &mut Default::default()) }
    };
    let other = app.instance.create_action_set("other", "Other", 0).unwrap();
    let action_of = |set: &xr::ActionSet, name: &str, localized: &str, ty, paths: &[xr::Path]| {
        let mut info = zeroed!(ActionCreateInfo);
        info.action_name = text(name);
        info.localized_action_name = text(localized);
        info.action_type = ty;
        info.count_subaction_paths = paths.len() as u32;
        info.subaction_paths = paths.as_ptr();
        // SAFETY: structures of their types
        unsafe { (fp.create_action)(set.as_raw(), &info, &mut Default::default()) }
    };
    let action = |name, localized, ty, paths: &[_]| action_of(&other, name, localized, ty, paths);
    let path = |text: &str| app.instance.string_to_path(text).unwrap();
    let (left, foot, no_path) = (
        path("/user/hand/left"),
        path("/user/foot/left"),
        xr::Path::from_raw(9999),
    );
    let boolean = xr::ActionType::BOOLEAN_INPUT;
    let no_type = xr::ActionType::from_raw(9);
    let unsupported = Code::ERROR_PATH_UNSUPPORTED;
    let attached = Code::ERROR_ACTIONSETS_ALREADY_ATTACHED;
    codes! {
        "a set": set("another", "Another") => SUCCESS;
        "its name": set("other", "Else") => Code::ERROR_NAME_DUPLICATED;
        "its localized name": set("else", "Other") => Code::ERROR_LOCALIZED_NAME_DUPLICATED;
        "no name": set("", "Nameless") => Code::ERROR_NAME_INVALID;
        "no localized name": set("nameless", "") => Code::ERROR_LOCALIZED_NAME_INVALID;
        "a malformed name": set("Upper", "Upper") => Code::ERROR_PATH_FORMAT_INVALID;
        "an action": action("a", "A", boolean, &[left]) => SUCCESS;
        "its name": action("a", "B", boolean, &[]) => Code::ERROR_NAME_DUPLICATED;
        "no type": action("b", "B", no_type, &[]) => INVALID;
        "a hand twice": action("c", "C", boolean, &[left, left]) => unsupported;
        "a foot": action("d", "D", boolean, &[foot]) => unsupported;
        "no path": action("e", "E", boolean, &[no_path]) => Code::ERROR_PATH_INVALID;
        "too late": action_of(&app.set, "f", "F", boolean, &[]) => attached;
    }
}

#[test]
fn wrong_bindings_and_readings_get_their_codes() {
    let _turn = turn();
    configure(config()).unwrap();
    let app = Headless::new(V1_0);
    let (fp, instance, session) = (
        app.instance.fp(),
        app.instance.as_raw(),
        app.session.as_raw(),
    );
    let path = |text: &str| app.instance.string_to_path(text).unwrap();
    let suggest = |profile: &str, binding: &str, action: sys::Action| {
        let bindings = [sys::ActionSuggestedBinding {
            action,
            binding: path(binding),
        }];
        let mut info = zeroed!(InteractionProfileSuggestedBinding);
        info.interaction_profile = path(profile);
        info.count_suggested_bindings = 1;
        info.suggested_bindings = bindings.as_ptr();
        // SAFETY: structures of their types
        unsafe { (fp.suggest_interaction_profile_bindings)(instance, &info) }
    };
    let free_set = app.instance.create_action_set("free", "Free", 0).unwrap();
    let free_action = free_set.create_action::<bool>("free", "Free", &[]).unwrap();
    let free = free_action.as_raw();
    let state = |action, subaction_path| {
        let info = zeroed!(ActionStateGetInfo);
        let info = sys::ActionStateGetInfo {
            action,
            subaction_path,
            ..info
        };
        // SAFETY: structures of their types
        unsafe { (fp.get_action_state_boolean)(session, &info, &mut zeroed!(ActionStateBoolean)) }
    };
    let sync = |set: &xr::ActionSet, subaction_path| {
        let active = [sys::ActiveActionSet {
            action_set: set.as_raw(),
            subaction_path,
        }];
        let mut info = zeroed!(ActionsSyncInfo);
        (info.count_active_action_sets, info.active_action_sets) = (1, active.as_ptr());
        // SAFETY: structures of their types
        unsafe { (fp.sync_actions)(session, &info) }
    };
    let (select, trigger) = (app.select.as_raw(), app.trigger.as_raw());
    let (left, head, null) = (path("/user/hand/left"), path("/user/head"), xr::Path::NULL);
    let (unsupported, not_attached) = (
        Code::ERROR_PATH_UNSUPPORTED,
        Code::ERROR_ACTIONSET_NOT_ATTACHED,
    );
    let attached = Code::ERROR_ACTIONSETS_ALREADY_ATTACHED;
    codes! {
        "a binding": suggest(SIMPLE, SELECT, free) => SUCCESS;
        "no profile": suggest("/interaction_profiles/a/b", SELECT, free) => unsupported;
        "no component": suggest(SIMPLE, "/user/hand/left/input/trigger", free) => unsupported;
        "bound too late": suggest(SIMPLE, SELECT, select) => attached;
        "attached twice":
            app.session.attach_action_sets(&[&free_set]).err().unwrap_or(SUCCESS) => attached;
        "sync": sync(&app.set, null) => SUCCESS;
        "sync one hand": sync(&app.set, left) => SUCCESS;
        "sync what no action has": sync(&app.set, head) => unsupported;
        "sync a set that isn't attached": sync(&free_set, null) => not_attached;
        "state": state(select, left) => SUCCESS;
        "state of what the action hasn't": state(select, head) => unsupported;
        "state of no path": state(select, xr::Path::from_raw(9999)) => Code::ERROR_PATH_INVALID;
        "state of another type": state(trigger, left) => Code::ERROR_ACTION_TYPE_MISMATCH;
        "state of an action that isn't attached": state(free, null) => not_attached;
    }
    app.session.request_exit().unwrap();
    assert_eq!(sync(&app.set, null), Code::SESSION_NOT_FOCUSED);
    assert!(!app.select.state(&app.session, null).unwrap().is_active);
}

#[test]
fn a_set_of_higher_priority_takes_the_button() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    recording(folder.path(), 3);
    let events = format!(
        "time_ns,event,value\n{},button,select_left down\n",
        frame_ns(0)
    );
    std::fs::write(folder.path().join("events.csv"), events).unwrap();
    configure(xr_sim::Config {
        session: Some(folder.path().into()),
        ..config()
    })
    .unwrap();
    let (instance, system) = instance(&entry(), V1_0);
    // SAFETY: a session without graphics needs no handles
    let (session, ..) = unsafe {
        instance.create_session::<xr::Headless>(system, &xr::headless::SessionCreateInfo {})
    }
    .unwrap();
    let sets = [("low", "Low", 1), ("high", "High", 2)].map(|(name, localized, priority)| {
        instance
            .create_action_set(name, localized, priority)
            .unwrap()
    });
    let actions = [0, 1].map(|set: usize| sets[set].create_action::<bool>("a", "A", &[]).unwrap());
    let path = |text: &str| instance.string_to_path(text).unwrap();
    let bindings = [0, 1].map(|action: usize| xr::Binding::new(&actions[action], path(SELECT)));
    instance
        .suggest_interaction_profile_bindings(path(SIMPLE), &bindings)
        .unwrap();
    session.attach_action_sets(&[&sets[0], &sets[1]]).unwrap();
    session
        .begin(xr::ViewConfigurationType::PRIMARY_STEREO)
        .unwrap();
    let states = || {
        [0, 1].map(|action: usize| {
            let state = actions[action].state(&session, xr::Path::NULL).unwrap();
            (state.is_active, state.current_state)
        })
    };
    session.sync_actions(&[(&sets[0]).into()]).unwrap();
    assert_eq!(states(), [(true, true), (false, false)]);
    session
        .sync_actions(&[(&sets[0]).into(), (&sets[1]).into()])
        .unwrap();
    assert_eq!(states(), [(false, false), (true, true)]);
}
