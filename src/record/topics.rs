//! The meaning of a recording's topics for a swarm.

use std::collections::BTreeMap;

use super::{Entry, Reader, RecordError};
use crate::messages::geometry_msgs::{self, PoseStamped, PoseWithCovarianceStamped};
use crate::messages::names::Names;
use crate::messages::nav_msgs::Odometry;
use crate::messages::recorder::EVENTS;
use crate::messages::std_msgs::Header;
use crate::scene::swarm::Swarm;
use crate::scene::swarm::raw::{RawNode, RawPoseType};
use crate::swarm::control::Control;

/// The meaning of a topic for the loop.
#[derive(Clone, Copy)]
pub(super) enum Heard {
    Events,
    Pose(usize),
    /// Of all robots, in their order.
    Poses,
    Leader(usize),
    /// That a robot measured.
    Ranges(usize),
    Target(usize),
    /// Of all robots, in their order.
    Targets,
}

/// A pose with its header, from any of the messages that carry one.
pub(super) fn stamped(entry: &Entry) -> Option<(Header, geometry_msgs::Pose)> {
    let plain = || entry.decode::<PoseStamped>().map(|message| (message.header, message.pose));
    let uncertain =
        || entry.decode::<PoseWithCovarianceStamped>().map(|message| (message.header, message.pose.pose));
    let odometry = || entry.decode::<Odometry>().map(|message| (message.header, message.pose.pose));
    plain().or_else(uncertain).or_else(odometry)
}

/// The meaning of the recorded topics for this swarm, and whether the loop's events are among them. The node may have had
/// another name, and its robots' topics other beginnings.
pub(super) fn topics(
    reader: &Reader,
    swarm: &Swarm,
    control: &Control,
    names: &Names,
) -> Result<(BTreeMap<String, Heard>, bool), RecordError> {
    let leaf = EVENTS.trim_start_matches('~');
    let mut topics = BTreeMap::new();
    reader.each(&mut |entry| {
        if &*entry.kind == "flockform_msgs/LoopEvent" && entry.topic.ends_with(leaf) {
            topics.insert(entry.topic.to_string(), Heard::Events);
        }
    });
    let has_events = !topics.is_empty();
    topics.extend(of_robots(swarm, control, names)?);
    Ok((topics, has_events))
}

/// The topics of poses and targets of single robots: where one message for all is sent, those that a node without it has.
/// It would say of all what the channels of a flight have delivered of one.
pub(super) fn single_topics(raw: &RawNode) -> [String; 2] {
    let RawNode { pose_topic, target_topic, .. } = RawNode::default();
    let poses = if raw.pose_type == RawPoseType::PoseArray { &pose_topic } else { &raw.pose_topic };
    let targets = if raw.has_target_array() { &target_topic } else { &raw.target_topic };
    [poses.clone(), targets.clone()]
}

/// The topics of a swarm's robots and leaders, whether a recording has messages of them or not.
pub(super) fn of_robots(
    swarm: &Swarm,
    control: &Control,
    names: &Names,
) -> Result<BTreeMap<String, Heard>, RecordError> {
    let raw = &swarm.raw.node;
    let mut topics = BTreeMap::new();
    if raw.pose_type == RawPoseType::PoseArray {
        topics.insert(names.fleet_topic(&raw.pose_topic)?, Heard::Poses);
    }
    if raw.has_target_array() {
        topics.insert(names.fleet_topic(&raw.target_topic)?, Heard::Targets);
    }
    let [poses, targets] = single_topics(raw);
    for (m, name) in control.formation().names.iter().enumerate() {
        let of = |pattern: &str| names.robot_topic(pattern, name);
        topics.insert(of(&poses)?, Heard::Pose(m));
        topics.insert(of(&raw.leader_topic)?, Heard::Leader(m));
        topics.insert(of(&raw.ranges_topic)?, Heard::Ranges(m));
        topics.insert(of(&targets)?, Heard::Target(m));
    }
    Ok(topics)
}
