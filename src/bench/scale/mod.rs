//! How a body scales over ranks: measured on those of this computer, counted on 64, predicted for 4,096.
//!
//! * **strong**: the same body on more ranks. **weak**: as many columns for each rank. Both take turns with one rank alone,
//!   and every rank has one thread. Without a launcher ranks are threads of this process; under `mpirun` they are processes.
//! * **at rest**: one equilibrium, by multigrid on ranks and on one. **large**, if asked for: that of 1056 by 1056 cells, and
//!   sweeps of 4096 by 4096 particles beside as many threads of one process.
//! * **counted**: messages, bytes and updates of small bodies on up to 64 ranks, beside those of the [`model`].
//! * **predicted**: the model with the cost of an update and of a message as they were measured here, and with the messages of
//!   a network that is assumed.

pub mod large;
pub mod model;
mod ranks;
mod table;

use std::thread::available_parallelism;

use rayon::ThreadPoolBuildError;
use serde::Serialize;

use self::large::{AtRest, BesideThreads};
use self::model::{Grid, Link, Model};
use self::ranks::{Tally, on_threads};
use super::grid::plan;
use super::machine::processor;
use crate::continuum::plan::Plan;
use crate::ranks::Team;
use crate::solve::stopwatch::median;

/// Options of the measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Small bodies and few repetitions, to see that it runs; the times mean little.
    pub quick: bool,
    /// Most ranks that are timed where they are threads; as many as there are cores, at most eight, unless given.
    pub ranks: Option<usize>,
    /// Two ranks, or those of the team, on large bodies as well, which take several GB and minutes.
    pub large: bool,
}

/// The amount of work that [`Options`] stand for.
struct Effort {
    /// Columns and rows of the body that is shared.
    strong: [usize; 2],
    /// Columns and rows for each rank.
    weak: [usize; 2],
    /// Times that one rank and all take turns, and for how long \[s\].
    turns: (usize, f64),
    /// Messages by which a link is measured.
    messages: usize,
    /// The plate that comes to rest on each number of ranks.
    at_rest: large::Effort,
}

const FULL: Effort = Effort {
    strong: [1536, 1536],
    weak: [1024, 1024],
    turns: (9, 0.25),
    messages: 401,
    at_rest: large::Effort { solved: 400, turns: 5, ..large::FULL },
};

const QUICK: Effort =
    Effort { strong: [96, 64], weak: [48, 64], turns: (3, 1e-3), messages: 11, at_rest: large::QUICK };

/// Ranks on which is counted.
const COUNTED: [usize; 7] = [1, 2, 4, 8, 16, 32, 64];
/// Columns of each of these ranks, rows, and steps that are counted.
const SMALL: ([usize; 2], usize) = ([48, 8], 64);

/// Ranks for which efficiencies are predicted, the body that they share, and that of each.
const PREDICTED: [usize; 6] = [1, 4, 16, 64, 512, 4096];
const LARGE: [usize; 2] = [16_384, 16_384];
const LARGE_EACH: [usize; 2] = [1024, 4096];

/// Columns of a band of a body this large: see `sweep::rows`.
const BAND: usize = 3;

/// Everything that was measured, counted and predicted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Whether this was the quick run, whose times mean little.
    pub quick: bool,
    /// The processor's name, where the system says.
    pub processor: Option<String>,
    /// Cores that this process may use.
    pub cores: usize,
    /// `threads` or `processes`.
    pub ranks_are: &'static str,
    /// Inputs of the model.
    pub model: Model,
    /// The same body on more ranks.
    pub strong: Vec<Case>,
    /// As much of a body for each rank.
    pub weak: Vec<Case>,
    /// One equilibrium on more ranks.
    pub at_rest: Vec<AtRest>,
    /// Sweeps of a large body beside threads, where they were asked for.
    pub beside_threads: Vec<BesideThreads>,
    /// Counts of small bodies, beside the model's.
    pub counted: Vec<Counted>,
    /// The body of `strong_efficiency` in what is predicted: columns, rows.
    pub predicted_body: [usize; 2],
    /// The part of a rank in `weak_efficiency`: columns, rows.
    pub predicted_part: [usize; 2],
    /// Efficiencies by the model.
    pub predicted: Vec<Predicted>,
}

/// A body on some ranks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Case {
    /// Processes or threads that share it.
    pub ranks: usize,
    /// Columns and rows of particles.
    pub body: [usize; 2],
    /// Of all ranks together, median \[s\].
    pub seconds_per_step: f64,
    /// Of one rank alone with the same body (strong) or with its part (weak), in turn with it, median \[s\].
    pub alone_seconds_per_step: f64,
    /// The share of the ranks' time that one alone would have needed \[1\].
    pub efficiency: f64,
    /// Share of the time that the rank that waited longest was in exchanges, waiting for slower ones included \[1\].
    pub share_in_exchange: f64,
    /// The model's \[s\].
    pub predicted_seconds_per_step: f64,
}

/// Counts of the rank that has most, per step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Counted {
    /// Threads that shared the body.
    pub ranks: usize,
    /// Columns and rows of particles.
    pub body: [usize; 2],
    /// Messages, bytes and updates that were counted.
    pub counted: Counts,
    /// The same by the model.
    pub predicted: Counts,
}

/// Of one rank, per step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Counts {
    /// Messages that it waited for.
    pub messages: f64,
    /// Bytes that it was sent.
    pub bytes: f64,
    /// Followers of its own that it moved.
    pub updates: f64,
}

/// Efficiencies that were not measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Predicted {
    /// How many ranks.
    pub ranks: usize,
    /// With the messages that were measured here \[1\].
    pub strong_efficiency: f64,
    /// The same for as much of a body each \[1\].
    pub weak_efficiency: f64,
    /// With the messages of a network, [`Link::NETWORK`] \[1\].
    pub strong_efficiency_on_network: f64,
    /// The same for as much of a body each \[1\].
    pub weak_efficiency_on_network: f64,
}

/// Measures on threads of this process, or on the processes of a team, all of which must call it; takes about a minute.
///
/// # Errors
/// If the system refuses to start the threads.
pub fn run(options: &Options, team: Option<&Team>) -> Result<Report, ThreadPoolBuildError> {
    let effort = if options.quick { &QUICK } else { &FULL };
    let cores = available_parallelism().map_or(1, usize::from);
    let most = options.ranks.unwrap_or(cores.min(8)).max(2);
    let mut counts: Vec<usize> = (1..).map(|k| 1 << k).take_while(|&ranks| ranks < most).collect();
    counts.push(most);
    let link = |team: &Team| ranks::link(team, effort.messages);
    let link = team.map_or_else(|| on_threads(2, link), |team| Ok(link(team)))?;
    let (mut strong, mut weak, mut at_rest) = (Vec::new(), Vec::new(), Vec::new());
    for ranks in team.map_or(counts, |team| vec![team.count()]) {
        strong.push(measured(effort, [effort.strong; 2], ranks, team)?);
        let [columns, rows] = effort.weak;
        weak.push(measured(effort, [effort.weak, [columns * ranks, rows]], ranks, team)?);
        at_rest.push(large::at_rest(&effort.at_rest, ranks, team)?);
    }
    let mut beside_threads = Vec::new();
    if options.large {
        let (sizes, ranks) =
            (if options.quick { &large::QUICK } else { &large::FULL }, team.map_or(2, Team::count));
        beside_threads = large::beside_threads(sizes, ranks, team)?;
        at_rest.push(large::at_rest(sizes, ranks, team)?);
    }
    let model = Model { update_seconds: update_seconds(&weak), link };
    for case in strong.iter_mut().chain(&mut weak) {
        case.predicted_seconds_per_step = model.seconds(&grid(case.body).load(case.ranks));
    }
    let counted = COUNTED.map(counted).into_iter().collect::<Result<_, _>>()?;
    let predicted = PREDICTED.map(|ranks| Predicted::new(ranks, &model)).into();
    Ok(Report {
        quick: options.quick,
        processor: processor(),
        cores,
        ranks_are: if team.is_some() { "processes" } else { "threads" },
        model,
        strong,
        weak,
        at_rest,
        beside_threads,
        counted,
        predicted_body: LARGE,
        predicted_part: LARGE_EACH,
        predicted,
    })
}

fn grid([columns, rows]: [usize; 2]) -> Grid {
    Grid { columns, rows, band: BAND }
}

/// Of one rank alone with a part, the median of all cases.
fn update_seconds(weak: &[Case]) -> f64 {
    let of = |case: &Case| {
        let [columns, rows] = case.body;
        case.alone_seconds_per_step / grid([columns / case.ranks, rows]).load(1).updates
    };
    median(&mut weak.iter().map(of).collect::<Vec<f64>>())
}

/// A case; its prediction comes later.
fn measured(
    effort: &Effort,
    [alone, shared]: [[usize; 2]; 2],
    ranks: usize,
    team: Option<&Team>,
) -> Result<Case, ThreadPoolBuildError> {
    let plans: [Plan; 2] = [alone, shared].map(|size| plan(size, &[]));
    let work = |team: &Team| ranks::time(team, plans.each_ref(), effort.turns);
    let times = large::on(ranks, team, work)?;
    let times_as_large = (shared[0] / alone[0]) as f64;
    Ok(Case {
        ranks,
        body: shared,
        seconds_per_step: times.shared,
        alone_seconds_per_step: times.alone,
        efficiency: times_as_large * times.alone / (ranks as f64 * times.shared),
        share_in_exchange: times.in_exchange,
        predicted_seconds_per_step: f64::NAN,
    })
}

/// Counts on ranks that are threads, as many as may be.
fn counted(ranks: usize) -> Result<Counted, ThreadPoolBuildError> {
    let ([columns, rows], steps) = SMALL;
    let body = [columns * ranks, rows];
    let plan = plan(body, &[]);
    let (Tally { messages, bytes, .. }, updates) =
        on_threads(ranks, |team| ranks::count(team, &plan, steps))?;
    let each = |count: u64| count as f64 / steps as f64;
    let counted = Counts { messages: each(messages), bytes: each(bytes), updates: each(updates) };
    let load = grid(body).load(ranks);
    let predicted = Counts { messages: load.messages, bytes: load.bytes, updates: load.updates };
    Ok(Counted { ranks, body, counted, predicted })
}

impl Predicted {
    fn new(ranks: usize, here: &Model) -> Self {
        let network = Model { link: Link::NETWORK, ..*here };
        let (body, part) = (grid(LARGE), grid(LARGE_EACH));
        Self {
            ranks,
            strong_efficiency: here.strong_efficiency(&body, ranks),
            weak_efficiency: here.weak_efficiency(&part, ranks),
            strong_efficiency_on_network: network.strong_efficiency(&body, ranks),
            weak_efficiency_on_network: network.weak_efficiency(&part, ranks),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::MOST_STEPS;

    #[test]
    fn what_is_exchanged_is_what_the_model_says_up_to_64_ranks() {
        for ranks in COUNTED {
            let Counted { counted, predicted, .. } = super::counted(ranks).expect("threads");
            assert_eq!(counted.messages, predicted.messages, "{ranks} ranks");
            assert_eq!(counted.bytes, predicted.bytes, "{ranks} ranks");
            // The model gives each rank whole bands; ends of the body have held columns.
            let off = counted.updates / predicted.updates;
            assert!((0.93..=1.0).contains(&off), "{ranks} ranks: {counted:?}, {predicted:?}");
        }
    }

    #[test]
    fn a_quick_run_measures_all_and_says_what_is_predicted() {
        let options = Options { quick: true, ranks: Some(3), large: true };
        let report = run(&options, None).expect("threads");
        assert_eq!(report.at_rest.iter().map(|one| one.ranks).collect::<Vec<_>>(), [2, 3, 2]);
        assert!(
            report.at_rest.iter().all(|one| one.iterations == one.alone_iterations && one.speed_up > 0.0)
        );
        let together: Vec<usize> = report.beside_threads.iter().map(|one| one.steps_together).collect();
        assert_eq!(together, [1, MOST_STEPS]);
        let ranks: Vec<usize> = report.strong.iter().map(|case| case.ranks).collect();
        assert_eq!(ranks, [2, 3]);
        for case in report.strong.iter().chain(&report.weak) {
            assert!(case.seconds_per_step > 0.0 && case.efficiency > 0.0, "{case:?}");
            assert!(case.predicted_seconds_per_step > 0.0 && case.share_in_exchange < 1.0, "{case:?}");
        }
        assert!(report.model.link.latency_seconds > 0.0 && report.model.link.bytes_per_second > 1e6);
        assert_eq!(report.predicted[0].strong_efficiency, 1.0);
        let json = serde_json::to_value(&report).expect("plain numbers");
        assert!(json["counted"][6]["predicted"]["bytes"].as_f64() > Some(0.0));
        let words = report.to_string();
        assert!(words.contains("4096") && words.contains("assumed") && words.contains("threads"), "{words}");
    }
}
