//! The machine's memory bandwidth, by the triad `a = b + s c`.
//!
//! It is taken on the arrays of the largest body rather than on some of its own, because where memory
//! lies matters: on a virtual machine the same loop over two sets of arrays was seen to differ by
//! 30 %, for as long as they lived.
//!
//! Two numbers describe the same time. *Counted* are the 24 bytes an element that the program names:
//! `b` and `c` read, `a` written. *Moved* are the 32 bytes that go over the memory bus, since an
//! ordinary store first reads the cache line it is about to overwrite (write-allocate). Rooflines
//! divide what they move by what was moved: the second number.

use std::hint::black_box;
use std::time::Instant;

use crate::solve::stopwatch::median;

use rayon::prelude::*;
use serde::Serialize;

/// Bytes an element that the program names.
const COUNTED_BYTES: f64 = 24.0;
/// Bytes an element that the memory bus carries: write-allocate included.
const MOVED_BYTES: f64 = 32.0;

/// The processor's name, where the system says.
pub(super) fn processor() -> Option<String> {
    let all = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = all.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

/// Memory bandwidth of the triad on some number of threads.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bandwidth {
    /// Threads that share the arrays.
    pub threads: usize,
    /// The bytes the program names \[B/s\].
    pub counted_bytes_per_second: f64,
    /// The same and the write-allocate traffic \[B/s\]: what the roofline is drawn from.
    pub moved_bytes_per_second: f64,
}

impl Bandwidth {
    /// From the median of passes over arrays of so many elements that took so many seconds each.
    pub(super) fn of_passes(elements: usize, threads: usize, seconds: &mut [f64]) -> Self {
        let elements_per_second = elements as f64 / median(seconds);
        Self {
            threads,
            counted_bytes_per_second: COUNTED_BYTES * elements_per_second,
            moved_bytes_per_second: MOVED_BYTES * elements_per_second,
        }
    }
}

/// Seconds that one pass over the arrays takes on all threads of the present pool.
pub(super) fn time_triad(a: &mut [f64], b: &[f64], c: &[f64]) -> f64 {
    let scale = black_box(3.0);
    // One piece a thread: each streams through memory of its own.
    let piece = a.len().div_ceil(rayon::current_num_threads());
    let begin = Instant::now();
    let pieces = a.par_chunks_mut(piece).zip(b.par_chunks(piece)).zip(c.par_chunks(piece));
    pieces.for_each(|((a, b), c)| {
        for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
            *a = b + scale * c;
        }
    });
    black_box(a);
    begin.elapsed().as_secs_f64()
}

/// Seconds that each of so many takes that `work` does.
pub(super) fn seconds_each(count: usize, work: impl FnOnce()) -> f64 {
    let begin = Instant::now();
    work();
    begin.elapsed().as_secs_f64() / count as f64
}

/// The smallest of the sorted values that so large a share of them does not exceed.
#[cfg(any(feature = "ros", feature = "shm"))]
pub(super) fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.saturating_sub(1)).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_triad_writes_all_of_its_elements_and_counts_its_bytes() {
        let mut a = vec![0.0; 1001];
        assert!(time_triad(&mut a, &[1.0; 1001], &[2.0; 1001]) > 0.0);
        assert!(a.iter().all(|&a| a == 7.0));
        let bandwidth = Bandwidth::of_passes(1001, 1, &mut [1.0, 4.0, 2.0]);
        assert_eq!(bandwidth.counted_bytes_per_second, 1001.0 * 24.0 / 2.0);
        assert_eq!(bandwidth.moved_bytes_per_second, 1001.0 * 32.0 / 2.0);
    }
}
