//! The topics of a configured node: the lifecycle's `configure` opens them, `cleanup` closes them.

use super::drive::Drive;
use super::link::Link;
use super::origin::Origin;
use super::{NodeError, copy};
use crate::messages::flockform_msgs::FormationState;
use crate::messages::formation::diagnostics::Statistics;
use crate::messages::formation::{markers, state};
use crate::messages::visualization_msgs::MarkerArray;
use crate::ros::edge::{Publisher, Quality};
use crate::swarm::control::Control;
use crate::swarm::transport::silence::Silence;

/// Poses in; targets, velocities, state and markers out.
pub(super) struct Endpoints {
    pub link: Link,
    drives: Vec<(usize, Drive)>,
    /// Whether the last velocities were those of an active node.
    is_driving: bool,
    state: Publisher<FormationState>,
    markers: Option<Publisher<MarkerArray>>,
    silence: Silence,
    /// Of their topic, which a recording has in any case.
    markers_name: String,
}

impl Endpoints {
    /// # Errors
    /// A topic that has no legal name, or that the middleware refuses.
    pub fn open(origin: &Origin, control: &Control) -> Result<Self, NodeError> {
        let Origin { node, names, part, swarm, .. } = origin;
        let raw = &swarm.raw.node;
        let topic = |pattern: &str, m: usize| Ok(names.robot_topic(pattern, &control.formation().names[m])?);
        let link = Link::open(node, raw, control, part, origin.simulated_time, &topic)?;
        let mut drives = Vec::new();
        for (m, kind) in part.mine.iter().flat_map(|&m| Some((m, raw.velocity?))) {
            let frame_id = raw.body_frame(names.fleet(), &control.formation().names[m]);
            let topic = topic(&raw.velocity_topic, m)?;
            drives.push((m, Drive::open(node, &topic, kind, &swarm.raw, frame_id)?));
        }
        let markers_name = names.topic("~/markers")?;
        Ok(Self {
            link,
            drives,
            is_driving: false,
            silence: Silence::default(),
            state: node.publisher(&names.topic("~/state")?, Quality::reliable(5))?,
            markers: raw.markers.then(|| node.publisher(&markers_name, Quality::reliable(1))).transpose()?,
            markers_name,
        })
    }

    /// Warns where robots are not heard for some seconds.
    pub fn warn_of_silence(&mut self, control: &Control, origin: &Origin) {
        let topic = |of: &[usize]| match of {
            [one] => origin.pose_topic(*one),
            [first, ..] => format!("{} or any other topic of poses", origin.pose_topic(*first)),
            [] => "any topic of poses".to_owned(),
        };
        self.silence.look(control, &origin.part.heard, &topic);
    }

    /// Velocities towards the targets of an active node at `now` \[s\]; of one that ceases to be, zero once: from then on the robots
    /// are driven by others.
    pub fn drive(&mut self, control: &Control, active: bool, now: f64, statistics: &mut Statistics) {
        if !active && !self.is_driving {
            return;
        }
        self.is_driving = active;
        for (member, drive) in &mut self.drives {
            let target = control.target(*member).filter(|_| active);
            statistics.sent(drive.publish(control, *member, target, now));
        }
    }

    /// Publishes state and markers at `now` \[s\].
    pub fn report(&mut self, control: &Control, origin: &Origin, now: f64, statistics: &mut Statistics) {
        let swarm = &origin.swarm;
        let state = state::message(control, &swarm.name, origin.header(now), statistics.last_tick());
        copy(&mut self.link.recorder, &self.state, &state, now);
        statistics.sent(self.state.publish(&state));
        if self.markers.is_none() && self.link.recorder.is_none() {
            return;
        }
        let markers = markers::message(control, &swarm.raw, &origin.header(now));
        if let Some(recorder) = &mut self.link.recorder {
            recorder.take(&self.markers_name, &markers, [now; 2]);
        }
        if let Some(topic) = &self.markers {
            statistics.sent(topic.publish(&markers));
        }
    }
}
