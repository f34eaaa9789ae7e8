//! A corotated body under loads: forces, stiffnesses and strain energy of its cells.

use rayon::prelude::*;

use super::Way;
use crate::flock::block::{self, Block, apply};
use crate::flock::law::{Flock, MatrixWeights};
use crate::flock::rules::{Corner, OWN, Turn, patch_row};
use crate::flock::vectors::Vectors;
use crate::geometry::point::{distance, dot, minus, plus};
use crate::solve::balance::Outer;
use crate::solve::equilibrium::{Request, System};
use crate::solve::operator::{Operator, OperatorError, Row};
use crate::solve::order::Order;
use crate::solve::whole::Whole;

/// Parts of a way at whose ends the force that moves the body is looked at: odd, so that leaders that turn there and back
/// are not met where they began each time.
const LOOKS: u32 = 7;
/// Places on a way that no number of turns has in common: multiples of the golden section, without what is whole of them.
pub(super) const GOLDEN: f64 = 0.618_033_988_749_895;
/// Parts into which a way is cut at most because leaders turn on it.
const MOST_PARTS: u32 = 1024;
/// Leaders go straight on enough where twice as many parts of their way are together no longer than this many times \[1\].
const STRAIGHT: f64 = 1.1;
/// Part of what forces could do at most along the way of an increment that the body may not store \[1\].
const LOST: f64 = 0.1;

/// A corotated body and what is done to it.
pub(super) struct Corotated<'a> {
    pub flock: &'a Flock,
    pub weights: &'a MatrixWeights,
    pub whole: Whole<'a>,
    pub order: Order<'a>,
    pub follows: Vec<bool>,
    pub held_axes: Vec<[bool; 2]>,
    pub way: &'a Way<'a>,
    /// How a linear system is solved.
    pub step: Request,
    /// How one is solved to see whether it is positive definite.
    pub question: Request,
}

/// A state on the way: what is stored in the body, and what holds it so.
pub(super) struct Stored {
    pub displacement: Vectors,
    /// Forces of the cells on every particle, shape \[count\]; zero beyond those that are owned.
    forces: Vectors,
    /// Strain energy of the whole body \[force length\].
    energy: f64,
    /// The part of the way after which it is.
    part: f64,
}

/// Force and stiffness of the cells around a particle.
pub(super) struct Local {
    /// Without the load.
    force: [f64; 2],
    /// Its share of what they store.
    energy: f64,
    /// Second derivatives of the energy: to itself, and to its neighbours.
    diagonal: Block,
    blocks: Vec<Block>,
    /// Of one of its cells.
    pub turn: Turn,
}

impl Corotated<'_> {
    /// A neighbour from where a particle is, both displaced by `u`.
    fn corner(&self, i: usize, slot: usize, u: &Vectors) -> Corner {
        let (reference, j) = (&self.flock.reference, self.flock.neighbours.of(i)[slot] as usize);
        Corner {
            reference: minus(reference.get(j), reference.get(i)),
            displacement: minus(u.get(j), u.get(i)),
        }
    }

    /// `None` where a cell has no direction left.
    fn local(&self, i: usize, u: &Vectors) -> Option<Local> {
        let (mut force, mut energy) = ([0.0; 2], 0.0);
        let mut diagonal = Block::default();
        let mut blocks = vec![Block::default(); self.flock.neighbours.of(i).len()];
        let mut turn = None;
        for cell in self.weights.cells_around(i) {
            let corner = |slot| self.corner(i, slot, u);
            let row = cell.element.row(cell.own, |k| cell.corner(k, corner))?;
            add(&mut force, row.force);
            energy += row.energy / cell.element.corners() as f64;
            for (&slot, block) in cell.slots.iter().zip(&row.tangent) {
                let sum = if slot == OWN { &mut diagonal } else { &mut blocks[slot as usize] };
                *sum = block::plus(sum, block);
            }
            turn = turn.or(Some(row.turn));
        }
        for (stiffness, cells) in self.weights.patches_around(i) {
            let row = patch_row(stiffness, cells, |slot| self.corner(i, slot, u))?;
            add(&mut force, row.force);
            energy += row.energy / row.tangent.len() as f64;
            for (slot, block) in row.tangent {
                let sum = if slot == OWN { &mut diagonal } else { &mut blocks[slot as usize] };
                *sum = block::plus(sum, &block);
            }
        }
        Some(Local { force, energy, diagonal, blocks, turn: turn? })
    }

    /// Something of every particle; `None` where any of any rank has none.
    fn of_all<T: Send>(&self, of_particle: impl Fn(usize) -> Option<T> + Sync + Send) -> Option<Vec<T>> {
        let all: Option<Vec<T>> = (0..self.follows.len()).into_par_iter().map(of_particle).collect();
        if self.whole.any(all.is_none()) { None } else { all }
    }

    /// Components of a particle that are not given.
    pub fn free(&self, i: usize) -> [bool; 2] {
        let held = self.held_axes.get(i).copied().unwrap_or_default();
        held.map(|held| self.follows[i] && !held)
    }

    /// Puts what is not free where it is.
    pub fn hold(&self, u: &mut Vectors, held: &Vectors) {
        for i in 0..u.len() {
            let (free, at, there) = (self.free(i), u.get(i), held.get(i));
            u.set(i, [0, 1].map(|axis| if free[axis] { at[axis] } else { there[axis] }));
        }
    }

    fn load(&self, i: usize) -> [f64; 2] {
        self.flock.forces.as_ref().map_or([0.0; 2], |forces| forces.get(i))
    }

    /// The force left on every follower after `part` of the way; zero on the others, and on those of a part that see less here
    /// than in the whole body.
    pub fn forces(&self, u: &Vectors, part: f64) -> Option<(Vec<Option<Local>>, Vectors)> {
        let exact = self.whole.body.exact();
        let of_particle = |i: usize| match self.follows[i] && exact.contains(&i) {
            false => Some(None),
            true => self.local(i, u).map(Some),
        };
        let locals = self.of_all(of_particle)?;
        let left = |(i, local): (usize, &Option<Local>)| match local {
            None => [0.0; 2],
            Some(local) => {
                let (load, free) = (self.load(i), self.free(i));
                [0, 1].map(|axis| if free[axis] { local.force[axis] + part * load[axis] } else { 0.0 })
            }
        };
        let left = locals.iter().enumerate().map(left).collect();
        Some((locals, left))
    }

    /// The force that the last digits of the displacements stand for, `eps | |K| |u| + |f| |`: no displacement in doubles can
    /// be asked to leave less.
    pub fn rounding(&self, locals: &[Option<Local>], u: &Vectors, part: f64) -> f64 {
        let size = |block: &Block, u: [f64; 2]| apply(&block.map(|row| row.map(f64::abs)), u.map(f64::abs));
        let of_particle = |(i, local): (usize, &Option<Local>)| {
            let (Some(local), free) = (local, self.free(i)) else { return [0.0; 2] };
            let mut sum = self.load(i).map(|load| (part * load).abs());
            add(&mut sum, size(&local.diagonal, u.get(i)));
            for (&j, block) in self.flock.neighbours.of(i).iter().zip(&local.blocks) {
                add(&mut sum, size(block, u.get(j as usize)));
            }
            [0, 1].map(|axis| if free[axis] { sum[axis] } else { 0.0 })
        };
        f64::EPSILON * self.whole.norm(&locals.iter().enumerate().map(of_particle).collect())
    }

    /// The force that moves the body: the largest on the way, since leaders that come back leave none at its end.
    pub fn size(&self) -> f64 {
        let even = (0..=LOOKS).map(|k| f64::from(k) / f64::from(LOOKS));
        let on_the_way = even.chain(uneven(LOOKS)).map(|part| self.way.part(part));
        on_the_way.chain([1.0]).map(|part| self.size_at(part)).fold(0.0, f64::max)
    }

    /// The largest part of the way on which leaders go straight on, or nearly so: one that turns once round is where it began, and
    /// the body is not.
    pub fn straight_part(&self) -> f64 {
        let along = |parts: &mut dyn Iterator<Item = f64>| {
            let place = |part: f64| (self.way.held)(self.way.part(part));
            let (mut sum, mut last) = (0.0, place(0.0));
            for part in parts.chain([1.0]) {
                let next = place(part);
                let moved = |i: usize| distance(next.get(i), last.get(i));
                sum += self.whole.largest(self.whole.body.owned().map(moved).fold(0.0, f64::max));
                last = next;
            }
            sum
        };
        let path = |parts: u32| along(&mut (1..parts).map(|k| f64::from(k) / f64::from(parts)));
        let (mut parts, mut finer) = (1, LOOKS);
        let mut known = path(1);
        while parts < MOST_PARTS {
            let found = path(finer);
            if found <= STRAIGHT * known && along(&mut uneven(finer).into_iter()) <= STRAIGHT * known {
                break;
            }
            (parts, finer, known) = (finer, 2 * finer, found);
        }
        1.0 / f64::from(parts)
    }

    /// The force with leaders as they are after a part of the whole way, all followers at zero and all cells in the axes of the
    /// reference.
    fn size_at(&self, part: f64) -> f64 {
        let mut u = Vectors::zeros(self.follows.len());
        self.hold(&mut u, &(self.way.held)(part));
        let owned = self.whole.body.owned();
        let force = |i: usize| {
            if !(self.follows[i] && owned.contains(&i)) {
                return [0.0; 2];
            }
            let mut force = self.load(i);
            let others = self.flock.neighbours.of(i).iter().zip(self.weights.stiffness_of(i));
            for (&j, block) in others {
                add(&mut force, apply(block, minus(u.get(j as usize), u.get(i))));
            }
            let free = self.free(i);
            [0, 1].map(|axis| if free[axis] { force[axis] } else { 0.0 })
        };
        self.whole.norm(&(0..u.len()).map(force).collect())
    }

    /// A state on the way, or `None` where a cell has no direction left.
    pub fn stored(&self, displacement: Vectors, part: f64) -> Option<Stored> {
        let owned = self.whole.body.owned();
        let of_particle = |i: usize| match owned.contains(&i) {
            true => self.local(i, &displacement).map(|local| (local.force, local.energy)),
            false => Some(([0.0; 2], 0.0)),
        };
        let own = self.of_all(of_particle)?;
        let [energy] = self.whole.sum(|i| [own[i].1]);
        Some(Stored { forces: own.into_iter().map(|(force, _)| force).collect(), energy, displacement, part })
    }

    /// What acts on the body from outside in a state on the way.
    pub fn outer(&self, state: &Stored) -> Outer {
        self.outer_with((&state.displacement, state.part), |i| state.forces.get(i))
    }

    /// The same where it has been displaced by so much after a part of the way.
    pub fn outer_at(&self, displacement: &Vectors, part: f64) -> Outer {
        self.outer_with((displacement, part), |i| self.flock.force_under(i, displacement))
    }

    fn outer_with(&self, (u, part): (&Vectors, f64), inner: impl Fn(usize) -> [f64; 2]) -> Outer {
        let held = |i: usize| self.free(i).map(|free| !free);
        let load = |i: usize| self.load(i).map(|load| part * load);
        let place = |i: usize| plus(self.flock.reference.get(i), u.get(i));
        Outer::of((self.flock, &self.whole), held, load, inner, place, u)
    }

    /// Whether the body is given as much work between two states as it stores: what is too much sets it swinging, so that
    /// it is no way of rest from one to the other. The work is that of forces which grow along a line, and differences are over what
    /// these could do at most: work itself passes through zero where leaders turn back.
    pub fn keeps_energy(&self, before: &Stored, after: &Stored) -> bool {
        let [work, size] = self.whole.sum(|i| {
            let way = minus(after.displacement.get(i), before.displacement.get(i));
            let forces = [before.forces.get(i), after.forces.get(i)];
            let size: f64 = forces.iter().map(|[x, y]| x.hypot(*y)).sum();
            let along: f64 = forces.iter().map(|force| dot(*force, way)).sum();
            [-0.5 * along, 0.5 * size * way[0].hypot(way[1])]
        });
        let lost = work - (after.energy - before.energy);
        tracing::debug!(work, size, lost, "the work of an increment");
        lost.abs() <= LOST * size
    }

    /// Second derivatives of the energy, forces per displacement, in the order of a system.
    fn tangent(&self, locals: &[Option<Local>]) -> Result<Operator, OperatorError> {
        let lattice = &self.whole.body.lattice;
        let grid = [lattice.vector([1, 0]), lattice.vector([0, 1])];
        let row = |i: usize| {
            let Some(local) = &locals[i] else { return Row::default() };
            let mut row = Row { diagonal: local.diagonal, entries: Vec::new() };
            for (&j, block) in self.flock.neighbours.of(i).iter().zip(&local.blocks) {
                if *block != Block::default() {
                    let (here, there) = (self.whole.body.sites[i], self.whole.body.sites[j as usize]);
                    let offset = [there[0] - here[0], there[1] - here[1]];
                    row.entries.push((offset, block.map(|row| row.map(|entry| -entry))));
                }
            }
            row
        };
        let (order, follows) = (&self.order, self.order.by_place(self.follows.clone()));
        let (sites, outliers) = order.sites();
        let row = |place: usize| row(order.particle(place));
        let operator = Operator::from_rows_along_outline((&sites[..], outliers), grid, follows, row);
        let operator = operator.map_err(|error| order.error(error))?;
        Ok(operator.with_held_axes(order.by_place(self.held_axes.clone())))
    }

    /// The system of a step, or of the part of it that is here: the forces that are left, and the leaders' moves.
    pub fn system(
        &self,
        locals: &[Option<Local>],
        [left, led]: [Vectors; 2],
    ) -> Result<System, OperatorError> {
        let own = self.tangent(locals);
        let ordered = |own: Operator| self.order.system(own, [left, led]);
        let Some(part) = &self.whole.part else { return own.map(ordered) };
        // Neighbours are those of the rule: nothing else can be wrong with a row.
        let lost = match &own {
            Err(OperatorError::NotFinite { particle }) => Some([*particle, 0]),
            _ => None,
        };
        match part.first_found(lost) {
            Some([particle, _]) => Err(OperatorError::NotFinite { particle }),
            None => Ok(ordered(own?).of_part(part.clone())),
        }
    }
}

/// So many places less one between 0 and 1, in order.
fn uneven(parts: u32) -> Vec<f64> {
    let mut places: Vec<f64> = (1..parts).map(|k| (f64::from(k) * GOLDEN).fract()).collect();
    places.sort_by(f64::total_cmp);
    places
}

fn add(sum: &mut [f64; 2], [x, y]: [f64; 2]) {
    *sum = [sum[0] + x, sum[1] + y];
}
