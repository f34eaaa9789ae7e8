//! Cells and neighbours to the 2x2 weights of the rule.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::cells::{Cells, Incidence};
use super::elastic::Elastic;
use super::mechanism::{Mechanism, require_rigid};
use super::stiffness::{ShapeError, element};
use crate::flock::block::{Block, apply, inverse, plus, product};
use crate::flock::body::Body;
use crate::flock::neighbourhood::Neighbours;
use crate::flock::points::Points;

/// Particles whose rows one thread puts together at a time.
const CHUNK: usize = 4096;

/// First particle of a chunk, then its blocks, `D_i` and `D_i^-1`.
type Chunk<'a> = (usize, &'a mut [Block], &'a mut [Block], &'a mut [Block]);

/// The material as seen by each particle. All arrays follow the particles or the bonds of
/// `neighbours`; particles of a frame have neither cells nor weights.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialWeights {
    /// Who sees whom, in the order in which it was asked for: the order of summation.
    pub neighbours: Neighbours,
    /// `K_ij` \[force / length\], parallel to the neighbours' index list, shape \[bonds\]. Zero between
    /// neighbours that share no cell. `K_ji` is the transpose of `K_ij`, to the bit.
    pub blocks: Vec<Block>,
    /// `D_i = sum_j K_ij` \[force / length\], shape \[count\].
    pub diagonal: Vec<Block>,
    /// `D_i^-1` \[length / force\], shape \[count\].
    pub inverse: Vec<Block>,
}

/// Why cells and neighbours make no material rule. Particles are named by their ids, which count from 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum WeightsError {
    #[error(
        "{neighbours} neighbours cannot carry shear coupling: particles {particle} and {missing} share a cell but are no neighbours, so {}; ask for everybody with whom a particle shares a cell",
        if *.corners == 4 { "the cell's diagonal pairs are missing" } else { "the cell's stiffness is cut" }
    )]
    MissingNeighbour { particle: usize, missing: usize, neighbours: usize, corners: usize },
    #[error(transparent)]
    Mechanism(#[from] Mechanism),
    #[error("cell {cell} (counted from 1): {reason}")]
    Shape { cell: usize, reason: ShapeError },
    #[error(
        "particle {particle} has a stiffness that is singular to the precision of a double: the cells around it are too slender or their stiffnesses too far apart"
    )]
    Singular { particle: usize },
    #[error("{given} stiffness factors were given for {cells} cells")]
    FactorCount { given: usize, cells: usize },
    #[error(
        "the stiffness factor of cell {cell} (counted from 1) must be positive and finite, but it is {value}"
    )]
    Factor { cell: usize, value: f64 },
}

impl MaterialWeights {
    /// Weights of a body cut from a lattice: one material throughout.
    ///
    /// `neighbours` are those the body was built with (see [`super::cells::neighbourhood`] for the
    /// fewest that will do); whoever shares a cell with a particle must be among them. Refuses a body
    /// that its cells do not hold together.
    pub fn assemble(
        cells: &Cells,
        body: &Body,
        neighbours: Neighbours,
        elastic: &Elastic,
    ) -> Result<Self, WeightsError> {
        let incidence = cells.incidence(body.count());
        require_rigid(cells, &incidence, &body.reference, |i| !body.is_frame[i])?;
        Self::gather(cells, &incidence, neighbours, elastic, None)
    }

    /// Weights of cells at any points, with a stiffness factor for each cell where given, shape
    /// \[cells\] (a contrast of materials, damage). Neighbours are [`Cells::mates`].
    pub fn on_points(
        cells: &Cells,
        reference: &Points,
        elastic: &Elastic,
        factor: Option<&[f64]>,
    ) -> Result<Self, WeightsError> {
        let cells = cells.on_points(reference);
        let incidence = cells.incidence(reference.len());
        require_rigid(&cells, &incidence, reference, |_| true)?;
        Self::gather(&cells, &incidence, cells.mates(reference.len()), elastic, factor)
    }

    fn gather(
        cells: &Cells,
        incidence: &Incidence,
        neighbours: Neighbours,
        elastic: &Elastic,
        factor: Option<&[f64]>,
    ) -> Result<Self, WeightsError> {
        check_factor(cells, factor)?;
        let elements = elements(cells, elastic)?;
        let count = neighbours.count();
        let mut weights = Self {
            blocks: vec![Block::default(); neighbours.index.len()],
            diagonal: vec![Block::default(); count],
            inverse: vec![Block::default(); count],
            neighbours,
        };
        let mut rest = weights.blocks.as_mut_slice();
        let mut chunks = Vec::new();
        let (diagonal, inverse) = (weights.diagonal.chunks_mut(CHUNK), weights.inverse.chunks_mut(CHUNK));
        for (chunk, (diagonal, inverse)) in diagonal.zip(inverse).enumerate() {
            let (first, starts) = (chunk * CHUNK, &weights.neighbours.starts);
            let bonds = starts[first + diagonal.len()] - starts[first];
            let (blocks, after) = rest.split_at_mut(bonds as usize);
            rest = after;
            chunks.push((first, blocks, diagonal, inverse));
        }
        // Every row is summed over its own cells in their order: the same bits on any number of threads.
        let assembly = Assembly { cells, incidence, neighbours: &weights.neighbours, elements, factor };
        let fill = |(first, mut blocks, diagonal, inverse): Chunk<'_>| {
            for (k, (diagonal, inverse)) in diagonal.iter_mut().zip(inverse).enumerate() {
                let (row, after) = blocks.split_at_mut(assembly.neighbours.of(first + k).len());
                blocks = after;
                (*diagonal, *inverse) = assembly.row(first + k, row)?;
            }
            Ok(())
        };
        // Collected before looking: the first error in the order of particles, not the first to be found.
        let outcomes: Vec<Result<(), WeightsError>> = chunks.into_par_iter().map(fill).collect();
        outcomes.into_iter().collect::<Result<(), _>>()?;
        Ok(weights)
    }

    pub fn count(&self) -> usize {
        self.diagonal.len()
    }

    /// `W_ij = D_i^-1 K_ij` \[1\] of a bond; those of one particle sum to the identity.
    pub fn weight(&self, particle: usize, bond: usize) -> Block {
        product(&self.inverse[particle], &self.blocks[bond])
    }

    /// All weights `W_ij` \[1\], parallel to the neighbours' index list, shape \[bonds\].
    pub fn weights(&self) -> Vec<Block> {
        let of_particle = |i: usize| self.neighbours.bonds(i).map(move |bond| self.weight(i, bond));
        (0..self.count()).flat_map(of_particle).collect()
    }

    /// What is added to the matrix-weighted mean of the neighbours' positions \[length\], shape \[count\]:
    /// `X_i - sum_j W_ij X_j`, and `D_i^-1 f_i` where there are `forces` \[force\], shape \[count\].
    pub fn rest_offsets(&self, reference: &Points, forces: Option<&Points>) -> Points {
        let offset = |i: usize| {
            let here = reference.get(i);
            let mut pull = forces.map_or([0.0; 2], |forces| forces.get(i));
            for bond in self.neighbours.bonds(i) {
                let there = reference.get(self.neighbours.index[bond] as usize);
                let [x, y] = apply(&self.blocks[bond], [here[0] - there[0], here[1] - there[1]]);
                pull = [pull[0] + x, pull[1] + y];
            }
            apply(&self.inverse[i], pull)
        };
        (0..self.count()).map(offset).collect()
    }

    /// `D_i^-1 f_i` \[length\], shape \[count\]: how far a load alone moves a particle whose neighbours
    /// stay. Added to a rest offset computed elsewhere.
    pub fn load_offsets(&self, forces: &Points) -> Points {
        (0..self.count()).map(|i| apply(&self.inverse[i], forces.get(i))).collect()
    }

    /// Force of the neighbours on a particle, `sum_j K_ij (u_j - u_i)` \[force\], under displacements
    /// \[length\]: zero to the last bit if all move alike.
    pub fn force(&self, particle: usize, displacement: &Points) -> [f64; 2] {
        let here = displacement.get(particle);
        let bonds = self.neighbours.bonds(particle);
        bonds.fold([0.0; 2], |sum, bond| {
            let there = displacement.get(self.neighbours.index[bond] as usize);
            let [x, y] = apply(&self.blocks[bond], [there[0] - here[0], there[1] - here[1]]);
            [sum[0] + x, sum[1] + y]
        })
    }

    /// Strain energy \[force length\] under displacements \[length\].
    pub fn energy(&self, displacement: &Points) -> f64 {
        let work = |i: usize| {
            let ([fx, fy], [x, y]) = (self.force(i, displacement), displacement.get(i));
            fx * x + fy * y
        };
        -0.5 * (0..self.count()).map(work).sum::<f64>()
    }
}

fn check_factor(cells: &Cells, factor: Option<&[f64]>) -> Result<(), WeightsError> {
    let Some(factor) = factor else { return Ok(()) };
    if factor.len() != cells.count() {
        return Err(WeightsError::FactorCount { given: factor.len(), cells: cells.count() });
    }
    match factor.iter().position(|f| !(*f > 0.0 && f.is_finite())) {
        Some(cell) => Err(WeightsError::Factor { cell: cell + 1, value: factor[cell] }),
        None => Ok(()),
    }
}

/// Element stiffness of each shape.
fn elements(cells: &Cells, elastic: &Elastic) -> Result<Vec<DMatrix<f64>>, WeightsError> {
    let of_kind = |kind: usize| {
        element(&cells.shapes[kind], elastic.stiffness()).map_err(|reason| {
            let cell = cells.kind.iter().position(|&k| k as usize == kind).map_or(0, |cell| cell + 1);
            WeightsError::Shape { cell, reason }
        })
    };
    let outcomes: Vec<_> = (0..cells.shapes.len()).into_par_iter().map(of_kind).collect();
    outcomes.into_iter().collect()
}

/// What the rows are put together from.
struct Assembly<'a> {
    cells: &'a Cells,
    incidence: &'a Incidence,
    neighbours: &'a Neighbours,
    elements: Vec<DMatrix<f64>>,
    factor: Option<&'a [f64]>,
}

impl Assembly<'_> {
    /// Adds the blocks `K_ij` of one particle to `blocks`, in the order of its neighbours; returns `D_i`
    /// and its inverse.
    fn row(&self, particle: usize, blocks: &mut [Block]) -> Result<(Block, Block), WeightsError> {
        let (cells, seen) = (self.cells, self.neighbours.of(particle));
        let around = self.incidence.of(particle);
        for cell in around.iter().map(|&cell| cell as usize) {
            let (corners, k) = (cells.of(cell), &self.elements[cells.kind[cell] as usize]);
            let factor = self.factor.map_or(1.0, |factor| factor[cell]);
            let own = corners.iter().position(|&corner| corner as usize == particle).unwrap_or_default();
            for (other, &corner) in corners.iter().enumerate().filter(|&(other, _)| other != own) {
                let Some(slot) = seen.iter().position(|&j| j == corner) else {
                    return Err(WeightsError::MissingNeighbour {
                        particle: particle + 1,
                        missing: corner as usize + 1,
                        neighbours: seen.len(),
                        corners: cells.corners,
                    });
                };
                let entry = |a: usize, b: usize| -factor * k[(2 * own + a, 2 * other + b)];
                blocks[slot] = plus(&blocks[slot], &[[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]]);
            }
        }
        let diagonal = blocks.iter().fold(Block::default(), |sum, block| plus(&sum, block));
        match inverse(&diagonal) {
            Some(inverse) => Ok((diagonal, inverse)),
            None if around.is_empty() => Ok((diagonal, Block::default())),
            None => Err(WeightsError::Singular { particle: particle + 1 }),
        }
    }
}
