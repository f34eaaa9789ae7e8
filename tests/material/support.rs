//! Bodies, materials and a direct solver, shared by the tests of the material rule.

use flockform::flock::block::{Block, apply, plus};
use flockform::flock::body::{Body, Cut};
use flockform::flock::lattice::{Lattice, LatticeKind};
use flockform::flock::law::{Flock, MatrixWeights, Weights};
use flockform::flock::neighbourhood::Neighbours;
use flockform::flock::rules::{Mean, Rotation, Rule};
use flockform::flock::vectors::Vectors;
use flockform::material::cells::{Cells, neighbourhood};
use flockform::material::elastic::{Constants, Elastic, Plane};
use flockform::material::weights::{WeightsError, assemble};

pub use crate::samples::{KINDS, fibres, of_whole_cells};

pub fn sheet(young: f64, poisson: f64) -> Elastic {
    Elastic::new(Constants::Isotropic { young, poisson, plane: Plane::Stress }, 1.0).expect("admissible")
}

pub fn build(lattice: Lattice, cut: &Cut) -> (Body, Neighbours, Cells) {
    let near = neighbourhood(&lattice);
    let (body, neighbours) = Body::build(lattice, cut, &near, None).expect("builds");
    let cells = Cells::of_body(&body);
    (body, neighbours, cells)
}

/// A turned and shifted body of every lattice.
pub fn sample(kind: LatticeKind, orientation: f64) -> (Body, Neighbours, Cells) {
    let lattice = Lattice::new(kind, [3.0, -2.0], orientation);
    of_whole_cells(&lattice, &Cut::Count { columns: 8, rows: 9 }, &neighbourhood(&lattice))
}

/// The material as seen by each particle.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialWeights {
    pub neighbours: Neighbours,
    pub weights: MatrixWeights,
}

impl MaterialWeights {
    pub fn assemble(
        cells: &Cells,
        body: &Body,
        neighbours: Neighbours,
        elastic: &Elastic,
    ) -> Result<Self, WeightsError> {
        let weights = assemble(cells, body, &neighbours, elastic, Rotation::Small)?;
        Ok(Self { neighbours, weights })
    }

    /// `D_i = sum_j K_ij`.
    pub fn diagonal(&self, particle: usize) -> Block {
        self.weights.stiffness_of(particle).iter().fold(Block::default(), |sum, block| plus(&sum, block))
    }

    /// The neighbours of a particle, and `K_ij`.
    pub fn bonds(&self, particle: usize) -> impl Iterator<Item = (usize, &Block)> {
        let seen = self.neighbours.of(particle).iter().map(|&j| j as usize);
        seen.zip(self.weights.stiffness_of(particle))
    }

    /// `sum_j K_ij (u_j - u_i)`: zero to the last bit if all move alike.
    pub fn force(&self, particle: usize, displacement: &Vectors) -> [f64; 2] {
        let here = displacement.get(particle);
        self.bonds(particle).fold([0.0; 2], |sum, (j, block)| {
            let there = displacement.get(j);
            let [x, y] = apply(block, [there[0] - here[0], there[1] - here[1]]);
            [sum[0] + x, sum[1] + y]
        })
    }

    pub fn energy(&self, displacement: &Vectors) -> f64 {
        let work = |i: usize| {
            let ([fx, fy], [x, y]) = (self.force(i, displacement), displacement.get(i));
            fx * x + fy * y
        };
        -0.5 * (0..displacement.len()).map(work).sum::<f64>()
    }
}

/// Particles on a free side.
pub fn on_boundary(cells: &Cells, count: usize) -> Vec<bool> {
    let mut boundary = vec![false; count];
    for [a, b] in cells.boundary_sides(&cells.incidence(count)) {
        (boundary[a as usize], boundary[b as usize]) = (true, true);
    }
    boundary
}

/// The rule as a host sweeps it.
pub fn flock(body: &Body, weights: &MaterialWeights, forces: Option<Vectors>) -> Flock {
    let mut flock = Flock {
        rule: Rule { mean: Mean::Material { rotation: Rotation::Small }, ..Rule::BARYCENTRE },
        reference: body.reference.clone(),
        neighbours: weights.neighbours.clone(),
        weights: Weights::Matrix(weights.weights.clone()),
        forces,
        rest: None,
        keeps_rest: false,
        bonds: None,
    };
    flock.keep_rest();
    flock
}

/// Followers at rest under their neighbours and loads, leaders where `displacement` has them: banded
/// Cholesky over the followers in their numbering.
pub fn equilibrium(
    weights: &MaterialWeights,
    leads: &[bool],
    forces: &Vectors,
    displacement: &Vectors,
) -> Vectors {
    let followers: Vec<usize> = (0..leads.len()).filter(|&i| !leads[i]).collect();
    let mut place = vec![usize::MAX; leads.len()];
    followers.iter().enumerate().for_each(|(row, &i)| place[i] = row);
    let mut entries: Vec<(usize, usize, Block)> = Vec::new();
    let mut right: Vec<f64> = Vec::new();
    for (row, &i) in followers.iter().enumerate() {
        entries.push((row, row, weights.diagonal(i)));
        let mut load = forces.get(i);
        for (j, &block) in weights.bonds(i) {
            if leads[j] {
                let u = displacement.get(j);
                (0..2).for_each(|a| load[a] += block[a][0] * u[0] + block[a][1] * u[1]);
            } else {
                entries.push((row, place[j], block.map(|row| row.map(|x| -x))));
            }
        }
        right.extend(load);
    }
    let solution = banded_cholesky(right.len(), &entries, right);
    let mut result = displacement.clone();
    followers
        .iter()
        .enumerate()
        .for_each(|(row, &i)| result.set(i, [solution[2 * row], solution[2 * row + 1]]));
    result
}

fn banded_cholesky(n: usize, entries: &[(usize, usize, Block)], mut x: Vec<f64>) -> Vec<f64> {
    let band = entries.iter().map(|&(r, c, _)| 2 * r.abs_diff(c) + 2).max().unwrap_or(1);
    // l[i][d] is the entry in row i, column i - d.
    let mut l = vec![vec![0.0; band]; n];
    for (row, column, block) in entries {
        for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let (i, j) = (2 * row + a, 2 * column + b);
            if j <= i {
                l[i][i - j] += block[a][b];
            }
        }
    }
    for i in 0..n {
        for j in i.saturating_sub(band - 1)..=i {
            let first = i.saturating_sub(band - 1).max(j.saturating_sub(band - 1));
            let sum: f64 = (first..j).map(|k| l[i][i - k] * l[j][j - k]).sum();
            let rest = l[i][i - j] - sum;
            l[i][i - j] = if i == j { rest.sqrt() } else { rest / l[j][0] };
        }
        let sum: f64 = (1..band.min(i + 1)).map(|d| l[i][d] * x[i - d]).sum();
        x[i] = (x[i] - sum) / l[i][0];
    }
    for i in (0..n).rev() {
        let sum: f64 = (1..band.min(n - i)).map(|d| l[i + d][d] * x[i + d]).sum();
        x[i] = (x[i] - sum) / l[i][0];
    }
    x
}

pub fn relative_l2(found: &Vectors, truth: &Vectors, counts: impl Fn(usize) -> bool) -> f64 {
    let (mut error, mut size) = (0.0, 0.0);
    for i in (0..truth.len()).filter(|&i| counts(i)) {
        let (f, t) = (found.get(i), truth.get(i));
        error += (f[0] - t[0]).powi(2) + (f[1] - t[1]).powi(2);
        size += t[0] * t[0] + t[1] * t[1];
    }
    (error / size).sqrt()
}
