//! The interaction profiles that bindings may be suggested for (specification, "Interaction Profile Paths").

use openxr_sys::ActionType;

use crate::extension::Extension;
use crate::path::EYES;

const LEFT: &str = "/user/hand/left";
const RIGHT: &str = "/user/hand/right";
const HANDS: &[&str] = &[LEFT, RIGHT];

/// A device as the specification describes it.
#[derive(Debug, PartialEq)]
pub(crate) struct Profile {
    pub path: &'static str,
    /// What a person calls it.
    pub title: &'static str,
    /// The user paths at which it is found.
    pub users: &'static [&'static str],
    /// Its components at every user path, below that path.
    components: &'static [&'static str],
    /// Those of one hand alone.
    left: &'static [&'static str],
    right: &'static [&'static str],
    /// The extension that defines it.
    pub needs: Option<Extension>,
    /// Whether the headset comes with it; else its bindings are accepted and never active.
    pub is_simulated: bool,
}

/// What a component yields or takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ComponentKind {
    Boolean,
    Float,
    Vector2f,
    Pose,
    Haptic,
}

impl ComponentKind {
    /// Told by a path's last level, as the specification names them.
    fn of(path: &str) -> Self {
        match path.rsplit('/').next() {
            Some("click" | "touch") => Self::Boolean,
            Some("value" | "force" | "x" | "y") => Self::Float,
            Some("pose") => Self::Pose,
            Some(name) if name.starts_with("haptic") => Self::Haptic,
            _ => Self::Vector2f,
        }
    }

    /// Whether an action of that type can be bound to it, converted if need be.
    fn serves(self, action: ActionType) -> bool {
        match action {
            ActionType::BOOLEAN_INPUT | ActionType::FLOAT_INPUT => {
                matches!(self, Self::Boolean | Self::Float)
            }
            ActionType::VECTOR2F_INPUT => self == Self::Vector2f,
            ActionType::POSE_INPUT => self == Self::Pose,
            ActionType::VIBRATION_OUTPUT => self == Self::Haptic,
            _ => false,
        }
    }
}

/// One input or output of a profile at one user path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Component {
    pub profile: &'static Profile,
    pub user: &'static str,
    /// Below the user path: `/input/trigger/value`.
    pub subpath: &'static str,
    pub kind: ComponentKind,
}

impl Component {
    /// The input that it is a component of: `trigger`.
    pub fn input(&self) -> &'static str {
        self.subpath.split('/').nth(2).unwrap_or_default()
    }
}

impl Profile {
    pub fn named(path: &str) -> Option<&'static Self> {
        PROFILES.iter().find(|profile| profile.path == path)
    }

    /// All components at a user path.
    pub fn components(&'static self, user: &'static str) -> impl Iterator<Item = Component> {
        let of_hand = match user {
            LEFT => self.left,
            RIGHT => self.right,
            _ => &[],
        };
        self.components
            .iter()
            .chain(of_hand)
            .map(move |&subpath| Component {
                profile: self,
                user,
                subpath,
                kind: ComponentKind::of(subpath),
            })
    }

    /// The components that a binding may mean: the one of that very path, or those below it.
    pub fn matches(&'static self, binding: &str) -> Vec<Component> {
        let below = |user| {
            binding
                .strip_prefix(user)
                .filter(|subpath| subpath.starts_with('/'))
        };
        let Some((user, subpath)) = self
            .users
            .iter()
            .find_map(|&user| Some((user, below(user)?)))
        else {
            return Vec::new();
        };
        let exact: Vec<_> = self
            .components(user)
            .filter(|it| it.subpath == subpath)
            .collect();
        let is_below = |component: &Component| {
            component
                .subpath
                .strip_prefix(subpath)
                .is_some_and(|rest| rest.starts_with('/'))
        };
        // a path that is a component, such as a thumbstick, also has components below it
        exact
            .into_iter()
            .chain(self.components(user).filter(is_below))
            .collect()
    }

    /// The component that an action of that type gets from a binding: the very one, else the nearest kind.
    pub fn resolve(&'static self, binding: &str, action: ActionType) -> Option<Component> {
        let preferred = match action {
            ActionType::BOOLEAN_INPUT => ComponentKind::Boolean,
            _ => ComponentKind::Float,
        };
        let mut fitting: Vec<_> = self
            .matches(binding)
            .into_iter()
            .filter(|it| it.kind.serves(action))
            .collect();
        // stable: the exact path and the specification's order come first among equals
        fitting.sort_by_key(|component| component.kind != preferred);
        fitting.into_iter().next()
    }
}

/// In the order in which one is chosen where bindings were suggested for several.
pub(crate) static PROFILES: &[Profile] = &[
    Profile {
        path: "/interaction_profiles/valve/index_controller",
        title: "Valve Index Controller",
        users: HANDS,
        components: &[
            "/input/system/click",
            "/input/system/touch",
            "/input/a/click",
            "/input/a/touch",
            "/input/b/click",
            "/input/b/touch",
            "/input/squeeze/value",
            "/input/squeeze/force",
            "/input/trigger/click",
            "/input/trigger/value",
            "/input/trigger/touch",
            "/input/thumbstick",
            "/input/thumbstick/x",
            "/input/thumbstick/y",
            "/input/thumbstick/click",
            "/input/thumbstick/touch",
            "/input/trackpad",
            "/input/trackpad/x",
            "/input/trackpad/y",
            "/input/trackpad/force",
            "/input/trackpad/touch",
            "/input/grip/pose",
            "/input/aim/pose",
            "/output/haptic",
        ],
        left: &[],
        right: &[],
        needs: None,
        is_simulated: true,
    },
    Profile {
        path: "/interaction_profiles/oculus/touch_controller",
        title: "Oculus Touch Controller",
        users: HANDS,
        components: &[
            "/input/squeeze/value",
            "/input/trigger/value",
            "/input/trigger/touch",
            "/input/thumbstick",
            "/input/thumbstick/x",
            "/input/thumbstick/y",
            "/input/thumbstick/click",
            "/input/thumbstick/touch",
            "/input/thumbrest/touch",
            "/input/grip/pose",
            "/input/aim/pose",
            "/output/haptic",
        ],
        left: &[
            "/input/x/click",
            "/input/x/touch",
            "/input/y/click",
            "/input/y/touch",
            "/input/menu/click",
        ],
        right: &[
            "/input/a/click",
            "/input/a/touch",
            "/input/b/click",
            "/input/b/touch",
            "/input/system/click",
        ],
        needs: None,
        is_simulated: true,
    },
    Profile {
        path: "/interaction_profiles/htc/vive_controller",
        title: "HTC Vive Controller",
        users: HANDS,
        components: &[
            "/input/system/click",
            "/input/squeeze/click",
            "/input/menu/click",
            "/input/trigger/click",
            "/input/trigger/value",
            "/input/trackpad",
            "/input/trackpad/x",
            "/input/trackpad/y",
            "/input/trackpad/click",
            "/input/trackpad/touch",
            "/input/grip/pose",
            "/input/aim/pose",
            "/output/haptic",
        ],
        left: &[],
        right: &[],
        needs: None,
        is_simulated: true,
    },
    Profile {
        path: "/interaction_profiles/microsoft/motion_controller",
        title: "Microsoft Mixed Reality Motion Controller",
        users: HANDS,
        components: &[
            "/input/menu/click",
            "/input/squeeze/click",
            "/input/trigger/value",
            "/input/thumbstick",
            "/input/thumbstick/x",
            "/input/thumbstick/y",
            "/input/thumbstick/click",
            "/input/trackpad",
            "/input/trackpad/x",
            "/input/trackpad/y",
            "/input/trackpad/click",
            "/input/trackpad/touch",
            "/input/grip/pose",
            "/input/aim/pose",
            "/output/haptic",
        ],
        left: &[],
        right: &[],
        needs: None,
        is_simulated: true,
    },
    Profile {
        path: "/interaction_profiles/khr/simple_controller",
        title: "Khronos Simple Controller",
        users: HANDS,
        components: &[
            "/input/select/click",
            "/input/menu/click",
            "/input/grip/pose",
            "/input/aim/pose",
            "/output/haptic",
        ],
        left: &[],
        right: &[],
        needs: None,
        is_simulated: true,
    },
    Profile {
        path: "/interaction_profiles/ext/eye_gaze_interaction",
        title: "Eye Tracker",
        users: &[EYES],
        components: &["/input/gaze_ext/pose"],
        left: &[],
        right: &[],
        needs: Some(Extension::EyeGazeInteraction),
        is_simulated: true,
    },
];
