//! Whether a chain of neighbours connects every follower to a held particle.

use std::ops::Range;

use super::Operator;
use super::matrix::{HELD, Matrix, Run};
use crate::geometry::lists::Lists;
use crate::solve::shared::{SystemPart, receive_flags};

/// Sweeps to and fro before single particles are followed: almost every body is done after one.
const SWEEPS: usize = 8;

impl Operator {
    /// The first follower, counted from 0, that no chain of neighbours connects to a held particle;
    /// `matrix` is what [`Matrix::of_followers`] made of this operator.
    pub(crate) fn adrift(&self, matrix: &Matrix) -> Option<usize> {
        let mut reached = self.beside_held(matrix);
        self.settle(matrix, (0..matrix.count(), &mut reached));
        (0..reached.len()).find(|&i| self.follows[i] && !reached[i])
    }

    /// The same of those that this rank speaks for, each rank having a part of the operator.
    pub(crate) fn adrift_of_part(&self, matrix: &Matrix, part: &SystemPart) -> Option<usize> {
        let mut reached = self.beside_held(matrix);
        let (owned, here) = (part.of_each(part.owned.clone()), part.of_each(0..matrix.count()));
        loop {
            self.settle(matrix, (part.owned.clone(), &mut reached));
            let has_changed = receive_flags(part, (&owned, &here), &mut reached);
            if !part.team.any(has_changed) {
                return part.owned.clone().find(|&i| self.follows[i] && !reached[i]);
            }
        }
    }

    /// Followers whose rows owe something to held particles: these rows were made after all others.
    fn beside_held(&self, matrix: &Matrix) -> Vec<bool> {
        let is_beside = |&class: &u32| class != HELD && class as usize >= self.rows.len();
        matrix.class.iter().map(is_beside).collect()
    }

    /// Reaches from those that are reached all those of a range, whole columns, that a chain within it connects to them.
    fn settle(&self, matrix: &Matrix, (of, reached): (Range<usize>, &mut [bool])) {
        // A part that no other has reached yet waits for them.
        if !reached.contains(&true) {
            return;
        }
        for _ in 0..SWEEPS {
            if !sweep(matrix, &of, reached) {
                return;
            }
        }
        self.spread(matrix, &of, reached);
    }

    /// Follows every connection from those already reached.
    fn spread(&self, matrix: &Matrix, of: &Range<usize>, reached: &mut [bool]) {
        let connections = || {
            runs_in(matrix, of).iter().flat_map(|run| {
                let of = |k: u32| {
                    let i = (run.start + k) as usize;
                    let others = matrix.distances(run)[1..].iter();
                    others.map(move |&distance| (i.wrapping_add_signed(distance as isize) as u32, i as u32))
                };
                (0..run.len).flat_map(of)
            })
        };
        // For each particle those that feel it.
        let feels = Lists::sorted(reached.len(), connections);
        let mut fresh: Vec<u32> = (0..reached.len() as u32).filter(|&i| reached[i as usize]).collect();
        while let Some(felt) = fresh.pop() {
            for &i in feels.of(felt as usize) {
                if !std::mem::replace(&mut reached[i as usize], true) {
                    fresh.push(i);
                }
            }
        }
    }
}

/// The runs of whole columns of particles.
fn runs_in<'a>(matrix: &'a Matrix, of: &Range<usize>) -> &'a [Run] {
    let begin = |particle: usize| matrix.runs().partition_point(|run| (run.start as usize) < particle);
    &matrix.runs()[begin(of.start)..begin(of.end)]
}

/// Marks each particle of whole columns that sees a reached one as reached, once up and once down the numbering; whether any is
/// left that was not.
fn sweep(matrix: &Matrix, of: &Range<usize>, reached: &mut [bool]) -> bool {
    let (runs, mut is_any_left) = (runs_in(matrix, of), false);
    for up in [true, false] {
        is_any_left = false;
        for run in 0..runs.len() {
            let run = &runs[if up { run } else { runs.len() - 1 - run }];
            let (start, len) = (run.start as usize, run.len as usize);
            if reached[start..start + len].iter().all(|&reached| reached) {
                continue;
            }
            let distances = &matrix.distances(run)[1..];
            for k in 0..len {
                let i = start + if up { k } else { len - 1 - k };
                reached[i] |= distances.iter().any(|&d| reached[i.wrapping_add_signed(d as isize)]);
                is_any_left |= !reached[i];
            }
        }
    }
    is_any_left
}
