//! The quadratic triangle: shape functions, their derivatives, quadrature, and the map to the plane.
//!
//! The reference cell is the triangle (0,0), (1,0), (0,1). Nodes are listed counter-clockwise: corners first, then the
//! middle of each side in the same order; sides may be curved.
//! Shape functions: Zienkiewicz, Taylor and Zhu, "The Finite Element Method: Its Basis and
//! Fundamentals", 7th ed. (2013), section 6.2.3.

/// Nodes of a cell.
pub(crate) const NODES: usize = 6;

/// Corners, and as many sides.
pub(crate) const CORNERS: usize = 3;

/// A pair of each node of a cell: its position, its displacement.
pub(crate) type Pairs = [[f64; 2]; NODES];

/// Gauss-Legendre points and weights on [-1, 1], 3 and 5 points
/// (Abramowitz and Stegun, table 25.4); n points integrate degree 2n - 1 exactly.
pub(crate) const GAUSS_3: [[f64; 2]; 3] =
    [[-0.774_596_669_241_483_4, 5.0 / 9.0], [0.0, 8.0 / 9.0], [0.774_596_669_241_483_4, 5.0 / 9.0]];
const GAUSS_5: [[f64; 2]; 5] = [
    [-0.906_179_845_938_664, 0.236_926_885_056_189_1],
    [-0.538_469_310_105_683_1, 0.478_628_670_499_366_5],
    [0.0, 0.568_888_888_888_888_9],
    [0.538_469_310_105_683_1, 0.478_628_670_499_366_5],
    [0.906_179_845_938_664, 0.236_926_885_056_189_1],
];

/// Reference coordinates of the nodes.
pub(crate) const REFERENCE_NODES: Pairs =
    [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]];

/// Reference coordinates of the middle.
pub(crate) const CENTRE: [f64; 2] = [1.0 / 3.0; 2];

/// Local numbers of the nodes on side `side`, which runs from corner `side` to the next one
/// counter-clockwise: start, end and middle.
pub(crate) fn side_nodes(side: usize) -> [usize; 3] {
    [side, (side + 1) % CORNERS, CORNERS + side]
}

/// Whether a reference point lies in the reference cell, to within `slack`.
pub(crate) fn contains([xi, eta]: [f64; 2], slack: f64) -> bool {
    xi >= -slack && eta >= -slack && xi + eta <= 1.0 + slack
}

/// A point of the reference cell near to a reference point, itself if it is in the cell.
pub(crate) fn clamped([xi, eta]: [f64; 2]) -> [f64; 2] {
    let [xi, eta] = [xi.max(0.0), eta.max(0.0)];
    let beyond = (xi + eta - 1.0).max(0.0);
    let xi = (xi - 0.5 * beyond).clamp(0.0, 1.0);
    [xi, eta.min(1.0 - xi)]
}

/// Quadrature points with the shape functions there, computed once for all cells of a mesh.
#[derive(Debug, Clone)]
pub(crate) struct Rule {
    pub points: Vec<(Shape, f64)>,
}

impl Rule {
    fn at(points: impl IntoIterator<Item = ([f64; 2], f64)>) -> Rule {
        Rule { points: points.into_iter().map(|(p, w)| (Shape::at(p), w)).collect() }
    }

    /// Points and weights that integrate the stiffness of a straight-sided cell exactly: six points, degree 4
    /// (D. A. Dunavant, Int. J. Numer. Meth. Engng 21 (1985) 1129-1148).
    pub(crate) fn of_stiffness() -> Rule {
        let orbits = [
            (0.445_948_490_915_964_9, 0.223_381_589_678_011_47),
            (0.091_576_213_509_770_74, 0.109_951_743_655_321_87),
        ];
        let orbit =
            |(a, w): (f64, f64)| [[a, a], [1.0 - 2.0 * a, a], [a, 1.0 - 2.0 * a]].map(|p| (p, 0.5 * w));
        Rule::at(orbits.into_iter().flat_map(orbit))
    }

    /// Points and weights of degree 8, for integrals against a field that is no polynomial.
    pub(crate) fn fine() -> Rule {
        let square = GAUSS_5.iter().flat_map(|b| GAUSS_5.iter().map(|a| ([a[0], b[0]], a[1] * b[1])));
        // Duffy's map of the square onto the triangle: (a, b) -> (a, (1 - a) b).
        Rule::at(square.map(|([s, t], w)| {
            let (a, b) = (0.5 * (1.0 + s), 0.5 * (1.0 + t));
            ([a, (1.0 - a) * b], 0.25 * w * (1.0 - a))
        }))
    }

    /// Points where the stress of a finite-element solution is most accurate (J. Barlow, Int. J. Numer. Meth. Engng 10
    /// (1976) 243-251).
    pub(crate) fn of_stress() -> Rule {
        let (a, b) = (1.0 / 6.0, 2.0 / 3.0);
        Rule::at([[a, a], [b, a], [a, b]].map(|p| (p, a)))
    }

    /// The middle of the cell.
    pub(crate) fn of_centre() -> Rule {
        Rule::at([(CENTRE, 0.5)])
    }
}

/// Value and derivative at `s` of the quadratic function that is 1 at `node` (-1, 0 or 1).
fn line_quadratic(node: f64, s: f64) -> [f64; 2] {
    if node == 0.0 { [1.0 - s * s, -2.0 * s] } else { [0.5 * s * (s + node), s + 0.5 * node] }
}

/// Values and derivatives on a side at `s` in [-1, 1], in the order start, end, middle.
pub(crate) fn side_shape(s: f64) -> [[f64; 2]; 3] {
    [-1.0, 1.0, 0.0].map(|node| line_quadratic(node, s))
}

/// Shape functions N and their derivatives along xi and eta at one reference point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shape {
    pub n: [f64; NODES],
    pub dxi: [f64; NODES],
    pub deta: [f64; NODES],
}

/// The isoparametric map at one point: determinant of the Jacobian, and dN/dx, dN/dy [1/m].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gradient {
    pub det: f64,
    pub dx: [f64; NODES],
    pub dy: [f64; NODES],
}

impl Shape {
    /// At a reference point: corner l (2 l - 1), side 4 l m, with l, m the area coordinates.
    pub fn at([xi, eta]: [f64; 2]) -> Shape {
        let (l, dxi, deta) = ([1.0 - xi - eta, xi, eta], [-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]);
        let mut s = Shape { n: [0.0; NODES], dxi: [0.0; NODES], deta: [0.0; NODES] };
        for a in 0..CORNERS {
            let b = (a + 1) % CORNERS;
            s.n[a] = l[a] * (2.0 * l[a] - 1.0);
            s.dxi[a] = (4.0 * l[a] - 1.0) * dxi[a];
            s.deta[a] = (4.0 * l[a] - 1.0) * deta[a];
            s.n[CORNERS + a] = 4.0 * l[a] * l[b];
            s.dxi[CORNERS + a] = 4.0 * (dxi[a] * l[b] + l[a] * dxi[b]);
            s.deta[CORNERS + a] = 4.0 * (deta[a] * l[b] + l[a] * deta[b]);
        }
        s
    }

    /// The Jacobian [[dx/dxi, dx/deta], [dy/dxi, dy/deta]] for node positions `at`.
    pub fn jacobian(&self, at: &Pairs) -> [[f64; 2]; 2] {
        let mut j = [[0.0; 2]; 2];
        for (a, p) in at.iter().enumerate() {
            for i in 0..2 {
                j[i][0] += self.dxi[a] * p[i];
                j[i][1] += self.deta[a] * p[i];
            }
        }
        j
    }

    /// Determinant of the Jacobian.
    pub fn determinant(&self, at: &Pairs) -> f64 {
        let j = self.jacobian(at);
        j[0][0] * j[1][1] - j[0][1] * j[1][0]
    }

    /// Derivatives along x and y by the chain rule.
    pub fn gradient(&self, at: &Pairs) -> Gradient {
        let j = self.jacobian(at);
        let det = j[0][0] * j[1][1] - j[0][1] * j[1][0];
        let dx = |a: usize| (j[1][1] * self.dxi[a] - j[1][0] * self.deta[a]) / det;
        let dy = |a: usize| (j[0][0] * self.deta[a] - j[0][1] * self.dxi[a]) / det;
        Gradient { det, dx: std::array::from_fn(dx), dy: std::array::from_fn(dy) }
    }

    /// Interpolates a pair of each node.
    pub fn interpolate(&self, values: &Pairs) -> [f64; 2] {
        let mut sum = [0.0; 2];
        for (n, v) in self.n.iter().zip(values) {
            sum[0] += n * v[0];
            sum[1] += n * v[1];
        }
        sum
    }
}

impl Gradient {
    /// Gradient (xx, xy, yx, yy) of nodal displacements.
    pub fn of(&self, u: &Pairs) -> [f64; 4] {
        let mut h = [0.0; 4];
        // Relative to the first node: a translation must not cost digits.
        for (a, v) in u.iter().enumerate() {
            let u = [v[0] - u[0][0], v[1] - u[0][1]];
            let [dx, dy] = [self.dx[a], self.dy[a]];
            h = [h[0] + dx * u[0], h[1] + dy * u[0], h[2] + dx * u[1], h[3] + dy * u[1]];
        }
        h
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shape_functions_are_one_at_their_node_and_zero_at_the_others() {
        for (a, &p) in REFERENCE_NODES.iter().enumerate() {
            let s = Shape::at(p);
            for b in 0..NODES {
                assert!((s.n[b] - f64::from(a == b)).abs() < 1e-15, "{a} {b}");
            }
        }
    }

    #[test]
    fn derivatives_agree_with_central_differences() {
        let (p, h) = ([0.31, 0.17], 1e-6);
        let s = Shape::at(p);
        for a in 0..NODES {
            let along = |dx: f64, dy: f64| {
                (Shape::at([p[0] + dx, p[1] + dy]).n[a] - Shape::at([p[0] - dx, p[1] - dy]).n[a]) / (2.0 * h)
            };
            assert!((s.dxi[a] - along(h, 0.0)).abs() < 1e-9, "{a}");
            assert!((s.deta[a] - along(0.0, h)).abs() < 1e-9, "{a}");
        }
    }

    /// The integral of xi^i eta^j over the reference triangle is i! j! / (i + j + 2)!.
    #[test]
    fn quadrature_is_exact_to_its_stated_degree() {
        let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
        for (rule, degree) in [(Rule::of_stiffness(), 4), (Rule::fine(), 8)] {
            for (i, j) in (0..=degree).flat_map(|i| (0..=degree - i).map(move |j| (i, j))) {
                let f = |s: &Shape| s.interpolate(&REFERENCE_NODES);
                let sum: f64 = rule.points.iter().map(|(s, w)| w * f(s)[0].powi(i) * f(s)[1].powi(j)).sum();
                let exact = factorial(i) * factorial(j) / factorial(i + j + 2);
                assert!((sum - exact).abs() < 1e-14, "xi^{i} eta^{j}");
            }
        }
    }
}
