//! From weights to the material that they are.
//!
//! An infinite lattice with the weights of an interior particle carries waves `u e^(i k.x)`. Its symbol
//! `S(k) = sum_j K_j (1 - e^(i k.r_j))` is what a wave costs; for long waves it is a continuum:
//!
//! * the `k^2` term is the acoustic tensor `A(k)_ac = C_abcd k_b k_d` of a stiffness `C` (M. Born and
//!   K. Huang, *Dynamical Theory of Crystal Lattices*, ch. V);
//! * the `k^4` term is the first gradient correction, `S = A k^2 (1 + l^2 k^2 + ...)`; `l^2 > 0`
//!   stiffens short waves (a second-gradient material), `l^2 < 0` softens them. For a chain with weights
//!   `w1`, `w2` at distances `a`, `2a`: `A = a^2 (w1 + 4 w2)`,
//!   `l^2 = -a^2 (w1 + 16 w2) / (12 (w1 + 4 w2))`.
//!
//! On the honeycomb, two particles to a lattice cell, the long wave is their mean displacement and
//! their difference takes whatever value costs least.
//!
//! A symmetric rule determines the acoustic tensor and no more. That is six constants if the stress is
//! symmetric; a scalar rule on a lattice of less than four-fold symmetry has an acoustic tensor that
//! belongs to no such stress, which [`Effective::misfit`] reports.

use std::collections::BTreeMap;

use nalgebra::{Complex, DMatrix, Matrix2, Matrix3, Vector2, Vector3};
use serde::Serialize;

use super::Block;
use super::cells::{Cells, templates};
use super::elastic::{Elastic, Voigt, mandel};
use super::stiffness::ShapeError;
use super::weights::{WeightsError, bonds_of};
use crate::flock::lattice::{Lattice, Site, ring};

/// A neighbour of an interior particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bond {
    /// From the particle to the neighbour \[length\].
    pub vector: [f64; 2],
    /// Sublattice of the neighbour.
    pub to: usize,
    /// `K_ij` \[force / length\], or `w_ij` times the identity \[1\] for a scalar rule.
    pub block: Block,
}

/// An infinite lattice and its weights.
#[derive(Clone, Debug, PartialEq)]
pub struct Crystal {
    /// Bonds of one particle of each sublattice, shape \[sublattices\]\[neighbours\].
    pub bonds: Vec<Vec<Bond>>,
    /// Translations of the lattice \[length\].
    pub primitive: [[f64; 2]; 2],
}

/// Why weights have no effective material.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HomogeniseError {
    /// A neighbour does not see a particle back with the transposed weight.
    #[error(
        "the rule is not symmetric: a particle of sublattice {sublattice} sees a neighbour at [{}, {}] that does not see it back alike, so the long-wave limit drifts instead of being elastic",
        .vector[0], .vector[1]
    )]
    NotSymmetric {
        /// Sublattice of the particle that sees.
        sublattice: usize,
        /// From that particle to the neighbour \[length\].
        vector: [f64; 2],
    },
    /// Far neighbours cancel near ones, so that long waves cost nothing.
    #[error(
        "long waves cost nothing: the weights of far neighbours cancel those of near ones, so there is no stiffness"
    )]
    NoStiffness,
    /// Products of lengths and weights over- or underflow.
    #[error("lengths or weights are too large or too small: their products do not fit a double")]
    Range,
    /// The two particles of a honeycomb's cell do not hold each other.
    #[error("the particles of a lattice cell do not hold each other: their difference costs nothing")]
    Loose,
    /// A particle has no target: its weights do not sum to a positive definite matrix.
    #[error(
        "the weights of a particle of sublattice {sublattice} do not sum to a positive definite matrix, so it has no target"
    )]
    Singular {
        /// Sublattice of the particle.
        sublattice: usize,
    },
    /// Lists of weights do not fit the lists of neighbours.
    #[error(
        "{given} lists of weights were given for {needed} sublattices, or lists of other lengths than the neighbours'"
    )]
    Weights {
        /// Lists that were given.
        given: usize,
        /// Sublattices of the lattice.
        needed: usize,
    },
    /// The material has no stiffness on the lattice's cell.
    #[error(transparent)]
    Shape(#[from] ShapeError),
}

/// The continuum that weights are for long waves. For a scalar rule every stiffness is up to a scale.
#[derive(Clone, Debug, PartialEq)]
pub struct Effective {
    /// Stiffness, Voigt order (xx, yy, xy) \[force / length\], shape \[3, 3\].
    pub stiffness: Voigt,
    /// Lame's constants of the nearest isotropic stiffness \[force / length\], two-dimensional: the
    /// stiffness of an equal stretch is `lambda + mu`.
    pub lambda: f64,
    /// The second of them, the stiffness against shear \[force / length\].
    pub mu: f64,
    /// Distance of the stiffness from the nearest isotropic one, relative \[1\].
    pub anisotropy: f64,
    /// How far the acoustic tensor is from that of any symmetric stress, relative \[1\].
    pub misfit: f64,
    /// Gradient lengths squared, with their sign \[length^2\]: see [`GradientLength`].
    pub gradient: GradientLength,
}

/// Gradient length squared `l^2` \[length^2\]: positive stiffens short waves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GradientLength {
    /// Of waves along x that move along x.
    pub longitudinal_x: f64,
    /// Of waves along x that move across it.
    pub transverse_x: f64,
    /// Over all directions and both polarisations.
    pub least: f64,
    /// Over all directions and both polarisations.
    pub greatest: f64,
}

impl Effective {
    /// Poisson's ratio of the nearest isotropic sheet in plane stress \[1\]: the two-dimensional one.
    pub fn poisson_plane_stress(&self) -> f64 {
        self.lambda / (self.lambda + 2.0 * self.mu)
    }

    /// Poisson's ratio of the nearest isotropic slice in plane strain \[1\]; none where that is -1 or less, or the sheet
    /// resists an equal stretch with nothing or less (no solid does so).
    pub fn poisson_plane_strain(&self) -> Option<f64> {
        let is_of_solid = |bulk: f64| bulk > 1e-12 * self.mu.abs();
        let bulk = self.lambda + self.mu;
        (is_of_solid(bulk) && is_of_solid(3.0 * self.lambda + 2.0 * self.mu))
            .then(|| self.lambda / (2.0 * bulk))
    }

    /// Young's modulus times thickness in plane stress \[force / length\], up to scale for a scalar rule;
    /// zero for Eq. 1.
    pub fn young_plane_stress(&self) -> f64 {
        4.0 * self.mu * (self.lambda + self.mu) / (self.lambda + 2.0 * self.mu)
    }

    /// Young's modulus times thickness in plane strain \[force / length\], up to scale for a scalar rule.
    pub fn young_plane_strain(&self) -> Option<f64> {
        self.poisson_plane_strain().map(|poisson| 2.0 * self.mu * (1.0 + poisson))
    }
}

impl Crystal {
    /// A scalar rule: neighbours at `offsets`, by sublattice, with these weights \[1\] of the same shape,
    /// or all 1.
    pub fn scalar(
        lattice: &Lattice,
        offsets: &[Vec<Site>],
        weights: Option<&[Vec<f64>]>,
    ) -> Result<Self, HomogeniseError> {
        let fits = weights.is_none_or(|weights| {
            weights.len() == offsets.len() && weights.iter().zip(offsets).all(|(w, o)| w.len() == o.len())
        });
        if offsets.len() != lattice.sublattices() || !fits {
            let given = weights.map_or(offsets.len(), <[_]>::len);
            return Err(HomogeniseError::Weights { given, needed: lattice.sublattices() });
        }
        let bonds = offsets.iter().enumerate().map(|(sublattice, offsets)| {
            let weight = |k: usize| weights.map_or(1.0, |weights| weights[sublattice][k]);
            let bond = |(k, &offset): (usize, &Site)| {
                bond(lattice, sublattice, offset, [[weight(k), 0.0], [0.0, weight(k)]])
            };
            offsets.iter().enumerate().map(bond).collect()
        });
        Ok(Self { bonds: bonds.collect(), primitive: primitive(lattice) })
    }

    /// The weights that cells of this material give an interior particle, nearest neighbours first.
    pub fn material(lattice: &Lattice, elastic: &Elastic) -> Result<Self, HomogeniseError> {
        let templates = templates(lattice);
        let cell = &templates[0];
        // Of an oblique lattice whose cell spans so many columns, sums would leave the integers.
        if cell.iter().flatten().any(|steps| steps.abs() > i32::MAX >> 5) {
            return Err(HomogeniseError::Range);
        }
        // Eight sides of a cell either way, which of a honeycomb are four cells: where dilatations are averaged, a particle in
        // the middle feels those two cells away, and around these no cell is missing, so that none is on an edge.
        let mut sites = ring(&[cell[1], cell[cell.len() - 1]], 8);
        sites.push([0, 0]);
        sites.retain(|&site| lattice.is_site(site));
        sites.sort_unstable();
        let cells = Cells::of_sites(lattice, &templates, &sites, |_| true);
        let bonds = (0..lattice.sublattices()).map(|sublattice| {
            let [column, row] = lattice.site_of_sublattice(sublattice);
            let middle = sites.partition_point(|&site| site < [column, row]);
            let found = bonds_of(middle, (&cells, sites.len()), elastic).map_err(|error| match error {
                WeightsError::Shape { reason, .. } => HomogeniseError::Shape(reason),
                // Every particle that shares a cell is there and is seen.
                _ => HomogeniseError::Singular { sublattice },
            })?;
            let offset = |j: u32| [sites[j as usize][0] - column, sites[j as usize][1] - row];
            let blocks: BTreeMap<Site, Block> =
                found.into_iter().map(|(j, block)| (offset(j), block)).collect();
            let mut order: Vec<Site> = blocks.keys().copied().collect();
            lattice.sort_nearest_first(&mut order);
            let bond = |offset| bond(lattice, sublattice, offset, blocks[&offset]);
            Ok::<Vec<Bond>, HomogeniseError>(order.into_iter().map(bond).collect())
        });
        Ok(Self { bonds: bonds.collect::<Result<_, _>>()?, primitive: primitive(lattice) })
    }

    /// `D = sum_j K_j` of a sublattice \[force / length\].
    pub fn diagonal(&self, sublattice: usize) -> Block {
        let mut sum = [[0.0; 2]; 2];
        for bond in &self.bonds[sublattice] {
            (0..2).for_each(|a| (0..2).for_each(|b| sum[a][b] += bond.block[a][b]));
        }
        sum
    }

    /// The same of all sublattices.
    pub fn diagonals(&self) -> Vec<Block> {
        (0..self.bonds.len()).map(|s| self.diagonal(s)).collect()
    }

    /// The continuum of long waves; refuses a rule that is not symmetric.
    pub fn effective(&self) -> Result<Effective, HomogeniseError> {
        self.require_symmetric()?;
        // Three directions determine a quadratic form; a fourth would add nothing.
        let half = 0.5f64.sqrt();
        let along = |n: [f64; 2]| Ok::<_, HomogeniseError>(self.long_wave(n)?.0);
        let (xx, yy, diagonal) = (along([1.0, 0.0])?, along([0.0, 1.0])?, along([half, half])?);
        let xy = diagonal - (xx + yy) * 0.5;
        let pull = self.pull();
        // So that neither squares nor what is left of a cancellation leave the range of a double.
        if !(1e-140..1e140).contains(&pull) {
            return Err(HomogeniseError::Range);
        }
        if xx.norm() + yy.norm() <= 1e-12 * pull {
            return Err(HomogeniseError::NoStiffness);
        }
        let (stiffness, misfit) = fit_stiffness(&xx, &yy, &xy);
        let c = |i: usize, j: usize| stiffness[(i, j)];
        let bulk = (c(0, 0) + c(1, 1) + 2.0 * c(0, 1)) / 4.0;
        let mu = (c(0, 0) + c(1, 1) - 2.0 * c(0, 1) + 4.0 * c(2, 2)) / 8.0;
        let lambda = bulk - mu;
        let direct = lambda + 2.0 * mu;
        let isotropic = Matrix3::new(direct, lambda, 0.0, lambda, direct, 0.0, 0.0, 0.0, mu);
        let anisotropy = mandel(&(stiffness - isotropic)).norm() / mandel(&stiffness).norm();
        Ok(Effective { stiffness, lambda, mu, anisotropy, misfit, gradient: self.gradient_length()? })
    }

    /// Refuses weights for which `K_ij` is not the transpose of `K_ji`.
    pub fn require_symmetric(&self) -> Result<(), HomogeniseError> {
        let largest = |bond: &Bond| bond.block.iter().flatten().fold(0f64, |m, x| m.max(x.abs()));
        let scale = self.bonds.iter().flatten().map(largest).fold(0.0, f64::max);
        let reach = self.bonds.iter().flatten().map(|b| b.vector[0].hypot(b.vector[1])).fold(0.0, f64::max);
        for (sublattice, bonds) in self.bonds.iter().enumerate() {
            for bond in bonds {
                let [x, y] = bond.vector;
                let back = |other: &&Bond| {
                    other.to == sublattice && (other.vector[0] + x).hypot(other.vector[1] + y) < 1e-9 * reach
                };
                let alike = |other: &Bond| {
                    let difference = |a: usize, b: usize| (bond.block[a][b] - other.block[b][a]).abs();
                    (0..4).all(|k| difference(k / 2, k % 2) <= 1e-9 * scale)
                };
                if !self.bonds[bond.to].iter().find(back).is_some_and(alike) {
                    return Err(HomogeniseError::NotSymmetric { sublattice, vector: bond.vector });
                }
            }
        }
        Ok(())
    }

    /// Size that the acoustic tensor would have if nothing cancelled \[force / length\].
    fn pull(&self) -> f64 {
        let size = |bond: &Bond| bond.block.iter().flatten().fold(0f64, |m, x| m.max(x.abs()));
        let bonds = self.bonds.iter().flatten();
        bonds.map(|b| size(b) * (b.vector[0].powi(2) + b.vector[1].powi(2))).sum::<f64>() / self.cell_area()
    }

    /// Area of a lattice cell \[length^2\].
    fn cell_area(&self) -> f64 {
        let [[ax, ay], [bx, by]] = self.primitive;
        (ax * by - ay * bx).abs()
    }

    /// The `k^2` and `k^4` terms of the symbol for waves along the unit vector `n`, per area.
    fn long_wave(&self, n: [f64; 2]) -> Result<(Matrix2<f64>, Matrix2<f64>), HomogeniseError> {
        let series = self.series(n);
        let [second, fourth] = match self.bonds.len() {
            1 => [series[2].clone(), series[4].clone()],
            _ => condensed(&series)?,
        };
        let real = |m: DMatrix<Complex<f64>>| {
            Matrix2::from_fn(|a, b| 0.5 * (m[(a, b)].re + m[(b, a)].re) / self.cell_area())
        };
        Ok((real(second), real(fourth)))
    }

    /// Taylor coefficients, orders 0 to 4, of the symbol of all sublattices along `n`.
    fn series(&self, n: [f64; 2]) -> Vec<DMatrix<Complex<f64>>> {
        let size = 2 * self.bonds.len();
        let mut series = vec![DMatrix::zeros(size, size); 5];
        for (from, bonds) in self.bonds.iter().enumerate() {
            for bond in bonds {
                let along = n[0] * bond.vector[0] + n[1] * bond.vector[1];
                let mut term = Complex::new(1.0, 0.0);
                for (order, matrix) in series.iter_mut().enumerate() {
                    if order > 0 {
                        term *= Complex::new(0.0, along / order as f64);
                    }
                    for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                        matrix[(2 * from + a, 2 * bond.to + b)] -= term * bond.block[a][b];
                        if order == 0 {
                            matrix[(2 * from + a, 2 * from + b)] += Complex::from(bond.block[a][b]);
                        }
                    }
                }
            }
        }
        series
    }

    fn gradient_length(&self) -> Result<GradientLength, HomogeniseError> {
        const DIRECTIONS: usize = 180;
        let (mut least, mut greatest) = (f64::INFINITY, f64::NEG_INFINITY);
        for step in 0..DIRECTIONS {
            let (sin, cos) = (std::f64::consts::PI * step as f64 / DIRECTIONS as f64).sin_cos();
            for length in self.polarised([cos, sin])? {
                (least, greatest) = (least.min(length), greatest.max(length));
            }
        }
        let [longitudinal_x, transverse_x] = self.polarised([1.0, 0.0])?;
        Ok(GradientLength { longitudinal_x, transverse_x, least, greatest })
    }

    /// `l^2` of the two waves along `n`, the one that moves more along `n` first.
    fn polarised(&self, n: [f64; 2]) -> Result<[f64; 2], HomogeniseError> {
        let (second, fourth) = self.long_wave(n)?;
        let along = Vector2::from(n);
        let across = Vector2::new(-n[1], n[0]);
        let coupled = (second * along).dot(&across).abs() > 1e-9 * second.norm();
        let modes = if coupled {
            let eigen = second.symmetric_eigen();
            let (p, q): (Vector2<f64>, Vector2<f64>) =
                (eigen.eigenvectors.column(0).into(), eigen.eigenvectors.column(1).into());
            if p.dot(&along).abs() >= q.dot(&along).abs() { [p, q] } else { [q, p] }
        } else {
            [along, across]
        };
        Ok(modes.map(|p| p.dot(&(fourth * p)) / p.dot(&(second * p))))
    }
}

fn primitive(lattice: &Lattice) -> [[f64; 2]; 2] {
    lattice.primitive().map(|offset| lattice.vector(offset))
}

fn bond(lattice: &Lattice, sublattice: usize, offset: Site, block: Block) -> Bond {
    let base = lattice.site_of_sublattice(sublattice);
    let to = lattice.sublattice([base[0] + offset[0], base[1] + offset[1]]);
    Bond { vector: lattice.vector(offset), to, block }
}

/// Displacements of two sublattices from their mean (first two columns) and half their difference.
fn mean_and_difference() -> DMatrix<Complex<f64>> {
    DMatrix::from_fn(4, 4, |row, column| {
        let sign = if row >= 2 && column >= 2 { -1.0 } else { 1.0 };
        Complex::from(if row % 2 == column % 2 { sign } else { 0.0 })
    })
}

/// Orders 2 and 4 of what is left for the mean displacement of two sublattices when their difference
/// costs least: the Schur complement of power series.
fn condensed(series: &[DMatrix<Complex<f64>>]) -> Result<[DMatrix<Complex<f64>>; 2], HomogeniseError> {
    let change = mean_and_difference();
    let changed: Vec<_> = series.iter().map(|order| change.transpose() * order * &change).collect();
    let part = |row: usize, column: usize| {
        changed.iter().map(|order| order.view((row, column), (2, 2)).into_owned()).collect::<Vec<_>>()
    };
    let (mean, to_mean, from_mean, difference) = (part(0, 0), part(0, 2), part(2, 0), part(2, 2));
    let scale = difference[0].norm();
    let inverse = difference[0].clone().try_inverse().ok_or(HomogeniseError::Loose)?;
    let condition = inverse.norm() * scale;
    if condition.is_nan() || condition > 1e12 {
        return Err(HomogeniseError::Loose);
    }
    // The difference that answers the mean: solve `difference * answer = from_mean` order by order.
    let mut answer: Vec<DMatrix<Complex<f64>>> = Vec::new();
    for order in 0..5 {
        let known = (0..order).map(|k| &difference[order - k] * &answer[k]);
        let right = known.fold(from_mean[order].clone(), |sum, term| sum - term);
        answer.push(&inverse * right);
    }
    Ok([2, 4].map(|order| {
        let product = (0..=order).map(|k| &to_mean[k] * &answer[order - k]);
        product.fold(mean[order].clone(), |sum, term| sum - term)
    }))
}

/// The stiffness whose acoustic tensor is nearest to `xx k_x^2 + 2 xy k_x k_y + yy k_y^2`, and the
/// relative distance that remains.
fn fit_stiffness(xx: &Matrix2<f64>, yy: &Matrix2<f64>, xy: &Matrix2<f64>) -> (Voigt, f64) {
    // A_xx = C11 kx^2 + 2 C13 kx ky + C33 ky^2, A_yy = C33 kx^2 + 2 C23 kx ky + C22 ky^2,
    // A_xy = C13 kx^2 + (C12 + C33) kx ky + C23 ky^2: C33, C13 and C23 each occur twice.
    let c33 = 0.5 * (xx[(1, 1)] + yy[(0, 0)]);
    let c13 = 0.5 * (xx[(0, 1)] + xy[(0, 0)]);
    let c23 = 0.5 * (yy[(0, 1)] + xy[(1, 1)]);
    let c12 = 2.0 * xy[(0, 1)] - c33;
    let stiffness = Matrix3::new(xx[(0, 0)], c12, c13, c12, yy[(1, 1)], c23, c13, c23, c33);
    // The part that changes its sign with the two pairs of axes; of a norm that does not change when the axes turn.
    let gaps = [xx[(0, 1)] - xy[(0, 0)], yy[(0, 1)] - xy[(1, 1)]].map(|gap| 2f64.sqrt() * gap);
    let gap = Vector3::new(xx[(1, 1)] - yy[(0, 0)], gaps[0], gaps[1]).norm();
    (stiffness, gap / (xx + yy).norm())
}

#[cfg(test)]
mod tests;
