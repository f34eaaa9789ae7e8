//! The loop's end over ROS 2: poses and places of leaders in, `PoseStamped` targets out.

use std::collections::BTreeMap;

use super::pose::{PoseSource, each};
use super::{NodeError, TopicOf, copy};
use crate::messages::builtin_interfaces::Time;
use crate::messages::flockform_msgs::Ranges;
use crate::messages::formation::{pose::is_frame, ranges};
use crate::messages::geometry_msgs::{Pose, PoseArray, PoseStamped};
use crate::messages::recorder::MessageRecorder;
use crate::messages::said;
use crate::messages::std_msgs::Header;
use crate::ros::edge::{EdgeError, Node, Publisher, Quality, Subscription};
use crate::scene::swarm::raw::RawNode;
use crate::swarm::control::Control;
use crate::swarm::control::scope::NodeScope;
use crate::swarm::pace::system_time;
use crate::swarm::transport::complaints::Complaints;
use crate::swarm::transport::{ControllerEnd, Received, Target};

/// Topics of the members.
pub struct Link {
    poses: PoseSource,
    /// By observer; empty in a swarm without ranges.
    ranges: Vec<(usize, Subscription<Ranges>)>,
    /// Of the robots, by their names.
    numbers: ranges::Numbers,
    /// Members whose poses are received.
    heard: Vec<usize>,
    leaders: Vec<(usize, Subscription<PoseStamped>)>,
    targets: TargetTopics,
    frame_id: String,
    simulated_time: bool,
    /// Places of leaders in another frame.
    misframed: u64,
    /// By member, the frame of its last pose in another than the swarm's.
    wrong_frames: BTreeMap<usize, String>,
    /// Of leaders' places and arrays of poses; those of single poses are the loop's.
    complaints: Complaints,
    /// Gets a copy of what goes through.
    pub recorder: Option<MessageRecorder>,
}

enum TargetTopics {
    /// By member; none for those that others serve.
    Stamped(Vec<Option<Publisher<PoseStamped>>>),
    /// One message for all.
    Array(Box<Publisher<PoseArray>>),
}

impl TargetTopics {
    fn open(
        node: &Node,
        raw: &RawNode,
        count: usize,
        mine: &[usize],
        topic: TopicOf<'_>,
    ) -> Result<Self, NodeError> {
        if raw.has_target_array() {
            let topic = topic(&raw.target_topic, 0)?;
            return Ok(Self::Array(Box::new(node.publisher(&topic, Quality::reliable(1))?)));
        }
        let mut targets: Vec<_> = (0..count).map(|_| None).collect();
        for &m in mine {
            targets[m] = Some(node.publisher(&topic(&raw.target_topic, m)?, Quality::reliable(1))?);
        }
        Ok(Self::Stamped(targets))
    }
}

impl Link {
    /// For a loop's part in a formation; under simulated time the computer's, by which DDS says when a message came,
    /// means nothing.
    pub fn open(
        node: &Node,
        raw: &RawNode,
        control: &Control,
        part: &NodeScope,
        simulated_time: bool,
        topic: TopicOf<'_>,
    ) -> Result<Self, NodeError> {
        let formation = control.formation();
        let moved = formation.moved().filter(|m| part.mine.contains(m));
        let leaders = each(node, moved, |m| topic(&raw.leader_topic, m))?;
        let targets = TargetTopics::open(node, raw, formation.count(), &part.mine, topic)?;
        let has_ranges = control.watch().limits().ranges.is_some();
        let ranging = part.heard.iter().copied().filter(|_| has_ranges);
        let ranges = each(node, ranging, |m| topic(&raw.ranges_topic, m))?;
        let poses = PoseSource::open(node, raw, &part.heard, formation.count(), topic)?;
        Ok(Self {
            poses,
            ranges,
            numbers: ranges::numbers(&formation.names),
            heard: part.heard.clone(),
            leaders,
            targets,
            frame_id: raw.frame_id.clone(),
            simulated_time,
            misframed: 0,
            wrong_frames: BTreeMap::new(),
            complaints: Complaints::default(),
            recorder: None,
        })
    }

    /// Of each source of poses, whether those that sent them have taken leave.
    pub fn left(&self) -> Vec<Option<bool>> {
        self.poses.left()
    }

    fn receive_ranges(&mut self, now: f64, take: &mut dyn FnMut(Received)) {
        for (observer, topic) in &self.ranges {
            let Some((message, stamps)) = topic.take_last() else { continue };
            let arrival = if self.simulated_time { now } else { stamps.received };
            if let Some(recorder) = &mut self.recorder {
                recorder.take_received(topic.topic(), &message, [now, arrival]);
            }
            ranges::ranges(&message, *observer, &self.numbers, arrival)
                .filter(|range| self.heard.binary_search(&range.of).is_ok())
                .for_each(|range| take(Received::Range(range)));
        }
    }
}

impl ControllerEnd for Link {
    type Error = EdgeError;

    fn receive(&mut self, now: f64, take: &mut dyn FnMut(Received)) {
        let simulated = self.simulated_time.then_some(now);
        self.receive_ranges(now, take);
        let copies = self.recorder.as_mut().map(|recorder| (recorder, now));
        let wrong_frames = &mut self.wrong_frames;
        let complaints = &mut self.complaints;
        self.poses.take(&self.frame_id, simulated, copies, complaints, &mut |m, pose, frame| {
            if !pose.frame_is_right {
                wrong_frames.insert(m, said(frame).to_string());
            }
            take(Received::Pose(m, pose));
        });
        for (member, topic) in &self.leaders {
            let Some((message, _)) = topic.take_last() else { continue };
            if let Some(recorder) = &mut self.recorder {
                recorder.take_received(topic.topic(), &message, [now; 2]);
            }
            if is_frame(&message.header.frame_id, &self.frame_id) {
                let place = message.pose.position;
                take(Received::Leader(*member, [place.x, place.y]));
            } else {
                let text = format_args!(
                    "{}: frame `{}` is not `{}`, which the swarm file names",
                    topic.topic(),
                    said(&message.header.frame_id),
                    self.frame_id
                );
                self.complaints.warn("wrong frame", *member, system_time(), &text);
                self.misframed += 1;
            }
        }
    }

    fn send(&mut self, now: f64, targets: &[Target]) -> Result<(), EdgeError> {
        let header = Header { stamp: Time::from_seconds(now), frame_id: self.frame_id.clone() };
        match &self.targets {
            TargetTopics::Array(_) if targets.is_empty() => Ok(()),
            TargetTopics::Array(topic) => {
                let message = array(targets, self.numbers.len(), header);
                copy(&mut self.recorder, topic, &message, now);
                topic.publish(&message)
            }
            TargetTopics::Stamped(topics) => {
                let mut outcome = Ok(());
                for target in targets {
                    let Some(topic) = &topics[target.member] else { continue };
                    let pose = Pose::planar(target.position, target.yaw);
                    let message = PoseStamped { header: header.clone(), pose };
                    copy(&mut self.recorder, topic, &message, now);
                    // A failure for one member does not stop the others' targets.
                    outcome = outcome.and(topic.publish(&message));
                }
                outcome
            }
        }
    }

    fn wrong_frame(&self, member: usize) -> Option<[&str; 2]> {
        Some([self.wrong_frames.get(&member)?, &self.frame_id])
    }

    fn refused(&self) -> u64 {
        self.misframed
            + self.poses.refused()
            + self.ranges.iter().map(|(_, topic)| topic.refused()).sum::<u64>()
            + self.leaders.iter().map(|(_, topic)| topic.refused()).sum::<u64>()
    }
}

/// The targets of `count` robots as one message; nowhere for robots without one.
fn array(targets: &[Target], count: usize, header: Header) -> PoseArray {
    let mut poses = vec![Pose::nowhere(); count];
    for target in targets {
        poses[target.member] = Pose::planar(target.position, target.yaw);
    }
    PoseArray { header, poses }
}
