//! The four cell kinds: shape functions, their derivatives, quadrature, and the map to the plane.
//!
//! Reference cells: the triangle (0,0), (1,0), (0,1) and the square [-1, 1] x [-1, 1]. Nodes are listed
//! counter-clockwise: corners first, then the middle of each side in the same order, then the centre.
//! Shape functions: Zienkiewicz, Taylor and Zhu, "The Finite Element Method: Its Basis and
//! Fundamentals", 7th ed. (2013), sections 6.2 (Lagrange quadrilaterals) and 6.2.3 (triangles).

/// Most nodes a cell can have.
pub(crate) const MAX_NODES: usize = 9;

/// Gauss-Legendre points and weights on [-1, 1], 1 to 3 points and 5 points
/// (Abramowitz and Stegun, table 25.4); n points integrate degree 2n - 1 exactly.
const GAUSS_1: [[f64; 2]; 1] = [[0.0, 2.0]];
const GAUSS_2: [[f64; 2]; 2] = [[-0.577_350_269_189_625_8, 1.0], [0.577_350_269_189_625_8, 1.0]];
pub(crate) const GAUSS_3: [[f64; 2]; 3] =
    [[-0.774_596_669_241_483_4, 5.0 / 9.0], [0.0, 8.0 / 9.0], [0.774_596_669_241_483_4, 5.0 / 9.0]];
const GAUSS_5: [[f64; 2]; 5] = [
    [-0.906_179_845_938_664, 0.236_926_885_056_189_1],
    [-0.538_469_310_105_683_1, 0.478_628_670_499_366_5],
    [0.0, 0.568_888_888_888_888_9],
    [0.538_469_310_105_683_1, 0.478_628_670_499_366_5],
    [0.906_179_845_938_664, 0.236_926_885_056_189_1],
];

const TRIANGLE_NODES: [[f64; 2]; 6] =
    [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]];
const SQUARE_NODES: [[f64; 2]; 9] = [
    [-1.0, -1.0],
    [1.0, -1.0],
    [1.0, 1.0],
    [-1.0, 1.0],
    [0.0, -1.0],
    [1.0, 0.0],
    [0.0, 1.0],
    [-1.0, 0.0],
    [0.0, 0.0],
];

/// The shape of a cell and the degree of its displacement.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CellKind {
    /// Triangle, linear, 3 nodes: constant strain. Locks in bending and near incompressibility.
    Tri3,
    /// Triangle, quadratic, 6 nodes; sides may be curved.
    Tri6,
    /// Quadrilateral, bilinear, 4 nodes, fully integrated.
    Quad4,
    /// Quadrilateral, biquadratic (Lagrange), 9 nodes; sides may be curved.
    Quad9,
}

impl CellKind {
    /// All kinds.
    pub const ALL: [CellKind; 4] = [CellKind::Tri3, CellKind::Tri6, CellKind::Quad4, CellKind::Quad9];

    /// Nodes per cell: 3, 6, 4 or 9.
    pub const fn nodes(self) -> usize {
        match self {
            CellKind::Tri3 => 3,
            CellKind::Tri6 => 6,
            CellKind::Quad4 => 4,
            CellKind::Quad9 => 9,
        }
    }

    /// Corners, and as many sides: 3 or 4.
    pub const fn corners(self) -> usize {
        match self {
            CellKind::Tri3 | CellKind::Tri6 => 3,
            CellKind::Quad4 | CellKind::Quad9 => 4,
        }
    }

    /// Degree of the displacement along a side: 1 or 2.
    pub const fn degree(self) -> usize {
        match self {
            CellKind::Tri3 | CellKind::Quad4 => 1,
            CellKind::Tri6 | CellKind::Quad9 => 2,
        }
    }

    /// Local numbers of the nodes on side `side`, which runs from corner `side` to the next one
    /// counter-clockwise: start, end and, for the quadratic kinds, middle.
    pub(crate) fn side_nodes(self, side: usize) -> impl Iterator<Item = usize> {
        let n = self.corners();
        [side, (side + 1) % n, n + side].into_iter().take(self.degree() + 1)
    }

    /// Reference coordinates of the nodes, shape \[nodes\].
    pub(crate) fn reference_nodes(self) -> &'static [[f64; 2]] {
        match self.corners() {
            3 => &TRIANGLE_NODES[..self.nodes()],
            _ => &SQUARE_NODES[..self.nodes()],
        }
    }

    /// Reference coordinates of the centre: where the stress of a cell is reported.
    pub(crate) fn reference_centre(self) -> [f64; 2] {
        if self.corners() == 3 { [1.0 / 3.0; 2] } else { [0.0; 2] }
    }

    /// Whether a reference point lies in the reference cell, to within `slack`.
    pub(crate) fn contains(self, [xi, eta]: [f64; 2], slack: f64) -> bool {
        if self.corners() == 3 {
            xi >= -slack && eta >= -slack && xi + eta <= 1.0 + slack
        } else {
            xi.abs() <= 1.0 + slack && eta.abs() <= 1.0 + slack
        }
    }

    /// A point of the reference cell near to a reference point, itself if it is in the cell.
    pub(crate) fn clamped(self, [xi, eta]: [f64; 2]) -> [f64; 2] {
        if self.corners() == 4 {
            return [xi.clamp(-1.0, 1.0), eta.clamp(-1.0, 1.0)];
        }
        let [xi, eta] = [xi.max(0.0), eta.max(0.0)];
        let beyond = (xi + eta - 1.0).max(0.0);
        let xi = (xi - 0.5 * beyond).clamp(0.0, 1.0);
        [xi, eta.min(1.0 - xi)]
    }

    /// Shape functions and derivatives at a reference point.
    pub(crate) fn shape(self, [xi, eta]: [f64; 2]) -> Shape {
        match self {
            CellKind::Tri3 => triangle_linear(xi, eta),
            CellKind::Tri6 => triangle_quadratic(xi, eta),
            CellKind::Quad4 => square(xi, eta, line_linear, 4),
            CellKind::Quad9 => square(xi, eta, line_quadratic, 9),
        }
    }

    /// Points and weights that integrate the stiffness of a straight-sided, parallelogram cell exactly.
    pub(crate) fn stiffness_rule(self) -> Rule {
        match self {
            CellKind::Tri3 => self.centre_rule(),
            CellKind::Tri6 => Rule::at(self, triangle_degree_4()),
            CellKind::Quad4 => Rule::at(self, square_product(&GAUSS_2)),
            CellKind::Quad9 => Rule::at(self, square_product(&GAUSS_3)),
        }
    }

    /// Points and weights of degree 8 and more, for integrals against a field that is no polynomial.
    pub(crate) fn fine_rule(self) -> Rule {
        if self.corners() == 4 {
            return Rule::at(self, square_product(&GAUSS_5));
        }
        // Duffy's map of the square onto the triangle: (a, b) -> (a, (1 - a) b).
        let points = square_product(&GAUSS_5).into_iter().map(|([s, t], w)| {
            let (a, b) = (0.5 * (1.0 + s), 0.5 * (1.0 + t));
            ([a, (1.0 - a) * b], 0.25 * w * (1.0 - a))
        });
        Rule::at(self, points.collect())
    }

    /// Points where the stress of a finite-element solution is most accurate (Barlow's points): one for
    /// the linear kinds, three (triangle) or 2 x 2 (square) for the quadratic ones.
    /// Source: J. Barlow, Int. J. Numer. Meth. Engng 10 (1976) 243-251.
    pub(crate) fn stress_rule(self) -> Rule {
        match self {
            CellKind::Tri3 | CellKind::Quad4 => self.centre_rule(),
            CellKind::Tri6 => {
                let (a, b) = (1.0 / 6.0, 2.0 / 3.0);
                Rule::at(self, [[a, a], [b, a], [a, b]].map(|p| (p, a)).to_vec())
            }
            CellKind::Quad9 => Rule::at(self, square_product(&GAUSS_2)),
        }
    }

    /// The middle of the cell.
    pub(crate) fn centre_rule(self) -> Rule {
        match self.corners() {
            4 => Rule::at(self, square_product(&GAUSS_1)),
            _ => Rule::at(self, vec![([1.0 / 3.0; 2], 0.5)]),
        }
    }
}

/// Shape functions N and their derivatives along xi and eta at one reference point; entries past the
/// number of nodes are zero.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shape {
    pub n: [f64; MAX_NODES],
    pub dxi: [f64; MAX_NODES],
    pub deta: [f64; MAX_NODES],
}

/// Quadrature points with the shape functions there, computed once for all cells of a mesh.
#[derive(Debug, Clone)]
pub(crate) struct Rule {
    pub points: Vec<(Shape, f64)>,
}

impl Rule {
    fn at(kind: CellKind, points: Vec<([f64; 2], f64)>) -> Rule {
        Rule { points: points.into_iter().map(|(p, w)| (kind.shape(p), w)).collect() }
    }
}

fn square_product(line: &[[f64; 2]]) -> Vec<([f64; 2], f64)> {
    line.iter().flat_map(|b| line.iter().map(|a| ([a[0], b[0]], a[1] * b[1]))).collect()
}

/// Six points, degree 4: D. A. Dunavant, Int. J. Numer. Meth. Engng 21 (1985) 1129-1148.
fn triangle_degree_4() -> Vec<([f64; 2], f64)> {
    let orbits = [
        (0.445_948_490_915_964_9, 0.223_381_589_678_011_47),
        (0.091_576_213_509_770_74, 0.109_951_743_655_321_87),
    ];
    let orbit = |(a, w): (f64, f64)| [[a, a], [1.0 - 2.0 * a, a], [a, 1.0 - 2.0 * a]].map(|p| (p, 0.5 * w));
    orbits.into_iter().flat_map(orbit).collect()
}

fn triangle_linear(xi: f64, eta: f64) -> Shape {
    let mut s = Shape { n: [0.0; MAX_NODES], dxi: [0.0; MAX_NODES], deta: [0.0; MAX_NODES] };
    s.n[..3].copy_from_slice(&[1.0 - xi - eta, xi, eta]);
    s.dxi[..3].copy_from_slice(&[-1.0, 1.0, 0.0]);
    s.deta[..3].copy_from_slice(&[-1.0, 0.0, 1.0]);
    s
}

/// Corner l (2 l - 1), side 4 l m, with l, m the area coordinates.
fn triangle_quadratic(xi: f64, eta: f64) -> Shape {
    let linear = triangle_linear(xi, eta);
    let mut s = linear;
    for a in 0..3 {
        let (b, l) = ((a + 1) % 3, &linear);
        s.n[a] = l.n[a] * (2.0 * l.n[a] - 1.0);
        s.dxi[a] = (4.0 * l.n[a] - 1.0) * l.dxi[a];
        s.deta[a] = (4.0 * l.n[a] - 1.0) * l.deta[a];
        s.n[3 + a] = 4.0 * l.n[a] * l.n[b];
        s.dxi[3 + a] = 4.0 * (l.dxi[a] * l.n[b] + l.n[a] * l.dxi[b]);
        s.deta[3 + a] = 4.0 * (l.deta[a] * l.n[b] + l.n[a] * l.deta[b]);
    }
    s
}

/// Value and derivative at `s` of the linear function that is 1 at `node` (-1 or 1).
fn line_linear(node: f64, s: f64) -> [f64; 2] {
    [0.5 * (1.0 + node * s), 0.5 * node]
}

/// Value and derivative at `s` of the quadratic function that is 1 at `node` (-1, 0 or 1).
fn line_quadratic(node: f64, s: f64) -> [f64; 2] {
    if node == 0.0 { [1.0 - s * s, -2.0 * s] } else { [0.5 * s * (s + node), s + 0.5 * node] }
}

fn square(xi: f64, eta: f64, line: fn(f64, f64) -> [f64; 2], nodes: usize) -> Shape {
    let mut s = Shape { n: [0.0; MAX_NODES], dxi: [0.0; MAX_NODES], deta: [0.0; MAX_NODES] };
    for (a, node) in SQUARE_NODES[..nodes].iter().enumerate() {
        let ([f, df], [g, dg]) = (line(node[0], xi), line(node[1], eta));
        (s.n[a], s.dxi[a], s.deta[a]) = (f * g, df * g, f * dg);
    }
    s
}

/// Values and derivatives on a side at `s` in [-1, 1], in the order start, end, middle.
pub(crate) fn side_shape(degree: usize, s: f64) -> [[f64; 2]; 3] {
    if degree == 1 {
        [line_linear(-1.0, s), line_linear(1.0, s), [0.0; 2]]
    } else {
        [line_quadratic(-1.0, s), line_quadratic(1.0, s), line_quadratic(0.0, s)]
    }
}

/// The isoparametric map at one point: determinant of the Jacobian, and dN/dx, dN/dy [1/m].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gradient {
    pub det: f64,
    pub dx: [f64; MAX_NODES],
    pub dy: [f64; MAX_NODES],
}

impl Shape {
    /// The Jacobian [[dx/dxi, dx/deta], [dy/dxi, dy/deta]] for node positions `at`, shape \[nodes\].
    pub fn jacobian(&self, at: &[[f64; 2]]) -> [[f64; 2]; 2] {
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
    pub fn determinant(&self, at: &[[f64; 2]]) -> f64 {
        let j = self.jacobian(at);
        j[0][0] * j[1][1] - j[0][1] * j[1][0]
    }

    /// Derivatives along x and y by the chain rule.
    pub fn gradient(&self, at: &[[f64; 2]]) -> Gradient {
        let j = self.jacobian(at);
        let det = j[0][0] * j[1][1] - j[0][1] * j[1][0];
        let mut g = Gradient { det, dx: [0.0; MAX_NODES], dy: [0.0; MAX_NODES] };
        for a in 0..at.len() {
            g.dx[a] = (j[1][1] * self.dxi[a] - j[1][0] * self.deta[a]) / det;
            g.dy[a] = (j[0][0] * self.deta[a] - j[0][1] * self.dxi[a]) / det;
        }
        g
    }

    /// Interpolates a pair per node, shape \[nodes\].
    pub fn interpolate(&self, values: &[[f64; 2]]) -> [f64; 2] {
        let mut sum = [0.0; 2];
        for (n, v) in self.n.iter().zip(values) {
            sum[0] += n * v[0];
            sum[1] += n * v[1];
        }
        sum
    }
}

impl Gradient {
    /// Gradient (xx, xy, yx, yy) of nodal displacements `u`, shape \[nodes\].
    pub fn of(&self, u: &[[f64; 2]]) -> [f64; 4] {
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
        for kind in CellKind::ALL {
            for (a, &p) in kind.reference_nodes().iter().enumerate() {
                let s = kind.shape(p);
                for b in 0..MAX_NODES {
                    assert!((s.n[b] - f64::from(a == b)).abs() < 1e-15, "{kind:?} {a} {b}");
                }
            }
        }
    }

    #[test]
    fn derivatives_agree_with_central_differences() {
        let (p, h) = ([0.31, 0.17], 1e-6);
        for kind in CellKind::ALL {
            let s = kind.shape(p);
            for a in 0..kind.nodes() {
                let along = |dx: f64, dy: f64| {
                    (kind.shape([p[0] + dx, p[1] + dy]).n[a] - kind.shape([p[0] - dx, p[1] - dy]).n[a])
                        / (2.0 * h)
                };
                assert!((s.dxi[a] - along(h, 0.0)).abs() < 1e-9, "{kind:?}");
                assert!((s.deta[a] - along(0.0, h)).abs() < 1e-9, "{kind:?}");
            }
        }
    }

    /// Integral of xi^i eta^j over the reference triangle is i! j! / (i + j + 2)!; over the square the
    /// product of 2 / (i + 1) for even powers.
    fn exact(kind: CellKind, i: i32, j: i32) -> f64 {
        let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
        let line = |i: i32| if i % 2 == 0 { 2.0 / f64::from(i + 1) } else { 0.0 };
        if kind.corners() == 3 {
            factorial(i) * factorial(j) / factorial(i + j + 2)
        } else {
            line(i) * line(j)
        }
    }

    #[test]
    fn quadrature_is_exact_to_its_stated_degree() {
        for kind in CellKind::ALL {
            let degree = match kind {
                CellKind::Tri3 => 1,
                CellKind::Tri6 => 4,
                CellKind::Quad4 => 3,
                CellKind::Quad9 => 5,
            };
            for (rule, degree) in [(kind.stiffness_rule(), degree), (kind.fine_rule(), 8)] {
                for (i, j) in (0..=degree).flat_map(|i| (0..=degree - i).map(move |j| (i, j))) {
                    let straight = CellKind::reference_nodes(kind);
                    let f = |s: &Shape| s.interpolate(straight);
                    let sum: f64 =
                        rule.points.iter().map(|(s, w)| w * f(s)[0].powi(i) * f(s)[1].powi(j)).sum();
                    assert!((sum - exact(kind, i, j)).abs() < 1e-14, "{kind:?} xi^{i} eta^{j}");
                }
            }
        }
    }
}
