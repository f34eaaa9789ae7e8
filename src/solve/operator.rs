//! The flock's operator by classes of rows.
//!
//! On a lattice body of one material, what a particle feels depends on nothing but which of the cells
//! around it exist, so a body of millions of particles has a few dozen different rows. The operator keeps
//! those and one class number a particle; indices of neighbours follow from the sites.

mod columns;
mod connected;
mod kernel;
mod matrix;
mod outliers;
mod packs;
mod rows;
#[cfg(test)]
pub mod samples;
#[cfg(test)]
mod tests;
mod window;

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use columns::Finder;
pub(crate) use columns::{Columns, Segment};
pub(crate) use kernel::{Particles, RowCoefficients, Task, pass, product};
#[cfg(test)]
pub(crate) use matrix::SIZE;
pub(crate) use matrix::{HELD, Matrix, leads_to_outlier};
pub(crate) use outliers::Outliers;
pub(crate) use rows::{RowRef, Rows};
pub(crate) use window::{Census, Name, fetched, name_of};

use crate::flock::block::{Block, transposed};
use crate::flock::lattice::Site;
use crate::ranks::Team;

/// `(K u)_i = diagonal u_i - sum_k block_k u_{i + offset_k}`: what holds a particle back, less what its
/// neighbours pull it along with \[force / length\].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row {
    /// Stiffness that holds the particle back by itself \[force / length\].
    pub diagonal: Block,
    /// Offsets in columns and rows of sites, none of them zero and none twice.
    pub entries: Vec<(Site, Block)>,
}

impl Row {
    fn divided_by(mut self, stiffness: f64) -> Self {
        let blocks =
            std::iter::once(&mut self.diagonal).chain(self.entries.iter_mut().map(|(_, block)| block));
        blocks.flatten().flatten().for_each(|value| *value /= stiffness);
        self
    }
}

/// Why rows make no operator. Particles are named by their ids, which count from 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OperatorError {
    /// Sites, classes and roles are not as many.
    #[error("{sites} sites, {classes} classes and {follows} roles do not describe one body")]
    Shapes {
        /// Sites that were given.
        sites: usize,
        /// Row classes that were given.
        classes: usize,
        /// Roles that were given.
        follows: usize,
    },
    /// The sites do not ascend column by column, or one is given twice.
    #[error("the sites must ascend column by column, but that of particle {particle} does not")]
    Order {
        /// Id of the first particle out of order.
        particle: usize,
    },
    /// A follower's row class names no row.
    #[error("particle {particle} has row class {class}, but there are {rows}")]
    NoClass {
        /// Id of the particle.
        particle: usize,
        /// Its row class, from 0.
        class: u32,
        /// Rows that were given.
        rows: usize,
    },
    /// A follower's row leads to a site without a particle.
    #[error(
        "the row of particle {particle} reaches {} columns and {} rows away, where no particle is",
        .offset[0], .offset[1]
    )]
    NoNeighbour {
        /// Id of the particle.
        particle: usize,
        /// Columns and rows from it to that site.
        offset: Site,
    },
    /// A follower's row has an entry that is not finite.
    #[error("the row of particle {particle} is not finite")]
    NotFinite {
        /// Id of the particle.
        particle: usize,
    },
}

impl OperatorError {
    /// The same with the numbers that the particles have elsewhere, both counted from 0.
    pub(crate) fn renumbered(mut self, number: impl Fn(usize) -> usize) -> Self {
        let (Self::Order { particle }
        | Self::NoClass { particle, .. }
        | Self::NoNeighbour { particle, .. }
        | Self::NotFinite { particle }) = &mut self
        else {
            return self;
        };
        *particle = number(*particle - 1) + 1;
        self
    }
}

/// Rows for all particles of a body that follow.
#[derive(Clone, Debug)]
pub struct Operator {
    pub(super) columns: Columns,
    pub(super) class: Vec<u32>,
    /// Divided by the stiffness.
    rows: Arc<Rows>,
    /// Of each row.
    names: Vec<Name>,
    /// The power of two near the largest stiffness that holds a particle back \[force / length\]: no square of one over- or
    /// underflows, and no bit changes.
    pub(super) stiffness: f64,
    pub(super) follows: Vec<bool>,
    /// Vectors from a site to that of the next column and of the next row \[length\].
    pub(super) grid: [[f64; 2]; 2],
    pub(super) outliers: Outliers,
    /// Components of single particles that are held while they follow along the other, shape \[count\]; empty
    /// where there are none.
    pub(super) held_axes: Vec<[bool; 2]>,
}

impl Operator {
    /// `class` names the row of each particle, shape \[count\]; that of particles that do not follow is not
    /// looked at. `sites` ascend, as those of a body do. `grid` are the vectors of one column and of one
    /// row \[length\].
    pub fn new(
        sites: &[Site],
        grid: [[f64; 2]; 2],
        class: Vec<u32>,
        rows: Vec<Row>,
        follows: Vec<bool>,
    ) -> Result<Self, OperatorError> {
        Self::along_outline((sites, Outliers::default()), grid, class, rows, follows)
    }

    /// The same of particles of which some stand along an outline.
    pub(crate) fn along_outline(
        (sites, outliers): (&[Site], Outliers),
        grid: [[f64; 2]; 2],
        mut class: Vec<u32>,
        rows: Vec<Row>,
        follows: Vec<bool>,
    ) -> Result<Self, OperatorError> {
        let names: Vec<Name> = rows.iter().map(|row| name_of(content(row))).collect();
        join_alike(&names, &mut class);
        Self::of_names((sites, outliers), grid, class, (rows, names), follows)
    }

    /// The same of rows of which no two have one name.
    fn of_names(
        (sites, outliers): (&[Site], Outliers),
        grid: [[f64; 2]; 2],
        class: Vec<u32>,
        (rows, names): (Vec<Row>, Vec<Name>),
        follows: Vec<bool>,
    ) -> Result<Self, OperatorError> {
        let (count, classes) = (sites.len(), class.len());
        if classes != count || follows.len() != count {
            return Err(OperatorError::Shapes { sites: count, classes, follows: follows.len() });
        }
        let order = |site: Site| (outliers.column(site), site);
        if let Some(i) = sites.windows(2).position(|pair| order(pair[0]) >= order(pair[1])) {
            return Err(OperatorError::Order { particle: i + 2 });
        }
        let known = |i: &usize| !follows[*i] || (class[*i] as usize) < rows.len();
        if let Some(i) = (0..count).find(|i| !known(i)) {
            return Err(OperatorError::NoClass { particle: i + 1, class: class[i], rows: rows.len() });
        }
        let columns = Columns::new(sites.iter().copied(), &outliers, |_| true);
        let diagonals = rows.iter().flat_map(|row| row.diagonal.as_flattened().iter().copied());
        let stiffness = power_of_two(diagonals);
        let rows =
            Arc::new(Rows::from(rows.into_iter().map(|row| row.divided_by(stiffness)).collect::<Vec<_>>()));
        let held_axes = Vec::new();
        let operator = Self { columns, class, rows, names, stiffness, follows, grid, outliers, held_axes };
        operator.check_rows()?;
        Ok(operator)
    }

    /// From a row for each particle, alike rows becoming one class; `row(i)` is asked of followers only.
    pub fn from_rows(
        sites: &[Site],
        grid: [[f64; 2]; 2],
        follows: Vec<bool>,
        row: impl Fn(usize) -> Row,
    ) -> Result<Self, OperatorError> {
        Self::from_rows_along_outline((sites, Outliers::default()), grid, follows, row)
    }

    /// The same of particles of which some stand along an outline.
    pub(crate) fn from_rows_along_outline(
        (sites, outliers): (&[Site], Outliers),
        grid: [[f64; 2]; 2],
        follows: Vec<bool>,
        row: impl Fn(usize) -> Row,
    ) -> Result<Self, OperatorError> {
        let mut known: HashMap<Name, u32> = HashMap::new();
        let (mut rows, mut names) = (Vec::new(), Vec::new());
        let mut class = vec![0; sites.len()];
        for i in (0..sites.len().min(follows.len())).filter(|&i| follows[i]) {
            let row = row(i);
            let name = name_of(content(&row));
            class[i] = *known.entry(name).or_insert_with(|| {
                rows.push(row);
                names.push(name);
                rows.len() as u32 - 1
            });
        }
        Self::of_names((sites, outliers), grid, class, (rows, names), follows)
    }

    /// The same with single components held of followers, shape \[count\]\[x, y\]; their rows for these components are
    /// the held displacement itself.
    pub fn with_held_axes(mut self, held: Vec<[bool; 2]>) -> Self {
        self.held_axes =
            if held.contains(&[true, false]) || held.contains(&[false, true]) || held.contains(&[true; 2]) {
                held
            } else {
                Vec::new()
            };
        self
    }

    /// The largest stiffness of these particles, as far as they follow \[force / length\].
    pub(super) fn largest_stiffness(&self, of: Range<usize>) -> f64 {
        let mut is_used = vec![false; self.rows.len()];
        of.filter(|&i| self.follows[i]).for_each(|i| is_used[self.class[i] as usize] = true);
        let used = self.rows.iter().zip(is_used).filter(|(_, is_used)| *is_used);
        let values = used.flat_map(|(row, _)| row.diagonal.as_flattened());
        values.fold(0.0, |largest: f64, value| largest.max((value * self.stiffness).abs()))
    }

    /// The same with its rows divided by the power of two near this stiffness, the largest of a body that this is a part of.
    pub(super) fn scaled_to(mut self, largest: f64) -> Self {
        let stiffness = power_of_two([largest].into_iter());
        if stiffness != self.stiffness {
            let row = |row: RowRef<'_>| {
                Row { diagonal: *row.diagonal, entries: row.entries.to_vec() }
                    .divided_by(stiffness / self.stiffness)
            };
            self.rows = Arc::new(Rows::from(self.rows.iter().map(row).collect::<Vec<_>>()));
            self.stiffness = stiffness;
        }
        self
    }

    /// The same with the places of all particles along an outline, of which each rank speaks for those among some particles.
    pub(super) fn with_all_outliers(mut self, team: &Team, owned: &Range<usize>) -> Self {
        let own = self.columns.along().filter(|(_, particle)| owned.contains(particle));
        let own = own.map(|(row, _)| (row, self.outliers.places()[row as usize]));
        self.outliers = Outliers::among(team, own);
        self
    }

    /// The components of a particle that are held while it follows.
    pub fn held_axes(&self, particle: usize) -> [bool; 2] {
        self.held_axes.get(particle).copied().unwrap_or_default()
    }

    /// Number of particles.
    pub fn count(&self) -> usize {
        self.class.len()
    }

    /// Number of particles that follow.
    pub fn followers(&self) -> usize {
        self.follows.iter().filter(|&&follows| follows).count()
    }

    /// Whether each particle follows, shape \[count\].
    pub fn follows(&self) -> &[bool] {
        &self.follows
    }

    /// The row of a follower.
    pub fn row(&self, particle: usize) -> Row {
        let RowRef { diagonal, entries } = self.scaled_row(particle);
        Row { diagonal: *diagonal, entries: entries.to_vec() }.divided_by(1.0 / self.stiffness)
    }

    /// The row of a follower, divided by the stiffness.
    pub(super) fn scaled_row(&self, particle: usize) -> RowRef<'_> {
        self.rows.of(self.class[particle])
    }

    /// Two followers, counted from 0, of which the second does not feel the first, one of these particles, as the first feels it;
    /// `None` where the operator is symmetric, to rounding.
    pub fn asymmetric_pair(&self, of: Range<usize>) -> Option<[usize; 2]> {
        // The last class that each entry of each class was found to fit; a body has few pairs.
        let mut fits: Vec<Vec<u32>> = self.rows.iter().map(|row| vec![HELD; row.entries.len()]).collect();
        self.stretches(|stretch, firsts| {
            if !of.contains(&stretch.start) {
                return None;
            }
            let class = stretch.class as usize;
            for (e, first) in firsts.iter().enumerate() {
                let first = (*first)?;
                for k in 0..stretch.len {
                    let other = first + k;
                    if !self.follows[other] || fits[class][e] == self.class[other] {
                        continue;
                    }
                    if !self.see_each_other_alike(stretch.class, e, self.class[other]) {
                        return Some([stretch.start + k, other]);
                    }
                    fits[class][e] = self.class[other];
                }
            }
            None
        })
    }

    fn see_each_other_alike(&self, class: u32, entry: usize, other: u32) -> bool {
        let [row, other] = [class, other].map(|class| self.rows.of(class));
        let (offset, block) = row.entries[entry];
        let back = [-offset[0], -offset[1]];
        let zero = Block::default();
        let seen = other.entries.iter().find(|(o, _)| *o == back).map_or(&zero, |(_, b)| b);
        let size = |block: &Block| block.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
        let scale = size(row.diagonal).min(size(other.diagonal));
        let expected = transposed(block);
        (0..4).all(|k| (seen[k / 2][k % 2] - expected[k / 2][k % 2]).abs() <= 1e-10 * scale)
    }

    /// Index of the particle at an offset from a site, which a row of the operator leads to.
    pub(super) fn index_of(&self, site: Site, offset: Site) -> usize {
        self.columns.find(add(site, offset)).map(|(index, _)| index).expect("checked when made")
    }

    /// Hands out followers of one class in a row, in segments whose neighbours are segments as well, with the first
    /// neighbour that each entry leads to, until there is an answer.
    pub(super) fn stretches<R>(
        &self,
        mut take: impl FnMut(Stretch, &[Option<usize>]) -> Option<R>,
    ) -> Option<R> {
        let (mut firsts, mut finder) = (Vec::new(), Finder::default());
        for (column, segment) in self.columns.iter() {
            let (mut start, end) = (segment.start as usize, (segment.start + segment.len) as usize);
            while start < end {
                if !self.follows[start] {
                    start += 1;
                    continue;
                }
                let class = self.class[start];
                let steps = start as i32 - segment.start as i32;
                let site = [column, segment.row + self.columns.step() * steps];
                let same = (start..end).take_while(|&i| self.follows[i] && self.class[i] == class);
                let mut len = same.count();
                firsts.clear();
                finder.go(&self.columns, site);
                for (offset, _) in self.rows.of(class).entries {
                    let found = finder.find(&self.columns, *offset);
                    len = len.min(found.map_or(1, |(_, room)| room));
                    firsts.push(found.map(|(first, _)| first));
                }
                if let Some(answer) = take(Stretch { site, start, len, class }, &firsts) {
                    return Some(answer);
                }
                start += len;
            }
        }
        None
    }

    fn check_rows(&self) -> Result<(), OperatorError> {
        let finite = |row: RowRef<'_>| {
            let blocks = std::iter::once(row.diagonal).chain(row.entries.iter().map(|(_, block)| block));
            blocks.flatten().flatten().all(|value| value.is_finite())
        };
        let finite: Vec<bool> = self.rows.iter().map(finite).collect();
        let refused = self.stretches(|Stretch { start, class, .. }, firsts| {
            let particle = start + 1;
            if !finite[class as usize] {
                return Some(OperatorError::NotFinite { particle });
            }
            let lost = firsts.iter().position(Option::is_none)?;
            let (offset, _) = self.rows.of(class).entries[lost];
            Some(OperatorError::NoNeighbour { particle, offset })
        });
        refused.map_or(Ok(()), Err)
    }
}

/// Followers `start..start + len` that have one class and each neighbour at one
/// index distance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch {
    /// Of the first one.
    pub site: Site,
    pub start: usize,
    pub len: usize,
    pub class: u32,
}

/// The power of two nearest below the largest of these in size, as far as its inverse is a double too.
pub(super) fn power_of_two(values: impl Iterator<Item = f64>) -> f64 {
    let largest = values.fold(0.0, |largest: f64, value| largest.max(value.abs()));
    if largest == 0.0 { 1.0 } else { largest.log2().floor().clamp(-1020.0, 1020.0).exp2() }
}

pub(super) fn add(a: Site, b: Site) -> Site {
    [a[0] + b[0], a[1] + b[1]]
}

/// Gives particles whose rows are the same one class: whether two have one must not hang on how they were found.
fn join_alike(names: &[Name], class: &mut [u32]) {
    let mut known: HashMap<Name, u32> = HashMap::new();
    let of_name: Vec<u32> =
        (0..).zip(names).map(|(class, name)| *known.entry(*name).or_insert(class)).collect();
    if known.len() < names.len() {
        let joined = class.iter_mut().filter(|class| (**class as usize) < names.len());
        joined.for_each(|class| *class = of_name[*class as usize]);
    }
}

/// The bits that two rows must share to be of one class.
fn content(row: &Row) -> impl Iterator<Item = u64> + '_ {
    let bits = |block: &Block| block.map(|row| row.map(f64::to_bits)).into_iter().flatten();
    let entries = row.entries.iter().flat_map(move |(offset, block)| {
        std::iter::once((offset[0] as u64) << 32 | u64::from(offset[1] as u32)).chain(bits(block))
    });
    bits(&row.diagonal).chain(entries)
}
