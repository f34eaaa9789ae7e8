//! The operator over the followers alone, compiled for speed: what the solvers iterate with, and what
//! every level of multigrid is.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

use super::columns::{Begin, Columns, Finder, groups};
use super::outliers::Outliers;
use super::packs::Packs;
use super::rows::{RowRef, Rows};
use super::window::{Census, Name, Window, cost_of, name_of};
use super::{Operator, Stretch};
use crate::flock::block::Block;
use crate::flock::body::Body;
use crate::flock::lattice::Site;
use crate::flock::vectors::Vectors;
use crate::ranks::Team;
use crate::solve::field::{Real, VectorsMut, dot};
use crate::solve::part::Part;

/// Class of particles that do not follow.
pub const HELD: u32 = u32::MAX;

/// About how many particles a thread is given at a time: their vectors stay in its second cache over a few loops.
const GROUP: u64 = 1 << 13;

/// What a particle in a pack costs, in particles of long runs.
const PACKED: u32 = 3;

/// Cost that is one thread's alone: two would wait for each other longer than they save.
const ALONE: u64 = 20_000;

#[cfg(test)]
thread_local! {
    /// Least cost of the groups of this thread's matrices, for small bodies to have several.
    pub static SIZE: std::cell::Cell<Option<u64>> = const { std::cell::Cell::new(None) };
}

/// Least cost of a group, of what all cost: one group up to [`ALONE`], and an even number of about as large ones above.
pub(super) fn group_size(cost: u64) -> u64 {
    #[cfg(test)]
    if let Some(size) = SIZE.get() {
        return size;
    }
    let groups = if cost <= ALONE { 1 } else { 2 * ((cost + GROUP) / (2 * GROUP)) };
    cost.div_ceil(groups).max(1)
}

/// What each of so many consecutive particles of one class costs, in particles of long runs.
pub(super) fn cost_of_each(len: u32) -> u32 {
    if len < LONG { PACKED } else { 1 }
}

/// Consecutive particles of one class whose neighbours lie at the same index distances.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    pub start: u32,
    pub len: u32,
    pub class: u32,
    /// Where the index distances begin: zero for the particle itself, then its neighbours'.
    pub distances: u32,
    /// Number of them.
    pub terms: u32,
}

/// Particles from which on a run is gone over by itself; those of shorter ones are packed.
pub(super) const LONG: u32 = 4;

impl Run {
    /// Whether its particles are in packs.
    #[inline(always)]
    pub fn is_packed(&self) -> bool {
        self.len < LONG
    }
}

/// A square matrix over the followers. Vectors are as long as the body, zero at particles that are held.
#[derive(Clone, Debug)]
pub struct Matrix {
    /// Segments of followers.
    pub columns: Columns,
    /// Row of each particle, [`HELD`] where it does not follow, shape \[count\].
    pub class: Vec<u32>,
    pub rows: Rows,
    /// Of each row, the same wherever it is computed; empty of a coarser grid that one rank has whole.
    pub names: Vec<Name>,
    /// Index bounds of the groups of columns that threads work on, shape \[groups + 1\].
    pub bounds: Vec<usize>,
    /// First column of each group, shape \[groups + 1\].
    pub group_columns: Vec<i32>,
    /// What passes go over, made when it is first asked for: the next coarser grid does not wait for it.
    runs: OnceLock<RunTable>,
    packs: OnceLock<Packs>,
    pub outliers: Outliers,
    /// The part of this rank while several iterate with it; what they compute outside it is not known here.
    pub part: Option<Arc<Part>>,
    /// The matrix that this is some columns of.
    pub window: Option<Window>,
}

impl Matrix {
    /// `columns` hold the particles that have a class, and the entries of every row lead to such.
    pub fn compile(columns: Columns, class: Vec<u32>, rows: Rows) -> Self {
        Self::uncompiled(columns, class, (rows, Vec::new())).grouped(group_size)
    }

    /// The matrix of no particle.
    pub fn nothing() -> Self {
        Self::uncompiled(Columns::default(), Vec::new(), (Rows::default(), Vec::new()))
    }

    /// The same without groups that passes go over.
    pub fn uncompiled(columns: Columns, class: Vec<u32>, (rows, names): (Rows, Vec<Name>)) -> Self {
        Self {
            columns,
            class,
            rows,
            names,
            bounds: Vec::new(),
            group_columns: Vec::new(),
            runs: OnceLock::new(),
            packs: OnceLock::new(),
            outliers: Outliers::default(),
            part: None,
            window: None,
        }
    }

    /// The same of particles of which some stand along an outline.
    pub fn with_outliers(self, outliers: Outliers) -> Self {
        Self { outliers, ..self }
    }

    /// Compiles the rows of the groups of this rank, of a matrix of which it has the columns that they lead to.
    pub fn in_window(mut self, census: &Arc<Census>, part: impl FnOnce(usize) -> Part) -> Self {
        let first = if self.count() == 0 { 0 } else { census.particles(self.columns.range()).start };
        let part = part(first);
        let (bounds, group_columns) = census.groups();
        self.bounds = bounds.iter().map(|bound| bound.saturating_sub(first).min(self.count())).collect();
        self.group_columns = group_columns;
        self.window = Some(Window { first, census: census.clone(), largest: 0.0 });
        self.part = Some(Arc::new(part));
        self
    }

    /// The same with the largest entry on the diagonal of a row of any rank.
    pub fn with_largest(mut self, team: &Team) -> Self {
        let own = self.runs().iter().map(|run| largest_on_diagonal(self.rows.of(run.class)));
        let [largest] = team.largest([own.fold(0.0, f64::max)]);
        self.window.iter_mut().for_each(|window| window.largest = largest);
        self
    }

    /// The largest entry on the diagonal of a row.
    pub fn largest(&self) -> f64 {
        let of_rows = || self.rows.iter().map(largest_on_diagonal).fold(0.0, f64::max);
        self.window.as_ref().map_or_else(of_rows, |window| window.largest)
    }

    /// The index in the whole matrix of the first particle that stands here.
    pub fn first(&self) -> usize {
        self.window.as_ref().map_or(0, |window| window.first)
    }

    /// The ranks that have windows of this matrix and groups of it, if it is more than one.
    pub fn team(&self) -> Option<&Team> {
        self.window.as_ref()?;
        self.part.as_ref().filter(|part| part.is_shared()).map(|part| &part.team)
    }

    /// Indices, in the whole matrix, of the particles of these columns.
    pub fn particles_of(&self, columns: Range<i32>) -> Range<usize> {
        match &self.window {
            Some(window) => window.census.particles(columns),
            None => self.columns.particles(columns),
        }
    }

    /// Cuts the body into groups that cost at least `size` of what all cost.
    fn grouped(mut self, size: impl FnOnce(u64) -> u64) -> Self {
        let mut sum = 0;
        let begins: Vec<Begin> = (self.columns.begins())
            .map(|(column, begin)| {
                let before = sum;
                sum += cost_of(&self, column);
                (column, begin, before)
            })
            .collect();
        let end = (self.columns.range().end, self.count(), sum);
        (self.bounds, self.group_columns) = groups(begins.into_iter(), end, size(sum));
        self
    }

    /// The same in groups of another size.
    #[cfg(test)]
    pub fn regrouped(self, size: u64) -> Self {
        let regrouped = self.grouped(|_| size);
        Self { runs: OnceLock::new(), packs: OnceLock::new(), ..regrouped }
    }

    /// The rows of the operator without what they owe to held particles.
    pub fn of_followers(operator: &Operator) -> Self {
        let outliers = operator.outliers.clone();
        let columns = Columns::new(operator.columns.sites(), &outliers, |i| operator.follows[i]);
        let mut class = vec![HELD; operator.count()];
        let mut rows = Rows::sharing(&operator.rows);
        let mut names = operator.names.clone();
        let (mut known, mut runs, mut distances) = (HashMap::new(), Runs::default(), Vec::new());
        // How many particles before each have something held.
        let mut held = vec![0u32];
        held.extend((0..operator.count()).scan(0, |held, i| {
            *held += u32::from(!operator.follows[i] || operator.held_axes(i) != [false; 2]);
            Some(*held)
        }));
        operator.stretches(|Stretch { site, start, len, class: full }, firsts| {
            let firsts = || firsts.iter().map(|first| first.expect("checked when made"));
            if std::iter::once(start).chain(firsts()).all(|first| held[first] == held[first + len]) {
                class[start..start + len].fill(full);
                distances.clear();
                distances.push(0);
                distances.extend(firsts().map(|first| first as i32 - start as i32));
                runs.push(start as u32..(start + len) as u32, full, &distances);
                return None::<()>;
            }
            for k in 0..len {
                // Which components of the particle itself and of its neighbours are unknowns.
                let unknown = |i: usize| {
                    let held = operator.held_axes(i);
                    if operator.follows[i] { held.map(|held| !held) } else { [false; 2] }
                };
                let ends = std::iter::once(start).chain(firsts());
                let free: Vec<[bool; 2]> = ends.map(|first| unknown(first + k)).collect();
                let follows: Vec<bool> = firsts().map(|j| operator.follows[j + k]).collect();
                class[start + k] =
                    *known.entry((full, free, follows)).or_insert_with_key(|(full, free, follows)| {
                        push_without_held(&mut rows, operator.rows.of(*full), free, follows);
                        let flags = free.iter().flatten().chain(follows).map(|&flag| u64::from(flag));
                        names.push(name_of(operator.names[*full as usize].into_iter().chain(flags)));
                        rows.len() as u32 - 1
                    });
            }
            runs.find((&columns, &class, &rows), site, start as u32..(start + len) as u32);
            None
        });
        let matrix = Self { outliers, ..Self::uncompiled(columns, class, (rows, names)) }.grouped(group_size);
        let runs = OnceLock::from(RunTable::new(runs, &matrix.bounds));
        Self { runs, ..matrix }
    }

    pub fn count(&self) -> usize {
        self.class.len()
    }

    pub fn groups(&self) -> usize {
        self.bounds.len() - 1
    }

    /// The square of a vector over all groups.
    pub fn square<T: Real>(&self, v: &Vectors<T>) -> f64 {
        let of_group = |ends: &[usize]| {
            let v = v.view().range(ends[0]..ends[1]);
            dot(v, v)
        };
        let own = self.own_groups();
        self.sum(&self.bounds[own.start..=own.end].windows(2).map(of_group).collect::<Vec<_>>())
    }

    /// The groups that this rank computes.
    pub fn own_groups(&self) -> Range<usize> {
        self.part.as_ref().map_or(0..self.groups(), |part| part.groups())
    }

    /// The groups that this rank computes, of a vector that is written.
    pub fn own_parts<'a, T: Real>(&self, v: &'a mut Vectors<T>) -> Vec<VectorsMut<'a, T>> {
        let groups = self.own_groups();
        v.parts(&self.bounds).into_iter().skip(groups.start).take(groups.len()).collect()
    }

    /// The sum over all groups, of which `own` are those of this rank.
    pub fn sum(&self, own: &[f64]) -> f64 {
        self.sum_and_any(own, false).0
    }

    /// The same, and whether any rank has the flag.
    pub fn sum_and_any(&self, own: &[f64], flag: bool) -> (f64, bool) {
        self.part.as_ref().map_or_else(|| (own.iter().sum(), flag), |part| part.sum(own, flag))
    }

    /// Makes known to this rank what the rows of its particles lead to.
    pub fn receive<T: Real>(&self, v: &mut Vectors<T>) {
        if let Some(part) = &self.part {
            part.receive(v);
        }
    }

    fn run_table(&self) -> &RunTable {
        self.runs.get_or_init(|| {
            let own = self.own_groups();
            let [begin, end] = [own.start, own.end].map(|group| self.group_columns[group]);
            let mut runs = Runs::default();
            for (column, segment) in self.columns.segments(begin..end) {
                let rows = (&self.columns, &self.class[..], &self.rows);
                runs.find(rows, [column, segment.row], segment.start..segment.start + segment.len);
            }
            RunTable::new(runs, &self.bounds)
        })
    }

    /// Runs of a group.
    pub fn runs_of(&self, group: usize) -> &[Run] {
        let table = self.run_table();
        &table.runs[table.of_groups[group]..table.of_groups[group + 1]]
    }

    /// Runs of the groups of this rank.
    pub fn runs(&self) -> &[Run] {
        &self.run_table().runs
    }

    /// Index distances to a run's particles themselves (zero) and to their neighbours, in the order of
    /// the row's entries.
    pub fn distances(&self, run: &Run) -> &[i32] {
        &self.run_table().distances[run.distances as usize..][..run.terms as usize]
    }

    /// The particles of short runs.
    pub fn packs(&self) -> &Packs {
        self.packs.get_or_init(|| Packs::new(self))
    }

    /// Most columns from a particle to another that its row leads to, of the rows that are compiled.
    pub fn reach_across(&self) -> i32 {
        if self.outliers.is_empty() {
            return self.reach()[0];
        }
        let column = |particle: u32| self.columns.column_of(particle as usize);
        let of_run = |run: &Run| {
            let here = column(run.start);
            let others = self.distances(run)[1..].iter();
            others.map(|&distance| (column(run.start.wrapping_add_signed(distance)) - here).abs()).max()
        };
        self.runs().iter().filter_map(of_run).max().unwrap_or(0)
    }

    /// Most columns and rows that an entry between two sites of the lattice reaches.
    pub fn reach(&self) -> [i32; 2] {
        let entries = self.rows.iter().flat_map(|row| row.entries);
        let entries = entries.filter(|(offset, _)| !leads_to_outlier(*offset));
        entries.fold([0, 0], |far, (o, _)| [far[0].max(o[0].abs()), far[1].max(o[1].abs())])
    }
}

fn largest_on_diagonal(row: RowRef<'_>) -> f64 {
    row.diagonal[0][0].abs().max(row.diagonal[1][1].abs())
}

/// The runs of a matrix.
#[derive(Clone, Debug)]
struct RunTable {
    runs: Vec<Run>,
    distances: Vec<i32>,
    /// First run of each group, shape \[groups + 1\].
    of_groups: Vec<usize>,
}

impl RunTable {
    fn new(Runs { runs, distances, .. }: Runs, bounds: &[usize]) -> Self {
        let first = |&bound: &usize| runs.partition_point(|run| (run.start as usize) < bound);
        let of_groups = bounds.iter().map(first).collect();
        Self { runs, distances, of_groups }
    }
}

/// Runs that are being found.
#[derive(Default)]
struct Runs {
    runs: Vec<Run>,
    distances: Vec<i32>,
    /// Where the distances last used with each class lie: most columns are like the one before.
    last: Vec<Option<usize>>,
    finder: Finder,
}

impl Runs {
    /// Adds a run of a class with these distances.
    fn push(&mut self, particles: Range<u32>, class: u32, distances: &[i32]) {
        if self.last.len() <= class as usize {
            self.last.resize(class as usize + 1, None);
        }
        let known = self.last[class as usize].filter(|&at| self.distances[at..].starts_with(distances));
        let at = known.unwrap_or_else(|| {
            self.distances.extend(distances);
            self.distances.len() - distances.len()
        });
        self.last[class as usize] = Some(at);
        let (start, len) = (particles.start, particles.len() as u32);
        self.runs.push(Run { start, len, class, distances: at as u32, terms: distances.len() as u32 });
    }

    /// Adds the runs of particles in a segment, of which the first stands at a site.
    fn find(&mut self, (columns, class, rows): (&Columns, &[u32], &Rows), site: Site, particles: Range<u32>) {
        let (mut start, mut found) = (particles.start, Vec::new());
        while start < particles.end {
            let own = class[start as usize];
            let classes = &class[start as usize..particles.end as usize];
            let mut len = classes.iter().take_while(|&&c| c == own).count();
            let site = [site[0], site[1] + columns.step() * (start - particles.start) as i32];
            found.clear();
            found.push(0);
            self.finder.go(columns, site);
            for (offset, _) in rows.of(own).entries {
                let (there, room) = self.finder.find(columns, *offset).expect("rows lead to followers");
                len = len.min(room);
                found.push(there as i32 - start as i32);
            }
            self.push(start..start + len as u32, own, &found);
            start += len as u32;
        }
    }
}

/// Whether an offset leads from a site of the lattice to a particle along an outline, or back.
pub fn leads_to_outlier([columns, _]: Site) -> bool {
    columns.abs() > Body::ALONG_OUTLINE / 2
}

/// Adds a row in unknown components alone: `free` are those of the particle itself and of each neighbour, of which only
/// those that follow have a place in the matrix. A held component keeps its place on the diagonal and is moved by
/// nothing.
fn push_without_held(rows: &mut Rows, row: RowRef<'_>, free: &[[bool; 2]], follows: &[bool]) {
    let own = free[0];
    let keep = |block: &Block, other: [bool; 2]| -> Block {
        std::array::from_fn(|a| std::array::from_fn(|b| if own[a] && other[b] { block[a][b] } else { 0.0 }))
    };
    let mut diagonal = keep(row.diagonal, own);
    for axis in (0..2).filter(|&axis| !own[axis]) {
        diagonal[axis][axis] = row.diagonal[axis][axis];
    }
    let entries = row.entries.iter().zip(&free[1..]).zip(follows).filter(|(_, follows)| **follows);
    rows.push(diagonal, entries.map(|(((offset, block), other), _)| (*offset, keep(block, *other))));
}
