//! A body that several ranks share.
//!
//! Every rank has the whole plan (roles, neighbours, weights, leaders) and moves the particles of its
//! [`Domain`]. Between steps whose course is known ahead the ranks exchange halos, for as many steps
//! together as pay. Everything that looks at the whole body is preceded by [`Engine::gather`], after which every
//! rank knows all positions and finds the same: bonds that break, neighbours found anew, roles taken on a
//! condition, frames that look after the sweep, observers. So what a body does hangs on no rank, and its bits on no number
//! of them.
//!
//! A body may be laid out in [parts](crate::flock::part::Part): then each rank has no more than the particles that it moves and
//! some around them, and to gather is to receive these. What a rank finds, it finds of its own; sums over the whole body go
//! through the ranks in their order.

use std::collections::HashMap;
use std::ops::{ControlFlow, Range};

use super::Engine;
use super::movement;
use super::observer::Observer;
use crate::flock::body::Body;
use crate::flock::fracture::{Bonds, Break};
use crate::flock::halo::{Halo, put, words};
use crate::flock::neighbourhood::Neighbours;
use crate::flock::part::Part;
use crate::flock::vectors::{Vectors, distance};
use crate::ranks::{Team, added};
use crate::sweep::caches::Caches;
use crate::sweep::domain::{Domain, Held, Share};
use crate::sweep::{Activity, Stage, Steps};

/// The particles whose positions a rank knows, now and before the last step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Known {
    /// Its own.
    Own,
    /// Those as well that its own see in a step that is taken by itself.
    Seen,
    /// All that stand there.
    All,
}

impl Engine {
    /// Shares the body with the other ranks from here on. All ranks must have the same engine, or each that of its part.
    pub fn join(&mut self, team: Team) {
        if team.count() == 1 && self.body.part.is_none() {
            return;
        }
        let caches = agreed_caches(&team);
        let part = self.body.part.as_ref().map(Part::held);
        let share = Share { rank: team.rank(), ranks: team.count(), caches, part };
        if !team.is_first() {
            let _ = self.activity.take_counts();
        }
        self.team = Some((team, share));
        self.release_ghosts();
        self.compile_sweep();
    }

    /// Makes the positions of all particles, now and before the last step, known to all ranks that share the body; of
    /// a part those of all particles that stand there. Every rank must call it at the same step.
    pub fn gather(&mut self) {
        let (Some((team, _)), Some(domain)) = (&self.team, self.sweep.domain()) else { return };
        if self.known == Known::All {
            return;
        }
        self.known = Known::All;
        if self.body.part.is_some() {
            receive(team, &domain.halo(0), [&mut self.present, &mut self.previous]);
            let counts = team.sum(self.activity.take_counts());
            if team.is_first() {
                self.activity.add_counts(counts);
            }
            return;
        }
        let of_ranks =
            gather_points(team, domain, [&mut self.present, &mut self.previous], self.activity.take_counts());
        if team.is_first() {
            of_ranks.into_iter().for_each(|counts| self.activity.add_counts(counts));
        }
    }

    /// Makes the positions known that the particles of this rank see in a step that is taken by itself. Every rank must call it at
    /// the same step.
    pub(super) fn gather_seen(&mut self) {
        if self.body.part.is_none() {
            self.gather();
        } else if self.known == Known::Own {
            let (Some((team, _)), Some(domain)) = (&self.team, self.sweep.domain()) else { return };
            receive(team, &domain.halo_of_a_step(), [&mut self.present, &mut self.previous]);
            self.known = Known::Seen;
        }
    }

    /// Notes that the ranks have moved on, each its own particles.
    pub(super) fn forget_others(&mut self) {
        self.known = if self.team.is_some() { Known::Own } else { Known::All };
    }

    /// One step of a body of which the positions are known that each rank's particles see: each moves its own, and then these are
    /// known again, the next ones in `previous`.
    pub(super) fn step_shared(&mut self) {
        self.sweep.step(&self.flock, None, &self.present, &mut self.previous);
        if let (Some((team, _)), Some(domain)) = (&self.team, self.sweep.domain()) {
            match self.body.part {
                None => drop(gather_points(team, domain, [&mut self.previous], [0; 2])),
                Some(_) => {
                    receive(team, &domain.halo_of_a_step(), [&mut self.previous]);
                    self.known = Known::Seen;
                }
            }
        }
        if let Some(frame) = &self.body.frame {
            frame.follow(&self.flock.reference, &self.present, &mut self.previous);
        }
    }

    /// Puts the bonds that break in the whole body in the place of those that break here, which come after `known` others.
    pub(super) fn share_breaks(&mut self, known: usize) {
        let Some((team, _)) = self.team.as_ref().filter(|_| self.body.part.is_some()) else { return };
        let found = self.breaks.split_off(known);
        self.breaks.extend(of_all_parts(team, &self.body, &self.flock.neighbours, found));
    }

    /// Keeps rest offsets if a particle of any rank needs one.
    pub(super) fn agree_on_rest(&mut self) {
        let (Some(team), Some(_)) = (self.parted(), &self.flock.bonds) else { return };
        let is_needed = |rest: &Vectors| self.body.owned().any(|i| rest.get(i) != [0.0; 2]);
        let is_needed = team.any(self.flock.rest.as_ref().is_some_and(is_needed));
        let rest = self.flock.rest.take();
        self.flock.rest = is_needed.then(|| rest.unwrap_or_else(|| Vectors::zeros(self.body.count())));
    }

    /// Learns what the other ranks move and need; to be called by all of them when the sweep is compiled.
    pub(super) fn agree_on_needs(&mut self) {
        let (Some((team, _)), Some(_)) = (&self.team, &self.body.part) else { return };
        let (takes_several, seen) = (self.takes_several, seen_in_a_step(&self.body, &self.flock.neighbours));
        let Some(domain) = self.sweep.domain_mut() else { return };
        let own = domain.needs(takes_several, seen).clone();
        domain.learn(team.gather_all(&[own]));
        self.takes_several = domain.steps_together() > 0;
    }

    /// The ranks among which the body is parted: none where each of them, or the only one, has all of it.
    pub fn parted(&self) -> Option<&Team> {
        self.body.part.as_ref().and(self.team.as_ref()).map(|(team, _)| team)
    }

    /// The largest over the parts of the body.
    pub(crate) fn largest_of_parts<const N: usize>(&self, own: [f64; N]) -> [f64; N] {
        self.parted().map_or(own, |team| team.largest(own))
    }

    /// The sum of each of some numbers of particles over those of the whole body that belong to it, in order of index.
    pub(super) fn sum_of_particles<const N: usize>(&self, of: impl Fn(usize) -> [f64; N]) -> [f64; N] {
        let own = self.body.owned().filter(|&i| self.roles[i].is_body());
        self.sum_over([-0.0; N], own.map(|i| (i, of(i))))
    }

    /// The sum of `start` and of numbers of particles, of those of this part and of the others, in the order of the whole body.
    pub(crate) fn sum_over<const N: usize>(
        &self,
        start: [f64; N],
        own: impl Iterator<Item = (usize, [f64; N])>,
    ) -> [f64; N] {
        self.sum_of_parts(start, own.map(|(i, own)| (self.body.index_after_all(i), own)))
    }

    /// What `start` and the numbers of this part, which are its `own`, and those of the others add up to, in the order of the parts;
    /// those that have a place after all others, in the order of these.
    pub(crate) fn sum_of_parts<const N: usize>(
        &self,
        start: [f64; N],
        own: impl Iterator<Item = (Option<usize>, [f64; N])>,
    ) -> [f64; N] {
        match self.parted() {
            None => own.map(|(_, own)| own).fold(start, added),
            Some(team) => team.sum_in_order(start, own, self.body.has_some_after_all()),
        }
    }

    /// The numbers of those particles of other parts that the particles of this one see, which the others know; none of a whole
    /// body.
    pub fn of_others<const N: usize>(&self, own: impl Fn(usize) -> [f64; N]) -> HashMap<usize, [f64; N]> {
        let (Some(team), Some(domain)) = (self.parted(), self.sweep.domain()) else { return HashMap::new() };
        let halo = domain.halo(0);
        let words = |(rank, of): &(usize, Range<usize>)| {
            (*rank, of.clone().flat_map(|i| own(i).map(f64::to_bits)).collect())
        };
        let sent: Vec<(usize, Vec<u64>)> = halo.sends.iter().map(words).collect();
        let sizes: Vec<_> = halo.receives.iter().map(|(rank, of)| (*rank, N * of.len())).collect();
        let received = team.swap(&sent, &sizes);
        let numbers = |words: &[u64]| std::array::from_fn(|k| f64::from_bits(words[k]));
        let of_rank = |((_, of), words): (&(usize, Range<usize>), &Vec<u64>)| -> Vec<_> {
            of.clone().zip(words.chunks_exact(N).map(numbers)).collect()
        };
        halo.receives.iter().zip(&received).flat_map(of_rank).collect()
    }

    /// The words that `of` says of each particle of the whole body, in the order in which files and messages have them. Of a body in
    /// parts the first rank has all of them, the others nothing.
    pub fn of_all<const N: usize>(&self, of: impl Fn(usize) -> [u64; N]) -> Vec<[u64; N]> {
        /// Particles of a piece on its way.
        const OF_A_PIECE: usize = 1 << 15;
        /// In place of a place after all others.
        const IN_ORDER: u64 = u64::MAX;
        let Some(team) = self.parted() else { return self.body.rows().map(of).collect() };
        let one = |&particle: &usize| {
            let place = self.body.index_after_all(particle).map_or(IN_ORDER, |place| place as u64);
            [place].into_iter().chain(of(particle)).flat_map(u64::to_le_bytes)
        };
        let own = self.body.owned_in_order();
        let (mut all, mut later) = (Vec::new(), Vec::new());
        team.bring(own.chunks(OF_A_PIECE).map(|some| some.iter().flat_map(one).collect()), |piece| {
            let (words, _) = piece.as_chunks::<8>();
            let words: Vec<u64> = words.iter().map(|word| u64::from_le_bytes(*word)).collect();
            for one in words.chunks_exact(N + 1) {
                let of_it = std::array::from_fn(|k| one[k + 1]);
                match one[0] {
                    IN_ORDER => all.push(of_it),
                    place => later.push((place, of_it)),
                }
            }
        });
        later.sort_unstable_by_key(|(place, _)| *place);
        all.extend(later.into_iter().map(|(_, of_it)| of_it));
        all
    }

    /// Whether it is so in any part of the body.
    pub fn any_of_parts(&self, own: bool) -> bool {
        self.parted().map_or(own, |team| team.any(own))
    }

    /// How many there are in all parts.
    pub(crate) fn count_of_parts(&self, own: usize) -> usize {
        self.parted().map_or(own, |team| team.sum([own as u64])[0] as usize)
    }

    /// The cells that belong to this part of the body, as their first corners do; all of a whole one.
    pub(crate) fn owned_cells(&self) -> impl Iterator<Item = usize> + Clone + use<> {
        self.cells.as_ref().map_or_else(Vec::new, |cells| cells.owned(&self.body)).into_iter().flatten()
    }

    /// The id of the first particle whose position is not finite.
    pub(crate) fn first_lost(&self) -> Option<usize> {
        let own = movement::first_lost(&self.present, self.body.owned()).map(|i| self.body.id(i));
        let Some(team) = self.parted() else { return own };
        let ids = team.each([own.map_or(u64::MAX, |id| id as u64)]).into_iter().flatten().min();
        ids.filter(|&id| id != u64::MAX).map(|id| id as usize)
    }

    /// The id of the particle farthest from its reference place, the first of several, and how far it is \[length\].
    pub fn farthest(&self) -> (usize, f64) {
        let far = movement::farthest(&self.present, &self.body.reference, self.body.owned());
        let apart = |far: usize| distance(self.present.get(far), self.body.reference.get(far));
        let own = far.map_or((0, f64::NEG_INFINITY), |far| (self.body.id(far), apart(far)));
        let Some(team) = self.parted() else { return own };
        let mut all = team.gather_all(&[own]);
        all.sort_unstable_by_key(|(id, _)| *id);
        all.into_iter().fold((0, f64::NEG_INFINITY), |most, one| if one.1 > most.1 { one } else { most })
    }

    /// For each step, whether it is so on any rank.
    pub(super) fn on_any_rank(&self, own: Vec<bool>) -> Vec<bool> {
        let Some((team, _)) = &self.team else { return own };
        let bits = own.iter().enumerate().fold(0, |bits, (k, &own)| bits | u64::from(own) << k);
        let any = team.each([bits]).into_iter().fold(0, |any, [bits]| any | bits);
        (0..own.len()).map(|k| any >> k & 1 == 1).collect()
    }
}

/// Takes several steps: of a body that is shared what needs nothing of the other ranks while the halo is on its way, unless
/// bands `beyond` those of this rank are moved as well. The places are those of now and those before the last step.
pub(super) fn take_steps(
    steps: &Steps<'_, f64>,
    (halo, beyond): (Option<(&Team, Halo)>, usize),
    [present, previous]: [&mut Vectors; 2],
    activity: &mut Activity,
) -> Vec<bool> {
    let mut under_way = steps.begin(activity);
    let mut stage = Stage::All;
    if let Some((team, halo)) = halo {
        let (sent, sizes) = halo.messages(&[&*present]);
        let received = team.swap_while(&sent, &sizes, &mut || {
            if beyond == 0 && steps.has_inside() {
                steps.go_on(
                    &mut under_way,
                    Stage::Inside,
                    present.components_mut(),
                    previous.components_mut(),
                );
                stage = Stage::Rim;
            }
        });
        halo.put(&received, &mut [&mut *present]);
    }
    steps.go_on(&mut under_way, stage, present.components_mut(), previous.components_mut());
    steps.end(under_way, activity)
}

/// The bonds that break in the whole body, in its order, of those that each rank has found among its own particles, by the numbers
/// that these have here.
pub(crate) fn of_all_parts(
    team: &Team,
    body: &Body,
    neighbours: &Neighbours,
    found: Vec<Break>,
) -> Vec<Break> {
    let owned = body.owned();
    // Of a bond between two parts, which both find, the one speaks that records it.
    let is_own =
        |one: &Break| owned.contains(&Bonds::recorded_from(one.pair.map(|i| i as usize), neighbours));
    let index = |particle: u32| body.index(particle as usize) as u32;
    let parts = |Break { step, pair, place, length }: Break| (step, pair.map(index), place, length);
    let own: Vec<_> = found.into_iter().filter(is_own).map(parts).collect();
    let all = team.gather_all(&own).into_iter();
    all.map(|(step, pair, place, length)| Break { step, pair, place, length }).collect()
}

/// The particles that those of a part see in a step that is taken by itself, as numbers of those that stand here; all of these where
/// points of a frame see some as well.
pub(crate) fn seen_in_a_step(body: &Body, neighbours: &Neighbours) -> Range<usize> {
    if body.frame.is_some() { body.exact() } else { neighbours.seen_from(body.owned()) }
}

/// Receives positions of others.
fn receive<const N: usize>(team: &Team, halo: &Halo, mut points: [&mut Vectors; N]) {
    let (sent, sizes) = halo.messages(&points.each_ref().map(|points| &**points));
    halo.put(&team.swap(&sent, &sizes), &mut points);
}

impl Part {
    /// For the sweep, which knows no bodies.
    pub fn held(&self) -> Held {
        let ends = |of: &Range<usize>| [of.start, of.end];
        Held { first: self.first, total: self.total, owned: ends(&self.owned), exact: ends(&self.exact) }
    }
}

/// The first rank's: all must cut the body into the same bands, and halos are measured by them.
pub(crate) fn agreed_caches(team: &Team) -> Caches {
    let Caches { whole_body, band } = Caches::here();
    let own = [whole_body as u64, u64::from(band.is_some()), band.unwrap_or(0) as u64];
    let [whole_body, has_band, band] = team.of_first(own);
    Caches { whole_body: whole_body as usize, band: (has_band == 1).then_some(band as usize) }
}

/// Makes all ranks' particles known, and two words of each rank, in one exchange: it takes long to begin one.
fn gather_points<const N: usize>(
    team: &Team,
    domain: &Domain,
    mut points: [&mut Vectors; N],
    more: [u64; 2],
) -> Vec<[u64; 2]> {
    let owned = domain.owned();
    let own: Vec<u64> = points.iter().flat_map(|points| words(points, &owned)).chain(more).collect();
    let counts: Vec<usize> = domain.counts().into_iter().map(|count| 2 * N * count + more.len()).collect();
    let all = team.gather(&own, &counts);
    let (mut rest, mut mores) = (&all[..], Vec::with_capacity(counts.len()));
    for rank in 0..counts.len() {
        let of = domain.of(rank);
        for points in &mut points {
            let (words, after) = rest.split_at(2 * of.len());
            put(points, &of, words);
            rest = after;
        }
        mores.push([rest[0], rest[1]]);
        rest = &rest[more.len()..];
    }
    mores
}

/// An observer on each rank: the first one says when they look, and any of them can break the run off.
pub struct Agreed<'a> {
    /// The ranks that look together.
    pub team: &'a Team,
    /// Looks on this rank.
    pub own: &'a mut dyn Observer,
}

impl Observer for Agreed<'_> {
    fn next(&mut self, step: usize) -> usize {
        let own = self.own.next(step) as u64;
        let [next] = self.team.of_first([own]);
        usize::try_from(next).unwrap_or(usize::MAX)
    }

    fn see(&mut self, engine: &Engine, residual: f64) -> ControlFlow<()> {
        let stops = self.own.see(engine, residual).is_break();
        if self.team.any(stops) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}
