//! A system of which each rank has some particles, and numbers of particles on their way from one share to another.
//!
//! A body is laid out in parts of about as many particles, and iterations are shared by groups of columns: a rank lays out
//! other particles than it iterates with.

use std::ops::Range;

use super::field::Real;
use super::operator::Columns;
use crate::flock::halo::{Halo, meet, put, words, words_per_particle};
use crate::flock::vectors::Vectors;
use crate::ranks::Team;

/// The particles of a system that stand here, and those among them that this rank speaks for.
#[derive(Clone, Debug)]
pub struct SystemPart {
    /// The ranks that have parts of the system.
    pub team: Team,
    /// Index in the whole of the first particle that stands here.
    pub first: usize,
    /// Particles that this rank speaks for, as they are numbered here: whole columns.
    pub owned: Range<usize>,
}

impl SystemPart {
    /// The share of this rank in a system that all ranks have as a whole.
    pub fn of_whole(team: &Team, columns: &Columns) -> Self {
        let all = columns.particles(columns.range());
        let cut = |rank: usize| match rank {
            0 => 0,
            _ if rank == team.count() => all.end,
            _ => {
                let column = columns.column_of(all.end * rank / team.count());
                columns.particles(column..column).start
            }
        };
        Self { team: team.clone(), first: 0, owned: cut(team.rank())..cut(team.rank() + 1) }
    }

    /// What each rank finds, if the first one that finds something is the one that counts.
    pub fn first_found(&self, own: Option<[usize; 2]>) -> Option<[usize; 2]> {
        let words = own.map_or([0; 3], |[a, b]| [1, a as u64, b as u64]);
        let found = self.team.each(words).into_iter().find(|of| of[0] == 1);
        found.map(|[_, a, b]| [a as usize, b as usize])
    }

    /// The columns that each rank speaks for, in their order, and the rows from one particle of a column to the next.
    pub fn columns(&self, columns: &Columns) -> (Vec<Range<i32>>, i32) {
        let column = |index: usize| columns.column_of(index);
        let word = |number: i32| i64::from(number) as u64;
        let step = columns.known_step().map_or(0, |step| step as u64);
        let own = match self.owned.is_empty() {
            true => [0, 0, 0, step],
            false => [1, word(column(self.owned.start)), word(column(self.owned.end - 1) + 1), step],
        };
        let all = self.team.each(own);
        let step = all.iter().map(|of| of[3]).filter(|&step| step > 0).min().unwrap_or(1) as i32;
        let some = || all.iter().filter(|of| of[0] == 1);
        let end = some().map(|of| of[2] as i64 as i32).max().unwrap_or(0);
        let mut begins: Vec<i32> =
            all.iter().map(|of| if of[0] == 1 { of[1] as i64 as i32 } else { i32::MAX }).collect();
        begins.push(end);
        // Those that speak for none do so before the next one that does.
        for rank in (0..begins.len() - 1).rev() {
            begins[rank] = begins[rank].min(begins[rank + 1]);
        }
        (begins.windows(2).map(|ends| ends[0]..ends[1]).collect(), step)
    }

    /// Indices in the whole of the particles of each rank that are so and so many here.
    pub fn of_each(&self, here: Range<usize>) -> Vec<Range<usize>> {
        of_each(&self.team, here.start + self.first..here.end + self.first)
    }
}

/// The range that each rank gives.
pub fn of_each(team: &Team, own: Range<usize>) -> Vec<Range<usize>> {
    let all = team.each([own.start as u64, own.end as u64]);
    all.into_iter().map(|[start, end]| start as usize..end as usize).collect()
}

/// Has words of particles travel from the ranks that own them to others that want them: `read` the words of some of those here,
/// `count` how many they are, and `write` those that arrive. All are numbered as in the whole.
fn exchanged(
    team: &Team,
    (owned, wanted): (&[Range<usize>], &[Range<usize>]),
    read: impl Fn(Range<usize>) -> Vec<u64>,
    count: impl Fn(usize) -> usize,
    mut write: impl FnMut(Range<usize>, &[u64]),
) {
    let ranks = (team.rank(), team.count());
    let Halo { sends, receives } = Halo::new(ranks, |of| owned[of].clone(), |of| wanted[of].clone());
    let sent: Vec<_> = sends.into_iter().map(|(other, of)| (other, read(of))).collect();
    let sizes: Vec<_> = receives.iter().map(|(other, of)| (*other, count(of.len()))).collect();
    for ((_, of), words) in receives.into_iter().zip(team.swap(&sent, &sizes)) {
        write(of, &words);
    }
}

/// The vector over the particles that this rank wants, of one that begins with the `first` particle of the whole.
pub fn moved<T: Real>(
    team: &Team,
    (owned, wanted): (&[Range<usize>], &[Range<usize>]),
    (from, first): (&Vectors<T>, usize),
) -> Vectors<T> {
    let to_first = wanted[team.rank()].start;
    let mut to = Vectors::zeros(wanted[team.rank()].len());
    exchanged(
        team,
        (owned, wanted),
        |of| words(from, &(of.start - first..of.end - first)),
        |count| words_per_particle::<T>() * count,
        |of, words| put(&mut to, &(of.start - to_first..of.end - to_first), words),
    );
    if let Some(own) = meet(&owned[team.rank()], &wanted[team.rank()]) {
        let (read, write) = (own.start - first..own.end - first, own.start - to_first..own.end - to_first);
        to.x[write.clone()].copy_from_slice(&from.x[read.clone()]);
        to.y[write].copy_from_slice(&from.y[read]);
    }
    to
}

/// Makes the flags of particles that others speak for what these say; whether any has changed.
pub fn receive_flags(
    part: &SystemPart,
    (owned, here): (&[Range<usize>], &[Range<usize>]),
    flags: &mut [bool],
) -> bool {
    let (first, mut has_changed) = (part.first, false);
    let known = flags.to_vec();
    exchanged(
        &part.team,
        (owned, here),
        |of| {
            let word =
                |flags: &[bool]| (0..).zip(flags).fold(0, |word, (k, &flag)| word | u64::from(flag) << k);
            known[of.start - first..of.end - first].chunks(64).map(word).collect()
        },
        |count| count.div_ceil(64),
        |of, words| {
            for (k, flag) in flags[of.start - first..of.end - first].iter_mut().enumerate() {
                let received = words[k / 64] >> (k % 64) & 1 == 1;
                has_changed |= received != *flag;
                *flag = received;
            }
        },
    );
    has_changed
}
