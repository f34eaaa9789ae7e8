//! How long equilibrium takes: multigrid beside a factorisation of the same system, in one process.
//!
//! A clamped beam under end shear in plane stress, and a plate with holes. Time runs from the classes of
//! rows to displacements and covers set-up and solve of both alike. It is the time to an *error*: the
//! relative L2 difference from the factorised solution, whose own rounding limits what can be asked for.

pub mod beam;

use std::fmt;
use std::time::Instant;

use serde::Serialize;

use self::beam::{Parts, Plate};
use super::quick_note;
use crate::continuum::memory::own;
use crate::flock::vectors::Vectors;
use crate::scene::text::counted;
use crate::solve::equilibrium::{Choice, Request, SolveError, Solved, Solver, System, solve};
use crate::solve::operator::OperatorError;
use crate::solve::stopwatch::median;

/// Relative errors that the time to reach is measured for.
const ERRORS: [f64; 2] = [1e-2, 1e-6];

/// Relative residual that iterations are counted to.
const RESIDUAL: f64 = 1e-8;

/// More iterations than any case needs.
const MOST_ITERATIONS: usize = 100;

/// Bytes a particle of a body that stand beside the solver's: position, site, neighbours, class.
const BODY_BYTES: f64 = 16.0 + 8.0 + 36.0 + 4.0;

/// A body with one coarser level, too small to leave room for that of another.
const WARM_UP: Plate = Plate { cells: [28, 28], holes: false };

/// Why nothing could be measured.
#[derive(Debug, thiserror::Error)]
pub enum EquilibriumError {
    /// The rows of a body make no operator.
    #[error(transparent)]
    Operator(#[from] OperatorError),
    /// A system was not solved.
    #[error(transparent)]
    Solve(#[from] SolveError),
}

/// All cases on one machine.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Whether this was the quick run, whose times mean little.
    pub quick: bool,
    /// Threads that multigrid runs on; the factorisation runs on one.
    pub threads: usize,
    /// Every body.
    pub cases: Vec<Case>,
}

/// One body.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Case {
    /// Cells along each side, and whether there are holes.
    pub body: String,
    /// Number of particles, the held ones included.
    pub particles: usize,
    /// Iterations of multigrid to a relative residual of 1e-8.
    pub iterations: usize,
    /// Median over the repetitions \[s\]; the direct solve of a large body runs once.
    pub direct_seconds: f64,
    /// Relative residual that the factorisation left \[1\].
    pub direct_residual: f64,
    /// One entry for each error that is aimed at.
    pub to_error: Vec<ToError>,
    /// Highest resident memory during the multigrid solve above that before, the body's own arrays
    /// included: positions 16, sites 8, neighbour lists 36, classes 4 \[B\]. Absent where the system does
    /// not report it.
    pub bytes_per_particle: Option<f64>,
}

/// Multigrid's way to an error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ToError {
    /// Relative L2 difference from the direct solution \[1\].
    pub error: f64,
    /// Iterations of multigrid to that error.
    pub iterations: usize,
    /// From classes of rows to the first iteration, median \[s\].
    pub set_up_seconds: f64,
    /// From there to the displacements, median \[s\].
    pub solve_seconds: f64,
    /// How many times as long the direct solve takes \[1\].
    pub faster: f64,
}

/// Bodies, and how often each is solved.
fn bodies(quick: bool) -> (Vec<Plate>, usize) {
    let beam = |columns, rows| Plate { cells: [columns, rows], holes: false };
    let holed = |side| Plate { cells: [side, side], holes: true };
    if quick {
        (vec![beam(40, 40), beam(100, 10), holed(60)], 1)
    } else {
        (vec![beam(88, 88), beam(352, 352), beam(1100, 110), holed(352), beam(1056, 1056)], 7)
    }
}

/// Measures all cases; takes about a minute and several gigabytes for the factors, or next to nothing if
/// quick.
///
/// # Errors
/// If a system cannot be solved, which would be a bug.
pub fn run(quick: bool) -> Result<Report, EquilibriumError> {
    let (plates, repetitions) = bodies(quick);
    // Memory first, and small bodies before large ones: what was freed before would hide what is used. The pages of
    // the program itself and the threads' stacks are no part of the first body: a tiny one touches them.
    bytes_per_particle(&WARM_UP.parts())?;
    let bytes: Vec<Option<f64>> =
        plates.iter().map(|plate| bytes_per_particle(&plate.parts())).collect::<Result<_, _>>()?;
    let cases = plates.iter().zip(bytes).map(|(plate, bytes)| Case::measure(plate, bytes, repetitions));
    Ok(Report { quick, threads: rayon::current_num_threads(), cases: cases.collect::<Result<_, _>>()? })
}

fn request(solver: Solver, tolerance: f64, most_iterations: usize) -> Request {
    Request { solver: Choice::This(solver), tolerance, most_iterations, ..Request::default() }
}

/// From parts to displacements; the seconds it took, and how many of them were set-up.
fn timed(parts: &Parts, request: &Request) -> Result<(Solved, [f64; 2]), EquilibriumError> {
    let parts = parts.clone();
    let begin = Instant::now();
    let system = parts.system()?;
    let made = begin.elapsed();
    let solved = solve(&system, request)?;
    let all = begin.elapsed();
    let set_up = made + solved.phases[0].1;
    Ok((solved, [all.as_secs_f64(), set_up.as_secs_f64()]))
}

impl Case {
    fn measure(plate: &Plate, bytes: Option<f64>, repetitions: usize) -> Result<Self, EquilibriumError> {
        let parts = plate.parts();
        let system = parts.clone().system()?;
        let (truth, [first, _]) = timed(&parts, &request(Solver::Direct, RESIDUAL, 1))?;
        // A large body's factorisation takes so long that its time hardly scatters.
        let again = if first > 1.0 { 0 } else { repetitions.saturating_sub(1).min(4) };
        let mut direct = vec![first];
        for _ in 0..again {
            direct.push(timed(&parts, &request(Solver::Direct, RESIDUAL, 1))?.1[0]);
        }
        let direct_seconds = median(&mut direct);
        let to_residual = solve(&system, &request(Solver::Multigrid, RESIDUAL, MOST_ITERATIONS))?;
        let to_error = ERRORS.iter().map(|&error| {
            let iterations = iterations_to(&system, &truth.displacement, error)?;
            ToError::measure(&parts, (error, iterations), direct_seconds, repetitions)
        });
        let [columns, rows] = plate.cells;
        let holes = if plate.holes { ", holes" } else { "" };
        Ok(Self {
            body: format!("{columns} x {rows}{holes}"),
            particles: parts.sites.len(),
            iterations: to_residual.iterations,
            direct_seconds,
            direct_residual: truth.residuals[truth.iterations],
            to_error: to_error.collect::<Result<_, EquilibriumError>>()?,
            bytes_per_particle: bytes,
        })
    }
}

impl ToError {
    fn measure(
        parts: &Parts,
        (error, iterations): (f64, usize),
        direct_seconds: f64,
        repetitions: usize,
    ) -> Result<Self, EquilibriumError> {
        // So many iterations and not one more: the residual is no measure of the error.
        let request = request(Solver::Multigrid, f64::MIN_POSITIVE, iterations);
        let (mut totals, mut set_ups) = (Vec::new(), Vec::new());
        for _ in 0..repetitions {
            let (_, [total, set_up]) = timed(parts, &request)?;
            totals.push(total);
            set_ups.push(set_up);
        }
        let (total, set_up_seconds) = (median(&mut totals), median(&mut set_ups));
        let (solve_seconds, faster) = (total - set_up_seconds, direct_seconds / total);
        Ok(Self { error, iterations, set_up_seconds, solve_seconds, faster })
    }
}

/// Fewest iterations of multigrid to a relative error.
fn iterations_to(system: &System, truth: &Vectors, error: f64) -> Result<usize, EquilibriumError> {
    for iterations in 1..MOST_ITERATIONS {
        let found = solve(system, &request(Solver::Multigrid, f64::MIN_POSITIVE, iterations))?;
        if difference(&found.displacement, truth) <= error {
            return Ok(iterations);
        }
    }
    Ok(MOST_ITERATIONS)
}

fn difference(found: &Vectors, truth: &Vectors) -> f64 {
    let pairs = || found.iter().zip(truth.iter());
    let error: f64 = pairs().map(|(a, b)| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)).sum();
    let size: f64 = pairs().map(|(_, b)| b[0] * b[0] + b[1] * b[1]).sum();
    (error / size).sqrt()
}

/// Peak of the resident memory over a multigrid solve, per particle.
fn bytes_per_particle(parts: &Parts) -> Result<Option<f64>, EquilibriumError> {
    let copy = parts.clone();
    let before = reset_peak();
    let system = copy.system()?;
    solve(&system, &request(Solver::Multigrid, RESIDUAL, MOST_ITERATIONS))?;
    let used = before.zip(own("VmHWM:")).map(|(before, peak)| peak.saturating_sub(before) as f64);
    // The system's own forces, 16 bytes, were there before.
    Ok(used.map(|used| used / parts.sites.len() as f64 + BODY_BYTES + 16.0))
}

/// Forgets the highest resident memory so far; returns what is resident now \[B\].
fn reset_peak() -> Option<u64> {
    std::fs::write("/proc/self/clear_refs", "5").ok()?;
    own("VmRSS:")
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{:>16}  {:>9}  {:>10}  {:>8}  {:>9}  {:>4}  {:>8}  {:>8}  {:>8}  {:>7}",
            "body",
            "particles",
            "B/particle",
            "to error",
            "direct",
            "its",
            "set-up",
            "solve",
            "total",
            "faster"
        )?;
        for case in &self.cases {
            for to in &case.to_error {
                let bytes = case.bytes_per_particle.map_or("-".into(), |bytes| format!("{bytes:.0}"));
                let total = to.set_up_seconds + to.solve_seconds;
                writeln!(
                    f,
                    "{:>16}  {:>9}  {:>10}  {:>8.0e}  {:>9}  {:>4}  {:>8}  {:>8}  {:>8}  {:>6.1}x",
                    case.body,
                    case.particles,
                    bytes,
                    to.error,
                    seconds(case.direct_seconds),
                    to.iterations,
                    seconds(to.set_up_seconds),
                    seconds(to.solve_seconds),
                    seconds(total),
                    to.faster,
                )?;
            }
        }
        let iterations: Vec<String> =
            self.cases.iter().map(|case| format!("{} ({})", case.iterations, case.body)).collect();
        writeln!(f, "\nIterations to a residual of {RESIDUAL:e}: {}.", iterations.join(", "))?;
        writeln!(f, "Multigrid on {}, the factorisation on one.", counted(self.threads, "thread"))?;
        quick_note(self.quick, f)
    }
}

fn seconds(seconds: f64) -> String {
    if seconds < 1.0 { format!("{:.1} ms", 1e3 * seconds) } else { format!("{seconds:.2} s") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quick_run_reaches_both_errors_on_every_body() {
        let report = run(true).expect("solvable");
        for case in &report.cases {
            assert!(case.iterations < MOST_ITERATIONS && case.direct_residual < RESIDUAL, "{case:?}");
            let reached: Vec<usize> = case.to_error.iter().map(|to| to.iterations).collect();
            assert!(reached[0] <= reached[1] && reached[1] < 30, "{case:?}");
            assert!(case.to_error.iter().all(|to| to.solve_seconds > 0.0 && to.set_up_seconds > 0.0));
        }
        assert!(report.to_string().contains("60 x 60, holes"));
        assert!(serde_json::to_value(&report).expect("plain")["cases"][0]["iterations"].is_u64());
    }

    #[test]
    fn the_plate_is_the_body_and_the_material_that_a_scene_would_have() {
        use crate::flock::body::{Body, Cut};
        use crate::flock::lattice::{Lattice, LatticeKind};
        use crate::flock::rules::Rotation;
        use crate::material::cells::{Cells, neighbourhood};
        use crate::material::elastic::{Constants, Elastic, Plane};
        use crate::material::weights::assemble;

        let system = Plate { cells: [6, 4], holes: false }.parts().system().expect("an operator");
        let lattice = Lattice::new(LatticeKind::Square { spacing: 1.0 }, [0.0; 2], 0.0);
        let near = neighbourhood(&lattice);
        let (body, neighbours) =
            Body::build(lattice, &Cut::Count { columns: 7, rows: 5 }, &near, None).expect("fits");
        let constants = Constants::Isotropic { young: 1000.0, poisson: 0.33, plane: Plane::Stress };
        let elastic = Elastic::new(constants, 1.0).expect("admissible");
        let weights = assemble(&Cells::of_body(&body), &body, &neighbours, &elastic, Rotation::Small);
        let weights = weights.expect("holds together");
        for i in (0..body.count()).filter(|&i| system.operator.follows()[i]) {
            let row = system.operator.row(i);
            for (&j, block) in neighbours.of(i).iter().zip(weights.stiffness_of(i)) {
                let j = j as usize;
                let offset = [0, 1].map(|k| body.sites[j][k] - body.sites[i][k]);
                let entry = row.entries.iter().find(|entry| entry.0 == offset).expect("a neighbour");
                let pairs = entry.1.iter().flatten().zip(block.iter().flatten());
                assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-9), "{i} {offset:?}");
            }
            assert_eq!(row.entries.len(), neighbours.of(i).len());
        }
        let total: f64 = system.forces.y.iter().sum();
        assert!((total - 4.0 * 50.0).abs() < 1e-9);
    }
}
