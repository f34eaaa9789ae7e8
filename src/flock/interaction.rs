//! Who sees whom, through which rule: everything that turns present positions into a target.

use std::sync::Arc;

use super::fracture::Bonds;
use super::neighbourhood::Neighbours;
use super::points::Points;
use super::rules::{Neighbour, Own, Rule};

/// The arrays and index lists that a sweep runs over; it knows particles, not lattices.
#[derive(Clone, Debug)]
pub struct Interaction {
    pub rule: Rule,
    /// Reference positions \[length\], shape \[count\].
    pub reference: Arc<Points>,
    pub neighbours: Neighbours,
    /// Fixed weights, parallel to the neighbours' index list; all 1 where absent.
    pub weights: Option<Vec<f64>>,
    /// Rest offsets \[length\], shape \[count\]; all zero where absent.
    pub rest: Option<Points>,
    /// Broken bonds; none can break where absent.
    pub bonds: Option<Bonds>,
}

impl Interaction {
    /// Target position of `particle` when all stand at `present` \[length, world frame\].
    pub fn target(&self, particle: usize, present: &Points) -> [f64; 2] {
        let own = Own {
            present: present.get(particle),
            reference: self.reference.get(particle),
            rest: self.rest.as_ref().map_or([0.0; 2], |rest| rest.get(particle)),
        };
        match &self.bonds {
            Some(bonds) if bonds.any_broken() => {
                self.rule.target(&own, self.seen_with_ghosts(particle, present, bonds))
            }
            _ => self.rule.target(&own, self.seen(particle, present)),
        }
    }

    /// Computes and keeps the rest offsets of the reference configuration; none are kept where all
    /// are zero, so that a body that needs none does not pay for them.
    pub fn keep_rest(&mut self) {
        let rest: Points = (0..self.reference.len())
            .map(|j| self.rule.rest_offset(self.reference.get(j), self.seen(j, &self.reference)))
            .collect();
        let needed = rest.iter().any(|offset| offset != [0.0; 2]);
        self.rest = needed.then_some(rest);
    }

    /// Indices of the neighbours that are not lost to `particle`.
    pub fn live_neighbours(&self, particle: usize) -> impl Iterator<Item = usize> + '_ {
        let live = move |bond: &usize| self.bonds.as_ref().is_none_or(|bonds| !bonds.is_broken(*bond));
        self.neighbours.bonds(particle).filter(live).map(|bond| self.neighbours.index[bond] as usize)
    }

    fn seen<'a>(
        &'a self,
        particle: usize,
        present: &'a Points,
    ) -> impl Iterator<Item = Neighbour> + Clone + 'a {
        self.neighbours.bonds(particle).map(move |bond| Neighbour {
            position: present.get(self.neighbours.index[bond] as usize),
            weight: self.weight(bond),
        })
    }

    fn seen_with_ghosts<'a>(
        &'a self,
        particle: usize,
        present: &'a Points,
        bonds: &'a Bonds,
    ) -> impl Iterator<Item = Neighbour> + Clone + 'a {
        self.neighbours.bonds(particle).filter_map(move |bond| {
            let position = if bonds.is_broken(bond) {
                bonds.ghost(particle, bond, &self.neighbours, &self.reference, present)?
            } else {
                present.get(self.neighbours.index[bond] as usize)
            };
            Some(Neighbour { position, weight: self.weight(bond) })
        })
    }

    fn weight(&self, bond: usize) -> f64 {
        self.weights.as_ref().map_or(1.0, |weights| weights[bond])
    }
}
