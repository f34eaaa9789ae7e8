//! What is to be solved, and what every solver starts from.

use super::SolveError;
use crate::flock::block::{apply, inverse};
use crate::flock::points::Points;
use crate::solve::field::{Field, dot};
use crate::solve::operator::{HELD, Matrix, Operator, Stencils};
use std::sync::OnceLock;

/// A body's operator, the forces on it and where its held particles are.
#[derive(Clone, Debug)]
pub struct System {
    pub operator: Operator,
    /// Force on each particle \[force\]; those on held ones change nothing. Shape \[count\].
    pub forces: Points,
    /// Displacement of each held particle \[length\]; that of followers is not looked at. Shape \[count\].
    pub held: Points,
    asymmetric_pair: OnceLock<Option<[usize; 2]>>,
}

impl System {
    pub fn new(operator: Operator, forces: Points, held: Points) -> Self {
        Self { operator, forces, held, asymmetric_pair: OnceLock::new() }
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
    pub(super) fn with_held(&self, found: Field<f64>) -> Points {
        let mut displacement = Points { x: found.x, y: found.y };
        for i in (0..displacement.len()).filter(|&i| !self.operator.follows()[i]) {
            displacement.set(i, self.held.get(i));
        }
        displacement
    }

    /// `f + K_FL u_L` for the followers, zero for the others.
    fn right_side(&self, matrix: &Matrix) -> Field<f64> {
        let operator = &self.operator;
        let mut right = Field { x: self.forces.x.clone(), y: self.forces.y.clone() };
        for stretch in operator.stretches() {
            let range = stretch.start..stretch.start + stretch.len;
            // Only rows that owe something to a held particle were given another class.
            if matrix.class[range.clone()].iter().all(|&class| class == stretch.class) {
                continue;
            }
            for (offset, block) in &operator.rows()[stretch.class as usize].entries {
                let first = operator.index_of(stretch.site, *offset);
                for (k, i) in range.clone().enumerate().filter(|(k, _)| !operator.follows()[first + k]) {
                    let [x, y] = apply(block, self.held.get(first + k));
                    right.x[i] += x;
                    right.y[i] += y;
                }
            }
        }
        for (i, _) in matrix.class.iter().enumerate().filter(|(_, class)| **class == HELD) {
            (right.x[i], right.y[i]) = (0.0, 0.0);
        }
        right
    }
}

/// A system over its followers.
pub(super) struct Prepared {
    pub matrix: Matrix,
    pub stencils: Stencils<f64>,
    /// Right-hand side \[force\], shape \[count\].
    pub right: Field<f64>,
    /// `|right|` \[force\].
    pub size: f64,
    /// Vectors from a site to that of the next column and of the next row \[length\].
    pub grid: [[f64; 2]; 2],
    /// Whether any two neighbours feel each other alike.
    pub symmetric: bool,
}

impl Prepared {
    pub fn new(system: &System) -> Result<Self, SolveError> {
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
        let stencils = Stencils::new(&matrix.rows, 1.0);
        let right = system.right_side(&matrix);
        let size = dot(right.view(), right.view()).sqrt();
        let symmetric = system.asymmetric_pair().is_none();
        Ok(Self { matrix, stencils, right, size, grid: operator.grid, symmetric })
    }
}

/// The first particle, counted from 0, that its own row does not hold back.
fn loose(matrix: &Matrix) -> Option<usize> {
    let loose: Vec<bool> = matrix.rows.iter().map(|row| inverse(&row.diagonal).is_none()).collect();
    // A class whose every particle has a held neighbour was replaced by others, and is nobody's.
    let any = loose.contains(&true);
    let is_loose = |&class: &u32| class != HELD && loose[class as usize];
    if any { matrix.class.iter().position(is_loose) } else { None }
}
