//! What the machine can do: the triad `a = b + s c` on arrays that no cache holds.
//!
//! Two numbers describe the same time. *Counted* are the 24 bytes an element that the program names:
//! `b` and `c` read, `a` written. *Moved* are the 32 bytes that go over the memory bus, since an
//! ordinary store first reads the cache line it is about to overwrite (write-allocate). Rooflines
//! divide what they move by what was moved: the second number.

use std::hint::black_box;
use std::time::Instant;

use rayon::prelude::*;
use serde::Serialize;

/// Bytes an element that the program names.
const COUNTED_BYTES: f64 = 24.0;
/// Bytes an element that the memory bus carries: write-allocate included.
const MOVED_BYTES: f64 = 32.0;

/// Memory bandwidth of the triad on some number of threads.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bandwidth {
    pub threads: usize,
    /// The bytes the program names \[B/s\].
    pub counted_bytes_per_second: f64,
    /// The same and the write-allocate traffic \[B/s\]: what the roofline is drawn from.
    pub moved_bytes_per_second: f64,
}

/// The arrays of the triad.
pub(super) struct Triad {
    a: Vec<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
}

impl Triad {
    pub(super) fn new(elements: usize) -> Self {
        // Ones rather than zeros, so that every page is written to and thus really there.
        Self { a: vec![1.0; elements], b: vec![1.0; elements], c: vec![2.0; elements] }
    }

    /// Seconds that one pass takes on all threads of the present pool.
    pub(super) fn time(&mut self) -> f64 {
        let begin = Instant::now();
        self.pass();
        begin.elapsed().as_secs_f64()
    }

    /// The bandwidth of the median of passes that took so many seconds each.
    pub(super) fn bandwidth(&self, threads: usize, seconds: &mut [f64]) -> Bandwidth {
        let elements_per_second = self.a.len() as f64 / median(seconds);
        Bandwidth {
            threads,
            counted_bytes_per_second: COUNTED_BYTES * elements_per_second,
            moved_bytes_per_second: MOVED_BYTES * elements_per_second,
        }
    }

    fn pass(&mut self) {
        let scale = black_box(3.0);
        // One piece a thread: each streams through memory of its own.
        let piece = self.a.len().div_ceil(rayon::current_num_threads());
        let (b, c) = (self.b.par_chunks(piece), self.c.par_chunks(piece));
        self.a.par_chunks_mut(piece).zip(b).zip(c).for_each(|((a, b), c)| {
            for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
                *a = b + scale * c;
            }
        });
        black_box(&mut self.a);
    }
}

/// The middle value, or the mean of the two; sorts the values. NaN of none.
pub(super) fn median(values: &mut [f64]) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    match (values.len() / 2, values.len() % 2) {
        (0, 0) => f64::NAN,
        (middle, 0) => f64::midpoint(values[middle - 1], values[middle]),
        (middle, _) => values[middle],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_pass_does_not_move_the_median() {
        assert_eq!(median(&mut [2.0, 1e9, 1.0]), 2.0);
        assert_eq!(median(&mut [3.0, 1e9, 1.0, 2.0]), 2.5);
        assert!(median(&mut []).is_nan());
    }

    #[test]
    fn the_triad_writes_all_of_its_elements_and_counts_its_bytes() {
        let mut triad = Triad::new(1001);
        assert!(triad.time() > 0.0);
        assert!(triad.a.iter().all(|&a| a == 7.0));
        let bandwidth = triad.bandwidth(1, &mut [1.0, 4.0, 2.0]);
        assert_eq!(bandwidth.counted_bytes_per_second, 1001.0 * 24.0 / 2.0);
        assert_eq!(bandwidth.moved_bytes_per_second, 1001.0 * 32.0 / 2.0);
    }
}
