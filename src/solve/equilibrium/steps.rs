//! The passes over a body that solvers are made of. Each is done group by group, in parallel where there
//! is more than one; sums are taken over each group and then over the groups in their order, so that any
//! number of threads gives the same bits, and any number of ranks. A rank passes over its own groups; what its rows read
//! of others it must have received.

use rayon::prelude::*;

use crate::flock::vectors::Vectors;
use crate::solve::field::{Real, VectorsMut, VectorsRef, dot};
use crate::solve::operator::{Matrix, Particles, RowCoefficients, Task, pass};

/// Does some work on every group, in parallel where that pays; answers in the order of groups.
pub fn for_groups<P: Send, R: Send>(groups: Vec<P>, work: impl Fn(usize, P) -> R + Sync) -> Vec<R> {
    if groups.len() > 1 && rayon::current_num_threads() > 1 {
        groups.into_par_iter().enumerate().map(|(group, part)| work(group, part)).collect()
    } else {
        groups.into_iter().enumerate().map(|(group, part)| work(group, part)).collect()
    }
}

/// Does two pieces of work that need nothing of each other, at the same time where there are threads for both.
pub fn side_by_side<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    if rayon::current_num_threads() > 1 { rayon::join(a, b) } else { (a(), b()) }
}

/// Does some work on a thread of the pool: from outside each of its passes would wake others and wait to be woken.
pub fn in_pool<R: Send>(work: impl FnOnce() -> R + Send) -> R {
    if rayon::current_num_threads() > 1 { rayon::scope(|_| work()) } else { work() }
}

/// Pieces that each thread is given of a list: those of a thread that has something else to do are another's.
const PIECES: usize = 4;

/// Does some work on a list, cut into pieces of `least` or more for the threads to share; answers in order.
pub fn in_pieces<P: Sync, R: Send>(list: &[P], least: usize, work: impl Fn(&[P]) -> R + Sync) -> Vec<R> {
    let pieces = match rayon::current_num_threads() {
        1 => 1,
        threads => PIECES * threads,
    };
    let size = list.len().div_ceil(pieces).max(least);
    for_groups(list.chunks(size).collect(), |_, piece| work(piece))
}

/// The same on every group of a matrix that this rank owns; `parts` are theirs.
pub fn for_own_groups<P: Send, R: Send>(
    matrix: &Matrix,
    parts: Vec<P>,
    work: impl Fn(usize, P) -> R + Sync,
) -> Vec<R> {
    let first = matrix.own_groups().start;
    for_groups(parts, |group, part| work(first + group, part))
}

/// `K u`, written to `out`.
pub struct Apply<'a, T> {
    pub out: VectorsMut<'a, T>,
}

impl<T: Real> Task<T> for Apply<'_, T> {
    #[inline(always)]
    fn take<const W: usize>(&mut self, particles: &impl Particles<T, W>, x: &[T; W], y: &[T; W]) {
        particles.set(self.out.x, self.out.begin, *x);
        particles.set(self.out.y, self.out.begin, *y);
    }
}

/// `f - K u`, written to `out`.
pub struct Residual<'a, T> {
    pub f: VectorsRef<'a, T>,
    pub out: VectorsMut<'a, T>,
}

impl<T: Real> Task<T> for Residual<'_, T> {
    #[inline(always)]
    fn take<const W: usize>(&mut self, particles: &impl Particles<T, W>, x: &[T; W], y: &[T; W]) {
        let (fx, fy) = (particles.of(self.f.x), particles.of(self.f.y));
        particles.set(self.out.x, self.out.begin, std::array::from_fn(|k| fx[k] - x[k]));
        particles.set(self.out.y, self.out.begin, std::array::from_fn(|k| fy[k] - y[k]));
    }
}

/// `u + weight D^-1 (f - K u)`, written to `out`.
pub struct Smooth<'a, T> {
    pub weight: T,
    pub f: VectorsRef<'a, T>,
    pub u: VectorsRef<'a, T>,
    pub out: VectorsMut<'a, T>,
}

impl<T: Real> Task<T> for Smooth<'_, T> {
    #[inline(always)]
    fn take<const W: usize>(&mut self, particles: &impl Particles<T, W>, x: &[T; W], y: &[T; W]) {
        let (fx, fy) = (particles.of(self.f.x), particles.of(self.f.y));
        let (ux, uy) = (particles.of(self.u.x), particles.of(self.u.y));
        let (mut to_x, mut to_y) = ([T::default(); W], [T::default(); W]);
        for k in 0..W {
            let [xx, xy, yx, yy] = [0, 1, 2, 3].map(|entry| particles.inverse(entry, k) * self.weight);
            to_x[k] = ux[k] + (xx * (fx[k] - x[k]) + xy * (fy[k] - y[k]));
            to_y[k] = uy[k] + (yx * (fx[k] - x[k]) + yy * (fy[k] - y[k]));
        }
        particles.set(self.out.x, self.out.begin, to_x);
        particles.set(self.out.y, self.out.begin, to_y);
    }
}

/// `out = K u`; returns `u . K u`.
pub fn apply<T: Real>(
    matrix: &Matrix,
    stencils: &RowCoefficients<T>,
    u: &Vectors<T>,
    out: &mut Vectors<T>,
) -> f64 {
    let sums = for_own_groups(matrix, matrix.own_parts(out), |group, out| {
        let range = out.range();
        let mut task = Apply { out };
        pass(matrix, stencils, group, u.view(), &mut task);
        dot(VectorsRef { x: task.out.x, y: task.out.y }, u.view().range(range))
    });
    matrix.sum(&sums)
}

/// `out = f - K u`; returns its square.
pub fn residual<T: Real>(
    matrix: &Matrix,
    stencils: &RowCoefficients<T>,
    of: (&Vectors<T>, &Vectors<T>),
    out: &mut Vectors<T>,
) -> f64 {
    matrix.sum(&residual_of_groups(matrix, stencils, of, out))
}

/// The same; returns the squares of the groups of this rank, for which it need not wait for others.
pub fn residual_of_groups<T: Real>(
    matrix: &Matrix,
    stencils: &RowCoefficients<T>,
    (u, f): (&Vectors<T>, &Vectors<T>),
    out: &mut Vectors<T>,
) -> Vec<f64> {
    for_own_groups(matrix, matrix.own_parts(out), |group, out| {
        let mut task = Residual { f: f.view(), out };
        pass(matrix, stencils, group, u.view(), &mut task);
        let out = VectorsRef { x: &*task.out.x, y: &*task.out.y };
        dot(out, out)
    })
}

/// `out = u + weight D^-1 (f - K u)`.
pub fn smooth<T: Real>(
    matrix: &Matrix,
    stencils: &RowCoefficients<T>,
    weight: f64,
    (u, f): (&Vectors<T>, &Vectors<T>),
    out: &mut Vectors<T>,
) {
    for_own_groups(matrix, matrix.own_parts(out), |group, out| {
        let mut task = Smooth { weight: T::of(weight), f: f.view(), u: u.view(), out };
        pass(matrix, stencils, group, u.view(), &mut task);
    });
}

/// `out = keep out + weight D^-1 f`.
pub fn precondition<T: Real>(
    matrix: &Matrix,
    stencils: &RowCoefficients<T>,
    (keep, weight): (f64, f64),
    f: &Vectors<T>,
    out: &mut Vectors<T>,
) {
    for_own_groups(matrix, matrix.own_parts(out), |group, out| {
        precondition_group(matrix, stencils, (keep, weight), f.view(), group, out);
    });
}

/// One group of [`precondition`].
pub fn precondition_group<T: Real>(
    matrix: &Matrix,
    stencils: &RowCoefficients<T>,
    (keep, weight): (f64, f64),
    f: VectorsRef<'_, T>,
    group: usize,
    out: VectorsMut<'_, T>,
) {
    let (keep, weight) = (T::of(keep), T::of(weight));
    for run in matrix.runs_of(group) {
        let [xx, xy, yx, yy] = stencils.inverse(run.class).map(|entry| entry * weight);
        let step = |x: &mut T, y: &mut T, fx: T, fy: T| {
            *x = keep * *x + (xx * fx + xy * fy);
            *y = keep * *y + (yx * fx + yy * fy);
        };
        let range = run.start as usize..(run.start + run.len) as usize;
        let begin = range.start - out.begin;
        // Along an outline there are as many runs as particles, and slices of one would take longer than the step.
        if run.len == 1 {
            step(&mut out.x[begin], &mut out.y[begin], f.x[range.start], f.y[range.start]);
            continue;
        }
        let here = begin..begin + range.len();
        let (f, x, y) = (f.range(range), &mut out.x[here.clone()], &mut out.y[here]);
        x.iter_mut().zip(y).zip(f.x).zip(f.y).for_each(|(((x, y), &fx), &fy)| step(x, y, fx, fy));
    }
}

/// `u += step`.
pub fn advance<T: Real>(matrix: &Matrix, step: &Vectors<T>, u: &mut Vectors<T>) {
    for_own_groups(matrix, matrix.own_parts(u), |_, u| {
        let step = step.view().range(u.range());
        u.x.iter_mut().zip(step.x).for_each(|(u, &step)| *u += step);
        u.y.iter_mut().zip(step.y).for_each(|(u, &step)| *u += step);
    });
}
