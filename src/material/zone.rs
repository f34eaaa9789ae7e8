//! All waves on a lattice: whether a rule is stable, and how far a synchronous update may go.
//!
//! The symbol `S(k)` of [`Crystal`] is sampled over the Brillouin zone. A rule is stable if every wave
//! costs something. A synchronous update `u <- u + w D^-1 (sum_j K_j u_j - D u)` multiplies a wave by
//! `1 - w s`, `s` an eigenvalue of `D^-1 S(k)`, so it shrinks every wave only if `w < 2 / s` for the
//! largest one: Eq. 1 has 2 on the square lattice, and what carries a material has more.

use nalgebra::{Complex, DMatrix};

use super::homogenise::{Crystal, HomogeniseError};
use crate::flock::block::{inverse, product};

/// Properties of a rule that the waves of its lattice show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Zone {
    /// Whether every wave but a translation costs energy.
    pub stable: bool,
    /// Least cost of a wave \[1\]: the smallest eigenvalue of the symbol over `4 - 2 cos p - 2 cos q`, `p` and
    /// `q` its phases along the two translations, and over the mean diagonal entry of `D`; not above zero
    /// if unstable.
    pub least: f64,
    /// The wave of that cost \[1/length\].
    pub worst: [f64; 2],
    /// Largest eigenvalue of `D^-1 S(k)` \[1\].
    pub largest: f64,
    /// The wave that has it \[1/length\].
    pub largest_at: [f64; 2],
    /// A synchronous update must be damped below this: 2 over the largest eigenvalue \[1\].
    pub damping_limit: f64,
}

/// Samples each way: a multiple of 6, so that the corners of square and hexagonal zones are among them.
const SAMPLES: i32 = 48;

/// Steps of one size while climbing: samples lie two of the first size apart.
const MOST_MOVES: usize = 16;

/// Below this a wave counts as free: it is rounding.
const FREE: f64 = 1e-10;

impl Crystal {
    /// Samples the Brillouin zone and refines the extremes found; refuses a rule that is not symmetric,
    /// and one whose `D` is not positive definite.
    pub fn zone(&self) -> Result<Zone, HomogeniseError> {
        self.zone_over(&self.diagonals())
    }

    /// As [`Crystal::zone`], of an update that divides by these blocks instead of `D`; shape \[sublattices\].
    pub fn zone_over(&self, divisors: &[super::Block]) -> Result<Zone, HomogeniseError> {
        self.require_symmetric()?;
        let inverses: Vec<_> = divisors
            .iter()
            .enumerate()
            .map(|(sublattice, block)| inverse(block).ok_or(HomogeniseError::Singular { sublattice }))
            .collect::<Result<_, _>>()?;
        let roots: Vec<_> = inverses.iter().map(cholesky).collect();
        let growth = |phase: [f64; 2]| self.growth(phase, &roots);
        let (mut lowest, mut top) = ((f64::INFINITY, [0.0; 2]), (0f64, [0.0; 2]));
        // S(-k) is the conjugate of S(k): half the zone is enough.
        for i in 0..=SAMPLES / 2 {
            for j in -SAMPLES / 2..=SAMPLES / 2 {
                let phase = [i, j].map(|n| std::f64::consts::TAU * f64::from(n) / f64::from(SAMPLES));
                let factor = growth(phase);
                if factor > top.0 {
                    top = (factor, phase);
                }
                // A translation costs nothing, by the phases of no wave.
                let cost = if (i, j) == (0, 0) { f64::INFINITY } else { self.cost(phase) };
                if cost < lowest.0 {
                    lowest = (cost, phase);
                }
            }
        }
        let lowest = climb(lowest, |phase| -self.cost(phase), -1.0);
        let top = climb(top, growth, 1.0);
        // Springs of stiffness 1 along two axes have 4 on the diagonal.
        let least = lowest.0 * 8.0 * self.bonds.len() as f64
            / divisors.iter().map(|d| d[0][0] + d[1][1]).sum::<f64>();
        Ok(Zone {
            stable: least > FREE,
            least,
            worst: self.wave(lowest.1),
            largest: top.0,
            largest_at: self.wave(top.1),
            damping_limit: 2.0 / top.0,
        })
    }

    /// `W = D^-1 K` of a bond of a sublattice \[1\].
    pub fn weight(&self, sublattice: usize, bond: usize) -> Option<super::Block> {
        inverse(&self.diagonal(sublattice))
            .map(|inverse| product(&inverse, &self.bonds[sublattice][bond].block))
    }

    /// The wave vector \[1/length\] whose phases along the two translations \[rad\] are these.
    fn wave(&self, [p, q]: [f64; 2]) -> [f64; 2] {
        let [[ax, ay], [bx, by]] = self.primitive;
        let area = ax * by - ay * bx;
        [(p * by - q * ay) / area, (q * ax - p * bx) / area]
    }

    /// `S(k)`, Hermitian, shape \[2 sublattices, 2 sublattices\].
    pub(super) fn symbol(&self, k: [f64; 2]) -> DMatrix<Complex<f64>> {
        let size = 2 * self.bonds.len();
        let mut symbol = DMatrix::zeros(size, size);
        for (from, bonds) in self.bonds.iter().enumerate() {
            for bond in bonds {
                let turn = Complex::from_polar(1.0, k[0] * bond.vector[0] + k[1] * bond.vector[1]);
                for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    symbol[(2 * from + a, 2 * from + b)] += Complex::from(bond.block[a][b]);
                    symbol[(2 * from + a, 2 * bond.to + b)] -= turn * bond.block[a][b];
                }
            }
        }
        let adjoint = symbol.adjoint();
        (symbol + adjoint) * Complex::from(0.5)
    }

    /// Least eigenvalue of the symbol over `4 - 2 cos p - 2 cos q` \[force / length\].
    fn cost(&self, phase: [f64; 2]) -> f64 {
        let springs: f64 = phase.iter().map(|p| 4.0 * (0.5 * p).sin().powi(2)).sum();
        self.symbol(self.wave(phase)).symmetric_eigenvalues().min() / springs
    }

    /// Largest eigenvalue of `D^-1 S(k)`: that of the Hermitian `L' S L` with `D^-1 = L L'`.
    fn growth(&self, phase: [f64; 2], roots: &[super::Block]) -> f64 {
        let symbol = self.symbol(self.wave(phase));
        let root = DMatrix::from_fn(symbol.nrows(), symbol.ncols(), |row, column| {
            let same = row / 2 == column / 2;
            Complex::from(if same { roots[row / 2][row % 2][column % 2] } else { 0.0 })
        });
        (root.transpose() * symbol * root).symmetric_eigenvalues().max()
    }
}

/// The lower triangular root of a positive definite block.
fn cholesky(block: &super::Block) -> super::Block {
    let [[a, b], [_, d]] = *block;
    let first = a.sqrt();
    let below = b / first;
    [[first, 0.0], [below, (d - below * below).max(0.0).sqrt()]]
}

/// Climbs from a sampled extreme by steps that shrink; `sign` is that of `height` against the value.
fn climb(start: (f64, [f64; 2]), height: impl Fn([f64; 2]) -> f64, sign: f64) -> (f64, [f64; 2]) {
    let mut best = (sign * start.0, start.1);
    let mut step = std::f64::consts::PI / f64::from(SAMPLES);
    let mut moves = 0;
    while step > 1e-7 {
        let [p, q] = best.1;
        let around = |k: u32| [k % 3, k / 3].map(|k| step * (f64::from(k) - 1.0));
        let tried = (0..9).map(around).map(|[a, b]| [p + a, q + b]);
        let higher = tried
            // Next to the origin a wave is a translation: what it costs is rounding.
            .filter(|phase| phase[0].hypot(phase[1]) > 0.01)
            .map(|phase| (height(phase), phase))
            .fold(best, |best, next| if next.0 > best.0 { next } else { best });
        // Along a ridge, or around the origin, it would climb for thousands of the smallest steps.
        if higher.0 > best.0 && moves < MOST_MOVES {
            (best, moves) = (higher, moves + 1);
        } else {
            (step, moves) = (0.5 * step, 0);
        }
    }
    (sign * best.0, best.1)
}
