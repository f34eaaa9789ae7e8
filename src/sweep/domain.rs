//! The part of a body that a rank moves, and what it has to be given of the others' parts.
//!
//! A rank *owns* a stretch of the numbering, cut where bands end. To take `n` steps without being given anything on the
//! way it also needs a *halo*: `n` bands on each side, of which it moves one fewer in each step, until what it owns
//! is left. The ranks on both sides of a cut compute these bands twice, from the same numbers to the same bits.

use std::ops::Range;

use super::caches::Caches;
use super::rows::Rows;
use super::schedule::MOST_STEPS;

/// Bands that a rank owns for each step taken together: the halo, which is computed twice, is at most a quarter of what a
/// rank computes on either side.
const BANDS_A_STEP: usize = 4;

/// One of several ranks that share a body, and the caches by which it is cut into bands: all ranks must cut it alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Share {
    /// The number of this rank, from 0.
    pub rank: usize,
    /// How many ranks there are.
    pub ranks: usize,
    /// Of one computer, the same for all ranks.
    pub caches: Caches,
}

impl Share {
    /// A body that is not shared, cut for this computer.
    pub fn whole() -> Self {
        Self { rank: 0, ranks: 1, caches: Caches::here() }
    }
}

/// Shares of the particles, by rank.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Domain {
    rank: usize,
    /// Where the ranks' parts begin, and where the last one ends, in bands and in particles; shape \[ranks + 1\]. There
    /// are no bands where the rule has no rows.
    bands: Option<Vec<usize>>,
    particles: Vec<usize>,
}

/// Particles that a rank sends and receives before steps: (rank, particles), at most one stretch for each rank.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Halo {
    /// Particles of this rank that others need.
    pub sends: Vec<(usize, Range<usize>)>,
    /// Particles of others that this rank needs.
    pub receives: Vec<(usize, Range<usize>)>,
}

impl Domain {
    /// Parts with about as many followers each.
    pub fn of_rows(rows: &Rows, share: Share) -> Self {
        let costs = (0..rows.band_count()).map(|band| rows.followers(band));
        let bands = cuts(costs, share.ranks);
        let begin = |&band: &usize| if band == 0 { 0 } else { rows.particles(band - 1..band).end };
        let particles = bands.iter().map(begin).collect();
        Self { rank: share.rank, bands: Some(bands), particles }
    }

    /// The same where the rule has no rows.
    pub fn of_particles(follows: &[bool], share: Share) -> Self {
        let particles = cuts(follows.iter().map(|&follows| usize::from(follows)), share.ranks);
        Self { rank: share.rank, bands: None, particles }
    }

    /// The particles of this rank.
    pub fn owned(&self) -> Range<usize> {
        self.of(self.rank)
    }

    /// The particles of a rank.
    pub fn of(&self, rank: usize) -> Range<usize> {
        self.particles[rank]..self.particles[rank + 1]
    }

    /// How many particles each rank has, shape \[ranks\].
    pub fn counts(&self) -> Vec<usize> {
        self.particles.windows(2).map(|ends| ends[1] - ends[0]).collect()
    }

    /// The bands of this rank.
    pub fn bands(&self) -> Range<usize> {
        self.bands.as_ref().map_or(0..0, |cuts| cuts[self.rank]..cuts[self.rank + 1])
    }

    /// Most steps that are worth taking together: more for larger parts, the same for all ranks.
    pub fn steps_together(&self) -> usize {
        let sizes = self.bands.iter().flat_map(|cuts| cuts.windows(2)).map(|ends| ends[1] - ends[0]);
        let least = sizes.filter(|&bands| bands > 0).min().unwrap_or(0);
        steps_of(least)
    }

    /// The exchange before so many steps are taken together.
    pub fn halo(&self, rows: &Rows, steps: usize) -> Halo {
        let others = (0..self.counts().len()).filter(|&rank| rank != self.rank);
        let mut halo = Halo::default();
        for other in others {
            let sent = meet(&self.needed(other, rows, steps), &self.owned());
            let received = meet(&self.needed(self.rank, rows, steps), &self.of(other));
            halo.sends.extend(sent.map(|particles| (other, particles)));
            halo.receives.extend(received.map(|particles| (other, particles)));
        }
        halo
    }

    /// How many particles each rank receives before so many steps, shape \[ranks\].
    pub fn halo_sizes(&self, rows: &Rows, steps: usize) -> Vec<usize> {
        let counts = self.counts().into_iter().enumerate();
        counts.map(|(rank, own)| self.needed(rank, rows, steps).len().saturating_sub(own)).collect()
    }

    /// The particles that a rank needs in order to take so many steps, its own among them; none if it owns none.
    fn needed(&self, rank: usize, rows: &Rows, steps: usize) -> Range<usize> {
        let cuts = self.bands.as_deref().unwrap_or_default();
        let (Some(&from), Some(&to)) = (cuts.get(rank), cuts.get(rank + 1)) else { return 0..0 };
        if from == to {
            return 0..0;
        }
        rows.particles(from.saturating_sub(steps)..(to + steps).min(rows.band_count()))
    }
}

/// How many steps a rank of so many bands takes together.
pub fn steps_of(bands: usize) -> usize {
    (bands / BANDS_A_STEP).clamp(1, MOST_STEPS)
}

/// The intersection of both stretches, if any.
fn meet(a: &Range<usize>, b: &Range<usize>) -> Option<Range<usize>> {
    let both = a.start.max(b.start)..a.end.min(b.end);
    (!both.is_empty()).then_some(both)
}

/// Where to cut things that cost so much into parts that cost about the same; shape \[parts + 1\].
fn cuts(costs: impl Iterator<Item = usize> + Clone, parts: usize) -> Vec<usize> {
    let total: usize = costs.clone().sum();
    let (mut cuts, mut before, mut count) = (vec![0], 0, 0);
    for cost in costs {
        // In the middle of what it costs: no part begins with a band that belongs to the one before it.
        while cuts.len() < parts && (2 * before + cost) * parts >= 2 * total * cuts.len() {
            cuts.push(count);
        }
        before += cost;
        count += 1;
    }
    cuts.resize(parts + 1, count);
    cuts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::body::{Body, Cut};
    use crate::flock::lattice::{Lattice, LatticeKind};
    use crate::flock::law::{Flock, Weights};
    use crate::flock::neighbourhood::Neighbourhood;
    use crate::flock::rules::Rule;

    #[test]
    fn parts_cost_about_the_same_and_leave_nothing_out() {
        let even = cuts([1; 12].into_iter(), 4);
        assert_eq!(even, [0, 3, 6, 9, 12]);
        assert_eq!(cuts([0, 0, 4, 0, 4, 4].into_iter(), 3), [0, 3, 5, 6]);
        assert_eq!(cuts([5].into_iter(), 1), [0, 1]);
        for parts in 1..9 {
            let cuts = cuts([3, 1, 4, 1, 5].into_iter(), parts);
            assert_eq!((cuts.len(), cuts[0], cuts[parts]), (parts + 1, 0, 5), "{cuts:?}");
            assert!(cuts.is_sorted());
        }
        assert_eq!(cuts(std::iter::empty(), 3), [0, 0, 0, 0]);
    }

    #[test]
    fn what_a_rank_receives_is_what_the_others_send_it_and_all_that_it_needs() {
        let lattice = Lattice::new(LatticeKind::Square { spacing: 1.0 }, [0.0; 2], 0.0);
        let cut = Cut::Count { columns: 60, rows: 7 };
        let (body, neighbours) =
            Body::build(lattice, &cut, &Neighbourhood::First { keep: None }, None).expect("fits");
        let flock = Flock::new(Rule::BARYCENTRE, body.reference, neighbours, Weights::Equal);
        let count = flock.reference.len();
        // The last ranks have nothing to do, and many steps reach over several ranks.
        for ranks in [2, 5, 40] {
            let share = |rank| Share { rank, ranks, ..Share::whole() };
            let rows = Rows::compile(&flock, &vec![true; count], share(0)).expect("a barycentre");
            let domains: Vec<Domain> = (0..ranks).map(|rank| Domain::of_rows(&rows, share(rank))).collect();
            for steps in [1, 3, 16] {
                let halos: Vec<Halo> = domains.iter().map(|domain| domain.halo(&rows, steps)).collect();
                for (rank, domain) in domains.iter().enumerate() {
                    let sent = |from: usize| halos[from].sends.iter().filter(|(to, _)| *to == rank);
                    let sent: Vec<_> = (0..ranks)
                        .flat_map(|from| sent(from).map(move |(_, of)| (from, of.clone())))
                        .collect();
                    assert_eq!(halos[rank].receives, sent, "rank {rank} of {ranks}, {steps} steps");
                    let received: usize = sent.iter().map(|(_, of)| of.len()).sum();
                    assert_eq!(received, domain.halo_sizes(&rows, steps)[rank]);
                    assert_eq!(received == 0, domain.owned().is_empty(), "rank {rank} of {ranks}");
                }
            }
        }
    }

    #[test]
    fn stretches_meet_in_what_both_have() {
        assert_eq!(meet(&(2..7), &(5..9)), Some(5..7));
        assert_eq!(meet(&(2..5), &(5..9)), None);
        assert_eq!(meet(&(0..0), &(0..9)), None);
    }
}
