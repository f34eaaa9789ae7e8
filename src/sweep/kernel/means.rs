//! Means of neighbours over a part of a run, and the terms that complete them while they are in the registers.

use super::{After, BOTH, CONTRACTED, Component, DAMPED, FED, Run, Tables};
use crate::flock::lanes::{add_product, lanes};
use crate::flock::real::Real;
use crate::sweep::terms::Finish;

/// How a mean is taken: a number of neighbours, and their coefficients.
pub(super) trait Mean {
    /// Whether its loops wait for multiplications, or else for loads and stores.
    const MULTIPLIES: bool = false;

    /// Whether the loops complete the means themselves: with feedback and damping, or with the Poisson term.
    const COMPLETES: bool = false;

    /// Writes means with rest offsets, and what loads add to them.
    fn fill<T: Real, const P: usize, const W: usize>(part: &mut Part<'_, '_, T, P>);
}

/// The particles `from..to` of a run.
pub(super) struct Part<'a, 'b, T, const P: usize> {
    pub run: &'a Run,
    pub tables: Tables<'a>,
    pub from: usize,
    pub to: usize,
    pub components: &'a mut [Component<'b, T>; P],
    pub after: After<'a, T>,
}

impl<'a, T: Real, const P: usize> Part<'a, '_, T, P> {
    #[inline(always)]
    fn distances(&self) -> &'a [isize] {
        &self.tables.distances[self.run.distances as usize..][..self.run.neighbours as usize]
    }

    /// The coefficients of the run's class, and all after them.
    #[inline(always)]
    fn coefficients(&self) -> &'a [f64] {
        &self.tables.coefficients.all()[self.run.coefficients as usize..]
    }
}

/// One coordinate as the particles of a part see it: of each neighbour as many numbers as there are targets.
struct Seen<'a, T, const N: usize> {
    neighbours: [&'a [T]; N],
    rest: Option<&'a [T]>,
}

/// A mean of `N` numbers.
trait Of<T, const N: usize> {
    fn mean<const W: usize>(&self, neighbours: &[&[T]; N], at: usize) -> [T; W];
}

#[inline(always)]
fn fill_all<T: Real, const N: usize, const P: usize, const W: usize, const A: u8>(
    part: &mut Part<'_, '_, T, P>,
    mean: &impl Of<T, N>,
) {
    let distances: &[isize; N] = part.distances().try_into().expect("as many as neighbours");
    let (from, to, len) = (part.from, part.to, part.to - part.from);
    let rests = part.run.rests;
    for component in &mut *part.components {
        let at = from - component.seen_from;
        let seen = |distance: isize| &component.present[at.wrapping_add_signed(distance)..][..len];
        let neighbours: [&[T]; N] = std::array::from_fn(|k| seen(distances[k]));
        let rest = component.rest.filter(|_| rests).map(|rest| &rest[from..to]);
        let target = &mut component.next[from - component.begin..to - component.begin];
        // Loops of their own: what is not there is not asked for. `A` alone decides, so that the others are not compiled.
        let (axis, here) = (component.axis, &component.present[at..][..len]);
        match A {
            FED => {
                let feedback = part.after.terms().feedback(axis, from, here);
                fill_with::<T, N, W, _>(neighbours, rest, mean, &feedback, target);
            }
            DAMPED => {
                let damping = part.after.terms().damping(here);
                fill_with::<T, N, W, _>(neighbours, rest, mean, &damping, target);
            }
            BOTH => {
                let terms = part.after.terms();
                let both = (terms.feedback(axis, from, here), terms.damping(here));
                fill_with::<T, N, W, _>(neighbours, rest, mean, &both, target);
            }
            CONTRACTED => {
                let contraction = part.after.terms().contraction(from, part.after.along(from, len));
                fill_with::<T, N, W, _>(neighbours, rest, mean, &contraction, target);
            }
            _ => fill_with::<T, N, W, _>(neighbours, rest, mean, &(), target),
        }
    }
}

#[inline(always)]
fn fill_with<T: Real, const N: usize, const W: usize, F: Finish<T>>(
    neighbours: [&[T]; N],
    rest: Option<&[T]>,
    mean: &impl Of<T, N>,
    finish: &F,
    target: &mut [T],
) {
    match rest {
        None => fill::<T, N, W, F>(&Seen { neighbours, rest: None }, mean, finish, target),
        Some(rest) => {
            let rest = Some(&rest[..target.len()]);
            fill::<T, N, W, F>(&Seen { neighbours, rest }, mean, finish, target);
        }
    }
}

/// All slices are as long as the target.
#[inline(always)]
fn fill<T: Real, const N: usize, const W: usize, F: Finish<T>>(
    seen: &Seen<'_, T, N>,
    mean: &impl Of<T, N>,
    finish: &F,
    target: &mut [T],
) {
    let len = target.len();
    // Said once, so that it is not asked in the loop.
    let mut neighbours = seen.neighbours;
    for slice in &mut neighbours {
        *slice = &slice[..len];
    }
    let seen = &Seen { neighbours, rest: seen.rest.map(|rest| &rest[..len]) };
    if len < W {
        for at in 0..len {
            fill_lanes::<T, N, 1, F>(seen, mean, finish, at, target);
        }
        return;
    }
    // From the second on they are stored at whole vectors: a store across two cache lines takes as long as two, and
    // these are what bodies within the caches wait for. Where two overlap, the same comes out again.
    let mut at = 0;
    let mut aligned = W - (target.as_ptr() as usize / size_of::<T>()) % W;
    loop {
        fill_lanes::<T, N, W, F>(seen, mean, finish, at, target);
        if at + W == len {
            return;
        }
        at = aligned.min(len - W);
        aligned += W;
    }
}

#[inline(always)]
fn fill_lanes<T: Real, const N: usize, const W: usize, F: Finish<T>>(
    seen: &Seen<'_, T, N>,
    mean: &impl Of<T, N>,
    finish: &F,
    at: usize,
    target: &mut [T],
) {
    let mean: [T; W] = mean.mean(&seen.neighbours, at);
    // Zero is added as well: the rule does, and it makes 0.0 of -0.0.
    let rest: [T; W] = seen.rest.map_or([T::default(); W], |rest| lanes(rest, at));
    let target = &mut target[at..at + W];
    for k in 0..W {
        target[k] = mean[k] + rest[k];
    }
    finish.lanes::<W>(at, target);
}

/// `N` neighbours that count the same.
pub(super) struct Equal<const N: usize, const A: u8>;

impl<const N: usize, const A: u8> Mean for Equal<N, A> {
    const COMPLETES: bool = true;

    #[inline(always)]
    fn fill<T: Real, const P: usize, const W: usize>(part: &mut Part<'_, '_, T, P>) {
        fill_all::<T, N, P, W, A>(part, &Self);
    }
}

impl<T: Real, const N: usize, const A: u8> Of<T, N> for Equal<N, A> {
    #[inline(always)]
    fn mean<const W: usize>(&self, neighbours: &[&[T]; N], at: usize) -> [T; W] {
        let mut sum: [T; W] = lanes(neighbours[0], at);
        for seen in &neighbours[1..] {
            let next: [T; W] = lanes(seen, at);
            for k in 0..W {
                sum[k] += next[k];
            }
        }
        for sum in &mut sum {
            *sum = *sum / T::of(N as f64);
        }
        sum
    }
}

/// `N` neighbours with weights.
pub(super) struct Scalar<const N: usize, const A: u8>;

struct Weights<T, const N: usize> {
    weights: [T; N],
    total: T,
}

impl<const N: usize, const A: u8> Mean for Scalar<N, A> {
    const COMPLETES: bool = true;

    #[inline(always)]
    fn fill<T: Real, const P: usize, const W: usize>(part: &mut Part<'_, '_, T, P>) {
        let all = part.coefficients();
        let weights = std::array::from_fn(|k| T::of(all[k]));
        fill_all::<T, N, P, W, A>(part, &Weights { weights, total: T::of(all[N]) });
    }
}

impl<T: Real, const N: usize> Of<T, N> for Weights<T, N> {
    #[inline(always)]
    fn mean<const W: usize>(&self, neighbours: &[&[T]; N], at: usize) -> [T; W] {
        // Negative zero is what adding the first neighbour to changes no bit.
        let mut sum = [T::of(-0.0); W];
        for (seen, &weight) in neighbours.iter().zip(&self.weights) {
            let next: [T; W] = lanes(seen, at);
            for k in 0..W {
                sum[k] += weight * next[k];
            }
        }
        for sum in &mut sum {
            *sum = *sum / self.total;
        }
        sum
    }
}

/// Any number of neighbours: one after the other into the target, which a tile keeps in cache.
pub(super) struct Any;

impl Mean for Any {
    #[inline(always)]
    fn fill<T: Real, const P: usize, const W: usize>(part: &mut Part<'_, '_, T, P>) {
        let (distances, all, rests) = (part.distances(), part.coefficients(), part.run.rests);
        let (from, to, len) = (part.from, part.to, part.to - part.from);
        let total = T::of(all.get(distances.len()).copied().unwrap_or(distances.len() as f64));
        for component in &mut *part.components {
            let at = from - component.seen_from;
            let target = &mut component.next[from - component.begin..to - component.begin];
            target.fill(T::of(-0.0));
            for (k, &distance) in distances.iter().enumerate() {
                let seen = &component.present[at.wrapping_add_signed(distance)..][..len];
                match all.get(k) {
                    None => target.iter_mut().zip(seen).for_each(|(target, &seen)| *target += seen),
                    Some(&weight) => {
                        let weight = T::of(weight);
                        target.iter_mut().zip(seen).for_each(|(target, &seen)| *target += weight * seen);
                    }
                }
            }
            match component.rest.filter(|_| rests).map(|rest| &rest[from..to]) {
                None => target.iter_mut().for_each(|target| *target = *target / total + T::default()),
                Some(rest) => {
                    target.iter_mut().zip(rest).for_each(|(target, &rest)| *target = *target / total + rest);
                }
            }
        }
    }
}

/// Targets that have been computed.
pub(super) struct AsTheyAre;

impl Mean for AsTheyAre {
    #[inline(always)]
    fn fill<T: Real, const P: usize, const W: usize>(_: &mut Part<'_, '_, T, P>) {}
}

/// Any number of neighbours with matrices, and a load.
pub(super) struct Matrix;

impl Mean for Matrix {
    const MULTIPLIES: bool = true;

    #[inline(always)]
    fn fill<T: Real, const P: usize, const W: usize>(part: &mut Part<'_, '_, T, P>) {
        let (from, len) = (part.from, part.to - part.from);
        let (blocks, distances) = (part.coefficients().as_chunks::<4>().0, part.distances());
        let [x, y] = &mut part.components[..] else { unreachable!("matrices need both coordinates") };
        let row = MatrixRow { blocks, distances };
        let mut at = 0;
        while at + W <= len {
            row.fill_lanes::<T, W>(from + at, [x, y]);
            at += W;
        }
        if at < len && len >= W {
            // The last ones overlap those before them, which come out the same again.
            row.fill_lanes::<T, W>(from + len - W, [x, y]);
        } else {
            (at..len).for_each(|at| row.fill_lanes::<T, 1>(from + at, [x, y]));
        }
    }
}

struct MatrixRow<'a> {
    /// Of each neighbour, then the compliance.
    blocks: &'a [[f64; 4]],
    distances: &'a [isize],
}

impl MatrixRow<'_> {
    /// `W` particles from number `j` on.
    #[inline(always)]
    fn fill_lanes<T: Real, const W: usize>(&self, j: usize, [x, y]: [&mut Component<'_, T>; 2]) {
        // Negative zero is what adding the first neighbour to changes no bit.
        let mut sum = [[T::of(-0.0); W]; 2];
        for (&distance, block) in self.distances.iter().zip(self.blocks) {
            let at = |seen_from: usize| (j - seen_from).wrapping_add_signed(distance);
            let seen: [[T; W]; 2] = [lanes(x.present, at(x.seen_from)), lanes(y.present, at(y.seen_from))];
            add_product(block.map(T::of), &seen, &mut sum);
        }
        // Zero is added as well: the rule does, and it makes 0.0 of -0.0.
        for (sum, rest) in sum.iter_mut().zip([x.rest, y.rest]) {
            let rest: [T; W] = rest.map_or([T::default(); W], |rest| lanes(rest, j));
            for k in 0..W {
                sum[k] += rest[k];
            }
        }
        if let (Some(of_x), Some(of_y)) = (x.force, y.force) {
            let compliance = self.blocks[self.distances.len()].map(T::of);
            add_product(compliance, &[lanes(of_x, j), lanes(of_y, j)], &mut sum);
        }
        x.next[j - x.begin..][..W].copy_from_slice(&sum[0]);
        y.next[j - y.begin..][..W].copy_from_slice(&sum[1]);
    }
}
