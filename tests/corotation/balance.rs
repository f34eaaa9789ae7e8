//! Action is reaction, and rest is a minimum of an energy.

use std::f64::consts::PI;

use flockform::flock::law::Weights;
use flockform::flock::rules::Corner;
use flockform::flock::vectors::{Vectors, distance};
use flockform::solve::corotated::CorotatedError;
use flockform::solve::equilibrium::Solver;

use crate::support::*;

/// Sum of forces and their moment about the origin, at these places.
fn resultant(forces: impl Iterator<Item = ([f64; 2], [f64; 2])>) -> [f64; 3] {
    forces.fold([0.0; 3], |[x, y, m], (place, f)| [x + f[0], y + f[1], m + place[0] * f[1] - place[1] * f[0]])
}

#[test]
fn reactions_carry_the_load_and_its_moment_in_the_deformed_state() {
    for kind in KINDS {
        for elastic in [sheet(12.0, 0.3), fibres(), slice(12.0, 0.49)] {
            let length = 8.0;
            let load = [0.002, 0.02];
            let beam = Beam::new(kind(0.25), length, &elastic, load);
            let solved = beam.solved_by(Solver::Direct);
            let at = beam.moved(&solved.displacement);
            assert!(beam.of_the_end(&solved.displacement)[1] > 0.2 * length, "bends far");
            let held = (0..at.len()).filter(|&i| !beam.follows[i]);
            let reactions = resultant(held.map(|i| {
                let (force, load) = (beam.flock.force(i, &at), beam.load(i));
                (at.get(i), [-force[0] - load[0], -force[1] - load[1]])
            }));
            let loads = resultant((0..at.len()).map(|i| (at.get(i), beam.load(i))));
            let [x, y, m] = [0, 1, 2].map(|k| reactions[k] + loads[k]);
            let size = load[0].hypot(load[1]);
            assert!(
                x.abs().max(y.abs()) < 1e-8 * size && m.abs() < 1e-8 * size * length,
                "{:?}: {x} {y} {m}, {:?}",
                kind(0.25),
                solved.residuals
            );
        }
    }
}

pub fn energy(beam: &Beam, at: &Vectors) -> f64 {
    let Weights::Matrix(weights) = &beam.flock.weights else { panic!("a material") };
    let from = |points: &Vectors, i: usize, j: usize| {
        let (a, b) = (points.get(i), points.get(j));
        [b[0] - a[0], b[1] - a[1]]
    };
    let stored: f64 = (0..at.len())
        .flat_map(|i| weights.cells_around(i).map(move |cell| (i, cell)))
        .filter(|(_, cell)| cell.own == 0)
        .map(|(i, cell)| {
            let neighbour = |slot: usize| {
                let j = beam.flock.neighbours.of(i)[slot] as usize;
                let (reference, now) = (from(&beam.body.reference, i, j), from(at, i, j));
                Corner { reference, displacement: [now[0] - reference[0], now[1] - reference[1]] }
            };
            cell.element.row(0, |k| cell.corner(k, neighbour)).expect("has a direction").energy
        })
        .sum();
    let work = (0..at.len()).map(|i| {
        let (x, f) = (at.get(i), beam.load(i));
        x[0] * f[0] + x[1] * f[1]
    });
    stored - work.sum::<f64>()
}

#[test]
fn rest_is_a_minimum_of_the_energy() {
    for kind in KINDS {
        for elastic in [sheet(12.0, 0.3), fibres()] {
            let beam = Beam::new(kind(0.5), 6.0, &elastic, [0.01, 0.03]);
            let solved = beam.solved_by(Solver::Direct);
            let at = beam.moved(&solved.displacement);
            let least = energy(&beam, &at);
            for seed in 0..20 {
                for size in [1e-3, 3e-2] {
                    let mut other = at.clone();
                    for i in (0..at.len()).filter(|&i| beam.follows[i]) {
                        let by = |k: usize| size * ((7 * i + 13 * k + 29 * seed) as f64).sin();
                        other.set(i, [at.x[i] + by(0), at.y[i] + by(1)]);
                    }
                    assert!(energy(&beam, &other) > least, "{seed} {size}");
                }
            }
        }
    }
}

/// L. Euler: a straight column that is clamped at one end is stable up to a load of pi^2 E I / (4 L^2) on the other.
#[test]
fn a_straight_column_beyond_its_euler_load_is_no_equilibrium_whatever_solves_it() {
    let (length, young) = (20.0, 12.0);
    let euler = (PI / length).powi(2) * young / 12.0 / 4.0;
    let solvers = [Solver::Direct, Solver::ConjugateGradients, Solver::Multigrid];
    for (kind, solver) in
        [KINDS[0], KINDS[3]].into_iter().flat_map(|kind| solvers.map(|solver| (kind, solver)))
    {
        let column =
            |load: f64| Beam::new(kind(0.25), length, &sheet(young, 0.0), [-load, 0.0]).solve_by(solver);
        assert!(column(0.9 * euler).is_ok_and(|solved| solved.converged), "{solver}");
        for over in [3.0, 30.0] {
            match column(over * euler) {
                Err(CorotatedError::Unsettled { part, .. }) => {
                    assert!((0.95..1.2).contains(&(over * part)), "{solver}: {part} of {over}");
                }
                other => panic!("{solver}, {over}: {:?}", other.map(|solved| solved.residuals)),
            }
        }
    }
    for solver in [Solver::Jacobi, Solver::GaussSeidel, Solver::Chebyshev] {
        let load = [-3.0 * euler, 0.0];
        let column = Beam::new(KINDS[0](0.5), length, &sheet(young, 0.0), load).solve_by(solver);
        let lost = matches!(column, Err(CorotatedError::Unsettled { part, .. }) if part < 0.6);
        assert!(lost, "{solver}: {:?}", column.map(|solved| solved.residuals));
    }
}

#[test]
fn every_solver_and_the_sweeps_find_the_same_rest() {
    for kind in KINDS {
        let beam = |length, elastic| Beam::new(kind(0.5), length, &elastic, [0.02, 0.06]);
        let (plain, averaged) = (beam(2.0, sheet(12.0, 0.3)), beam(1.5, slice(12.0, 0.45)));
        for beam in [plain, averaged, beam(2.0, sheet(12.0, 0.3)).on_rollers()] {
            let solved = beam.solved_by(Solver::Direct);
            for solver in [Solver::ConjugateGradients, Solver::GaussSeidel, Solver::Multigrid] {
                let other = beam.solved_by(solver).displacement;
                let apart = other.iter().zip(solved.displacement.iter()).map(|(a, b)| distance(a, b));
                assert!(apart.fold(0.0, f64::max) < 1e-9, "{solver}");
            }
            let (at, swept) = (beam.moved(&solved.displacement), swept(&beam));
            let apart = swept.iter().zip(at.iter()).map(|(a, b)| distance(a, b)).fold(0.0, f64::max);
            assert!(apart < 1e-8, "{apart}");
        }
    }
}

/// Where sweeps come to rest that move one particle after the other to its target.
fn swept(beam: &Beam) -> Vectors {
    let mut places = (*beam.body.reference).clone();
    for _ in 0..400_000 {
        let mut farthest = 0.0f64;
        for i in (0..places.len()).filter(|&i| beam.follows[i]) {
            let target = beam.flock.target(i, &places);
            farthest = farthest.max(distance(target, places.get(i)));
            places.set(i, target);
        }
        if farthest < 1e-13 {
            return places;
        }
    }
    panic!("the sweeps do not settle")
}
