//! Cells and neighbours to the 2x2 weights of the rule.

mod assembly;

use rayon::prelude::*;

use assembly::Assembly;

use super::cells::Cells;
use super::elastic::Elastic;
use super::mechanism::{Mechanism, require_rigid};
use super::stiffness::ShapeError;
use crate::flock::block::{Block, apply, product};
use crate::flock::body::Body;
use crate::flock::cells_around::CellsAround;
use crate::flock::law::MatrixWeights;
use crate::flock::neighbourhood::Neighbours;
use crate::flock::vectors::Vectors;

/// The material as seen by each particle. A row depends only on the cells around its particle, so
/// particles fall into a few classes that share one; particles of a frame have neither cells nor
/// weights.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialWeights {
    /// The neighbours of each particle, in the order in which they were given: the order of summation.
    pub neighbours: Neighbours,
    /// Class of each particle, shape \[count\].
    pub class: Vec<u32>,
    /// One row for each class, shape \[classes\].
    pub rows: Vec<Row>,
    /// The cells around the particles of each class.
    pub cells: CellsAround,
}

/// The stiffness felt by the particles of a class.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row {
    /// `K_ij` \[force / length\] in the order of the particle's neighbours. Zero between neighbours that
    /// share no cell. `K_ji` is the transpose of `K_ij`, to the bit.
    pub blocks: Vec<Block>,
    /// `D_i = sum_j K_ij` \[force / length\].
    pub diagonal: Block,
    /// `D_i^-1` \[length / force\].
    pub inverse: Block,
}

/// Why cells and neighbours make no material rule. Particles are named by their ids, which count from 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum WeightsError {
    /// Two corners of a cell do not see each other.
    #[error(
        "{neighbours} neighbours cannot carry shear coupling: particles {particle} and {missing} share a cell but are no neighbours, so {}; ask for all particles that share a cell",
        if *.corners == 4 { "the cell's diagonal pairs are missing" } else { "the cell's stiffness is cut" }
    )]
    MissingNeighbour {
        /// Id of the particle that lacks a neighbour.
        particle: usize,
        /// Id of the neighbour that it lacks.
        missing: usize,
        /// Most neighbours that any particle has.
        neighbours: usize,
        /// Corners of their cell.
        corners: usize,
    },
    /// Two particles that feel the same averaged dilatation do not see each other.
    #[error(
        "{neighbours} neighbours cannot carry a dilatation averaged over cells: particles {particle} and {missing} have cells that meet at a particle, but are no neighbours"
    )]
    MissingMate {
        /// Id of the particle that lacks a neighbour.
        particle: usize,
        /// Id of the neighbour that it lacks.
        missing: usize,
        /// Most neighbours that any particle has.
        neighbours: usize,
    },
    /// The cells do not hold the body together.
    #[error(transparent)]
    Mechanism(#[from] Mechanism),
    /// A cell has no stiffness.
    #[error("cell {cell} (counted from 1): {reason}")]
    Shape {
        /// Number of the cell, from 1.
        cell: usize,
        /// The fault of its corners.
        reason: ShapeError,
    },
    /// The cells around a particle give it no stiffness that can be inverted.
    #[error(
        "particle {particle} has a stiffness that is singular to the precision of a double: the cells around it are too slender or their stiffnesses too far apart"
    )]
    Singular {
        /// Id of the particle.
        particle: usize,
    },
}

impl WeightsError {
    /// The same of a part of `body`, in the whole of which a particle has as many neighbours at most.
    pub fn in_whole(self, body: &Body, most: usize) -> Self {
        let id = |particle: usize| body.id(particle - 1);
        match self {
            Self::MissingNeighbour { particle, missing, corners, .. } => Self::MissingNeighbour {
                particle: id(particle),
                missing: id(missing),
                neighbours: most,
                corners,
            },
            Self::MissingMate { particle, missing, .. } => {
                Self::MissingMate { particle: id(particle), missing: id(missing), neighbours: most }
            }
            Self::Singular { particle } => Self::Singular { particle: id(particle) },
            other => other,
        }
    }
}

impl MaterialWeights {
    /// Weights of a body cut from a lattice: one material throughout.
    ///
    /// `neighbours` are those the body was built with (see [`super::cells::neighbourhood`] for the
    /// fewest that will do); every particle that shares a cell must be among them. Refuses a body
    /// that its cells do not hold together; of a part of one that is for all parts to find out.
    pub fn assemble(
        cells: &Cells,
        body: &Body,
        neighbours: Neighbours,
        elastic: &Elastic,
    ) -> Result<Self, WeightsError> {
        let incidence = cells.incidence(body.count());
        if body.part.is_none() {
            require_rigid(cells, &incidence, &body.reference, |i| !body.is_frame[i])?;
        }
        let index = |i: usize| body.index(i);
        let assembly = Assembly::new((cells, &incidence), &neighbours, elastic, &index)?;
        let (class, first) = assembly.classes();
        // Every row is summed over its own cells in their order: the same bits on any number of threads.
        // Collected before looking: the first error in the order of particles, not the first to be found.
        let rows: Vec<Result<Row, WeightsError>> = first.par_iter().map(|&i| assembly.row(i)).collect();
        let rows = rows.into_iter().collect::<Result<_, _>>()?;
        let cells = assembly.cells_around(&first);
        Ok(Self { neighbours, class, rows, cells })
    }

    /// The row of a particle.
    pub fn of(&self, particle: usize) -> &Row {
        &self.rows[self.class[particle] as usize]
    }

    /// Bonds of a particle: the neighbour and `K_ij` \[force / length\].
    pub fn bonds(&self, particle: usize) -> impl Iterator<Item = (usize, &Block)> {
        let seen = self.neighbours.of(particle).iter().map(|&j| j as usize);
        seen.zip(&self.of(particle).blocks)
    }

    /// The weights `W_ij = D_i^-1 K_ij` \[1\] as the rule applies them; those of one particle sum to the
    /// identity.
    pub fn weights(&self) -> MatrixWeights {
        let mut weights = MatrixWeights {
            class: self.class.clone(),
            starts: vec![0],
            blocks: Vec::new(),
            stiffness: Vec::new(),
            compliance: self.rows.iter().map(|row| row.inverse).collect(),
            cells: None,
        };
        for row in &self.rows {
            weights.blocks.extend(row.blocks.iter().map(|block| product(&row.inverse, block)));
            weights.stiffness.extend(&row.blocks);
            weights.starts.push(weights.blocks.len() as u32);
        }
        weights
    }

    /// The weights of a corotated rule: those of [`MaterialWeights::weights`] and the cells around each particle.
    pub fn corotated_weights(&self) -> MatrixWeights {
        MatrixWeights { cells: Some(Box::new(self.cells.clone())), ..self.weights() }
    }

    /// Force of the neighbours on a particle, `sum_j K_ij (u_j - u_i)` \[force\], under displacements
    /// \[length\]: zero to the last bit if all move alike.
    pub fn force(&self, particle: usize, displacement: &Vectors) -> [f64; 2] {
        let here = displacement.get(particle);
        self.bonds(particle).fold([0.0; 2], |sum, (j, block)| {
            let there = displacement.get(j);
            let [x, y] = apply(block, [there[0] - here[0], there[1] - here[1]]);
            [sum[0] + x, sum[1] + y]
        })
    }

    /// Strain energy \[force length\] under displacements \[length\].
    pub fn energy(&self, displacement: &Vectors) -> f64 {
        let work = |i: usize| {
            let ([fx, fy], [x, y]) = (self.force(i, displacement), displacement.get(i));
            fx * x + fy * y
        };
        -0.5 * (0..self.class.len()).map(work).sum::<f64>()
    }
}

/// Those that one of `particles` particles feels, in order of index, and `K_ij` \[force / length\].
pub(super) fn bonds_of(
    particle: usize,
    (cells, particles): (&Cells, usize),
    elastic: &Elastic,
) -> Result<Vec<(u32, Block)>, WeightsError> {
    let (incidence, neighbours) = (cells.incidence(particles), cells.neighbours(particles, elastic));
    let row = Assembly::new((cells, &incidence), &neighbours, elastic, &|i| i)?.row(particle)?;
    Ok(neighbours.of(particle).iter().copied().zip(row.blocks).collect())
}
