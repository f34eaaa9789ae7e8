//! The weights nearest to equal ones that reproduce one place.
//!
//! Minimise `|w - 1/n|^2` subject to `sum w = 1`, `sum w q = 0` and `w >= 0`, `q` being the offsets to the
//! neighbours: a strictly convex quadratic program whose Hessian is the identity, solved by the dual
//! active-set method (Goldfarb & Idnani, *Mathematical Programming* 27, 1983). It starts from the minimum
//! without `w >= 0`, sets to zero one negative weight after the other, lets go of those that turn out to
//! hold it back, and knows when nothing satisfies all: then the start itself is the answer.

use nalgebra::{DMatrix, DVector};

/// The own place is off the line, or the point, that the neighbours stand on, by so much of their spread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unreachable {
    pub off: f64,
}

/// To which the constraints are met, relative to the farthest neighbour.
const TOLERANCE: f64 = 1e-12;

/// Weights for these offsets \[length\] from the own place to the neighbours, at least one and all finite;
/// `coordinate` is the largest number they are differences of \[length\].
pub fn nearest(offsets: &[[f64; 2]], coordinate: f64) -> Result<Vec<f64>, Unreachable> {
    let count = offsets.len();
    let equal = vec![1.0 / count as f64; count];
    let spread = offsets.iter().flatten().fold(0.0, |most: f64, q| most.max(q.abs()));
    let sum = offsets.iter().fold([0.0; 2], |sum: [f64; 2], q| [sum[0] + q[0], sum[1] + q[1]]);
    if sum.iter().all(|s| s.abs() <= f64::EPSILON * spread * count as f64) {
        return Ok(equal);
    }
    let tolerance = TOLERANCE.max(8.0 * f64::EPSILON * coordinate / spread);
    let scaled: Vec<[f64; 2]> = offsets.iter().map(|q| q.map(|q| q / spread)).collect();
    let constraints = Constraints::new(&scaled, tolerance)?;
    let mut free = equal;
    constraints.project(&mut free);
    Ok(not_negative(&constraints, &free, tolerance).unwrap_or(free))
}

/// The equality constraints as `rows w = right`, `rows` orthonormal, shape \[rank\]\[count\].
struct Constraints {
    rows: Vec<DVector<f64>>,
    right: Vec<f64>,
}

impl Constraints {
    /// Orthonormalises the sum and the two coordinates (Gram-Schmidt, twice for its rounding); a row that
    /// depends on those before it must agree with them.
    fn new(offsets: &[[f64; 2]], tolerance: f64) -> Result<Self, Unreachable> {
        let count = offsets.len();
        let ones = DVector::from_element(count, 1.0);
        let axis = |k: usize| DVector::from_iterator(count, offsets.iter().map(|q| q[k]));
        let spread = |v: &DVector<f64>| (v - DVector::from_element(count, v.mean())).norm();
        let (mut first, mut second) = (axis(0), axis(1));
        if spread(&second) > spread(&first) {
            std::mem::swap(&mut first, &mut second);
        }
        let mut known = Self { rows: Vec::new(), right: Vec::new() };
        for (row, right) in [(ones, 1.0), (first, 0.0), (second, 0.0)] {
            known.add(row, right, tolerance)?;
        }
        Ok(known)
    }

    fn add(&mut self, mut row: DVector<f64>, mut right: f64, tolerance: f64) -> Result<(), Unreachable> {
        for _ in 0..2 {
            for (other, value) in self.rows.iter().zip(&self.right) {
                let share = other.dot(&row);
                row.axpy(-share, other, 1.0);
                right -= share * value;
            }
        }
        let norm = row.norm();
        if norm > tolerance {
            self.rows.push(row / norm);
            self.right.push(right / norm);
        } else if right.abs() > tolerance {
            return Err(Unreachable { off: right.abs() });
        }
        Ok(())
    }

    /// Moves `weights` the shortest way to where the constraints hold; twice, for the rounding of the first.
    fn project(&self, weights: &mut [f64]) {
        for _ in 0..2 {
            for (row, right) in self.rows.iter().zip(&self.right) {
                let missing = right - row.iter().zip(&*weights).map(|(r, w)| r * w).sum::<f64>();
                weights.iter_mut().zip(row.iter()).for_each(|(w, r)| *w += missing * r);
            }
        }
    }
}

/// A weight held at zero, and how hard it is held.
struct Held {
    index: usize,
    multiplier: f64,
}

/// The nearest weights none of which is negative, from `start`, the nearest without that; `None` where there
/// are none.
fn not_negative(constraints: &Constraints, start: &[f64], tolerance: f64) -> Option<Vec<f64>> {
    let mut weights = start.to_vec();
    let mut held: Vec<Held> = Vec::new();
    let mut pushed = 0.0;
    let mut entering: Option<usize> = None;
    // Each step sets a weight to zero or lets one go; the objective only grows, so none repeats.
    for _ in 0..16 + 8 * weights.len() {
        let Some(enter) = entering.or_else(|| lowest(&weights, tolerance)) else {
            return Some(finished(constraints, weights, &held));
        };
        let step = Step::towards(constraints, &held, enter, weights.len())?;
        let to_zero = if step.direction[enter] > 1e-10 {
            -weights[enter] / step.direction[enter]
        } else {
            f64::INFINITY
        };
        let (to_release, released) = step.first_released(&held);
        let length = to_zero.min(to_release);
        if length.is_infinite() {
            return None;
        }
        if to_zero.is_finite() {
            weights.iter_mut().zip(&step.direction).for_each(|(w, d)| *w += length * d);
        }
        held.iter_mut().zip(&step.relief).for_each(|(h, r)| h.multiplier -= length * r);
        pushed += length;
        if to_zero <= to_release {
            weights[enter] = 0.0;
            held.push(Held { index: enter, multiplier: pushed });
            (entering, pushed) = (None, 0.0);
        } else {
            held.remove(released);
            entering = Some(enter);
        }
    }
    None
}

/// The most negative weight.
fn lowest(weights: &[f64], tolerance: f64) -> Option<usize> {
    let lowest = (0..weights.len()).min_by(|&a, &b| weights[a].total_cmp(&weights[b]))?;
    (weights[lowest] < -tolerance).then_some(lowest)
}

/// The effect of raising one weight while the constraints hold and those held stay at zero.
struct Step {
    /// Change of the weights; of the raised one its own square length.
    direction: Vec<f64>,
    /// How much less each of the held is held, parallel to them.
    relief: Vec<f64>,
}

impl Step {
    /// Of the unit vector of `enter`, what is left beside the constraints and the held: least squares over
    /// the weights that are free. `None` where rounding leaves no solution.
    fn towards(constraints: &Constraints, held: &[Held], enter: usize, count: usize) -> Option<Self> {
        let free: Vec<usize> = (0..count).filter(|k| held.iter().all(|h| h.index != *k)).collect();
        let coefficients = fitted(constraints, &free, enter)?;
        let fit =
            |k: usize| (0..coefficients.len()).map(|j| coefficients[j] * constraints.rows[j][k]).sum::<f64>();
        let mut direction = vec![0.0; count];
        for &k in &free {
            direction[k] = f64::from(u8::from(k == enter)) - fit(k);
        }
        Some(Self { direction, relief: held.iter().map(|h| -fit(h.index)).collect() })
    }

    /// How far to go until one of the held is held no more, and which.
    fn first_released(&self, held: &[Held]) -> (f64, usize) {
        let mut first = (f64::INFINITY, 0);
        for (k, (h, &relief)) in held.iter().zip(&self.relief).enumerate() {
            if relief > 1e-12 && h.multiplier / relief < first.0 {
                first = (h.multiplier / relief, k);
            }
        }
        first
    }
}

/// The combination of the constraints' rows, over the free weights, nearest to the unit vector of `enter`.
fn fitted(constraints: &Constraints, free: &[usize], enter: usize) -> Option<DVector<f64>> {
    let rank = constraints.rows.len();
    if free.len() < rank {
        return None;
    }
    let columns = DMatrix::from_fn(free.len(), rank, |k, j| constraints.rows[j][free[k]]);
    let unit = DVector::from_iterator(free.len(), free.iter().map(|&k| f64::from(u8::from(k == enter))));
    let factors = columns.qr();
    factors.r().solve_upper_triangular(&(factors.q().transpose() * unit))
}

/// Takes the rounding of the steps out again, over the weights that are free.
fn finished(constraints: &Constraints, mut weights: Vec<f64>, held: &[Held]) -> Vec<f64> {
    held.iter().for_each(|h| weights[h.index] = 0.0);
    let free: Vec<usize> = (0..weights.len()).filter(|k| held.iter().all(|h| h.index != *k)).collect();
    let rank = constraints.rows.len();
    let factors = DMatrix::from_fn(free.len(), rank, |k, j| constraints.rows[j][free[k]]).qr();
    for _ in 0..2 {
        let missing = DVector::from_fn(rank, |j, _| {
            constraints.right[j] - constraints.rows[j].iter().zip(&weights).map(|(r, w)| r * w).sum::<f64>()
        });
        if let Some(solution) = factors.r().transpose().solve_lower_triangular(&missing) {
            let change = factors.q() * solution;
            free.iter().zip(change.iter()).for_each(|(&k, change)| weights[k] += change);
        }
    }
    // A weight below zero by no more than the tolerance is rounding, and so is one hardly above it.
    weights.iter_mut().filter(|w| **w < 4.0 * f64::EPSILON).for_each(|w| *w = 0.0);
    weights
}
