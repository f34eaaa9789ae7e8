//! The messages that the node of a simulated flight would receive and send.

use super::RecordError;
use super::topics::single_topics;
use crate::messages::builtin_interfaces::Time;
use crate::messages::flockform_msgs::LoopEvent;
use crate::messages::formation::diagnostics::{self, Statistics};
use crate::messages::formation::pose::said;
use crate::messages::formation::{NAME, markers, ranges, state};
use crate::messages::geometry_msgs::{self, PoseStamped, PoseWithCovarianceStamped};
use crate::messages::names::{NameError, Names};
use crate::messages::nav_msgs::Odometry;
use crate::messages::recorder::{MessageRecorder, RecordSink};
use crate::messages::std_msgs::Header;
use crate::scene::swarm::Swarm;
use crate::scene::swarm::raw::RawPoseType;
use crate::swarm::control::Control;
use crate::swarm::transport::{Received, target_of};
use crate::swarm::watch::{Pose, Range};

/// States and markers a second, as of a node with default parameters \[Hz\].
const STATES: f64 = 10.0;
const DIAGNOSTICS: f64 = 1.0;

/// Writes down a flight, period by period.
pub struct FlightMessages {
    recorder: MessageRecorder,
    /// Fully qualified name of the node.
    node: String,
    swarm: Swarm,
    /// Topics of the robots, by number.
    poses: Vec<String>,
    ranges: Vec<String>,
    targets: Vec<String>,
    /// Topics of the node.
    state: String,
    markers: String,
    diagnostics: String,
    heard: Vec<(usize, Pose)>,
    measured: Vec<Range>,
    statistics: Statistics,
    begun: bool,
}

impl FlightMessages {
    /// # Errors
    /// A robot whose name no topic can have.
    pub fn new(swarm: &Swarm, control: &Control, sink: RecordSink) -> Result<Self, RecordError> {
        let names = Names::new(NAME, "/", &[])?;
        let raw = &swarm.raw.node;
        let [poses, targets] = single_topics(raw);
        let of_robots = |pattern: &str| -> Result<Vec<String>, NameError> {
            let all = control.formation().names.iter();
            all.map(|name| names.robot_topic(pattern, name)).collect()
        };
        Ok(Self {
            recorder: MessageRecorder::new(&names, &raw.frame_id, sink)?,
            poses: of_robots(&poses)?,
            ranges: of_robots(&raw.ranges_topic)?,
            targets: of_robots(&targets)?,
            state: names.topic("~/state")?,
            markers: names.topic("~/markers")?,
            diagnostics: names.topic("/diagnostics")?,
            node: names.fully_qualified(),
            swarm: swarm.clone(),
            heard: Vec::new(),
            measured: Vec::new(),
            statistics: Statistics::default(),
            begun: false,
        })
    }

    /// A pose or a range that the channels have delivered; leaders are moved by commands of the file.
    pub fn receive(&mut self, received: Received) {
        match received {
            Received::Pose(member, pose) => self.heard.push((member, pose)),
            Received::Range(range) => self.measured.push(range),
            Received::Leader(..) => {}
        }
    }

    /// A period that was computed at `now` \[s\].
    pub fn tick(&mut self, control: &Control, now: f64) {
        if !std::mem::replace(&mut self.begun, true) {
            self.recorder.parameters(now, control);
            self.recorder.event(now, LoopEvent::ACTIVE, "", &[]);
        }
        let measured = std::mem::take(&mut self.measured);
        let names = &control.formation().names;
        for (observer, message) in ranges::messages(&measured, names, &self.swarm.raw.node.frame_id) {
            self.recorder.take_received(&self.ranges[observer], &message, [now; 2]);
        }
        for (member, pose) in std::mem::take(&mut self.heard) {
            self.pose(member, &pose, now);
        }
        self.recorder.event(now, LoopEvent::TICK, "", &[now]);
        let header =
            || Header { stamp: Time::from_seconds(now), frame_id: self.swarm.raw.node.frame_id.clone() };
        for (member, topic) in self.targets.iter().enumerate() {
            if let Some(target) = target_of(control, member) {
                let pose = geometry_msgs::Pose::planar(target.position, target.yaw);
                self.recorder.take(topic, &PoseStamped { header: header(), pose }, [now; 2]);
            }
        }
        // A simulated tick takes no time of the flight, and what it takes of ours is another every time.
        self.statistics.tick(0.0);
        if self.statistics.is_due(diagnostics::STATE, now, STATES) {
            let message = state::message(control, &self.swarm.name, header(), 0.0);
            self.recorder.take(&self.state, &message, [now; 2]);
            let message = markers::message(control, &self.swarm.raw, &header());
            self.recorder.take(&self.markers, &message, [now; 2]);
        }
        if self.statistics.is_due(diagnostics::DIAGNOSTICS, now, DIAGNOSTICS) {
            let names = [self.node.as_str(), &self.swarm.name];
            let message = self.statistics.message(control, names, header(), 0, true, &[]);
            self.recorder.take(&self.diagnostics, &message, [now; 2]);
        }
    }

    fn pose(&mut self, member: usize, pose: &Pose, now: f64) {
        let raw = &self.swarm.raw.node;
        let (header, pose) = said(pose, &raw.frame_id);
        let (recorder, topic, times) = (&mut self.recorder, &self.poses[member], [now; 2]);
        match raw.pose_type {
            RawPoseType::PoseStamped | RawPoseType::PoseArray => {
                recorder.take_received(topic, &PoseStamped { header, pose }, times);
            }
            RawPoseType::PoseWithCovarianceStamped => {
                let message = PoseWithCovarianceStamped { header, pose: pose.into() };
                recorder.take_received(topic, &message, times);
            }
            RawPoseType::Odometry => {
                let message = Odometry { header, pose: pose.into(), ..Odometry::default() };
                recorder.take_received(topic, &message, times);
            }
        }
    }
}
