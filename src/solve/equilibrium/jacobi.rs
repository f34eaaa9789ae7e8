//! Damped Jacobi: the paper's synchronous sweep of the rule, `u <- u + w D^-1 (f - K u)`.
//!
//! It converges where `w` times the largest eigenvalue of `D^-1 K` is below 2, and the slowest mode
//! shrinks by `1 - w` times the smallest eigenvalue at each step. Where neighbours feel each other alike
//! the largest eigenvalue is estimated (Lanczos); elsewhere the norm of the rows bounds it.

use super::history::History;
use super::system::Prepared;
use super::{Found, Request, SolveError, Solver, lanczos, steps};
use crate::flock::block::{Block, inverse, product};
use crate::flock::vectors::Vectors;
use crate::solve::operator::RowRef;
use crate::solve::stopwatch::Stopwatch;

/// Share of the largest damping that converges; below 1 since the eigenvalue is estimated from within,
/// and the largest mode would not shrink at 1.
const SHARE: f64 = 0.96;

/// Lanczos steps: within a percent of the largest eigenvalue on all lattices.
const ESTIMATE: usize = 20;

pub(super) fn solve(prepared: &mut Prepared, request: &Request) -> Result<Found, SolveError> {
    let begin = Stopwatch::start();
    let Prepared { matrix, right, size, symmetric, .. } = &*prepared;
    let stencils = prepared.stencils();
    let bound = matrix.rows.iter().map(row_sum).fold(1.0, f64::max);
    let largest = if *symmetric { lanczos::largest(matrix, stencils, ESTIMATE).min(bound) } else { bound };
    let weight = SHARE * 2.0 / largest;
    let mut u = Vectors::zeros(matrix.count());
    let mut r = right.clone();
    let set_up = begin.elapsed();
    let mut history = History::new(request);
    while history.goes_on(request) {
        steps::precondition(matrix, stencils, (1.0, weight), &r, &mut u);
        let residual = steps::residual(matrix, stencils, (&u, right), &mut r).sqrt() / *size;
        history.push(Solver::Jacobi, residual)?;
    }
    Ok(Found { displacement: u, residuals: history.residuals, set_up })
}

/// The sum of the norms of a row's blocks of `D^-1 K`: no eigenvalue is larger in modulus than the largest of all rows.
pub(super) fn row_sum(row: RowRef<'_>) -> f64 {
    let norm = |block: &Block| block.iter().flatten().map(|v| v * v).sum::<f64>().sqrt();
    let spectral = |block: &Block| {
        let [[a, b], [c, d]] = *block;
        let (square, determinant) = (norm(block).powi(2), a * d - b * c);
        ((square + (square * square - 4.0 * determinant * determinant).max(0.0).sqrt()) / 2.0).sqrt()
    };
    let inverse = inverse(row.diagonal).unwrap_or_default();
    1.0 + row.entries.iter().map(|(_, block)| spectral(&product(&inverse, block))).sum::<f64>()
}
