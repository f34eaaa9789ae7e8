//! Vectors over the particles in single or double precision, and sums over them in a fixed order.

pub use crate::flock::real::Real;
use crate::flock::vectors::Vectors;

impl<T: Real> Vectors<T> {
    /// Both coordinates, whole.
    pub fn view(&self) -> VectorsRef<'_, T> {
        VectorsRef { x: &self.x, y: &self.y }
    }

    /// Both coordinates, cut at `bounds`: ascending, from 0 to the length.
    pub fn parts(&mut self, bounds: &[usize]) -> Vec<VectorsMut<'_, T>> {
        let (mut x, mut y) = (&mut self.x[..], &mut self.y[..]);
        let mut parts = Vec::with_capacity(bounds.len());
        for ends in bounds.windows(2) {
            let (head_x, tail_x) = x.split_at_mut(ends[1] - ends[0]);
            let (head_y, tail_y) = y.split_at_mut(ends[1] - ends[0]);
            parts.push(VectorsMut { begin: ends[0], x: head_x, y: head_y });
            (x, y) = (tail_x, tail_y);
        }
        parts
    }
}

/// A field to be read.
#[derive(Clone, Copy, Debug)]
pub struct VectorsRef<'a, T> {
    pub x: &'a [T],
    pub y: &'a [T],
}

impl<'a, T> VectorsRef<'a, T> {
    pub fn range(self, range: std::ops::Range<usize>) -> Self {
        Self { x: &self.x[range.clone()], y: &self.y[range] }
    }
}

/// The stretch of a field that one thread writes.
#[derive(Debug)]
pub struct VectorsMut<'a, T> {
    /// Index of its first particle.
    pub begin: usize,
    pub x: &'a mut [T],
    pub y: &'a mut [T],
}

impl<T> VectorsMut<'_, T> {
    pub fn range(&self) -> std::ops::Range<usize> {
        self.begin..self.begin + self.x.len()
    }
}

/// Lanes that products are summed in: enough to keep an adder busy, and fixed, so that the sum has the
/// same bits on every machine.
const LANES: usize = 16;

/// `sum a b` over one coordinate, in double precision.
fn dot_of<A: Real, B: Real>(a: &[A], b: &[B]) -> f64 {
    let mut sums = [0.0; LANES];
    let (whole_a, rest_a) = a.as_chunks::<LANES>();
    let (whole_b, rest_b) = b.as_chunks::<LANES>();
    for (a, b) in whole_a.iter().zip(whole_b) {
        for k in 0..LANES {
            sums[k] += a[k].wide() * b[k].wide();
        }
    }
    let rest: f64 = rest_a.iter().zip(rest_b).map(|(a, b)| a.wide() * b.wide()).sum();
    sums.iter().sum::<f64>() + rest
}

/// `sum a . b` over all particles, in double precision.
pub fn dot<A: Real, B: Real>(a: VectorsRef<'_, A>, b: VectorsRef<'_, B>) -> f64 {
    dot_of(a.x, b.x) + dot_of(a.y, b.y)
}
