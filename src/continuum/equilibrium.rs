//! Straight to rest: the equilibrium under the leaders' places at the last step, without stepping there.

mod increments;

use std::ops::ControlFlow;

use super::layout::roles::{held, held_components};
use super::parts::agreed;
use super::plan::Plan;
use super::run::{Outcome, SharedError, StopReason, overflow, run_shared, run_watched};
use crate::engine::Engine;
use crate::engine::observer::{EachStep, Observer};
use crate::engine::setup::Setup;
use crate::engine::shared::Agreed;
use crate::engine::state::EngineState;
use crate::flock::role::Role;
use crate::flock::rules::{FeedbackReference, Rule};
use crate::flock::vectors::{Vectors, distance};
use crate::material::elastic::Elastic;
use crate::ranks::Team;
use crate::scene::{LoadSteps, Scene, SceneError};
use crate::solve::corotated::{self, CorotatedError, Way};
use crate::solve::equilibrium::{Choice, Request, SolveError, Solved, Solver, System, choose};
use crate::solve::linear::{HeldComponent, NotLinear, overshoot, system};
use crate::solve::refined::solve_refined;
use crate::solve::shared::SystemPart;

/// Runs a plan to its end as its scene asks: stepping, or straight to the equilibrium under the whole load or, where the scene has
/// `[load_steps]`, under one part of it after the other, which are its steps then. `see` sees each step of a stepped run as
/// [`run`](super::run::run) shows it, and of a solved one each equilibrium.
///
/// # Errors
/// As [`solve_equilibrium`]; a scene that is stepped has none.
pub fn run_to_equilibrium(
    scene: &Scene,
    plan: Plan,
    see: &mut dyn FnMut(&Engine, f64) -> ControlFlow<()>,
) -> Result<Outcome, SceneError> {
    run_to_equilibrium_watched(scene, plan, &mut EachStep(see))
}

/// The same, seen at those steps alone that the observer names.
///
/// # Errors
/// As [`run_to_equilibrium`].
pub fn run_to_equilibrium_watched(
    scene: &Scene,
    plan: Plan,
    observer: &mut dyn Observer,
) -> Result<Outcome, SceneError> {
    come_to_rest(scene, plan, None, observer)
}

/// Runs a plan to its end as its scene asks, or goes on from a state of a stepped run and the residual that was seen with
/// it; where there is a `team`, shared with the other ranks, which all must have the same scene and plan. The results are
/// those of a run alone, to the bit, on every rank, and the observers are as [`run_shared`] has them.
///
/// # Errors
/// As [`run_to_equilibrium`] and [`run_shared`].
pub fn run_to_equilibrium_shared<'t>(
    scene: &Scene,
    plan: Plan,
    from: Option<(EngineState<'_>, f64)>,
    team: impl Into<Option<&'t Team>>,
    observer: &mut dyn Observer,
) -> Result<Outcome, SharedError> {
    let team = team.into();
    if scene.equilibrium.is_none() || from.is_some() {
        return run_shared(plan, from, team, observer);
    }
    Ok(match team {
        None => come_to_rest(scene, plan, None, observer)?,
        Some(team) => come_to_rest(scene, plan, Some(team), &mut Agreed { team, own: observer })?,
    })
}

fn come_to_rest(
    scene: &Scene,
    plan: Plan,
    team: Option<&Team>,
    observer: &mut dyn Observer,
) -> Result<Outcome, SceneError> {
    match (&scene.equilibrium, &scene.load_steps) {
        (Some(asked), Some(LoadSteps::Solved(parts))) => {
            increments::settle_each((scene, &asked.request, team), plan, parts, observer)
        }
        _ => come_to_whole_load(scene, plan, team, observer),
    }
}

fn come_to_whole_load(
    scene: &Scene,
    plan: Plan,
    team: Option<&Team>,
    observer: &mut dyn Observer,
) -> Result<Outcome, SceneError> {
    let Some(asked) = &scene.equilibrium else { return Ok(run_watched(plan, observer)) };
    let solved = solve_plan(scene, &asked.request, &plan, team)?;
    let outcome = outcome(plan, solved, team);
    // There is nothing left to break off.
    let _ = observer.see(&outcome.engine, outcome.residual);
    Ok(outcome)
}

/// Finds the equilibrium that the scene's `[equilibrium]` asks for.
///
/// # Errors
/// Names what in the scene has no equilibrium, or none that the solver asked for can find.
pub fn solve_equilibrium(scene: &Scene, request: &Request, plan: Plan) -> Result<Outcome, SceneError> {
    let solved = solve_plan(scene, request, &plan, None)?;
    Ok(outcome(plan, solved, None))
}

fn solve_plan(
    scene: &Scene,
    request: &Request,
    plan: &Plan,
    team: Option<&Team>,
) -> Result<Solved, SceneError> {
    if !corotated::is_corotated(&plan.setup.flock) {
        let system = shared_system(scene, plan, team, plan.stop.steps as f64)?;
        return solve_linear(plan, system, request, team).map_err(|error| refuse(scene, &error));
    }
    let steps = steps_of_the_way(plan) as f64;
    let held = |part: f64| way_after(plan, part * steps);
    solve_corotated(plan, &Way::whole(&held), request, team).map_err(|error| refuse_corotated(scene, &error))
}

fn solve_linear(
    plan: &Plan,
    system: System,
    request: &Request,
    team: Option<&Team>,
) -> Result<Solved, SolveError> {
    let follows = |i: usize| plan.setup.roles[i] == Role::Follower;
    solve_refined((&plan.setup.flock, &plan.setup.body, &follows), system, request, team)
}

/// Every rank solves the whole body, or each has a part of it, and all end alike.
fn solve_corotated(
    plan: &Plan,
    way: &Way<'_>,
    request: &Request,
    team: Option<&Team>,
) -> Result<Solved, CorotatedError> {
    const INTERRUPTED: CorotatedError = CorotatedError::Solve(SolveError::Interrupted);
    let (flock, body) = (&plan.setup.flock, &plan.setup.body);
    let parted = team.filter(|_| body.part.is_some());
    let solved = corotated::solve((flock, body), follows(plan), held_axes(plan), way, request, parted);
    let is_interrupted = solved.as_ref().is_err_and(|error| *error == INTERRUPTED);
    if team.is_some_and(|team| team.any(is_interrupted)) { Err(INTERRUPTED) } else { solved }
}

/// The solver that would be taken, and why.
///
/// # Errors
/// As [`solve_equilibrium`], as far as they are known without solving.
pub fn select_solver(scene: &Scene, request: &Request, plan: &Plan) -> Result<(Solver, String), SceneError> {
    if corotated::is_corotated(&plan.setup.flock) {
        let followers = follows(plan).into_iter().filter(|&follows| follows).count();
        return corotated::choose(followers, request).map_err(|error| refuse_corotated(scene, &error));
    }
    Ok(choose(&of_plan(scene, plan)?, request))
}

fn follows(plan: &Plan) -> Vec<bool> {
    plan.setup.roles.iter().map(|&role| role == Role::Follower).collect()
}

/// Steps until the last leader is where it is at the last step.
fn steps_of_the_way(plan: &Plan) -> usize {
    let motions = plan.setup.changes.iter().filter_map(|change| change.motion.as_ref());
    let last = motions.map(|motion| motion.duration().unwrap_or(usize::MAX)).max();
    last.unwrap_or(0).min(plan.stop.steps)
}

/// Displacements of particles that do not follow after so many steps; zero for the others \[length\], shape \[count\].
fn held_after(plan: &Plan, steps: f64) -> Vectors {
    let at_rest = |d: Option<[f64; 2]>| d.unwrap_or_default();
    held(&plan.setup.changes, &plan.setup.body, steps).into_iter().map(at_rest).collect()
}

/// The same with the single components that are held of followers.
fn way_after(plan: &Plan, steps: f64) -> Vectors {
    let mut held = held_after(plan, steps);
    for HeldComponent { particle, axis, displacement } in
        held_components(&plan.setup.changes, &plan.setup.body, steps)
    {
        let mut place = held.get(particle);
        place[axis as usize] = displacement;
        held.set(particle, place);
    }
    held
}

/// Single components that are held of followers, shape \[count\]\[x, y\]; empty without any.
fn held_axes(plan: &Plan) -> Vec<[bool; 2]> {
    let components = held_components(&plan.setup.changes, &plan.setup.body, 0.0);
    let mut axes = vec![[false; 2]; if components.is_empty() { 0 } else { plan.count() }];
    components.iter().for_each(|held| axes[held.particle][held.axis as usize] = true);
    axes
}

/// The linear system of a plan: leaders where they are at the last step.
///
/// # Errors
/// Names the part of the rule that is not linear.
pub fn of_plan(scene: &Scene, plan: &Plan) -> Result<System, SceneError> {
    of_plan_after(scene, plan, plan.stop.steps as f64)
}

/// The same with the leaders where they are after so many steps; of a body in parts this rank's, which all have or none.
pub(crate) fn shared_system(
    scene: &Scene,
    plan: &Plan,
    team: Option<&Team>,
    steps: f64,
) -> Result<System, SceneError> {
    let (body, own) = (&plan.setup.body, of_plan_after(scene, plan, steps));
    let Some(team) = team.filter(|_| body.part.is_some()) else { return own };
    let part = SystemPart { team: team.clone(), first: body.first(), owned: body.owned() };
    Ok(agreed(scene, team, own)?.of_part(part))
}

fn of_plan_after(scene: &Scene, plan: &Plan, steps: f64) -> Result<System, SceneError> {
    let held = held_after(plan, steps);
    let components = held_components(&plan.setup.changes, &plan.setup.body, steps);
    let found = system(&plan.setup.flock, &plan.setup.body, follows(plan), held, &components);
    let mut system = found.map_err(|error| {
        let (key, help) = match error {
            NotLinear::Rule { .. } => {
                ("rule.mean", "leave [equilibrium] out: sweeps find where such a rule comes to rest")
            }
            NotLinear::Broken => ("roles", "leave [equilibrium] out to step with broken bonds"),
            NotLinear::Operator(_) => ("rule", "give weights that are finite"),
        };
        scene.refuse(key, format!("no equilibrium can be solved for: {error}"), help)
    })?;
    system.is_nearly_incompressible = is_nearly_incompressible(scene);
    Ok(system)
}

/// Whether the body's material, or that of one of its inclusions, hardly changes its volume.
pub(super) fn is_nearly_incompressible(scene: &Scene) -> bool {
    let inclusions = scene.inclusions.iter().map(|part| &part.material);
    let mut all = scene.material.iter().chain(inclusions);
    all.any(Elastic::is_nearly_incompressible)
}

fn refuse_corotated(scene: &Scene, error: &CorotatedError) -> SceneError {
    let (key, help) = match error {
        CorotatedError::Solve(error) => return refuse(scene, error),
        CorotatedError::DoubleOnly => ("equilibrium.precision", "use \"f64\", or leave the precision out"),
        CorotatedError::Feedback => match scene.feedback.map(|feedback| feedback.reference) {
            Some(FeedbackReference::Initial) => {
                ("rule.feedback", "leave [equilibrium] out to step there: it moves the place of rest")
            }
            _ => ("rule.feedback", "leave it out: it does not move the place of rest"),
        },
        CorotatedError::Unsettled { cut_short: 1.., .. } => {
            ("equilibrium.most_iterations", "raise it, leave it out, or take equilibrium.solver = \"direct\"")
        }
        CorotatedError::Unsettled { .. } => (
            "equilibrium",
            "load it less, add a small load in the direction in which it may buckle, go there by [load_steps], or leave [equilibrium] out to step \
             there",
        ),
        CorotatedError::NotLinear(_) => ("rule", "leave [equilibrium] out to step"),
    };
    scene.refuse(key, error.to_string(), help)
}

fn refuse(scene: &Scene, error: &SolveError) -> SceneError {
    let is_auto = matches!(&scene.equilibrium, Some(asked) if matches!(asked.request.solver, Choice::Auto));
    let help = match (error, is_auto) {
        (SolveError::DoubleOnly { .. }, _) => {
            "use equilibrium.precision = \"f64\", or equilibrium.solver = \"conjugate-gradients\" or \"multigrid\""
        }
        (SolveError::SinglePrecision { .. }, _) => {
            "use equilibrium.precision = \"f64\", or a larger equilibrium.tolerance"
        }
        (SolveError::NothingFollows, _) => "let particles follow, or leave [equilibrium] out to step",
        (SolveError::Adrift { .. }, _) => "clamp or lead particles of each part of the body",
        (SolveError::Loose { .. }, _) => "clamp or lead it, or give it weights whose sum is positive",
        (SolveError::NotPositive { solver: Solver::Direct, .. }, _) => {
            "add supports, or bring the stiffnesses closer together"
        }
        (SolveError::NotPositive { .. }, false) => {
            "try equilibrium.solver = \"direct\": a factorisation finds out whether the body is stable"
        }
        (_, true) => "try equilibrium.solver = \"direct\", a larger lattice.spacing, or more supports",
        (_, false) => "choose another equilibrium.solver, or equilibrium.solver = \"auto\"",
    };
    // Between -1 and 0 it makes a body only more stable: what is wrong there lies elsewhere.
    let stretch = overshoot(&Rule { feedback: scene.feedback, ..Rule::BARYCENTRE });
    if !(stretch > 0.0 && stretch <= 1.0) {
        let message =
            format!("{error}; feedback from the initial place stretches every displacement by {stretch}");
        let help = "give a factor between -1 and 0, or leave the feedback out";
        return scene.refuse("rule.feedback.factor", message, help);
    }
    scene.refuse("equilibrium", error.to_string(), help)
}

fn outcome(plan: Plan, solved: Solved, team: Option<&Team>) -> Outcome {
    let (step, spacing) = (plan.stop.steps, plan.setup.body.lattice.spacing());
    let mut engine = engine_of(plan.setup, team);
    engine.place_at_rest(step, &solved.displacement);
    let residual = farthest_from_target(&engine) / spacing;
    let reason = overflow(&engine).map_or_else(|| reason(&solved), StopReason::Diverged);
    Outcome { engine, reason, residual, solved: Some(solved) }
}

/// The engine of a body that is put to rest: shared where each rank has a part of it.
fn engine_of(setup: Setup, team: Option<&Team>) -> Engine {
    let mut engine = Engine::new(setup);
    if let Some(team) = team.filter(|_| engine.body().part.is_some()) {
        engine.join(team.clone());
    }
    engine
}

fn reason(solved: &Solved) -> StopReason {
    if solved.is_at_rest() { StopReason::Equilibrium } else { StopReason::Unsettled }
}

/// How far the follower farthest from its target is from it \[length\].
fn farthest_from_target(engine: &Engine) -> f64 {
    let present: &Vectors = engine.present();
    let follows = |&i: &usize| engine.roles()[i] == Role::Follower;
    let apart = |i: usize| distance(engine.flock().target(i, present), present.get(i));
    let own = engine.body().owned().filter(follows).map(apart).fold(0.0, f64::max);
    engine.largest_of_parts([own])[0]
}
