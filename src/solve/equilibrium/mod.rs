//! Where a body comes to rest: solvers for `K u = f` over the followers, the held particles' displacements
//! being given.
//!
//! A sweep moves every particle to its target and arrives at equilibrium in the end; these solvers go
//! there directly. One file each:
//!
//! * [`jacobi`]: the paper's synchronous sweep, damped by what the spectrum allows.
//! * [`gauss_seidel`]: the sequential sweep, by colours, so that its order depends on the lattice alone.
//! * [`chebyshev`]: synchronous sweeps whose damping varies, after the bounds of the spectrum.
//! * [`conjugate_gradients`]: the best that sweeps with memory can do without knowing the body's shape.
//! * [`multigrid`]: conjugate gradients that let the whole body move and turn as well, on coarser and
//!   coarser grids: the number of iterations does not grow with the body.
//! * [`direct`]: a sparse factorisation.
//!
//! All of them reach the same equilibrium; [`solve`] says how it went, and [`choose`] which of them
//! [`Choice::Auto`] is.

pub mod chebyshev;
mod choice;
pub mod conjugate_gradients;
pub mod direct;
mod error;
pub mod gauss_seidel;
mod history;
pub mod jacobi;
mod lanczos;
pub mod multigrid;
mod rounding;
pub(super) mod steps;
mod system;
mod windows;

use std::time::Duration;

pub use choice::{DIRECT_UP_TO, FACTORISED_UP_TO, INCOMPRESSIBLE_UP_TO, UNSYMMETRIC_UP_TO, choose};
pub use error::SolveError;
pub use system::System;

use super::interrupt::Interrupt;
use super::operator::Matrix;
use super::part::{Cuts, received_by};
use super::stopwatch::Stopwatch;
use crate::flock::vectors::Vectors;
use crate::ranks::Team;
use choice::{PATIENCE, falls_back};
use system::Prepared;

/// Relative residual that no whole solve in single precision is asked to go below.
pub const SINGLE_FLOOR: f64 = 1e-5;

named! {
    /// The solvers there are.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
    pub enum Solver {
        /// The synchronous sweep, damped: see [`jacobi`].
        Jacobi => "jacobi",
        /// The sequential sweep, by colours: see [`gauss_seidel`].
        GaussSeidel => "gauss-seidel",
        /// Synchronous sweeps of varied damping: see [`chebyshev`].
        Chebyshev => "chebyshev",
        /// Sweeps with memory: see [`conjugate_gradients`].
        ConjugateGradients => "conjugate-gradients",
        /// Conjugate gradients on coarser and coarser grids: see [`multigrid`].
        Multigrid => "multigrid",
        /// A sparse factorisation: see [`direct`].
        Direct => "direct",
    }
}

impl Solver {
    /// Whether it only converges where any two neighbours feel each other alike.
    pub fn needs_symmetry(self) -> bool {
        matches!(self, Solver::Chebyshev | Solver::ConjugateGradients | Solver::Multigrid)
    }

    /// Whether it carries its residual along instead of computing it anew, so that the two part in the end.
    fn updates_residual(self) -> bool {
        matches!(self, Solver::ConjugateGradients | Solver::Multigrid)
    }

    /// Whether ranks share its iterations; with another solver each of them solves the whole system.
    pub fn is_shared(self) -> bool {
        matches!(self, Solver::ConjugateGradients | Solver::Multigrid)
    }

    /// Whether it can compute in single precision throughout.
    pub fn has_single(self) -> bool {
        matches!(self, Solver::ConjugateGradients | Solver::Multigrid)
    }
}

impl std::fmt::Display for Solver {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// Which solver to take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Choice {
    /// By size, symmetry and tolerance: see [`choose`].
    #[default]
    Auto,
    /// The one that is named.
    This(Solver),
}

/// The precision of all vectors of a solve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// Double precision wherever it decides the result.
    #[default]
    F64,
    /// The whole solve in single precision: down to [`SINGLE_FLOOR`], and on slender bodies an error in
    /// the displacement that is larger by their condition number.
    F32,
}

/// How equilibrium is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Request {
    /// Which solver to take.
    pub solver: Choice,
    /// Largest residual force `|f - K u|` over that at the start, with all followers at zero, `|b|` \[1\].
    pub tolerance: f64,
    /// Iterations after which the solve ends short of its tolerance.
    pub most_iterations: usize,
    /// Precision of the vectors.
    pub precision: Precision,
    /// Ends the solve with [`SolveError::Interrupted`].
    pub interrupt: Interrupt,
}

impl Default for Request {
    fn default() -> Self {
        Self {
            solver: Choice::Auto,
            tolerance: 1e-10,
            most_iterations: 1_000_000,
            precision: Precision::default(),
            interrupt: Interrupt::default(),
        }
    }
}

/// An equilibrium and how it was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Solved {
    /// Displacements \[length\], those of the held particles included, shape \[count\].
    pub displacement: Vectors,
    /// The solver that was taken.
    pub solver: Solver,
    /// Why this solver.
    pub why: String,
    /// Iterations made.
    pub iterations: usize,
    /// Relative residual before the first iteration, which is 1, and after each.
    pub residuals: Vec<f64>,
    /// The phases of the solve and how long each took: zero where there is no clock, as in a browser.
    pub phases: Vec<(&'static str, Duration)>,
    /// Whether the tolerance was reached.
    pub converged: bool,
    /// Where rounding ended the solve short of its tolerance: the relative L2 error that the displacements are
    /// estimated to have \[1\].
    pub known_to: Option<f64>,
}

/// Largest error of displacements that still are an equilibrium.
const LARGEST_ERROR: f64 = 1e-3;

impl Solved {
    /// Whether this is an equilibrium: to its tolerance, or as far as doubles go and known to three digits.
    pub fn is_at_rest(&self) -> bool {
        self.converged || self.known_to.is_some_and(|error| error <= LARGEST_ERROR)
    }
}

/// The result of a solver: displacements of the followers, zero elsewhere.
struct Found {
    displacement: Vectors<f64>,
    residuals: Vec<f64>,
    /// Time the solver itself spent before the first iteration.
    set_up: Duration,
}

/// Finds the equilibrium of a system.
pub fn solve(system: &System, request: &Request) -> Result<Solved, SolveError> {
    steps::in_pool(|| solve_shared(system, request, None))
}

/// The same shared with the other ranks of a team, which all have the same system, or each a part of it: the same bits on every
/// one of them, and an interrupt of any ends all alike.
pub fn solve_shared(system: &System, request: &Request, team: Option<&Team>) -> Result<Solved, SolveError> {
    let begin = Stopwatch::start();
    let allowed = request.tolerance > 0.0 && request.tolerance < 1.0;
    if !allowed {
        return Err(SolveError::Tolerance { tolerance: request.tolerance });
    }
    let (solver, why) = choose(system, request);
    check(system, request, solver)?;
    let mut prepared = Prepared::new(system, team, solver)?;
    let prepared_in = begin.elapsed();
    let can_fall_back = falls_back(system, request, solver);
    let most_iterations =
        if can_fall_back { request.most_iterations.min(PATIENCE) } else { request.most_iterations };
    let patient = Request { most_iterations, ..*request };
    let found = by(solver, &mut prepared, &patient);
    let gives_up = match &found {
        Err(SolveError::NotPositive { .. }) => {
            Some(format!("{solver} took the body for unstable, which a factorisation finds out"))
        }
        Ok(found)
            if found.residuals.len() > PATIENCE
                && request.most_iterations > PATIENCE
                && found.residuals.last().is_some_and(|left| *left > request.tolerance) =>
        {
            Some(format!("{solver} was not at rest after {PATIENCE} iterations, and a factorisation is"))
        }
        _ => None,
    };
    let (found, solver, why) = match gives_up.filter(|_| can_fall_back) {
        Some(why) => {
            // The iteration has used up the right-hand side, and each rank has a window of its own.
            prepared = Prepared::new(system, team, Solver::Direct)?;
            (by(Solver::Direct, &mut prepared, request)?, Solver::Direct, why)
        }
        None => (found?, solver, why),
    };
    let set_up = prepared_in + found.set_up;
    let mut residuals = found.residuals;
    if let Some(last) = residuals.last_mut().filter(|_| solver.updates_residual() && prepared.size > 0.0) {
        *last = prepared.residual(system, &found.displacement);
    }
    let ended = solver == Solver::Direct || residuals.len() <= request.most_iterations;
    // Rounding keeps an iteration from the last digits of what it was asked for; what ran out of iterations was kept by nothing.
    let slack = if ended { 2.0 } else { 1.0 };
    let converged = residuals.last().is_some_and(|last| *last <= slack * request.tolerance);
    let known_to = (!converged && ended && request.precision == Precision::F64)
        .then(|| rounding::known_to(&mut prepared, system, request, (solver, &found.displacement)))
        .flatten();
    let found = prepared.in_system(system, found.displacement);
    let displacement = system.with_held(prepared.unscaled(found));
    let is_finite = |i: usize| displacement.get(i).iter().all(|u| u.is_finite());
    if let Some([i, _]) = system.first_found(system.owned().find(|&i| !is_finite(i)).map(|i| [i, 0])) {
        return Err(SolveError::NotFinite { what: "displacement in equilibrium", particle: i + 1 });
    }
    Ok(Solved {
        displacement: system.in_body(displacement),
        solver,
        why,
        iterations: residuals.len() - 1,
        converged,
        known_to,
        residuals,
        phases: vec![("set-up", set_up), ("solve", begin.elapsed() - set_up)],
    })
}

/// How ranks share the iterations of a solver.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SolverShares {
    /// Particles of each rank, shape \[ranks\].
    pub particles: Vec<usize>,
    /// The most that a rank receives of others before it applies the operator, in particles.
    pub received: usize,
}

/// How so many ranks would share a solve; `None` where each would solve the whole system.
pub fn shared_by(system: &System, solver: Solver, ranks: usize) -> Option<SolverShares> {
    if !solver.is_shared() {
        return None;
    }
    let matrix = Matrix::of_followers(&system.operator);
    let cuts = Cuts::new(&matrix.bounds, ranks);
    let received = |rank: usize| received_by(&matrix, &cuts, rank);
    let particles = (0..ranks).map(|rank| cuts.particles_of(rank).len()).collect();
    let received = (0..ranks).map(received).max().unwrap_or_default();
    Some(SolverShares { particles, received })
}

/// The result of a solver, which is the same on all ranks.
fn by(solver: Solver, prepared: &mut Prepared, request: &Request) -> Result<Found, SolveError> {
    let found = by_one(solver, prepared, request);
    // Where each rank solves the whole system, one that is interrupted would leave the others waiting for it later on.
    let is_interrupted = found.as_ref().is_err_and(|error| *error == SolveError::Interrupted);
    let any = |team: &Team| team.any(is_interrupted);
    if prepared.team.as_ref().is_some_and(any) { Err(SolveError::Interrupted) } else { found }
}

fn by_one(solver: Solver, prepared: &mut Prepared, request: &Request) -> Result<Found, SolveError> {
    match solver {
        _ if prepared.size == 0.0 => Ok(Found::nothing(prepared.matrix.count())),
        Solver::Jacobi => jacobi::solve(prepared, request),
        Solver::GaussSeidel => gauss_seidel::solve(prepared, request),
        Solver::Chebyshev => chebyshev::solve(prepared, request),
        Solver::ConjugateGradients => conjugate_gradients::solve(prepared, request),
        Solver::Multigrid => multigrid::solve(prepared, request),
        Solver::Direct => direct::solve(prepared),
    }
}

/// Refuses what can be refused before anything is computed.
fn check(system: &System, request: &Request, solver: Solver) -> Result<(), SolveError> {
    let tolerance = request.tolerance;
    if request.precision == Precision::F32 {
        if !solver.has_single() {
            return Err(SolveError::DoubleOnly { solver });
        }
        if tolerance < SINGLE_FLOOR {
            return Err(SolveError::SinglePrecision { tolerance, floor: SINGLE_FLOOR });
        }
    }
    system.check()?;
    if solver.needs_symmetry()
        && let Some([first, second]) = system.asymmetric_pair()
    {
        return Err(SolveError::NotSymmetric { solver, first: first + 1, second: second + 1 });
    }
    Ok(())
}

impl Found {
    /// Without any load the followers stay where they are.
    fn nothing(count: usize) -> Self {
        Self { displacement: Vectors::zeros(count), residuals: vec![0.0], set_up: Duration::ZERO }
    }
}
