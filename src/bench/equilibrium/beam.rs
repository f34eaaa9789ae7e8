//! The bodies that equilibrium is measured on: plates of square cells, clamped along the left edge and
//! sheared along the right one.

use std::collections::HashMap;

use crate::flock::block::{Block, plus};
use crate::flock::lattice::Site;
use crate::flock::vectors::Vectors;
use crate::material::elastic::{Constants, Elastic, Plane};
use crate::material::stiffness::quadrilateral;
use crate::solve::equilibrium::System;
use crate::solve::operator::{Operator, OperatorError, Row};

/// Young's modulus, Poisson's ratio and the shear on the right edge: the beam of the reference data.
const YOUNG: f64 = 1000.0;
const POISSON: f64 = 0.33;
const SHEAR: f64 = 50.0;

/// Corners of the cell at the upper right of a site, counter-clockwise.
const CORNERS: [Site; 4] = [[0, 0], [1, 0], [1, 1], [0, 1]];

/// A plate of unit cells.
#[derive(Clone, Debug)]
pub struct Plate {
    /// Cells along x and along y.
    pub cells: [i32; 2],
    /// Whether it has round holes.
    pub holes: bool,
}

/// Everything that an operator is made of.
#[derive(Clone, Debug)]
pub struct Parts {
    /// Sites of the particles, column by column from the bottom.
    pub sites: Vec<Site>,
    class: Vec<u32>,
    rows: Vec<Row>,
    follows: Vec<bool>,
    forces: Vectors,
}

impl Plate {
    fn has_cell(&self, [i, j]: Site) -> bool {
        let inside = (0..self.cells[0]).contains(&i) && (0..self.cells[1]).contains(&j);
        // Holes of two fifths of their distance in radius, ten along the shorter side.
        let pitch = f64::from(self.cells[0].min(self.cells[1])) / 10.0;
        let off = |at: i32| ((f64::from(at) + 0.5) / pitch).fract() - 0.5;
        inside && !(self.holes && off(i).hypot(off(j)) < 0.3)
    }

    /// Classes are numbered by which of the four cells around a particle exist, so that each row is put
    /// together once.
    pub fn parts(&self) -> Parts {
        let mut parts = Parts {
            sites: Vec::new(),
            class: Vec::new(),
            rows: Vec::new(),
            follows: Vec::new(),
            forces: Vectors::default(),
        };
        let stiffness = cell_stiffness();
        let mut known: HashMap<[bool; 4], u32> = HashMap::new();
        for i in 0..=self.cells[0] {
            for j in 0..=self.cells[1] {
                let around = CORNERS.map(|[a, b]| self.has_cell([i - a, j - b]));
                if !around.contains(&true) {
                    continue;
                }
                let class = *known.entry(around).or_insert_with(|| {
                    parts.rows.push(row(around, &stiffness));
                    parts.rows.len() as u32 - 1
                });
                parts.sites.push([i, j]);
                parts.class.push(class);
                parts.follows.push(i > 0);
                let sides = around.iter().filter(|&&exists| exists).count() as f64;
                let loaded = i == self.cells[0];
                parts.forces.push([0.0, if loaded { SHEAR * sides / 2.0 } else { 0.0 }]);
            }
        }
        parts
    }
}

impl Parts {
    /// The system that a host would hand to the solvers.
    pub fn system(self) -> Result<System, OperatorError> {
        let held = Vectors::zeros(self.sites.len());
        let grid = [[1.0, 0.0], [0.0, 1.0]];
        let operator = Operator::new(&self.sites, grid, self.class, self.rows, self.follows)?;
        Ok(System::new(operator, self.forces, held))
    }
}

/// Blocks between the corners of a cell: `[a][b]` is the force on corner `a` per displacement of `b`.
type CellStiffness = [[Block; 4]; 4];

fn cell_stiffness() -> CellStiffness {
    let constants = Constants::Isotropic { young: YOUNG, poisson: POISSON, plane: Plane::Stress };
    let sheet = Elastic::new(constants, 1.0).expect("admissible constants");
    let corners = CORNERS.map(|[x, y]| [f64::from(x), f64::from(y)]);
    let k = quadrilateral(&corners, sheet.stiffness()).expect("a square");
    let block = |a: usize, b: usize| [0, 1].map(|r| [0, 1].map(|c| k[(2 * a + r, 2 * b + c)]));
    std::array::from_fn(|a| std::array::from_fn(|b| block(a, b)))
}

/// The row of a particle that is corner `k` of the cells for which `around[k]` holds.
fn row(around: [bool; 4], stiffness: &CellStiffness) -> Row {
    let mut blocks: HashMap<Site, Block> = HashMap::new();
    for own in (0..4).filter(|&own| around[own]) {
        for other in 0..4 {
            let offset = [0, 1].map(|k| CORNERS[other][k] - CORNERS[own][k]);
            let sum = blocks.entry(offset).or_default();
            *sum = plus(sum, &stiffness[own][other]);
        }
    }
    let diagonal = blocks.remove(&[0, 0]).unwrap_or_default();
    let mut entries: Vec<(Site, Block)> =
        blocks.into_iter().map(|(offset, block)| (offset, block.map(|row| row.map(|v| -v)))).collect();
    entries.sort_unstable_by_key(|&(offset, _)| offset);
    Row { diagonal, entries }
}
