//! Vectors: the one place where the width of a loop is chosen, by what the processor has.
//!
//! Lanes are never added to each other, so the width changes no bit.

use super::real::Real;

/// A loop that is compiled for several widths.
pub trait InLanes: Sized {
    /// Bytes of a number: four or eight.
    const BYTES: usize;

    /// Whether it waits for multiplications, or else for loads and stores. The first take two vectors at a time: measured, up to
    /// twice as fast. The others take one, the widest: on a Xeon AVX-512 is 1.05 to 1.35 times as fast as AVX2 in bodies within
    /// the caches, on an EPYC as fast, and AVX2 1.4 times as fast as the oldest vectors.
    const MULTIPLIES: bool;

    /// Runs it with `W` numbers at a time. Implementations are `#[inline(always)]`, or they are compiled for the oldest
    /// processor.
    fn run<const W: usize>(self);
}

/// The vectors that [`in_lanes`] takes on this processor, in words.
pub fn vectors() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx512f") {
        return "AVX-512";
    } else if is_x86_feature_detected!("avx2") {
        return "AVX2";
    }
    "of 16 bytes"
}

/// Runs a loop. Of the branches on its constants those alone are compiled that it takes.
pub fn in_lanes<L: InLanes>(work: L) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx512f") {
        // SAFETY: the processor has AVX-512, which is all that the callee asks for.
        return unsafe { avx512(work) };
    } else if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2, which is all that the callee asks for.
        return unsafe { avx2(work) };
    }
    // 16 bytes: the vectors of the oldest x86-64 and of every aarch64.
    if L::MULTIPLIES { in_bytes::<L, 32>(work) } else { in_bytes::<L, 16>(work) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn avx512<L: InLanes>(work: L) {
    if L::MULTIPLIES { in_bytes::<L, 128>(work) } else { in_bytes::<L, 64>(work) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn avx2<L: InLanes>(work: L) {
    if L::MULTIPLIES { in_bytes::<L, 64>(work) } else { in_bytes::<L, 32>(work) }
}

/// Runs a loop with as many numbers at a time as fill so many bytes.
#[inline(always)]
fn in_bytes<L: InLanes, const BYTES: usize>(work: L) {
    // Not by their quotient: only branches on a constant itself are left out before they are compiled.
    match L::BYTES {
        4 => match BYTES {
            16 => work.run::<4>(),
            32 => work.run::<8>(),
            64 => work.run::<16>(),
            _ => work.run::<32>(),
        },
        _ => match BYTES {
            16 => work.run::<2>(),
            32 => work.run::<4>(),
            64 => work.run::<8>(),
            _ => work.run::<16>(),
        },
    }
}

/// The `W` numbers from `at` on.
#[inline(always)]
pub fn lanes<T: Copy, const W: usize>(slice: &[T], at: usize) -> [T; W] {
    slice[at..at + W].try_into().expect("as many as asked for")
}

/// Adds a matrix, by rows, times vectors to their sums: the step that a product with rows of matrices is made of, in sweeps as in solvers.
#[inline(always)]
pub fn add_product<T: Real, const W: usize>(
    [xx, xy, yx, yy]: [T; 4],
    [x, y]: &[[T; W]; 2],
    sum: &mut [[T; W]; 2],
) {
    for k in 0..W {
        sum[0][k] += xx * x[k] + xy * y[k];
        sum[1][k] += yx * x[k] + yy * y[k];
    }
}
