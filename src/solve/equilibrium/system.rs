//! The system to be solved, from which every solver starts.

use super::{SolveError, steps};
use crate::flock::block::{apply, inverse};
use crate::flock::vectors::Vectors;
use crate::ranks::Team;
use crate::solve::field::dot;
use crate::solve::operator::{HELD, Matrix, Operator, RowCoefficients, power_of_two};
use std::sync::OnceLock;

/// A body's operator, the forces on it and where its held particles are.
#[derive(Clone, Debug)]
pub struct System {
    /// `K` over all particles, with the rows of the followers.
    pub operator: Operator,
    /// Force on each particle \[force\]; those on held ones change nothing. Shape \[count\].
    pub forces: Vectors,
    /// Displacement of each held particle \[length\]; that of followers is not looked at. Shape \[count\].
    pub held: Vectors,
    /// Whether its material hardly changes its volume: iterations are many then.
    pub is_nearly_incompressible: bool,
    asymmetric_pair: OnceLock<Option<[usize; 2]>>,
}

impl System {
    /// `forces` \[force\] and `held` displacements \[length\] of shape \[count\] each.
    pub fn new(operator: Operator, forces: Vectors, held: Vectors) -> Self {
        Self { operator, forces, held, is_nearly_incompressible: false, asymmetric_pair: OnceLock::new() }
    }

    /// See [`Operator::asymmetric_pair`]; looked for once.
    pub fn asymmetric_pair(&self) -> Option<[usize; 2]> {
        *self.asymmetric_pair.get_or_init(|| self.operator.asymmetric_pair())
    }

    pub(super) fn check(&self) -> Result<(), SolveError> {
        let (forces, held, particles) = (self.forces.len(), self.held.len(), self.operator.count());
        if forces != particles || held != particles {
            return Err(SolveError::Shapes { forces, held, particles });
        }
        for (i, &follows) in self.operator.follows().iter().enumerate() {
            let (points, what) = if follows { (&self.forces, "force") } else { (&self.held, "displacement") };
            if !points.get(i).iter().all(|value| value.is_finite()) {
                return Err(SolveError::NotFinite { what, particle: i + 1 });
            }
        }
        Ok(())
    }

    /// The followers' displacements with those of the held particles.
    pub(super) fn with_held(&self, found: Vectors<f64>) -> Vectors {
        let mut displacement = Vectors { x: found.x, y: found.y };
        for i in 0..displacement.len() {
            let held = self.held.get(i);
            if !self.operator.follows()[i] {
                displacement.set(i, held);
                continue;
            }
            match self.operator.held_axes(i) {
                [false, false] => {}
                [x, y] => {
                    let found = displacement.get(i);
                    displacement
                        .set(i, [if x { held[0] } else { found[0] }, if y { held[1] } else { found[1] }]);
                }
            }
        }
        displacement
    }

    /// The known part of a particle's displacement \[length\]: zero in unknown components, `None` where all
    /// are unknown.
    fn held_part(&self, particle: usize) -> Option<[f64; 2]> {
        let held = self.held.get(particle);
        match (self.operator.follows()[particle], self.operator.held_axes(particle)) {
            (false, _) => Some(held),
            (true, [false, false]) => None,
            (true, [x, y]) => Some([if x { held[0] } else { 0.0 }, if y { held[1] } else { 0.0 }]),
        }
    }

    /// `f + K_FL u_L` for the followers, zero for the others and in held components.
    fn right_side(&self, matrix: &Matrix) -> Vectors<f64> {
        let operator = &self.operator;
        let mut right = Vectors { x: self.forces.x.clone(), y: self.forces.y.clone() };
        for (column, segment) in matrix.columns.iter() {
            for k in 0..segment.len as usize {
                let i = segment.start as usize + k;
                let class = operator.class[i];
                // Only rows that owe something to a held particle were given another class.
                if matrix.class[i] == class {
                    continue;
                }
                let row = operator.scaled_row(i);
                let site = [column, segment.row + matrix.columns.step() * k as i32];
                for (offset, block) in row.entries {
                    let Some(held) = self.held_part(operator.index_of(site, *offset)) else { continue };
                    let [x, y] = apply(block, held).map(|pull| pull * operator.stiffness);
                    right.x[i] += x;
                    right.y[i] += y;
                }
                let [x, y] = operator.held_axes(i);
                let Some(held) = self.held_part(i).filter(|_| x || y) else { continue };
                let [fx, fy] = apply(row.diagonal, held).map(|pull| pull * operator.stiffness);
                right.x[i] = if x { 0.0 } else { right.x[i] - fx };
                right.y[i] = if y { 0.0 } else { right.y[i] - fy };
            }
        }
        for (i, _) in matrix.class.iter().enumerate().filter(|(_, class)| **class == HELD) {
            (right.x[i], right.y[i]) = (0.0, 0.0);
        }
        right
    }
}

/// A system over its followers, its stiffness and its right-hand side each divided by a power of two that
/// brings them near 1: no square of a force or stiffness then over- or underflows, and no bit changes.
pub(super) struct Prepared {
    pub matrix: Matrix,
    stencils: OnceLock<RowCoefficients<f64>>,
    /// Right-hand side \[1\], shape \[count\].
    pub right: Vectors<f64>,
    /// `|right|` \[1\].
    pub size: f64,
    /// The powers of two that a displacement has to be multiplied by, one after the other.
    pub scales: [f64; 2],
    /// Vectors from a site to that of the next column and of the next row, the longer about 1 \[1\].
    pub grid: [[f64; 2]; 2],
    /// Whether any two neighbours feel each other alike.
    pub symmetric: bool,
    /// The ranks that solve it together.
    pub team: Option<Team>,
}

impl Prepared {
    pub fn new(system: &System, team: Option<Team>) -> Result<Self, SolveError> {
        let operator = &system.operator;
        if operator.followers() == 0 {
            return Err(SolveError::NothingFollows);
        }
        let matrix = Matrix::of_followers(operator);
        if let Some(i) = operator.adrift(&matrix) {
            return Err(SolveError::Adrift { particle: i + 1 });
        }
        if let Some(i) = loose(&matrix) {
            return Err(SolveError::Loose { particle: i + 1 });
        }
        let mut right = system.right_side(&matrix);
        if let Some(i) = (0..right.len()).find(|&i| !right.get(i).iter().all(|f| f.is_finite())) {
            return Err(SolveError::NotFinite { what: "pull on the held neighbours", particle: i + 1 });
        }
        let force = power_of_two(right.x.iter().chain(&right.y).copied());
        right.x.iter_mut().chain(&mut right.y).for_each(|f| *f /= force);
        let size = dot(right.view(), right.view()).sqrt();
        let symmetric = system.asymmetric_pair().is_none();
        let scales = [1.0 / operator.stiffness, force];
        let length = power_of_two(operator.grid.as_flattened().iter().copied());
        let grid = operator.grid.map(|vector| vector.map(|v| v / length));
        Ok(Self { matrix, stencils: OnceLock::new(), right, size, scales, grid, symmetric, team })
    }

    /// The rows as the passes of an iteration read them.
    pub fn stencils(&self) -> &RowCoefficients<f64> {
        self.stencils.get_or_init(|| RowCoefficients::new(&self.matrix, 1.0))
    }

    /// `|f - K u| / |f|` of these displacements, which is not what an iteration that never looks back takes
    /// it for.
    pub fn residual(&self, system: &System, found: &Vectors<f64>) -> f64 {
        let right = self.scaled_right(system);
        let mut r = Vectors::zeros(right.len());
        steps::residual(&self.matrix, self.stencils(), (found, &right), &mut r).sqrt() / self.size
    }

    /// The right-hand side anew, for solvers use it up \[1\].
    pub fn scaled_right(&self, system: &System) -> Vectors<f64> {
        let mut right = system.right_side(&self.matrix);
        right.x.iter_mut().chain(&mut right.y).for_each(|f| *f /= self.scales[1]);
        right
    }

    /// Displacements \[length\] from those of the scaled system.
    pub fn unscaled(&self, mut found: Vectors<f64>) -> Vectors<f64> {
        let [first, second] = self.scales;
        found.x.iter_mut().chain(&mut found.y).for_each(|u| *u = *u * first * second);
        found
    }
}

/// The first particle, counted from 0, that its own row does not hold back.
fn loose(matrix: &Matrix) -> Option<usize> {
    let loose: Vec<bool> = matrix.rows.iter().map(|row| inverse(row.diagonal).is_none()).collect();
    // A class whose every particle has a held neighbour was replaced by others, and has no particles left.
    let any = loose.contains(&true);
    let is_loose = |&class: &u32| class != HELD && loose[class as usize];
    if any { matrix.class.iter().position(is_loose) } else { None }
}
