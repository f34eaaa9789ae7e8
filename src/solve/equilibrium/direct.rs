//! The direct solve: sparse Cholesky where the operator is symmetric, sparse LU elsewhere, both from the
//! library faer.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltError;
use faer::prelude::Solve;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMat, SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

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
    let set_up = if symmetric {
        let factor = Cholesky::new(&sparse)?;
        let set_up = begin.elapsed();
        factor.solve(&mut unknowns);
        set_up
    } else {
        let lu = sparse.lu()?;
        let set_up = begin.elapsed();
        let n = unknowns.len();
        lu.solve_in_place(MatMut::from_column_major_slice_mut(&mut unknowns, n, 1));
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

    fn lu(&self) -> Result<faer::sparse::linalg::solvers::Lu<usize, f64>, SolveError> {
        let n = self.size();
        let failed = |reason: String| SolveError::Factorisation { unknowns: n, reason };
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, &self.starts, None, &self.rows);
        let transposed = SparseColMatRef::new(pattern, &self.values[..]);
        let matrix: SparseColMat<usize, f64> =
            transposed.transpose().to_col_major().map_err(|e| failed(format!("{e:?}")))?;
        matrix.sp_lu().map_err(|e| failed(format!("{e:?}")))
    }
}

/// The factor `L` of the permuted matrix.
struct Cholesky {
    symbolic: faer::sparse::linalg::cholesky::SymbolicCholesky<usize>,
    values: Vec<f64>,
}

impl Cholesky {
    fn new(sparse: &Sparse) -> Result<Self, SolveError> {
        let n = sparse.size();
        let failed =
            |e: &dyn std::fmt::Debug| SolveError::Factorisation { unknowns: n, reason: format!("{e:?}") };
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, &sparse.starts, None, &sparse.rows);
        let matrix = SparseColMatRef::new(pattern, &sparse.values[..]);
        let params = CholeskySymbolicParams::default();
        let symbolic = factorize_symbolic_cholesky(pattern, Side::Lower, SymmetricOrdering::Amd, params)
            .map_err(|e| failed(&e))?;
        let mut values = Vec::new();
        values.try_reserve_exact(symbolic.len_val()).map_err(|e| failed(&e))?;
        values.resize(symbolic.len_val(), 0.0);
        let need = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        let mut memory = MemBuffer::try_new(need).map_err(|e| failed(&e))?;
        let stack = MemStack::new(&mut memory);
        symbolic
            .factorize_numeric_llt(
                &mut values,
                matrix,
                Side::Lower,
                Default::default(),
                Par::Seq,
                stack,
                Default::default(),
            )
            .map_err(|LltError::NonPositivePivot { index }| SolveError::NotPositive {
                solver: Solver::Direct,
                iteration: index,
            })?;
        Ok(Self { symbolic, values })
    }

    /// Overwrites the right-hand side with the solution.
    fn solve(&self, unknowns: &mut [f64]) {
        let n = unknowns.len();
        let mut memory = MemBuffer::new(self.symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        LltRef::new(&self.symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(unknowns, n, 1),
            Par::Seq,
            MemStack::new(&mut memory),
        );
    }
}
