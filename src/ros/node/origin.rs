//! The part of a node that stays while its formation is opened and closed.

use super::NodeError;
use super::settings::TOPICS;
use crate::messages::builtin_interfaces::Time;
use crate::messages::names::Names;
use crate::messages::std_msgs::Header;
use crate::ros::edge::Node;
use crate::ros::edge::parameters::{Parameters, Value};
use crate::scene::swarm::Swarm;
use crate::scene::swarm::raw::RawNode;
use crate::swarm::control::Control;
use crate::swarm::control::scope::NodeScope;

/// Names, robots and swarm of a node.
pub(super) struct Origin {
    pub names: Names,
    pub part: NodeScope,
    /// Its topics and frame are those of the parameters when the formation was last opened.
    pub swarm: Swarm,
    pub simulated_time: bool,
    /// The loop before its first tick.
    pub fresh: Control,
    // Dropped after all that was made from it.
    pub node: Node,
}

impl Origin {
    /// Fully qualified name of a robot's topic.
    ///
    /// # Errors
    /// A name that ROS 2 does not allow.
    pub fn topic_of(&self, pattern: &str, robot: &str) -> Result<String, NodeError> {
        Ok(self.names.fleet_topic(&pattern.replace("{name}", robot))?)
    }

    /// Takes topics and frame from the parameters.
    pub fn take_names(&mut self, parameters: &Parameters) {
        let raw = &mut self.swarm.raw.node;
        for (name, field) in TOPICS {
            if let Some(value) = parameters.get(name).and_then(Value::as_str) {
                value.clone_into(field(raw));
            }
        }
    }

    /// Refuses topics that a later `configure` could not open.
    ///
    /// # Errors
    /// The first name that ROS 2 does not allow.
    pub fn check_topics(&self) -> Result<(), NodeError> {
        let RawNode { pose_topic, target_topic, leader_topic, velocity_topic, .. } = &self.swarm.raw.node;
        for robot in &self.fresh.formation().names {
            for pattern in [pose_topic, target_topic, leader_topic, velocity_topic] {
                self.topic_of(pattern, robot)?;
            }
        }
        Ok(())
    }

    /// Where the node can be reached, in words: its name and domain, and the topics of its first robot.
    pub fn reached_at(&self) -> [String; 2] {
        let (raw, robots) = (&self.swarm.raw.node, &self.fresh.formation().names);
        let first = self.part.mine.first().map_or("{name}", |&m| &robots[m]);
        // Checked when the node was opened.
        let topic = |pattern: &str| self.topic_of(pattern, first).unwrap_or_default();
        let (poses, targets) = (topic(&raw.pose_topic), topic(&raw.target_topic));
        [
            format!("{} on {}", self.node.name(), self.node.options()),
            format!("{first}: poses from {poses}, targets to {targets}, in the frame `{}`", raw.frame_id),
        ]
    }

    /// Header of what is published at `now` \[s\].
    pub fn header(&self, now: f64) -> Header {
        Header { stamp: Time::from_seconds(now), frame_id: self.swarm.raw.node.frame_id.clone() }
    }
}
