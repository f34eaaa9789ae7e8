//! Straight to rest: the equilibrium under the leaders' places at the last step, without stepping there.

use std::ops::ControlFlow;

use super::engine::Engine;
use super::layout::held;
use super::plan::Plan;
use super::run::{Outcome, StopReason, run};
use crate::flock::points::{Points, distance};
use crate::flock::role::Role;
use crate::scene::raw::{RawEquilibrium, RawPrecision, RawSolver};
use crate::scene::{Scene, SceneError};
use crate::solve::equilibrium::{Choice, Precision, Request, SolveError, Solved, Solver, choose, solve};
use crate::solve::linear::{NotLinear, Scaled, scaled_system};

/// Runs a plan to its end as its scene asks: stepping, or straight to the equilibrium. `watch` sees a
/// stepped run as [`run`] shows it, and of a solved one the end.
///
/// # Errors
/// As [`settle`]; a scene that is stepped has none.
pub fn come_to_rest(
    scene: &Scene,
    plan: Plan,
    watch: &mut dyn FnMut(&Engine, f64) -> ControlFlow<()>,
) -> Result<Outcome, SceneError> {
    let Some(asked) = &scene.raw.equilibrium else { return Ok(run(plan, watch)) };
    let outcome = settle(scene, asked, plan)?;
    // There is nothing left to break off.
    let _ = watch(&outcome.engine, outcome.residual);
    Ok(outcome)
}

/// Finds the equilibrium that the scene's `[equilibrium]` asks for.
///
/// # Errors
/// Names what in the scene has no equilibrium, or none that the solver asked for can find.
pub fn settle(scene: &Scene, asked: &RawEquilibrium, plan: Plan) -> Result<Outcome, SceneError> {
    let Scaled { system, length } = of_plan(scene, &plan)?;
    let mut solved = solve(&system, &request(asked)).map_err(|error| refuse(scene, &error))?;
    let Points { x, y } = &mut solved.displacement;
    x.iter_mut().chain(y).for_each(|displacement| *displacement *= length);
    Ok(outcome(plan, solved))
}

/// The solver that would be taken, and why.
///
/// # Errors
/// As [`settle`], as far as can be told without solving.
pub fn foresee(scene: &Scene, asked: &RawEquilibrium, plan: &Plan) -> Result<(Solver, String), SceneError> {
    Ok(choose(&of_plan(scene, plan)?.system, &request(asked)))
}

/// The linear system of a plan, in units of its own: leaders where they are at the last step.
///
/// # Errors
/// Names the part of the rule that is not linear.
pub fn of_plan(scene: &Scene, plan: &Plan) -> Result<Scaled, SceneError> {
    let follows = plan.roles.iter().map(|&role| role == Role::Follower).collect();
    let at_rest = |d: Option<[f64; 2]>| d.unwrap_or_default();
    let held: Points = held(&plan.changes, &plan.body, plan.stop.steps).into_iter().map(at_rest).collect();
    scaled_system(&plan.interaction, &plan.body, follows, &held).map_err(|error| {
        let (key, help) = match error {
            NotLinear::Rule { .. } => {
                ("rule.mean", "leave [equilibrium] out: sweeps find where such a rule comes to rest")
            }
            NotLinear::Broken => ("roles", "leave [equilibrium] out to step with broken bonds"),
            NotLinear::Operator(_) => ("rule", "give weights that are finite"),
        };
        scene.refuse(key, format!("no equilibrium can be solved for: {error}"), help)
    })
}

fn request(asked: &RawEquilibrium) -> Request {
    let solver = match asked.solver {
        RawSolver::Auto => Choice::Auto,
        RawSolver::Jacobi => Choice::This(Solver::Jacobi),
        RawSolver::GaussSeidel => Choice::This(Solver::GaussSeidel),
        RawSolver::Chebyshev => Choice::This(Solver::Chebyshev),
        RawSolver::ConjugateGradients => Choice::This(Solver::ConjugateGradients),
        RawSolver::Multigrid => Choice::This(Solver::Multigrid),
        RawSolver::Direct => Choice::This(Solver::Direct),
    };
    let precision = match asked.precision {
        RawPrecision::F64 => Precision::F64,
        RawPrecision::F32 => Precision::F32,
    };
    Request { solver, tolerance: asked.tolerance, most_iterations: asked.most_iterations, precision }
}

fn refuse(scene: &Scene, error: &SolveError) -> SceneError {
    let help = "choose another equilibrium.solver, or equilibrium.solver = \"auto\"";
    scene.refuse("equilibrium", error.to_string(), help)
}

fn outcome(plan: Plan, solved: Solved) -> Outcome {
    let (step, spacing) = (plan.stop.steps, plan.body.lattice.spacing());
    let mut engine = Engine::new(plan);
    engine.settle(step, &solved.displacement);
    let residual = farthest_from_target(&engine) / spacing;
    let reason = if solved.converged { StopReason::Equilibrium } else { StopReason::Unsettled };
    Outcome { engine, reason, residual, solved: Some(solved) }
}

/// How far the follower farthest from its target is from it \[length\].
fn farthest_from_target(engine: &Engine) -> f64 {
    let present: &Points = engine.present();
    let follows = |&i: &usize| engine.roles()[i] == Role::Follower;
    let apart = |i: usize| distance(engine.interaction().target(i, present), present.get(i));
    (0..present.len()).filter(follows).map(apart).fold(0.0, f64::max)
}
