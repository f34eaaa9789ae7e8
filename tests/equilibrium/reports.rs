//! What a solve says about itself.

use flockform::bench::equilibrium::beam::Plate;
use flockform::flock::vectors::Vectors;
use flockform::solve::equilibrium::{
    Choice, Precision, Request, SINGLE_FLOOR, Solved, Solver, System, choose, solve,
};

use crate::support::{Feel, KINDS, body, by, difference, operator, plate, solved, system};

fn beam(columns: i32, rows: i32) -> System {
    Plate { cells: [columns, rows], holes: false }.parts().system().expect("an operator")
}

#[test]
fn the_history_begins_at_one_and_ends_below_the_tolerance() {
    let system = beam(30, 12);
    for solver in Solver::ALL {
        let solved = solved(&system, solver, 1e-7);
        assert_eq!((solved.solver, solved.why.as_str()), (solver, "asked for"));
        assert_eq!(solved.residuals.len(), solved.iterations + 1, "{solver}");
        assert_eq!(solved.residuals[0], 1.0);
        assert!(solved.residuals[..solved.iterations].iter().all(|&r| r > 1e-7), "{solver}");
        assert!(solved.residuals[solved.iterations] <= 1e-7, "{solver}");
        assert_eq!(solved.phases.iter().map(|phase| phase.0).collect::<Vec<_>>(), ["set-up", "solve"]);
    }
}

#[test]
fn a_solve_that_runs_out_of_iterations_says_so() {
    let system = beam(70, 60);
    let iterative = Solver::ALL.into_iter().filter(|&solver| solver != Solver::Direct);
    for solver in iterative {
        let request = Request { most_iterations: 3, ..by(solver, 1e-14) };
        let solved = solve(&system, &request).expect("no error");
        assert!(!solved.converged && solved.iterations == 3, "{solver} {}", solved.iterations);
        assert!(!solved.is_at_rest(), "{solver}");
        // Nor is one at rest that was on its way when they were used up, however near it was.
        let left = solved.residuals.last().expect("of each iteration").min(0.9);
        let solved =
            solve(&system, &Request { most_iterations: 3, ..by(solver, 0.6 * left) }).expect("no error");
        assert!(!solved.converged && !solved.is_at_rest(), "{solver}: {:?}", solved.residuals);
    }
}

#[test]
fn auto_takes_what_suits_size_and_precision_and_says_why() {
    let auto = |system: &System, precision| {
        let tolerance = 1e-4;
        choose(system, &Request { solver: Choice::Auto, tolerance, precision, ..Request::default() })
    };
    let (small, large) = (beam(8, 8), beam(120, 100));
    assert_eq!(auto(&small, Precision::F64).0, Solver::Direct);
    assert_eq!(auto(&large, Precision::F64).0, Solver::Multigrid);
    assert_eq!(auto(&small, Precision::F32).0, Solver::Multigrid);
    assert!(auto(&large, Precision::F64).1.contains("12120 followers"));
    let solved = solve(&small, &Request::default()).expect("solvable");
    assert_eq!(solved.solver, Solver::Direct);
    assert!(solved.converged && solved.why.contains("72 followers"), "{}", solved.why);
}

#[test]
fn in_single_precision_the_answer_is_as_good_as_the_condition_of_the_body_allows() {
    for kind in KINDS {
        let (body, neighbours) = body(kind, [40, 38], plate);
        let system = system(&body, neighbours, Feel::Material);
        let truth = solved(&system, Solver::Direct, 1e-9).displacement;
        for solver in [Solver::ConjugateGradients, Solver::Multigrid] {
            let request = Request { precision: Precision::F32, ..by(solver, SINGLE_FLOOR) };
            let found = solve(&system, &request).expect("solvable");
            let error = difference(&found.displacement, &truth);
            println!("{kind:?} {solver} {error:e} after {}", found.iterations);
            assert!(found.converged && error < 1e-3, "{kind:?} {solver}: {error:e}");
            assert!(error > 1e-12, "{kind:?} {solver}: computed in double precision after all");
        }
    }
}

#[test]
fn without_loads_nobody_moves_and_held_particles_are_where_they_are_held() {
    let (plate, neighbours) = body(KINDS[5], [12, 12], plate);
    let count = plate.count();
    let operator = operator(&plate, neighbours, Feel::Material, |i| i < 20);
    let lead: Vectors = (0..count).map(|_| [0.25, -0.5]).collect();
    for held in [Vectors::zeros(count), lead] {
        let system = System::new(operator.clone(), Vectors::zeros(count), held.clone());
        for solver in Solver::ALL {
            let found = solved(&system, solver, 1e-12).displacement;
            // A translation of the held particles is one of the whole body.
            let worst = (0..count).map(|i| (found.x[i] - held.x[i]).abs() + (found.y[i] - held.y[i]).abs());
            assert!(worst.fold(0.0, f64::max) < 1e-9, "{solver}");
        }
    }
}

#[test]
fn forces_of_any_size_lead_to_the_same_bits_by_every_solver() {
    let system = beam(12, 9);
    for solver in Solver::ALL {
        let usual = solved(&system, solver, 1e-9).displacement;
        for exponent in [-950, 900] {
            let scale = 2f64.powi(exponent);
            let mut scaled = system.clone();
            scaled.forces.y.iter_mut().for_each(|force| *force *= scale);
            let found = solved(&scaled, solver, 1e-9).displacement;
            let back: Vectors = found.iter().map(|u| u.map(|u| u / scale)).collect();
            assert_eq!(back, usual, "{solver} at 2^{exponent}");
        }
    }
}

#[test]
fn a_residual_that_rounding_has_left_behind_is_told_as_it_is() {
    // The iteration's own residual falls for ever; that of its answer does not.
    let found = solve(&beam(60, 6), &by(Solver::ConjugateGradients, 1e-18)).expect("solvable");
    let [.., before, last] = found.residuals[..] else { panic!("iterated") };
    assert!(before < 1e-15 && last > 1e-15 && !found.converged, "{before:e} {last:e}");
}

#[test]
fn what_rounding_leaves_of_a_slender_body_is_told_with_the_error_it_makes() {
    for columns in [300, 1000] {
        let system = beam(columns, 1);
        let [direct, multigrid] = [Solver::Direct, Solver::Multigrid]
            .map(|solver| solve(&system, &by(solver, 1e-10)).expect("solvable"));
        let known = |solved: &Solved| {
            assert!(!solved.converged && solved.is_at_rest(), "{columns} {:?}", solved.residuals.last());
            solved.known_to.expect("rounding ended it")
        };
        let (most, least) = (known(&direct).max(known(&multigrid)), known(&direct).min(known(&multigrid)));
        let apart = difference(&direct.displacement, &multigrid.displacement);
        assert!(apart < 4.0 * most && most < 1e-4, "{columns}: {apart:e} apart, {least:e} {most:e}");
        assert!(apart > most / 100.0, "{columns}: {apart:e} apart, {most:e}");
    }
    let stout = solve(&beam(30, 12), &by(Solver::Direct, 1e-10)).expect("solvable");
    assert!(stout.converged && stout.known_to.is_none());
}
