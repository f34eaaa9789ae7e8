//! The part of a node that stays while its formation is opened and closed.

use std::collections::BTreeSet;

use super::NodeError;
use super::settings::{Field, TOPICS};
use super::uses::Uses;
use crate::messages::builtin_interfaces::Time;
use crate::messages::names::Names;
use crate::messages::recorder::EVENTS;
use crate::messages::std_msgs::Header;
use crate::ros::edge::Node;
use crate::ros::edge::parameters::{Parameters, Value};
use crate::scene::swarm::Swarm;
use crate::scene::swarm::raw::{RawPoseType, RawService};
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
    /// Takes topics and frame from the parameters.
    pub fn take_names(&mut self, parameters: &Parameters) {
        let raw = &mut self.swarm.raw.node;
        for (name, field) in TOPICS {
            if let Some(value) = parameters.get(name).and_then(Value::as_str) {
                value.clone_into(field(raw));
            }
        }
    }

    /// Overrides by which this swarm file, that of the node, names the topics and the frame as the parameters do.
    pub fn overrides(&self, file: &Swarm) -> Vec<String> {
        let (mut theirs, mut ours) = (file.raw.node.clone(), self.swarm.raw.node.clone());
        let changed = |(key, field): (&str, Field)| {
            let value = field(&mut ours);
            (field(&mut theirs) != value).then(|| format!("node.{key}={value:?}"))
        };
        TOPICS.into_iter().filter_map(changed).collect()
    }

    /// Refuses topics that `configure` could not open, and topics with two uses: of the fleet, or the node's own.
    ///
    /// # Errors
    /// The first name that ROS 2 does not allow, or that is used twice.
    pub fn check_topics(&self) -> Result<(), NodeError> {
        type IsUsed<'a> = &'a dyn Fn(usize) -> bool;
        let (raw, part, formation) = (&self.swarm.raw.node, &self.part, self.fresh.formation());
        let is_array = raw.pose_type == RawPoseType::PoseArray;
        let moved: BTreeSet<usize> = formation.moved().collect();
        let is_posed = |m: usize| m == 0 || !is_array;
        let is_target = |m: usize| m == 0 || !raw.has_target_array();
        let is_moved = |m: usize| moved.contains(&m);
        let has_ranges = self.swarm.raw.ranges.is_some();
        let has_velocity = |_: usize| raw.velocity.is_some();
        let patterns: [(_, _, _, IsUsed<'_>); 5] = [
            ("poses", &raw.pose_topic, &part.heard, &is_posed),
            ("targets", &raw.target_topic, &part.mine, &is_target),
            ("places", &raw.leader_topic, &part.mine, &is_moved),
            ("ranges", &raw.ranges_topic, &part.heard, &|_| has_ranges),
            ("velocities", &raw.velocity_topic, &part.mine, &has_velocity),
        ];
        let stop =
            raw.commands.may_stop().then(|| self.names.fleet_topic(&raw.emergency_stop_topic)).transpose()?;
        // A node without a log may be stopped on its topic; one with a log refuses that when it opens it.
        let has_log = stop != Some(self.names.topic("/rosout")?);
        let mut uses = Uses::default();
        uses.add_own(
            &self.names,
            &[
                ("~/state", "states", true),
                // These two are in a recording in any case.
                ("~/markers", "markers", true),
                (EVENTS, "events", true),
                ("/diagnostics", "diagnostics", true),
                ("/rosout", "log lines", has_log),
                ("/parameter_events", "changed parameters", raw.serves(RawService::Parameters)),
                ("~/transition_event", "transitions", raw.serves(RawService::TransitionEvents)),
                ("/clock", "the time", self.simulated_time),
            ],
        )?;
        if let Some(stop) = stop {
            uses.add(stop, "emergency stops", "all robots")?;
        }
        for (purpose, pattern, own, is_used) in patterns {
            // Topics below the node are its own alone: other robots' nodes have others.
            let is_private = pattern.starts_with('~');
            for (m, robot) in formation.names.iter().enumerate() {
                let topic = self.names.robot_topic(pattern, robot)?;
                if is_used(m) && (!is_private || own.contains(&m)) {
                    uses.add(topic, purpose, robot)?;
                }
            }
        }
        Ok(())
    }

    /// The robot that the node serves, where there are others which it does not.
    pub fn alone(&self) -> Option<&str> {
        let robots = &self.fresh.formation().names;
        match self.part.mine[..] {
            [m] if robots.len() > 1 => Some(&robots[m]),
            _ => None,
        }
    }

    /// Where the node can be reached, in words: its name and domain.
    pub fn reached_at(&self) -> String {
        format!("{} on {}", self.node.name(), self.node.options())
    }

    /// The topic of a robot's poses.
    pub fn pose_topic(&self, member: usize) -> String {
        // Checked before the topics were opened.
        let robot = &self.fresh.formation().names[member];
        self.names.robot_topic(&self.swarm.raw.node.pose_topic, robot).unwrap_or_default()
    }

    /// Where its first robot is reached, in words.
    pub fn robots_reached_at(&self) -> String {
        let (raw, robots) = (&self.swarm.raw.node, &self.fresh.formation().names);
        let first = self.part.mine.first().map_or("{name}", |&m| &robots[m]);
        // Checked before the topics were opened.
        let topic = |pattern: &str| self.names.robot_topic(pattern, first).unwrap_or_default();
        let (poses, targets) = (topic(&raw.pose_topic), topic(&raw.target_topic));
        format!("{first}: poses from {poses}, targets to {targets}, in the frame `{}`", raw.frame_id)
    }

    /// Header of what is published at `now` \[s\].
    pub fn header(&self, now: f64) -> Header {
        Header { stamp: Time::from_seconds(now), frame_id: self.swarm.raw.node.frame_id.clone() }
    }
}
