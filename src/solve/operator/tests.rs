//! The operator compiled is the operator given.

use super::samples::{operator, with_outliers};
use super::*;
use crate::flock::block::apply;
use crate::flock::lattice::LatticeKind;
use crate::flock::vectors::Vectors;

/// Collects `K u` and `D^-1`.
struct Collect {
    product: Vectors<f64>,
}

impl Task<f64> for Collect {
    fn take<const W: usize>(&mut self, particles: &impl Particles<f64, W>, x: &[f64; W], y: &[f64; W]) {
        particles.set(&mut self.product.x, 0, *x);
        particles.set(&mut self.product.y, 0, *y);
    }
}

fn noise(count: usize) -> Vectors<f64> {
    let noise = |i: usize| (i as f64 * 0.618_033_988_749_895).fract() - 0.5;
    Vectors { x: (0..count).map(noise).collect(), y: (count..2 * count).map(noise).collect() }
}

#[test]
fn the_compiled_matrix_is_the_rows_over_the_followers() {
    for kind in LatticeKind::SAMPLES {
        let regular = operator(kind, 41, 53, |i| i < 30 || i % 97 == 5);
        for operator in [with_outliers(&regular).with_held_axes(Vec::new()), regular] {
            assert_compiled(&operator, kind);
        }
    }
}

fn assert_compiled(operator: &Operator, kind: LatticeKind) {
    let matrix = Matrix::of_followers(operator);
    let stencils = RowCoefficients::<f64>::new(&matrix, 2.0);
    let mut u = noise(operator.count());
    for i in (0..operator.count()).filter(|&i| !operator.follows()[i]) {
        (u.x[i], u.y[i]) = (0.0, 0.0);
    }
    let mut found = Collect { product: Vectors::zeros(operator.count()) };
    (0..matrix.groups()).for_each(|group| pass(&matrix, &stencils, group, u.view(), &mut found));
    for (i, site) in operator.columns.sites().enumerate() {
        assert_eq!(operator.columns.find(site).map(|(found, _)| found), Some(i), "{kind:?} {site:?}");
        assert_eq!(operator.columns.column_of(i), operator.outliers.column(site), "{kind:?} {site:?}");
        let mut expected = [0.0; 2];
        if operator.follows()[i] {
            expected = apply(operator.scaled_row(i).diagonal, u.get(i));
            for (offset, block) in operator.scaled_row(i).entries {
                let pull = apply(block, u.get(operator.index_of(site, *offset)));
                expected = [expected[0] - pull[0], expected[1] - pull[1]];
            }
        }
        let found = found.product.get(i);
        assert!((0..2).all(|k| (found[k] - 2.0 * expected[k]).abs() < 1e-13), "{kind:?} {i}");
    }
}

#[test]
fn a_regular_body_has_few_classes_and_long_runs() {
    for kind in LatticeKind::SAMPLES {
        let operator = operator(kind, 60, 61, |i| i < 50);
        let matrix = Matrix::of_followers(&operator);
        assert!(matrix.rows.len() < 80, "{kind:?}: {}", matrix.rows.len());
        assert!(matrix.runs().len() * 6 < operator.count(), "{kind:?}: {}", matrix.runs().len());
    }
}

#[test]
fn rows_that_lead_nowhere_or_are_of_no_class_are_refused() {
    let sites = [[0, 0], [0, 1], [1, 0]];
    let grid = [[1.0, 0.0], [0.0, 1.0]];
    let row = |offset| Row { diagonal: [[1.0, 0.0], [0.0, 1.0]], entries: vec![(offset, Block::default())] };
    let make =
        |class: Vec<u32>, rows: Vec<Row>| Operator::new(&sites, grid, class, rows, vec![true, false, true]);
    assert_eq!(
        make(vec![0, 9, 0], vec![row([0, 1])]).expect_err("no particle there"),
        OperatorError::NoNeighbour { particle: 3, offset: [0, 1] }
    );
    assert_eq!(
        make(vec![0, 9, 1], vec![row([0, 1])]).expect_err("no such class"),
        OperatorError::NoClass { particle: 3, class: 1, rows: 1 }
    );
    let mut spoiled = row([0, 1]);
    spoiled.diagonal[0][1] = f64::NAN;
    assert_eq!(
        make(vec![0, 9, 1], vec![row([0, 1]), spoiled.clone()]).expect_err("leads nowhere, and not finite"),
        OperatorError::NotFinite { particle: 3 }
    );
    assert!(make(vec![0, 9, 1], vec![row([0, 1]), row([-1, 1])]).is_ok());
    let follows = vec![true; 3];
    let refused = Operator::new(&[[0, 1], [0, 0], [1, 0]], grid, vec![0; 3], vec![Row::default()], follows);
    assert_eq!(refused.expect_err("no order"), OperatorError::Order { particle: 2 });
}

#[test]
fn a_pair_that_does_not_feel_each_other_alike_is_found() {
    for kind in LatticeKind::SAMPLES {
        let symmetric = operator(kind, 12, 13, |i| i == 0);
        assert_eq!(symmetric.asymmetric_pair(0..symmetric.count()), None, "{kind:?}");
        let mut other = symmetric.clone();
        let class = other.class[70];
        let mut rows: Vec<Row> = other.rows.iter().map(RowRef::to_row).collect();
        let (offset, block) = &mut rows[class as usize].entries[1];
        block[0][1] += 1e-3;
        let offset = *offset;
        other.rows = Arc::new(Rows::from(rows));
        let [first, second] = other.asymmetric_pair(0..other.count()).expect("not symmetric");
        let sites: Vec<Site> = other.columns.sites().collect();
        let apart = [0, 1].map(|k| sites[second][k] - sites[first][k]);
        let back = apart.map(|step| -step);
        assert!(apart == offset || back == offset, "{kind:?} {apart:?}");
    }
}

#[test]
fn followers_that_no_held_particle_reaches_are_found_however_they_hang_together() {
    for kind in LatticeKind::SAMPLES {
        // Held at one corner only; tall and narrow, so that sweeps alone take long.
        let reached = operator(kind, 3, 400, |i| i == 0);
        assert_eq!(reached.adrift(&Matrix::of_followers(&reached)), None, "{kind:?}");
        let none = operator(kind, 12, 12, |_| false);
        assert_eq!(none.adrift(&Matrix::of_followers(&none)), Some(0), "{kind:?}");
    }
    // Two plates side by side, of which one is held.
    let sites: Vec<Site> = [0, 1, 3, 4].into_iter().flat_map(|i| (0..3).map(move |j| [i, j])).collect();
    let near = [[1, 0], [-1, 0], [0, 1], [0, -1]];
    let row = |i: usize| {
        let there = |offset: Site| sites.binary_search(&add(sites[i], offset)).is_ok();
        let entries: Vec<_> =
            near.into_iter().filter(|&o| there(o)).map(|o| (o, [[1.0, 0.0], [0.0, 1.0]])).collect();
        let count = entries.len() as f64;
        Row { diagonal: [[count, 0.0], [0.0, count]], entries }
    };
    let follows = (0..12).map(|i| i != 4).collect();
    let apart = Operator::from_rows(&sites, [[1.0, 0.0], [0.0, 1.0]], follows, row).expect("an operator");
    assert_eq!(apart.adrift(&Matrix::of_followers(&apart)), Some(6));
}
