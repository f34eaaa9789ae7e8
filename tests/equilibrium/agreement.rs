//! All solvers, all lattices, rules of both kinds, bodies of all shapes.

use flockform::solve::equilibrium::Solver;

use crate::support::*;

fn assert_agree(solvers: &[Solver], sizes: [u32; 2], shape: Shape) {
    for kind in KINDS {
        for feel in FEELS {
            let (body, neighbours) = body(kind, sizes, shape);
            let system = system(&body, neighbours, feel);
            let truth = solved(&system, Solver::Direct, 1e-6);
            for &solver in solvers {
                let found = solved(&system, solver, 1e-12);
                let error = difference(&found.displacement, &truth.displacement);
                println!(
                    "{} {kind:?} {feel:?}, {solver}: {error:e} after {} iterations",
                    body.count(),
                    found.iterations
                );
                assert!(error < 1e-8, "{kind:?}, {feel:?}, {solver}: {error:e}");
            }
        }
    }
}

#[test]
fn every_solver_finds_the_same_rest_of_a_plate_on_every_lattice() {
    assert_agree(&Solver::ALL, [13, 12], plate);
}

#[test]
fn every_solver_finds_the_same_rest_of_a_body_with_holes() {
    assert_agree(&Solver::ALL, [15, 14], holed);
}

#[test]
fn every_solver_finds_the_same_rest_of_a_body_with_thin_parts() {
    assert_agree(&[Solver::ConjugateGradients, Solver::Multigrid], [96, 60], fork);
}

#[test]
fn multigrid_finds_the_same_rest_on_many_levels_as_a_factorisation() {
    assert_agree(&[Solver::ConjugateGradients, Solver::Multigrid], [61, 58], plate);
    assert_agree(&[Solver::ConjugateGradients, Solver::Multigrid], [61, 58], holed);
}
