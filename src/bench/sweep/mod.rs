//! How fast the rules are swept, beside what the memory allows and what plain code does.
//!
//! The roofline is that of one step at a time: 48 bytes a particle in double precision, being two coordinates of
//! which each is read once (its neighbours' are in cache by then), written once, and read once more
//! because a store first fetches its cache line; index lists are read besides. It is drawn from the triad's bandwidth
//! *moved*, which counts that fetch as well. Bodies that a cache holds, and several steps taken together, may lie above it.
//!
//! Everything is timed in turn within one run, so that a neighbour's load on the machine hits all alike.

mod bodies;
mod capabilities;
mod table;

use rayon::{ThreadPoolBuildError, ThreadPoolBuilder};
use serde::Serialize;

use super::machine::{Bandwidth, processor, time_triad};
use crate::solve::stopwatch::median;
use crate::sweep::chosen_here;
use bodies::Subject;
pub use capabilities::{Capability, measure as measure_capabilities};

const THREADS: [usize; 2] = [1, 2];

/// The amount of work of a measurement.
struct Effort {
    /// Particles along each side of the square bodies.
    sides: &'static [usize],
    /// The same of the bodies that are swept by other rules, and by lists.
    other: usize,
    /// The same of the bodies that the engine steps.
    engine: usize,
    /// Elements of the triad's arrays.
    triad: usize,
    repetitions: usize,
    /// Time of one repetition \[s\]; a single step may take longer.
    seconds: f64,
}

const FULL: Effort = Effort {
    sides: &[12, 256, 1024, 4096],
    other: 1024,
    // Odd, so that it does not depend on where the arrays happen to lie whether a column's neighbours are aligned.
    engine: 509,
    triad: 1 << 24,
    repetitions: 9,
    seconds: 0.06,
};

const QUICK: Effort =
    Effort { sides: &[12, 256], other: 64, engine: 32, triad: 1 << 16, repetitions: 3, seconds: 1e-3 };

/// The machine and the sweeps on it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Whether this was the quick run, whose times mean little.
    pub quick: bool,
    /// The processor's name, where the system says.
    pub processor: Option<String>,
    /// The vectors and bands that were chosen for it.
    pub chosen: String,
    /// One entry for each number of threads: the median over the whole run.
    pub triad: Vec<Bandwidth>,
    /// Every body with every way to sweep it, on every number of threads.
    pub cases: Vec<Case>,
    /// The cost of a step of the engine over the bare loops, and that of each capability where it is named.
    pub capabilities: Vec<Capability>,
}

/// One body, one way to sweep it, some number of threads.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Case {
    /// The body and the way to sweep it, in words.
    pub subject: &'static str,
    /// `f64` or `f32`.
    pub precision: &'static str,
    /// Particles along each side of the body.
    pub side: usize,
    /// Threads that share the sweep.
    pub threads: usize,
    /// Steps taken together.
    pub steps_together: usize,
    /// Particles that follow.
    pub followers: usize,
    /// Bonds whose length is looked at in each step.
    pub bonds_watched: usize,
    /// Median over the repetitions \[s\].
    pub seconds_per_step: f64,
    /// Followers over the time of a step \[1/s\].
    pub updates_per_second: f64,
    /// Bytes that an update moves when no cache holds the body.
    pub bytes_per_update: f64,
    /// Of the updates per second that the triad's bandwidth would allow \[1\], going by those passes of
    /// the triad that were taken in turn with this body's repetitions.
    pub share_of_roofline: f64,
}

/// Measures the sweeps; takes about two minutes and 2 GB, or next to nothing if quick.
///
/// # Errors
/// If the system refuses to start the threads.
pub fn run(quick: bool) -> Result<Report, ThreadPoolBuildError> {
    let effort = if quick { &QUICK } else { &FULL };
    let mut report = Report {
        quick,
        processor: processor(),
        chosen: chosen_here(),
        triad: Vec::new(),
        cases: Vec::new(),
        capabilities: Vec::new(),
    };
    let mut triad = Triad::new(effort.triad);
    let pools: Vec<_> = THREADS
        .iter()
        .map(|&threads| Ok((threads, ThreadPoolBuilder::new().num_threads(threads).build()?)))
        .collect::<Result<_, ThreadPoolBuildError>>()?;
    let mut passes = vec![Vec::new(); pools.len()];
    for make in bodies::all(effort.sides, effort.other) {
        let mut subject = make();
        for ((threads, pool), passes) in pools.iter().zip(&mut passes) {
            if *threads == 1 || subject.is_shared {
                pool.install(|| report.measure(*threads, effort, &mut subject, &mut triad, passes));
            }
        }
    }
    for ((threads, _), mut passes) in pools.iter().zip(passes) {
        report.triad.push(Bandwidth::of_passes(effort.triad, *threads, &mut passes));
    }
    let (_, single) = &pools[0];
    report.capabilities =
        single.install(|| measure_capabilities(effort.engine, effort.repetitions, effort.seconds));
    Ok(report)
}

impl Report {
    fn measure(
        &mut self,
        threads: usize,
        effort: &Effort,
        subject: &mut Subject,
        triad: &mut Triad,
        passes: &mut Vec<f64>,
    ) {
        let steps = subject.steps_in(effort.seconds);
        let (mut beside, mut times): (Vec<f64>, Vec<f64>) =
            (0..effort.repetitions).map(|_| (triad.time(), subject.time(steps))).unzip();
        passes.extend_from_slice(&beside);
        let bandwidth = Bandwidth::of_passes(effort.triad, threads, &mut beside);
        let seconds_per_step = median(&mut times);
        let updates_per_second = subject.followers as f64 / seconds_per_step;
        self.cases.push(Case {
            subject: subject.name,
            precision: "f64",
            side: subject.side,
            threads,
            steps_together: subject.steps_together,
            followers: subject.followers,
            bonds_watched: subject.bonds_watched,
            seconds_per_step,
            updates_per_second,
            bytes_per_update: subject.bytes_per_update,
            share_of_roofline: updates_per_second * subject.bytes_per_update
                / bandwidth.moved_bytes_per_second,
        });
    }
}

/// The arrays of the triad.
struct Triad([Vec<f64>; 3]);

impl Triad {
    fn new(elements: usize) -> Self {
        Self([0.0, 1.0, 2.0].map(|value| vec![value; elements]))
    }

    fn time(&mut self) -> f64 {
        let [a, b, c] = &mut self.0;
        time_triad(a, b, c)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quick_run_measures_every_subject_and_capability() {
        let report = run(true).expect("threads");
        let json = serde_json::to_value(&report).expect("plain numbers");
        for case in json["cases"].as_array().expect("cases") {
            for key in ["seconds_per_step", "updates_per_second", "share_of_roofline", "bytes_per_update"] {
                assert!(case[key].as_f64().expect("a number") > 0.0, "{key} of {case}");
            }
        }
        let is_there = |name: &str, side, threads| {
            report.cases.iter().any(|c| c.subject == name && c.side == side && c.threads == threads)
        };
        assert!(is_there(bodies::PLAIN, 12, 1) && is_there(bodies::PLAIN, 256, 2));
        for name in [bodies::LOOP, bodies::EIGHT, bodies::MATERIAL, bodies::INTACT, bodies::CRACKED] {
            assert!(report.cases.iter().any(|case| case.subject == name), "{name}");
        }
        assert!(report.capabilities.len() > 6);
        let words = report.to_string();
        assert!(words.contains("256 x 256") && words.contains("nothing named"), "{words}");
    }
}
