//! Ranks: processes that share one body, each of which moves its own particles.
//!
//! A [`Team`] is what a rank knows of the others: how many they are, which one it is, and how numbers get from one
//! to another. They travel over MPI (`mpi`, with the feature of that name) or between threads of one process
//! ([`in_process`]), which the tests run on and which needs no MPI. What a rank owns is decided where bodies are
//! swept; what is exchanged, and when, by the engine. [`launcher`] finds out whether a program was started as one of
//! several.
//!
//! Everything travels as bits, and what several ranks have computed is put together in the order of the ranks: results
//! do not depend on which rank was faster.

pub mod launcher;
#[cfg(feature = "mpi")]
pub mod mpi;
mod threads;

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::Serialize;
use serde::de::DeserializeOwned;

pub use threads::in_process;

/// How numbers get from rank to rank. All ranks call the same methods in the same order.
///
/// A rank that is lost ends the others: neither method returns without what it waits for.
pub trait Exchange: Send {
    /// The number of this rank, from 0.
    fn rank(&self) -> usize;

    /// How many ranks there are.
    fn count(&self) -> usize;

    /// Sends each message to its rank and receives as many words as are asked for from each of `from`, in their order:
    /// (rank, words). A rank is named at most once in each, and never this one. Does `meanwhile`, once, while they travel.
    fn swap(
        &mut self,
        messages: &[(usize, Vec<u64>)],
        from: &[(usize, usize)],
        meanwhile: &mut dyn FnMut(),
    ) -> Vec<Vec<u64>>;

    /// The words of all ranks, one after the other; `counts` says how many each has, shape \[ranks\].
    fn gather(&mut self, own: &[u64], counts: &[usize]) -> Vec<u64>;
}

/// A rank's connection to the others; copies are the same rank's.
#[derive(Clone)]
pub struct Team {
    rank: usize,
    count: usize,
    exchange: Arc<Mutex<dyn Exchange>>,
}

impl fmt::Debug for Team {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "rank {} of {}", self.rank, self.count)
    }
}

impl Team {
    /// The team that an exchange connects this rank with.
    pub fn new(exchange: impl Exchange + 'static) -> Self {
        let (rank, count) = (exchange.rank(), exchange.count());
        Self { rank, count, exchange: Arc::new(Mutex::new(exchange)) }
    }

    /// The number of this rank, from 0.
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// How many ranks there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Whether this is the rank that prints and writes.
    pub fn is_first(&self) -> bool {
        self.rank == 0
    }

    /// See [`Exchange::swap`]; there is nothing else to do.
    pub fn swap(&self, messages: &[(usize, Vec<u64>)], from: &[(usize, usize)]) -> Vec<Vec<u64>> {
        self.swap_while(messages, from, &mut || ())
    }

    /// See [`Exchange::swap`].
    pub fn swap_while(
        &self,
        messages: &[(usize, Vec<u64>)],
        from: &[(usize, usize)],
        meanwhile: &mut dyn FnMut(),
    ) -> Vec<Vec<u64>> {
        self.exchange().swap(messages, from, meanwhile)
    }

    /// See [`Exchange::gather`].
    pub fn gather(&self, own: &[u64], counts: &[usize]) -> Vec<u64> {
        self.exchange().gather(own, counts)
    }

    /// What all ranks have, one after the other, each as many as it has; an exchange less where there is none.
    pub(crate) fn gather_all<T: Serialize + DeserializeOwned>(&self, own: &[T]) -> Vec<T> {
        let own = if own.is_empty() { Ok(Vec::new()) } else { postcard::to_stdvec(own) };
        let of = |bytes: Vec<u8>| -> Vec<T> { postcard::from_bytes(&bytes).expect("as it was sent") };
        let all = self.each_bytes(&own.expect("values without maps and of known length can be written"));
        all.into_iter().filter(|bytes| !bytes.is_empty()).flat_map(of).collect()
    }

    /// As many words of each rank, shape \[ranks\]\[N\].
    pub fn each<const N: usize>(&self, own: [u64; N]) -> Vec<[u64; N]> {
        let all = self.gather(&own, &vec![N; self.count]);
        let of = |words: &[u64]| std::array::from_fn(|k| words[k]);
        all.chunks_exact(N).map(of).collect()
    }

    /// The first rank's words, on all ranks.
    pub fn of_first<const N: usize>(&self, own: [u64; N]) -> [u64; N] {
        self.each(own).first().copied().unwrap_or(own)
    }

    /// Whether it is so on any rank.
    pub fn any(&self, own: bool) -> bool {
        self.each([u64::from(own)]).contains(&[1])
    }

    /// The largest of each of the numbers, none of which is NaN.
    pub fn largest<const N: usize>(&self, own: [f64; N]) -> [f64; N] {
        let all = self.each(own.map(f64::to_bits));
        let largest = |k: usize| all.iter().map(|of| f64::from_bits(of[k])).fold(own[k], f64::max);
        std::array::from_fn(largest)
    }

    /// The sum of each of the numbers.
    pub fn sum<const N: usize>(&self, own: [u64; N]) -> [u64; N] {
        let all = self.each(own);
        std::array::from_fn(|k| all.iter().map(|of| of[k]).sum())
    }

    /// What becomes of the words on their way through all ranks, in the order of the ranks: each makes of them what `work` says
    /// and hands them on. All ranks have the result.
    pub fn chain<const N: usize>(
        &self,
        start: [u64; N],
        work: impl FnOnce([u64; N]) -> [u64; N],
    ) -> [u64; N] {
        let mut words = start;
        if let Some(before) = self.rank.checked_sub(1) {
            let received = self.swap(&[], &[(before, N)]);
            words = std::array::from_fn(|k| received[0][k]);
        }
        words = work(words);
        if self.rank + 1 < self.count {
            self.swap(&[(self.rank + 1, words.to_vec())], &[]);
        }
        self.each(words).last().copied().unwrap_or(words)
    }

    /// What `start` and the numbers of all ranks, of which these are this one's `own`, add up to, in the order of the ranks; those
    /// that have a place after all others, as some may where `has_later`, in the order of these.
    pub(crate) fn sum_in_order<const N: usize>(
        &self,
        start: [f64; N],
        own: impl Iterator<Item = (Option<usize>, [f64; N])>,
        has_later: bool,
    ) -> [f64; N] {
        let mut later: Vec<(usize, Vec<f64>)> = Vec::new();
        let before = own.filter_map(|(place, own)| match place {
            None => Some(own),
            Some(place) => {
                later.push((place, own.to_vec()));
                None
            }
        });
        let chained = self.chain(start.map(f64::to_bits), |sums| {
            before.fold(sums.map(f64::from_bits), added).map(f64::to_bits)
        });
        let mut later = if has_later { self.gather_all(&later) } else { Vec::new() };
        later.sort_unstable_by_key(|(place, _)| *place);
        let numbers = later.into_iter().map(|(_, of)| std::array::from_fn(|k| of[k]));
        numbers.fold(chained.map(f64::from_bits), added)
    }

    /// The bytes of each rank, shape \[ranks\].
    pub(crate) fn each_bytes(&self, own: &[u8]) -> Vec<Vec<u8>> {
        let lengths: Vec<usize> =
            self.each([own.len() as u64]).into_iter().map(|[length]| length as usize).collect();
        if lengths.iter().all(|&length| length == 0) {
            return vec![Vec::new(); lengths.len()];
        }
        let counts: Vec<usize> = lengths.iter().map(|length| length.div_ceil(8)).collect();
        let all = self.gather(&packed(own), &counts);
        let mut rest = &all[..];
        let bytes = |length: &usize| {
            let (words, after) = rest.split_at(length.div_ceil(8));
            rest = after;
            unpacked(words, *length)
        };
        lengths.iter().map(bytes).collect()
    }

    /// Has the first rank `take` the pieces of all ranks, in their order: its own ones and, as they come, those of the others. Empty
    /// ones are left out.
    pub(crate) fn bring(&self, own: impl IntoIterator<Item = Vec<u8>>, mut take: impl FnMut(&[u8])) {
        let own = own.into_iter().filter(|piece| !piece.is_empty());
        if !self.is_first() {
            own.chain([Vec::new()]).for_each(|piece| self.send_bytes(&piece));
            return;
        }
        own.for_each(|piece| take(&piece));
        for rank in 1..self.count {
            let received = || Some(self.receive_bytes(rank)).filter(|piece| !piece.is_empty());
            std::iter::from_fn(received).for_each(|piece| take(&piece));
        }
    }

    fn send_bytes(&self, bytes: &[u8]) {
        self.swap(&[(0, vec![bytes.len() as u64])], &[]);
        self.swap(&[(0, packed(bytes))], &[]);
    }

    fn receive_bytes(&self, from: usize) -> Vec<u8> {
        let length = self.swap(&[], &[(from, 1)])[0][0] as usize;
        unpacked(&self.swap(&[], &[(from, length.div_ceil(8))])[0], length)
    }

    fn exchange(&self) -> MutexGuard<'_, dyn Exchange + 'static> {
        self.exchange.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The sum of each of the numbers.
pub(crate) fn added<const N: usize>(sums: [f64; N], more: [f64; N]) -> [f64; N] {
    std::array::from_fn(|k| sums[k] + more[k])
}

/// What all ranks have, as [`Team::gather_all`]; what there is here without a team.
pub(crate) fn gathered<T: Serialize + DeserializeOwned>(team: Option<&Team>, own: Vec<T>) -> Vec<T> {
    match team {
        Some(team) => team.gather_all(&own),
        None => own,
    }
}

fn packed(bytes: &[u8]) -> Vec<u64> {
    let word = |bytes: &[u8]| {
        let mut word = [0; 8];
        word[..bytes.len()].copy_from_slice(bytes);
        u64::from_le_bytes(word)
    };
    bytes.chunks(8).map(word).collect()
}

fn unpacked(words: &[u64], length: usize) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_le_bytes()).take(length).collect()
}
