//! Bounds of the spectrum of `D^-1 K`, from a few steps of conjugate gradients.
//!
//! The coefficients of the iteration are those of Lanczos' tridiagonal matrix, whose extreme eigenvalues
//! approach those of the operator from within (G. H. Golub and C. F. Van Loan, *Matrix Computations*,
//! section 10.2.5). On a large body the largest eigenvalue is looked for on a few groups of its columns with all
//! others held. It belongs to a displacement of a few particles that the rows around them decide, so both ends, the
//! middle and the groups whose rows could carry most have it to next to nothing. Written here, as no crate has the
//! coefficients of an iteration that the solver takes anyway.

use std::collections::HashSet;

use super::jacobi::row_sum;
use super::steps::{Apply, precondition_group};
use crate::flock::vectors::Vectors;
use crate::solve::field::{Real, VectorsMut, dot};
use crate::solve::operator::{Matrix, Name, RowCoefficients, RowRef, pass};

/// Share of the first residual's square below which the next one is rounding.
const EXHAUSTED: f64 = 1e-24;

/// Lowest and highest eigenvalue found of `D^-1 K`; zero and infinity of one that is not positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    pub low: f64,
    pub high: f64,
}

/// Most groups looked at beside both ends and the middle: each costs as much as they do.
const MOST_ODD: usize = 2;

/// Groups of columns that a largest eigenvalue is looked for in: both ends, the middle, and of those with rows that
/// none of these has, as at an outline, a hole or an inclusion, the few whose rows could carry most.
fn samples(matrix: &Matrix) -> Vec<usize> {
    let last = matrix.groups() - 1;
    let mut samples = vec![0, last / 2, last];
    samples.dedup();
    if samples.len() == matrix.groups() {
        return samples;
    }
    let rows_of = |group: usize| matrix.runs_of(group).iter().map(|run| run.class as usize);
    let mut seen = vec![false; matrix.rows.len()];
    samples.iter().flat_map(|&group| rows_of(group)).for_each(|row| seen[row] = true);
    if let Some(team) = matrix.team() {
        let own = matrix.names.iter().zip(&seen).filter(|(_, seen)| **seen).map(|(name, _)| *name);
        let all: HashSet<Name> = team.gather_all(&own.collect::<Vec<_>>()).into_iter().collect();
        seen.iter_mut().zip(&matrix.names).for_each(|(seen, name)| *seen = all.contains(name));
    }
    let sum_of = |(row, seen): (RowRef<'_>, &bool)| if *seen { 0.0 } else { row_sum(row) };
    let sums: Vec<f64> = matrix.rows.iter().zip(&seen).map(sum_of).collect();
    let odd_of =
        |group: usize| rows_of(group).filter(|&row| !seen[row]).map(|row| sums[row]).reduce(f64::max);
    let mut odd: Vec<(f64, usize)> =
        (0..=last).filter_map(|group| odd_of(group).map(|sum| (sum, group))).collect();
    if let Some(team) = matrix.team() {
        odd = team.gather_all(&odd);
    }
    odd.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    samples.extend(odd.iter().take(MOST_ODD).map(|&(_, group)| group));
    samples.sort_unstable();
    samples
}

/// The largest eigenvalue, found from below.
pub fn largest<T: Real>(matrix: &Matrix, stencils: &RowCoefficients<T>, steps: usize) -> f64 {
    bounds(matrix, stencils, &samples(matrix), steps).high
}

/// Both ends of the spectrum on the whole body; the low one is found from above, and slowly.
pub fn both<T: Real>(matrix: &Matrix, stencils: &RowCoefficients<T>, steps: usize) -> Bounds {
    let all: Vec<usize> = (0..matrix.groups()).collect();
    bounds(matrix, stencils, &all, steps)
}

fn bounds<T: Real>(matrix: &Matrix, stencils: &RowCoefficients<T>, groups: &[usize], steps: usize) -> Bounds {
    let mut krylov = Krylov::new(matrix, stencils, groups);
    let (mut diagonal, mut beside) = (Vec::new(), Vec::new());
    let (mut step_before, mut ratio) = (1.0, 0.0);
    let at_start = krylov.rz;
    for _ in 0..steps {
        let Some((step, next_ratio)) = krylov.step() else {
            // Nothing is left, unless a displacement was met that costs no energy.
            if krylov.rz > EXHAUSTED * at_start {
                return Bounds { low: 0.0, high: f64::INFINITY };
            }
            break;
        };
        diagonal.push(1.0 / step + ratio / step_before);
        beside.push(next_ratio.sqrt() / step);
        (step_before, ratio) = (step, next_ratio);
    }
    if diagonal.is_empty() {
        return Bounds { low: 1.0, high: 1.0 };
    }
    beside.truncate(diagonal.len() - 1);
    extremes(&diagonal, &beside)
}

/// Conjugate gradients on some groups of columns, all others held.
struct Krylov<'a, T> {
    matrix: &'a Matrix,
    stencils: &'a RowCoefficients<T>,
    /// Of these the ones that this rank owns, where each has a window of the matrix.
    groups: Vec<usize>,
    r: Vectors<T>,
    z: Vectors<T>,
    p: Vectors<T>,
    q: Vectors<T>,
    rz: f64,
}

impl<'a, T: Real> Krylov<'a, T> {
    /// Fields of zeros are not touched outside the groups, so they cost no memory there.
    fn new(matrix: &'a Matrix, stencils: &'a RowCoefficients<T>, groups: &[usize]) -> Self {
        let zeros = || Vectors::zeros(matrix.count());
        let (r, z, p, q) = (zeros(), zeros(), zeros(), zeros());
        let is_own = |group: &usize| matrix.team().is_none() || matrix.own_groups().contains(group);
        let groups: Vec<usize> = groups.iter().copied().filter(is_own).collect();
        let mut krylov = Self { matrix, stencils, groups, r, z, p, q, rz: 0.0 };
        // A fixed start without symmetry: the fractional parts of multiples of the golden ratio.
        let noise = |i: usize| T::of((i as f64 * 0.618_033_988_749_895).fract() - 0.5);
        for run in krylov.groups.iter().flat_map(|&group| matrix.runs_of(group)) {
            for i in run.start as usize..(run.start + run.len) as usize {
                krylov.r.x[i] = noise(2 * (matrix.first() + i) + 1);
                krylov.r.y[i] = noise(2 * (matrix.first() + i) + 2);
            }
        }
        krylov.precondition();
        krylov.rz = krylov.product(&krylov.r, &krylov.z);
        krylov.p = krylov.z.clone();
        krylov
    }

    /// Step length, and the ratio of the residuals' squares; `None` once nothing is left.
    fn step(&mut self) -> Option<(f64, f64)> {
        if self.matrix.team().is_some() {
            self.matrix.receive(&mut self.p);
        }
        for &group in &self.groups {
            let out = part(&mut self.q, self.matrix, group);
            pass(self.matrix, self.stencils, group, self.p.view(), &mut Apply { out });
        }
        let pq = self.product(&self.p, &self.q);
        let before = self.rz;
        let exhausted = !(pq > 0.0 && before > 0.0);
        if exhausted {
            return None;
        }
        let step = before / pq;
        for &group in &self.groups {
            add_times(part(&mut self.r, self.matrix, group), (T::of(1.0), T::of(-step)), &self.q);
        }
        self.precondition();
        self.rz = self.product(&self.r, &self.z);
        let ratio = self.rz / before;
        for &group in &self.groups {
            add_times(part(&mut self.p, self.matrix, group), (T::of(ratio), T::of(1.0)), &self.z);
        }
        (ratio > 0.0).then_some((step, ratio))
    }

    fn precondition(&mut self) {
        for &group in &self.groups {
            let out = part(&mut self.z, self.matrix, group);
            precondition_group(self.matrix, self.stencils, (0.0, 1.0), self.r.view(), group, out);
        }
    }

    fn product(&self, a: &Vectors<T>, b: &Vectors<T>) -> f64 {
        let of_group = |&group: &usize| {
            let range = self.matrix.bounds[group]..self.matrix.bounds[group + 1];
            dot(a.view().range(range.clone()), b.view().range(range))
        };
        let own = self.groups.iter().map(of_group);
        match self.matrix.team() {
            None => own.sum(),
            Some(team) => team.gather_all(&own.collect::<Vec<f64>>()).into_iter().sum(),
        }
    }
}

/// The stretch of a field that belongs to a group.
fn part<'a, T>(field: &'a mut Vectors<T>, matrix: &Matrix, group: usize) -> VectorsMut<'a, T> {
    let range = matrix.bounds[group]..matrix.bounds[group + 1];
    VectorsMut { begin: range.start, x: &mut field.x[range.clone()], y: &mut field.y[range] }
}

/// `to = keep to + weight from`.
fn add_times<T: Real>(to: VectorsMut<'_, T>, (keep, weight): (T, T), from: &Vectors<T>) {
    let from = from.view().range(to.range());
    to.x.iter_mut().zip(from.x).for_each(|(to, &from)| *to = keep * *to + weight * from);
    to.y.iter_mut().zip(from.y).for_each(|(to, &from)| *to = keep * *to + weight * from);
}

/// Lowest and highest eigenvalue of a symmetric tridiagonal matrix, by bisection on Sturm's count.
fn extremes(diagonal: &[f64], beside: &[f64]) -> Bounds {
    let below = |shift: f64| {
        let mut pivot = 1.0;
        let negative = |k: usize| {
            let coupling = if k == 0 { 0.0 } else { beside[k - 1] * beside[k - 1] };
            pivot = diagonal[k] - shift - coupling / pivot;
            if pivot == 0.0 {
                pivot = f64::MIN_POSITIVE;
            }
            pivot < 0.0
        };
        (0..diagonal.len()).map(negative).filter(|&negative| negative).count()
    };
    let radius = |k: usize| {
        let left = if k == 0 { 0.0 } else { beside[k - 1].abs() };
        left + beside.get(k).map_or(0.0, |b| b.abs())
    };
    let reach = |sign: f64| (0..diagonal.len()).map(move |k| diagonal[k] + sign * radius(k));
    let (floor, ceiling) =
        (reach(-1.0).fold(f64::INFINITY, f64::min), reach(1.0).fold(f64::NEG_INFINITY, f64::max));
    let bisect = |count: usize| {
        let (mut low, mut high) = (floor, ceiling);
        for _ in 0..100 {
            let middle = f64::midpoint(low, high);
            if below(middle) >= count { high = middle } else { low = middle }
        }
        f64::midpoint(low, high)
    };
    Bounds { low: bisect(1), high: bisect(diagonal.len()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extremes_of_a_chain_are_known() {
        let n = 30;
        let found = extremes(&vec![2.0; n], &vec![-1.0; n - 1]);
        let angle = std::f64::consts::PI / (n as f64 + 1.0);
        assert!((found.low - (2.0 - 2.0 * angle.cos())).abs() < 1e-12, "{found:?}");
        assert!((found.high - (2.0 + 2.0 * angle.cos())).abs() < 1e-12, "{found:?}");
    }
}
