//! Spaces, and where they are relative to each other.

use glam::Vec3;
use openxr_sys as sys;
use openxr_sys::ReferenceSpaceType;

use crate::handle::Object;
use crate::pose::Pose;
use crate::script::{Hand, Script, TRACKED};

/// Height of LOCAL's origin, the eyes at rest, above the floor, in metres.
const EYE_HEIGHT_M: f32 = 1.6;

/// Half the time over which velocities are measured.
const VELOCITY_HALF_SPAN_NS: i64 = 1_000_000;

/// `XrSpaceVelocityFlags`: linear and angular, both valid.
const VELOCITY_VALID: u64 = 0b11;

/// A space of a session.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Space {
    pub session: sys::Session,
    pub origin: Origin,
    /// The space's own pose in its origin.
    pub origin_from_space: Pose,
}

impl Object for Space {
    type Handle = sys::Space;
    const KIND: u8 = 3;
}

/// What a space is fixed to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Origin {
    Reference(ReferenceSpaceType),
    /// An action's pose; where it is depends on what is bound at the time.
    Action {
        action: sys::Action,
        subaction: sys::Path,
    },
}

/// A device whose pose the script knows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Tracker {
    Gaze,
    Hand(Hand),
}

/// A space relative to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Location {
    pub base_from_space: Pose,
    /// `XrSpaceLocationFlags`.
    pub flags: u64,
    /// The script's time of the gaze sample that this stems from.
    pub gaze_time_ns: Option<i64>,
    /// `XrSpaceVelocityFlags`.
    pub velocity_flags: u64,
    pub linear_velocity: Vec3,
    pub angular_velocity: Vec3,
}

/// A space with its origin resolved: none where no device stands behind an action.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Resolved {
    pub anchor: Option<Anchor>,
    pub origin_from_space: Pose,
}

impl Resolved {
    /// A reference space's own origin.
    pub const fn of(ty: ReferenceSpaceType) -> Self {
        Self {
            anchor: Some(Anchor::Reference(ty)),
            origin_from_space: Pose::IDENTITY,
        }
    }
}

/// What an origin turns out to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Anchor {
    Reference(ReferenceSpaceType),
    Tracker(Tracker),
}

/// The reference spaces of the headset; LOCAL_FLOOR is OpenXR 1.1's.
pub(crate) fn reference_spaces(is_1_1: bool) -> &'static [ReferenceSpaceType] {
    const ALL: &[ReferenceSpaceType] = &[
        ReferenceSpaceType::VIEW,
        ReferenceSpaceType::LOCAL,
        ReferenceSpaceType::STAGE,
        ReferenceSpaceType::LOCAL_FLOOR,
    ];
    if is_1_1 { ALL } else { &ALL[..3] }
}

/// Locates `space` in `base` at a time of the script, with its velocity where `wants_velocity`.
pub(crate) fn locate(
    script: &Script,
    space: Resolved,
    base: Resolved,
    time_ns: i64,
    wants_velocity: bool,
) -> Location {
    let (base_from_space, flags) = relate(script, space, base, time_ns);
    let is_gaze = |space: Resolved| space.anchor == Some(Anchor::Tracker(Tracker::Gaze));
    let gaze = script
        .gaze(time_ns)
        .filter(|_| is_gaze(space) || is_gaze(base));
    let mut location = Location {
        base_from_space,
        flags,
        gaze_time_ns: gaze.map(|sample| sample.time_ns),
        velocity_flags: 0,
        linear_velocity: Vec3::ZERO,
        angular_velocity: Vec3::ZERO,
    };
    // gaze comes in samples that are held: between them there is no velocity to be told
    if wants_velocity && flags != 0 && !is_gaze(space) && !is_gaze(base) {
        let (before, _) = relate(script, space, base, time_ns - VELOCITY_HALF_SPAN_NS);
        let (after, _) = relate(script, space, base, time_ns + VELOCITY_HALF_SPAN_NS);
        let span_s = 2.0 * VELOCITY_HALF_SPAN_NS as f32 * 1e-9;
        let rotation = after.orientation * before.orientation.inverse();
        location.velocity_flags = VELOCITY_VALID;
        location.linear_velocity = (after.position - before.position) / span_s;
        location.angular_velocity = rotation.to_scaled_axis() / span_s;
    }
    location
}

/// `base_from_space` and what of it is known.
fn relate(script: &Script, space: Resolved, base: Resolved, time_ns: i64) -> (Pose, u64) {
    let (Some(space_anchor), Some(base_anchor)) = (space.anchor, base.anchor) else {
        return (Pose::IDENTITY, 0);
    };
    if space_anchor == base_anchor {
        return (
            base.origin_from_space
                .inverse()
                .then(space.origin_from_space),
            TRACKED,
        );
    }
    let from = place(script, space_anchor, time_ns);
    let to = place(script, base_anchor, time_ns);
    // the head's pose matters only between what moves with it and what doesn't
    let (base_from_space, head_flags) = match (from.moves_with_head, to.moves_with_head) {
        (true, true) | (false, false) => (to.pose.inverse().then(from.pose), TRACKED),
        (true, false) => {
            let head = script.head(time_ns);
            (
                to.pose.inverse().then(head.local_from_head).then(from.pose),
                head.flags,
            )
        }
        (false, true) => {
            let head = script.head(time_ns);
            (
                to.pose
                    .inverse()
                    .then(head.local_from_head.inverse())
                    .then(from.pose),
                head.flags,
            )
        }
    };
    let pose = base
        .origin_from_space
        .inverse()
        .then(base_from_space)
        .then(space.origin_from_space);
    match from.flags & to.flags & head_flags {
        // nothing is known: nothing is told
        0 => (Pose::IDENTITY, 0),
        flags => (pose, flags),
    }
}

/// Where an anchor is: in the head where it moves with it, else in LOCAL.
struct Placement {
    moves_with_head: bool,
    pose: Pose,
    flags: u64,
}

fn place(script: &Script, anchor: Anchor, time_ns: i64) -> Placement {
    let fixed = |position| Placement {
        moves_with_head: false,
        pose: Pose::from_position(position),
        flags: TRACKED,
    };
    match anchor {
        Anchor::Reference(ReferenceSpaceType::VIEW) => Placement {
            moves_with_head: true,
            pose: Pose::IDENTITY,
            flags: TRACKED,
        },
        Anchor::Reference(ReferenceSpaceType::STAGE | ReferenceSpaceType::LOCAL_FLOOR) => {
            fixed(Vec3::new(0.0, -EYE_HEIGHT_M, 0.0))
        }
        Anchor::Reference(_) => fixed(Vec3::ZERO),
        Anchor::Tracker(Tracker::Hand(hand)) => fixed(resting_place(hand)),
        Anchor::Tracker(Tracker::Gaze) => {
            let pose = script
                .gaze(time_ns)
                .and_then(|sample| sample.view_from_gaze);
            Placement {
                moves_with_head: true,
                pose: pose.unwrap_or(Pose::IDENTITY),
                flags: if pose.is_some() { TRACKED } else { 0 },
            }
        }
    }
}

/// Where a hand's controller lies in LOCAL space: recordings hold no hands.
fn resting_place(hand: Hand) -> Vec3 {
    match hand {
        Hand::Left => Vec3::new(-0.2, -0.3, -0.4),
        Hand::Right => Vec3::new(0.2, -0.3, -0.4),
    }
}
