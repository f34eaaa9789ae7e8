//! Cells and neighbours to the 2x2 weights of the rule.

mod assembly;

use rayon::prelude::*;

use assembly::{Assembly, Row};

use super::cells::Cells;
use super::elastic::Elastic;
use super::mechanism::{Mechanism, require_rigid};
use super::stiffness::ShapeError;
use crate::flock::block::{Block, product};
use crate::flock::body::Body;
use crate::flock::law::MatrixWeights;
use crate::flock::neighbourhood::Neighbours;
use crate::flock::rules::Rotation;

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
    pub fn in_whole(mut self, body: &Body, most: usize) -> Self {
        let id = |particle: usize| body.id(particle - 1);
        match &mut self {
            Self::MissingNeighbour { particle, missing, neighbours, .. }
            | Self::MissingMate { particle, missing, neighbours } => {
                (*particle, *missing, *neighbours) = (id(*particle), id(*missing), most);
            }
            Self::Singular { particle } => *particle = id(*particle),
            Self::Mechanism(_) | Self::Shape { .. } => {}
        }
        self
    }
}

/// The weights `W_ij = D_i^-1 K_ij` \[1\] of a body cut from a lattice, one material throughout: those of one particle
/// sum to the identity, those of a corotated rule come with the cells around each particle. A row depends
/// only on these cells, so particles fall into a few classes that share one; particles of a frame have
/// neither cells nor weights.
///
/// `neighbours` are those the body was built with (see [`super::cells::neighbourhood`] for the
/// fewest that will do); every particle that shares a cell must be among them. Between those that share none
/// `K_ij` is zero; `K_ji` is its transpose, to the bit.
///
/// # Errors
/// A body that its cells do not hold together, of a part of which all parts find it out together; cells that
/// the neighbours or the material do not fit.
pub fn assemble(
    cells: &Cells,
    body: &Body,
    neighbours: &Neighbours,
    elastic: &Elastic,
    rotation: Rotation,
) -> Result<MatrixWeights, WeightsError> {
    let incidence = cells.incidence(body.count());
    if body.part.is_none() {
        require_rigid(cells, &incidence, &body.reference, |i| !body.is_frame[i])?;
    }
    let index = |i: usize| body.index(i);
    let assembly = Assembly::new((cells, &incidence), neighbours, elastic, &index)?;
    let (class, first) = assembly.classes();
    // Every row is summed over its own cells in their order: the same bits on any number of threads.
    // Collected before looking: the first error in the order of particles, not the first to be found.
    let rows: Vec<Result<Row, WeightsError>> = first.par_iter().map(|&i| assembly.row(i)).collect();
    let around = || Box::new(assembly.cells_around(&first));
    let mut weights = MatrixWeights {
        class,
        starts: vec![0],
        blocks: Vec::new(),
        stiffness: Vec::new(),
        compliance: Vec::with_capacity(rows.len()),
        cells: None,
    };
    for row in rows {
        let (stiffness, compliance) = row?;
        weights.blocks.extend(stiffness.iter().map(|block| product(&compliance, block)));
        weights.stiffness.extend(stiffness);
        weights.compliance.push(compliance);
        weights.starts.push(weights.blocks.len() as u32);
    }
    // After the rows: where they stand, each corner of a cell is among the neighbours.
    weights.cells = (rotation == Rotation::Corotated).then(around);
    Ok(weights)
}

/// Those that one of `particles` particles feels, in order of index, and `K_ij` \[force / length\].
pub(super) fn bonds_of(
    particle: usize,
    (cells, particles): (&Cells, usize),
    elastic: &Elastic,
) -> Result<Vec<(u32, Block)>, WeightsError> {
    let (incidence, neighbours) = (cells.incidence(particles), cells.neighbours(particles, elastic));
    let (blocks, _) = Assembly::new((cells, &incidence), &neighbours, elastic, &|i| i)?.row(particle)?;
    Ok(neighbours.of(particle).iter().copied().zip(blocks).collect())
}
