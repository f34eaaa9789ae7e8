//! The five plane Bravais lattices and the honeycomb (the paper's Choice 1).
//!
//! Every lattice is written on one integer grid: a site `(i, j)` sits at
//! `origin + i*e1 + j*e2`, and a parity rule says which integer pairs are sites. `i` is the
//! particle's column and `j` its row, so the paper's numbering (column by column, from the
//! bottom) is the lexicographic order of sites on every lattice, whatever its orientation.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::geometry::point::bounds;

/// Integer coordinates of a site: `[column, row]`.
pub type Site = [i32; 2];

/// Which lattice, with its spacings \[length\] and angle \[rad\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LatticeKind {
    /// Bonds of one length at right angles.
    Square {
        /// Bond length.
        spacing: f64,
    },
    /// Bonds of two lengths at right angles.
    Rectangular {
        /// Bond length along x, before the lattice is turned.
        a: f64,
        /// Bond length along y, before the lattice is turned.
        b: f64,
    },
    /// Conventional cell `a` by `b` with a site at its centre.
    CentredRectangular {
        /// Width of the cell along x, before the lattice is turned.
        a: f64,
        /// Height of the cell along y, before the lattice is turned.
        b: f64,
    },
    /// Triangular lattice; one bond direction lies along x.
    Hexagonal {
        /// Bond length.
        spacing: f64,
    },
    /// Edges `a` along x and `b` at `angle` \[rad\] from it.
    Oblique {
        /// Length of the edge along x.
        a: f64,
        /// Length of the other edge.
        b: f64,
        /// Angle from the first edge to the other, counter-clockwise.
        angle: f64,
    },
    /// A hexagonal lattice with every third site missing; `spacing` is the bond length.
    Honeycomb {
        /// Bond length.
        spacing: f64,
    },
}

/// A lattice placed in the plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Lattice {
    kind: LatticeKind,
    origin: [f64; 2],
    /// Grid vectors before the lattice is turned: neighbour order must not depend on orientation.
    grid: [[f64; 2]; 2],
    e1: [f64; 2],
    e2: [f64; 2],
}

impl Lattice {
    /// `origin` is the place of site (0, 0) \[length\]; `orientation` turns the lattice about it \[rad\].
    pub fn new(kind: LatticeKind, origin: [f64; 2], orientation: f64) -> Self {
        let half_root3 = 3f64.sqrt() / 2.0;
        let (e1, e2) = match kind {
            LatticeKind::Square { spacing } => ([spacing, 0.0], [0.0, spacing]),
            LatticeKind::Rectangular { a, b } => ([a, 0.0], [0.0, b]),
            LatticeKind::CentredRectangular { a, b } => ([a / 2.0, 0.0], [0.0, b / 2.0]),
            LatticeKind::Hexagonal { spacing } | LatticeKind::Honeycomb { spacing } => {
                ([spacing / 2.0, 0.0], [0.0, spacing * half_root3])
            }
            LatticeKind::Oblique { a, b, angle } => ([a, 0.0], [b * angle.cos(), b * angle.sin()]),
        };
        Self { kind, origin, grid: [e1, e2], e1: rotate(e1, orientation), e2: rotate(e2, orientation) }
    }

    /// The same lattice `factor` times as large, about the origin of the coordinates.
    pub fn scaled(&self, factor: f64) -> Self {
        let by = |v: [f64; 2]| v.map(|v| factor * v);
        let kind = match self.kind {
            LatticeKind::Square { spacing } => LatticeKind::Square { spacing: factor * spacing },
            LatticeKind::Rectangular { a, b } => LatticeKind::Rectangular { a: factor * a, b: factor * b },
            LatticeKind::CentredRectangular { a, b } => {
                LatticeKind::CentredRectangular { a: factor * a, b: factor * b }
            }
            LatticeKind::Hexagonal { spacing } => LatticeKind::Hexagonal { spacing: factor * spacing },
            LatticeKind::Oblique { a, b, angle } => {
                LatticeKind::Oblique { a: factor * a, b: factor * b, angle }
            }
            LatticeKind::Honeycomb { spacing } => LatticeKind::Honeycomb { spacing: factor * spacing },
        };
        let (origin, grid) = (by(self.origin), self.grid.map(by));
        Self { kind, origin, grid, e1: by(self.e1), e2: by(self.e2) }
    }

    /// Kind and spacings, as the lattice was made or scaled.
    pub fn kind(&self) -> LatticeKind {
        self.kind
    }

    /// The name in scene files and messages.
    pub fn name(&self) -> &'static str {
        match self.kind {
            LatticeKind::Square { .. } => "square",
            LatticeKind::Rectangular { .. } => "rectangular",
            LatticeKind::CentredRectangular { .. } => "centred-rectangular",
            LatticeKind::Hexagonal { .. } => "hexagonal",
            LatticeKind::Oblique { .. } => "oblique",
            LatticeKind::Honeycomb { .. } => "honeycomb",
        }
    }

    /// Whether the lattice has a site at these integers: the parity rule.
    pub(crate) fn is_site(&self, [i, j]: Site) -> bool {
        match self.kind {
            LatticeKind::Square { .. } | LatticeKind::Rectangular { .. } | LatticeKind::Oblique { .. } => {
                true
            }
            LatticeKind::CentredRectangular { .. } | LatticeKind::Hexagonal { .. } => (i + j) % 2 == 0,
            LatticeKind::Honeycomb { .. } => (i + j) % 2 == 0 && honeycomb_class([i, j]) != 2,
        }
    }

    /// Sublattice of a site: 0 everywhere except on the honeycomb, whose two kinds of site see
    /// their neighbours in opposite directions.
    pub fn sublattice(&self, site: Site) -> usize {
        match self.kind {
            LatticeKind::Honeycomb { .. } => honeycomb_class(site) as usize,
            _ => 0,
        }
    }

    /// Number of sublattices: 2 on the honeycomb, else 1.
    pub fn sublattices(&self) -> usize {
        if matches!(self.kind, LatticeKind::Honeycomb { .. }) { 2 } else { 1 }
    }

    /// Where a site is \[length, world frame\].
    pub fn position(&self, site: Site) -> [f64; 2] {
        let [x, y] = self.vector(site);
        [self.origin[0] + x, self.origin[1] + y]
    }

    /// Vector from a site to the site `offset` away from it \[length\].
    pub fn vector(&self, offset: Site) -> [f64; 2] {
        combine([self.e1, self.e2], offset)
    }

    /// The integer coordinates, as reals, of a point in the plane: the inverse of
    /// [`Lattice::position`].
    pub(crate) fn grid_coordinates(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        // In units of the grid, or areas would leave the range of a double long before lengths do.
        let unit = norm(self.e1).max(norm(self.e2));
        let (dx, dy) = ((x - self.origin[0]) / unit, (y - self.origin[1]) / unit);
        let ([ax, ay], [bx, by]) = (self.e1.map(|v| v / unit), self.e2.map(|v| v / unit));
        let area = ax * by - ay * bx;
        [(dx * by - dy * bx) / area, (dy * ax - dx * ay) / area]
    }

    /// Lowest and highest grid coordinates of the rectangle between two points \[length\].
    pub(crate) fn grid_bounds(&self, (low, high): ([f64; 2], [f64; 2])) -> ([f64; 2], [f64; 2]) {
        let corners = [low, [high[0], low[1]], high, [low[0], high[1]]];
        bounds(corners.map(|corner| self.grid_coordinates(corner)))
    }

    /// Smallest distance between two sites \[length\]: the scale residuals are relative to.
    pub fn spacing(&self) -> f64 {
        self.first_neighbours(0).iter().map(|&offset| norm(self.vector(offset))).fold(f64::INFINITY, f64::min)
    }

    /// Area of the Voronoi cell of one particle \[length^2\].
    pub(crate) fn cell_area(&self) -> f64 {
        let grid_cell = (self.e1[0] * self.e2[1] - self.e1[1] * self.e2[0]).abs();
        match self.kind {
            LatticeKind::Square { .. } | LatticeKind::Rectangular { .. } | LatticeKind::Oblique { .. } => {
                grid_cell
            }
            LatticeKind::CentredRectangular { .. } | LatticeKind::Hexagonal { .. } => 2.0 * grid_cell,
            LatticeKind::Honeycomb { .. } => 3.0 * grid_cell,
        }
    }

    /// The two primitive offsets; their integer combinations are the translations of the lattice.
    pub fn primitive(&self) -> [Site; 2] {
        match self.kind {
            LatticeKind::Square { .. } | LatticeKind::Rectangular { .. } | LatticeKind::Oblique { .. } => {
                [[1, 0], [0, 1]]
            }
            LatticeKind::CentredRectangular { .. } | LatticeKind::Hexagonal { .. } => [[2, 0], [1, 1]],
            LatticeKind::Honeycomb { .. } => [[3, 1], [3, -1]],
        }
    }

    /// Offsets to the sites within `radius` \[length\] of a site of `sublattice`, nearest first. Ties in
    /// distance (1e-9 relative) are ordered in opposite pairs, by the angle of the pair and then by
    /// the angle itself, so that cutting the list at an even number keeps a Bravais neighbourhood
    /// balanced: east, west, north, south on the square.
    pub fn offsets_within(&self, sublattice: usize, radius: f64) -> Vec<Site> {
        let reach = radius * (1.0 + 1e-9);
        // A grid vector's height over the other bounds how many steps of it fit in the radius.
        let [[ax, ay], [bx, by]] = self.grid;
        let (a, b) = (norm(self.grid[0]), norm(self.grid[1]));
        let sine = ((ax / a) * (by / b) - (ay / a) * (bx / b)).abs();
        let window = |own: f64| (reach / own / sine) as i32 + 1;
        let (columns, rows) = (window(a), window(b));
        let base = self.site_of_sublattice(sublattice);
        let mut offsets: Vec<Site> = (-columns..=columns)
            .flat_map(|i| (-rows..=rows).map(move |j| [i, j]))
            .filter(|&[i, j]| (i, j) != (0, 0) && self.is_site([base[0] + i, base[1] + j]))
            .filter(|&offset| norm(combine(self.grid, offset)) <= reach)
            .collect();
        self.sort_nearest_first(&mut offsets);
        offsets
    }

    /// Sorts offsets in the neighbour order of [`Lattice::offsets_within`].
    pub(crate) fn sort_nearest_first(&self, offsets: &mut [Site]) {
        let scale = norm(self.grid[0]).min(norm(self.grid[1]));
        // Rounded, so that distances and angles that differ by rounding alone tie.
        offsets.sort_by_key(|&[i, j]| {
            let v = combine(self.grid, [i, j]);
            let angle = v[1].atan2(v[0]);
            ((norm(v) / scale * 1e9).round() as i64, rounded_angle(angle, PI), rounded_angle(angle, TAU))
        });
    }

    /// First neighbours of a site of `sublattice`, in the documented order.
    pub(crate) fn first_neighbours(&self, sublattice: usize) -> Vec<Site> {
        let mut offsets: Vec<Site> = match self.kind {
            LatticeKind::Square { .. } | LatticeKind::Rectangular { .. } => {
                vec![[1, 0], [-1, 0], [0, 1], [0, -1]]
            }
            LatticeKind::Hexagonal { .. } => vec![[2, 0], [-2, 0], [1, 1], [-1, -1], [1, -1], [-1, 1]],
            LatticeKind::CentredRectangular { a, b } => {
                let short = if a <= b { [2, 0] } else { [0, 2] };
                vec![short, [-short[0], -short[1]], [1, 1], [-1, -1], [1, -1], [-1, 1]]
            }
            LatticeKind::Oblique { .. } => self.oblique_voronoi(),
            LatticeKind::Honeycomb { spacing } => self.offsets_within(sublattice, spacing),
        };
        self.sort_nearest_first(&mut offsets);
        offsets
    }

    /// Offsets that close a frame around a body: those sharing a lattice cell with the site.
    pub(crate) fn cell_corners(&self) -> Vec<Site> {
        match self.kind {
            LatticeKind::Square { .. } | LatticeKind::Rectangular { .. } | LatticeKind::Oblique { .. } => {
                ring(&self.primitive(), 1)
            }
            _ => Vec::new(),
        }
    }

    /// A site of the given sublattice, for walking its neighbourhood.
    pub(crate) fn site_of_sublattice(&self, sublattice: usize) -> Site {
        match self.kind {
            LatticeKind::Honeycomb { .. } if sublattice == 1 => [2, 0],
            _ => [0, 0],
        }
    }

    /// Reduces the cell (Lagrange-Gauss) and takes the three shortest translation pairs, which are
    /// the Voronoi neighbours of a generic lattice.
    fn oblique_voronoi(&self) -> Vec<Site> {
        let (mut p, mut q): (Site, Site) = ([1, 0], [0, 1]);
        for _ in 0..64 {
            if norm(self.vector(p)) > norm(self.vector(q)) {
                std::mem::swap(&mut p, &mut q);
            }
            let (u, v) = (self.vector(p), self.vector(q));
            let times = ((u[0] * v[0] + u[1] * v[1]) / (u[0] * u[0] + u[1] * u[1])).round();
            let less = [0, 1].map(|k| f64::from(q[k]) - times * f64::from(p[k]));
            // Of a cell so flat that its columns cannot be counted none is nearest.
            if times == 0.0 || !less.iter().all(|columns| columns.abs() <= MOST_COLUMNS) {
                break;
            }
            q = less.map(|columns| columns as i32);
        }
        let (sum, difference) = ([p[0] + q[0], p[1] + q[1]], [p[0] - q[0], p[1] - q[1]]);
        let third = if norm(self.vector(sum)) < norm(self.vector(difference)) { sum } else { difference };
        [p, q, third].into_iter().flat_map(|s| [s, [-s[0], -s[1]]]).collect()
    }
}

/// An edge of an oblique cell is at most so many times as long as the cell is high above it.
const MOST_OBLIQUE: f64 = 1e6;

/// Columns, or rows, that a neighbour may be away: sums of some of them fit in a [`Site`].
const MOST_COLUMNS: f64 = (1 << 26) as f64;

/// All nonzero integer combinations of the primitive offsets with coefficients up to `radius`:
/// the Chebyshev ring (8 for radius 1, 24 for radius 2).
pub fn ring(primitive: &[Site; 2], radius: i32) -> Vec<Site> {
    let [p, q] = *primitive;
    (-radius..=radius)
        .flat_map(|m| (-radius..=radius).map(move |n| (m, n)))
        .filter(|&(m, n)| (m, n) != (0, 0))
        .map(|(m, n)| [m * p[0] + n * q[0], m * p[1] + n * q[1]])
        .collect()
}

/// Class of a hexagonal site modulo 3 along its axial coordinates; the honeycomb leaves class 2 empty.
fn honeycomb_class([i, j]: Site) -> i32 {
    ((i - 3 * j) / 2).rem_euclid(3)
}

fn combine([e1, e2]: [[f64; 2]; 2], [i, j]: Site) -> [f64; 2] {
    let (i, j) = (f64::from(i), f64::from(j));
    [i * e1[0] + j * e2[0], i * e1[1] + j * e2[1]]
}

fn rotate([x, y]: [f64; 2], angle: f64) -> [f64; 2] {
    // Exact at the quarter turns, where sin and cos of a rounded angle are not.
    let (sin, cos) = match angle.rem_euclid(TAU) / FRAC_PI_2 {
        0.0 => (0.0, 1.0),
        1.0 => (1.0, 0.0),
        2.0 => (0.0, -1.0),
        3.0 => (-1.0, 0.0),
        _ => angle.sin_cos(),
    };
    [cos * x - sin * y, sin * x + cos * y]
}

fn norm(v: [f64; 2]) -> f64 {
    v[0].hypot(v[1])
}

/// The angle modulo `period` in steps of 1e-9 rad.
fn rounded_angle(angle: f64, period: f64) -> i64 {
    ((angle * 1e9).round() as i64).rem_euclid((period * 1e9).round() as i64)
}

impl LatticeKind {
    /// Whether an edge of its cell is so many times as long as the cell is high above it that columns of one cannot be counted
    /// along the other.
    pub fn is_out_of_proportion(&self) -> bool {
        matches!(self, Self::Oblique { a, b, angle } if a.max(*b) > MOST_OBLIQUE * (a.min(*b) * angle.sin()))
    }

    /// One lattice of each kind, of about unit size, to try on all of them what must hold on each.
    pub const SAMPLES: [LatticeKind; 6] = [
        LatticeKind::Square { spacing: 1.0 },
        LatticeKind::Rectangular { a: 1.0, b: 1.5 },
        LatticeKind::CentredRectangular { a: 1.0, b: 1.4 },
        LatticeKind::Hexagonal { spacing: 1.0 },
        LatticeKind::Oblique { a: 1.0, b: 1.2, angle: 1.2 },
        LatticeKind::Honeycomb { spacing: 1.0 },
    ];
}

#[cfg(test)]
mod tests {
    use super::*;

    fn every_kind() -> Vec<Lattice> {
        LatticeKind::SAMPLES.map(|kind| Lattice::new(kind, [0.0, 0.0], 0.3)).to_vec()
    }

    #[test]
    fn first_neighbours_are_sites_and_balance_to_zero() {
        // As many as share an edge of the Voronoi cell, in the order of the samples.
        for (lattice, count) in every_kind().iter().zip([4, 4, 6, 6, 6, 3]) {
            for sublattice in 0..lattice.sublattices() {
                let base = lattice.site_of_sublattice(sublattice);
                assert_eq!(lattice.sublattice(base), sublattice);
                let offsets = lattice.first_neighbours(sublattice);
                assert_eq!(offsets.len(), count, "{}", lattice.name());
                let sum = offsets.iter().fold([0.0, 0.0], |sum, &offset| {
                    assert!(lattice.is_site([base[0] + offset[0], base[1] + offset[1]]));
                    let v = lattice.vector(offset);
                    [sum[0] + v[0], sum[1] + v[1]]
                });
                assert!(norm(sum) < 1e-14, "{}: {sum:?}", lattice.name());
            }
        }
    }

    #[test]
    fn square_neighbours_come_in_opposite_pairs() {
        let lattice = Lattice::new(LatticeKind::Square { spacing: 2.0 }, [0.0, 0.0], 1.0);
        assert_eq!(lattice.first_neighbours(0), [[1, 0], [-1, 0], [0, 1], [0, -1]]);
        assert_eq!(lattice.offsets_within(0, 2.0), [[1, 0], [-1, 0], [0, 1], [0, -1]]);
    }

    #[test]
    fn spacing_is_the_distance_of_the_nearest_site() {
        let expected = [1.0, 1.0, (0.25f64 + 0.49).sqrt(), 1.0, 1.0, 1.0];
        for (lattice, expected) in every_kind().iter().zip(expected) {
            assert!((lattice.spacing() - expected).abs() < 1e-12, "{}", lattice.name());
        }
    }

    #[test]
    fn quarter_turns_are_exact() {
        let turned = Lattice::new(LatticeKind::Square { spacing: 1.0 }, [0.0, 0.0], FRAC_PI_2);
        assert_eq!(turned.position([3, 0]), [0.0, 3.0]);
    }
}
