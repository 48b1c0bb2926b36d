//! Reads the animations of a document into one [`Animation`].

use std::collections::HashMap;

use glam::{DAffine3, DQuat, DVec3};
use gltf::animation::{Interpolation, Property};

use super::accessor::Accessors;
use super::animation::{Animation, Channels, MovingNode, Parent};
use super::error::SceneProblem;
use super::limits::LoadLimits;
use super::node::{Local, NodeTree, display_name, normalized};
use super::track::{Keys, Track};
use super::warnings::Warnings;

/// Merges all animations (a later one wins where two move the same thing) and finds the nodes that they move, in the file's world space.
pub(super) fn read_animation(
    document: &gltf::Document,
    tree: &NodeTree,
    accessors: &Accessors,
    limits: &LoadLimits,
    warnings: &mut Warnings,
) -> Result<Animation, SceneProblem> {
    let mut reader = Reader {
        accessors,
        keys_read: 0,
        keys_limit: limits.animation_keys,
        channels_of_node: HashMap::new(),
        duration_s: 0.0,
        warnings,
    };
    for animation in document.animations() {
        let label = display_name("animation", animation.name(), animation.index());
        for (index, channel) in animation.channels().enumerate() {
            reader.read(&channel, &format!("{label} channel {index}"), tree)?;
        }
    }
    Ok(moving_nodes(
        tree,
        reader.channels_of_node,
        reader.duration_s,
    ))
}

/// Lists every node that has channels, or whose parent is listed.
fn moving_nodes(
    tree: &NodeTree,
    mut channels_of_node: HashMap<usize, Channels>,
    duration_s: f64,
) -> Animation {
    let mut animation = Animation {
        duration_s,
        ..Animation::default()
    };
    if channels_of_node.is_empty() {
        return animation;
    }
    let mut world_of_fixed = HashMap::new();
    for &node in &tree.order {
        let parent = tree.parent[node];
        let moving_parent = parent.and_then(|p| animation.moving_of_node.get(&p).copied());
        let fixed_parent = parent.and_then(|p| world_of_fixed.get(&p).copied());
        let channels = channels_of_node.remove(&node);
        let parent = match moving_parent {
            Some(parent) => Parent::Moving(parent),
            None => Parent::Fixed(fixed_parent.unwrap_or(DAffine3::IDENTITY)),
        };
        match (parent, channels) {
            (Parent::Fixed(world_from_parent), None) => {
                world_of_fixed.insert(node, world_from_parent * tree.local[node].to_affine());
            }
            (parent, channels) => {
                let position = animation.moving.len();
                animation.moving_of_node.insert(node, position);
                animation.moving.push(MovingNode {
                    parent,
                    local: tree.local[node],
                    channels: channels.unwrap_or_default(),
                });
            }
        }
    }
    animation
}

struct Reader<'a> {
    accessors: &'a Accessors<'a>,
    keys_read: u64,
    keys_limit: u64,
    channels_of_node: HashMap<usize, Channels>,
    duration_s: f64,
    warnings: &'a mut Warnings,
}

impl Reader<'_> {
    fn read(
        &mut self,
        channel: &gltf::animation::Channel,
        label: &str,
        tree: &NodeTree,
    ) -> Result<(), SceneProblem> {
        let node = channel.target().node().index();
        let property = channel.target().property();
        if property == Property::MorphTargetWeights {
            self.warnings
                .push(format!("{label} animates morph targets; it is left out"));
            return Ok(());
        }
        if matches!(tree.local[node], Local::Matrix(_)) {
            self.warnings.push(format!(
                "{label} animates {}, which has a matrix; its shear, if any, is lost",
                tree.names[node]
            ));
        }
        let sampler = channel.sampler();
        let interpolation = sampler.interpolation();
        let (input, output) = (sampler.input().index(), sampler.output().index());
        let claimed = self
            .accessors
            .count(input)
            .saturating_add(self.accessors.count(output));
        self.keys_read = self.keys_read.saturating_add(claimed);
        SceneProblem::check_limit(
            format!("animation keys up to {label}"),
            self.keys_read,
            self.keys_limit,
            "animation_keys",
        )?;

        let times = self
            .accessors
            .read_vectors::<1>(input, &format!("{label} times"))?;
        let times_s = times.iter().map(|[time]| f64::from(*time)).collect();
        let label_values = format!("{label} values");
        let channels = self.channels_of_node.entry(node).or_default();
        let (end_s, replaced) = if property == Property::Rotation {
            let values = self.accessors.read_vectors::<4>(output, &label_values)?;
            let values = values
                .into_iter()
                .map(|q| DQuat::from_array(q.map(f64::from)));
            let mut keys = keys(values.collect(), interpolation);
            // Tangents are no rotations: only the values become unit quaternions.
            match &mut keys {
                Keys::Step(values) | Keys::Linear(values) => values.iter_mut().for_each(make_unit),
                Keys::CubicSpline(values) => {
                    values.iter_mut().for_each(|key| make_unit(&mut key[1]))
                }
            }
            put(&mut channels.rotation, times_s, keys)
        } else {
            let values = self.accessors.read_vectors::<3>(output, &label_values)?;
            let values = values
                .into_iter()
                .map(|v| DVec3::from_array(v.map(f64::from)));
            let slot = match property {
                Property::Translation => &mut channels.translation,
                _ => &mut channels.scale,
            };
            put(slot, times_s, keys(values.collect(), interpolation))
        }
        .ok_or_else(|| {
            SceneProblem::Invalid(format!(
                "{label} needs keys at ascending times from 0 on, and as many values as times"
            ))
        })?;
        self.duration_s = self.duration_s.max(end_s);
        if replaced {
            self.warnings.push(format!(
                "{label} moves {} as an earlier channel does; the later one is used",
                tree.names[node]
            ));
        }
        Ok(())
    }
}

fn make_unit(rotation: &mut DQuat) {
    *rotation = normalized(*rotation).unwrap_or(DQuat::IDENTITY);
}

fn keys<T: Copy>(values: Vec<T>, interpolation: Interpolation) -> Keys<T> {
    match interpolation {
        Interpolation::Step => Keys::Step(values),
        Interpolation::Linear => Keys::Linear(values),
        Interpolation::CubicSpline => Keys::CubicSpline(
            values
                .chunks_exact(3)
                .map(|key| [key[0], key[1], key[2]])
                .collect(),
        ),
    }
}

/// Fills a slot; returns the end of the track and whether it replaced another, or `None` if the keys make no track.
fn put<T: super::track::Interpolate>(
    slot: &mut Option<Track<T>>,
    times_s: Vec<f64>,
    keys: Keys<T>,
) -> Option<(f64, bool)> {
    let track = Track::new(times_s, keys)?;
    let end_s = track.end_s();
    Some((end_s, slot.replace(track).is_some()))
}
