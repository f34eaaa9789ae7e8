//! The loops that a sweep spends its time in: sums over runs, a few runs abreast.
//!
//! A body larger than the caches is swept at the speed of its memory, and what stands in the way of
//! that is not arithmetic but the way back from the second cache: a column is read three times, as
//! itself and as the neighbour of the columns on both sides. Columns are therefore swept abreast, a
//! tile of each after the other, so that the second and third reading come from the first cache and
//! the memory has several streams to fetch at once. Bodies within the caches are bound by arithmetic,
//! where wider vectors pay: the loops are compiled for each width. Lanes are never added to each other,
//! so the width changes no bit.

use super::Run;
use crate::flock::real::Real;

/// Runs swept abreast. Measured on 4096 squared: one alone is swept at seven tenths of the speed of
/// three, and eight, whose streams get into each other's way, at three quarters.
const ABREAST: usize = 3;

/// Most particles in the gaps of a run: they are set aside on the stack.
pub const MOST_KEPT: usize = 64;

/// One coordinate of a body, or of a stretch of one, before and after the step.
#[derive(Debug)]
pub struct Plane<'a, T> {
    /// Coordinates before the step, those of particle number `seen_from` first.
    pub seen_from: usize,
    pub present: &'a [T],
    /// Rest offsets of the whole body.
    pub rest: Option<&'a [T]>,
    /// Coordinates after the step, those of particle number `begin` first.
    pub begin: usize,
    pub next: &'a mut [T],
}

/// Index distances, and particles in gaps.
type Tables<'a> = (&'a [isize], &'a [u32]);

/// Computes one coordinate of runs that all have the same number of neighbours, `tile` particles of each at a
/// time (a power of two).
pub fn sweep<T: Real>(runs: &[Run], tables: Tables<'_>, tile: usize, plane: &mut Plane<'_, T>) {
    let sweep = match runs.first().map_or(0, |run| run.neighbours) {
        3 => sweep_alike::<T, 3>,
        4 => sweep_alike::<T, 4>,
        5 => sweep_alike::<T, 5>,
        6 => sweep_alike::<T, 6>,
        8 => sweep_alike::<T, 8>,
        12 => sweep_alike::<T, 12>,
        18 => sweep_alike::<T, 18>,
        24 => sweep_alike::<T, 24>,
        _ => sweep_alike::<T, ANY>,
    };
    sweep(runs, tables, tile, plane);
}

/// Stands for a number of neighbours that no lattice has by itself, not worth loops of its own.
const ANY: usize = 0;

fn sweep_alike<T: Real, const N: usize>(
    runs: &[Run],
    tables: Tables<'_>,
    tile: usize,
    plane: &mut Plane<'_, T>,
) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2, which is all that the callee asks for. Measured: bodies
        // within the caches are swept 1.4 times as fast.
        return unsafe { sweep_avx2::<T, N>(runs, tables, tile, plane) };
    }
    // 16 bytes: the vectors of the oldest x86-64 and of every aarch64.
    match size_of::<T>() {
        4 => sweep_in_lanes::<T, N, 4>(runs, tables, tile, plane),
        _ => sweep_in_lanes::<T, N, 2>(runs, tables, tile, plane),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn sweep_avx2<T: Real, const N: usize>(
    runs: &[Run],
    tables: Tables<'_>,
    tile: usize,
    plane: &mut Plane<'_, T>,
) {
    match size_of::<T>() {
        4 => sweep_in_lanes::<T, N, 8>(runs, tables, tile, plane),
        _ => sweep_in_lanes::<T, N, 4>(runs, tables, tile, plane),
    }
}

/// `W` particles at a time; `N` is the number of neighbours, or [`ANY`].
#[inline(always)]
fn sweep_in_lanes<T: Real, const N: usize, const W: usize>(
    runs: &[Run],
    (distances, kept): Tables<'_>,
    tile: usize,
    plane: &mut Plane<'_, T>,
) {
    for abreast in runs.chunks(ABREAST) {
        // Runs with gaps are those of small bodies, which a tile gains nothing.
        if abreast.iter().any(|run| run.gaps > 0) {
            abreast.iter().for_each(|run| sweep_over_gaps::<T, N, W>(run, distances, kept, plane));
            continue;
        }
        let (mut corner, mut more) = (0, true);
        while more {
            more = false;
            for run in abreast {
                let (start, end) = (run.start as usize, (run.start + run.len) as usize);
                // Tiles end at multiples of their size in the array, not in the run: whole
                // cache lines.
                let begin = (start & !(tile - 1)) + corner;
                let (from, to) = (start.max(begin), end.min(begin + tile));
                more |= to < end;
                if from < to {
                    sweep_part::<T, N, W>(run, distances, plane, from, to);
                }
            }
            corner += tile;
        }
    }
}

/// A whole run; what its gaps hold is set aside meanwhile.
#[inline(always)]
fn sweep_over_gaps<T: Real, const N: usize, const W: usize>(
    run: &Run,
    distances: &[isize],
    kept: &[u32],
    plane: &mut Plane<'_, T>,
) {
    let kept = &kept[run.kept as usize..][..run.gaps as usize];
    let mut aside = [T::default(); MOST_KEPT];
    for (aside, &j) in aside.iter_mut().zip(kept) {
        *aside = plane.next[j as usize - plane.begin];
    }
    sweep_part::<T, N, W>(run, distances, plane, run.start as usize, (run.start + run.len) as usize);
    for (&aside, &j) in aside.iter().zip(kept) {
        plane.next[j as usize - plane.begin] = aside;
    }
}

/// The means of the neighbours of the particles `from..to` of a run, each with its rest offset.
#[inline(always)]
fn sweep_part<T: Real, const N: usize, const W: usize>(
    run: &Run,
    distances: &[isize],
    plane: &mut Plane<'_, T>,
    from: usize,
    to: usize,
) {
    let distances = &distances[run.stencil as usize..][..run.neighbours as usize];
    let (len, at) = (to - from, from - plane.seen_from);
    let rest = plane.rest.filter(|_| run.rests).map(|rest| &rest[from..to]);
    let target = &mut plane.next[from - plane.begin..to - plane.begin];
    let seen = |distance: isize| &plane.present[at.wrapping_add_signed(distance)..][..len];
    if N == ANY {
        return means_of_any(distances.iter().map(|&distance| seen(distance)), rest, target);
    }
    let distances: &[isize; N] = distances.try_into().expect("a run has as many distances as neighbours");
    let seen: [&[T]; N] = std::array::from_fn(|k| seen(distances[k]));
    match rest {
        None => fill::<T, N, W>(&seen, None, target),
        Some(rest) => fill::<T, N, W>(&seen, Some(&rest[..len]), target),
    }
}

/// All slices are as long as the target.
#[inline(always)]
fn fill<T: Real, const N: usize, const W: usize>(seen: &[&[T]; N], rest: Option<&[T]>, target: &mut [T]) {
    let len = target.len();
    if len < W {
        for at in 0..len {
            fill_lanes::<T, N, 1>(seen, rest, at, target);
        }
        return;
    }
    // From the second on they are stored at whole vectors: a store across two cache lines takes as long as two, and
    // these are what bodies within the caches wait for. Where two overlap, the same comes out again.
    let mut at = 0;
    let mut aligned = W - (target.as_ptr() as usize / size_of::<T>()) % W;
    loop {
        fill_lanes::<T, N, W>(seen, rest, at, target);
        if at + W == len {
            return;
        }
        at = aligned.min(len - W);
        aligned += W;
    }
}

#[inline(always)]
fn fill_lanes<T: Real, const N: usize, const W: usize>(
    seen: &[&[T]; N],
    rest: Option<&[T]>,
    at: usize,
    target: &mut [T],
) {
    let mut sum: [T; W] = lanes(seen[0], at);
    for slice in &seen[1..] {
        let next: [T; W] = lanes(slice, at);
        for k in 0..W {
            sum[k] += next[k];
        }
    }
    // Zero is added as well: the rule does, and it makes 0.0 of -0.0.
    let rest: [T; W] = rest.map_or([T::default(); W], |rest| lanes(rest, at));
    let (target, count) = (&mut target[at..at + W], T::of(N as f64));
    for k in 0..W {
        target[k] = sum[k] / count + rest[k];
    }
}

#[inline(always)]
fn lanes<T: Copy, const W: usize>(slice: &[T], at: usize) -> [T; W] {
    slice[at..at + W].try_into().expect("as many as asked for")
}

/// Any number of neighbours: one after the other into the target, which a tile keeps in cache.
fn means_of_any<'a, T: Real>(
    seen: impl ExactSizeIterator<Item = &'a [T]>,
    rest: Option<&[T]>,
    target: &mut [T],
) {
    let count = T::of(seen.len() as f64);
    target.fill(T::of(-0.0));
    for seen in seen {
        target.iter_mut().zip(seen).for_each(|(target, &seen)| *target += seen);
    }
    match rest {
        None => target.iter_mut().for_each(|target| *target = *target / count + T::default()),
        Some(rest) => {
            target.iter_mut().zip(rest).for_each(|(target, &rest)| *target = *target / count + rest);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Loops = fn(&[Run], Tables<'_>, usize, &mut Plane<'_, f64>);

    #[test]
    fn the_width_of_the_vectors_changes_no_bit() {
        let present: Vec<f64> = (0..1000).map(|i| f64::from(i * i % 991) / 7.0 - 50.0).collect();
        let distances = [-30, 2, 1, -1, 30, 7];
        for len in [1, 2, 3, 4, 5, 7, 61, 300] {
            let runs = [Run { start: 37, len, stencil: 0, neighbours: 6, kept: 0, gaps: 0, rests: true }];
            let swept = |sweep: Loops| {
                let mut next = vec![0.0; 1000];
                let (present, rest) = (&present[..], Some(&present[..]));
                let mut plane = Plane { seen_from: 0, present, rest, begin: 0, next: &mut next };
                sweep(&runs, (&distances, &[]), 64, &mut plane);
                next
            };
            let results = [
                swept(sweep_in_lanes::<f64, 6, 1>),
                swept(sweep_in_lanes::<f64, 6, 2>),
                swept(sweep_in_lanes::<f64, 6, 4>),
                swept(sweep_in_lanes::<f64, 6, 8>),
                swept(sweep_in_lanes::<f64, ANY, 4>),
                swept(sweep),
            ];
            assert!(results.iter().all(|result| *result == results[0]), "{len} particles");
            assert_eq!(results[0].iter().filter(|&&value| value != 0.0).count(), len as usize);
        }
    }

    #[test]
    fn what_stands_in_a_gap_stays_there() {
        let present: Vec<f32> = (0..100).map(|i| i as f32).collect();
        let runs = [Run { start: 10, len: 60, stencil: 0, neighbours: 3, kept: 1, gaps: 2, rests: false }];
        let mut next = vec![-1.0; 70];
        let mut plane = Plane { seen_from: 0, present: &present, rest: None, begin: 5, next: &mut next };
        sweep(&runs, (&[-3, 2, 4], &[99, 30, 31]), 64, &mut plane);
        for (at, value) in (5..).zip(next) {
            let swept = (10..70).contains(&at) && at != 30 && at != 31;
            assert_eq!(value, if swept { at as f32 + 1.0 } else { -1.0 }, "{at}");
        }
    }
}
