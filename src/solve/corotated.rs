//! Where a corotated material comes to rest: Newton's method on the energy of its cells.
//!
//! The force on a particle is minus the gradient of the energy that the cells around it store (see
//! [`crate::flock::rules::Element`]), and the tangent is its second derivative: a symmetric operator over the rule's own
//! neighbours. It is positive definite wherever the body rests stably, so every solver will do; on the way to there it need
//! not be, and an increment whose system has no positive solution is taken in smaller parts.
//!
//! An equilibrium counts where its own tangent is positive: a straight column is in equilibrium under any load, and buckles.
//!
//! Leaders go their way and loads grow in increments, halved where Newton's method does not settle, where a cell turns too far at
//! once, or where the body does not store the work of the increment: that keeps to the equilibrium that the unstrained body grows
//! into. A body that snaps from one to another gives off work, however small the increment; one that gives off less than a tenth of
//! what its forces could do on the way is not noticed.
//!
//! A displacement known to the last digit of a double leaves a residual of `eps |K| |u|`. The bending of a beam needs so much
//! less force than its stretching that this exceeds the load itself where the beam is some thousands of times as long as
//! high, so Newton's method has settled where its residual is no more than that.

mod body;
mod newton;

use super::equilibrium::{Choice, Precision, Request, SolveError, Solved, Solver};
use super::linear::NotLinear;
use super::order::Order;
use super::whole::Whole;
use crate::flock::body::Body;
use crate::flock::law::{Flock, Weights};
use crate::flock::rules::{Mean, Rotation};
use crate::flock::vectors::Vectors;
use crate::ranks::Team;
use body::Corotated;
use newton::Newton;

const DIRECT: Choice = Choice::This(Solver::Direct);
/// Residual of each linear system: more digits than a Newton step has.
const OF_A_STEP: f64 = 1e-5;

/// Why there is no corotated equilibrium to be had.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CorotatedError {
    /// The rule has no operator.
    #[error(transparent)]
    NotLinear(#[from] NotLinear),
    /// A system of Newton's method could not be solved in the unstrained body, or the solve was interrupted.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// The rule has feedback.
    #[error("feedback is a term of the sweep, which the corotated equilibrium does not have")]
    Feedback,
    /// Single precision was asked for.
    #[error("Newton's method on a corotated material computes in double precision only")]
    DoubleOnly,
    /// Increments of the way got too small, or there were too many.
    #[error(
        "the rotations do not settle beyond {:.1} % of the way of leaders and loads ({solves} systems solved{}): {}",
        100.0 * part,
        if *cut_short > 0 { format!(", {cut_short} of them no further than most_iterations allows") } else { String::new() },
        match *solves >= newton::MOST_SOLVES {
            true => "so many are solved at most",
            false if *cut_short > 0 => "the body snaps, buckles or is torn there, or was never brought to rest",
            false => "the body snaps, buckles or is torn there",
        }
    )]
    Unsettled {
        /// Share of the way of leaders and loads that was reached \[1\].
        part: f64,
        /// Systems that were solved.
        solves: usize,
        /// Those of which the iterations that were asked for came to no end.
        cut_short: usize,
    },
}

/// Whether a rule is what this file is about.
pub fn is_corotated(flock: &Flock) -> bool {
    flock.rule.mean == Mean::Material { rotation: Rotation::Corotated }
}

/// Followers up to which a factorisation is taken: the rows of the tangent differ from particle to particle, which
/// multigrid on a lattice gains nothing from.
pub const DIRECT_UP_TO: usize = 200_000;

/// The solver of the linear systems, and why.
///
/// # Errors
/// If single precision is asked for.
pub fn choose(followers: usize, request: &Request) -> Result<(Solver, String), CorotatedError> {
    let (solver, why) = match request.solver {
        Choice::This(solver) => (solver, "asked for".into()),
        Choice::Auto if followers <= DIRECT_UP_TO => {
            (Solver::Direct, format!("{followers} followers are few enough to factorise"))
        }
        Choice::Auto => (
            Solver::Multigrid,
            format!("the number of its iterations does not grow with {followers} followers"),
        ),
    };
    if request.precision == Precision::F32 {
        return Err(CorotatedError::DoubleOnly);
    }
    Ok((solver, format!("{why}; once a step of Newton's method, until the rotations settle")))
}

/// How leaders and loads get to where they are.
pub struct Way<'a> {
    /// Where what is held is after a part of the whole way \[length\], shape \[count\]; as much of the
    /// loads is then on the body.
    pub held: &'a (dyn Fn(f64) -> Vectors + Sync),
    /// The equilibrium to start from and the part that it belongs to; the reference and 0 where there is none.
    pub start: Option<(&'a Vectors, f64)>,
    /// The part to come to \[1\].
    pub end: f64,
}

impl<'a> Way<'a> {
    /// From the reference to the end.
    pub fn whole(held: &'a (dyn Fn(f64) -> Vectors + Sync)) -> Self {
        Self { held, start: None, end: 1.0 }
    }

    /// The part of the whole way that belongs to a part of this one.
    fn part(&self, of_this: f64) -> f64 {
        let start = self.start.map_or(0.0, |(_, part)| part);
        if of_this == 1.0 { self.end } else { start + of_this * (self.end - start) }
    }
}

/// The equilibrium at the end of the way. `held_axes` are single components of followers that are held, shape
/// \[count\]\[x, y\], or empty; the way says where they are as well. Of a body of which each rank of the team has a part, and
/// that is all that is given here, all find the same, or fail alike.
///
/// # Errors
/// As [`solve_shared`](super::equilibrium::solve_shared); names the part of the way from which on the rotations do not settle.
pub fn solve(
    (flock, body): (&Flock, &Body),
    follows: Vec<bool>,
    held_axes: Vec<[bool; 2]>,
    way: &Way<'_>,
    request: &Request,
    team: Option<&Team>,
) -> Result<Solved, CorotatedError> {
    let Weights::Matrix(weights) = &flock.weights else {
        return Err(NotLinear::Rule { rule: "a material without its weights".into() }.into());
    };
    if flock.rule.feedback.is_some() {
        return Err(CorotatedError::Feedback);
    }
    let tolerance = request.tolerance;
    if tolerance.is_nan() || tolerance <= 0.0 || tolerance >= 1.0 {
        return Err(SolveError::Tolerance { tolerance }.into());
    }
    let whole = Whole::new(body, team);
    let own = body.owned().filter(|&i| follows[i]).count();
    let followers = team.map_or(own, |team| team.sum([own as u64])[0] as usize);
    let (solver, why) = choose(followers, request)?;
    let step = Request { solver: Choice::This(solver), tolerance: OF_A_STEP, ..*request };
    let order = Order::new(body);
    // A sweep whose system is not positive definite just ends short of its tolerance.
    let sees = |solver: Solver| !matches!(solver, Solver::Jacobi | Solver::GaussSeidel | Solver::Chebyshev);
    let question = match sees(solver) {
        true => step,
        false => Request { solver: Choice::This(choose(followers, &Request::default())?.0), ..step },
    };
    let rule = Corotated { flock, weights, whole, order, follows, held_axes, way, step, question };
    let mut newton = Newton::new(&rule);
    let displacement = if newton.size == 0.0 { (way.held)(way.end) } else { newton.go(tolerance)? };
    let residuals = if newton.size == 0.0 { vec![0.0] } else { newton.residuals };
    let converged = newton.off.is_none() && residuals.last().is_some_and(|last| *last <= 2.0 * tolerance);
    // Where rounding has the last word, the last step is made of what it left.
    let known_to = (!converged).then_some(newton.last_step.max(newton.off.unwrap_or(0.0)));
    let phases = vec![("set-up", newton.times[0]), ("solve", newton.times[1])];
    Ok(Solved {
        displacement,
        solver,
        why,
        iterations: residuals.len() - 1,
        residuals,
        phases,
        converged,
        known_to,
    })
}
