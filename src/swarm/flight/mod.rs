//! A simulated flight: robots, channels and the control loop in one process, without middleware, deterministic.
//!
//! In a period every robot sends its pose, the channels deliver, the control ticks, and every robot goes towards
//! its target. A real swarm's period is the same, so a simulated flight tests the tick that flies real robots.

mod acceleration;
mod alarms;
mod beginning;
pub(crate) mod commands;
mod faults;
mod fleet;
mod measurable;
mod measure;
mod moment;
mod rangefinders;
mod report;

use std::ops::ControlFlow;

use super::control::Control;
use super::robots::Robot;
use super::transport::Received;
use crate::continuum::plan::Plan;
use crate::engine::Engine;
use crate::flock::rounding::at_most;
use crate::flock::vectors::distance;
use crate::scene::SceneError;
use crate::scene::swarm::raw::RawCommand;
use crate::scene::swarm::{Shape, Swarm};
pub use acceleration::AccelerationReport;
pub use alarms::Alarm;
pub(super) use faults::lasts;
pub use fleet::Fleet;
pub use measure::{Record, Sample};
pub use moment::Moment;
pub use report::{FlightReport, RobotReport, Verdict};

/// The continuum run of the scene that is flown.
#[derive(Clone)]
struct Twin {
    engine: Engine,
    /// Particle of each member.
    particles: Vec<usize>,
}

/// Robots under way. Members by number, as everywhere in this room.
#[derive(Clone)]
pub struct Flight {
    control: Control,
    fleet: Fleet,
    periods: u64,
    /// The same scene as a continuum, stepped beside the flight.
    continuum: Option<Twin>,
    /// By ascending period.
    commands: Vec<RawCommand>,
}

impl Flight {
    /// # Errors
    /// Names the key of the swarm that cannot be laid out, kept safe or flown, a robot that starts in something
    /// solid, a bound that cannot be measured.
    pub fn new(swarm: &Swarm) -> Result<Self, SceneError> {
        let control = Control::new(swarm)?;
        let flight = Self {
            fleet: Fleet::new(swarm, control.formation())?,
            periods: periods(swarm, &control)?,
            continuum: continuum(swarm)?,
            commands: swarm.raw.flight.commands.clone(),
            control,
        };
        commands::check(swarm, &flight.control)?;
        beginning::require_free(swarm, &flight)?;
        measurable::require(swarm, &flight)?;
        Ok(flight)
    }

    /// The loop that flies the robots.
    pub fn control(&self) -> &Control {
        &self.control
    }

    /// The same, to be stopped, restored or given other limits.
    pub fn control_mut(&mut self) -> &mut Control {
        &mut self.control
    }

    /// The robots as they are, with their channels and faults.
    pub fn fleet(&self) -> &Fleet {
        &self.fleet
    }

    /// The same, to be given faults.
    pub fn fleet_mut(&mut self) -> &mut Fleet {
        &mut self.fleet
    }

    /// The number of periods of the flight.
    pub fn periods(&self) -> u64 {
        self.periods
    }

    /// Flies one period.
    pub fn step(&mut self) {
        self.step_with_observer(&mut |_| {});
    }

    /// Flies one period; `hear` receives what the control receives.
    pub(crate) fn step_with_observer(&mut self, hear: &mut dyn FnMut(Received)) {
        let now = self.fleet.time();
        self.perform_due();
        let control = &mut self.control;
        self.fleet.send(now, &mut |received| {
            hear(received);
            // The watch counts rejected poses.
            let _ = control.take(received, now);
        });
        self.control.tick(now);
        self.fleet.go(|member| self.control.target(member));
        if let Some(twin) = &mut self.continuum {
            twin.engine.advance();
        }
    }

    /// Whether a member's pose cannot be used. Before its first one has arrived a member is not lost, but late: until it
    /// would be too old, counted from when the first may arrive.
    pub(super) fn is_lost(&self, member: usize) -> bool {
        let watch = self.control.watch();
        let counts = watch.counts(member);
        let has_sent = counts.accepted + counts.rejected() > 0;
        let is_late = at_most(self.fleet.time(), self.fleet.longest_delay() + watch.limits().age_limit);
        !self.control.health(member).is_usable() && (has_sent || !is_late)
    }

    /// Largest distance of a robot from its particle in the continuum run of the same scene \[m\].
    pub fn continuum_error(&self) -> Option<f64> {
        let place = self.continuum_places()?;
        let apart = |(m, robot): (usize, &Robot)| distance(place(m), robot.position);
        Some(self.fleet.robots().iter().enumerate().map(apart).fold(0.0, f64::max))
    }

    /// Each robot's place in the continuum run of the same scene \[m\].
    fn continuum_places(&self) -> Option<impl Fn(usize) -> [f64; 2]> {
        let Twin { engine, particles } = self.continuum.as_ref()?;
        Some(|m: usize| engine.present().get(particles[m]))
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
    fly_with_observer(swarm, &mut |_| {}, watch)
}

/// As [`fly`]; `hear` receives what the control receives, before `watch` is called for the period.
///
/// # Errors
/// As [`Flight::new`].
pub fn fly_with_observer(
    swarm: &Swarm,
    hear: &mut dyn FnMut(Received),
    watch: &mut dyn FnMut(&Flight, &Sample) -> ControlFlow<()>,
) -> Result<(Record, FlightReport), SceneError> {
    let mut flight = Flight::new(swarm)?;
    let mut record = Record::new(swarm, &flight);
    while flight.fleet.period() < flight.periods() {
        let before = flight.fleet.places();
        flight.step_with_observer(hear);
        let sample = record.take(&flight, &before);
        if watch(&flight, &sample).is_break() {
            record.end(&flight);
            break;
        }
    }
    let report = FlightReport::new(swarm, &flight, &record);
    Ok((record, report))
}

/// As long as the file states; else as many periods as the scene has steps, or until some time after the programs.
///
/// # Errors
/// Names what makes it too long.
fn periods(swarm: &Swarm, control: &Control) -> Result<u64, SceneError> {
    /// \[s\]
    const AFTER_THE_PROGRAMS: f64 = 10.0;
    /// At a hundred a second more than a day.
    const MOST: f64 = 1e7;
    let (why, periods) = match (swarm.raw.flight.duration, &swarm.shape, control.formation().steps()) {
        (Some(duration), ..) => ("", (duration / control.period()).round().max(1.0)),
        (None, _, Some(steps)) => ("as long as the recorded run it ", steps as f64),
        (None, Shape::Scene(scene) | Shape::Inside(scene), None) => {
            ("as long as the scene's it ", scene.stop.steps as f64)
        }
        _ => {
            let end = control.formation().programs_end();
            let end = if end.is_finite() { end } else { 0.0 };
            ("until the leaders' programs end it ", ((end + AFTER_THE_PROGRAMS) / control.period()).ceil())
        }
    };
    if periods > MOST {
        let message = format!("{why}is {periods:.3e} periods; a flight has {MOST:e} at most");
        let help = "give a shorter time, or a longer control.period";
        return Err(swarm.refuse("flight.duration", message, help));
    }
    Ok(periods as u64)
}

/// The run that the flight is compared with.
fn continuum(swarm: &Swarm) -> Result<Option<Twin>, SceneError> {
    let Shape::Scene(scene) = &swarm.shape else { return Ok(None) };
    let plan = Plan::new(scene)?;
    let particles = plan.setup.body.body_particles().collect();
    Ok(Some(Twin { engine: Engine::new(plan.setup), particles }))
}
