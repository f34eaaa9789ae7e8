//! 2x2 matrices by rows: weights that turn and couple the components of a position.

/// `block[a][b]` takes component `b` of a neighbour to component `a` of the particle.
pub type Block = [[f64; 2]; 2];

/// The block that changes no vector.
pub(crate) const IDENTITY: Block = [[1.0, 0.0], [0.0, 1.0]];

/// `block * vector`.
#[inline]
pub fn apply(block: &Block, [x, y]: [f64; 2]) -> [f64; 2] {
    [block[0][0] * x + block[0][1] * y, block[1][0] * x + block[1][1] * y]
}

/// `a + b`.
#[inline]
pub fn plus(a: &Block, b: &Block) -> Block {
    [[a[0][0] + b[0][0], a[0][1] + b[0][1]], [a[1][0] + b[1][0], a[1][1] + b[1][1]]]
}

/// `a * b`.
#[inline]
pub fn product(a: &Block, b: &Block) -> Block {
    let (left, right) = (apply(a, [b[0][0], b[1][0]]), apply(a, [b[0][1], b[1][1]]));
    [[left[0], right[0]], [left[1], right[1]]]
}

/// Rows become columns.
#[inline]
pub fn transposed([[a, b], [c, d]]: Block) -> Block {
    [[a, c], [b, d]]
}

/// The inverse of a positive definite block; `None` where it is singular to the precision of a double.
#[inline]
pub fn inverse(block: &Block) -> Option<Block> {
    let [[a, b], [c, d]] = *block;
    // Scaled first, so that no product of two stiffnesses over- or underflows.
    let scale = a.abs().max(d.abs());
    let [a, b, c, d] = [a, b, c, d].map(|entry| entry / scale);
    let determinant = a * d - b * c;
    let regular = a > 0.0 && determinant > 1e-14;
    regular.then(|| [[d, -b], [-c, a]].map(|row| row.map(|entry| entry / determinant / scale)))
}
