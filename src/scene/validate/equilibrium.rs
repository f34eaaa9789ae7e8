//! How the equilibrium is to be found, and what must not be in a scene that is not stepped.

use super::Refuse;
use super::material::is_material;
use crate::scene::Equilibrium;
use crate::scene::document::problem::SceneError;
use crate::scene::raw::*;
use crate::solve::equilibrium::{Choice, Precision, Request, SINGLE_FLOOR, Solver};

/// Residual over load to which a scene is solved that does not say.
const TOLERANCE: f64 = 1e-8;

/// Of an accuracy, the part that the solver may use up: displacements of slender bodies are off by more
/// than the residual is.
const OF_ACCURACY: f64 = 0.01;

/// Accuracy from which singles are enough: what they leave of a displacement is about 1e-6 times the
/// condition of the body, which reaches a thousand on beams of some dozen particles.
const SINGLES_FROM: f64 = 0.01;

/// Nearer to elasticity than this the paper's rule has not been seen, whatever its spacing; see
/// `flockform trade`.
const PAPER_REACHES: f64 = 0.3;

pub fn equilibrium(raw: &RawScene, refuse: Refuse<'_>) -> Result<Option<Equilibrium>, SceneError> {
    let Some(asked) = &raw.equilibrium else { return Ok(None) };
    check(raw, refuse)?;
    let accuracy = asked.accuracy.as_ref().map(|asked| accuracy(asked, raw, refuse)).transpose()?;
    let solver = match asked.solver {
        RawSolver::Auto => Choice::Auto,
        RawSolver::Jacobi => Choice::This(Solver::Jacobi),
        RawSolver::GaussSeidel => Choice::This(Solver::GaussSeidel),
        RawSolver::Chebyshev => Choice::This(Solver::Chebyshev),
        RawSolver::ConjugateGradients => Choice::This(Solver::ConjugateGradients),
        RawSolver::Multigrid => Choice::This(Solver::Multigrid),
        RawSolver::Direct => Choice::This(Solver::Direct),
    };
    let tolerance = asked.tolerance.unwrap_or_else(|| accuracy.map_or(TOLERANCE, |a| OF_ACCURACY * a));
    let has_single = match solver {
        Choice::Auto => true,
        Choice::This(solver) => solver.has_single(),
    };
    // Turned axes leave no symmetry, and the solvers that need none compute in doubles.
    let corotated = matches!(raw.rule.mean, Some(RawMean::Material { rotation: RawRotation::Corotated, .. }));
    let has_single = has_single && !corotated;
    let singles = accuracy.is_some_and(|a| a >= SINGLES_FROM) && has_single && tolerance >= SINGLE_FLOOR;
    let precision = match asked.precision {
        Some(asked) => asked.into(),
        None if singles => Precision::F32,
        None => Precision::F64,
    };
    let most_iterations = asked.most_iterations;
    let request = Request { solver, tolerance, most_iterations, precision, ..Request::default() };
    Ok(Some(Equilibrium { request, accuracy }))
}

/// `1%`, `1 %` or 0.01; refuses what the rule cannot reach.
fn accuracy(asked: &RawAccuracy, raw: &RawScene, refuse: Refuse<'_>) -> Result<f64, SceneError> {
    let key = "equilibrium.accuracy";
    let value = match asked {
        RawAccuracy::Part(value) => Some(*value),
        RawAccuracy::Text(text) => {
            let (number, unit) = match text.trim().strip_suffix('%') {
                Some(number) => (number.trim_end(), 0.01),
                None => (text.trim(), 1.0),
            };
            number.parse::<f64>().ok().map(|number| unit * number)
        }
    };
    let Some(value) = value.filter(|value| *value > 0.0 && *value < 1.0) else {
        let message = "an accuracy is a percentage or a part of 1, more than 0 and less than 1".into();
        return Err(refuse(key, message, "give \"1%\" or 0.01"));
    };
    if raw.material.is_none() {
        let message = "an accuracy is that of a material's displacement, and the scene has none".into();
        return Err(refuse(key, message, "add [material] with kind = \"isotropic\", young and poisson"));
    }
    if !is_material(raw) && value < PAPER_REACHES {
        let message = format!(
            "this rule has no material: it is not sure to come nearer to elasticity than {} % at any spacing",
            100.0 * PAPER_REACHES
        );
        return Err(refuse(key, message, "leave rule.mean out, or use kind = \"material\""));
    }
    Ok(value)
}

/// Stepless runs: nothing may depend on how the body got where it is.
pub fn check(raw: &RawScene, refuse: Refuse<'_>) -> Result<(), SceneError> {
    let when = raw.roles.iter().position(|entry| entry.when.is_some());
    let later = raw.roles.iter().position(|entry| entry.from > 1);
    let present = matches!(raw.neighbours, Some(RawNeighbours::Dynamic { .. }));
    let broken = raw.fracture.is_some() || !raw.cuts.is_empty();
    let clash = [
        (when.map(|k| format!("roles[{k}].when")), "condition on the way"),
        (later.map(|k| format!("roles[{k}].from")), "role that changes on the way"),
        (present.then(|| "neighbours".to_owned()), "neighbours found anew at every step"),
        (broken.then(|| if raw.cuts.is_empty() { "fracture" } else { "cuts" }.to_owned()), "breaking bonds"),
    ];
    if raw.rule.feedback.as_ref().is_some_and(|feedback| feedback.factor == -1.0) {
        let message = "takes back all that the mean asks for: no follower ever moves, and there is nothing to solve for";
        let help = "give a factor between -1 and 0, or leave [equilibrium] out to step";
        return Err(refuse("rule.feedback.factor", message.into(), help));
    }
    match clash.into_iter().find_map(|(key, what)| key.map(|key| (key, what))) {
        None => Ok(()),
        Some((key, what)) => Err(refuse(
            &key,
            format!("an equilibrium that is not stepped to has no {what}"),
            "step instead, without [equilibrium], or leave this out",
        )),
    }
}
