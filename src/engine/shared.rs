//! A body that several ranks share.
//!
//! Every rank has the whole plan (roles, neighbours, weights, leaders) and moves the particles of its
//! [`Domain`]. Between steps whose course is known ahead the ranks exchange halos, for as many steps
//! together as pay. Everything that looks at the whole body is preceded by [`Engine::gather`], after which every
//! rank knows all positions and finds the same: bonds that break, neighbours found anew, roles taken on a
//! condition, frames that look after the sweep, observers. So what a body does hangs on no rank, and its bits on no number
//! of them.

use std::ops::{ControlFlow, Range};

use super::Engine;
use super::observer::Observer;
use crate::flock::vectors::Vectors;
use crate::ranks::Team;
use crate::sweep::Order;
use crate::sweep::caches::Caches;
use crate::sweep::domain::{Domain, Share};

/// A sweep that ranks cannot share.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a sequential sweep moves one particle after the other and cannot be shared by ranks")]
pub struct NotShared;

impl Engine {
    /// Shares the body with the other ranks from here on. All ranks must have the same engine.
    ///
    /// # Errors
    /// A sequential sweep.
    pub fn join(&mut self, team: Team) -> Result<(), NotShared> {
        if team.count() == 1 {
            return Ok(());
        }
        if self.update.order == Order::Sequential {
            return Err(NotShared);
        }
        let caches = agreed_caches(&team);
        let share = Share { rank: team.rank(), ranks: team.count(), caches };
        if !team.is_first() {
            let _ = self.activity.take_counts();
        }
        self.team = Some((team, share));
        self.compile_sweep();
        Ok(())
    }

    /// Makes the positions of all particles, now and before the last step, known to all ranks that share the body.
    /// Every rank must call it at the same step.
    pub fn gather(&mut self) {
        let (Some((team, _)), Some(domain)) = (&self.team, self.sweep.domain()) else { return };
        if self.is_whole {
            return;
        }
        let of_ranks =
            gather_points(team, domain, [&mut self.present, &mut self.previous], self.activity.take_counts());
        self.is_whole = true;
        if team.is_first() {
            of_ranks.into_iter().for_each(|counts| self.activity.add_counts(counts));
        }
    }

    /// One step of a body whose positions are all known: each rank moves its own, and then all are known again, the next
    /// ones in `previous`.
    pub(super) fn step_shared(&mut self) {
        self.sweep.step(&self.flock, None, &self.present, &mut self.previous);
        if let (Some((team, _)), Some(domain)) = (&self.team, self.sweep.domain()) {
            gather_points(team, domain, [&mut self.previous], [0; 2]);
        }
        if let Some(frame) = &self.body.frame {
            frame.follow(&self.flock.reference, &self.present, &mut self.previous);
        }
    }

    /// Exchanges the particles that must be known for so many steps together.
    pub(super) fn receive_halo(&mut self, steps: usize) {
        let Some((team, _)) = &self.team else { return };
        if !std::mem::replace(&mut self.is_whole, false) {
            let halo = self.sweep.halo(steps);
            let sent: Vec<_> =
                halo.sends.iter().map(|(rank, of)| (*rank, words(&self.present, of))).collect();
            let sizes: Vec<_> = halo.receives.iter().map(|(rank, of)| (*rank, 2 * of.len())).collect();
            let received = team.swap(&sent, &sizes);
            for ((_, of), words) in halo.receives.iter().zip(received) {
                put(&mut self.present, of, &words);
            }
        }
    }

    /// For each step, whether it is so on any rank.
    pub(super) fn on_any_rank(&self, own: Vec<bool>) -> Vec<bool> {
        let Some((team, _)) = &self.team else { return own };
        let bits = own.iter().enumerate().fold(0, |bits, (k, &own)| bits | u64::from(own) << k);
        let any = team.each([bits]).into_iter().fold(0, |any, [bits]| any | bits);
        (0..own.len()).map(|k| any >> k & 1 == 1).collect()
    }
}

/// The first rank's: all must cut the body into the same bands.
fn agreed_caches(team: &Team) -> Caches {
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

/// Coordinates as words: x, then y.
fn words(points: &Vectors, of: &Range<usize>) -> Vec<u64> {
    points.x[of.clone()].iter().chain(&points.y[of.clone()]).map(|value| value.to_bits()).collect()
}

fn put(points: &mut Vectors, of: &Range<usize>, words: &[u64]) {
    let (x, y) = words.split_at(of.len());
    for (to, words) in [(&mut points.x, x), (&mut points.y, y)] {
        to[of.clone()].iter_mut().zip(words).for_each(|(value, &bits)| *value = f64::from_bits(bits));
    }
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
