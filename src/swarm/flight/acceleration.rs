//! The accelerations of robots, held against their limit.
//!
//! A robot that takes no time to brake keeps its cell first: where a border of it comes too fast, the limit gives way.

use serde::Serialize;

use super::moment::Extreme;
use super::{Flight, Moment};
use crate::swarm::safety::Flags;

/// More than the limit by this share is rounding \[1\].
const ROUNDING: f64 = 1e-6;

/// The changes of velocity of robots without a fault, from period to period.
#[derive(Clone, Debug, Default)]
pub struct Accelerations {
    /// \[m/s^2\]
    limit: f64,
    /// At the end of the last period \[m/s\].
    velocities: Vec<[f64; 2]>,
    /// Whether a robot has had no fault in the last period.
    was_sound: Vec<bool>,
    largest: Option<Extreme>,
    exceeded: usize,
    /// How often each robot exceeded it.
    by_robot: Vec<usize>,
    /// How often for each of [`REASONS`].
    for_reason: [usize; 3],
}

/// What a robot is kept clear of before it keeps its acceleration, and its name.
const REASONS: [(u32, &str); 3] =
    [(Flags::SEPARATED, "other robots"), (Flags::OBSTRUCTED, "obstacles"), (Flags::GEOFENCED, "the fence")];

/// How far the limit of acceleration was kept.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AccelerationReport {
    /// The limit \[m/s^2\].
    pub limit: f64,
    /// Largest change of a robot's velocity from one period to the next, over the period \[m/s^2\].
    pub largest: f64,
    /// The robot that had it, when and where.
    pub worst: Moment,
    /// Periods of single robots in which it was above the limit.
    pub exceeded: usize,
    /// Robots that were above it at some time.
    pub robots: usize,
    /// How many of those periods had a way that was cut or bent by other robots.
    pub for_robots: usize,
    /// The same by an obstacle.
    pub for_obstacles: usize,
    /// The same by the fence.
    pub for_fence: usize,
}

impl Accelerations {
    /// For robots with a limit \[m/s^2\].
    pub fn new(limit: f64, flight: &Flight) -> Self {
        let robots = flight.fleet().robots();
        Self {
            limit,
            velocities: robots.iter().map(|robot| robot.velocity).collect(),
            was_sound: vec![true; robots.len()],
            by_robot: vec![0; robots.len()],
            ..Self::default()
        }
    }

    /// Takes in the period just flown, `period` \[s\] long.
    pub fn take(&mut self, flight: &Flight, period: f64) {
        let fleet = flight.fleet();
        for (member, robot) in fleet.robots().iter().enumerate() {
            let before = std::mem::replace(&mut self.velocities[member], robot.velocity);
            let is_sound = fleet.is_sound(member);
            let counts = std::mem::replace(&mut self.was_sound[member], is_sound) && is_sound;
            let value = (robot.velocity[0] - before[0]).hypot(robot.velocity[1] - before[1]) / period;
            if !counts {
                continue;
            }
            if self.largest.is_none_or(|largest| value > largest.value) {
                let (time, place, other) = (fleet.time(), robot.position, None);
                self.largest = Some(Extreme { value, member, other, time, place });
            }
            if value > self.limit * (1.0 + ROUNDING) {
                self.exceeded += 1;
                self.by_robot[member] += 1;
                let flags = flight.control().flags(member);
                for (count, (flag, _)) in self.for_reason.iter_mut().zip(REASONS) {
                    *count += usize::from(flags & flag != 0);
                }
            }
        }
    }

    /// With the robots by name; `None` where none was ever without a fault.
    pub fn report(&self, names: &[String]) -> Option<AccelerationReport> {
        let [for_robots, for_obstacles, for_fence] = self.for_reason;
        let largest = self.largest?;
        Some(AccelerationReport {
            limit: self.limit,
            largest: largest.value,
            worst: largest.named(names),
            exceeded: self.exceeded,
            robots: self.by_robot.iter().filter(|&&times| times > 0).count(),
            for_robots,
            for_obstacles,
            for_fence,
        })
    }
}

impl AccelerationReport {
    /// In words; `number` writes accelerations. A way may be cut by several things at once, and a unicycle that stops to turn is
    /// cut by none.
    pub fn words(&self, number: impl Fn(f64) -> String) -> String {
        let largest = format!("{} m/s^2: {}", number(self.largest), self.worst);
        let limit = number(self.limit);
        if self.exceeded == 0 {
            return format!("{largest}; robots without a fault kept the limit of {limit}");
        }
        let counts = [self.for_robots, self.for_obstacles, self.for_fence];
        let reasons = counts.iter().zip(REASONS).filter(|(count, _)| **count > 0);
        let reasons: Vec<String> =
            reasons.map(|(count, (_, name))| format!("by {name} in {count}")).collect();
        let cut = if reasons.is_empty() { String::new() } else { format!(", cut {}", reasons.join(", ")) };
        format!(
            "{largest}; robots without a fault ({} of them) were above the limit of {limit} in {} steps of a period{cut}",
            self.robots, self.exceeded
        )
    }
}
