//! Preconditioned conjugate gradients.
//!
//! M. R. Hestenes and E. Stiefel, Journal of Research of the National Bureau of Standards 49, 1952. By
//! itself the solver takes `D^-1` for a preconditioner: the rule's own step is the direction that it makes
//! conjugate to those before. With [`super::multigrid`] the number of iterations stops growing.

use super::history::History;
use super::steps::{for_groups, for_own_groups};
use super::system::Prepared;
use super::{Found, Precision, Request, SolveError, Solver, steps};
use crate::flock::vectors::Vectors;
use crate::solve::field::{Real, VectorsMut, VectorsRef, dot};
use crate::solve::operator::{Matrix, RowCoefficients};
use crate::solve::stopwatch::Stopwatch;

/// An approximation of `K^-1`, symmetric and positive.
pub(super) trait Preconditioner<T: Real> {
    /// The type that it computes in: half as wide as the iteration's, or as wide.
    type Z: Real;

    /// `z`, an approximation of `K^-1 r / size` up to a factor; `size` is the order of magnitude of `r`.
    /// Returns `r . z` as well.
    fn precondition(&mut self, r: &Vectors<T>, size: f64) -> (&Vectors<Self::Z>, f64);
}

pub(super) fn solve(prepared: &mut Prepared, request: &Request) -> Result<Found, SolveError> {
    let right = std::mem::take(&mut prepared.right);
    let matrix = &prepared.matrix;
    match request.precision {
        Precision::F64 => {
            let mut jacobi =
                BlockJacobi { matrix, stencils: prepared.stencils(), z: Vectors::zeros(right.len()) };
            iterate(prepared, prepared.stencils(), right, &mut jacobi, request, Solver::ConjugateGradients)
        }
        Precision::F32 => {
            let stencils = RowCoefficients::<f32>::new(matrix, single_scale(matrix));
            let mut jacobi = BlockJacobi { matrix, stencils: &stencils, z: Vectors::zeros(right.len()) };
            iterate_single(prepared, &stencils, right, &mut jacobi, request, Solver::ConjugateGradients)
        }
    }
}

/// The inverse of the largest stiffness: in single precision the rows are scaled by it, so that neither
/// pascals nor parts of them overflow.
pub(super) fn single_scale(matrix: &Matrix) -> f64 {
    1.0 / matrix.largest().max(f64::MIN_POSITIVE)
}

/// The whole iteration in single precision: right-hand side and rows scaled to about 1.
pub(super) fn iterate_single<P: Preconditioner<f32>>(
    prepared: &Prepared,
    stencils: &RowCoefficients<f32>,
    right: Vectors<f64>,
    preconditioner: &mut P,
    request: &Request,
    solver: Solver,
) -> Result<Found, SolveError> {
    let (scale, size) = (single_scale(&prepared.matrix), prepared.size);
    let narrow = |values: Vec<f64>| values.into_iter().map(|v| (v / size) as f32).collect();
    let right = Vectors { x: narrow(right.x), y: narrow(right.y) };
    let found = iterate(prepared, stencils, right, preconditioner, request, solver)?;
    let widen = |values: Vec<f64>| values.into_iter().map(|v| v * size * scale).collect();
    let displacement = Vectors { x: widen(found.displacement.x), y: widen(found.displacement.y) };
    Ok(Found { displacement, ..found })
}

/// Conjugate gradients from zero. `right` becomes the residual. Of a matrix that ranks share each has the result of its window.
pub(super) fn iterate<T: Real, P: Preconditioner<T>>(
    prepared: &Prepared,
    stencils: &RowCoefficients<T>,
    right: Vectors<T>,
    preconditioner: &mut P,
    request: &Request,
    solver: Solver,
) -> Result<Found, SolveError> {
    let begin = Stopwatch::start();
    let matrix = &prepared.matrix;
    let mut r = right;
    let zeros = || Vectors::<T>::zeros(r.len());
    let (mut x, mut p, mut q) = (zeros(), zeros(), zeros());
    let at_start = matrix.square(&r).sqrt();
    let (mut size, mut rz_before) = (at_start, f64::INFINITY);
    let set_up = begin.elapsed();
    let mut history = History::new(request);
    while history.goes_on(request) {
        let iteration = history.iterations() + 1;
        let (z, rz) = preconditioner.precondition(&r, size);
        let rz = rz * size;
        let positive = rz > 0.0;
        if !positive {
            return Err(SolveError::NotPositive { solver, iteration });
        }
        turn(matrix, (size, z), rz / rz_before, &mut p);
        matrix.receive(&mut p);
        let pq = steps::apply(matrix, stencils, &p, &mut q);
        let positive = pq > 0.0;
        if !positive {
            return Err(SolveError::NotPositive { solver, iteration });
        }
        let squares = advance(matrix, rz / pq, (&p, &q), (&mut x, &mut r));
        let (square, is_interrupted) = matrix.sum_and_any(&squares, request.interrupt.is_raised());
        size = square.sqrt();
        rz_before = rz;
        history.push_agreed(solver, size / at_start, is_interrupted)?;
    }
    matrix.receive(&mut x);
    let wide = |values: Vec<T>| values.into_iter().map(Real::wide).collect();
    Ok(Found { displacement: Vectors { x: wide(x.x), y: wide(x.y) }, residuals: history.residuals, set_up })
}

/// `p = size z + ratio p`.
fn turn<T: Real, Z: Real>(matrix: &Matrix, (size, z): (f64, &Vectors<Z>), ratio: f64, p: &mut Vectors<T>) {
    let (size, ratio) = (T::of(size), T::of(ratio));
    for_own_groups(matrix, matrix.own_parts(p), |_, p| {
        let z = z.view().range(p.range());
        let turn = |p: &mut [T], z: &[Z]| {
            p.iter_mut().zip(z).for_each(|(p, z)| *p = size * T::of(z.wide()) + ratio * *p);
        };
        turn(p.x, z.x);
        turn(p.y, z.y);
    });
}

/// `x += step p` and `r -= step q`; returns the square of `r` over each group of this rank.
fn advance<T: Real>(
    matrix: &Matrix,
    step: f64,
    (p, q): (&Vectors<T>, &Vectors<T>),
    (x, r): (&mut Vectors<T>, &mut Vectors<T>),
) -> Vec<f64> {
    let step = T::of(step);
    let groups = matrix.own_parts(x).into_iter().zip(matrix.own_parts(r)).collect();
    for_groups(groups, |_, (x, r): (VectorsMut<'_, T>, VectorsMut<'_, T>)| {
        let (p, q) = (p.view().range(x.range()), q.view().range(x.range()));
        let advance = |x: &mut [T], p: &[T]| x.iter_mut().zip(p).for_each(|(x, &p)| *x += step * p);
        let retreat = |r: &mut [T], q: &[T]| r.iter_mut().zip(q).for_each(|(r, &q)| *r = *r - step * q);
        advance(x.x, p.x);
        advance(x.y, p.y);
        retreat(r.x, q.x);
        retreat(r.y, q.y);
        let r = VectorsRef { x: &*r.x, y: &*r.y };
        dot(r, r)
    })
}

/// `D^-1` of the rows.
pub(super) struct BlockJacobi<'a, T> {
    pub matrix: &'a Matrix,
    pub stencils: &'a RowCoefficients<T>,
    pub z: Vectors<T>,
}

impl<T: Real> Preconditioner<T> for BlockJacobi<'_, T> {
    type Z = T;

    fn precondition(&mut self, r: &Vectors<T>, size: f64) -> (&Vectors<T>, f64) {
        let (matrix, stencils) = (self.matrix, self.stencils);
        let sums = for_own_groups(matrix, matrix.own_parts(&mut self.z), |group, z| {
            let range = z.range();
            let part = VectorsMut { begin: z.begin, x: &mut *z.x, y: &mut *z.y };
            steps::precondition_group(matrix, stencils, (0.0, 1.0 / size), r.view(), group, part);
            dot(VectorsRef { x: &*z.x, y: &*z.y }, r.view().range(range))
        });
        (&self.z, matrix.sum(&sums))
    }
}
