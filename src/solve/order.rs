//! The order that a system has the particles of a body in: column by column, those of a column that stand along an outline last.
//!
//! A body has these after all others. In their columns they are close to what they feel, so that ranks share them as they share
//! the rest, and a part of a body is laid out in this order already.

use std::borrow::Cow;

use super::equilibrium::System;
use super::operator::{Operator, OperatorError, Outliers};
use crate::flock::body::Body;
use crate::flock::lattice::Site;
use crate::flock::vectors::Vectors;

/// Which particle of a body has which place in a system.
pub(super) struct Order<'a> {
    body: &'a Body,
    outliers: Outliers,
    /// The particle at each place, where that is another number.
    particles: Option<Vec<u32>>,
}

/// Where the particles of a body are that stand at no site of its lattice.
pub(crate) fn outliers_of(body: &Body) -> Outliers {
    let is_along = |(i, site): (usize, &Site)| (site[0] == Body::ALONG_OUTLINE).then_some((site[1], i));
    let along = body.sites.iter().enumerate().filter_map(is_along);
    Outliers::new(along.map(|(row, i)| (row, body.lattice.grid_coordinates(body.reference.get(i)))))
}

impl<'a> Order<'a> {
    pub fn new(body: &'a Body) -> Self {
        let outliers = outliers_of(body);
        let is_other = body.part.is_none() && !outliers.is_empty();
        let sorted = || {
            let mut particles: Vec<u32> = (0..body.count() as u32).collect();
            let place = |site: Site| (outliers.column(site), site);
            particles.sort_by_key(|&i| place(body.sites[i as usize]));
            particles
        };
        let particles = is_other.then(sorted);
        Self { body, outliers, particles }
    }

    /// The particle at a place.
    pub fn particle(&self, place: usize) -> usize {
        self.particles.as_ref().map_or(place, |particles| particles[place] as usize)
    }

    /// Something of each particle, by places.
    pub fn by_place<T: Clone>(&self, of_particles: Vec<T>) -> Vec<T> {
        match &self.particles {
            None => of_particles,
            Some(_) if of_particles.is_empty() => of_particles,
            Some(particles) => particles.iter().map(|&i| of_particles[i as usize].clone()).collect(),
        }
    }

    /// Sites by places, and where the particles are that stand at none.
    pub fn sites(&self) -> (Cow<'_, [Site]>, Outliers) {
        let sites = &self.body.sites;
        let sites = match &self.particles {
            None => Cow::Borrowed(&sites[..]),
            Some(particles) => particles.iter().map(|&i| sites[i as usize]).collect(),
        };
        (sites, self.outliers.clone())
    }

    /// The system of an operator by places, with what is given of each particle.
    pub fn system(&self, operator: Operator, [forces, held]: [Vectors; 2]) -> System {
        let by_place = |Vectors { x, y }| Vectors { x: self.by_place(x), y: self.by_place(y) };
        let of_part = |i: usize| self.body.index(i) as u32;
        let numbers = match &self.particles {
            None if self.body.has_some_after_all() => Some((0..self.body.count()).map(of_part).collect()),
            particles => particles.clone(),
        };
        System::new(operator, by_place(forces), by_place(held)).numbered(numbers)
    }

    /// An error by the numbers that particles have in the whole body.
    pub fn error(&self, error: OperatorError) -> OperatorError {
        error.renumbered(|place| self.body.index(self.particle(place)))
    }
}
