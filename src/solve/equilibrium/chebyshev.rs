//! Chebyshev's semi-iteration: synchronous sweeps whose damping and memory vary, by the bounds of the
//! spectrum of `D^-1 K`. No sums over the body are needed, so on a machine of many parts none waits.
//!
//! R. S. Varga, *Matrix Iterative Analysis*, chapter 5. The lowest eigenvalue is estimated from above
//! (Lanczos); where the residual shrinks more slowly than the bounds promise, the bound was too high and is
//! lowered, and the iteration begins anew from where it is.

use super::history::History;
use super::lanczos::Bounds;
use super::system::Prepared;
use super::{Found, Request, SolveError, Solver, lanczos, steps};
use crate::flock::vectors::Vectors;
use crate::solve::stopwatch::Stopwatch;

/// Lanczos steps for the bounds.
const ESTIMATE: usize = 60;

/// The largest eigenvalue is found from below.
const SAFETY: f64 = 1.02;

pub(super) fn solve(prepared: &mut Prepared, request: &Request) -> Result<Found, SolveError> {
    let begin = Stopwatch::start();
    let Prepared { matrix, right, size, .. } = &*prepared;
    let stencils = prepared.stencils();
    let Bounds { low, high } = lanczos::both(matrix, stencils, ESTIMATE);
    if low <= 0.0 {
        return Err(SolveError::NotPositive { solver: Solver::Chebyshev, iteration: 0 });
    }
    let (mut low, high) = (low, SAFETY * high);
    let (mut u, mut step) = (Vectors::zeros(matrix.count()), Vectors::zeros(matrix.count()));
    let mut r = right.clone();
    let set_up = begin.elapsed();
    let mut history = History::new(request);
    while history.goes_on(request) {
        let (begun_at, rate) = (history.iterations(), rate(low, high));
        // Half of the promised digits, and never fewer steps than it takes to gain one.
        let window = (2.3 / -rate.ln()).ceil() as usize + 10;
        let mut recurrence = Recurrence::new(low, high);
        loop {
            let factors = recurrence.next();
            steps::precondition(matrix, stencils, factors, &r, &mut step);
            steps::advance(matrix, &step, &mut u);
            let residual = steps::residual(matrix, stencils, (&u, right), &mut r).sqrt() / *size;
            history.push(Solver::Chebyshev, residual)?;
            let taken = history.iterations() - begun_at;
            let promised = 2.0 * rate.powi(taken as i32);
            let slow =
                taken.is_multiple_of(window) && residual > history.residuals[begun_at] * promised.sqrt();
            if slow || !history.goes_on(request) {
                break;
            }
        }
        low *= 0.4;
    }
    Ok(Found { displacement: u, residuals: history.residuals, set_up })
}

/// Factor by which the error shrinks at each step, in the long run.
fn rate(low: f64, high: f64) -> f64 {
    let root = (high / low).sqrt();
    (root - 1.0) / (root + 1.0)
}

/// The factors of the recurrence: `step <- keep step + weight D^-1 r`.
struct Recurrence {
    centre: f64,
    half_width: f64,
    rho: Option<f64>,
}

impl Recurrence {
    fn new(low: f64, high: f64) -> Self {
        Self { centre: f64::midpoint(low, high), half_width: (high - low) / 2.0, rho: None }
    }

    fn next(&mut self) -> (f64, f64) {
        let sigma = self.centre / self.half_width;
        let Some(before) = self.rho else {
            self.rho = Some(1.0 / sigma);
            return (0.0, 1.0 / self.centre);
        };
        let rho = 1.0 / (2.0 * sigma - before);
        self.rho = Some(rho);
        (rho * before, 2.0 * rho / self.half_width)
    }
}
