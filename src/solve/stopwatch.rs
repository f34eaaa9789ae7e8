//! How long the parts of a solve take: nothing is decided by it.
//!
//! In a browser (`wasm32-unknown-unknown`) the standard library has no clock, and asking it for the time panics: every
//! time is zero there.

use std::time::Duration;
#[cfg(not(all(target_family = "wasm", target_os = "unknown")))]
use std::time::Instant;

/// Counts from when it was started.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stopwatch {
    #[cfg(not(all(target_family = "wasm", target_os = "unknown")))]
    begun: Instant,
}

#[cfg(not(all(target_family = "wasm", target_os = "unknown")))]
impl Stopwatch {
    pub(crate) fn start() -> Self {
        Self { begun: Instant::now() }
    }

    pub(crate) fn elapsed(&self) -> Duration {
        self.begun.elapsed()
    }
}

#[cfg(all(target_family = "wasm", target_os = "unknown"))]
impl Stopwatch {
    pub(crate) fn start() -> Self {
        Self {}
    }

    pub(crate) fn elapsed(&self) -> Duration {
        Duration::ZERO
    }
}

/// The middle of several times, or the mean of the two; sorts them. NaN of none.
#[cfg(any(feature = "bench", feature = "fem"))]
pub(crate) fn median(times: &mut [f64]) -> f64 {
    times.sort_unstable_by(f64::total_cmp);
    match (times.len() / 2, times.len() % 2) {
        (0, 0) => f64::NAN,
        (middle, 0) => f64::midpoint(times[middle - 1], times[middle]),
        (middle, _) => times[middle],
    }
}

#[cfg(all(test, any(feature = "bench", feature = "fem")))]
mod tests {
    use super::*;

    #[test]
    fn a_slow_pass_does_not_move_the_median() {
        assert_eq!(median(&mut [2.0, 1e9, 1.0]), 2.0);
        assert_eq!(median(&mut [3.0, 1e9, 1.0, 2.0]), 2.5);
        assert!(median(&mut []).is_nan());
    }
}
