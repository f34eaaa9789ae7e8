//! The parts of the cycle, on every lattice.

use super::coarsen::coarsen;
use super::descent::{first_steps, next_steps, spacing_of};
use super::envelope::Envelope;
use super::transfer::{OutlierShares, Transfer};
use super::*;
use crate::flock::lattice::{Lattice, LatticeKind, Site};
use crate::solve::operator::samples::{operator, with_outliers};
use crate::solve::operator::{HELD, Row, RowRef};

fn dense(matrix: &Matrix) -> Vec<Vec<f64>> {
    let stencils = RowCoefficients::<f64>::new(matrix, 1.0);
    columns(matrix.count(), |unit| {
        let mut out = Vectors::zeros(matrix.count());
        steps::apply(matrix, &stencils, unit, &mut out);
        out
    })
}

/// The images of the unit displacements under a linear map, x components first.
fn columns<T: Real>(count: usize, map: impl Fn(&Vectors<T>) -> Vectors<T>) -> Vec<Vec<f64>> {
    (0..2 * count)
        .map(|k| {
            let mut unit = Vectors::zeros(count);
            if k < count {
                unit.x[k] = T::of(1.0)
            } else {
                unit.y[k - count] = T::of(1.0)
            }
            let out = map(&unit);
            out.x.iter().chain(&out.y).map(|value| value.wide()).collect()
        })
        .collect()
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Every way a lattice may be coarsened, and the matrices above and below.
fn each_coarsening(test: impl Fn(LatticeKind, &Matrix, &(Matrix, OutlierShares), Transfer)) {
    for kind in LatticeKind::SAMPLES {
        let regular = operator(kind, 11, 13, |i| i < 9 || i == 50);
        let operators = [with_outliers(&regular), regular];
        for fine in operators.iter().map(Matrix::of_followers) {
            let lattice = Lattice::new(kind, [0.0; 2], 0.2);
            let spacing = spacing_of([lattice.vector([1, 0]), lattice.vector([0, 1])]);
            let first = first_steps(spacing, particles_per_site(&fine));
            for steps in [first, [2, 2], [1, 2], [2, 1], [3, 4]] {
                let transfer = Transfer { steps };
                let coarse = coarsen(&fine, transfer);
                test(kind, &fine, &coarse, transfer);
                // And again, from a grid without gaps.
                let transfer = Transfer { steps: [2, 2] };
                test(kind, &coarse.0, &coarsen(&coarse.0, transfer), transfer);
            }
        }
    }
}

#[test]
fn the_coarse_operator_is_the_triple_product() {
    each_coarsening(|kind, fine, (coarse, shares), transfer| {
        let k = dense(fine);
        let p = columns(coarse.count(), |unit| {
            let mut out = Vectors::zeros(fine.count());
            transfer.prolong((fine, coarse), shares, unit, &mut out);
            out
        });
        let coarse = dense(coarse);
        for (a, column) in p.iter().enumerate() {
            let kp: Vec<f64> = (0..k.len()).map(|row| product(&k[row], column)).collect();
            for (b, other) in p.iter().enumerate() {
                // K is symmetric: its columns are its rows.
                let error = (coarse[a][b] - product(other, &kp)).abs();
                assert!(error < 1e-6, "{kind:?} {transfer:?}: {error}");
            }
        }
    });
}

#[test]
fn restriction_is_the_transpose_of_interpolation() {
    each_coarsening(|kind, fine, (coarse, shares), transfer| {
        let p = columns(coarse.count(), |unit| {
            let mut out = Vectors::zeros(fine.count());
            transfer.prolong((fine, coarse), shares, unit, &mut out);
            out
        });
        let r = columns(fine.count(), |unit| {
            let mut out = Vectors::zeros(coarse.count());
            transfer.restrict((fine, coarse), shares, unit, &mut out);
            out
        });
        for (i, row) in r.iter().enumerate().filter(|(i, _)| fine.class[i % fine.count()] != HELD) {
            for (j, value) in row.iter().enumerate() {
                assert!((value - p[j][i]).abs() < 1e-6, "{kind:?} {transfer:?} {i} {j}");
            }
        }
    });
}

#[test]
fn the_coarse_space_contains_translations_rotations_and_uniform_strains() {
    each_coarsening(|kind, fine, (coarse, shares), transfer| {
        let affine = |[i, j]: [f64; 2]| [0.5 - 0.3 * i + 0.7 * j, -0.25 + 0.2 * i + 0.1 * j];
        let mut nodes = Vectors::zeros(coarse.count());
        for (node, [i, j]) in coarse.columns.sites().enumerate() {
            let at = [i * transfer.steps[0], j * transfer.steps[1]].map(f64::from);
            let [x, y] = affine(at);
            (nodes.x[node], nodes.y[node]) = (x as f32, y as f32);
        }
        let mut found = Vectors::zeros(fine.count());
        transfer.prolong((fine, coarse), shares, &nodes, &mut found);
        for site in fine.columns.sites() {
            let (i, _) = fine.columns.find(site).expect("a follower");
            let (found, expected) = (found.get(i), affine(fine.outliers.place(site)));
            let error = (0..2).map(|k| (f64::from(found[k]) - expected[k]).abs()).fold(0.0, f64::max);
            assert!(error < 1e-5, "{kind:?} {transfer:?} {site:?}: {error}");
        }
        assert!((0..fine.count()).all(|i| fine.class[i] != HELD || found.get(i) == [0.0; 2]));
    });
}

#[test]
fn a_place_at_a_node_is_that_node_s_alone() {
    // Places come from coordinates and have their rounding.
    let shares = super::transfer::parents_of_place([6.0 + 1e-14, 4.0 - 1e-13], [2, 2]);
    let taken: Vec<_> = shares.into_iter().filter(|(_, share)| *share > 0.0).collect();
    assert_eq!(taken, [([3, 2], 1.0)]);
}

#[test]
fn the_envelope_solves_what_it_factorised() {
    for kind in LatticeKind::SAMPLES {
        for (columns, rows) in [(9, 21), (21, 9)] {
            let matrix = Matrix::of_followers(&operator(kind, columns, rows, |i| i < 5 || i == 40));
            let mut factor = Envelope::new(&matrix, 1.0, false).expect("positive");
            let mut exact = Vectors::<f32>::zeros(matrix.count());
            for (i, _) in matrix.class.iter().enumerate().filter(|(_, class)| **class != HELD) {
                exact.x[i] = (i as f32 * 0.7).sin();
                exact.y[i] = (i as f32 * 0.3).cos();
            }
            let mut f = Vectors::zeros(matrix.count());
            steps::apply(&matrix, &RowCoefficients::<f32>::new(&matrix, 1.0), &exact, &mut f);
            let mut found = Vectors::zeros(matrix.count());
            factor.solve((&f.x, &f.y), (&mut found.x, &mut found.y));
            let worst = (0..matrix.count()).map(|i| (found.x[i] - exact.x[i]).abs()).fold(0.0, f32::max);
            assert!(worst < 1e-3, "{kind:?}: {worst}");
        }
    }
}

#[test]
fn the_envelope_refuses_what_is_not_positive_and_leaves_out_what_is_nothing() {
    let mut matrix = Matrix::of_followers(&operator(LatticeKind::SAMPLES[0], 9, 9, |i| i < 5));
    let mut rows: Vec<Row> = matrix.rows.iter().map(RowRef::to_row).collect();
    rows.iter_mut().for_each(|row| row.diagonal[1][1] -= 2.0);
    matrix.rows = rows.into();
    assert!(Envelope::new(&matrix, 1.0, false).is_none());
    // A strip one particle wide between two columns of nodes: they are twice as many as can move.
    let sites: Vec<Site> = (0..40).map(|j| [1, j]).collect();
    let row = |j: usize| {
        let entries: Vec<_> = [[0, -1], [0, 1]]
            .into_iter()
            .filter(|o: &Site| (0..40).contains(&(j as i32 + o[1])))
            .map(|offset| (offset, [[1.0, 0.0], [0.0, 1.0]]))
            .collect();
        let count = entries.len() as f64;
        Row { diagonal: [[count, 0.0], [0.0, count]], entries }
    };
    let grid = [[1.0, 0.0], [0.0, 1.0]];
    let follows = (0..40).map(|j| j > 0).collect();
    let strip = crate::solve::operator::Operator::from_rows(&sites, grid, follows, row).expect("rows");
    let fine = Matrix::of_followers(&strip);
    let transfer = Transfer { steps: [2, 2] };
    let (coarse, none) = coarsen(&fine, transfer);
    let mut factor = Envelope::new(&coarse, 1.0, false).expect("not negative");
    // The force of a displacement that the coarse grid can have, on the coarse grid.
    let mut nodes = Vectors::<f32>::zeros(coarse.count());
    nodes.x.iter_mut().enumerate().for_each(|(k, x)| *x = (k as f32 * 0.4).sin());
    let mut exact = Vectors::zeros(fine.count());
    transfer.prolong((&fine, &coarse), &none, &nodes, &mut exact);
    let (mut f, mut coarse_f) = (Vectors::zeros(fine.count()), Vectors::zeros(coarse.count()));
    steps::apply(&fine, &RowCoefficients::<f32>::new(&fine, 1.0), &exact, &mut f);
    transfer.restrict((&fine, &coarse), &none, &f, &mut coarse_f);
    let (mut solved, mut found) = (Vectors::zeros(coarse.count()), Vectors::zeros(fine.count()));
    factor.solve((&coarse_f.x, &coarse_f.y), (&mut solved.x, &mut solved.y));
    transfer.prolong((&fine, &coarse), &none, &solved, &mut found);
    let worst = (0..40).map(|i| (found.x[i] - exact.x[i]).abs()).fold(0.0, f32::max);
    assert!(worst < 1e-3 && exact.x.iter().any(|x| x.abs() > 0.2), "{worst}");
}

#[test]
fn nodes_lie_about_as_far_apart_both_ways_and_stand_for_about_four_particles() {
    let lattices = LatticeKind::SAMPLES.into_iter().chain([
        LatticeKind::Rectangular { a: 1.0, b: 4.0 },
        LatticeKind::Rectangular { a: 3.0, b: 1.0 },
        LatticeKind::CentredRectangular { a: 1.0, b: 3.0 },
    ]);
    for kind in lattices {
        let lattice = Lattice::new(kind, [0.0; 2], 0.0);
        let mut spacing = spacing_of([lattice.vector([1, 0]), lattice.vector([0, 1])]);
        let fine = Matrix::of_followers(&operator(kind, 24, 24, |i| i == 0));
        let steps = first_steps(spacing, particles_per_site(&fine));
        spacing = [0, 1].map(|k| spacing[k] * f64::from(steps[k]));
        let ratio = fine.count() as f64 / coarsen(&fine, Transfer { steps }).0.count() as f64;
        println!("{kind:?} {steps:?} {spacing:?} {ratio}");
        assert!((1.9..5.0).contains(&ratio), "{kind:?} {steps:?}: {ratio}");
        for _ in 0..3 {
            let aspect = (spacing[0] / spacing[1]).ln().abs();
            assert!(aspect < 2f64.ln(), "{kind:?} {steps:?}: {spacing:?}");
            let next = next_steps(spacing);
            spacing = [0, 1].map(|k| spacing[k] * f64::from(next[k]));
        }
    }
}
