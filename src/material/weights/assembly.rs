//! Rows put together from cells, one for each class of particles.

use std::collections::HashMap;

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::WeightsError;
use crate::flock::block::{Block, inverse, plus};
use crate::flock::cells_around::CellsAround;
use crate::flock::neighbourhood::Neighbours;
use crate::flock::rules::{Element, OWN, weighted};
use crate::material::cells::{Cells, Incidence};
use crate::material::dilatation::Patches;
use crate::material::elastic::Elastic;
use crate::material::stiffness::mean_gradients;

/// Particles whose classes one thread finds at a time.
const CHUNK: usize = 1 << 14;

/// The stiffness that the particles of a class feel: `K_ij` \[force / length\] in the order of the particle's neighbours, and
/// the inverse of their sum `D_i` \[length / force\].
pub(super) type Row = (Vec<Block>, Block);

/// The parts that the rows are put together from.
pub(super) struct Assembly<'a> {
    pub cells: &'a Cells,
    pub incidence: &'a Incidence,
    pub neighbours: &'a Neighbours,
    /// By kind: stiffness and mean gradients.
    pub elements: Vec<DMatrix<f64>>,
    pub gradients: Vec<Vec<[f64; 2]>>,
    /// Over which cells dilatations are averaged.
    pub averaged: Option<Patches<'a>>,
    /// The index of a particle in the whole body, in the order of which all is summed.
    pub index: &'a (dyn Fn(usize) -> usize + Sync),
}

/// Cells whose dilatations are averaged.
struct Patch {
    /// Lambda over the area \[force / length^3\].
    stiffness: f64,
    /// Of the strain that is averaged: see [`Averaged`](crate::material::elastic::Averaged).
    weights: [f64; 3],
    parts: Vec<Part>,
}

struct Part {
    cell: usize,
    /// \[length^2\]
    share: f64,
}

/// The key of a class: which corner of which kind of cell the particle is, and where among its
/// neighbours the other corners are; and how many neighbours there are.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
enum Pattern {
    /// Of the cells around the particle, packed.
    Packed(u128, u32),
    /// Of those around its cell_neighbours as well.
    Long(Box<[u8]>),
}

impl<'a> Assembly<'a> {
    /// The parts for the rows of these cells in this material.
    ///
    /// # Errors
    /// A cell that has no stiffness.
    pub fn new(
        (cells, incidence): (&'a Cells, &'a Incidence),
        neighbours: &'a Neighbours,
        elastic: &Elastic,
        index: &'a (dyn Fn(usize) -> usize + Sync),
    ) -> Result<Self, WeightsError> {
        let elements = elements(cells, elastic)?;
        let gradients = cells.shapes.iter().map(|shape| mean_gradients(shape)).collect();
        let averaged = Patches::new(cells, incidence, neighbours.count(), elastic);
        Ok(Self { cells, incidence, neighbours, elements, gradients, averaged, index })
    }

    /// Class of each particle, and the first particle of each class.
    pub fn classes(&self) -> (Vec<u32>, Vec<usize>) {
        let count = self.neighbours.count();
        let chunks: Vec<usize> = (0..count).step_by(CHUNK).collect();
        let of_chunk = |&begin: &usize| {
            let mut known: HashMap<Pattern, u32> = HashMap::new();
            // Each pattern of the chunk with the first particle that has it; none has its own class.
            let mut first: Vec<(Option<Pattern>, usize)> = Vec::new();
            let of_particle = |i: usize| match self.pattern(i) {
                Some(pattern) => *known.entry(pattern.clone()).or_insert_with(|| {
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
        if self.averaged.is_some() {
            return self.long_pattern(particle);
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
            // Of six triangles, the most, just what 128 bits hold.
            push(self.cells.kind[cell] as usize, 8)?;
            push(own, 3)?;
            for &corner in corners.iter().filter(|&&corner| corner as usize != particle) {
                push(seen.iter().position(|&j| j == corner)?, 5)?;
            }
        }
        Some(Pattern::Packed(packed, seen.len() as u32))
    }

    /// The pattern of all cells that a particle feels through averaged dilatations; none beside cells that an outline has
    /// cut, which are of many kinds.
    fn long_pattern(&self, particle: usize) -> Option<Pattern> {
        let mut pattern = vec![u8::try_from(self.neighbours.of(particle).len()).ok()?];
        let mut push = |cell: usize, count: usize| {
            let whole = |kind: &u8| usize::from(*kind) < self.cells.whole;
            pattern.push(u8::try_from(self.cells.kind[cell]).ok().filter(whole)?);
            pattern.push(u8::try_from(count).ok()?);
            for slot in self.slots(particle, cell) {
                pattern.push(if slot? == OWN { u8::MAX } else { u8::try_from(slot?).ok()? });
            }
            Some(())
        };
        self.around(particle).try_for_each(|cell| push(cell, 0))?;
        for patch in self.patches(particle) {
            for (k, part) in patch.parts.iter().enumerate() {
                // The parity marks where a patch begins; the rest is the number of patches that the cell is in.
                let averaged = self.averaged.as_ref()?;
                push(part.cell, 8 * averaged.middles(part.cell).count() + usize::from(k == 0))?;
            }
        }
        Some(Pattern::Long(pattern.into()))
    }

    /// The patches that a particle feels, alike for all particles that feel one.
    fn patches(&self, particle: usize) -> Vec<Patch> {
        let Some(patches) = &self.averaged else { return Vec::new() };
        let mut middles: Vec<usize> = self.around(particle).flat_map(|cell| patches.middles(cell)).collect();
        middles.sort_unstable_by_key(|&middle| (self.index)(middle));
        middles.dedup();
        let around = middles.into_iter().flat_map(|middle| patches.around(middle));
        let own = |cell: &usize| self.cells.of(*cell).contains(&(particle as u32));
        let felt = around.filter(|patch| patch.iter().any(own));
        let of_cells = |cells: Vec<usize>| {
            let averaged = patches.averaged(cells[0])?;
            let part = |cell: usize| Part { cell, share: patches.share(cell) };
            let parts: Vec<Part> = cells.into_iter().map(part).collect();
            let area: f64 = parts.iter().map(|part| part.share).sum();
            Some(Patch { stiffness: averaged.stiffness / area, weights: averaged.weights, parts })
        };
        felt.filter_map(of_cells).collect()
    }

    /// Adds the averaged dilatations to the row of a particle: `k v_i v_j'` for each patch, `v` the sum over its cells
    /// of share times mean gradient, with the weights of the strain. The sums run in the same order for either of two particles: no bit of `K_ij` differs
    /// from that of the transpose of `K_ji`.
    fn add_patches(&self, particle: usize, blocks: &mut [Block]) -> Result<(), WeightsError> {
        for Patch { stiffness, weights, parts } in self.patches(particle) {
            let mut v: Vec<(u32, [f64; 2])> = Vec::new();
            for Part { cell, share } in parts {
                let kind = self.cells.kind[cell] as usize;
                for (corner, slot) in self.slots(particle, cell).into_iter().enumerate() {
                    let slot = slot.ok_or_else(|| WeightsError::MissingMate {
                        particle: particle + 1,
                        missing: self.cells.of(cell)[corner] as usize + 1,
                        neighbours: self.most_neighbours(),
                    })?;
                    let [x, y] = weighted(weights, self.gradients[kind][corner]).map(|g| share * g);
                    match v.iter_mut().find(|(known, _)| *known == slot) {
                        Some((_, sum)) => *sum = [sum[0] + x, sum[1] + y],
                        None => v.push((slot, [x, y])),
                    }
                }
            }
            let own = v.iter().find(|(slot, _)| *slot == OWN).map_or([0.0; 2], |(_, v)| *v);
            for &(slot, other) in v.iter().filter(|(slot, _)| *slot != OWN) {
                let block = own.map(|a| other.map(|b| -stiffness * (a * b)));
                blocks[slot as usize] = plus(&blocks[slot as usize], &block);
            }
        }
        Ok(())
    }

    /// The row of one particle; refuses a particle that does not see a corner of its cells.
    pub fn row(&self, particle: usize) -> Result<Row, WeightsError> {
        let seen = self.neighbours.of(particle);
        let mut blocks = vec![Block::default(); seen.len()];
        for cell in self.around(particle) {
            let (k, slots) = (&self.elements[self.cells.kind[cell] as usize], self.slots(particle, cell));
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
                let entry = |a: usize, b: usize| -k[(2 * own + a, 2 * other + b)];
                blocks[slot] = plus(&blocks[slot], &[[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]]);
            }
        }
        self.add_patches(particle, &mut blocks)?;
        let diagonal = blocks.iter().fold(Block::default(), |sum, block| plus(&sum, block));
        let inverse = match inverse(&diagonal) {
            Some(inverse) => inverse,
            None if self.around(particle).next().is_none() => Block::default(),
            None => return Err(WeightsError::Singular { particle: particle + 1 }),
        };
        Ok((blocks, inverse))
    }

    fn around(&self, particle: usize) -> impl Iterator<Item = usize> {
        self.incidence.of(particle).iter().map(|&cell| cell as usize)
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

    /// The stiffness of each kind of cell, for a rule that turns with them.
    fn elements(&self) -> Vec<Element> {
        let of_kind = |(kind, k): (usize, &DMatrix<f64>)| {
            let corners = self.gradients[kind].len();
            let block = |n: usize| {
                let (a, b) = (2 * (n / corners), 2 * (n % corners));
                [[k[(a, b)], k[(a, b + 1)]], [k[(a + 1, b)], k[(a + 1, b + 1)]]]
            };
            Element {
                stiffness: (0..corners * corners).map(block).collect(),
                gradients: self.gradients[kind].clone(),
            }
        };
        self.elements.iter().enumerate().map(of_kind).collect()
    }

    /// The cells and patches around one particle of each class, all of whose corners it sees.
    pub fn cells_around(&self, first: &[usize]) -> CellsAround {
        let mut around = CellsAround::new(self.elements());
        for &particle in first {
            let slots = |cell: usize| -> Vec<u32> {
                self.slots(particle, cell).into_iter().map(Option::unwrap_or_default).collect()
            };
            for cell in self.around(particle) {
                let slots = slots(cell);
                let own = slots.iter().position(|&slot| slot == OWN).unwrap_or_default();
                around.push(self.cells.kind[cell], own, &slots);
            }
            for Patch { stiffness, weights, parts } in self.patches(particle) {
                let of_part = |part: &Part| (self.cells.kind[part.cell], part.share, slots(part.cell));
                around.push_patch((stiffness, weights), parts.iter().map(of_part));
            }
            around.end_class();
        }
        around
    }
}

/// Element stiffness of each shape.
fn elements(cells: &Cells, elastic: &Elastic) -> Result<Vec<DMatrix<f64>>, WeightsError> {
    let of_kind = |kind: usize| {
        cells.element(kind, elastic).map_err(|reason| {
            let cell = cells.kind.iter().position(|&k| k as usize == kind).map_or(0, |cell| cell + 1);
            WeightsError::Shape { cell, reason }
        })
    };
    let outcomes: Vec<_> = (0..cells.shapes.len()).into_par_iter().map(of_kind).collect();
    outcomes.into_iter().collect()
}
