//! Iterations of multigrid do not grow with the body, and bits do not depend on threads.

use flockform::bench::equilibrium::beam::Plate;
use flockform::flock::vectors::Vectors;
use flockform::solve::equilibrium::{Solver, solve};

use crate::support::{FEELS, KINDS, by, solved, system};

fn iterations(columns: i32, rows: i32) -> usize {
    let beam = Plate { cells: [columns, rows], holes: false };
    solved(&beam.parts().system().expect("an operator"), Solver::Multigrid, 1e-8).iterations
}

fn assert_flat(bodies: &[[i32; 2]]) {
    let counts: Vec<usize> = bodies.iter().map(|&[columns, rows]| iterations(columns, rows)).collect();
    let (least, most) = (counts[0], counts[counts.len() - 1]);
    assert!(most <= least + 2 && (most as f64) < 1.5 * least as f64, "{counts:?}");
    assert!(counts.iter().all(|&count| count <= 11), "{counts:?}");
}

#[test]
fn iterations_grow_by_less_than_half_from_2500_to_160_thousand_particles() {
    assert_flat(&[[50, 50], [100, 100], [200, 200], [400, 400]]);
    assert_flat(&[[160, 16], [320, 32], [640, 64], [1280, 128]]);
}

#[test]
fn iterations_grow_by_less_than_half_from_10_thousand_to_a_million_particles() {
    assert_flat(&[[100, 100], [317, 317], [1000, 1000]]);
    assert_flat(&[[316, 32], [1000, 100], [3160, 316]]);
}

#[test]
fn iterations_stay_few_on_every_lattice_and_for_rules_of_both_kinds() {
    for kind in KINDS {
        for feel in FEELS {
            let counts = [40, 80].map(|side| {
                let (body, neighbours) = crate::support::body(kind, [side, side], crate::support::plate);
                let system = system(&body, neighbours, feel);
                solved(&system, Solver::Multigrid, 1e-8).iterations
            });
            println!("{kind:?} {feel:?} {counts:?}");
            assert!(counts[1] <= counts[0] + 2 && counts[1] <= 13, "{kind:?} {feel:?} {counts:?}");
        }
    }
}

#[test]
fn odd_sizes_take_no_more_iterations_than_even_ones() {
    for side in 124..=132 {
        let count = iterations(side, side + 3);
        assert!(count <= 10, "{side}: {count}");
    }
}

fn bits(points: &Vectors) -> Vec<u64> {
    points.x.iter().chain(&points.y).map(|value| value.to_bits()).collect()
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let beam = Plate { cells: [260, 190], holes: true };
    let system = beam.parts().system().expect("an operator");
    for solver in Solver::ALL {
        let mut request = by(solver, 1e-8);
        request.most_iterations = 30;
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            let solved = pool.install(|| solve(&system, &request)).expect("solvable");
            (bits(&solved.displacement), solved.residuals)
        };
        let one = on(1);
        for threads in [2, 4] {
            assert!(on(threads) == one, "{solver}, {threads} threads");
        }
    }
}
