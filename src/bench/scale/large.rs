//! Large bodies on ranks: sweeps beside as many threads of one process, and equilibria beside one rank alone.

use std::thread::sleep;
use std::time::{Duration, Instant};

use rayon::{ThreadPoolBuildError, ThreadPoolBuilder};
use serde::Serialize;

use super::super::grid::plan;
use super::ranks::{engine, on_threads, single, step};
use crate::continuum::equilibrium::shared_system;
use crate::continuum::plan::Plan;
use crate::engine::Engine;
use crate::ranks::Team;
use crate::scene::Scene;
use crate::solve::equilibrium::{Choice, Request, Solver, System, solve_shared};
use crate::solve::stopwatch::median;
use crate::sweep::MOST_STEPS;

/// Sizes of what is measured.
pub(super) struct Effort {
    /// Columns and rows of the body that is swept.
    pub swept: [usize; 2],
    /// Cells of the plate that comes to rest, along either side.
    pub solved: usize,
    /// Times that both take turns.
    pub turns: usize,
}

/// The sides of the plate on which ranks come to rest beside one, in cells, and the turns.
pub(super) const FULL: Effort = Effort { swept: [4096, 4096], solved: 1056, turns: 7 };
pub(super) const QUICK: Effort = Effort { swept: [96, 64], solved: 12, turns: 3 };

/// Sweeps by ranks with one thread each, and by as many threads of one process.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BesideThreads {
    /// How many ranks, and how many threads.
    pub ranks: usize,
    /// Columns and rows of particles.
    pub body: [usize; 2],
    /// Most steps that were taken together.
    pub steps_together: usize,
    /// Of the ranks, median \[s\].
    pub seconds_per_step: f64,
    /// Of one process with as many threads, in turn with them, median \[s\].
    pub threads_seconds_per_step: f64,
    /// How many times as fast the ranks are \[1\].
    pub ratio: f64,
}

/// A plate that is clamped on one side and pulled on the other, put to rest by multigrid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AtRest {
    /// Processes or threads that share the solve.
    pub ranks: usize,
    /// Columns and rows of particles.
    pub body: [usize; 2],
    /// Iterations of the ranks.
    pub iterations: usize,
    /// Iterations of one rank alone.
    pub alone_iterations: usize,
    /// Of a solve on all ranks, its preparation included, median \[s\].
    pub seconds: f64,
    /// Of a solve on one rank, in turn with them, median \[s\].
    pub alone_seconds: f64,
    /// How many times as fast as one rank they are \[1\].
    pub speed_up: f64,
}

/// What is done on all ranks: on those of a team, or on threads.
pub(super) fn on<T: Send>(
    ranks: usize,
    team: Option<&Team>,
    work: impl Fn(&Team) -> T + Sync + Send,
) -> Result<T, ThreadPoolBuildError> {
    match team {
        Some(team) => Ok(single()?.install(|| work(team))),
        None => on_threads(ranks, work),
    }
}

/// Takes turns: the first rank does `alone` while the others sleep for as long as it took before, then all do `shared`.
/// Medians of both \[s\].
fn in_turns(team: &Team, turns: usize, mut alone: impl FnMut(), mut shared: impl FnMut()) -> [f64; 2] {
    let (mut of_one, mut of_all, mut lasts) = (Vec::new(), Vec::new(), 0.0);
    for _ in 0..turns {
        let begin = Instant::now();
        if team.is_first() {
            alone();
            lasts = begin.elapsed().as_secs_f64();
            of_one.push(lasts);
        } else {
            // Ranks that wait for a message keep a core busy.
            sleep(Duration::from_secs_f64(0.9 * lasts));
        }
        [lasts] = team.of_first([lasts.to_bits()]).map(f64::from_bits);
        let begin = Instant::now();
        shared();
        team.any(false);
        of_all.push(begin.elapsed().as_secs_f64());
    }
    if of_one.is_empty() {
        of_one.push(f64::NAN);
    }
    [median(&mut of_one), median(&mut of_all)]
}

/// Steps by ranks beside as many threads, one at a time and together.
pub(super) fn beside_threads(
    effort: &Effort,
    ranks: usize,
    team: Option<&Team>,
) -> Result<Vec<BesideThreads>, ThreadPoolBuildError> {
    let plan = plan(effort.swept, &[]);
    let threads = ThreadPoolBuilder::new().num_threads(ranks).build()?;
    let of = |most: usize| {
        let work = |team: &Team| {
            let mut whole: Option<Engine> = team.is_first().then(|| engine(&plan, None));
            let mut parts = engine(&plan, Some(team.clone()));
            let mut alone = || {
                let whole = whole.as_mut().expect("the first rank has it");
                threads.install(|| step(whole, MOST_STEPS, most));
            };
            // The first steps begin where every rank knows the whole body.
            step(&mut parts, MOST_STEPS, most);
            in_turns(team, effort.turns, &mut alone, || step(&mut parts, MOST_STEPS, most))
        };
        let times = on(ranks, team, work)?.map(|seconds| seconds / MOST_STEPS as f64);
        let [threads_seconds_per_step, seconds_per_step] = times;
        let (body, ratio) = (effort.swept, threads_seconds_per_step / seconds_per_step);
        let steps_together = most;
        Ok(BesideThreads { ranks, body, steps_together, seconds_per_step, threads_seconds_per_step, ratio })
    };
    [1, MOST_STEPS].map(of).into_iter().collect()
}

/// A solve on ranks beside the same on one.
pub(super) fn at_rest(
    effort: &Effort,
    ranks: usize,
    team: Option<&Team>,
) -> Result<AtRest, ThreadPoolBuildError> {
    let request = Request { solver: Choice::This(Solver::Multigrid), ..Request::default() };
    let solve = |system: &System, team: Option<&Team>| {
        let solved = solve_shared(system, &request, team);
        solved
            .unwrap_or_else(|error| panic!("the benchmark's own plate has no equilibrium: {error}"))
            .iterations
    };
    let work = |team: &Team| {
        let whole = team.is_first().then(|| plate(effort.solved, None));
        let part = plate(effort.solved, Some(team));
        let (mut of_one, mut of_all) = (0, 0);
        let mut alone = || of_one = solve(whole.as_ref().expect("the first rank has it"), None);
        let times = in_turns(team, effort.turns, &mut alone, || of_all = solve(&part, Some(team)));
        (times, [of_one, of_all])
    };
    let ([alone_seconds, seconds], [alone_iterations, iterations]) = on(ranks, team, work)?;
    let body = [effort.solved + 1; 2];
    let speed_up = alone_seconds / seconds;
    Ok(AtRest { ranks, body, iterations, alone_iterations, seconds, alone_seconds, speed_up })
}

/// The whole plate, or of a team the part of this rank.
fn plate(cells: usize, team: Option<&Team>) -> System {
    let text = format!(
        r#"
title = "A plate that is pulled"
lattice = {{ kind = "square", spacing = 1.0 }}
body.shape = {{ kind = "rectangle", max = [{cells}.0, {cells}.0] }}
material = {{ kind = "isotropic", young = 1000.0, poisson = 0.3 }}
rule.mean = {{ kind = "material" }}
loads = [{{ kind = "traction", region = {{ kind = "edge", side = "right" }}, traction = [1.0, 0.0] }}]
roles = [{{ region = {{ kind = "edge", side = "left" }}, role = "clamped" }}]
equilibrium = {{ solver = "multigrid" }}
"#
    );
    let scene = Scene::parse("plate", "plate", &text, &[], None);
    let of_scene = |scene: Scene| {
        let plan = team.map_or_else(|| Plan::new(&scene), |team| Plan::of_part(&scene, team))?;
        shared_system(&scene, &plan, team, plan.stop.steps as f64)
    };
    let system = scene.and_then(of_scene);
    system.unwrap_or_else(|error| panic!("the benchmark's own scene is refused: {error}"))
}
