//! What ranks that share a body send each other of it. Everything is known of each rank, so that nothing has to be negotiated.

use std::ops::Range;

use super::real::Real;
use super::vectors::Vectors;

/// Particles, or columns, that a rank sends and receives: (rank, particles), at most one stretch for each rank, in their order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Halo<N = usize> {
    /// Particles of this rank that others need.
    pub sends: Vec<(usize, Range<N>)>,
    /// Particles of others that this rank needs.
    pub receives: Vec<(usize, Range<N>)>,
}

/// What is sent and how many words are received: (rank, words).
pub type Messages = (Vec<(usize, Vec<u64>)>, Vec<(usize, usize)>);

impl<N: Copy + Ord> Halo<N> {
    /// The halo of one of so many ranks, by the particles that a rank owns and those that it needs, which may be its own.
    pub fn new(
        (rank, ranks): (usize, usize),
        owned: impl Fn(usize) -> Range<N>,
        needed: impl Fn(usize) -> Range<N>,
    ) -> Self {
        let others = || (0..ranks).filter(|&other| other != rank);
        let both = |owner: usize, reader: usize| meet(&owned(owner), &needed(reader));
        Self {
            sends: others().filter_map(|other| Some((other, both(rank, other)?))).collect(),
            receives: others().filter_map(|other| Some((other, both(other, rank)?))).collect(),
        }
    }
}

impl Halo {
    /// The same where the first particle here is this one of the whole.
    #[must_use]
    pub fn here(mut self, first: usize) -> Self {
        let of_ranks = self.sends.iter_mut().chain(&mut self.receives);
        of_ranks.for_each(|(_, of)| *of = of.start - first..of.end - first);
        self
    }

    /// The messages that carry some fields, one after the other.
    pub fn messages<T: Real>(&self, fields: &[&Vectors<T>]) -> Messages {
        let sent = |(rank, of): &(usize, Range<usize>)| {
            (*rank, fields.iter().flat_map(|field| words(field, of)).collect())
        };
        let size =
            |(rank, of): &(usize, Range<usize>)| (*rank, words_per_particle::<T>() * fields.len() * of.len());
        (self.sends.iter().map(sent).collect(), self.receives.iter().map(size).collect())
    }

    /// Writes down what came of these fields, in the order of the ranks.
    pub fn put<T: Real>(&self, received: &[Vec<u64>], fields: &mut [&mut Vectors<T>]) {
        for ((_, of), words) in self.receives.iter().zip(received) {
            let of_one = words_per_particle::<T>() * of.len();
            for (field, words) in fields.iter_mut().zip(words.chunks_exact(of_one)) {
                put(field, of, words);
            }
        }
    }
}

/// The intersection of both stretches, if any.
pub fn meet<N: Copy + Ord>(a: &Range<N>, b: &Range<N>) -> Option<Range<N>> {
    let both = a.start.max(b.start)..a.end.min(b.end);
    (!both.is_empty()).then_some(both)
}

/// Both components of single precision go into one word.
pub const fn words_per_particle<T>() -> usize {
    if size_of::<T>() == size_of::<f32>() { 1 } else { 2 }
}

/// Some particles of a field as words.
pub fn words<T: Real>(field: &Vectors<T>, of: &Range<usize>) -> Vec<u64> {
    let (x, y) = (&field.x[of.clone()], &field.y[of.clone()]);
    if words_per_particle::<T>() == 1 {
        x.iter().zip(y).map(|(x, y)| x.bits() | y.bits() << 32).collect()
    } else {
        x.iter().chain(y).map(|value| value.bits()).collect()
    }
}

/// The field's particles from such words.
pub fn put<T: Real>(field: &mut Vectors<T>, of: &Range<usize>, words: &[u64]) {
    let (x, y) = (&mut field.x[of.clone()], &mut field.y[of.clone()]);
    if words_per_particle::<T>() == 1 {
        for ((x, y), word) in x.iter_mut().zip(y).zip(words) {
            (*x, *y) = (T::of_bits(word & u64::from(u32::MAX)), T::of_bits(word >> 32));
        }
    } else {
        let (of_x, of_y) = words.split_at(of.len());
        x.iter_mut().zip(of_x).for_each(|(x, &bits)| *x = T::of_bits(bits));
        y.iter_mut().zip(of_y).for_each(|(y, &bits)| *y = T::of_bits(bits));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_meet_in_what_both_have() {
        assert_eq!(meet(&(2..7), &(5..9)), Some(5..7));
        assert_eq!(meet(&(2..5), &(5..9)), None);
        assert_eq!(meet(&(0..0), &(0..9)), None);
    }
}
