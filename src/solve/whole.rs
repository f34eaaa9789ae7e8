//! Sums over a body of which each rank may have a part: all find the same bits.

use super::shared::SystemPart;
use crate::flock::body::Body;
use crate::flock::vectors::Vectors;
use crate::ranks::{Team, added};

/// A whole body, seen from the part of it that is here.
pub(super) struct Whole<'a> {
    pub body: &'a Body,
    /// Where each rank has a part.
    pub part: Option<SystemPart>,
}

impl<'a> Whole<'a> {
    pub fn new(body: &'a Body, team: Option<&Team>) -> Self {
        let part = |team: &Team| SystemPart { team: team.clone(), first: body.first(), owned: body.owned() };
        Self { body, part: team.map(part) }
    }

    pub fn team(&self) -> Option<&Team> {
        self.part.as_ref().map(|part| &part.team)
    }

    /// The norm over the whole body.
    pub fn norm(&self, points: &Vectors) -> f64 {
        let size = |i: usize| points.get(i).into_iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let largest = self.body.owned().map(size).fold(0.0, f64::max);
        let largest = self.largest(largest);
        // In a unit of their size squares neither vanish nor overflow: a power of two, which keeps all bits.
        let unit = if largest.is_normal() { largest.log2().floor().exp2() } else { 1.0 };
        let [sum] = self.sum(|i| {
            let [x, y] = points.get(i).map(|x| x / unit);
            [x * x + y * y]
        });
        unit * sum.sqrt()
    }

    /// The sum over the whole body.
    pub fn sum<const N: usize>(&self, of_particle: impl Fn(usize) -> [f64; N]) -> [f64; N] {
        let own = self.body.owned().map(|i| (self.body.index_after_all(i), of_particle(i)));
        match &self.part {
            None => own.map(|(_, own)| own).fold([0.0; N], added),
            Some(part) => part.team.sum_in_order([0.0; N], own, self.body.has_some_after_all()),
        }
    }

    /// The largest of all ranks.
    pub fn largest(&self, own: f64) -> f64 {
        self.part.as_ref().map_or(own, |part| part.team.largest([own])[0])
    }

    /// Whether it is so on any rank.
    pub fn any(&self, own: bool) -> bool {
        self.part.as_ref().map_or(own, |part| part.team.any(own))
    }
}
