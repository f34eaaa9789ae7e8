//! Poses as they come in: one topic a member, or one for all; four types of message.

use super::recorder::MessageRecorder;
use super::{NodeError, TopicOf};
use crate::messages::Message;
use crate::messages::formation::pose::pose;
use crate::messages::geometry_msgs::{self, PoseArray, PoseStamped, PoseWithCovarianceStamped};
use crate::messages::nav_msgs::Odometry;
use crate::messages::std_msgs::Header;
use crate::ros::edge::{Node, Quality, Stamps, Subscription};
use crate::scene::swarm::raw::{RawNode, RawPoseType};
use crate::swarm::pace::system_time;
use crate::swarm::transport::complaints::Complaints;
use crate::swarm::watch::Pose;

/// Where the members' poses come from.
pub enum PoseSource {
    Stamped(Vec<(usize, Subscription<PoseStamped>)>),
    WithCovariance(Vec<(usize, Subscription<PoseWithCovarianceStamped>)>),
    Odometry(Vec<(usize, Subscription<Odometry>)>),
    /// One message for all, in the order of the members.
    Array(Box<PoseArrays>),
}

/// Poses of all members in one message.
pub struct PoseArrays {
    topic: Subscription<PoseArray>,
    /// Members whose poses are read.
    heard: Vec<usize>,
    /// All members \[1\].
    count: usize,
    /// Messages with another number of poses.
    misfits: u64,
}

/// Poses of one member taken in a tick at most: a flood must not hold the loop.
const MOST_AT_ONCE: usize = 64;

/// Of arrays of poses: those of several stamps may come in one period.
pub const ARRAYS: Quality = Quality { depth: MOST_AT_ONCE as u16, ..Quality::BEST_EFFORT };

/// Whether an array has a pose of each of `count` robots; complains of one that has not: whose its poses are is not known.
pub fn is_whole(message: &PoseArray, count: usize, topic: &str, complaints: &mut Complaints) -> bool {
    let poses = message.poses.len();
    if poses != count {
        let text = format_args!(
            "{topic}: {poses} poses, and the swarm has {count} robots: send one of each, in the order of the swarm file"
        );
        complaints.warn("number of poses", 0, system_time(), &text);
    }
    poses == count
}

impl PoseSource {
    /// Of the members in `heard`, of `count` in all.
    pub fn open(
        node: &Node,
        raw: &RawNode,
        heard: &[usize],
        count: usize,
        topic: TopicOf<'_>,
    ) -> Result<Self, NodeError> {
        let members = heard.iter().copied();
        let of = |m| topic(&raw.pose_topic, m);
        Ok(match raw.pose_type {
            RawPoseType::PoseStamped => Self::Stamped(each(node, members, of)?),
            RawPoseType::PoseWithCovarianceStamped => Self::WithCovariance(each(node, members, of)?),
            RawPoseType::Odometry => Self::Odometry(each(node, members, of)?),
            RawPoseType::PoseArray => {
                let topic = node.subscription(&of(0)?, ARRAYS)?.steady();
                Self::Array(Box::new(PoseArrays { topic, heard: heard.to_vec(), count, misfits: 0 }))
            }
        })
    }

    /// Passes every pose that arrived since the last call to `hear`, and its message to `recorder` with the loop's
    /// time, and the frame that the message names; an array of another length is left out, with a complaint, and so are entries
    /// that are nowhere, without one. Under simulated
    /// time `now` \[s\] is given; it replaces the reception time, which DDS takes from the computer's clock.
    pub fn take(
        &mut self,
        frame_id: &str,
        now: Option<f64>,
        mut recorder: Option<(&mut MessageRecorder, f64)>,
        complaints: &mut Complaints,
        hear: &mut dyn FnMut(usize, Pose, &str),
    ) {
        let pose = |header: &Header, one: &geometry_msgs::Pose, stamps: Stamps| {
            pose(header, one, now.unwrap_or(stamps.received), frame_id)
        };
        match self {
            Self::Stamped(all) => {
                drain(all, |message| (&message.header, &message.pose), pose, (&mut recorder, now), hear);
            }
            Self::WithCovariance(all) => {
                drain(all, |message| (&message.header, &message.pose.pose), pose, (&mut recorder, now), hear);
            }
            Self::Odometry(all) => {
                drain(all, |message| (&message.header, &message.pose.pose), pose, (&mut recorder, now), hear);
            }
            Self::Array(arrays) => {
                let PoseArrays { topic, heard, count, misfits } = &mut **arrays;
                for (message, stamps) in std::iter::from_fn(|| topic.take()).take(MOST_AT_ONCE) {
                    copy(&mut recorder, topic.topic(), &message, stamps, now);
                    if !is_whole(&message, *count, topic.topic(), complaints) {
                        *misfits += 1;
                        continue;
                    }
                    let all = heard.iter().map(|&member| (member, &message.poses[member]));
                    for (member, one) in all.filter(|(_, one)| !one.is_nowhere()) {
                        hear(member, pose(&message.header, one, stamps), &message.header.frame_id);
                    }
                }
            }
        }
    }

    /// Of each topic, whether those that sent poses on it have taken leave.
    pub fn left(&self) -> Vec<Option<bool>> {
        match self {
            Self::Stamped(all) => all.iter().map(|(_, topic)| topic.is_left()).collect(),
            Self::WithCovariance(all) => all.iter().map(|(_, topic)| topic.is_left()).collect(),
            Self::Odometry(all) => all.iter().map(|(_, topic)| topic.is_left()).collect(),
            Self::Array(arrays) => vec![arrays.topic.is_left()],
        }
    }

    /// Messages that were no message of the type, or not of this swarm.
    pub fn refused(&self) -> u64 {
        match self {
            Self::Stamped(all) => all.iter().map(|(_, topic)| topic.refused()).sum(),
            Self::WithCovariance(all) => all.iter().map(|(_, topic)| topic.refused()).sum(),
            Self::Odometry(all) => all.iter().map(|(_, topic)| topic.refused()).sum(),
            Self::Array(arrays) => arrays.topic.refused() + arrays.misfits,
        }
    }
}

/// A steady topic of each of these members.
pub fn each<M: Message>(
    node: &Node,
    members: impl Iterator<Item = usize>,
    topic: impl Fn(usize) -> Result<String, NodeError>,
) -> Result<Vec<(usize, Subscription<M>)>, NodeError> {
    let open = |m| Ok((m, node.subscription(&topic(m)?, Quality::BEST_EFFORT)?.steady()));
    members.map(open).collect()
}

fn drain<M: Message>(
    all: &[(usize, Subscription<M>)],
    parts: impl Fn(&M) -> (&Header, &geometry_msgs::Pose),
    pose: impl Fn(&Header, &geometry_msgs::Pose, Stamps) -> Pose,
    (recorder, now): (&mut Option<(&mut MessageRecorder, f64)>, Option<f64>),
    hear: &mut dyn FnMut(usize, Pose, &str),
) {
    for (member, topic) in all {
        for (message, stamps) in std::iter::from_fn(|| topic.take()).take(MOST_AT_ONCE) {
            copy(recorder, topic.topic(), &message, stamps, now);
            let (header, one) = parts(&message);
            hear(*member, pose(header, one, stamps), &header.frame_id);
        }
    }
}

fn copy<M: Message>(
    recorder: &mut Option<(&mut MessageRecorder, f64)>,
    topic: &str,
    message: &M,
    stamps: Stamps,
    now: Option<f64>,
) {
    if let Some((recorder, time)) = recorder {
        recorder.take_received(topic, message, [*time, now.unwrap_or(stamps.received)]);
    }
}
