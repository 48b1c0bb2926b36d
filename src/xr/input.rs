//! What the person presses, on any controller, and the action set that buttons and gaze share.

use std::fmt;

use super::eye_gaze::EyeGaze;
use super::views::Viewer;
use super::{GazeReading, XrError, failed, interop};

/// What a button is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Button {
    /// The trigger: an answer.
    Select,
    /// The menu button or its neighbour: the other answer.
    Menu,
    /// The stick or the trackpad: take the present view as straight ahead.
    Recentre,
}

impl Button {
    const ALL: [Button; 3] = [Button::Select, Button::Menu, Button::Recentre];

    fn name(self) -> &'static str {
        match self {
            Button::Select => "select",
            Button::Menu => "menu",
            Button::Recentre => "recentre",
        }
    }
}

/// Whose button.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hand {
    /// Left.
    Left,
    /// Right.
    Right,
}

impl Hand {
    const ALL: [Hand; 2] = [Hand::Left, Hand::Right];

    fn name(self) -> &'static str {
        match self {
            Hand::Left => "left",
            Hand::Right => "right",
        }
    }
}

/// A button went down or up. Printed as in a session's `events.csv`: `select_right down`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ButtonChange {
    /// Which button.
    pub button: Button,
    /// On which hand.
    pub hand: Hand,
    /// Down, or up.
    pub down: bool,
    /// When, on the clock of the display times, nanoseconds.
    pub time_ns: i64,
}

impl fmt::Display for ButtonChange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let direction = if self.down { "down" } else { "up" };
        write!(f, "{}_{} {direction}", self.button.name(), self.hand.name())
    }
}

/// A controller and where our buttons are on it; each input for the left and for the right hand.
struct Profile {
    path: &'static str,
    select: [&'static str; 2],
    menu: [&'static str; 2],
    /// The simple controller has but two buttons.
    recentre: Option<[&'static str; 2]>,
}

/// OpenXR 1.0, section 6.4, interaction profile paths. The runtime maps other controllers onto one of these.
const PROFILES: [Profile; 5] = [
    Profile {
        path: "/interaction_profiles/khr/simple_controller",
        select: ["select/click"; 2],
        menu: ["menu/click"; 2],
        recentre: None,
    },
    Profile {
        path: "/interaction_profiles/htc/vive_controller",
        select: ["trigger/click"; 2],
        menu: ["menu/click"; 2],
        recentre: Some(["trackpad/click"; 2]),
    },
    Profile {
        path: "/interaction_profiles/valve/index_controller",
        select: ["trigger/click"; 2],
        menu: ["b/click"; 2],
        recentre: Some(["thumbstick/click"; 2]),
    },
    Profile {
        path: "/interaction_profiles/oculus/touch_controller",
        select: ["trigger/value"; 2],
        menu: ["y/click", "b/click"],
        recentre: Some(["thumbstick/click"; 2]),
    },
    Profile {
        path: "/interaction_profiles/microsoft/motion_controller",
        select: ["trigger/value"; 2],
        menu: ["menu/click"; 2],
        recentre: Some(["thumbstick/click"; 2]),
    },
];

impl Profile {
    fn inputs(&self, button: Button) -> Option<[&'static str; 2]> {
        match button {
            Button::Select => Some(self.select),
            Button::Menu => Some(self.menu),
            Button::Recentre => self.recentre,
        }
    }
}

/// What was read for one frame.
pub(super) struct InputReading {
    pub gaze: GazeReading,
    pub buttons: Vec<ButtonChange>,
}

/// The attached action set.
pub(super) struct Input {
    gaze: Option<EyeGaze>,
    buttons: Vec<(Button, openxr::Action<bool>)>,
    hands: [(Hand, openxr::Path); 2],
    actions: openxr::ActionSet,
}

impl Input {
    /// Makes the actions, suggests all bindings and attaches the set to the session. `eye_gaze`: whether the extension is enabled;
    /// its binding is accepted even by a runtime whose headset has no tracker.
    pub fn attach(
        instance: &openxr::Instance,
        session: &openxr::Session<openxr::Vulkan>,
        eye_gaze: bool,
    ) -> Result<Self, XrError> {
        let path = |path: &str| {
            instance
                .string_to_path(path)
                .map_err(failed("xrStringToPath"))
        };
        let hands = [
            (Hand::Left, path(openxr::USER_HAND_LEFT)?),
            (Hand::Right, path(openxr::USER_HAND_RIGHT)?),
        ];
        let actions = instance
            .create_action_set("macula", "macula", 0)
            .map_err(failed("xrCreateActionSet"))?;
        let buttons = create_buttons(&actions, &hands.map(|(_, path)| path))?;
        let gaze_action = eye_gaze
            .then(|| actions.create_action::<openxr::Posef>("eye_gaze", "Eye gaze", &[]))
            .transpose()
            .map_err(failed("xrCreateAction"))?;

        for profile in &PROFILES {
            let mut bindings = Vec::new();
            for (button, action) in &buttons {
                for (hand, input) in Hand::ALL
                    .iter()
                    .zip(profile.inputs(*button).into_iter().flatten())
                {
                    let full = format!("/user/hand/{}/input/{input}", hand.name());
                    bindings.push(openxr::Binding::new(action, path(&full)?));
                }
            }
            suggest(instance, profile.path, path(profile.path)?, &bindings)?;
        }
        if let Some(action) = &gaze_action {
            let binding = openxr::Binding::new(action, path(EyeGaze::BINDING)?);
            suggest(
                instance,
                EyeGaze::PROFILE,
                path(EyeGaze::PROFILE)?,
                &[binding],
            )?;
        }

        session
            .attach_action_sets(&[&actions])
            .map_err(failed("xrAttachSessionActionSets"))?;
        let gaze = gaze_action
            .map(|action| EyeGaze::new(session, action))
            .transpose()?;
        Ok(Self {
            gaze,
            buttons,
            hands,
            actions,
        })
    }

    /// Reads gaze and buttons for the frame displayed at `time`.
    pub fn read(
        &mut self,
        session: &openxr::Session<openxr::Vulkan>,
        viewer: &Viewer,
        time: openxr::Time,
    ) -> Result<InputReading, XrError> {
        let focused = interop::sync_actions(session, &self.actions)?;
        let gaze = match &mut self.gaze {
            Some(gaze) => gaze.read(session, viewer, time, focused)?,
            None => GazeReading::INACTIVE,
        };
        let mut changes = Vec::new();
        for (button, action) in &self.buttons {
            for (hand, path) in self.hands {
                let state = action
                    .state(session, path)
                    .map_err(failed("xrGetActionStateBoolean"))?;
                if state.is_active && state.changed_since_last_sync {
                    changes.push(ButtonChange {
                        button: *button,
                        hand,
                        down: state.current_state,
                        time_ns: state.last_change_time.as_nanos(),
                    });
                }
            }
        }
        Ok(InputReading {
            gaze,
            buttons: changes,
        })
    }
}

fn create_buttons(
    actions: &openxr::ActionSet,
    hands: &[openxr::Path],
) -> Result<Vec<(Button, openxr::Action<bool>)>, XrError> {
    Button::ALL
        .into_iter()
        .map(|button| {
            let action = actions.create_action::<bool>(button.name(), button.name(), hands);
            Ok((button, action.map_err(failed("xrCreateAction"))?))
        })
        .collect()
}

/// Suggests a profile's bindings; a runtime that does not know the profile goes without it.
fn suggest(
    instance: &openxr::Instance,
    name: &str,
    profile: openxr::Path,
    bindings: &[openxr::Binding<'_>],
) -> Result<(), XrError> {
    match instance.suggest_interaction_profile_bindings(profile, bindings) {
        Err(openxr::sys::Result::ERROR_PATH_UNSUPPORTED) => {
            tracing::debug!("the OpenXR runtime does not know the profile {name}");
            Ok(())
        }
        result => result.map_err(failed("xrSuggestInteractionProfileBindings")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_button_change_prints_as_in_a_session_folder() {
        let change = ButtonChange {
            button: Button::Select,
            hand: Hand::Right,
            down: true,
            time_ns: 5,
        };
        assert_eq!(change.to_string(), "select_right down");
        assert_eq!(
            ButtonChange {
                down: false,
                ..change
            }
            .to_string(),
            "select_right up"
        );
    }
}
