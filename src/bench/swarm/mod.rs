//! The costs of a swarm: robots served by a thread, the control loop's tick, and the way over the network.
//!
//! * [`rule`]: neighbour query and rule of all robots, and the same with the safety filter.
//! * [`tick`]: [`Control`](crate::swarm::control::Control)'s whole tick with fresh poses.
//! * [`latency`] (feature `ros`): from a published pose to the received target that answers it.

pub mod latency;
pub mod rule;
pub mod tick;

use std::fmt;

use serde::Serialize;

use super::quick_note;
use crate::scene::SceneError;
use crate::scene::swarm::Swarm;

/// The amount of work of a measurement.
struct Effort {
    robots: &'static [usize],
    /// Robots, and how often the rule is applied in a tick.
    ticks: &'static [(usize, usize)],
    /// Robots, and poses of each that are answered.
    latency: &'static [(usize, usize)],
    repetitions: usize,
    /// Time of one repetition [s]; a single tick may take longer.
    seconds: f64,
}

const FULL: Effort = Effort {
    robots: &[12, 100, 1000, 10_000],
    ticks: &[(12, 1), (100, 1), (100, 200), (1000, 1)],
    latency: &[(1, 500), (50, 100)],
    repetitions: 15,
    seconds: 0.05,
};

const QUICK: Effort = Effort {
    robots: &[12, 100],
    ticks: &[(12, 1), (100, 1)],
    latency: &[(1, 10)],
    repetitions: 3,
    seconds: 1e-3,
};

/// Swarms of several sizes, on one thread.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Whether this was the quick run, whose times mean little.
    pub quick: bool,
    /// Neighbour query and rule, by number of robots.
    pub cases: Vec<rule::Case>,
    /// Whole ticks of the loop, by number of robots.
    pub ticks: Vec<tick::Case>,
    /// The way over the network.
    pub latency: latency::Report,
}

/// Measures; takes about twenty seconds, or a few if quick.
pub fn run(quick: bool) -> Report {
    let effort = if quick { &QUICK } else { &FULL };
    Report {
        quick,
        cases: effort.robots.iter().map(|&robots| rule::measure(robots, effort)).collect(),
        ticks: effort.ticks.iter().map(|&(robots, sweeps)| tick::measure(robots, sweeps, effort)).collect(),
        latency: latency::measure(effort.latency),
    }
}

/// Distance of robots that stand side by side in [`formation`] \[m\]: so near that the filter has to look.
const SPACING: f64 = 0.72;

/// Robots in a square, each with its eight nearest as neighbours; the first is led from outside. They are
/// kept apart, from two discs and inside a fence, and poses are believed wherever they jump.
fn formation(robots: usize, sweeps: usize, period: f64) -> Result<Swarm, SceneError> {
    let columns = (robots as f64).sqrt().ceil() as usize;
    let width = SPACING * columns as f64;
    let one = |k: usize| {
        let [x, y] = [k % columns, k / columns].map(|site| SPACING * site as f64);
        format!("{{ name = \"r{k}\", place = [{x:?}, {y:?}] }},\n")
    };
    let all: String = (0..robots).map(one).collect();
    let links = (robots - 1).min(8);
    let links =
        if links > 0 { format!("[links]\nkind = \"nearest\"\ncount = {links}\n") } else { String::new() };
    let (low, high) = (-4.0, width + 4.0);
    let text = format!(
        r#"
title = "A square of robots"
radius = 0.2
robots = [
{all}]
{links}
[[leaders]]
robots = ["r0"]
program = {{ kind = "external" }}

[[obstacles]]
kind = "disc"
centre = [{beside:?}, -1.5]
radius = 0.5

[[obstacles]]
kind = "disc"
centre = [-1.5, {beside:?}]
radius = 0.5

[limits]
speed = 1.0
clearance = 0.3
geofence = [[{low:?}, {low:?}], [{high:?}, {low:?}], [{high:?}, {high:?}], [{low:?}, {high:?}]]

[control]
period = {period:?}
sweeps = {sweeps}

[poses]
fresh = 4.0
age_limit = 5.0
stop_after = 9.0
jump_speed = 1e6
recover = 1

[node]
markers = false
"#,
        beside = 0.5 * width,
    );
    Swarm::parse("bench", "the benchmark's swarm", &text, &[], None)
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rule = "query and rule";
        let safe = "with the safety filter";
        writeln!(f, "{:>7}  {:>10}  {rule:>27}  {safe:>27}", "robots", "neighbours")?;
        for case in &self.cases {
            writeln!(
                f,
                "{:>7}  {:>10.1}  {:>10.1} us {:>8.0} / ms  {:>10.1} us {:>8.0} / ms",
                case.robots,
                case.neighbours,
                1e6 * case.rule_seconds_per_tick,
                case.rule_robots_per_millisecond,
                1e6 * case.safe_seconds_per_tick,
                case.safe_robots_per_millisecond,
            )?;
        }
        writeln!(f, "\nOne thread; time of a tick for all robots, and robots served in a millisecond.\n")?;
        writeln!(f, "Whole control tick, poses received, filter included, settled prediction not:")?;
        for case in &self.ticks {
            let (ms, rate) = (1e3 * case.seconds_per_tick, case.robots_per_millisecond);
            let (robots, sweeps) = (case.robots, case.sweeps);
            writeln!(f, "{robots:>7} robots  {sweeps:>4} sweeps a tick  {ms:>9.4} ms {rate:>8.0} / ms")?;
        }
        writeln!(f, "\nPose in to target out over loopback:\n{}", self.latency)?;
        quick_note(self.quick, f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quick_run_serves_two_swarms_with_and_without_the_filter() {
        let report = run(true);
        let json = serde_json::to_value(&report).expect("plain numbers");
        let robots: Vec<_> = report.cases.iter().map(|case| case.robots).collect();
        assert_eq!(robots, [12, 100]);
        for case in json["cases"].as_array().expect("cases") {
            for key in ["rule_robots_per_millisecond", "safe_robots_per_millisecond"] {
                assert!(case[key].as_f64().expect("a number") > 0.0, "{key}");
            }
        }
        assert_eq!(report.ticks.len(), 2);
        assert!(report.ticks.iter().all(|case| case.seconds_per_tick > 0.0));
        assert!(report.to_string().contains("100"));
    }
}
