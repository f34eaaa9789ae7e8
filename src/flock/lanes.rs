//! Vectors: the one place where the width of a loop is chosen, by what the processor has.
//!
//! Lanes are never added to each other, so the width changes no bit.

/// A loop that is compiled for several widths.
pub trait InLanes {
    /// Runs it with `W` numbers at a time. Implementations are `#[inline(always)]`, or they are compiled for the oldest
    /// processor.
    fn run<const W: usize>(self);
}

/// For [`in_lanes`]: one of AVX2's vectors at a time, for loops that wait for loads and stores. Measured: no slower than
/// AVX-512 on the processors tried, and 1.4 times as fast as the oldest vectors in bodies within the caches.
pub(crate) const MEMORY: bool = false;
/// For [`in_lanes`]: two of the widest vectors at a time, for loops that multiply. Measured: up to twice as fast.
pub(crate) const ARITHMETIC: bool = true;

/// The vectors that [`in_lanes`] takes on this processor, in words.
pub fn vectors() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx512f") {
        return "AVX2, and AVX-512 for loops that multiply";
    } else if is_x86_feature_detected!("avx2") {
        return "AVX2";
    }
    "of 16 bytes"
}

/// Runs a loop over numbers of so many bytes.
pub fn in_lanes<const BYTES: usize, const LOAD: bool>(work: impl InLanes) {
    #[cfg(target_arch = "x86_64")]
    if LOAD == ARITHMETIC && is_x86_feature_detected!("avx512f") {
        // SAFETY: the processor has AVX-512, which is all that the callee asks for.
        return unsafe { avx512::<BYTES>(work) };
    } else if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2, which is all that the callee asks for.
        return unsafe { avx2::<BYTES, LOAD>(work) };
    }
    // 16 bytes: the vectors of the oldest x86-64 and of every aarch64.
    match (BYTES, LOAD) {
        (4, MEMORY) => work.run::<4>(),
        (4, ARITHMETIC) => work.run::<8>(),
        (_, MEMORY) => work.run::<2>(),
        (_, ARITHMETIC) => work.run::<4>(),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn avx512<const BYTES: usize>(work: impl InLanes) {
    if BYTES == 4 { work.run::<32>() } else { work.run::<16>() }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn avx2<const BYTES: usize, const LOAD: bool>(work: impl InLanes) {
    match (BYTES, LOAD) {
        (4, MEMORY) => work.run::<8>(),
        (4, ARITHMETIC) => work.run::<16>(),
        (_, MEMORY) => work.run::<4>(),
        (_, ARITHMETIC) => work.run::<8>(),
    }
}

/// The `W` numbers from `at` on.
#[inline(always)]
pub fn lanes<T: Copy, const W: usize>(slice: &[T], at: usize) -> [T; W] {
    slice[at..at + W].try_into().expect("as many as asked for")
}
