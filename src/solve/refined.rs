//! Equilibria of slender bodies, whose rows have rounded away what bends them.
//!
//! The diagonal of a row is what its neighbours pull with, summed up and rounded: moved as a whole, a body of stiffness `K` feels
//! `eps |K| |u|`. A beam a thousand times as long as high bends by so much under so little load that this is some percent of
//! it, and no solver of the rounded system sees it. Forces from the *differences* of displacements do not have it, and what
//! they leave is solved for again (iterative refinement; N. J. Higham, *Accuracy and Stability of Numerical Algorithms*, 2002,
//! chapter 12).
//!
//! Where a tolerance was not reached that is known. Where it was, loads and reactions say whether it was enough ([`super::balance`]).

use rayon::prelude::*;

use super::balance::{Outer, is_too_much};
use super::equilibrium::{Choice, Request, SolveError, Solved, System, solve_shared};
use super::whole::Whole;
use crate::flock::body::Body;
use crate::flock::law::{Flock, Weights};
use crate::flock::rules::Rule;
use crate::flock::vectors::Vectors;
use crate::geometry::point::plus;
use crate::ranks::Team;

/// Solves after the first one, at most.
const MOST: usize = 8;
/// Tolerance of each of them where rounding ended the first: the system is rounded itself.
const OF_WHAT_IS_LEFT: f64 = 1e-3;
/// Part of a correction that the next one may be, lest the system have too few digits to find it.
const WORTH_IT: f64 = 0.5;

/// The equilibrium of the `system` of a body under the loads of its `flock`; shared with a team, each rank with a part of the body or
/// all with the whole of it.
/// Iterations and residuals are those of the first solve, which are of the rounded system.
///
/// # Errors
/// As [`solve_shared`].
pub fn solve_refined(
    (flock, body, follows): (&Flock, &Body, &dyn Fn(usize) -> bool),
    mut system: System,
    request: &Request,
    team: Option<&Team>,
) -> Result<Solved, SolveError> {
    let mut solved = solve_shared(&system, request, team)?;
    let Weights::Matrix(weights) = &flock.weights else { return Ok(solved) };
    let whole = Whole::new(body, team.filter(|_| body.part.is_some()));
    let load = |i: usize| flock.forces.as_ref().map_or([0.0; 2], |forces| forces.get(i));
    let is_cut_off = !solved.converged && solved.residuals.len() > request.most_iterations;
    if flock.rule != Rule::MATERIAL || is_cut_off {
        return Ok(solved);
    }
    let held = |i: usize| if follows(i) { weights.held(i) } else { [true; 2] };
    let off = |u: &Vectors| {
        let (inner, place) = (|i: usize| flock.force_under(i, u), |i: usize| flock.reference.get(i));
        Outer::of((flock, &whole), held, load, inner, place, u).off(None)
    };
    if solved.known_to.is_none() && !is_too_much(off(&solved.displacement), request.tolerance) {
        return Ok(solved);
    }
    // What it leaves where something is held, the system does not look at.
    let left = |u: &Vectors| -> Vectors {
        let force = |i: usize| match body.exact().contains(&i) {
            true => plus(flock.force_under(i, u), load(i)),
            false => [0.0; 2],
        };
        let force: Vec<[f64; 2]> = (0..u.len()).into_par_iter().map(force).collect();
        force.into_iter().collect()
    };
    let again = Request {
        tolerance: if solved.converged { request.tolerance } else { OF_WHAT_IS_LEFT.max(request.tolerance) },
        solver: Choice::This(solved.solver),
        ..*request
    };
    let mut last = f64::INFINITY;
    for _ in 0..MOST {
        system = system.under(&left(&solved.displacement));
        let more = match solve_shared(&system, &again, team) {
            Err(SolveError::Interrupted) => return Err(SolveError::Interrupted),
            // What was found before stands.
            Err(_) => break,
            Ok(more) => more,
        };
        let refined = solved.displacement.iter().zip(more.displacement.iter()).map(|(u, by)| plus(u, by));
        let refined: Vectors = refined.collect();
        let correction = whole.norm(&more.displacement) / whole.norm(&refined);
        tracing::debug!(correction, "refined by forces from differences of displacements");
        if correction.is_nan() || correction > WORTH_IT * last {
            solved.known_to = Some(correction + last).filter(|part| part.is_finite());
            // To its tolerance, of a system that is another.
            solved.converged = false;
            break;
        }
        solved.displacement = refined;
        // Each is the error of what was there before it, and the next one would be as much less again.
        solved.known_to = Some(correction * if last.is_finite() { correction / last } else { 1.0 });
        solved.phases.iter_mut().zip(&more.phases).for_each(|((_, sum), (_, more))| *sum += *more);
        if correction <= request.tolerance {
            break;
        }
        last = correction;
    }
    // An iteration does not find what its right-hand side has too little of.
    let off = off(&solved.displacement);
    solved.converged &= !is_too_much(off, request.tolerance);
    solved.known_to = solved.known_to.filter(|_| !solved.converged).map(|part| part.max(off));
    Ok(solved)
}
