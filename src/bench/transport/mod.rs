//! The cost of carrying poses to another thread and back: our transport beside what it stands on and what people
//! would use instead, in one run.
//!
//! Two threads; one sends a message of so many poses, the other answers with one as large ([`measure`]). Two things
//! are timed:
//!
//! * **hand-off**: the message lies ready in the sender's memory (for shared memory: in a slice of it), and counts as
//!   arrived when the receiver can read it where it lies. Copies and encoding count here.
//! * **filled and read**: writing every pose into the message and adding all of them up at the other side count too.
//!
//! The ways (`ways`, and `dds` with feature `ros`): a channel of the standard library that hands a vector over,
//! iceoryx2 as it comes, our [`shm`](crate::shm) on top of it as the node uses it, a Unix socket, and DDS over loopback
//! as the node uses it (polled every 50 us). No side spins: on shared cores a spinning thread delays the one that it
//! waits for.
//!
//! All but DDS take turns within a size, several times over, so that a busy moment of the computer meets all alike.

#[cfg(feature = "ros")]
mod dds;
pub mod measure;
mod ways;

use std::fmt;

use serde::Serialize;

use super::quick_note;
use crate::shm::payload::Pose;
use measure::{Case, Samples, Work, exchange};

/// The amount of work of a measurement.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Poses in a message.
    sizes: &'static [usize],
    /// Times that the ways take turns; an odd number.
    turns: usize,
    /// Round trips in a turn, at most.
    rounds: usize,
    /// Time of a turn \[s\]; one round trip may take longer.
    seconds: f64,
}

const FULL: Effort = Effort { sizes: &[1, 100, 1000, 10_000, 100_000], turns: 41, rounds: 150, seconds: 0.3 };

const QUICK: Effort = Effort { sizes: &[1, 100], turns: 1, rounds: 20, seconds: 0.2 };

/// Ways over DDS take one turn that is so many times as long: finding each other takes seconds.
#[cfg(feature = "ros")]
const DDS_TURNS: usize = 3;

/// All ways, sizes and kinds of work.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Whether this was the quick run, whose times mean little.
    pub quick: bool,
    /// Size of a pose in shared memory \[byte\].
    pub bytes_per_pose: usize,
    /// Every way with every number of poses and kind of work.
    pub cases: Vec<Case>,
    /// Our transport's median round trip over that of iceoryx2 as it comes: the median over the turns.
    pub ours_over_raw: Vec<Ratio>,
    /// Ways that could not be measured, and why.
    pub skipped: Vec<String>,
}

/// Two ways of one run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Ratio {
    /// The work that is timed.
    pub work: Work,
    /// Poses in a message.
    pub poses: usize,
    /// Round trip of the first way over that of the second, the median over the turns \[1\].
    pub ratio: f64,
}

/// A pose of a round: its number is its member, and every coordinate differs from the others.
fn pose(k: usize) -> Pose {
    Pose { member: k as u32, frame: 0, position: [k as f64, 0.5], yaw: 0.25, stamp: 0.0 }
}

/// Measures; takes about two minutes, or a few seconds if quick.
pub fn run(quick: bool) -> Report {
    let effort = if quick { &QUICK } else { &FULL };
    let mut report = Report {
        quick,
        bytes_per_pose: size_of::<Pose>(),
        cases: Vec::new(),
        ours_over_raw: Vec::new(),
        skipped: Vec::new(),
    };
    for work in Work::ALL {
        for &poses in effort.sizes {
            take_turns(effort, work, poses, &mut report);
        }
    }
    #[cfg(feature = "ros")]
    dds::measure(effort, &mut report);
    report
}

/// All ways of one size, a turn each, over and over.
fn take_turns(effort: &Effort, work: Work, poses: usize, report: &mut Report) {
    let ways = ways::all();
    let mut all: Vec<Samples> = ways.iter().map(|_| Samples::default()).collect();
    for _ in 0..effort.turns {
        for (way, samples) in ways.iter().zip(&mut all) {
            let measured = (way.open)(poses)
                .and_then(|(near, far)| exchange(near, far, work, effort.rounds, effort.seconds, samples));
            if let Err(why) = measured {
                let why = format!("{}, {poses} poses: {why}", way.name);
                if !report.skipped.contains(&why) {
                    report.skipped.push(why);
                }
            }
        }
    }
    let of =
        |name: &str| ways.iter().zip(&all).find_map(|(way, samples)| (way.name == name).then_some(samples));
    let ratio = of(ways::OURS).zip(of(ways::RAW)).and_then(|(ours, raw)| ours.over(raw));
    report.ours_over_raw.extend(ratio.map(|ratio| Ratio { work, poses, ratio }));
    report.cases.extend(ways.iter().zip(all).map(|(way, samples)| samples.case(way.name, work, poses)));
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for work in Work::ALL {
            writeln!(f, "{}\n", work.words())?;
            writeln!(
                f,
                "{:>7}  {:<18} {:>38}  {:>38}  {:>8}",
                "poses",
                "",
                "round trip [us] p50 p90 p99 p99.9",
                "one way [us] p50 p90 p99 p99.9",
                "CPU [us]"
            )?;
            for case in self.cases.iter().filter(|case| case.work == work) {
                let us = |time: Option<f64>| time.map_or("-".into(), |time| format!("{:.1}", 1e6 * time));
                write!(f, "{:>7}  {:<18}", case.poses, case.transport)?;
                for one in [&case.round_trip, &case.one_way] {
                    for time in [one.p50_seconds, one.p90_seconds, one.p99_seconds, one.p999_seconds] {
                        write!(f, " {:>9}", us(time))?;
                    }
                }
                let lost = if case.lost > 0 { format!("  {} lost", case.lost) } else { String::new() };
                writeln!(f, " {:>9}{lost}", us(case.cpu_seconds_per_message))?;
            }
            let ratios: Vec<String> = self
                .ours_over_raw
                .iter()
                .filter(|one| one.work == work)
                .map(|one| format!("{} poses {:.2}", one.poses, one.ratio))
                .collect();
            writeln!(
                f,
                "\nours over iceoryx2, median of {} turns: {}\n",
                if self.quick { QUICK.turns } else { FULL.turns },
                ratios.join(", ")
            )?;
        }
        writeln!(f, "CPU is that of both threads for one message, of which a round trip has two.")?;
        self.skipped.iter().try_for_each(|why| writeln!(f, "not measured: {why}"))?;
        quick_note(self.quick, f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quick_run_measures_every_way_and_its_json_says_so() {
        let report = run(true);
        let json = serde_json::to_value(&report).expect("plain numbers");
        let ways = if cfg!(feature = "ros") { 5 } else { 4 };
        let cases = json["cases"].as_array().expect("cases");
        let no_network = report.skipped.iter().all(|why| why.contains("no DDS participant"));
        assert!(report.skipped.is_empty() || no_network, "{report}");
        assert!(cases.len() == 2 * 2 * ways || no_network && cases.len() >= 2 * 2 * 4, "{report}");
        for case in cases.iter().filter(|case| case["transport"] != "DDS") {
            for times in ["round_trip", "one_way"] {
                let at = |key: &str| case[times][key].as_f64().expect("a number");
                assert!(at("p50_seconds") > 0.0 && at("p50_seconds") <= at("p999_seconds"), "{case}");
            }
            assert_eq!((case["lost"].as_u64(), case["samples"].as_u64()), (Some(0), Some(20)), "{case}");
        }
        assert_eq!(report.ours_over_raw.len(), 4);
        assert!(report.to_string().contains("ours over iceoryx2"));
    }
}
