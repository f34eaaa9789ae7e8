//! Cells and neighbours to the 2x2 weights of the rule.

use std::collections::HashMap;

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::cells::{Cells, Incidence};
use super::elastic::Elastic;
use super::mechanism::{Mechanism, require_rigid};
use super::stiffness::{ShapeError, mean_gradients};
use crate::flock::block::{Block, apply, inverse, plus, product};
use crate::flock::body::Body;
use crate::flock::cells_around::CellsAround;
use crate::flock::interaction::MatrixWeights;
use crate::flock::neighbourhood::Neighbours;
use crate::flock::points::Points;
use crate::flock::rules::{Element, OWN};

/// Particles whose classes one thread finds at a time.
const CHUNK: usize = 1 << 14;

/// The material as seen by each particle. A row depends only on the cells around its particle, so
/// particles fall into a few classes that share one; particles of a frame have neither cells nor
/// weights.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialWeights {
    /// Who sees whom, in the order in which it was asked for: the order of summation.
    pub neighbours: Neighbours,
    /// Class of each particle, shape \[count\].
    pub class: Vec<u32>,
    /// One row for each class, shape \[classes\].
    pub rows: Vec<Row>,
    /// The cells around the particles of each class.
    pub cells: CellsAround,
}

/// What the particles of a class feel.
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
        let assembly = Assembly { cells, incidence, neighbours: &neighbours, elements, factor };
        let (class, first) = assembly.classes();
        // Every row is summed over its own cells in their order: the same bits on any number of threads.
        // Collected before looking: the first error in the order of particles, not the first to be found.
        let rows: Vec<Result<Row, WeightsError>> = first.par_iter().map(|&i| assembly.row(i)).collect();
        let rows = rows.into_iter().collect::<Result<_, _>>()?;
        let cells = assembly.cells_around(&first);
        Ok(Self { neighbours, class, rows, cells })
    }

    pub fn count(&self) -> usize {
        self.class.len()
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
        MatrixWeights { cells: Some(self.cells.clone()), ..self.weights() }
    }

    /// Force of the neighbours on a particle, `sum_j K_ij (u_j - u_i)` \[force\], under displacements
    /// \[length\]: zero to the last bit if all move alike.
    pub fn force(&self, particle: usize, displacement: &Points) -> [f64; 2] {
        let here = displacement.get(particle);
        self.bonds(particle).fold([0.0; 2], |sum, (j, block)| {
            let there = displacement.get(j);
            let [x, y] = apply(block, [there[0] - here[0], there[1] - here[1]]);
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
        cells.element(kind, elastic.stiffness()).map_err(|reason| {
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

/// What tells the classes apart: which corner of which kind of cell the particle is, and where among its
/// neighbours the other corners are, packed; and how many neighbours there are.
type Pattern = (u128, u32);

impl Assembly<'_> {
    /// Class of each particle, and the first particle of each class.
    fn classes(&self) -> (Vec<u32>, Vec<usize>) {
        let count = self.neighbours.count();
        let chunks: Vec<usize> = (0..count).step_by(CHUNK).collect();
        let of_chunk = |&begin: &usize| {
            let mut known: HashMap<Pattern, u32> = HashMap::new();
            // Each pattern of the chunk with the first particle that has it; none has its own class.
            let mut first: Vec<(Option<Pattern>, usize)> = Vec::new();
            let of_particle = |i: usize| match self.pattern(i) {
                Some(pattern) => *known.entry(pattern).or_insert_with(|| {
                    first.push((Some(pattern), i));
                    first.len() as u32 - 1
                }),
                None => {
                    first.push((None, i));
                    first.len() as u32 - 1
                }
            };
            let class: Vec<u32> = (begin..count.min(begin + CHUNK)).map(of_particle).collect();
            (class, first)
        };
        let found: Vec<_> = chunks.par_iter().map(of_chunk).collect();
        let mut known: HashMap<Pattern, u32> = HashMap::new();
        let (mut class, mut first) = (Vec::with_capacity(count), Vec::new());
        for (of_chunk, first_of_chunk) in found {
            let mut add = |i: usize| {
                first.push(i);
                first.len() as u32 - 1
            };
            let global: Vec<u32> = first_of_chunk
                .into_iter()
                .map(|(pattern, i)| match pattern {
                    Some(pattern) => *known.entry(pattern).or_insert_with(|| add(i)),
                    None => add(i),
                })
                .collect();
            class.extend(of_chunk.into_iter().map(|local| global[local as usize]));
        }
        (class, first)
    }

    fn most_neighbours(&self) -> usize {
        (0..self.neighbours.count()).map(|i| self.neighbours.of(i).len()).max().unwrap_or(0)
    }

    /// `None` where cells differ in more than their kind, or do not fit the pattern.
    fn pattern(&self, particle: usize) -> Option<Pattern> {
        if self.factor.is_some() {
            return None;
        }
        let seen = self.neighbours.of(particle);
        let mut packed: u128 = 1;
        let mut push = |value: usize, bits: u32| {
            let fits = packed.leading_zeros() >= bits && value >> bits == 0;
            packed = (packed << bits) | value as u128;
            fits.then_some(())
        };
        for cell in self.incidence.of(particle).iter().map(|&cell| cell as usize) {
            let corners = self.cells.of(cell);
            let own = corners.iter().position(|&corner| corner as usize == particle)?;
            push(self.cells.kind[cell] as usize, 1)?;
            push(own, 3)?;
            for &corner in corners.iter().filter(|&&corner| corner as usize != particle) {
                push(seen.iter().position(|&j| j == corner)?, 5)?;
            }
        }
        Some((packed, seen.len() as u32))
    }

    /// The row of one particle; refuses a particle that does not see a corner of its cells.
    fn row(&self, particle: usize) -> Result<Row, WeightsError> {
        let seen = self.neighbours.of(particle);
        let mut blocks = vec![Block::default(); seen.len()];
        for cell in self.around(particle) {
            let (k, slots) = (&self.elements[self.cells.kind[cell] as usize], self.slots(particle, cell));
            let factor = self.factor(cell);
            let own = slots.iter().position(|&slot| slot == Some(OWN)).unwrap_or_default();
            for (other, slot) in slots.into_iter().enumerate().filter(|&(other, _)| other != own) {
                let Some(slot) = slot else {
                    return Err(WeightsError::MissingNeighbour {
                        particle: particle + 1,
                        missing: self.cells.of(cell)[other] as usize + 1,
                        neighbours: self.most_neighbours(),
                        corners: self.cells.of(cell).len(),
                    });
                };
                let slot = slot as usize;
                let entry = |a: usize, b: usize| -factor * k[(2 * own + a, 2 * other + b)];
                blocks[slot] = plus(&blocks[slot], &[[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]]);
            }
        }
        let diagonal = blocks.iter().fold(Block::default(), |sum, block| plus(&sum, block));
        let inverse = match inverse(&diagonal) {
            Some(inverse) => inverse,
            None if self.around(particle).next().is_none() => Block::default(),
            None => return Err(WeightsError::Singular { particle: particle + 1 }),
        };
        Ok(Row { blocks, diagonal, inverse })
    }

    fn around(&self, particle: usize) -> impl Iterator<Item = usize> {
        self.incidence.of(particle).iter().map(|&cell| cell as usize)
    }

    fn factor(&self, cell: usize) -> f64 {
        self.factor.map_or(1.0, |factor| factor[cell])
    }

    /// Which neighbour of a particle each corner of a cell is, [`OWN`] for itself, shape \[corners\].
    fn slots(&self, particle: usize, cell: usize) -> Vec<Option<u32>> {
        let seen = self.neighbours.of(particle);
        let slot = |&corner: &u32| match corner as usize == particle {
            true => Some(OWN),
            false => seen.iter().position(|&j| j == corner).map(|slot| slot as u32),
        };
        self.cells.of(cell).iter().map(slot).collect()
    }

    /// The cells around one particle of each class, all of whose corners it sees.
    fn cells_around(&self, first: &[usize]) -> CellsAround {
        let kinds = self.elements.iter().zip(&self.cells.shapes);
        let elements = kinds.map(|(k, shape)| {
            let entry = |a: usize, b: usize| {
                let (a, b) = (2 * a, 2 * b);
                [[k[(a, b)], k[(a, b + 1)]], [k[(a + 1, b)], k[(a + 1, b + 1)]]]
            };
            let corners = shape.len();
            let stiffness = (0..corners * corners).map(|n| entry(n / corners, n % corners)).collect();
            Element { stiffness, gradients: mean_gradients(shape) }
        });
        let mut around = CellsAround::new(elements.collect());
        for &particle in first {
            for cell in self.around(particle) {
                let slots: Vec<u32> =
                    self.slots(particle, cell).into_iter().map(Option::unwrap_or_default).collect();
                let own = slots.iter().position(|&slot| slot == OWN).unwrap_or_default();
                around.push(self.cells.kind[cell], own, &slots, self.factor(cell));
            }
            around.end_class();
        }
        around
    }
}
