//! How fast the plain rule is swept, beside what the memory allows.
//!
//! The roofline is that of one step at a time: 48 bytes a particle, being two coordinates of which
//! each is read once (its neighbours' are in cache by then), written once, and read once more
//! because a store first fetches its cache line. It is drawn from the triad's bandwidth *moved*,
//! which counts that fetch as well. Bodies that a cache holds may lie above it.

use std::fmt;
use std::time::Instant;

use rayon::{ThreadPoolBuildError, ThreadPoolBuilder};
use serde::Serialize;

use super::machine::{Bandwidth, median, time_triad};
use crate::flock::interaction::{Interaction, Weights};
use crate::flock::lattice::{Lattice, LatticeKind};
use crate::flock::neighbourhood::{Neighbourhood, Neighbours};
use crate::flock::points::Points;
use crate::flock::role::Role;
use crate::flock::rules::Rule;
use crate::solve::sweep::{Sweep, Update};

/// Bytes that one update moves when no cache holds the body: `x` and `y`, each read, written and
/// fetched for writing.
const BYTES_PER_UPDATE: f64 = 48.0;

const THREADS: [usize; 2] = [1, 2];

/// What to measure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// The two smallest bodies and few repetitions, to see that it runs; the times mean little.
    pub quick: bool,
}

/// What [`Options`] stand for.
struct Effort {
    /// Particles along each side of the bodies.
    sides: &'static [usize],
    repetitions: usize,
    /// Time of one repetition [s]; a single step may take longer.
    seconds: f64,
}

const FULL: Effort = Effort { sides: &[12, 256, 1024, 4096], repetitions: 9, seconds: 0.12 };

const QUICK: Effort = Effort { sides: &[12, 256], repetitions: 3, seconds: 1e-3 };

/// The machine and the sweeps on it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Whether this was the quick run, whose times mean little.
    pub quick: bool,
    pub bytes_per_update: f64,
    /// One entry for each number of threads: the median over the whole run.
    pub triad: Vec<Bandwidth>,
    pub cases: Vec<Case>,
}

/// One body on some number of threads.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Case {
    /// Particles along each side of the body.
    pub side: usize,
    pub threads: usize,
    /// Particles that follow: all but the outermost.
    pub followers: usize,
    /// Median over the repetitions \[s\].
    pub seconds_per_step: f64,
    pub updates_per_second: f64,
    /// Of the updates per second that the triad's bandwidth would allow \[1\], going by those passes of
    /// the triad that were taken in turn with this body's repetitions.
    pub share_of_roofline: f64,
}

/// Measures the sweeps; takes about half a minute and 1.5 GB, or next to nothing if quick.
///
/// # Errors
/// If the system refuses to start the threads.
pub fn run(options: &Options) -> Result<Report, ThreadPoolBuildError> {
    let effort = if options.quick { &QUICK } else { &FULL };
    let mut report = Report {
        quick: options.quick,
        bytes_per_update: BYTES_PER_UPDATE,
        triad: Vec::new(),
        cases: Vec::new(),
    };
    let mut lattices: Vec<SquareLattice> =
        effort.sides.iter().map(|&side| SquareLattice::new(side)).collect();
    for threads in THREADS {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build()?;
        pool.install(|| report.measure(threads, effort, &mut lattices));
    }
    Ok(report)
}

impl Report {
    fn measure(&mut self, threads: usize, effort: &Effort, lattices: &mut [SquareLattice]) {
        let largest = lattices.len() - 1;
        let elements = lattices[largest].present.len();
        let mut passes = Vec::new();
        for index in 0..lattices.len() {
            let steps = lattices[index].steps_in(effort.seconds);
            // In turn, so that a neighbour's load on the machine hits the sweep and the triad alike.
            let (mut beside, mut times): (Vec<f64>, Vec<f64>) = (0..effort.repetitions)
                .map(|_| (lattices[largest].time_triad(), lattices[index].time(steps)))
                .unzip();
            passes.extend_from_slice(&beside);
            let bandwidth = Bandwidth::of_passes(elements, threads, &mut beside);
            self.cases.push(Case::new(&lattices[index], median(&mut times), &bandwidth));
        }
        self.triad.push(Bandwidth::of_passes(elements, threads, &mut passes));
    }
}

impl Case {
    fn new(lattice: &SquareLattice, seconds_per_step: f64, bandwidth: &Bandwidth) -> Self {
        let followers = lattice.followers();
        let updates_per_second = followers as f64 / seconds_per_step;
        Self {
            side: lattice.side,
            threads: bandwidth.threads,
            followers,
            seconds_per_step,
            updates_per_second,
            share_of_roofline: updates_per_second * BYTES_PER_UPDATE / bandwidth.moved_bytes_per_second,
        }
    }
}

/// A square body of a square lattice whose outermost particles are held.
struct SquareLattice {
    side: usize,
    interaction: Interaction,
    sweep: Sweep,
    present: Points,
    next: Points,
}

impl SquareLattice {
    /// In the numbering and with the neighbours' order that a scene would give; only the lists are
    /// made directly, a body of this many sites being slow to cut.
    fn new(side: usize) -> Self {
        let lattice = Lattice::new(LatticeKind::Square { spacing: 1.0 }, [0.0; 2], 0.0);
        let offsets = Neighbourhood::First { keep: None }
            .offsets(&lattice)
            .expect("every lattice has first neighbours");
        let sites = || (0..side).flat_map(|column| (0..side).map(move |row| (column, row)));
        let inner = 1..side - 1;
        let follows = |(column, row)| inner.contains(&column) && inner.contains(&row);
        let offsets = offsets[0].iter().map(|&[i, j]| i as isize * side as isize + j as isize);
        let neighbours = Neighbours::from_lists(sites().enumerate().map(|(particle, site)| {
            let seen = if follows(site) { usize::MAX } else { 0 };
            offsets.clone().take(seen).map(move |offset| particle.wrapping_add_signed(offset) as u32)
        }));
        let roles: Vec<Role> =
            sites().map(|site| if follows(site) { Role::Follower } else { Role::Clamped }).collect();
        let reference: Points = sites().map(|(i, j)| lattice.position([i as i32, j as i32])).collect();
        // Stretched at one side, so that there is something to compute.
        let mut present = reference.clone();
        let last_column = present.len() - side;
        present.x[last_column..].iter_mut().for_each(|x| *x += 0.5);
        let interaction = Interaction {
            rule: Rule::BARYCENTRE,
            reference: reference.into(),
            neighbours,
            weights: Weights::Equal,
            forces: None,
            rest: None,
            bonds: None,
        };
        let sweep = Sweep::compile(Update::default(), &interaction, &roles);
        Self { side, interaction, sweep, next: present.clone(), present }
    }

    fn followers(&self) -> usize {
        (self.side - 2).pow(2)
    }

    /// A small body's step is too short for the clock: as many as fill the time.
    fn steps_in(&mut self, seconds: f64) -> usize {
        self.time(1);
        (seconds / self.time(2)).clamp(1.0, 1e7) as usize
    }

    /// Seconds of the triad over `x` and over `y`, on average: all the memory that a sweep uses.
    fn time_triad(&mut self) -> f64 {
        let (present, next) = (&self.present, &mut self.next);
        let x = time_triad(&mut next.x, &present.x, &present.y);
        let y = time_triad(&mut next.y, &present.y, &present.x);
        // The held particles' places must stand in both.
        next.x.copy_from_slice(&present.x);
        next.y.copy_from_slice(&present.y);
        f64::midpoint(x, y)
    }

    /// Seconds per step over some steps.
    fn time(&mut self, steps: usize) -> f64 {
        let begin = Instant::now();
        for _ in 0..steps {
            self.sweep.step(&self.interaction, None, &self.present, &mut self.next);
            std::mem::swap(&mut self.present, &mut self.next);
        }
        begin.elapsed().as_secs_f64() / steps as f64
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const GIGA: f64 = 1e-9;
        for triad in &self.triad {
            let Bandwidth { threads, counted_bytes_per_second, moved_bytes_per_second } = triad;
            let (counted, moved) = (GIGA * counted_bytes_per_second, GIGA * moved_bytes_per_second);
            let roofline = moved / self.bytes_per_update;
            writeln!(
                f,
                "triad, {}: {moved:.1} GB/s moved ({counted:.1} GB/s without write-allocate); \
                 at {} bytes an update the roofline is {roofline:.3} G updates/s",
                of_threads(*threads),
                self.bytes_per_update,
            )?;
        }
        writeln!(
            f,
            "\n{:>11}  {:>7}  {:>12}  {:>11}  {:>8}",
            "body", "threads", "time a step", "G updates/s", "roofline"
        )?;
        for case in &self.cases {
            writeln!(
                f,
                "{:>11}  {:>7}  {:>12}  {:>11.3}  {:>6.0} %",
                format!("{0} x {0}", case.side),
                case.threads,
                duration(case.seconds_per_step),
                GIGA * case.updates_per_second,
                100.0 * case.share_of_roofline,
            )?;
        }
        if self.quick {
            writeln!(f, "\nA quick run: it shows that the benchmark works, its times mean little.")?;
        }
        Ok(())
    }
}

fn of_threads(threads: usize) -> String {
    format!("{threads} thread{}", if threads == 1 { "" } else { "s" })
}

/// Three figures and the unit that suits them.
fn duration(seconds: f64) -> String {
    let (value, unit) = match seconds {
        s if s < 1e-6 => (s * 1e9, "ns"),
        s if s < 1e-3 => (s * 1e6, "us"),
        s => (s * 1e3, "ms"),
    };
    format!("{value:.*} {unit}", if value < 10.0 { 2 } else { usize::from(value < 100.0) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quick_run_measures_two_bodies_on_one_and_two_threads() {
        let report = run(&Options { quick: true }).expect("threads");
        let cases: Vec<_> = report.cases.iter().map(|case| (case.side, case.threads)).collect();
        assert_eq!(cases, [(12, 1), (256, 1), (12, 2), (256, 2)]);
        let json = serde_json::to_value(&report).expect("plain numbers");
        for case in json["cases"].as_array().expect("cases") {
            for key in ["seconds_per_step", "updates_per_second", "share_of_roofline"] {
                assert!(case[key].as_f64().expect("a number") > 0.0, "{key}");
            }
        }
        assert!(report.to_string().contains("256 x 256"));
    }

    #[test]
    fn the_lattice_built_directly_is_the_one_a_scene_would_cut() {
        use crate::flock::body::{Body, Cut};
        let lattice = Lattice::new(LatticeKind::Square { spacing: 1.0 }, [0.0; 2], 0.0);
        let cut = Cut::Count { columns: 9, rows: 9 };
        let (body, neighbours) =
            Body::build(lattice, &cut, &Neighbourhood::First { keep: None }, None).expect("fits");
        let direct = SquareLattice::new(9);
        assert_eq!(direct.interaction.reference, body.reference);
        let inner = (1..8).flat_map(|column| (1..8).map(move |row| 9 * column + row));
        for particle in inner {
            assert_eq!(direct.interaction.neighbours.of(particle), neighbours.of(particle));
        }
        assert_eq!(direct.interaction.neighbours.index.len(), 4 * direct.followers());
    }

    #[test]
    fn a_step_moves_the_followers_beside_the_stretched_side_and_nobody_held() {
        let mut lattice = SquareLattice::new(12);
        let before = lattice.present.clone();
        lattice.time(1);
        let moved: Vec<usize> = (0..144).filter(|&i| lattice.present.x[i] != before.x[i]).collect();
        assert_eq!(moved, (10 * 12 + 1..10 * 12 + 11).collect::<Vec<_>>());
    }

    #[test]
    fn durations_are_written_with_three_figures() {
        let written = [1.234e-9, 45.67e-9, 345.6e-6, 7.891e-3, 1.5].map(duration);
        assert_eq!(written, ["1.23 ns", "45.7 ns", "346 us", "7.89 ms", "1500 ms"]);
    }
}
