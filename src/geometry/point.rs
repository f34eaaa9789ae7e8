//! Places in the plane and vectors between them.

/// A place in the plane, or a vector \[length\].
pub type Point = [f64; 2];

/// The sum of two vectors.
#[inline]
pub fn plus(a: Point, b: Point) -> Point {
    [a[0] + b[0], a[1] + b[1]]
}

/// The way to `a` from `b`.
#[inline]
pub fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

/// The scalar product.
#[inline]
pub fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// The area that two vectors span, positive where the second lies to the left of the first.
#[inline]
pub fn cross(a: Point, b: Point) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// Area of a polygon, positive if its corners run counter-clockwise.
pub fn area<'a>(corners: impl IntoIterator<Item = &'a Point, IntoIter: Clone>) -> f64 {
    let corners = corners.into_iter();
    // About the first corner: far from the origin of the coordinates no digits are lost.
    let o = corners.clone().next().copied().unwrap_or_default();
    let off = corners.map(|&p| minus(p, o));
    off.clone().zip(off.skip(1)).map(|(a, b)| 0.5 * cross(a, b)).sum()
}

/// Euclidean distance; `hypot`, so that coordinates near 1e±150 neither overflow nor vanish.
#[inline]
pub fn distance(a: Point, b: Point) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Lowest and highest coordinates of points.
pub fn bounds(points: impl IntoIterator<Item = Point>) -> (Point, Point) {
    points.into_iter().fold(([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]), |(low, high), p| {
        ([low[0].min(p[0]), low[1].min(p[1])], [high[0].max(p[0]), high[1].max(p[1])])
    })
}
