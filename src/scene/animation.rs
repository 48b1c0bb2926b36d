//! Motion: node transforms that change with time, and where everything is at one time.

use std::collections::HashMap;

use glam::{Affine3A, DAffine3, DQuat, DVec3};

use super::load::MAX_COORDINATE_M;
use super::node::{Local, Trs};
use super::track::Track;
use super::{Aabb, Camera, PunctualLight, Scene};

/// How nodes move. Time is in seconds and loops over the duration of the longest animation.
#[derive(Clone, Debug, Default)]
pub struct Animation {
    /// Time of the last key of all channels.
    pub(super) duration_s: f64,
    /// The nodes that move, parents before children.
    pub(super) moving: Vec<MovingNode>,
    /// Position in `moving` of a glTF node.
    pub(super) moving_of_node: HashMap<usize, usize>,
}

/// A node that moves by its own channels, or because one of its ancestors does.
#[derive(Clone, Debug)]
pub(super) struct MovingNode {
    pub parent: Parent,
    pub local: Local,
    pub channels: Channels,
}

/// What a moving node hangs on.
#[derive(Clone, Copy, Debug)]
pub(super) enum Parent {
    /// A place in scene space that never moves.
    Fixed(DAffine3),
    /// A position in [`Animation::moving`].
    Moving(usize),
}

/// The animated parts of one node's transform.
#[derive(Clone, Debug, Default)]
pub(super) struct Channels {
    pub translation: Option<Track<DVec3>>,
    pub rotation: Option<Track<DQuat>>,
    pub scale: Option<Track<DVec3>>,
}

impl Channels {
    pub fn is_empty(&self) -> bool {
        self.translation.is_none() && self.rotation.is_none() && self.scale.is_none()
    }

    /// Where the node is within its parent; `rest` fills the parts that do not move.
    fn place(&self, rest: Local, time_s: f64) -> DAffine3 {
        if self.is_empty() {
            return rest.to_affine();
        }
        let rest = rest.to_trs();
        let at = |track: &Option<Track<DVec3>>, rest| track.as_ref().map_or(rest, |t| t.at(time_s));
        let rotation = self.rotation.as_ref();
        Trs {
            translation: at(&self.translation, rest.translation),
            rotation: rotation.map_or(rest.rotation, |t| t.at(time_s)),
            scale: at(&self.scale, rest.scale),
        }
        .to_affine()
    }
}

impl Animation {
    /// Length of the loop, seconds; 0 where nothing moves.
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Whether an animation moves the glTF node, directly or through an ancestor.
    pub fn moves(&self, node: usize) -> bool {
        self.moving_of_node.contains_key(&node)
    }

    /// The time within the loop: any time, also negative, huge or NaN (read as 0), becomes one in `0..duration_s`.
    pub fn loop_time_s(&self, time_s: f64) -> f64 {
        let looped = time_s.rem_euclid(self.duration_s);
        if looped.is_finite() { looped } else { 0.0 }
    }

    /// Scene space from each moving node's space, in the order of `moving`.
    pub(super) fn scene_from_moving(&self, time_s: f64) -> Vec<DAffine3> {
        let time_s = self.loop_time_s(time_s);
        let mut placed: Vec<DAffine3> = Vec::with_capacity(self.moving.len());
        for node in &self.moving {
            let scene_from_parent = match node.parent {
                Parent::Fixed(affine) => affine,
                Parent::Moving(parent) => placed[parent],
            };
            placed.push(scene_from_parent * node.channels.place(node.local, time_s));
        }
        placed
    }

    /// Moves the scene space that the fixed parents are given in: scene space's origin goes to `origin`.
    pub(super) fn recenter(&mut self, origin: DVec3) {
        for node in &mut self.moving {
            if let Parent::Fixed(affine) = &mut node.parent {
                affine.translation -= origin;
            }
        }
    }
}

/// Where everything that moves is at one time.
#[derive(Clone, Debug, Default)]
pub struct ScenePose {
    /// Scene from object space, one for each of `Scene::objects`. It may scale, shear or mirror; while a scale passes through 0 it is
    /// singular and the object is invisible. The front normal in scene space is always the inverse transpose of that in object space.
    pub scene_from_object: Vec<Affine3A>,
    /// The lights at that time, one for each of `Scene::lights`.
    pub lights: Vec<PunctualLight>,
    /// The cameras at that time, one for each of `Scene::cameras`.
    pub cameras: Vec<Camera>,
}

impl Scene {
    /// Where objects, lights and cameras are at a time, seconds. Loops over [`Animation::duration_s`]; any time is allowed.
    pub fn pose_at(&self, time_s: f64) -> ScenePose {
        let placed = self.animation.scene_from_moving(time_s);
        let of_node = |node: usize| {
            let position = *self.animation.moving_of_node.get(&node)?;
            Some(within_reach(placed[position]))
        };
        ScenePose {
            scene_from_object: self
                .objects
                .iter()
                .map(|object| of_node(object.node).map_or(Affine3A::IDENTITY, to_f32))
                .collect(),
            lights: self
                .lights
                .iter()
                .map(|light| match of_node(light.node) {
                    Some(scene_from_node) => light.placed(scene_from_node),
                    None => light.clone(),
                })
                .collect(),
            cameras: self
                .cameras
                .iter()
                .map(|camera| match of_node(camera.node) {
                    Some(scene_from_node) => camera.placed(scene_from_node),
                    None => camera.clone(),
                })
                .collect(),
        }
    }

    /// Bounds of all geometry at any time of the animation, scene space, metres: what a grid over the scene must cover.
    ///
    /// Moving objects are sampled at 256 even times by the corners of their own bounds, so this is generous for turning objects; a motion
    /// faster than the sampling can leave it for a moment.
    pub fn bounds_over_time(&self) -> Aabb {
        const SAMPLES: u32 = 256;
        let mut bounds = self.bounds;
        let object_bounds: Vec<Aabb> = self.objects.iter().map(|o| o.mesh.bounds()).collect();
        for sample in 0..SAMPLES {
            if self.objects.is_empty() {
                break;
            }
            let time_s = self.animation.duration_s * f64::from(sample) / f64::from(SAMPLES);
            let pose = self.pose_at(time_s);
            for (scene_from_object, object) in pose.scene_from_object.iter().zip(&object_bounds) {
                for corner in object.corners() {
                    bounds.include(scene_from_object.transform_point3(corner));
                }
            }
        }
        bounds
    }
}

/// The map, or the zero map where extreme keys make it so large that f32 would overflow: then the node vanishes for that moment.
fn within_reach(scene_from_node: DAffine3) -> DAffine3 {
    let is_near = |entry: f64| entry.abs() <= MAX_COORDINATE_M;
    if scene_from_node.to_cols_array().into_iter().all(is_near) {
        scene_from_node
    } else {
        DAffine3::ZERO
    }
}

/// An affine map in the precision of the GPU.
pub(super) fn to_f32(affine: DAffine3) -> Affine3A {
    affine.as_affine3a()
}
