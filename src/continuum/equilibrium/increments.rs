//! Equilibria on the way: loads and leaders' motions in parts, each solved from where the last one left the body.

use super::{Observer, Outcome, Plan, StopReason, overflow, steps_of_the_way};
use super::{
    engine_of, farthest_from_target, reason, refuse, refuse_corotated, shared_system, solve_corotated,
    solve_linear, way_after,
};
use crate::engine::load::scaled;
use crate::flock::vectors::Vectors;
use crate::ranks::Team;
use crate::scene::{Scene, SceneError};
use crate::solve::corotated::{self, CorotatedError, Way};
use crate::solve::equilibrium::{Request, SolveError, Solved};

/// Why a part of the way cannot be gone.
enum Failure {
    Refused(SceneError),
    /// The equilibrium is lost on the way.
    Lost(String),
    Interrupted,
}

/// Solves each part of the way in turn. `observer` sees the unloaded body and then every equilibrium, as step 1, 2, ...;
/// where one is not found, the run ends with the last.
///
/// # Errors
/// As [`super::solve_equilibrium`]: what is wrong with the scene and not with the size of the load.
pub(super) fn settle_each(
    (scene, request, team): (&Scene, &Request, Option<&Team>),
    mut plan: Plan,
    parts: &[f64],
    observer: &mut dyn Observer,
) -> Result<Outcome, SceneError> {
    let whole = plan.setup.flock.forces.clone();
    let spacing = plan.setup.body.lattice.spacing();
    let probes = plan.setup.probes.take();
    let mut engine = engine_of(plan.setup.clone(), team);
    engine.set_load_factor(0.0);
    engine.begin_probes(probes);
    let mut outcome =
        Outcome { engine, reason: StopReason::Equilibrium, residual: f64::INFINITY, solved: None };
    let mut interrupted = observer.see(&outcome.engine, outcome.residual).is_break();
    let mut last = 0.0;
    for (n, &part) in parts.iter().enumerate() {
        if interrupted {
            outcome.reason = StopReason::Interrupted;
            break;
        }
        let start = outcome.solved.as_ref().map(|solved| (&solved.displacement, last));
        let solved = match settle_at((scene, request, team), (&mut plan, whole.as_ref()), start, part) {
            Ok(solved) => solved,
            Err(Failure::Refused(error)) => return Err(error),
            Err(Failure::Interrupted) => {
                outcome.reason = StopReason::Interrupted;
                break;
            }
            Err(Failure::Lost(why)) => {
                outcome.reason = StopReason::Stuck(format!("at {part} of the load: {why}"));
                break;
            }
        };
        outcome.engine.place_at_rest(n + 1, &solved.displacement);
        outcome.engine.set_load_part(part);
        outcome.engine.extend_path();
        outcome.engine.record_probes();
        outcome.residual = farthest_from_target(&outcome.engine) / spacing;
        outcome.reason = overflow(&outcome.engine).map_or_else(|| reason(&solved), StopReason::Diverged);
        outcome.solved = Some(solved);
        interrupted = observer.see(&outcome.engine, outcome.residual).is_break();
        last = part;
        if matches!(outcome.reason, StopReason::Unsettled | StopReason::Diverged(_)) {
            break;
        }
    }
    Ok(outcome)
}

/// The equilibrium under this part of loads and motions.
fn settle_at(
    (scene, request, team): (&Scene, &Request, Option<&Team>),
    (plan, whole): (&mut Plan, Option<&Vectors>),
    start: Option<(&Vectors, f64)>,
    part: f64,
) -> Result<Solved, Failure> {
    let steps = steps_of_the_way(plan) as f64;
    if !corotated::is_corotated(&plan.setup.flock) {
        plan.setup.flock.forces = whole.map(|whole| scaled(whole, part));
        let system = shared_system(scene, plan, team, part * steps).map_err(Failure::Refused)?;
        return solve_linear(plan, system, request, team).map_err(|error| match error {
            SolveError::Interrupted => Failure::Interrupted,
            error => Failure::Refused(refuse(scene, &error)),
        });
    }
    let way = Way { held: &|part| way_after(plan, part * steps), start, end: part };
    let solved = solve_corotated(plan, &way, request, team);
    solved.map_err(|error| match error {
        CorotatedError::Solve(SolveError::Interrupted) => Failure::Interrupted,
        CorotatedError::Unsettled { .. } if start.is_some() => Failure::Lost(error.to_string()),
        _ => Failure::Refused(refuse_corotated(scene, &error)),
    })
}
