//! Draws from a seed, the same on every machine.

use crate::flock::splitmix;

/// One draw from each of `count` equal parts, in a drawn order \[1\].
pub(super) fn latin_column(count: usize, draws: &mut Draws) -> Vec<f64> {
    let mut order: Vec<usize> = (0..count).collect();
    // Fisher and Yates.
    for last in (1..count).rev() {
        order.swap(last, draws.below(last + 1));
    }
    order.into_iter().map(|part| (part as f64 + draws.part()) / count as f64).collect()
}

/// Uniform draws by splitmix64.
pub(super) struct Draws(u64);

impl Draws {
    pub(super) fn new(seed: u64, stream: u64) -> Self {
        // Mixed one after the other: by a symmetric mixture, stream 1 of seed 0 would be stream 0 of seed 1.
        let of_seed = Self(seed).next();
        Self(Self(of_seed ^ stream).next())
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(splitmix::STEP);
        splitmix::mixed(self.0)
    }

    /// From 0 up to, and without, 1.
    pub(super) fn part(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// From 0 up to, and without, `count`.
    fn below(&mut self, count: usize) -> usize {
        ((u128::from(self.next()) * count as u128) >> 64) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_and_streams_are_not_interchangeable() {
        let pairs = (0..4).flat_map(|seed| (0..4).map(move |stream| (seed, stream)));
        let mut first: Vec<u64> = pairs.map(|(seed, stream)| Draws::new(seed, stream).next()).collect();
        first.sort_unstable();
        first.dedup();
        assert_eq!(first.len(), 16);
    }
}
