//! Conjugate gradients preconditioned by multigrid: a V-cycle moves the body on grids that are coarser and
//! coarser, so that a displacement of the whole takes one step and not a walk from particle to particle.
//!
//! * Level 0 are the particles. The nodes of the next level stand every few columns and rows of their
//!   sites (`transfer`), and interpolation is linear along both: translations, rotations and every
//!   uniform strain are among what the coarse grid can do, on every lattice.
//! * Every level's operator is `P' K P` in double precision, by classes (`coarsen`): a rectangle has a
//!   few dozen different rows on each, so that setting up costs little time and next to no memory.
//! * Smoothing is block-Jacobi with Chebyshev's weights of degree 2 before and after (M. F. Adams, M. Brezina,
//!   J. J. Hu, R. S. Tuminaro, Journal of Computational Physics 188, 2003), bounded by an estimate of the
//!   largest eigenvalue of each level.
//! * The coarsest level is solved outright (`envelope`).
//! * Ranks share each level by groups of its columns. Where these become few, the first rank does what is left of the
//!   way down and back up, and the others wait for it: it would take less time than their exchanges. Of a level that they share
//!   each has the columns that it needs (`windows`).
//!
//! The cycle runs in single precision: it begins at zero and its result is only a direction, so what
//! rounding does to it costs no digit of the equilibrium; the iteration around it runs in double precision.

pub(super) mod coarsen;
pub(super) mod descent;
mod envelope;
mod sums;
#[cfg(test)]
mod tests;
pub(super) mod transfer;

use std::sync::Arc;

use self::descent::Descent;
use self::envelope::Envelope;
use self::transfer::{OutlierShares, Transfer};
use super::conjugate_gradients::{Preconditioner, iterate, iterate_single, single_scale};
use super::steps::{for_groups, for_own_groups, side_by_side};
use super::system::Prepared;
use super::{Found, Precision, Request, SolveError, Solver, lanczos, steps};
use crate::flock::halo::Halo;
use crate::flock::vectors::Vectors;
use crate::ranks::Team;
use crate::solve::field::{Real, dot};
use crate::solve::operator::{Matrix, RowCoefficients};
use crate::solve::part::{Part, receive};
use crate::solve::stopwatch::Stopwatch;

/// Lanczos steps for the largest eigenvalue of each level, and what its estimate is raised by.
const ESTIMATE: usize = 8;
const SAFETY: f64 = 1.06;

/// Largest over smallest eigenvalue that the smoother is to dampen; what is below is left to the coarser
/// level.
const SMOOTHED: f64 = 5.0;

pub(super) fn solve(prepared: &mut Prepared, request: &Request) -> Result<Found, SolveError> {
    let begin = Stopwatch::start();
    let right = std::mem::take(&mut prepared.right);
    let mut cycle = match prepared.matrix.window {
        None => side_by_side(|| Cycle::new(&prepared.matrix, prepared.grid), || prepared.stencils()).0,
        Some(_) => Cycle::in_windows(prepared),
    }?;
    let set_up = begin.elapsed();
    tracing::debug!(levels = cycle.levels.len() + 1, "multigrid is set up");
    let found = match request.precision {
        Precision::F64 => {
            iterate(prepared, prepared.stencils(), right, &mut cycle, request, Solver::Multigrid)
        }
        Precision::F32 => {
            let finest = cycle.smoothers.first().map(|smoother| smoother.stencils.clone());
            let stencils = finest
                .unwrap_or_else(|| RowCoefficients::new(&prepared.matrix, single_scale(&prepared.matrix)));
            iterate_single(prepared, &stencils, right, &mut cycle, request, Solver::Multigrid)
        }
    }?;
    Ok(Found { set_up: found.set_up + set_up, ..found })
}

/// All levels of a body.
struct Cycle<'a> {
    matrix: &'a Matrix,
    vectors: LevelVectors,
    /// Of each level but the coarsest, the finest first.
    smoothers: Vec<Smoother>,
    /// The way down from each of them.
    levels: Vec<Level>,
    coarsest: Option<Envelope>,
}

/// A coarser level, and how it is reached.
struct Level {
    transfer: Transfer,
    outliers: OutlierShares,
    matrix: Arc<Matrix>,
    vectors: LevelVectors,
    /// Between ranks, where they share the levels.
    transfers: Option<Transfers>,
}

/// What a rank receives to get from one level to the next and back.
struct Transfers {
    team: Team,
    /// Of the finer level, for the restriction.
    down: Halo,
    /// Of the coarser level, for the interpolation.
    up: Halo,
}

impl Transfers {
    fn new([fine, coarse]: [(&Part, &Matrix); 2], transfer: Transfer) -> Self {
        let (team, levels) = (fine.0.team.clone(), (fine.1, coarse.1));
        let [fine, coarse] = [&fine.0.cuts, &coarse.0.cuts];
        let read_down = |rank: usize| transfer.restricted_from(levels, &coarse.groups_of(rank));
        let read_up = |rank: usize| transfer.prolonged_from(levels, &fine.groups_of(rank));
        let rank = team.rank();
        let (down, up) = (fine.halo(rank, read_down), coarse.halo(rank, read_up));
        Self { team, down: down.here(levels.0.first()), up: up.here(levels.1.first()) }
    }
}

/// The vectors of a level.
struct LevelVectors {
    f: Vectors<f32>,
    u: Vectors<f32>,
    v: Vectors<f32>,
}

impl LevelVectors {
    fn new(count: usize) -> Self {
        Self { f: Vectors::zeros(count), u: Vectors::zeros(count), v: Vectors::zeros(count) }
    }
}

/// What a level is smoothed with.
struct Smoother {
    stencils: RowCoefficients<f32>,
    /// Weights of two sweeps that dampen all eigenvalues from a share of the largest to the largest best.
    weights: [f64; 2],
}

impl Smoother {
    /// The rows of a level multiplied by `scale`; `None` if its matrix is not positive.
    fn new(matrix: &Matrix, scale: f64) -> Option<Self> {
        let stencils = RowCoefficients::new(matrix, scale);
        let high = SAFETY * lanczos::largest(matrix, &stencils, ESTIMATE);
        let low = high / SMOOTHED;
        let weight = |k: f64| {
            let node = (std::f64::consts::PI * k / 4.0).cos();
            1.0 / (f64::midpoint(high, low) + (high - low) / 2.0 * node)
        };
        high.is_finite().then(|| Self { stencils, weights: [1.0, 3.0].map(weight) })
    }
}

const NOT_POSITIVE: SolveError = SolveError::NotPositive { solver: Solver::Multigrid, iteration: 0 };

impl<'a> Cycle<'a> {
    fn of_finest(matrix: &'a Matrix) -> Self {
        let vectors = LevelVectors::new(matrix.count());
        Self { matrix, vectors, smoothers: Vec::new(), levels: Vec::new(), coarsest: None }
    }

    fn new(matrix: &'a Matrix, grid: [[f64; 2]; 2]) -> Result<Self, SolveError> {
        let mut cycle = Self::of_finest(matrix);
        cycle.go_down(single_scale(matrix), Descent::new(grid))?;
        Ok(cycle)
    }

    /// The same where each rank has windows of the levels that they share; the first one goes on alone.
    fn in_windows(prepared: &'a Prepared) -> Result<Self, SolveError> {
        let matrix = &prepared.matrix;
        let mut cycle = Self::of_finest(matrix);
        let (scale, mut descent) = (single_scale(matrix), Descent::new(prepared.grid));
        let of_levels = || {
            for (transfer, coarse) in &prepared.coarser {
                let fine = cycle.coarsest_matrix();
                let smoother = Smoother::new(fine, scale).ok_or(NOT_POSITIVE)?;
                let level = Level::in_window(fine, coarse, *transfer);
                cycle.smoothers.push(smoother);
                descent.go(*transfer);
                cycle.levels.push(level);
            }
            let is_left_to_this = !cycle.coarsest_matrix().own_groups().is_empty();
            if is_left_to_this { cycle.go_down(scale, descent) } else { Ok(()) }
        };
        let is_over = of_levels().is_err();
        let any = prepared.team.as_ref().is_some_and(|team| team.any(is_over));
        if any { Err(NOT_POSITIVE) } else { Ok(cycle) }
    }

    /// Adds the levels from here on, each of which this rank has whole.
    fn go_down(&mut self, scale: f64, mut descent: Descent) -> Result<(), SolveError> {
        loop {
            let fine = self.coarsest_matrix();
            let next = descent.next((fine.count(), fine.columns.extent()), || particles_per_site(fine));
            let Some(transfer) = next else { break };
            let (level, smoother) =
                side_by_side(|| Level::new(fine, transfer), || Smoother::new(fine, scale));
            if level.matrix.count() >= fine.count() {
                break;
            }
            self.smoothers.push(smoother.ok_or(NOT_POSITIVE)?);
            descent.go(transfer);
            self.levels.push(level);
        }
        let coarsest = Envelope::new(self.coarsest_matrix(), scale, !self.matrix.outliers.is_empty());
        self.coarsest = Some(coarsest.ok_or(NOT_POSITIVE)?);
        Ok(())
    }

    fn coarsest_matrix(&self) -> &Matrix {
        self.levels.last().map_or(self.matrix, |level| &*level.matrix)
    }

    /// `v` of the finest level becomes the cycle's answer to its `f`.
    fn run(&mut self) {
        let Self { matrix, vectors, smoothers, levels, coarsest } = self;
        descend(matrix, vectors, (smoothers, levels), coarsest.as_mut());
    }
}

fn descend(
    matrix: &Matrix,
    vectors: &mut LevelVectors,
    (smoothers, below): (&[Smoother], &mut [Level]),
    coarsest: Option<&mut Envelope>,
) {
    let LevelVectors { f, u, v } = vectors;
    let (Some((Smoother { stencils, weights }, smoothers)), Some((next, further))) =
        (smoothers.split_first(), below.split_first_mut())
    else {
        // Of levels that are left to the first rank the others have nothing.
        coarsest.into_iter().for_each(|coarsest| coarsest.solve((&f.x, &f.y), (&mut v.x, &mut v.y)));
        return;
    };
    steps::precondition(matrix, stencils, (0.0, weights[0]), f, u);
    matrix.receive(u);
    steps::smooth(matrix, stencils, weights[1], (u, f), v);
    matrix.receive(v);
    steps::residual_of_groups(matrix, stencils, (v, f), u);
    if let Some(Transfers { team, down, .. }) = &next.transfers {
        receive(down, team, u);
    }
    let levels = (matrix, &*next.matrix);
    next.transfer.restrict(levels, &next.outliers, u, &mut next.vectors.f);
    descend(&next.matrix, &mut next.vectors, (smoothers, further), coarsest);
    if let Some(Transfers { team, up, .. }) = &next.transfers {
        receive(up, team, &mut next.vectors.v);
    }
    next.transfer.prolong(levels, &next.outliers, &next.vectors.v, v);
    matrix.receive(v);
    steps::smooth(matrix, stencils, weights[1], (v, f), u);
    matrix.receive(u);
    steps::smooth(matrix, stencils, weights[0], (u, f), v);
}

impl Level {
    /// Of a grid that one rank has whole.
    fn new(fine: &Matrix, transfer: Transfer) -> Self {
        let (matrix, outliers) = coarsen::coarsen(fine, transfer);
        let vectors = LevelVectors::new(matrix.count());
        Self { transfer, outliers, matrix: Arc::new(matrix), vectors, transfers: None }
    }

    /// The same of a level that is set up.
    fn in_window(fine: &Matrix, coarse: &Arc<Matrix>, transfer: Transfer) -> Self {
        let outliers = coarsen::outlier_shares(fine, transfer, coarse);
        let parts = fine.part.as_deref().zip(coarse.part.as_deref());
        let transfers =
            parts.map(|(above, here)| Transfers::new([(above, fine), (here, &**coarse)], transfer));
        let vectors = LevelVectors::new(coarse.count());
        Self { transfer, outliers, matrix: coarse.clone(), vectors, transfers }
    }
}

/// One on lattices that have a particle at every column and row, less on others.
fn particles_per_site(matrix: &Matrix) -> f64 {
    let columns: Vec<i32> = matrix.columns.range().filter(|&i| !matrix.columns.of(i).is_empty()).collect();
    let occupied = columns.len() as f64 / matrix.columns.range().len().max(1) as f64;
    occupied / f64::from(matrix.columns.step())
}

impl<T: Real> Preconditioner<T> for Cycle<'_> {
    type Z = f32;

    fn precondition(&mut self, r: &Vectors<T>, size: f64) -> (&Vectors<f32>, f64) {
        let f = &mut self.vectors.f;
        let scale = 1.0 / size;
        for_own_groups(self.matrix, self.matrix.own_parts(f), |_, f| {
            let r = r.view().range(f.range());
            let cast = |f: &mut [f32], r: &[T]| {
                f.iter_mut().zip(r).for_each(|(f, r)| *f = (r.wide() * scale) as f32);
            };
            cast(f.x, r.x);
            cast(f.y, r.y);
        });
        self.run();
        let z = &self.vectors.v;
        let own = self.matrix.own_groups();
        let groups =
            self.matrix.bounds[own.start..=own.end].windows(2).map(|ends| ends[0]..ends[1]).collect();
        let sums = for_groups(groups, |_, range: std::ops::Range<usize>| {
            dot(z.view().range(range.clone()), r.view().range(range))
        });
        (z, self.matrix.sum(&sums))
    }
}
