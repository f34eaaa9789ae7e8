//! The control loop's whole tick: a fresh pose of every member received, then the tick.

use std::hint::black_box;

use serde::Serialize;

use super::{Effort, formation};
use crate::bench::machine::seconds_each;
use crate::solve::stopwatch::median;
use crate::swarm::control::Control;
use crate::swarm::watch::Pose;

/// One formation; the median over the repetitions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Case {
    /// Robots of the formation.
    pub robots: usize,
    /// How often the rule is applied in a tick, at most.
    pub sweeps: usize,
    /// All poses received, and the tick \[s\].
    pub seconds_per_tick: f64,
    /// Robots that one thread serves in a millisecond \[1/ms\].
    pub robots_per_millisecond: f64,
}

/// Of a tick [s].
const PERIOD: f64 = 0.05;

/// How far robots are from their places, at most [m]: so that none stands where the rule wants it.
const ASIDE: f64 = 0.03;

pub(super) fn measure(robots: usize, sweeps: usize, effort: &Effort) -> Case {
    let mut served = Loop::new(robots, sweeps);
    let ticks = (effort.seconds / served.time(8)).clamp(1.0, 1e6) as usize;
    let mut times: Vec<f64> = (0..effort.repetitions).map(|_| served.time(ticks)).collect();
    let seconds_per_tick = median(&mut times);
    Case { robots, sweeps, seconds_per_tick, robots_per_millisecond: 1e-3 * robots as f64 / seconds_per_tick }
}

struct Loop {
    control: Control,
    tick: u64,
}

impl Loop {
    fn new(robots: usize, sweeps: usize) -> Self {
        let swarm = formation(robots, sweeps, PERIOD).expect("the file is valid");
        Self { control: Control::new(&swarm).expect("the formation can be laid out"), tick: 0 }
    }

    /// Seconds per tick over some ticks.
    fn time(&mut self, ticks: usize) -> f64 {
        seconds_each(ticks, || (0..ticks).for_each(|_| self.serve()))
    }

    fn serve(&mut self) {
        self.tick += 1;
        let now = self.tick as f64 * PERIOD;
        for member in 0..self.control.formation().count() {
            let [x, y] = self.control.formation().places.get(member);
            // Another place at every tick, without a random number for each.
            let aside = ASIDE * ((self.tick * 7 + member as u64 * 13) % 17) as f64 / 16.0;
            let pose = Pose { position: [x + aside, y - aside], yaw: 0.0, stamp: now, frame_is_right: true };
            self.control.receive(member, pose, now).expect("a good pose");
        }
        self.control.tick(now);
        black_box(self.control.target(0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::swarm::watch::Health;

    #[test]
    fn everybody_is_heard_and_gets_a_target_that_the_tick_made_safe() {
        let mut served = Loop::new(12, 1);
        (0..3).for_each(|_| served.serve());
        let control = &served.control;
        for member in 0..12 {
            assert_eq!(control.health(member), Health::Fresh, "{member}");
            assert!(control.target(member).is_some(), "{member}");
        }
        let wants = |&m: &usize| control.position(m).is_some_and(|here| here != control.wanted(m));
        assert!((0..12).filter(wants).count() > 10);
        let cut = |served: &Loop| (0..12).filter(|&m| served.control.flags(m) != 0).count();
        let cuts: usize = (0..17)
            .map(|_| {
                served.serve();
                cut(&served)
            })
            .sum();
        assert!(cuts > 17, "{cuts} of 204 ways");
    }
}
