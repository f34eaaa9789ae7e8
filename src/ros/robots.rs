//! `flockform robots`: the simulated robots of a swarm file over ROS 2, in one process.
//!
//! Poses out, targets in, frames on `/tf`, of one node for all robots or of a node for each ([`Layout`]). The noise,
//! delay, loss and faults of the file are applied here, so the formation node receives what it would from real robots.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;

use serde::{Deserialize, Serialize};

use super::arguments::{Names, RosArguments};
use super::edge::descriptions::TypeDescriptions;
use super::edge::loggers::{LogLevel, Loggers};
use super::edge::parameters::{Declaration, Parameters, Store, Value};
use super::edge::pulse::Pulse;
use super::edge::rosout::Rosout;
use super::edge::{EdgeError, Node, Publisher, Quality, Subscription};
use super::network;
use super::node::pose::{ARRAYS, is_whole};
use super::node::uses::Uses;
use super::node::{NodeError, TopicOf, settings};
use crate::messages::Message;
use crate::messages::builtin_interfaces::Time;
use crate::messages::diagnostic_msgs::DiagnosticArray;
use crate::messages::flockform_msgs::Ranges;
use crate::messages::formation::pose::said;
use crate::messages::formation::ranges;
use crate::messages::geometry_msgs::{
    self, PoseArray, PoseStamped, PoseWithCovarianceStamped, Quaternion, Transform, TransformStamped, Vector3,
};
use crate::messages::nav_msgs::Odometry;
use crate::messages::rcl_interfaces::Log;
use crate::messages::rosgraph_msgs::Clock;
use crate::messages::std_msgs::Header;
use crate::messages::tf2_msgs::TFMessage;
use crate::scene::swarm::Swarm;
use crate::scene::swarm::raw::{RawPoseType, RawService, RawSwarm};
use crate::swarm::control::Control;
use crate::swarm::flight::Fleet;
use crate::swarm::formation::Formation;
use crate::swarm::pace::{Pace, system_time};
use crate::swarm::plan::cautions;
use crate::swarm::robots::Robot;
use crate::swarm::transport::complaints::Complaints;
use crate::swarm::transport::{RobotsEnd, catch_up, fly};
use crate::swarm::watch::{Pose, Range};

/// The robots, and what they speak through.
pub struct RobotNodes {
    fleet: Fleet,
    pace: Pace,
    goals: Vec<Option<[f64; 2]>>,
    link: Link,
    frames: Publisher<TFMessage>,
    rosout: Option<Rosout>,
    /// Of the watchdog, where there is one.
    pulse: Option<Arc<Pulse>>,
}

/// The state of the robots that outlasts their process.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct RobotsSnapshot {
    robots: Vec<Robot>,
    goals: Vec<Option<[f64; 2]>>,
    period: u64,
}

/// The nodes that the robots are to others. Topics are the same in both, unless their names are relative to the node
/// (`~/pose`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layout {
    /// One node, `robots`, with its parameters: tools that ask every node wait for none.
    #[default]
    OneNode,
    /// A node `robot` in the namespace of each robot, as of real ones; they serve no parameters.
    NodePerRobot,
}

/// Name of the node of all robots, unless `__node` says otherwise.
pub const NAME: &str = "robots";

/// The robots' end over ROS 2.
pub struct Link {
    /// The frame that each robot carries.
    frames: Vec<String>,
    targets: Targets,
    poses: Poses,
    /// Of the first robot's poses and targets.
    first_topics: [String; 2],
    /// By robot; empty in a swarm without ranges.
    ranges: Vec<Publisher<Ranges>>,
    names: Vec<String>,
    clock: Option<Publisher<Clock>>,
    frame_id: String,
    /// Of arrays of targets.
    complaints: Complaints,
    /// Of nodes that need not be active; none where the permissions do not allow it.
    diagnoses: Option<Subscription<DiagnosticArray>>,
    /// Name of the swarm, which diagnoses of its nodes bear.
    swarm: String,
    /// Whether a target has come.
    has_been_sent: bool,
    /// Whether a target, or a diagnosis once targets have come, came since last asked.
    hears_any: bool,
    /// Of the one node, as what follows.
    parameters: Option<Parameters>,
    descriptions: Option<TypeDescriptions>,
    loggers: Option<Loggers>,
    has_loggers: bool,
    // Dropped after all that was made from them.
    nodes: Vec<Node>,
}

enum Targets {
    Stamped(Vec<Subscription<PoseStamped>>),
    /// In the order of the robots.
    Array(Box<Subscription<PoseArray>>),
}

impl Targets {
    /// Of each topic, whether those that sent targets on it have taken leave.
    fn left(&self) -> Vec<Option<bool>> {
        match self {
            Self::Stamped(all) => all.iter().map(Subscription::is_left).collect(),
            Self::Array(topic) => vec![topic.is_left()],
        }
    }
}

/// Messages of an array taken in a period at most: each node of one robot sends its own.
const MOST_AT_ONCE: usize = 1024;

enum Poses {
    Stamped(Vec<Publisher<PoseStamped>>),
    WithCovariance(Vec<Publisher<PoseWithCovarianceStamped>>),
    Odometry(Vec<Publisher<Odometry>>),
    Array(Publisher<PoseArray>),
}

impl Link {
    /// # Errors
    /// An obstacle in the ROS arguments or the network.
    pub fn open(
        swarm: &Swarm,
        formation: &Formation,
        arguments: &RosArguments,
        layout: Layout,
    ) -> Result<Self, NodeError> {
        let raw = &swarm.raw.node;
        let world = arguments.names(NAME, "/")?;
        let store = declare(arguments, &world)?;
        let publishes_clock = store.get(PUBLISH_CLOCK).and_then(Value::as_bool).unwrap_or_default();
        let edge = network::join(arguments)?;
        let owners = owners(formation, arguments, layout)?;
        let nodes: Vec<Node> = owners.iter().map(|names| edge.named_node(names)).collect::<Result<_, _>>()?;
        // The one node is the owner of all.
        let owner = |m: usize| m.min(nodes.len() - 1);
        let of = |pattern: &str, m: usize| -> Result<_, NodeError> {
            Ok(owners[owner(m)].robot_topic(pattern, &formation.names[m])?)
        };
        let is_one = layout == Layout::OneNode;
        let is_served = is_one && raw.serves(RawService::Parameters);
        let mut uses = Uses::default();
        uses.add_own(
            &owners[0],
            &[
                ("/tf", "frames", true),
                ("/rosout", "log lines", true),
                ("/diagnostics", "diagnostics", true),
                ("/parameter_events", "changed parameters", is_served),
                ("/clock", "the time", publishes_clock),
            ],
        )?;
        check_topics(&swarm.raw, formation, &of, uses)?;
        let target = |m: usize| -> Result<_, NodeError> {
            Ok(nodes[owner(m)].subscription(&of(&raw.target_topic, m)?, Quality::reliable(1))?.steady())
        };
        let targets = if raw.has_target_array() {
            let topic = of(&raw.target_topic, 0)?;
            // As many as there may be nodes.
            let depth = u16::try_from(formation.count()).unwrap_or(u16::MAX);
            Targets::Array(Box::new(nodes[0].subscription(&topic, Quality::reliable(depth))?.steady()))
        } else {
            Targets::Stamped((0..formation.count()).map(target).collect::<Result<_, _>>()?)
        };
        let pose = |m: usize| Ok((&nodes[owner(m)], of(&raw.pose_topic, m)?));
        let (count, first) = (formation.count(), &nodes[0]);
        let poses = match raw.pose_type {
            RawPoseType::PoseStamped => Poses::Stamped(each(count, &pose)?),
            RawPoseType::PoseWithCovarianceStamped => Poses::WithCovariance(each(count, &pose)?),
            RawPoseType::Odometry => Poses::Odometry(each(count, &pose)?),
            RawPoseType::PoseArray => Poses::Array(first.publisher(&of(&raw.pose_topic, 0)?, ARRAYS)?),
        };
        let range = |m: usize| Ok((&nodes[owner(m)], of(&raw.ranges_topic, m)?));
        let ranges = if swarm.raw.ranges.is_some() { each(count, &range)? } else { Vec::new() };
        let clock = publishes_clock
            .then(|| first.publisher(&first.topic("/clock")?, Quality::BEST_EFFORT))
            .transpose()?;
        let parameters = is_one.then(|| Parameters::open(first, store, is_served)).transpose()?;
        let describes = is_one && raw.serves(RawService::TypeDescription);
        let descriptions = describes.then(|| TypeDescriptions::new(first)).transpose()?;
        let frames = formation.names.iter().map(|name| raw.body_frame(world.fleet(), name)).collect();
        let (names, frame_id) = (formation.names.clone(), raw.frame_id.clone());
        Ok(Self {
            frames,
            targets,
            poses,
            first_topics: [of(&raw.pose_topic, 0)?, of(&raw.target_topic, 0)?],
            ranges,
            names,
            clock,
            frame_id,
            complaints: Complaints::default(),
            diagnoses: first.subscription(&first.topic("/diagnostics")?, Quality::reliable(5)).ok(),
            swarm: swarm.name.clone(),
            has_been_sent: false,
            hears_any: false,
            parameters,
            descriptions,
            loggers: None,
            has_loggers: is_one && raw.serves(RawService::LoggerLevels),
            nodes,
        })
    }
}

impl RobotNodes {
    /// # Errors
    /// An obstacle in the swarm file, the ROS arguments or the network.
    pub fn open(swarm: &Swarm, arguments: &RosArguments, layout: Layout) -> Result<Self, NodeError> {
        let control = Control::new(swarm)?;
        let formation = control.formation();
        cautions::of_simulated_robots(&swarm.raw).inspect(|caution| tracing::warn!("{caution}"));
        let fleet = Fleet::new(swarm, formation)?;
        let link = Link::open(swarm, formation, arguments, layout)?;
        Ok(Self {
            frames: link.nodes[0].publisher(&link.nodes[0].topic("/tf")?, Quality::reliable(100))?,
            pace: Pace::new(1.0 / control.period()),
            goals: vec![None; formation.count()],
            rosout: None,
            pulse: None,
            fleet,
            link,
        })
    }

    /// Where the robots can be reached, in words.
    pub fn reached_at(&self) -> String {
        let (first, others) = (&self.link.nodes[0], self.link.nodes.len() - 1);
        let others = if others == 0 { String::new() } else { format!(" and {others} nodes like it") };
        let [poses, targets] = &self.link.first_topics;
        format!("{}{others} on {}; poses to {poses}, targets from {targets}", first.name(), first.options())
    }

    /// As [`FormationNode::run_while`](super::node::FormationNode::run_while).
    pub fn run_while(&mut self, stop: &AtomicBool, look: &mut dyn FnMut(&Self) -> bool) -> bool {
        while !stop.load(Ordering::Relaxed) {
            let missed = self.pace.wait();
            // A clock of their own waits.
            if self.link.clock.is_none() {
                catch_up(&mut self.fleet, &self.goals, missed);
            }
            self.tick();
            if let Some(pulse) = &self.pulse {
                let hears_any = std::mem::take(&mut self.link.hears_any);
                pulse.note_peers(hears_any, || self.link.targets.left());
            }
            if self.pulse.as_ref().is_some_and(|pulse| pulse.is_given_up()) {
                return false;
            }
            if !look(self) {
                break;
            }
        }
        self.pulse.iter().for_each(|pulse| pulse.leave());
        true
    }

    /// As [`FormationNode::share_log`](super::node::FormationNode::share_log), in the name of the first node.
    ///
    /// # Errors
    /// A service or a topic that the middleware refuses.
    pub fn share_log(
        &mut self,
        level: Option<LogLevel>,
        lines: Option<Receiver<Log>>,
    ) -> Result<(), EdgeError> {
        let link = &mut self.link;
        let level = level.filter(|_| link.has_loggers);
        link.loggers = level.map(|level| Loggers::new(&link.nodes[0], level)).transpose()?;
        self.rosout = lines.map(|lines| Rosout::new(&link.nodes[0], lines)).transpose()?;
        Ok(())
    }

    /// As [`FormationNode::watch_middleware`](super::node::FormationNode::watch_middleware).
    ///
    /// # Errors
    /// A computer that gives no socket or thread.
    pub fn watch_middleware(&mut self) -> Result<(), EdgeError> {
        self.pulse = Some(self.link.nodes[0].watch()?);
        Ok(())
    }

    pub fn kept(&self) -> RobotsSnapshot {
        let (robots, period) = (self.fleet.robots().to_vec(), self.fleet.period());
        RobotsSnapshot { robots, goals: self.goals.clone(), period }
    }

    /// Goes on from what another process left.
    pub fn restore(&mut self, kept: &RobotsSnapshot) {
        self.fleet.restore(&kept.robots, kept.period);
        self.goals.iter_mut().zip(&kept.goals).for_each(|(goal, kept)| *goal = *kept);
    }

    pub fn fleet(&self) -> &Fleet {
        &self.fleet
    }

    /// One period: targets in, poses out.
    pub fn tick(&mut self) {
        let Self { fleet, goals, link, pulse, rosout, pace, .. } = self;
        // The publisher of the simulated time starts it. By the computer's the robots have flown until the tick was due,
        // however late it is: from poses of other times it would look as if they did not fly by their model.
        let own_time = link.clock.is_some();
        let now = |fleet: &Fleet| if own_time { fleet.time() } else { system_time() - pace.lateness() };
        let pulse = pulse.clone();
        let _inside = pulse.as_ref().map(|pulse| pulse.inside());
        if let Some(parameters) = &mut link.parameters {
            // All are read-only: nothing changes.
            parameters.poll(now(fleet), None);
        }
        link.descriptions.iter().for_each(TypeDescriptions::serve);
        link.loggers.iter().for_each(|loggers| loggers.serve(None));
        rosout.iter().for_each(Rosout::publish);
        let sent = fly(fleet, goals, link, now).and_then(|()| self.say_frames());
        if let Err(error) = sent {
            tracing::debug!("{error}");
        }
    }

    fn say_frames(&self) -> Result<(), EdgeError> {
        let Self { link, fleet, .. } = self;
        let now = if link.clock.is_some() { fleet.time() } else { system_time() };
        let frame = |(carried, robot): (&String, &crate::swarm::robots::Robot)| TransformStamped {
            header: Header { stamp: Time::from_seconds(now), frame_id: link.frame_id.clone() },
            child_frame_id: carried.clone(),
            transform: Transform {
                translation: Vector3 { x: robot.position[0], y: robot.position[1], z: 0.0 },
                rotation: Quaternion::from_yaw(robot.yaw),
            },
        };
        let transforms = link.frames.iter().zip(fleet.robots()).map(frame).collect();
        self.frames.publish(&TFMessage { transforms })
    }
}

impl RobotsEnd for Link {
    type Error = EdgeError;

    fn targets(&mut self, go: &mut dyn FnMut(usize, [f64; 2])) {
        match &self.targets {
            Targets::Stamped(all) => {
                for (member, topic) in all.iter().enumerate() {
                    if let Some((message, _)) = topic.take_last() {
                        self.hears_any = true;
                        go(member, [message.pose.position.x, message.pose.position.y]);
                    }
                }
            }
            Targets::Array(topic) => {
                for (message, _) in std::iter::from_fn(|| topic.take()).take(MOST_AT_ONCE) {
                    self.hears_any = true;
                    if !is_whole(&message, self.names.len(), topic.topic(), &mut self.complaints) {
                        continue;
                    }
                    let places =
                        message.poses.iter().map(|pose| [pose.position.x, pose.position.y]).enumerate();
                    places
                        .filter(|(_, place)| place.iter().all(|x| x.is_finite()))
                        .for_each(|(m, place)| go(m, place));
                }
            }
        }
        self.has_been_sent |= self.hears_any;
        // A node that is not active sends no targets, and is there all the same.
        let diagnoses = self.diagnoses.iter().flat_map(|topic| std::iter::from_fn(|| topic.take()));
        for (message, _) in diagnoses.take(MOST_AT_ONCE) {
            let is_ours = message.status.iter().any(|status| status.hardware_id == self.swarm);
            self.hears_any |= self.has_been_sent && is_ours;
        }
    }

    fn send_ranges(&mut self, _now: f64, measured: &[Range]) -> Result<(), EdgeError> {
        for (observer, message) in ranges::messages(measured, &self.names, &self.frame_id) {
            if let Some(topic) = self.ranges.get(observer) {
                topic.publish(&message)?;
            }
        }
        Ok(())
    }

    fn send(&mut self, now: f64, poses: &[(usize, Pose)]) -> Result<(), EdgeError> {
        let stamp = Time::from_seconds(now);
        if let Some(clock) = &self.clock {
            clock.publish(&Clock { clock: stamp })?;
        }
        if let Poses::Array(topic) = &self.poses {
            return arrays(poses, self.names.len(), &self.frame_id)
                .iter()
                .try_for_each(|all| topic.publish(all));
        }
        for (m, pose) in poses {
            let (header, pose) = said(pose, &self.frame_id);
            match &self.poses {
                Poses::Stamped(all) => all[*m].publish(&PoseStamped { header, pose })?,
                Poses::WithCovariance(all) => {
                    all[*m].publish(&PoseWithCovarianceStamped { header, pose: pose.into() })?;
                }
                Poses::Odometry(all) => {
                    let (child_frame_id, pose) = (self.frames[*m].clone(), pose.into());
                    all[*m].publish(&Odometry { header, child_frame_id, pose, ..Odometry::default() })?;
                }
                Poses::Array(_) => {}
            }
        }
        Ok(())
    }
}

/// Poses in arrays, the oldest first: each of those with one stamp and frame, and nowhere for the robots that sent none.
fn arrays(poses: &[(usize, Pose)], count: usize, frame_id: &str) -> Vec<PoseArray> {
    let mut arrays: Vec<PoseArray> = Vec::new();
    for &(m, ref pose) in poses {
        let (header, pose) = said(pose, frame_id);
        // What comes twice is sent twice.
        let has_room = |array: &PoseArray| array.header == header && array.poses[m].is_nowhere();
        let place = arrays.iter().position(has_room).unwrap_or_else(|| {
            arrays.push(PoseArray { header, poses: vec![geometry_msgs::Pose::nowhere(); count] });
            arrays.len() - 1
        });
        arrays[place].poses[m] = pose;
    }
    arrays.sort_by(|a, b| a.header.stamp.seconds().total_cmp(&b.header.stamp.seconds()));
    arrays
}

const PUBLISH_CLOCK: &str = "publish_clock";

/// The parameters of the robots, with what the arguments give the node of this name.
fn declare(arguments: &RosArguments, names: &Names) -> Result<Store, NodeError> {
    let publish_clock = Declaration::new(PUBLISH_CLOCK, false)
        .read_only()
        .describe("publish the simulation's time on /clock, from 0 s on");
    settings::store(vec![publish_clock], &arguments.parameters_for(&names.fully_qualified()))
}

/// The names of the nodes to which the robots belong: one for all, or one for each.
fn owners(formation: &Formation, arguments: &RosArguments, layout: Layout) -> Result<Vec<Names>, NodeError> {
    match layout {
        Layout::OneNode => Ok(vec![arguments.names(NAME, "/")?]),
        Layout::NodePerRobot => {
            formation.names.iter().map(|robot| Ok(arguments.names("robot", "/")?.of_robot(robot)?)).collect()
        }
    }
}

/// Refuses topics of the robots with two uses, or with one of those that there are.
fn check_topics(
    raw: &RawSwarm,
    formation: &Formation,
    topic: TopicOf<'_>,
    mut uses: Uses,
) -> Result<(), NodeError> {
    let (has_ranges, raw) = (raw.ranges.is_some(), &raw.node);
    for (m, robot) in formation.names.iter().enumerate() {
        if m == 0 || !raw.has_target_array() {
            uses.add(topic(&raw.target_topic, m)?, "targets", robot)?;
        }
        if m == 0 || raw.pose_type != RawPoseType::PoseArray {
            uses.add(topic(&raw.pose_topic, m)?, "poses", robot)?;
        }
        if has_ranges {
            uses.add(topic(&raw.ranges_topic, m)?, "ranges", robot)?;
        }
    }
    Ok(())
}

/// A publisher for each robot, on the node and the topic that are the robot's.
fn each<'a, M: Message>(
    count: usize,
    pose: &dyn Fn(usize) -> Result<(&'a Node, String), NodeError>,
) -> Result<Vec<Publisher<M>>, NodeError> {
    let open = |m| {
        let (node, topic) = pose(m)?;
        Ok(node.publisher(&topic, Quality::BEST_EFFORT)?)
    };
    (0..count).map(open).collect()
}
