//! Fracture (the paper's Choices 5 and 6): a pair stretched past a threshold never influences each
//! other again, and ghosts stand in for what was lost.

#[cfg(test)]
pub(crate) mod tests;
mod watch;

use std::ops::Range;

use super::neighbourhood::Neighbours;
use super::role::Role;
use super::vectors::{Vectors, distance};
use crate::geometry::shape::{Segment, segments_cross};
use watch::Watch;

/// When a bond breaks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Threshold {
    /// Longer than this (the paper's `df`) \[length\].
    Distance(f64),
    /// Longer than this multiple of its reference length \[1\].
    Stretch(f64),
}

impl Threshold {
    /// Whether a bond of reference length `rest` breaks at `length` \[length\].
    pub(crate) fn is_passed(self, length: f64, rest: f64) -> bool {
        length > self.limit(rest)
    }

    /// Greatest length of a bond of reference length `rest` that holds \[length\].
    fn limit(self, rest: f64) -> f64 {
        match self {
            Threshold::Distance(df) => df,
            Threshold::Stretch(ratio) => ratio * rest,
        }
    }
}

/// The stand-in for a neighbour that a particle has lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ghosts {
    /// A point at the original lattice offset from the particle's present position: the fragment
    /// recovers the shape of the lattice.
    Lattice,
    /// The mirror image of the opposite neighbour through the particle; where there is none, as
    /// `Lattice`.
    Mirrored,
    /// Nothing: the mean runs over the neighbours that are left. Rest offsets are then those of these neighbours; without
    /// rest offsets (the literal formula) the flanks of a crack draw together.
    None,
}

/// A bond that broke.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Break {
    /// Step at which it broke; 0 for a bond cut before the first.
    pub step: usize,
    /// Indices of the two particles in the whole body, the lower first.
    pub pair: [u32; 2],
    /// Middle of the bond in the reference configuration \[length\].
    pub place: [f64; 2],
    /// Length at which it broke \[length\]; its present length for bonds cut or lost otherwise.
    pub length: f64,
}

/// Which bonds are broken, parallel to [`Neighbours::index`].
#[derive(Clone, Debug)]
pub struct Bonds {
    /// When bonds break as the body moves; without one they are only cut.
    pub threshold: Option<Threshold>,
    /// The substitute for neighbours that are lost.
    pub ghosts: Ghosts,
    /// A bond breaks here if it has an end among these particles: in a part of a body those that belong to it. Nothing here looks
    /// at the others.
    pub owned: Range<usize>,
    broken: Vec<bool>,
    any_broken: bool,
    /// Whether every particle is a neighbour of each of its neighbours.
    is_mutual: bool,
    /// The bonds that may still break, compiled when they are first looked at.
    watch: Option<Watch>,
}

/// Where a particle sees the ghost of a neighbour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum StandIn {
    /// At this offset from its own place \[length\].
    Offset([f64; 2]),
    /// Opposite to this particle.
    Opposite(usize),
}

impl Bonds {
    /// All bonds of `neighbours`, unbroken.
    pub fn new(threshold: Option<Threshold>, ghosts: Ghosts, neighbours: &Neighbours) -> Self {
        let sees = |j: usize, k: u32| neighbours.of(j).contains(&k);
        let seen_by = |j: usize| neighbours.of(j).iter().all(|&k| sees(k as usize, j as u32));
        Self {
            threshold,
            ghosts,
            owned: 0..neighbours.count(),
            broken: vec![false; neighbours.index.len()],
            any_broken: false,
            is_mutual: (0..neighbours.count()).all(seen_by),
            watch: None,
        }
    }

    /// All bonds of `neighbours`, of which none breaks by itself.
    pub(crate) fn uncut(neighbours: &Neighbours) -> Self {
        Self::new(None, Ghosts::Lattice, neighbours)
    }

    /// Whether the pair at this place of [`Neighbours::index`] is broken.
    pub fn is_broken(&self, bond: usize) -> bool {
        self.broken[bond]
    }

    /// Whether any bond is broken.
    pub(crate) fn any_broken(&self) -> bool {
        self.any_broken
    }

    /// Breaks the bonds that `is_broken` names and mends all others.
    pub(crate) fn set_broken(&mut self, is_broken: impl Fn(usize) -> bool) {
        self.broken.iter_mut().enumerate().for_each(|(bond, broken)| *broken = is_broken(bond));
        self.any_broken = self.broken.contains(&true);
        self.watch = None;
    }

    /// Whether a particle has lost a bond.
    pub(crate) fn is_torn(&self, particle: usize, neighbours: &Neighbours) -> bool {
        self.any_broken && self.broken[neighbours.bonds(particle)].contains(&true)
    }

    /// Breaks every live bond past the threshold and appends it, once per pair, to `breaks`.
    /// Bonds to the frame never break: it is no matter. Give the same `neighbours` and `reference` every time.
    pub fn break_stretched(
        &mut self,
        step: usize,
        neighbours: &Neighbours,
        (reference, present): (&Vectors, &Vectors),
        roles: &[Role],
        breaks: &mut Vec<Break>,
    ) {
        let Some(threshold) = self.threshold else { return };
        let is_mutual = self.is_mutual;
        let known = self.watch.take().filter(|watch| watch.threshold() == threshold);
        let watch = known
            .unwrap_or_else(|| Watch::compile(threshold, neighbours, reference, |bond| !self.broken[bond]));
        // Most steps break nothing, which the squares show.
        let suspects = watch.suspects(present);
        self.watch = Some(watch);
        self.break_among(suspects, step, neighbours, (reference, present), breaks, |j, k| {
            // A bond that both ends see is checked from the lower one alone.
            (!is_mutual || j < k)
                && roles[k].is_body()
                && threshold.is_passed(
                    distance(present.get(j), present.get(k)),
                    distance(reference.get(j), reference.get(k)),
                )
        });
    }

    /// Breaks every bond whose reference segment crosses the cut from `from` to `to` \[length\].
    pub fn cut(
        &mut self,
        (from, to): Segment,
        neighbours: &Neighbours,
        reference: &Vectors,
        breaks: &mut Vec<Break>,
    ) {
        self.break_where(0, neighbours, (reference, reference), breaks, |j, k| {
            segments_cross(reference.get(j), reference.get(k), from, to)
        });
    }

    /// Breaks, at this step, every bond that crosses the cut from `from` to `to` \[length\] where its ends are at present.
    /// Bonds to the frame hold: it is no matter.
    pub(crate) fn cut_present(
        &mut self,
        step: usize,
        (from, to): Segment,
        neighbours: &Neighbours,
        (reference, present): (&Vectors, &Vectors),
        roles: &[Role],
        breaks: &mut Vec<Break>,
    ) {
        self.break_where(step, neighbours, (reference, present), breaks, |j, k| {
            roles[j].is_body()
                && roles[k].is_body()
                && segments_cross(present.get(j), present.get(k), from, to)
        });
    }

    /// Breaks every bond to a particle that has become a ghost.
    pub(crate) fn release_ghosts(
        &mut self,
        step: usize,
        neighbours: &Neighbours,
        (reference, present): (&Vectors, &Vectors),
        roles: &[Role],
        breaks: &mut Vec<Break>,
    ) {
        self.break_where(step, neighbours, (reference, present), breaks, |j, k| {
            roles[j] == Role::Ghost || roles[k] == Role::Ghost
        });
    }

    /// The end of a pair from which a broken bond is recorded: the lower one, if that sees the other.
    pub(crate) fn recorded_from([low, high]: [usize; 2], neighbours: &Neighbours) -> usize {
        if bond_to(low, high, neighbours).is_some() { low } else { high }
    }

    fn break_where(
        &mut self,
        step: usize,
        neighbours: &Neighbours,
        (reference, present): (&Vectors, &Vectors),
        breaks: &mut Vec<Break>,
        breaks_now: impl Fn(usize, usize) -> bool,
    ) {
        self.break_among(0..neighbours.count(), step, neighbours, (reference, present), breaks, breaks_now);
    }

    /// Breaks those bonds of these particles, ascending, for which `breaks_now` holds.
    fn break_among(
        &mut self,
        particles: impl IntoIterator<Item = usize>,
        step: usize,
        neighbours: &Neighbours,
        (reference, present): (&Vectors, &Vectors),
        breaks: &mut Vec<Break>,
        breaks_now: impl Fn(usize, usize) -> bool,
    ) {
        for j in particles {
            for bond in neighbours.bonds(j) {
                let k = neighbours.index[bond] as usize;
                let is_found_here = self.owned.contains(&j) || self.owned.contains(&k);
                if self.broken[bond] || !is_found_here || !breaks_now(j, k) {
                    continue;
                }
                let back = bond_to(k, j, neighbours);
                self.broken[bond] = true;
                self.any_broken = true;
                if let Some(back) = back.filter(|_| self.is_mutual) {
                    self.broken[back] = true;
                }
                if let Some(watch) = self.watch.as_mut().filter(|_| back.is_none_or(|back| self.broken[back]))
                {
                    watch.forget([j, k]);
                }
                let pair = [j.min(k), j.max(k)];
                if Self::recorded_from(pair, neighbours) == j {
                    let (a, b) = (reference.get(j), reference.get(k));
                    breaks.push(Break {
                        step,
                        pair: pair.map(|i| i as u32),
                        place: [(a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0],
                        length: distance(present.get(j), present.get(k)),
                    });
                }
            }
        }
    }

    /// Where particle `j` sees the ghost of the neighbour at the other end of `bond`, if it does
    /// \[length\].
    pub fn ghost(
        &self,
        j: usize,
        bond: usize,
        neighbours: &Neighbours,
        reference: &Vectors,
        present: &Vectors,
    ) -> Option<[f64; 2]> {
        let here = present.get(j);
        self.stand_in(j, bond, neighbours, reference).map(|stand_in| match stand_in {
            StandIn::Offset(lost) => [here[0] + lost[0], here[1] + lost[1]],
            StandIn::Opposite(k) => [2.0 * here[0] - present.x[k], 2.0 * here[1] - present.y[k]],
        })
    }

    pub(crate) fn stand_in(
        &self,
        j: usize,
        bond: usize,
        neighbours: &Neighbours,
        reference: &Vectors,
    ) -> Option<StandIn> {
        let offset = |k: usize| [reference.x[k] - reference.x[j], reference.y[k] - reference.y[j]];
        let lost = offset(neighbours.index[bond] as usize);
        match self.ghosts {
            Ghosts::None => None,
            Ghosts::Lattice => Some(StandIn::Offset(lost)),
            Ghosts::Mirrored => {
                let size = lost[0].hypot(lost[1]);
                let opposite = neighbours.bonds(j).filter(|&other| !self.broken[other]).find_map(|other| {
                    let k = neighbours.index[other] as usize;
                    let [x, y] = offset(k);
                    ((x + lost[0]).hypot(y + lost[1]) <= 1e-6 * size).then_some(k)
                });
                Some(opposite.map_or(StandIn::Offset(lost), StandIn::Opposite))
            }
        }
    }
}

/// Where `j` has its bond to `k`, if it sees it.
fn bond_to(j: usize, k: usize, neighbours: &Neighbours) -> Option<usize> {
    neighbours.bonds(j).find(|&bond| neighbours.index[bond] as usize == k)
}
