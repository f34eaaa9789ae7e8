//! Neighbours, weights and rule: everything that turns present positions into a target.

use std::sync::Arc;

use super::block::{Block, IDENTITY, apply, inverse as invert, plus, product};
use super::cells_around::CellsAround;
use super::fracture::{Bonds, Ghosts};
use super::neighbourhood::Neighbours;
use super::rules::{
    CellAround, Corner, Load, Mean, Neighbour, OWN, ParticleState, PatchCell, Rotation, Rule, pull,
};
use super::vectors::Vectors;

/// The arrays and index lists that a sweep runs over; it knows particles, not lattices.
#[derive(Clone, Debug)]
pub struct Flock {
    /// The mean and the terms added to it.
    pub rule: Rule,
    /// Reference positions \[length\], shape \[count\].
    pub reference: Arc<Vectors>,
    /// Which particle sees which, in summation order.
    pub neighbours: Neighbours,
    /// How much each neighbour counts.
    pub weights: Weights,
    /// Loads on the particles of a material \[force\], shape \[count\].
    pub forces: Option<Vectors>,
    /// Rest offsets \[length\], shape \[count\]; all zero where absent.
    pub rest: Option<Vectors>,
    /// Whether rest offsets keep an unloaded body in place, also where bonds break and no ghost stands in.
    pub keeps_rest: bool,
    /// Broken bonds; none can break where absent.
    pub bonds: Option<Bonds>,
}

/// The material that looks at nothing but weights and positions.
const SMALL: Mean = Mean::Material { rotation: Rotation::Small };

/// The material that looks at the cells around a particle.
const COROTATED: Mean = Mean::Material { rotation: Rotation::Corotated };

/// Fixed weights of the neighbours.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Weights {
    /// All count the same.
    #[default]
    Equal,
    /// Parallel to the neighbours' index list, shape \[bonds\].
    Scalar(Vec<f64>),
    /// Matrices of a material. They take memory by class, not by particle.
    Matrix(MatrixWeights),
}

/// Matrix weights. Particles with the same cells around them have the same weights, so on a lattice a
/// few classes of particles hold them all.
#[derive(Clone, Debug, PartialEq)]
pub struct MatrixWeights {
    /// Class of each particle, shape \[count\].
    pub class: Vec<u32>,
    /// Where each class begins in `blocks`, shape \[classes + 1\].
    pub starts: Vec<u32>,
    /// `W_ij = D_i^-1 K_ij` \[1\] in the order of the particle's neighbours.
    pub blocks: Vec<Block>,
    /// `K_ij` \[force / length\], parallel to `blocks`: what solvers work with, since it is symmetric.
    pub stiffness: Vec<Block>,
    /// `D_i^-1` \[length / force\], shape \[classes\].
    pub compliance: Vec<Block>,
    /// The cells around the particles of each class, for a corotated rule alone.
    pub cells: Option<Box<CellsAround>>,
}

impl MatrixWeights {
    /// Weights of a particle, parallel to its neighbours.
    #[inline]
    pub fn of(&self, particle: usize) -> &[Block] {
        &self.blocks[self.range(particle)]
    }

    /// Stiffnesses of a particle, parallel to its neighbours.
    pub fn stiffness_of(&self, particle: usize) -> &[Block] {
        &self.stiffness[self.range(particle)]
    }

    /// The cells around a particle; none for a rule that does not turn with them.
    pub fn cells_around(&self, particle: usize) -> impl Iterator<Item = CellAround<'_>> + Clone {
        let class = self.class[particle] as usize;
        self.cells.iter().flat_map(move |cells| cells.of(class))
    }

    /// The patches that a particle feels, whose dilatations are averaged: stiffness \[force / length^3\] and cells.
    pub(crate) fn patches_around(
        &self,
        particle: usize,
    ) -> impl Iterator<Item = (f64, impl Iterator<Item = PatchCell<'_>> + Clone)> + Clone {
        let class = self.class[particle] as usize;
        self.cells.iter().flat_map(move |cells| cells.patches_of(class))
    }

    #[inline]
    fn range(&self, particle: usize) -> std::ops::Range<usize> {
        let class = self.class[particle] as usize;
        self.starts[class] as usize..self.starts[class + 1] as usize
    }

    /// Gives a particle a class of its own, in which the components that are `held` stay where they are and the other
    /// one moves as if they did.
    pub fn hold(&mut self, particle: usize, held: [bool; 2]) {
        let range = self.range(particle);
        let stiffness: Vec<Block> = self.stiffness[range].to_vec();
        let diagonal = stiffness.iter().fold(Block::default(), |sum, block| plus(&sum, block));
        let mut compliance = Block::default();
        match held {
            [false, true] => compliance[0][0] = 1.0 / diagonal[0][0],
            [true, false] => compliance[1][1] = 1.0 / diagonal[1][1],
            _ => {}
        }
        if let Some(cells) = &mut self.cells {
            cells.copy_class(self.class[particle] as usize);
        }
        self.class[particle] = self.compliance.len() as u32;
        self.compliance.push(compliance);
        self.blocks.extend(stiffness.iter().map(|block| product(&compliance, block)));
        self.stiffness.extend(stiffness);
        self.starts.push(self.blocks.len() as u32);
    }

    /// The components of a particle that the rule keeps where its rest offset says: those that no force moves.
    pub fn held(&self, particle: usize) -> [bool; 2] {
        let compliance = self.compliance(particle);
        [0, 1].map(|axis| compliance[axis][axis] == 0.0)
    }

    /// How far the free component of a particle is moved back for each unit by which the held one, `axis`, is moved \[1\].
    fn coupling(&self, particle: usize, axis: usize) -> f64 {
        let free = 1 - axis;
        let row = self.stiffness_of(particle).iter().fold(0.0, |sum, block| sum + block[free][axis]);
        self.compliance(particle)[free][free] * row
    }

    /// How far a force moves the particle while its neighbours stay, `D^-1` \[length / force\].
    pub fn compliance(&self, particle: usize) -> Block {
        self.compliance[self.class[particle] as usize]
    }
}

impl Weights {
    fn scalar(&self, bond: usize) -> f64 {
        match self {
            Weights::Scalar(weights) => weights[bond],
            Weights::Equal | Weights::Matrix(_) => 1.0,
        }
    }

    /// Of bond number `k` of a particle.
    fn matrix(&self, particle: usize, k: usize) -> Block {
        match self {
            Weights::Matrix(weights) => weights.of(particle)[k],
            Weights::Equal | Weights::Scalar(_) => IDENTITY,
        }
    }
}

impl Flock {
    /// Without loads, rest offsets and bonds.
    pub fn new(rule: Rule, reference: Arc<Vectors>, neighbours: Neighbours, weights: Weights) -> Self {
        Self {
            rule,
            reference,
            neighbours,
            weights,
            forces: None,
            rest: None,
            keeps_rest: false,
            bonds: None,
        }
    }

    /// Target position of `particle` when all stand at `present` \[length, world frame\].
    pub fn target(&self, particle: usize, present: &Vectors) -> [f64; 2] {
        self.target_by(&self.rule, particle, present)
    }

    /// Target position by another rule over the same neighbours and weights.
    #[inline]
    pub(crate) fn target_by(&self, rule: &Rule, particle: usize, present: &Vectors) -> [f64; 2] {
        let own = ParticleState {
            present: present.get(particle),
            reference: self.reference.get(particle),
            rest: self.rest.as_ref().map_or([0.0; 2], |rest| rest.get(particle)),
            load: self.load(particle),
        };
        if let (COROTATED, Weights::Matrix(weights)) = (rule.mean, &self.weights) {
            let pulled = self.pulled(weights, particle, present);
            return rule.target_by_cells(&own, pulled, weights.held(particle));
        }
        let broken = self.bonds.as_ref().filter(|bonds| bonds.any_broken());
        match (broken, &self.weights) {
            (Some(bonds), Weights::Equal) if rule.mean == Mean::Barycentre => {
                let seen = self.places_with_ghosts(particle, present, bonds);
                rule.target(&own, seen.map(|(_, place)| Neighbour::at(place)))
            }
            (Some(bonds), _) => rule.target(&own, self.seen_with_ghosts(particle, present, bonds)),
            (None, Weights::Matrix(weights)) if rule.mean == SMALL => {
                let seen = self.neighbours.of(particle).iter().map(|&k| present.get(k as usize));
                rule.target_of_material(&own, weights.of(particle).iter().copied().zip(seen))
            }
            // Without weights a mean looks at places alone: the same bits without fetching the rest.
            (None, Weights::Equal) => {
                let seen = self.neighbours.of(particle).iter().map(|&k| present.get(k as usize));
                rule.target(&own, seen.map(Neighbour::at))
            }
            _ => rule.target(&own, self.seen(particle, present)),
        }
    }

    /// Force of a material on a particle when all stand at `present` \[force, world frame\]: on one that rests, minus its
    /// load; on one that is held, minus its load and its reaction. Zero for a rule that is no material.
    pub fn force(&self, particle: usize, present: &Vectors) -> [f64; 2] {
        self.force_from(particle, |slot| self.corner(particle, slot, present))
    }

    /// The same when all are displaced by so much from their reference places \[length\]: to more digits where that is
    /// little.
    pub fn force_under(&self, particle: usize, displacement: &Vectors) -> [f64; 2] {
        let from =
            |points: &Vectors, j: usize| [points.x[j] - points.x[particle], points.y[j] - points.y[particle]];
        self.force_from(particle, |slot| {
            let j = self.neighbours.of(particle)[slot] as usize;
            Corner { reference: from(&self.reference, j), displacement: from(displacement, j) }
        })
    }

    /// What neighbours pull with and push with, sizes added up, when all are displaced by so much \[force\]: what rounding is a part of.
    pub fn pulls_under(&self, particle: usize, displacement: &Vectors) -> f64 {
        let Weights::Matrix(weights) = &self.weights else { return 0.0 };
        let size = |j: usize| displacement.get(j).map(f64::abs);
        let seen = self.neighbours.of(particle).iter().zip(weights.stiffness_of(particle));
        let pulls = seen.map(|(&j, block)| {
            let [here, there] = [size(particle), size(j as usize)];
            let [x, y] = apply(&block.map(|row| row.map(f64::abs)), [here[0] + there[0], here[1] + there[1]]);
            x.hypot(y)
        });
        pulls.sum()
    }

    fn force_from(&self, particle: usize, corner: impl Fn(usize) -> Corner + Copy) -> [f64; 2] {
        match &self.weights {
            Weights::Matrix(weights) if self.rule.mean == COROTATED => {
                pull(weights.cells_around(particle), weights.patches_around(particle), corner).0
            }
            Weights::Matrix(weights) => {
                weights.stiffness_of(particle).iter().enumerate().fold([0.0; 2], |sum, (slot, block)| {
                    let [x, y] = apply(block, corner(slot).displacement);
                    [sum[0] + x, sum[1] + y]
                })
            }
            Weights::Equal | Weights::Scalar(_) => [0.0; 2],
        }
    }

    /// Target position of `particle` by those of its neighbours alone that `keeps` names: the others are unknown
    /// or not believed. Those that are left take over the share of the others, so that the reference
    /// configuration stays at rest; `None` where too few are left to determine a target. They have these weights instead of their own,
    /// if there are any, one for each neighbour. Otherwise of numbers of both signs the sizes are the shares: what is left of such
    /// weights may add up to next to nothing, over which each move would be that much larger.
    pub fn target_among(
        &self,
        particle: usize,
        present: &Vectors,
        keeps: impl Fn(usize) -> bool + Clone,
        instead: Option<&[f64]>,
    ) -> Option<[f64; 2]> {
        let are_all = self.neighbours.of(particle).iter().all(|&k| keeps(k as usize));
        let kept = |points| {
            let keeps = keeps.clone();
            let weighted = move |slot: usize, near: Neighbour| {
                let weight =
                    instead.map_or(if are_all { near.weight } else { near.weight.abs() }, |one| one[slot]);
                Neighbour { weight, ..near }
            };
            self.seen(particle, points)
                .zip(self.neighbours.of(particle))
                .enumerate()
                .filter(move |&(_, (_, &k))| keeps(k as usize))
                .map(move |(slot, (near, _))| weighted(slot, near))
        };
        kept(present).next()?;
        if let (COROTATED, Weights::Matrix(weights)) = (self.rule.mean, &self.weights) {
            return self.target_by_whole_cells(weights, particle, present, keeps);
        }
        let share = match &self.weights {
            Weights::Matrix(_) => {
                invert(&kept(present).fold(Block::default(), |sum, n| plus(&sum, &n.matrix)))?
            }
            Weights::Equal | Weights::Scalar(_) => IDENTITY,
        };
        let shared = |n: Neighbour| Neighbour { matrix: product(&share, &n.matrix), ..n };
        let reference = self.reference.get(particle);
        let own = ParticleState {
            present: present.get(particle),
            reference,
            rest: self.rule.rest_offset(reference, kept(&self.reference).map(shared)),
            load: self
                .load(particle)
                .map(|load| Load { compliance: product(&share, &load.compliance), ..load }),
        };
        Some(self.rule.target(&own, kept(present).map(shared)))
    }

    /// By those cells of which `keeps` leaves every corner; `None` where they do not hold the particle.
    fn target_by_whole_cells(
        &self,
        weights: &MatrixWeights,
        particle: usize,
        present: &Vectors,
        keeps: impl Fn(usize) -> bool,
    ) -> Option<[f64; 2]> {
        let near = self.neighbours.of(particle);
        let kept = |slot: &u32| *slot == OWN || keeps(near[*slot as usize] as usize);
        let cells = weights.cells_around(particle).filter(|cell| cell.slots.iter().all(kept));
        let patches = weights.patches_around(particle);
        let patches = patches.filter(|(_, cells)| cells.clone().all(|cell| cell.slots.iter().all(kept)));
        let pulled = pull(cells, patches, |slot| self.corner(particle, slot, present));
        invert(&pulled.1)?;
        let rest = self.rest.as_ref().map_or([0.0; 2], |rest| rest.get(particle));
        let (present, reference) = (present.get(particle), self.reference.get(particle));
        let own = ParticleState { present, reference, rest, load: self.load(particle) };
        Some(self.rule.target_by_cells(&own, pulled, weights.held(particle)))
    }

    /// Force of the cells around a particle, and what holds it.
    fn pulled(&self, weights: &MatrixWeights, particle: usize, present: &Vectors) -> ([f64; 2], Block) {
        let (cells, patches) = (weights.cells_around(particle), weights.patches_around(particle));
        pull(cells, patches, |slot| self.corner(particle, slot, present))
    }

    /// A neighbour, seen from where the particle is.
    fn corner(&self, particle: usize, slot: usize, present: &Vectors) -> Corner {
        let other = self.neighbours.of(particle)[slot] as usize;
        let from = |points: &Vectors| {
            let ([x, y], [x0, y0]) = (points.get(other), points.get(particle));
            [x - x0, y - y0]
        };
        let (reference, now) = (from(&self.reference), from(present));
        Corner { reference, displacement: [now[0] - reference[0], now[1] - reference[1]] }
    }

    /// Holds one component of a particle at a place \[length\], if there are rest offsets; where the rule's rows are the same
    /// however the body turns, the other one is in balance with that if it is free.
    pub(crate) fn hold_at(&mut self, particle: usize, axis: usize, place: f64) {
        let Some(mut offset) = self.rest.as_ref().map(|rest| rest.get(particle)) else { return };
        offset[axis] = self.rule.held_offset(place, self.reference.get(particle)[axis]);
        if let (SMALL, Weights::Matrix(weights)) = (self.rule.mean, &self.weights)
            && !weights.held(particle)[1 - axis]
        {
            let reference = self.reference.get(particle);
            let unmoved = self.rule.rest_offset(reference, self.seen(particle, &self.reference));
            offset[1 - axis] =
                unmoved[1 - axis] - weights.coupling(particle, axis) * (place - reference[axis]);
        }
        self.rest.iter_mut().for_each(|rest| rest.set(particle, offset));
    }

    /// Computes and keeps the rest offsets of the reference configuration; none are kept where all
    /// are zero, so that a body that needs none does not pay for them.
    pub fn keep_rest(&mut self) {
        self.keeps_rest = true;
        if let (COROTATED, Weights::Matrix(weights)) = (self.rule.mean, &self.weights) {
            self.rest = rest_of_cells(weights, &self.reference);
            return;
        }
        let rest: Vectors = (0..self.reference.len())
            .map(|j| self.rule.rest_offset(self.reference.get(j), self.seen(j, &self.reference)))
            .collect();
        let needed = rest.iter().any(|offset| offset != [0.0; 2]);
        self.rest = needed.then_some(rest);
    }

    /// Computes anew the rest offsets of particles whose bonds have broken or been mended, where no ghosts stand in for
    /// lost neighbours: each then rests on the neighbours that are left. One without any has no mean and stays anyway.
    pub(crate) fn renew_rest(&mut self, particles: impl IntoIterator<Item = usize>) {
        let has_ghosts = self.bonds.as_ref().is_none_or(|bonds| bonds.ghosts != Ghosts::None);
        if !self.keeps_rest || has_ghosts || matches!(self.rule.mean, Mean::Material { .. }) {
            return;
        }
        let mut rest = self.rest.take();
        let count = self.reference.len();
        for j in particles {
            let left = self.neighbours.bonds(j).filter(|&bond| !self.is_lost(bond)).map(|bond| {
                let position = self.reference.get(self.neighbours.index[bond] as usize);
                self.neighbour(j, bond, position)
            });
            let offset = self.rule.rest_offset(self.reference.get(j), left);
            if rest.is_some() || offset != [0.0; 2] {
                rest.get_or_insert_with(|| Vectors::zeros(count)).set(j, offset);
            }
        }
        self.rest = rest;
    }

    /// The same of all particles that have lost a bond.
    pub(crate) fn renew_rest_of_torn(&mut self) {
        let Some(bonds) = self.bonds.as_ref().filter(|bonds| bonds.any_broken()) else { return };
        let is_torn = |&j: &usize| bonds.is_torn(j, &self.neighbours);
        let torn: Vec<usize> = (0..self.reference.len()).filter(is_torn).collect();
        self.renew_rest(torn);
    }

    fn is_lost(&self, bond: usize) -> bool {
        self.bonds.as_ref().is_some_and(|bonds| bonds.is_broken(bond))
    }

    /// Indices of the neighbours that are not lost to `particle`.
    pub(crate) fn live_neighbours(&self, particle: usize) -> impl Iterator<Item = usize> + '_ {
        self.neighbours
            .bonds(particle)
            .filter(|&bond| !self.is_lost(bond))
            .map(|bond| self.neighbours.index[bond] as usize)
    }

    fn load(&self, particle: usize) -> Option<Load> {
        match (&self.forces, &self.weights) {
            (Some(forces), Weights::Matrix(weights)) => {
                Some(Load { force: forces.get(particle), compliance: weights.compliance(particle) })
            }
            _ => None,
        }
    }

    /// The coordinates of which there is no mean for `particle` when all stand at `present`.
    pub(crate) fn lacks_mean(&self, particle: usize, present: &Vectors) -> [bool; 2] {
        self.rule.lacks_mean(present.get(particle), self.seen(particle, present))
    }

    fn seen<'a>(
        &'a self,
        particle: usize,
        present: &'a Vectors,
    ) -> impl Iterator<Item = Neighbour> + Clone + 'a {
        self.neighbours.bonds(particle).map(move |bond| {
            let position = present.get(self.neighbours.index[bond] as usize);
            self.neighbour(particle, bond, position)
        })
    }

    fn seen_with_ghosts<'a>(
        &'a self,
        particle: usize,
        present: &'a Vectors,
        bonds: &'a Bonds,
    ) -> impl Iterator<Item = Neighbour> + Clone + 'a {
        self.places_with_ghosts(particle, present, bonds)
            .map(move |(bond, place)| self.neighbour(particle, bond, place))
    }

    /// Bonds and where their ends are seen.
    fn places_with_ghosts<'a>(
        &'a self,
        particle: usize,
        present: &'a Vectors,
        bonds: &'a Bonds,
    ) -> impl Iterator<Item = (usize, [f64; 2])> + Clone + 'a {
        self.neighbours.bonds(particle).filter_map(move |bond| {
            let place = if bonds.is_broken(bond) {
                bonds.ghost(particle, bond, &self.neighbours, &self.reference, present)?
            } else {
                present.get(self.neighbours.index[bond] as usize)
            };
            Some((bond, place))
        })
    }

    fn neighbour(&self, particle: usize, bond: usize, position: [f64; 2]) -> Neighbour {
        Neighbour {
            position,
            weight: self.weights.scalar(bond),
            matrix: self.weights.matrix(particle, bond - self.neighbours.starts[particle] as usize),
        }
    }
}

/// Cells that have not moved pull nothing, to the last bit; what is left are held components.
fn rest_of_cells(weights: &MatrixWeights, reference: &Vectors) -> Option<Vectors> {
    let place = |i: usize| {
        let (held, at) = (weights.held(i), reference.get(i));
        [0, 1].map(|axis| if held[axis] { at[axis] } else { 0.0 })
    };
    let any = (0..reference.len()).any(|i| weights.held(i) != [false; 2]);
    any.then(|| (0..reference.len()).map(place).collect())
}

#[cfg(test)]
mod tests;
