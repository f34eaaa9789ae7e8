//! The part of a body that a rank moves, and what it has to be given of the others' parts.
//!
//! A rank *owns* a stretch of the numbering, cut where bands end. To take `n` steps without being given anything on the
//! way it also needs a *halo*: `n` bands on each side, of which it moves one fewer in each step, until what it owns
//! is left. The ranks on both sides of a cut compute these bands twice, from the same numbers to the same bits.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::caches::Caches;
use super::rows::Rows;
use super::schedule::MOST_STEPS;
use crate::flock::halo::Halo;

/// Bands that a rank owns for each step taken together: the halo, which is computed twice, is at most a quarter of what a
/// rank computes on either side.
const BANDS_A_STEP: usize = 4;

/// One of several ranks that share a body, and the caches by which it is cut into bands: where each rank has the whole body,
/// all must cut it alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Share {
    /// The number of this rank, from 0.
    pub rank: usize,
    /// How many ranks there are.
    pub ranks: usize,
    /// Of one computer, the same for all ranks.
    pub caches: Caches,
    /// The part of the body that this rank has, where it has no more.
    pub part: Option<Held>,
}

/// Some of a body's particles, as numbers of those that stand here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Held {
    /// Number of the first particle in the whole body.
    pub first: usize,
    /// Particles of the whole body.
    pub total: usize,
    /// The first particle that this rank moves, and the one after the last.
    pub owned: [usize; 2],
    /// The same of those that see here what they see in the whole body: others are not moved at all.
    pub exact: [usize; 2],
}

impl Share {
    /// A body that is not shared, cut for this computer.
    pub fn whole() -> Self {
        Self { rank: 0, ranks: 1, caches: Caches::here(), part: None }
    }

    /// Particles where a band has to end, ascending; none where it may end anywhere.
    pub(super) fn cuts(&self) -> Vec<usize> {
        self.part.map_or_else(Vec::new, |Held { owned: [a, b], exact: [c, d], .. }| vec![c, a, b, d])
    }
}

/// Shares of the particles, by rank. Unless it says otherwise, particles are numbered as in the whole body.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Domain {
    rank: usize,
    /// Number of the first particle that stands here.
    first: usize,
    /// The bands of this rank; none where the rule has no rows.
    bands: Range<usize>,
    /// Of all ranks, shape \[ranks\]; of this one alone until [`Domain::learn`] where each has a part of the body.
    shares: Vec<Needs>,
}

/// What a rank moves and what it needs for that.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Needs {
    owned: Range<usize>,
    /// Most steps that it can take together; 0 where it looks at each.
    steps: usize,
    /// The particles that it sees when it takes a step by itself, its own among them.
    seen: Range<usize>,
    /// The particles that it needs for so many steps, its own among them; number 0 is all that it has. Shape
    /// \[[`MOST_STEPS`] + 1\].
    needed: Vec<Range<usize>>,
}

impl Needs {
    fn of(owned: Range<usize>, all: Range<usize>) -> Self {
        let all = if owned.is_empty() { 0..0 } else { all };
        Self { owned, steps: 0, seen: all.clone(), needed: vec![all; MOST_STEPS + 1] }
    }

    /// Most steps together, if so many bands are to be known beyond those that they need, and how many particles of others all
    /// that is; of a rank that looks at each step those that it sees.
    pub fn most(&self, spare: usize) -> (usize, usize) {
        let steps = self.steps.saturating_sub(spare);
        let needed = if steps == 0 { &self.seen } else { &self.needed[self.steps] };
        (steps, needed.len() - self.owned.len())
    }
}

impl Domain {
    /// Parts with about as many followers each; or the part that is there.
    pub(crate) fn of_rows(rows: &Rows, share: Share) -> Self {
        if let Some(held) = share.part {
            return Self::of_held_rows(rows, share, held);
        }
        let count = rows.band_count();
        let cuts = cuts((0..count).map(|band| rows.followers(band)), share.ranks);
        let least = cuts.windows(2).map(|ends| ends[1] - ends[0]).filter(|&bands| bands > 0).min();
        let needs = |ends: &[usize]| {
            let of = |bands: Range<usize>| if count == 0 { 0..0 } else { rows.particles(bands) };
            let mut needs = Needs::of(of(ends[0]..ends[1]), of(0..count));
            needs.steps = steps_of(least.unwrap_or(0));
            for steps in (1..=MOST_STEPS).filter(|_| ends[0] < ends[1]) {
                needs.needed[steps] = of(ends[0].saturating_sub(steps)..(ends[1] + steps).min(count));
            }
            needs
        };
        let bands = cuts[share.rank]..cuts[share.rank + 1];
        Self { rank: share.rank, first: 0, bands, shares: cuts.windows(2).map(needs).collect() }
    }

    fn of_held_rows(rows: &Rows, share: Share, held: Held) -> Self {
        let mut domain = Self::of_held(share, held);
        let band_at = |particle: usize| {
            (0..rows.band_count()).find(|&band| rows.particles(band..band + 1).start >= particle)
        };
        let [owned, exact] = [held.owned, held.exact].map(|ends| {
            let [start, end] = ends.map(|end| band_at(end).unwrap_or(rows.band_count()));
            start..end
        });
        domain.bands = owned.clone();
        let needs = &mut domain.shares[share.rank];
        // Beyond the ends of the body there is nothing to be known.
        let before = if held.first + held.exact[0] == 0 { MOST_STEPS } else { owned.start - exact.start };
        let ends = held.first + held.exact[1] == held.total;
        let after = if ends { MOST_STEPS } else { exact.end - owned.end };
        needs.steps = MOST_STEPS;
        if !owned.is_empty() {
            needs.steps = steps_of(owned.len()).min(before).min(after);
            for steps in 1..=MOST_STEPS {
                let bands =
                    owned.start.saturating_sub(steps).max(exact.start)..(owned.end + steps).min(exact.end);
                let particles = rows.particles(bands);
                needs.needed[steps] = held.first + particles.start..held.first + particles.end;
            }
        }
        domain
    }

    /// The same where the rule has no rows.
    pub(crate) fn of_particles(follows: &[bool], share: Share) -> Self {
        if let Some(held) = share.part {
            return Self::of_held(share, held);
        }
        let cuts = cuts(follows.iter().map(|&follows| usize::from(follows)), share.ranks);
        let shares = cuts.windows(2).map(|ends| Needs::of(ends[0]..ends[1], 0..follows.len())).collect();
        Self { rank: share.rank, first: 0, bands: 0..0, shares }
    }

    fn of_held(share: Share, held: Held) -> Self {
        let Held { first, owned, exact, .. } = held;
        let [owned, exact] = [owned, exact].map(|[start, end]| first + start..first + end);
        let mut shares = vec![Needs::of(0..0, 0..0); share.ranks];
        shares[share.rank] = Needs::of(owned, exact);
        Self { rank: share.rank, first, bands: 0..0, shares }
    }

    /// What this rank moves and needs, for the others to know, if its particles see these of those that stand here.
    pub fn needs(&mut self, takes_several: bool, seen: Range<usize>) -> &Needs {
        let needs = &mut self.shares[self.rank];
        if !takes_several {
            needs.steps = 0;
        }
        if !needs.owned.is_empty() {
            needs.seen = self.first + seen.start..self.first + seen.end;
        }
        needs
    }

    /// Takes in what all ranks move and need.
    pub fn learn(&mut self, shares: Vec<Needs>) {
        self.shares = shares;
    }

    /// The particles of this rank, as numbers of those that stand here.
    pub fn owned(&self) -> Range<usize> {
        self.here(&self.of(self.rank))
    }

    /// The particles of a rank.
    pub fn of(&self, rank: usize) -> Range<usize> {
        self.shares[rank].owned.clone()
    }

    fn here(&self, of: &Range<usize>) -> Range<usize> {
        of.start - self.first..of.end - self.first
    }

    /// How many particles each rank has, shape \[ranks\].
    pub fn counts(&self) -> Vec<usize> {
        self.shares.iter().map(|share| share.owned.len()).collect()
    }

    /// The bands of this rank.
    pub fn bands(&self) -> Range<usize> {
        self.bands.clone()
    }

    /// Most steps that are worth taking together: more for larger parts, the same for all ranks.
    pub(crate) fn steps_together(&self) -> usize {
        self.shares.iter().map(|share| share.steps).min().unwrap_or(0)
    }

    /// The exchange before so many steps are taken together; before 0 steps, of all that a rank has of others.
    pub fn halo(&self, steps: usize) -> Halo {
        self.halo_of(|share| &share.needed[steps])
    }

    /// The exchange before a step that is taken by itself.
    pub fn halo_of_a_step(&self) -> Halo {
        self.halo_of(|share| &share.seen)
    }

    fn halo_of(&self, needed: impl Fn(&Needs) -> &Range<usize>) -> Halo {
        let needed = |rank: usize| needed(&self.shares[rank]).clone();
        Halo::new((self.rank, self.shares.len()), |rank| self.of(rank), needed).here(self.first)
    }

    /// How many particles each rank receives before so many steps, shape \[ranks\].
    pub(crate) fn halo_sizes(&self, steps: usize) -> Vec<usize> {
        let of = |share: &Needs| share.needed[steps].len().saturating_sub(share.owned.len());
        self.shares.iter().map(of).collect()
    }
}

/// How many steps a rank of so many bands takes together.
pub fn steps_of(bands: usize) -> usize {
    (bands / BANDS_A_STEP).clamp(1, MOST_STEPS)
}

/// Where to cut things that cost so much into parts that cost about the same; shape \[parts + 1\].
pub fn cuts(costs: impl Iterator<Item = usize> + Clone, parts: usize) -> Vec<usize> {
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
                let halos: Vec<Halo> = domains.iter().map(|domain| domain.halo(steps)).collect();
                for (rank, domain) in domains.iter().enumerate() {
                    let sent = |from: usize| halos[from].sends.iter().filter(|(to, _)| *to == rank);
                    let sent: Vec<_> = (0..ranks)
                        .flat_map(|from| sent(from).map(move |(_, of)| (from, of.clone())))
                        .collect();
                    assert_eq!(halos[rank].receives, sent, "rank {rank} of {ranks}, {steps} steps");
                    let received: usize = sent.iter().map(|(_, of)| of.len()).sum();
                    assert_eq!(received, domain.halo_sizes(steps)[rank]);
                    assert_eq!(received == 0, domain.owned().is_empty(), "rank {rank} of {ranks}");
                }
            }
        }
    }
}
