//! Neighbour query and rule, and the same with the safety filter.
//!
//! The robots stand about a unit apart in places shaken from a lattice, numbered without any order, and
//! see those within 1.9 units: about ten. Their targets come from the very function that moves
//! particles. With the filter, all are led to far beyond the reach of a tick and the speed is such that
//! the filter has to look at the same ten, and to project onto a cell of as many half-planes.

use std::hint::black_box;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde::Serialize;

use super::Effort;
use crate::bench::machine::seconds_each;
use crate::flock::grid::CellGrid;
use crate::flock::law::{Flock, Weights};
use crate::flock::neighbourhood::Neighbours;
use crate::flock::rules::Rule;
use crate::flock::vectors::Vectors;
use crate::solve::stopwatch::median;
use crate::swarm::safety::{Filter, Flags, Limits, Obstacles, Seen};

/// How far robots see [m].
const SIGHT: f64 = 1.9;

/// Their radius [m].
const RADIUS: f64 = 0.1;

/// [m]
const CLEARANCE: f64 = 0.05;

/// Of a tick [s].
const PERIOD: f64 = 0.1;

/// Makes the filter look as far as the robots see [m/s].
const SPEED: f64 = (SIGHT - 2.0 * RADIUS - CLEARANCE) / (2.0 * PERIOD);

/// How far beyond their targets all are led [m].
const LED: f64 = 10.0;

/// Sets of places that are served in turn, so that no tick is the repetition of the one before.
const SETS: usize = 8;

/// One swarm; medians over the repetitions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Case {
    /// Robots of the swarm.
    pub robots: usize,
    /// Neighbours of a robot, on average \[1\].
    pub neighbours: f64,
    /// Neighbour query and rule of all robots \[s\].
    pub rule_seconds_per_tick: f64,
    /// Robots that one thread serves in a millisecond \[1/ms\].
    pub rule_robots_per_millisecond: f64,
    /// The same with the safety filter \[s\].
    pub safe_seconds_per_tick: f64,
    /// Robots that one thread serves in a millisecond with the safety filter \[1/ms\].
    pub safe_robots_per_millisecond: f64,
}

pub(super) fn measure(robots: usize, effort: &Effort) -> Case {
    let mut swarm = Swarm::new(robots);
    let ticks = swarm.ticks_in(effort.seconds);
    // In turn, so that another's load on the machine hits both alike.
    let (mut rule, mut safe): (Vec<f64>, Vec<f64>) =
        (0..effort.repetitions).map(|_| (swarm.time(ticks, false), swarm.time(ticks, true))).unzip();
    let (rule, safe) = (median(&mut rule), median(&mut safe));
    let per_millisecond = |seconds: f64| 1e-3 * robots as f64 / seconds;
    Case {
        robots,
        neighbours: swarm.flock.neighbours.index.len() as f64 / robots as f64,
        rule_seconds_per_tick: rule,
        rule_robots_per_millisecond: per_millisecond(rule),
        safe_seconds_per_tick: safe,
        safe_robots_per_millisecond: per_millisecond(safe),
    }
}

struct Swarm {
    places: Vec<Vectors>,
    flock: Flock,
    grid: CellGrid,
    members: Vec<bool>,
    ages: Vec<f64>,
    wanted: Vectors,
    filter: Filter,
    safe: Vectors,
    flags: Vec<Flags>,
    tick: usize,
}

impl Swarm {
    fn new(robots: usize) -> Self {
        let mut random = Pcg64Mcg::seed_from_u64(robots as u64);
        let side = (robots as f64).sqrt().ceil() as usize;
        let mut sites: Vec<usize> = (0..robots).collect();
        for k in (1..robots).rev() {
            sites.swap(k, random.random_range(0..=k));
        }
        let mut shaken = |site: usize| site as f64 + random.random_range(-0.35..0.35);
        let places: Vec<Vectors> = (0..SETS)
            .map(|_| sites.iter().map(|&site| [shaken(site / side), shaken(site % side)]).collect())
            .collect();
        let limits = Limits { speed: SPEED, clearance: CLEARANCE, ..Limits::default() };
        let filter = Filter::new(limits, vec![RADIUS; robots], Obstacles::default());
        Self {
            flock: Flock::new(
                Rule::BARYCENTRE,
                places[0].clone().into(),
                Neighbours::default(),
                Weights::Equal,
            ),
            grid: CellGrid::default(),
            members: vec![true; robots],
            ages: vec![0.0; robots],
            wanted: Vectors::zeros(robots),
            filter: filter.expect("the numbers above are in range"),
            safe: Vectors::zeros(robots),
            flags: vec![Flags::default(); robots],
            places,
            tick: 0,
        }
    }

    /// A small swarm's tick is too short for the clock: as many as fill the time.
    fn ticks_in(&mut self, seconds: f64) -> usize {
        self.time(SETS, true);
        (seconds / self.time(SETS, true)).clamp(1.0, 1e6) as usize
    }

    /// Seconds per tick over some ticks.
    fn time(&mut self, ticks: usize, filtered: bool) -> f64 {
        seconds_each(ticks, || (0..ticks).for_each(|_| self.serve(filtered)))
    }

    fn serve(&mut self, filtered: bool) {
        self.tick += 1;
        let present = &self.places[self.tick % SETS];
        self.flock.neighbours.rebuild_within(&mut self.grid, present, &self.members, SIGHT);
        let led = if filtered { LED } else { 0.0 };
        for robot in 0..present.len() {
            let [x, y] = self.flock.target(robot, present);
            self.wanted.set(robot, [x + led, y]);
        }
        if filtered {
            let seen = Seen { present, known: &self.members, ages: &self.ages, velocity: None, strays: None };
            self.filter.apply(&seen, &self.wanted, PERIOD, &mut self.safe, &mut self.flags);
            black_box(&self.safe);
        }
        black_box(&self.wanted);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn robots_see_about_ten_and_the_filter_changes_what_they_want() {
        let mut swarm = Swarm::new(1000);
        swarm.serve(true);
        let neighbours = swarm.flock.neighbours.index.len();
        assert!((9000..10_500).contains(&neighbours), "{neighbours}");
        assert!(swarm.flags.iter().all(|flags| flags.has(Flags::SPEED_LIMITED)));
        assert!(swarm.flags.iter().filter(|flags| flags.has(Flags::SEPARATED)).count() > 500);
    }
}
