//! Ranks that each have a part of a system find what one finds that has all of it, to the bit.

use std::ops::Range;

use crate::flock::body::Body;
use crate::flock::lattice::{LatticeKind, Site};
use crate::flock::vectors::Vectors;
use crate::ranks::{Team, in_process};
use crate::solve::equilibrium::{
    Choice, Precision, Request, SolveError, Solved, Solver, System, solve_shared,
};
use crate::solve::operator::samples::{operator, with_outliers};
use crate::solve::operator::{Matrix, Operator, Outliers, Row, SIZE};
use crate::solve::shared::SystemPart;

/// A body, whole or in parts.
struct Sample {
    sites: Vec<Site>,
    /// Column of each particle.
    column: Vec<i32>,
    operator: Operator,
    forces: Vectors,
    held: Vectors,
    held_axes: Vec<[bool; 2]>,
}

fn noise(k: usize) -> f64 {
    (k as f64 * 0.618_033_988_749_895).fract() - 0.5
}

impl Sample {
    fn new(kind: LatticeKind, [columns, rows]: [u32; 2], is_held: impl Fn(usize) -> bool) -> Self {
        Self::of(operator(kind, columns, rows, is_held))
    }

    /// The same with some of the particles along an outline.
    fn with_outliers(kind: LatticeKind, size: [u32; 2], is_held: impl Fn(usize) -> bool) -> Self {
        Self::of(with_outliers(&operator(kind, size[0], size[1], is_held)))
    }

    fn of(operator: Operator) -> Self {
        let count = operator.count();
        let sites: Vec<Site> = operator.columns.sites().collect();
        let field =
            |from: usize| (0..count).map(|i| [noise(from + 2 * i), noise(from + 2 * i + 1)]).collect();
        Self {
            column: sites.iter().map(|&site| operator.outliers.column(site)).collect(),
            sites,
            forces: field(7),
            held: field(1000),
            held_axes: (0..count).map(|i| [i % 53 == 11, i % 61 == 5]).collect(),
            operator,
        }
    }

    /// The particles of these columns, as a system of their own.
    fn columns(&self, columns: Range<i32>) -> System {
        let of = self.particles(&columns);
        let row = |i: usize| {
            let (i, Row { diagonal, mut entries }) = (of.start + i, self.operator.row(of.start + i));
            entries.retain(|(offset, _)| {
                let there = self.operator.index_of(self.sites[i], *offset);
                columns.contains(&self.column[there])
            });
            Row { diagonal, entries }
        };
        let follows = self.operator.follows()[of.clone()].to_vec();
        let sites = &self.sites[of.clone()];
        // A part has the places of those that stand in it.
        let along = sites.iter().filter(|site| site[0] == Body::ALONG_OUTLINE);
        let outliers = Outliers::new(along.map(|&site| (site[1], self.operator.outliers.place(site))));
        let grid = self.operator.grid;
        let operator = Operator::from_rows_along_outline((sites, outliers), grid, follows, row);
        let operator = operator.expect("an operator");
        let slice = |of_all: &Vectors| of.clone().map(|i| of_all.get(i)).collect();
        let operator = operator.with_held_axes(self.held_axes[of.clone()].to_vec());
        System::new(operator, slice(&self.forces), slice(&self.held))
    }

    fn particles(&self, columns: &Range<i32>) -> Range<usize> {
        let begin = |column: i32| self.column.partition_point(|&other| other < column);
        begin(columns.start)..begin(columns.end)
    }

    fn all(&self) -> Range<i32> {
        self.column[0]..self.column[self.column.len() - 1] + 1
    }

    /// The part of a rank, with a few columns on either side.
    fn part(&self, team: &Team) -> System {
        let all = self.all();
        let cut = |rank: usize| all.start + (all.len() * rank / team.count()) as i32;
        let own = cut(team.rank())..cut(team.rank() + 1);
        let window = (own.start - 5).max(all.start)..(own.end + 5).min(all.end);
        let (own, here) = (self.particles(&own), self.particles(&window));
        let owned = own.start - here.start..own.end - here.start;
        self.columns(window).of_part(SystemPart { team: team.clone(), first: here.start, owned })
    }
}

/// The results of each rank, with matrices in groups of so much.
fn on_ranks<T: Send>(count: usize, size: u64, work: impl Fn(&Team) -> T + Sync) -> Vec<T> {
    let alone = |team: Team| {
        // Of one thread, so that all matrices of a rank are set up by it.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
        pool.install(|| {
            SIZE.set(Some(size));
            work(&team)
        })
    };
    std::thread::scope(|scope| {
        let ranks: Vec<_> = in_process(count).into_iter().map(|team| scope.spawn(|| alone(team))).collect();
        ranks.into_iter().map(|rank| rank.join().expect("no rank panics")).collect()
    })
}

type Found = (Result<(Vec<u64>, String), SolveError>, Vec<u64>);

fn words(found: Result<Solved, SolveError>, of: impl Fn(&Solved) -> Range<usize>) -> Found {
    match found {
        Err(error) => (Err(error), Vec::new()),
        Ok(solved) => {
            let u = &solved.displacement;
            let places = of(&solved).flat_map(|i| u.get(i).map(f64::to_bits)).collect();
            let residuals = solved.residuals.iter().map(|residual| residual.to_bits()).collect();
            let how = (residuals, format!("{} {} {:?}", solved.solver, solved.converged, solved.known_to));
            (Ok(how), places)
        }
    }
}

fn assert_found_the_same(sample: &Sample, size: u64, request: &Request, what: &str) {
    let whole = |_: &Team| {
        let system = sample.columns(sample.all());
        words(solve_shared(&system, request, None), |solved| 0..solved.displacement.len())
    };
    let expected = on_ranks(1, size, whole).remove(0);
    for ranks in [1, 2, 3, 5] {
        let found = on_ranks(ranks, size, |team| {
            let system = sample.part(team);
            let owned = system.owned();
            words(solve_shared(&system, request, Some(team)), |_| owned.clone())
        });
        assert!(found.iter().all(|one| one.0 == expected.0), "{what}, {ranks} ranks: {:?}", found[0].0);
        let places: Vec<u64> = found.into_iter().flat_map(|one| one.1).collect();
        assert!(places == expected.1, "{what}, {ranks} ranks: displacements");
        let found = on_ranks(ranks, size, |team| {
            let system = sample.columns(sample.all());
            words(solve_shared(&system, request, Some(team)), |solved| 0..solved.displacement.len())
        });
        assert!(found.iter().all(|one| *one == expected), "{what}, whole on each of {ranks} ranks");
    }
}

#[test]
fn parts_of_a_system_have_the_bits_of_the_whole_on_every_lattice() {
    for kind in LatticeKind::SAMPLES {
        assert_parts_have_the_bits_of(&Sample::new(kind, [67, 41], |i| i < 60 || i % 211 == 5), kind);
    }
}

#[test]
fn so_have_parts_of_one_with_particles_along_an_outline() {
    for kind in LatticeKind::SAMPLES {
        let sample = Sample::with_outliers(kind, [67, 41], |i| i < 60 || i % 211 == 5);
        assert_parts_have_the_bits_of(&sample, kind);
    }
}

fn assert_parts_have_the_bits_of(sample: &Sample, kind: LatticeKind) {
    for (solver, size) in [
        (Solver::ConjugateGradients, 90),
        (Solver::Multigrid, 90),
        (Solver::Multigrid, 300),
        // Left to the first rank.
        (Solver::Multigrid, 2000),
        (Solver::Direct, 300),
    ] {
        let request = Request { solver: Choice::This(solver), tolerance: 1e-8, ..Request::default() };
        assert_found_the_same(sample, size, &request, &format!("{kind:?} {solver} {size}"));
    }
    for solver in [Solver::ConjugateGradients, Solver::Multigrid] {
        let request = Request { solver: Choice::This(solver), tolerance: 1e-4, ..Request::default() };
        let request = Request { precision: Precision::F32, ..request };
        assert_found_the_same(sample, 90, &request, &format!("{kind:?} {solver} in single precision"));
    }
}

#[test]
fn what_ranks_refuse_together_is_what_one_refuses_alone() {
    let kind = LatticeKind::SAMPLES[0];
    let of = |change: &dyn Fn(&mut Sample)| {
        let mut sample = Sample::new(kind, [40, 11], |i| i < 9);
        change(&mut sample);
        sample
    };
    let request = Request { solver: Choice::This(Solver::Multigrid), ..Request::default() };
    let samples = [
        of(&|sample| sample.forces.x[333] = f64::NAN),
        of(&|sample| sample.held.y[3] = f64::INFINITY),
        of(&|sample| sample.held.y[3] = 1e308),
        of(&|sample| *sample = Sample::new(kind, [40, 11], |_| true)),
        of(&|sample| {
            *sample = Sample::new(kind, [40, 11], |_| false);
            sample.held_axes.fill([false; 2]);
        }),
        of(&|sample| {
            *sample = Sample::with_outliers(kind, [40, 11], |i| i < 9);
            sample.forces.x[333] = f64::NAN;
        }),
    ];
    for (k, sample) in samples.iter().enumerate() {
        assert_found_the_same(sample, 40, &request, &format!("{k}"));
    }
}

#[test]
fn what_columns_cost_is_what_their_runs_cost() {
    for kind in LatticeKind::SAMPLES {
        let sample = Sample::with_outliers(kind, [67, 41], |i| i < 60 || i % 211 == 5);
        let bounds = on_ranks(1, 90, |team| {
            let matrix = Matrix::of_followers(&sample.columns(sample.all()).operator);
            let (bounds, columns) = (matrix.bounds.clone(), matrix.group_columns.clone());
            let part = SystemPart::of_whole(team, &matrix.columns);
            let (windowed, _) = super::of_part(&part, matrix, (false, [[1.0, 0.0], [0.0, 1.0]]));
            [(bounds, columns), (windowed.bounds.clone(), windowed.group_columns.clone())]
        });
        assert!(bounds[0][0].0.len() > 20, "{kind:?}");
        assert_eq!(bounds[0][0], bounds[0][1], "{kind:?}");
    }
}
