//! A simulated flight: robots, channels and the control loop in one process, without middleware, deterministic.
//!
//! A period goes: every robot says where it is, the channels deliver what they deliver, the control ticks, every
//! robot goes towards its target. That is what a real swarm's period is, so what holds here is tested
//! through the tick that flies.

mod faults;
mod measure;
mod report;

use std::ops::ControlFlow;

use super::channel::{Channel, ChannelParams};
use super::control::Control;
use super::robots::{DoubleIntegrator, Integrator, Model, Robot, Unicycle};
use super::watch::Pose;
use crate::continuum::engine::Engine;
use crate::continuum::plan::Plan;
use crate::flock::points::{Points, distance};
use crate::scene::SceneError;
use crate::scene::swarm::raw::{RawModel, RawSwarm};
use crate::scene::swarm::{Shape, Swarm};
use faults::Fault;

pub use measure::{Record, Sample};
pub use report::{FlightReport, RobotReport, Verdict};

/// Robots under way. Members by number, as everywhere in this room.
pub struct Flight {
    control: Control,
    robots: Vec<Robot>,
    channels: Vec<Channel>,
    faults: Vec<Fault>,
    model: Model,
    periods: u64,
    period: u64,
    /// The same scene as a continuum, stepped beside the flight.
    continuum: Option<(Box<Engine>, Vec<usize>)>,
}

impl Flight {
    /// # Errors
    /// Names the key of the swarm that cannot be laid out, kept safe or flown.
    pub fn new(swarm: &Swarm) -> Result<Self, SceneError> {
        let control = Control::new(swarm)?;
        let formation = control.formation();
        let raw = &swarm.raw;
        let mut robots: Vec<Robot> = formation.places.iter().map(|place| Robot::at(place, 0.0)).collect();
        for (k, start) in raw.flight.start.iter().enumerate() {
            let m = faults::member(swarm, formation, &format!("flight.start[{k}].robot"), &start.robot)?;
            robots[m].position = start.place;
        }
        let params = ChannelParams {
            noise: raw.flight.noise,
            delay: raw.flight.delay,
            jitter: raw.flight.jitter,
            loss: raw.flight.loss,
            duplication: raw.flight.duplicates,
            ..ChannelParams::default()
        };
        Ok(Self {
            channels: (0..robots.len()).map(|m| Channel::new(params, raw.flight.seed, m)).collect(),
            faults: faults::of(swarm, formation)?,
            model: model(raw),
            periods: periods(swarm, &control),
            period: 0,
            continuum: continuum(swarm)?,
            robots,
            control,
        })
    }

    pub fn control(&self) -> &Control {
        &self.control
    }

    pub fn control_mut(&mut self) -> &mut Control {
        &mut self.control
    }

    pub fn robots(&self) -> &[Robot] {
        &self.robots
    }

    /// How many periods the flight takes.
    pub fn periods(&self) -> u64 {
        self.periods
    }

    /// Periods flown.
    pub fn period(&self) -> u64 {
        self.period
    }

    /// Time flown \[s\].
    pub fn time(&self) -> f64 {
        self.period as f64 * self.control.period()
    }

    /// Whether the robot moves at all now.
    pub fn is_able(&self, member: usize) -> bool {
        let now = self.time();
        !self.faults.iter().any(|fault| fault.member == member && fault.holds(now) && fault.stands())
    }

    /// Flies one period.
    pub fn step(&mut self) {
        let (now, dt) = (self.time(), self.control.period());
        for (m, channel) in self.channels.iter_mut().enumerate() {
            let fault = self.faults.iter().rev().find(|fault| fault.member == m && fault.holds(now));
            channel.set_sender(fault.map(Fault::sender).unwrap_or_default());
            let Robot { position, yaw, .. } = self.robots[m];
            let frame_is_right = !fault.is_some_and(Fault::is_in_wrong_frame);
            channel.send(self.period, Pose { position, yaw, stamp: now, frame_is_right });
            for pose in channel.deliver(self.period) {
                // What is turned away is counted by the watch.
                let _ = self.control.receive(m, pose, now);
            }
        }
        self.control.tick(now);
        for m in 0..self.robots.len() {
            if self.is_able(m) {
                let target = self.control.target(m).unwrap_or(self.robots[m].position);
                self.robots[m].step(&self.model, target, dt);
            } else {
                self.robots[m].velocity = [0.0; 2];
            }
        }
        if let Some((engine, _)) = &mut self.continuum {
            engine.advance();
        }
        self.period += 1;
    }

    /// Largest distance of a robot from its particle in the continuum run of the same scene \[m\].
    pub fn continuum_error(&self) -> Option<f64> {
        let (engine, particles) = self.continuum.as_ref()?;
        let apart = |(robot, &i): (&Robot, &usize)| distance(robot.position, engine.present().get(i));
        Some(self.robots.iter().zip(particles).map(apart).fold(0.0, f64::max))
    }

    /// Where the robots are \[m\].
    pub fn places(&self) -> Points {
        self.robots.iter().map(|robot| robot.position).collect()
    }
}

/// Flies a swarm to the end, or until `watch` breaks it off.
///
/// # Errors
/// As [`Flight::new`].
pub fn fly(
    swarm: &Swarm,
    watch: &mut dyn FnMut(&Flight, &Sample) -> ControlFlow<()>,
) -> Result<(Record, FlightReport), SceneError> {
    let mut flight = Flight::new(swarm)?;
    let mut record = Record::new(swarm, &flight);
    while flight.period() < flight.periods() {
        let before = flight.places();
        flight.step();
        let sample = record.take(&flight, &before);
        if watch(&flight, &sample).is_break() {
            break;
        }
    }
    let report = FlightReport::new(swarm, &flight, &record);
    Ok((record, report))
}

fn model(raw: &RawSwarm) -> Model {
    let speed = raw.limits.speed.unwrap_or(f64::INFINITY);
    match raw.flight.model {
        RawModel::Ideal => Model::Ideal,
        RawModel::Integrator => Model::Integrator(Integrator { speed }),
        RawModel::Unicycle { turn_rate } => {
            Model::Unicycle(Unicycle { speed, turn_rate: turn_rate.to_radians(), ..Unicycle::default() })
        }
        RawModel::DoubleIntegrator => Model::DoubleIntegrator(DoubleIntegrator {
            speed,
            acceleration: raw.limits.acceleration.unwrap_or(f64::INFINITY),
        }),
    }
}

/// As long as the file says; else as many periods as the scene has steps, or until some time after the programs.
fn periods(swarm: &Swarm, control: &Control) -> u64 {
    /// \[s\]
    const AFTER_THE_PROGRAMS: f64 = 10.0;
    if let Some(duration) = swarm.raw.flight.duration {
        return (duration / control.period()).round().max(1.0) as u64;
    }
    match (&swarm.shape, control.formation().steps()) {
        (_, Some(steps)) => steps as u64,
        (Shape::Scene(scene) | Shape::Inside(scene), None) => scene.stop.steps as u64,
        _ => {
            let end = control.formation().programs_end();
            let end = if end.is_finite() { end } else { 0.0 };
            ((end + AFTER_THE_PROGRAMS) / control.period()).ceil() as u64
        }
    }
}

/// The run that the flight is held against, and the particle of each member.
fn continuum(swarm: &Swarm) -> Result<Option<(Box<Engine>, Vec<usize>)>, SceneError> {
    let Shape::Scene(scene) = &swarm.shape else { return Ok(None) };
    let plan = Plan::new(scene)?;
    let particles = (0..plan.count()).filter(|&i| !plan.body.is_frame[i]).collect();
    Ok(Some((Box::new(Engine::new(plan)), particles)))
}
