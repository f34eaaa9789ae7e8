//! What has no equilibrium, or none that a solver can find, is refused by name.

use flockform::flock::block::Block;
use flockform::flock::lattice::Site;
use flockform::flock::vectors::Vectors;
use flockform::solve::equilibrium::{
    Choice, Precision, Request, SINGLE_FLOOR, SolveError, Solver, System, choose, solve,
};
use flockform::solve::operator::{Operator, Row};

use crate::support::{Feel, KINDS, body, by, difference, operator, plate, solved};

const GRID: [[f64; 2]; 2] = [[1.0, 0.0], [0.0, 1.0]];

fn times(factor: f64) -> Block {
    [[factor, 0.0], [0.0, factor]]
}

/// A chain of particles of which the first is held; each weighs the one before and the one after.
fn chain(count: i32, weigh: impl Fn(i32) -> [f64; 2]) -> System {
    let sites: Vec<Site> = (0..count).map(|i| [i, 0]).collect();
    let row = |i: usize| {
        let [before, after] = weigh(i as i32);
        let beside = [([-1, 0], before), ([1, 0], after)];
        let there = |offset: Site| (0..count).contains(&(i as i32 + offset[0]));
        let entries: Vec<_> =
            beside.into_iter().filter(|&(o, _)| there(o)).map(|(o, weight)| (o, times(weight))).collect();
        Row { diagonal: times(entries.iter().map(|(_, block)| block[0][0]).sum()), entries }
    };
    let follows = (0..count).map(|i| i > 0).collect();
    let operator = Operator::from_rows(&sites, GRID, follows, row).expect("an operator");
    let forces = (0..count).map(|i| [1.0, f64::from(i)]).collect();
    System::new(operator, forces, Vectors::zeros(count as usize))
}

fn refused(system: &System, solver: Solver) -> SolveError {
    let outcome = solve(system, &by(solver, 1e-8)).map(|solved| solved.iterations);
    outcome.expect_err("refused")
}

#[test]
fn an_operator_without_symmetry_names_a_pair_and_the_other_solvers_agree() {
    let system = chain(30, |i| if i == 7 { [1.0, 1.5] } else { [1.0, 1.0] });
    for solver in [Solver::Chebyshev, Solver::ConjugateGradients, Solver::Multigrid] {
        let error = refused(&system, solver);
        let expected = SolveError::NotSymmetric { solver, first: 8, second: 9 };
        assert_eq!(error, expected);
        assert!(error.to_string().contains("particles 8 and 9"), "{error}");
    }
    let truth = solved(&system, Solver::Direct, 1e-10).displacement;
    for solver in [Solver::Jacobi, Solver::GaussSeidel] {
        assert!(difference(&solved(&system, solver, 1e-12).displacement, &truth) < 1e-8, "{solver}");
    }
    let (solver, why) = choose(&system, &Request::default());
    assert!(!solver.needs_symmetry() && why.contains("do not feel each other alike"), "{solver} {why}");
}

#[test]
fn bodies_that_nothing_holds_are_refused() {
    let (plate, neighbours) = body(KINDS[3], [6, 5], plate);
    let count = plate.count();
    let loads = || (Vectors::zeros(count), Vectors::zeros(count));
    let with = |held: &dyn Fn(usize) -> bool| {
        let (forces, at) = loads();
        System::new(operator(&plate, neighbours.clone(), Feel::Material, held), forces, at)
    };
    assert_eq!(refused(&with(&|_| true), Solver::Multigrid), SolveError::NothingFollows);
    assert_eq!(refused(&with(&|_| false), Solver::Jacobi), SolveError::Adrift { particle: 1 });
    let mut loose = chain(9, |i| if i < 5 { [1.0, 1.0] } else { [0.0, 0.0] });
    assert_eq!(refused(&loose, Solver::GaussSeidel), SolveError::Loose { particle: 6 });
    loose.forces.x[3] = f64::NAN;
    let not_finite = SolveError::NotFinite { what: "force", particle: 4 };
    assert_eq!(refused(&loose, Solver::GaussSeidel), not_finite);
    loose.held = Vectors::zeros(2);
    let shapes = SolveError::Shapes { forces: 9, held: 2, particles: 9 };
    assert_eq!(refused(&loose, Solver::GaussSeidel), shapes);
}

#[test]
fn a_body_that_gains_energy_by_moving_is_found_out() {
    // Springs that push where they should pull, weak enough that every particle by itself is held back.
    let unstable = chain(40, |i| if i % 2 == 0 { [-0.9, 1.0] } else { [1.0, -0.9] });
    for solver in [Solver::ConjugateGradients, Solver::Multigrid, Solver::Chebyshev, Solver::Direct] {
        let error = refused(&unstable, solver);
        assert!(matches!(error, SolveError::NotPositive { .. }), "{solver}: {error}");
    }
    for solver in [Solver::Jacobi, Solver::GaussSeidel] {
        let error = refused(&unstable, solver);
        assert!(matches!(error, SolveError::Diverged { .. }), "{solver}: {error}");
    }
}

#[test]
fn an_automatic_choice_asks_a_factorisation_before_it_calls_a_body_unstable() {
    let unstable = chain(2000, |i| if i % 2 == 0 { [-0.9, 1.0] } else { [1.0, -0.9] });
    assert_eq!(choose(&unstable, &Request::default()).0, Solver::Multigrid);
    let error = solve(&unstable, &Request::default()).map(|solved| solved.iterations).expect_err("refused");
    assert!(matches!(error, SolveError::NotPositive { solver: Solver::Direct, .. }), "{error}");
}

#[test]
fn tolerances_and_precisions_that_cannot_be_had_are_refused() {
    let system = chain(10, |_| [1.0, 1.0]);
    for tolerance in [0.0, 1.0, -1.0, f64::NAN] {
        let request = Request { tolerance, ..Request::default() };
        assert!(matches!(solve(&system, &request), Err(SolveError::Tolerance { .. })), "{tolerance}");
    }
    let single = |solver, tolerance| {
        let precision = Precision::F32;
        solve(&system, &Request { solver: Choice::This(solver), tolerance, precision, ..Request::default() })
    };
    let too_tight = SolveError::SinglePrecision { tolerance: 1e-9, floor: SINGLE_FLOOR };
    assert_eq!(single(Solver::Multigrid, 1e-9).expect_err("too tight"), too_tight);
    let only = SolveError::DoubleOnly { solver: Solver::Direct };
    assert_eq!(single(Solver::Direct, 1e-4).expect_err("double only"), only);
    assert!(single(Solver::Multigrid, 1e-4).is_ok());
}
