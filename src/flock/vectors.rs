//! Positions as parallel arrays: the one layout every sweep, recorder and transport reads.

use std::borrow::Cow;

pub use crate::geometry::point::distance;
use crate::geometry::point::minus;

/// One vector in the plane for each particle, shape \[count\] each: positions and displacements
/// \[length unit of the scene, world frame\], forces, residuals.
///
/// Parallel arrays rather than an array of pairs, so that a sweep streams one coordinate at a
/// time and the compiler can vectorise it.
#[derive(Debug, Default, PartialEq)]
pub struct Vectors<T = f64> {
    /// First coordinates, shape \[count\].
    pub x: Vec<T>,
    /// Second coordinates, shape \[count\].
    pub y: Vec<T>,
}

impl From<Vectors> for Cow<'_, Vectors> {
    fn from(vectors: Vectors) -> Self {
        Cow::Owned(vectors)
    }
}

impl<T: Copy + Default> Vectors<T> {
    /// `count` zeros.
    pub fn zeros(count: usize) -> Self {
        Self { x: vec![T::default(); count], y: vec![T::default(); count] }
    }

    /// Number of vectors.
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Whether there is no vector.
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// The coordinates along each axis, shape \[2\]\[count\].
    pub fn components(&self) -> [&[T]; 2] {
        [&self.x, &self.y]
    }

    /// The same, to be overwritten.
    pub(crate) fn components_mut(&mut self) -> [&mut [T]; 2] {
        [&mut self.x, &mut self.y]
    }

    /// Both coordinates of one vector.
    #[inline]
    pub fn get(&self, index: usize) -> [T; 2] {
        [self.x[index], self.y[index]]
    }

    /// Overwrites one vector.
    #[inline]
    pub fn set(&mut self, index: usize, vector: [T; 2]) {
        [self.x[index], self.y[index]] = vector;
    }

    /// Appends a vector.
    pub fn push(&mut self, [x, y]: [T; 2]) {
        self.x.push(x);
        self.y.push(y);
    }

    /// The vectors in order.
    pub fn iter(&self) -> impl Iterator<Item = [T; 2]> + '_ {
        self.x.iter().zip(&self.y).map(|(&x, &y)| [x, y])
    }
}

impl Vectors {
    /// The mean of all; the origin if there are none.
    pub fn middle(&self) -> [f64; 2] {
        let sum = self.iter().fold([0.0; 2], |[a, b], [x, y]| [a + x, b + y]);
        sum.map(|s| s / self.len().max(1) as f64)
    }

    /// How far each is from the one of the same number in `start`.
    pub fn since(&self, start: &Self) -> Self {
        self.iter().zip(start.iter()).map(|(now, then)| minus(now, then)).collect()
    }

    /// Lowest and highest coordinate on each axis, over `indices`; `None` if there are none.
    pub fn bounds(&self, indices: impl IntoIterator<Item = usize>) -> Option<([f64; 2], [f64; 2])> {
        indices.into_iter().map(|i| self.get(i)).fold(None, |bounds, [x, y]| {
            let (low, high) = bounds.unwrap_or(([x, y], [x, y]));
            Some(([low[0].min(x), low[1].min(y)], [high[0].max(x), high[1].max(y)]))
        })
    }
}

impl<T: Clone> Clone for Vectors<T> {
    fn clone(&self) -> Self {
        Self { x: self.x.clone(), y: self.y.clone() }
    }

    /// Reuses the buffers, which a derived one would not: it stands in the step loop.
    fn clone_from(&mut self, source: &Self) {
        self.x.clone_from(&source.x);
        self.y.clone_from(&source.y);
    }
}

impl<T> FromIterator<[T; 2]> for Vectors<T> {
    fn from_iter<I: IntoIterator<Item = [T; 2]>>(vectors: I) -> Self {
        let (x, y) = vectors.into_iter().map(|[x, y]| (x, y)).unzip();
        Self { x, y }
    }
}
