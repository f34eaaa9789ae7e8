//! Positions as parallel arrays: the one layout every sweep, recorder and transport reads.

/// Points in the plane [length unit of the scene, world frame], shape \[count\] each.
///
/// Parallel arrays rather than an array of pairs, so that a sweep streams one coordinate at a
/// time and the compiler can vectorise it.
#[derive(Debug, Default, PartialEq)]
pub struct Points {
    pub x: Vec<f64>,
    pub y: Vec<f64>,
}

impl Points {
    /// `count` points at the origin.
    pub fn zeros(count: usize) -> Self {
        Self { x: vec![0.0; count], y: vec![0.0; count] }
    }

    pub fn len(&self) -> usize {
        self.x.len()
    }

    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    pub fn get(&self, index: usize) -> [f64; 2] {
        [self.x[index], self.y[index]]
    }

    pub fn set(&mut self, index: usize, point: [f64; 2]) {
        self.x[index] = point[0];
        self.y[index] = point[1];
    }

    pub fn push(&mut self, point: [f64; 2]) {
        self.x.push(point[0]);
        self.y.push(point[1]);
    }

    pub fn iter(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        self.x.iter().zip(&self.y).map(|(&x, &y)| [x, y])
    }

    /// The mean of all; the origin if there are none.
    pub fn middle(&self) -> [f64; 2] {
        let sum = self.iter().fold([0.0; 2], |[a, b], [x, y]| [a + x, b + y]);
        sum.map(|s| s / self.len().max(1) as f64)
    }

    /// Lowest and highest coordinate on each axis, over `indices`; `None` if there are none.
    pub fn bounds(&self, indices: impl IntoIterator<Item = usize>) -> Option<([f64; 2], [f64; 2])> {
        indices.into_iter().map(|i| self.get(i)).fold(None, |bounds, [x, y]| {
            let (low, high) = bounds.unwrap_or(([x, y], [x, y]));
            Some(([low[0].min(x), low[1].min(y)], [high[0].max(x), high[1].max(y)]))
        })
    }
}

impl Clone for Points {
    fn clone(&self) -> Self {
        Self { x: self.x.clone(), y: self.y.clone() }
    }

    /// Reuses the buffers, which a derived one would not: it stands in the step loop.
    fn clone_from(&mut self, source: &Self) {
        self.x.clone_from(&source.x);
        self.y.clone_from(&source.y);
    }
}

impl FromIterator<[f64; 2]> for Points {
    fn from_iter<I: IntoIterator<Item = [f64; 2]>>(points: I) -> Self {
        let (x, y) = points.into_iter().map(|[x, y]| (x, y)).unzip();
        Self { x, y }
    }
}

/// Euclidean distance; `hypot`, so that coordinates near 1e±150 neither overflow nor vanish.
pub fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}
