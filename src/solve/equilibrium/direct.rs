//! The direct solve: sparse Cholesky where the operator is symmetric, sparse LU elsewhere, both from the
//! library faer.

use faer::linalg::cholesky::llt::factor::LltError::NonPositivePivot;
use faer::prelude::Solve;
use faer::sparse::linalg::LltError;
use faer::sparse::linalg::solvers::{Llt, Lu};
use faer::sparse::{SparseColMat, SparseColMatRef, SymbolicSparseColMatRef};
use faer::{MatMut, Side};

use super::system::Prepared;
use super::{Found, SolveError, Solver, steps};
use crate::flock::vectors::Vectors;
use crate::solve::operator::{HELD, Matrix};
use crate::solve::stopwatch::Stopwatch;

pub(super) fn solve(prepared: &mut Prepared) -> Result<Found, SolveError> {
    let begin = Stopwatch::start();
    let symmetric = prepared.symmetric;
    let sparse = Sparse::new(&prepared.matrix, symmetric);
    let mut unknowns = sparse.unknowns(&prepared.right);
    let n = unknowns.len();
    let right = MatMut::from_column_major_slice_mut(&mut unknowns, n, 1);
    let set_up = if symmetric {
        let factor = sparse.cholesky()?;
        let set_up = begin.elapsed();
        factor.solve_in_place(right);
        set_up
    } else {
        let lu = sparse.lu()?;
        let set_up = begin.elapsed();
        lu.solve_in_place(right);
        set_up
    };
    let displacement = sparse.displacements(&unknowns, prepared.matrix.count());
    let mut r = Vectors::zeros(prepared.matrix.count());
    let fields = (&displacement, &prepared.right);
    let residual = steps::residual(&prepared.matrix, prepared.stencils(), fields, &mut r).sqrt();
    Ok(Found { displacement, residuals: vec![1.0, residual / prepared.size], set_up })
}

/// A matrix by columns: all of it, or its lower triangle.
struct Sparse {
    /// Particle of each pair of unknowns.
    particles: Vec<u32>,
    starts: Vec<usize>,
    rows: Vec<usize>,
    values: Vec<f64>,
}

impl Sparse {
    /// Rows of the matrix are stored as columns: for a symmetric one they are the same, and of any
    /// other this is the transpose.
    fn new(matrix: &Matrix, lower: bool) -> Self {
        let follows = |&i: &u32| matrix.class[i as usize] != HELD;
        let particles: Vec<u32> = (0..matrix.count() as u32).filter(follows).collect();
        let mut place = vec![0; matrix.count()];
        particles.iter().enumerate().for_each(|(p, &i)| place[i as usize] = p);
        let mut sparse = Self { particles, starts: vec![0], rows: Vec::new(), values: Vec::new() };
        let mut order: Vec<(usize, [[f64; 2]; 2])> = Vec::new();
        for run in matrix.runs() {
            let row = matrix.rows.of(run.class);
            for i in run.start as usize..(run.start + run.len) as usize {
                let others = matrix.distances(run)[1..].iter().zip(row.entries);
                let others = others.map(|(&distance, (_, block))| {
                    (place[i.wrapping_add_signed(distance as isize)], block.map(|r| r.map(|v| -v)))
                });
                order.clear();
                order.extend(others.chain([(place[i], *row.diagonal)]));
                order.sort_unstable_by_key(|&(place, _)| place);
                for component in 0..2 {
                    let own = 2 * place[i] + component;
                    for &(there, block) in &order {
                        for other in (0..2).filter(|other| !lower || 2 * there + other >= own) {
                            sparse.rows.push(2 * there + other);
                            sparse.values.push(block[component][other]);
                        }
                    }
                    sparse.starts.push(sparse.rows.len());
                }
            }
        }
        sparse
    }

    fn size(&self) -> usize {
        self.starts.len() - 1
    }

    fn unknowns(&self, field: &Vectors<f64>) -> Vec<f64> {
        self.particles.iter().flat_map(|&i| field.get(i as usize)).collect()
    }

    fn displacements(&self, unknowns: &[f64], count: usize) -> Vectors<f64> {
        let mut field = Vectors::zeros(count);
        for (pair, &i) in unknowns.chunks_exact(2).zip(&self.particles) {
            (field.x[i as usize], field.y[i as usize]) = (pair[0], pair[1]);
        }
        field
    }

    /// As it is stored.
    fn columns(&self) -> SparseColMatRef<'_, usize, f64> {
        let n = self.size();
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, &self.starts, None, &self.rows);
        SparseColMatRef::new(pattern, &self.values[..])
    }

    fn failed(&self, reason: impl std::fmt::Debug) -> SolveError {
        SolveError::Factorisation { unknowns: self.size(), reason: format!("{reason:?}") }
    }

    fn cholesky(&self) -> Result<Llt<usize, f64>, SolveError> {
        self.columns().sp_cholesky(Side::Lower).map_err(|error| match error {
            LltError::Numeric(NonPositivePivot { .. }) => {
                SolveError::NotPositive { solver: Solver::Direct, iteration: 0 }
            }
            LltError::Generic(error) => self.failed(error),
        })
    }

    fn lu(&self) -> Result<Lu<usize, f64>, SolveError> {
        let matrix: SparseColMat<usize, f64> =
            self.columns().transpose().to_col_major().map_err(|error| self.failed(error))?;
        matrix.sp_lu().map_err(|error| self.failed(error))
    }
}
