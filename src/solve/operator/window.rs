//! A matrix of which each rank has some columns: its own, and those that their rows lead to.
//!
//! All ranks know how many particles each column of the whole has and what they cost, and so how the columns are cut into
//! groups. Columns that another rank has computed travel as numbers, with the rows that their particles have. A row has a
//! *name*, which hangs on nothing but what it was computed from: rows of one name are one, on whichever rank they were computed.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use super::RowRef;
use super::columns::{Columns, groups};
use super::matrix::{HELD, Matrix, cost_of_each, group_size};
use super::rows::Rows;
use crate::flock::block::Block;
use crate::flock::body::Body;
use crate::flock::halo::{Halo, meet};
use crate::flock::lattice::Site;
use crate::flock::splitmix::{STEP, mixed};
use crate::ranks::Team;

/// 128 bits: that two rows of a body have one by chance is out of the question.
pub type Name = [u64; 2];

/// The name of something that consists of these words.
pub fn name_of(words: impl IntoIterator<Item = u64>) -> Name {
    let add =
        |[a, b]: Name, word: u64| [mixed(a ^ word).wrapping_add(STEP), mixed(b.wrapping_mul(STEP) ^ word)];
    words.into_iter().fold([0, 1], add)
}

/// The whole matrix, as far as a rank knows it that has some of its columns.
#[derive(Clone, Debug)]
pub struct Window {
    /// Index in the whole of the first particle that stands here.
    pub first: usize,
    pub census: Arc<Census>,
    /// The largest entry on the diagonal of a row of the whole, where it is asked for.
    pub largest: f64,
}

/// The columns of a matrix, counted.
#[derive(Clone, Debug)]
pub struct Census {
    /// Number of the first column.
    first: i32,
    /// Particles before each column and in all, whether they follow or not, and what they cost; shape \[columns + 1\].
    before: Vec<(usize, u64)>,
    /// Lowest and highest row.
    rows: Option<[i32; 2]>,
    /// Columns in which a particle follows.
    occupied: usize,
    /// Rows from one particle of a column to the next.
    pub step: i32,
}

/// Words of a column that is counted.
const WORDS: usize = 3;

impl Census {
    /// Of columns of which each rank speaks for some, in their order.
    pub fn among(team: &Team, matrix: &Matrix, shares: &[Range<i32>], step: i32) -> Self {
        let of_column = |column: i32| -> [u64; WORDS] {
            let [low, high] = matrix.columns.rows_of(column).unwrap_or([i32::MAX, i32::MIN]);
            let rows = u64::from(low as u32) | u64::from(high as u32) << 32;
            [matrix.columns.particles(column..column + 1).len() as u64, cost_of(matrix, column), rows]
        };
        let own: Vec<u64> = shares[team.rank()].clone().flat_map(of_column).collect();
        let counts: Vec<usize> = shares.iter().map(|share| WORDS * share.len()).collect();
        let all = team.gather(&own, &counts);
        let all: Vec<&[u64]> = all.chunks_exact(WORDS).collect();
        let has_some = |column: &[u64]| column[0] > 0;
        let left_out = all.iter().take_while(|column| !has_some(column)).count();
        let end = all.iter().rposition(|column| has_some(column)).map_or(left_out, |last| last + 1);
        let (mut before, mut sum) = (vec![(0, 0)], (0, 0));
        let (mut rows, mut occupied): (Option<[i32; 2]>, _) = (None, 0);
        for of in &all[left_out..end] {
            sum = (sum.0 + of[0] as usize, sum.1 + of[1]);
            before.push(sum);
            let [low, high] = [of[2] as u32 as i32, (of[2] >> 32) as u32 as i32];
            if low <= high {
                occupied += 1;
                rows = Some(rows.map_or([low, high], |known| [known[0].min(low), known[1].max(high)]));
            }
        }
        Self { first: shares[0].start + left_out as i32, before, rows, occupied, step }
    }

    /// Numbers of the columns.
    pub fn range(&self) -> Range<i32> {
        self.first..self.first + self.before.len() as i32 - 1
    }

    /// Particles of the whole matrix.
    pub fn count(&self) -> usize {
        self.before[self.before.len() - 1].0
    }

    /// Indices of the particles of these columns.
    pub fn particles(&self, columns: Range<i32>) -> Range<usize> {
        let last = self.before.len() as i32 - 1;
        let begin = |column: i32| self.before[(column - self.first).clamp(0, last) as usize].0;
        begin(columns.start)..begin(columns.end)
    }

    /// As [`Columns::extent`].
    pub fn extent(&self) -> [i32; 2] {
        [self.range().len() as i32, self.rows.map_or(0, |[low, high]| (high - low) / self.step + 1)]
    }

    /// One on lattices that have a particle at every column and row, less on others.
    pub fn particles_per_site(&self) -> f64 {
        self.occupied as f64 / self.range().len().max(1) as f64 / f64::from(self.step)
    }

    /// Index bounds of the groups, and the column that each begins with.
    pub fn groups(&self) -> (Vec<usize>, Vec<i32>) {
        let begins = (self.first..).zip(&self.before).map(|(column, &(begin, cost))| (column, begin, cost));
        let (count, cost) = self.before[self.before.len() - 1];
        groups(begins, (self.range().end, count, cost), group_size(cost))
    }
}

/// Particles of one class in a row, of a segment: site and index of the first one, how many, class.
type Stretch = (Site, usize, usize, u32);

/// The stretches of a column; those of particles that do not follow are in no row.
fn stretches(matrix: &Matrix, column: i32) -> Vec<Stretch> {
    let (mut stretches, particles) = (Vec::new(), matrix.columns.particles(column..column + 1));
    let mut at = particles.start;
    for (of, segment) in matrix.columns.segments(column..column + 1) {
        let [start, end] = [segment.start, segment.start + segment.len].map(|index| index as usize);
        if at < start {
            stretches.push(([of, 0], at, start - at, HELD));
        }
        at = start;
        for alike in matrix.class[start..end].chunk_by(|a, b| a == b) {
            let row = segment.row + matrix.columns.step() * (at - start) as i32;
            stretches.push(([of, row], at, alike.len(), alike[0]));
            at += alike.len();
        }
    }
    if at < particles.end {
        stretches.push(([column, 0], at, particles.end - at, HELD));
    }
    stretches
}

/// The cost of a column: particles that stand one after the other with one class are a run, as hardly ever their neighbours do not
/// stand one after the other too.
pub(super) fn cost_of(matrix: &Matrix, column: i32) -> u64 {
    let follow = stretches(matrix, column).into_iter().filter(|(.., class)| *class != HELD);
    follow.map(|(_, _, len, _)| len as u64 * u64::from(cost_of_each(len as u32))).sum()
}

/// Marks particles that stand along an outline.
const ALONG: u64 = 1 << 32;

/// Columns as words: those of each column, then those of the rows that they have.
fn packed(matrix: &Matrix, columns: Range<i32>, step: i32) -> Vec<u64> {
    let mut words = Vec::new();
    let (mut number, mut used) = (vec![HELD; matrix.rows.len()], Vec::new());
    let is_other = matrix.columns.step() != step;
    for column in columns {
        let head = words.len();
        words.push(0);
        for ([of, row], _, len, class) in stretches(matrix, column) {
            let is_along = if of == Body::ALONG_OUTLINE { ALONG } else { 0 };
            let class = match class {
                HELD => HELD,
                class => {
                    let known = &mut number[class as usize];
                    if *known == HELD {
                        *known = used.len() as u32;
                        used.push(class);
                    }
                    *known
                }
            };
            // A few particles whose step says nothing.
            let pieces = if is_other && class != HELD { len } else { 1 };
            for piece in 0..pieces {
                let row = row + matrix.columns.step() * piece as i32;
                let word = u64::from(row as u32) | ((len / pieces) as u64) << 32;
                words.extend([word, u64::from(class) | is_along]);
            }
        }
        words[head] = ((words.len() - head - 1) / 2) as u64;
    }
    for class in used {
        let RowRef { diagonal, entries } = matrix.rows.of(class);
        words.extend(matrix.names[class as usize]);
        words.push(entries.len() as u64);
        words.extend(diagonal.as_flattened().iter().map(|value| value.to_bits()));
        for ([column, row], block) in entries {
            words.push(u64::from(*column as u32) | u64::from(*row as u32) << 32);
            words.extend(block.as_flattened().iter().map(|value| value.to_bits()));
        }
    }
    words
}

/// Columns that are put together.
struct Assembly {
    columns: Columns,
    class: Vec<u32>,
    rows: Rows,
    names: Vec<Name>,
    known: HashMap<Name, u32>,
}

impl Assembly {
    fn new(first: i32, step: i32) -> Self {
        Self {
            columns: Columns::from_number(first, step),
            class: Vec::new(),
            rows: Rows::default(),
            names: Vec::new(),
            known: HashMap::new(),
        }
    }

    /// Adds so many columns that were packed.
    fn add(&mut self, columns: usize, words: &[u64]) {
        let begin = self.class.len();
        let mut rest = words;
        for _ in 0..columns {
            let (&[stretches], after) = rest.split_first_chunk().expect("a column");
            let (of_column, after) = after.split_at(2 * stretches as usize);
            self.columns.open_next(self.class.len());
            for of in of_column.chunks_exact(2) {
                let (row, len, class) = (of[0] as u32 as i32, (of[0] >> 32) as usize, of[1] as u32);
                match of[1] & ALONG {
                    _ if class == HELD => {}
                    ALONG => self.columns.push_along(row, self.class.len(), len),
                    _ => self.columns.push(row, self.class.len(), len),
                }
                self.class.resize(self.class.len() + len, class);
            }
            rest = after;
        }
        let mut of_number = Vec::new();
        while let [a, b, entries, after @ ..] = rest {
            let (diagonal, after) = after.split_at(4);
            let (row, after) = after.split_at(5 * *entries as usize);
            rest = after;
            let name = [*a, *b];
            of_number.push(*self.known.entry(name).or_insert_with(|| {
                let entries = row.chunks_exact(5).map(|of| {
                    let offset: Site = [of[0] as u32 as i32, (of[0] >> 32) as u32 as i32];
                    (offset, block(&of[1..]))
                });
                self.rows.push(block(diagonal), entries);
                self.names.push(name);
                self.names.len() as u32 - 1
            }));
        }
        let follow = self.class[begin..].iter_mut().filter(|class| **class != HELD);
        follow.for_each(|class| *class = of_number[*class as usize]);
    }

    fn into_matrix(mut self) -> Matrix {
        self.columns.end(self.class.len());
        Matrix::uncompiled(self.columns, self.class, (self.rows, self.names))
    }
}

fn block(words: &[u64]) -> Block {
    let entry = |k: usize| f64::from_bits(words[k]);
    [[entry(0), entry(1)], [entry(2), entry(3)]]
}

/// The columns that this rank `wants` of a matrix, of which each rank speaks for its share.
pub fn fetched(
    team: &Team,
    matrix: &Matrix,
    (shares, step): (&[Range<i32>], i32),
    wants: &[Range<i32>],
) -> Matrix {
    let rank = team.rank();
    let Halo { sends, receives } =
        Halo::new((rank, team.count()), |of| shares[of].clone(), |of| wants[of].clone());
    let messages: Vec<_> = sends.into_iter().map(|(other, of)| (other, packed(matrix, of, step))).collect();
    let lengths: Vec<_> = messages.iter().map(|(to, words)| (*to, vec![words.len() as u64])).collect();
    let from: Vec<_> = receives.iter().map(|(other, _)| (*other, 1)).collect();
    let sizes = team.swap(&lengths, &from).into_iter().map(|words| words[0] as usize);
    let from: Vec<_> = receives.iter().map(|(other, _)| *other).zip(sizes).collect();
    let arrived = receives.into_iter().zip(team.swap(&messages, &from));
    let own = meet(&shares[rank], &wants[rank]).map(|of| ((rank, of.clone()), packed(matrix, of, step)));
    let mut all: Vec<_> = arrived.chain(own).collect();
    all.sort_by_key(|((of, _), _)| *of);
    let mut assembly = Assembly::new(wants[rank].start, step);
    all.iter().for_each(|((_, columns), words)| assembly.add(columns.len(), words));
    assembly.into_matrix().with_outliers(matrix.outliers.clone())
}
