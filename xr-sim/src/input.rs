//! What the attached actions of a session are bound to, and their states as of the last `xrSyncActions`.

use std::collections::HashMap;

use glam::Vec2;
use openxr_sys as sys;
use openxr_sys::{ActionType, Handle};

use crate::XrResult;
use crate::action::Action;
use crate::path::{EYES, PathTable};
use crate::profile::{Component, ComponentKind, PROFILES, Profile};
use crate::script::{Hand, Script};
use crate::space::Tracker;

/// From here on a value counts as pressed.
const PRESSED: f32 = 0.5;

/// An action bound to a path by the application's suggestion.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Suggestion {
    pub action: sys::Action,
    pub binding: sys::Path,
}

/// An action's state, of one user path or of all together. The default is what an inactive action has.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct ActionState {
    pub is_active: bool,
    /// x alone for a number; 0 or 1 there for a boolean.
    pub value: Vec2,
    pub changed: bool,
    pub last_change_ns: i64,
}

/// A component that feeds an action.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Source {
    pub component: Component,
    /// The whole path of the component.
    pub path: sys::Path,
    /// The user path that it begins with.
    pub user: sys::Path,
}

#[derive(Debug)]
struct AttachedAction {
    set: sys::ActionSet,
    kind: ActionType,
    sources: Vec<Source>,
    /// By subaction; `Path::NULL` is all together.
    states: HashMap<u64, ActionState>,
}

/// The action sets attached to a session.
#[derive(Debug)]
pub(crate) struct Input {
    /// By handle, with their priorities.
    sets: HashMap<u64, u32>,
    /// By handle.
    actions: HashMap<u64, AttachedAction>,
    /// The profile in use at each user path that bindings were suggested for.
    profiles: Vec<(&'static str, &'static Profile)>,
    is_announced: bool,
}

/// An action set to be synchronised, of all user paths or of one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ActiveSet {
    pub set: sys::ActionSet,
    pub subaction: sys::Path,
}

impl Input {
    /// Attaches action sets with their actions and binds these as suggested.
    pub fn attach(
        sets: HashMap<u64, u32>,
        actions: &[(sys::Action, &Action)],
        suggestions: &HashMap<&'static str, Vec<Suggestion>>,
        has_eye_gaze: bool,
        paths: &mut PathTable,
    ) -> XrResult<Self> {
        let mut profiles: Vec<(&'static str, &'static Profile)> = Vec::new();
        for profile in PROFILES
            .iter()
            .filter(|it| it.is_simulated && suggestions.contains_key(it.path))
        {
            for &user in profile.users {
                let is_there = user != EYES || has_eye_gaze;
                if is_there && profiles.iter().all(|(taken, _)| *taken != user) {
                    profiles.push((user, profile));
                }
            }
        }
        let mut attached = HashMap::new();
        for (handle, action) in actions {
            let mut sources = Vec::new();
            for (user, profile) in &profiles {
                for suggestion in suggestions[profile.path]
                    .iter()
                    .filter(|it| it.action == *handle)
                {
                    let binding = paths.string(suggestion.binding)?.to_owned();
                    let component = profile.resolve(&binding, action.kind);
                    let Some(component) = component.filter(|it| it.user == *user) else {
                        continue;
                    };
                    let path = paths.atom(&format!("{user}{}", component.subpath))?;
                    sources.push(Source {
                        component,
                        path,
                        user: paths.atom(user)?,
                    });
                }
            }
            sources.dedup_by_key(|source| source.path);
            let states = action
                .subactions
                .iter()
                .map(|path| path.into_raw())
                .chain([0]);
            attached.insert(
                handle.into_raw(),
                AttachedAction {
                    set: action.set,
                    kind: action.kind,
                    sources,
                    states: states.map(|path| (path, ActionState::default())).collect(),
                },
            );
        }
        Ok(Self {
            sets,
            actions: attached,
            profiles,
            is_announced: false,
        })
    }

    /// Whether the set is attached here.
    pub fn verify_set(&self, set: sys::ActionSet) -> XrResult<()> {
        match self.sets.contains_key(&set.into_raw()) {
            true => Ok(()),
            false => Err(sys::Result::ERROR_ACTIONSET_NOT_ATTACHED),
        }
    }

    /// The profile in use at a user path; none before the first synchronisation.
    pub fn profile(&self, user: &str) -> Option<&'static Profile> {
        let (_, profile) = self.profiles.iter().find(|(taken, _)| *taken == user)?;
        self.is_announced.then_some(*profile)
    }

    /// Every action of an unfocused session is inactive.
    pub fn deactivate(&mut self) {
        for state in self
            .actions
            .values_mut()
            .flat_map(|action| action.states.values_mut())
        {
            *state = ActionState::default();
        }
    }

    /// Takes the states of the active sets from the script; true where the profiles in use are news.
    pub fn sync(
        &mut self,
        active: &[ActiveSet],
        script: &Script,
        script_time_ns: i64,
        now: sys::Time,
    ) -> bool {
        let claims = self.claims(active);
        for action in self.actions.values_mut() {
            let priority = self.sets.get(&action.set.into_raw()).copied().unwrap_or(0);
            // a source belongs to the sets of the highest priority that use it
            let is_live = |source: &&Source| {
                active
                    .iter()
                    .any(|it| it.set == action.set && covers(it.subaction, source.user))
                    && claims.get(&source.path.into_raw()) == Some(&priority)
            };
            for (&subaction, state) in &mut action.states {
                let subaction = sys::Path::from_raw(subaction);
                let mut live = action
                    .sources
                    .iter()
                    .filter(is_live)
                    .filter(|it| covers(subaction, it.user))
                    .peekable();
                if live.peek().is_none() {
                    *state = ActionState::default();
                    continue;
                }
                let value = live
                    .map(|source| value(source.component, action.kind, script, script_time_ns))
                    .max_by(|a, b| a.length().total_cmp(&b.length()))
                    .unwrap_or_default();
                let changed = value != state.value;
                *state = ActionState {
                    is_active: true,
                    value,
                    changed,
                    last_change_ns: if changed {
                        now.as_nanos()
                    } else {
                        state.last_change_ns
                    },
                };
            }
        }
        !std::mem::replace(&mut self.is_announced, true) && !self.profiles.is_empty()
    }

    /// The highest priority with which each source is used by the active sets.
    fn claims(&self, active: &[ActiveSet]) -> HashMap<u64, u32> {
        let mut claims = HashMap::new();
        for action in self.actions.values() {
            let priority = self.sets.get(&action.set.into_raw()).copied().unwrap_or(0);
            for source in &action.sources {
                if active
                    .iter()
                    .any(|it| it.set == action.set && covers(it.subaction, source.user))
                {
                    let claim = claims.entry(source.path.into_raw()).or_insert(priority);
                    *claim = priority.max(*claim);
                }
            }
        }
        claims
    }

    /// An action's state; `PATH_UNSUPPORTED` for a user path that it isn't told apart by.
    pub fn state(&self, action: sys::Action, subaction: sys::Path) -> XrResult<ActionState> {
        let action = self.action(action)?;
        action
            .states
            .get(&subaction.into_raw())
            .copied()
            .ok_or(sys::Result::ERROR_PATH_UNSUPPORTED)
    }

    /// All that an action is bound to.
    pub fn sources(&self, action: sys::Action) -> XrResult<&[Source]> {
        self.action(action).map(|action| action.sources.as_slice())
    }

    /// The device behind a pose action, while it is active.
    pub fn tracker(&self, action: sys::Action, subaction: sys::Path) -> Option<Tracker> {
        let action = self.actions.get(&action.into_raw())?;
        action
            .states
            .get(&subaction.into_raw())
            .filter(|state| state.is_active)?;
        let source = action
            .sources
            .iter()
            .find(|source| covers(subaction, source.user))?;
        match source.component.user {
            EYES => Some(Tracker::Gaze),
            user => hand(user).map(Tracker::Hand),
        }
    }

    /// What a person calls a bound source: the user's part, the device, the component.
    pub fn source_names(&self, path: &str) -> Option<[String; 3]> {
        let sources = self.actions.values().flat_map(|action| &action.sources);
        let component = sources
            .map(|source| source.component)
            .find(|it| path.strip_prefix(it.user) == Some(it.subpath))?;
        Some([
            title(component.user),
            component.profile.title.into(),
            title(component.input()),
        ])
    }

    fn action(&self, action: sys::Action) -> XrResult<&AttachedAction> {
        self.actions
            .get(&action.into_raw())
            .ok_or(sys::Result::ERROR_ACTIONSET_NOT_ATTACHED)
    }
}

/// Whether a user path is the one asked for; null asks for all.
fn covers(asked: sys::Path, user: sys::Path) -> bool {
    asked == sys::Path::NULL || asked == user
}

fn hand(user: &str) -> Option<Hand> {
    match user {
        "/user/hand/left" => Some(Hand::Left),
        "/user/hand/right" => Some(Hand::Right),
        _ => None,
    }
}

/// `/user/hand/left` and `gaze_ext` as a person reads them: "Left Hand", "Gaze Ext".
fn title(name: &str) -> String {
    let words: Vec<_> = name
        .trim_start_matches("/user/")
        .rsplit('/')
        .flat_map(|level| level.split('_'))
        .map(|word| word[..1].to_uppercase() + &word[1..])
        .collect();
    words.join(" ")
}

/// What a component yields for an action of that type.
fn value(component: Component, kind: ActionType, script: &Script, script_time_ns: i64) -> Vec2 {
    let is_button = matches!(
        component.kind,
        ComponentKind::Boolean | ComponentKind::Float
    );
    let is_axis = component.subpath.ends_with("/x") || component.subpath.ends_with("/y");
    let (Some(hand), true, false) = (hand(component.user), is_button, is_axis) else {
        return Vec2::ZERO;
    };
    let input = component.input();
    let mut pressed = script.pressed(hand, input, script_time_ns);
    // controllers without a select button select by the trigger
    if input == "trigger"
        && component
            .profile
            .components(component.user)
            .all(|it| it.input() != "select")
    {
        pressed = pressed.max(script.pressed(hand, "select", script_time_ns));
    }
    let is_boolean = kind == ActionType::BOOLEAN_INPUT || component.kind == ComponentKind::Boolean;
    match is_boolean {
        true => Vec2::new(f32::from(u8::from(pressed >= PRESSED)), 0.0),
        false => Vec2::new(pressed, 0.0),
    }
}
