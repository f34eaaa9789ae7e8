//! Simulated robots with their channels and faults; their targets come from outside.

use super::faults::{self, Fault};
use super::rangefinders::Rangefinders;
use crate::flock::vectors::Vectors;
use crate::scene::SceneError;
use crate::scene::swarm::Swarm;
use crate::scene::swarm::raw::{RawFaultKind, RawModel, RawSwarm};
use crate::swarm::channel::{Channel, ChannelParams};
use crate::swarm::formation::Formation;
use crate::swarm::robots::{DoubleIntegrator, Integrator, Model, Robot, Unicycle};
use crate::swarm::transport::Received;
use crate::swarm::watch::Pose;

/// Robots by number, and the periods they have flown.
#[derive(Clone)]
pub struct Fleet {
    robots: Vec<Robot>,
    channels: Vec<Channel>,
    faults: Vec<Fault>,
    rangefinders: Option<Rangefinders>,
    model: Model,
    /// \[s\]
    dt: f64,
    period: u64,
}

impl Fleet {
    /// # Errors
    /// Names a robot that the swarm does not have.
    pub fn new(swarm: &Swarm, formation: &Formation) -> Result<Self, SceneError> {
        let raw = &swarm.raw;
        let robots: Vec<Robot> = formation.starts(swarm)?.iter().map(|place| Robot::at(place, 0.0)).collect();
        let params = ChannelParams::of(&raw.flight);
        Ok(Self {
            channels: (0..robots.len()).map(|m| Channel::new(params, raw.flight.seed, m)).collect(),
            faults: faults::of(swarm, formation)?,
            rangefinders: raw
                .ranges
                .as_ref()
                .map(|one| Rangefinders::new(one, raw.flight.seed, robots.len())),
            model: model(raw),
            dt: raw.control.period,
            period: 0,
            robots,
        })
    }

    /// True states of the robots, shape \[members\].
    pub fn robots(&self) -> &[Robot] {
        &self.robots
    }

    /// Continues with the states of the robots after so many periods; surplus states are ignored.
    pub fn restore(&mut self, robots: &[Robot], period: u64) {
        self.robots.iter_mut().zip(robots).for_each(|(robot, kept)| *robot = *kept);
        self.period = period;
    }

    /// The model by which every robot moves.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Periods flown.
    pub fn period(&self) -> u64 {
        self.period
    }

    /// Time flown \[s\].
    pub fn time(&self) -> f64 {
        self.period as f64 * self.dt
    }

    /// The robots' places \[m\].
    pub fn places(&self) -> Vectors {
        self.robots.iter().map(|robot| robot.position).collect()
    }

    /// Whether the robot has no fault now.
    pub fn is_sound(&self, member: usize) -> bool {
        self.fault(member).is_none()
    }

    /// Whether the robot has a fault, or had one.
    pub(super) fn had_fault(&self, member: usize) -> bool {
        self.faults.iter().any(|fault| fault.member == member && fault.has_begun(self.time()))
    }

    /// Whether the robot moves at all now.
    fn is_able(&self, member: usize) -> bool {
        !self.fault(member).is_some_and(Fault::stands)
    }

    /// The kind of a robot's present fault, as its file calls it.
    pub fn fault_name(&self, member: usize) -> Option<&'static str> {
        self.fault(member).map(Fault::name)
    }

    /// Gives a robot a fault from now on, of which it has this one alone.
    pub fn break_down(&mut self, member: usize, kind: RawFaultKind) {
        self.mend(member);
        self.faults.push(Fault::from_now(member, self.time(), kind));
    }

    /// Ends the present faults of a robot.
    pub fn mend(&mut self, member: usize) {
        let now = self.time();
        self.faults.iter_mut().filter(|fault| fault.member == member).for_each(|fault| fault.end(now));
    }

    /// The longest that a pose is under way at present \[s\].
    pub(super) fn longest_delay(&self) -> f64 {
        let periods = |channel: &Channel| channel.params().delay + channel.params().jitter;
        f64::from(self.channels.iter().map(periods).max().unwrap_or(0)) * self.dt
    }

    /// Noise \[m\], delay \[period\] and loss \[1\] with which poses are sent.
    #[cfg(feature = "live")]
    pub(crate) fn channel(&self) -> (f64, u32, f64) {
        let params = self.channels.first().map(Channel::params).unwrap_or_default();
        (params.noise, params.delay, params.loss)
    }

    /// Sends poses with this noise \[m\], delay \[period\] and loss \[1\] from now on.
    pub(super) fn set_channels(&mut self, noise: f64, delay: u32, loss: f64) {
        for channel in &mut self.channels {
            channel.set_params(ChannelParams { noise, delay, loss, ..channel.params() });
        }
    }

    /// Every robot sends the ranges that it measures, then its pose, stamped with `stamp` \[s\]; `hear` receives what
    /// arrives now.
    pub fn send(&mut self, stamp: f64, hear: &mut dyn FnMut(Received)) {
        self.send_ranges(stamp, hear);
        for m in 0..self.robots.len() {
            let fault = self.fault(m).map(|fault| fault.kind.clone());
            let Robot { position, yaw, .. } = self.robots[m];
            let channel = &mut self.channels[m];
            channel.set_fault(fault);
            channel.send(self.period, Pose { position, yaw, stamp, frame_is_right: true });
            channel.deliver(self.period).for_each(|pose| hear(Received::Pose(m, pose)));
        }
    }

    fn send_ranges(&mut self, stamp: f64, hear: &mut dyn FnMut(Received)) {
        let Some(mut rangefinders) = self.rangefinders.take() else { return };
        let sends = |m: usize| !self.fault(m).is_some_and(Fault::is_mute);
        if let Some(channel) = self.channels.first() {
            let measured = (self.places(), stamp);
            rangefinders
                .measure(measured, &channel.params(), sends, &mut |range| hear(Received::Range(range)));
        }
        self.rangefinders = Some(rangefinders);
    }

    /// Every robot goes towards its target \[m\] for one period; those without one come to rest.
    pub fn go(&mut self, target: impl Fn(usize) -> Option<[f64; 2]>) {
        for m in 0..self.robots.len() {
            if self.is_able(m) {
                let target = target(m).unwrap_or(self.robots[m].position);
                self.robots[m].step(&self.model, target, self.dt);
            } else {
                self.robots[m].velocity = [0.0; 2];
            }
        }
        self.period += 1;
    }

    /// The robot's present fault; of several the last in the file.
    fn fault(&self, member: usize) -> Option<&Fault> {
        let now = self.time();
        self.faults.iter().rev().find(|fault| fault.member == member && fault.holds(now))
    }
}

fn model(raw: &RawSwarm) -> Model {
    let speed = raw.limits.speed.unwrap_or(f64::INFINITY);
    match raw.flight.model {
        RawModel::Ideal => Model::Ideal,
        RawModel::Integrator => Model::Integrator(Integrator { speed }),
        RawModel::Unicycle { turn_rate } => {
            // A target lies no farther than speed and, from rest, acceleration lead in a period: to stand still there would
            // be to stand for ever.
            let period = raw.control.period;
            let from_rest = raw.limits.acceleration.unwrap_or(f64::INFINITY) * period.powi(2);
            let tolerance = Unicycle::default().tolerance.min(0.1 * from_rest.min(speed * period));
            Model::Unicycle(Unicycle { speed, turn_rate: turn_rate.to_radians(), tolerance })
        }
        RawModel::DoubleIntegrator => Model::DoubleIntegrator(DoubleIntegrator {
            speed,
            acceleration: raw.limits.acceleration.unwrap_or(f64::INFINITY),
        }),
    }
}
