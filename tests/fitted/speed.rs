//! How fast fitted bodies are solved beside those of whole cells: for an optimised build and a quiet machine.

use std::time::{Duration, Instant};

use flockform::continuum::equilibrium::of_plan;
use flockform::continuum::plan::Plan;
use flockform::solve::equilibrium::{Choice, Request, Solver, System, solve};

use crate::support::{lattice, scene};

const ROUNDS: usize = 25;

/// Most that a fitted body may take, in times of the same shape in whole cells along the axes of its lattice. Rows along an
/// outline are each of their own (7 232 in the sieve on squares, against 31): their products are taken for eight particles at
/// a time as well, but the coefficients of each have to be fetched, and its row on every coarser level is summed by itself.
const MOST: f64 = 1.5;

fn holes(count: usize, radius: f64) -> String {
    let side = 40.0 / count as f64;
    let hole = |k: usize| {
        let centre = [k % count, k / count].map(|k| (k as f64 + 0.5) * side + 0.013);
        format!("{{ kind = \"disc\", centre = [{}, {}], radius = {radius} }}", centre[0], centre[1])
    };
    (0..count * count).map(hole).collect::<Vec<_>>().join(", ")
}

/// A system with the share of its particles that stand along its outline.
fn system(kind: &str, h: f64, orientation: f64, body: &str) -> (System, f64) {
    let parts = format!(
        "material = {{ kind = \"isotropic\", young = 1000.0, poisson = 0.3 }}\n\
         roles = [{{ region = {{ kind = \"edge\", side = \"left\" }}, role = \"clamped\" }}]\n\
         loads = [{{ kind = \"traction\", region = {{ kind = \"edge\", side = \"right\" }}, traction = [0.0, 1.0] }}]\n\
         [body]\n{body}"
    );
    let scene = scene(&lattice(kind, h, orientation), &parts).unwrap_or_else(|error| panic!("{error}"));
    let plan = Plan::new(&scene).unwrap_or_else(|error| panic!("{error}"));
    let along = plan.setup.body.outline.as_ref().map_or(0, |outline| outline.places.iter().flatten().count());
    let share = along as f64 / plan.count() as f64;
    (of_plan(&scene, &plan).expect("linear"), share)
}

/// Set-up and whole time for a particle, in nanoseconds, and the iterations.
fn once(system: &System) -> ([f64; 2], usize) {
    let request = Request { solver: Choice::This(Solver::Multigrid), tolerance: 1e-8, ..Request::default() };
    let begin = Instant::now();
    let solved = solve(system, &request).expect("solved");
    let times: [Duration; 2] = [solved.phases[0].1, begin.elapsed()];
    (times.map(|time| time.as_secs_f64() * 1e9 / system.operator.count() as f64), solved.iterations)
}

/// What other programs on the machine cost is never negative.
fn least(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::INFINITY, f64::min)
}

#[test]
#[ignore = "times, for an optimised build and a quiet machine; reached by solving alone: with set-up 1.3 to 1.7 on two threads, 1.4 to 1.9 on one"]
fn fitted_bodies_are_solved_in_at_most_half_as_much_time_more_than_whole_cells() {
    let plate = |sides: [f64; 2]| format!("shape = {{ kind = \"rectangle\", max = {sides:?} }}");
    let sieve = |n: usize, radius: f64| format!("{}\nholes = [{}]", plate([40.0; 2]), holes(n, radius));
    let mut worst = 0.0f64;
    for kind in ["square", "hexagonal"] {
        let bodies = [
            ("turned plate", plate([40.0; 2]), 0.25),
            ("turned beam", plate([60.0, 6.0]), 0.25),
            ("plate with 9 holes", sieve(3, 3.6), 0.2),
            ("sieve of 36 holes", sieve(6, 2.0), 0.2),
        ];
        for (name, body, h) in bodies {
            let (fitted, share) = system(kind, h, 17.0, &body);
            let (whole, _) = system(kind, h, 0.0, &format!("outline = \"lattice\"\n{body}"));
            let rounds: Vec<_> = (0..ROUNDS).map(|_| [once(&whole), once(&fitted)]).collect();
            let of = |which: usize, phase: usize| least(rounds.iter().map(|r| r[which].0[phase]));
            let ratio = of(1, 1) / of(0, 1);
            worst = worst.max(ratio);
            println!(
                "{kind}, {name}: {} particles, {:.1} % on the outline; ns a particle: whole cells {:.0} + {:.0} in {}, \
                 fitted {:.0} + {:.0} in {}; ratio {ratio:.2}, of solving alone {:.2}",
                fitted.operator.count(),
                100.0 * share,
                of(0, 0),
                of(0, 1) - of(0, 0),
                rounds[0][0].1,
                of(1, 0),
                of(1, 1) - of(1, 0),
                rounds[0][1].1,
                (of(1, 1) - of(1, 0)) / (of(0, 1) - of(0, 0)),
            );
        }
    }
    assert!(worst <= MOST, "{worst:.2} times as long");
}
