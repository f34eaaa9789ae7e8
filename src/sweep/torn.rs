//! The plain barycentre of particles that have lost neighbours: over the neighbours that are left and the ghosts.
//!
//! Along a crack consecutive particles have mostly lost the same neighbours: they are swept as runs, like those of
//! [rows](super::rows) but for the stand-ins of the lost. The others are grouped by what they see, so that
//! nothing is decided particle by particle. The sums are those of
//! [`Flock::target`](crate::flock::law::Flock::target) in the same order: the bits are the same.
//! A broken bond renews its band alone.

#[cfg(test)]
mod tests;

use std::ops::Range;

use super::kernel::Component;
use crate::flock::fracture::{Bonds, StandIn};
use crate::flock::lanes::{InLanes, in_lanes};
use crate::flock::neighbourhood::Neighbours;
use crate::flock::vectors::Vectors;

/// Fewest particles of a run, which are summed up so many at a time.
const SHORT: usize = 8;

/// The same of a long run.
const LONG: usize = 64;

/// Particles of a group that are summed up together.
const SCATTERED: usize = 16;

/// So many of the last groups are looked through for one that a particle fits into: an irregular body has as many as
/// particles.
const GROUPS_TRIED: usize = 32;

/// The followers that have lost a neighbour, as runs, band by band.
#[derive(Clone, Debug, Default)]
pub struct DamagedRows {
    bands: Vec<Band>,
}

#[derive(Clone, Debug, Default)]
struct Band {
    particles: Range<usize>,
    /// Consecutive ones that see the same.
    runs: Vec<Alike>,
    /// Others that see the same, by their places in `members`.
    groups: Vec<Alike>,
    members: Vec<u32>,
    /// The neighbours that each run and group sees, one list after the other.
    seen: Vec<SeenNeighbour>,
}

#[derive(Clone, Debug)]
struct Alike {
    particles: Range<usize>,
    /// Where what they see lies in the band's `seen`.
    seen: Range<usize>,
}

/// One of those that the particles of a run or group see; distances are of indices.
#[derive(Clone, Copy, Debug, PartialEq)]
enum SeenNeighbour {
    /// A neighbour.
    At(isize),
    /// The ghost of a neighbour, at an offset that is the same for all \[length\].
    Offset(isize, [f64; 2]),
    /// The ghost of a neighbour, at its reference offset, which differs between them by rounding.
    Reference(isize),
    /// The mirror image of a neighbour.
    Opposite(isize),
}

impl SeenNeighbour {
    /// A description that fits both this, seen by some, and `other`, seen by the next particle.
    fn shared(self, other: SeenNeighbour) -> Option<SeenNeighbour> {
        match (self, other) {
            (SeenNeighbour::Offset(a, of_a), SeenNeighbour::Offset(b, of_b)) if a == b => {
                let same = of_a.map(f64::to_bits) == of_b.map(f64::to_bits);
                Some(if same { self } else { SeenNeighbour::Reference(a) })
            }
            (SeenNeighbour::Reference(a), SeenNeighbour::Offset(b, _))
            | (SeenNeighbour::Offset(a, _), SeenNeighbour::Reference(b)) => {
                (a == b).then_some(SeenNeighbour::Reference(a))
            }
            _ => (self == other).then_some(self),
        }
    }
}

impl DamagedRows {
    /// Without particles yet, in these bands one after the other.
    pub fn new(bands: impl Iterator<Item = Range<usize>>) -> Self {
        let empty = |particles| Band { particles, ..Band::default() };
        Self { bands: bands.map(empty).collect() }
    }

    pub fn is_empty(&self) -> bool {
        self.bands.iter().all(|band| band.runs.is_empty() && band.members.is_empty())
    }

    /// How many particles.
    #[cfg(test)]
    pub fn len(&self) -> usize {
        let in_runs = |band: &Band| band.runs.iter().map(|run| run.particles.len()).sum::<usize>();
        self.bands.iter().map(|band| in_runs(band) + band.members.len()).sum()
    }

    /// Finds the runs anew in the bands of these particles, which have lost a bond since.
    pub fn renew(
        &mut self,
        particles: impl IntoIterator<Item = usize>,
        follows: &[bool],
        (bonds, neighbours, reference): (&Bonds, &Neighbours, &Vectors),
    ) {
        let band_of = |j| self.bands.partition_point(|band| band.particles.end <= j);
        let mut stale: Vec<usize> = particles.into_iter().map(band_of).collect();
        stale.sort_unstable();
        stale.dedup();
        for band in stale {
            let band = &mut self.bands[band];
            let is_torn = |&j: &usize| follows[j] && bonds.is_torn(j, neighbours);
            let torn: Vec<usize> = band.particles.clone().filter(is_torn).collect();
            *band = Band { particles: band.particles.clone(), ..Band::default() };
            band.compile(&torn, |j| seen_by(j, bonds, neighbours, reference));
        }
    }

    /// Computes both coordinates of the targets of those in some bands, whatever stands there.
    pub fn sweep(&self, bands: Range<usize>, reference: &Vectors, components: &mut [Component<'_, f64>; 2]) {
        in_lanes(Torns { bands: &self.bands[bands], reference, components });
    }
}

/// The neighbours and stand-ins that a particle sees, in the order of summation.
fn seen_by<'a>(
    j: usize,
    bonds: &'a Bonds,
    neighbours: &'a Neighbours,
    reference: &'a Vectors,
) -> impl Iterator<Item = SeenNeighbour> + Clone + 'a {
    let distance = move |k: usize| k as isize - j as isize;
    neighbours.bonds(j).filter_map(move |bond| {
        let there = distance(neighbours.index[bond] as usize);
        if !bonds.is_broken(bond) {
            return Some(SeenNeighbour::At(there));
        }
        Some(match bonds.stand_in(j, bond, neighbours, reference)? {
            StandIn::Offset(lost) => SeenNeighbour::Offset(there, lost),
            StandIn::Opposite(k) => SeenNeighbour::Opposite(distance(k)),
        })
    })
}

/// If all that some see can stand for what another sees as well, makes it so.
fn shares(known: &mut [SeenNeighbour], seen: &[SeenNeighbour]) -> bool {
    let fits = known.len() == seen.len() && known.iter().zip(seen).all(|(a, &b)| a.shared(b).is_some());
    if fits {
        known.iter_mut().zip(seen).for_each(|(a, &b)| *a = a.shared(b).unwrap_or(*a));
    }
    fits
}

impl Band {
    /// Parts the torn particles, ascending, into runs and groups.
    fn compile<S: Iterator<Item = SeenNeighbour>>(&mut self, torn: &[usize], seen_by: impl Fn(usize) -> S) {
        let mut groups: Vec<(Vec<SeenNeighbour>, Vec<u32>)> = Vec::new();
        let mut at = 0;
        while at < torn.len() {
            let mut known: Vec<SeenNeighbour> = seen_by(torn[at]).collect();
            let begin = at;
            at += 1;
            while at < torn.len()
                && torn[at] == torn[at - 1] + 1
                && shares(&mut known, &seen_by(torn[at]).collect::<Vec<_>>())
            {
                at += 1;
            }
            if at - begin >= SHORT {
                let seen = self.keep(&known);
                self.runs.push(Alike { particles: torn[begin]..torn[at - 1] + 1, seen });
                continue;
            }
            let members = torn[begin..at].iter().map(|&j| j as u32);
            match groups
                .iter_mut()
                .rev()
                .take(GROUPS_TRIED)
                .find_map(|(of, members)| shares(of, &known).then_some(members))
            {
                Some(known) => known.extend(members),
                None => groups.push((known, members.collect())),
            }
        }
        for (seen, members) in groups {
            let begin = self.members.len();
            self.members.extend(members);
            let seen = self.keep(&seen);
            self.groups.push(Alike { particles: begin..self.members.len(), seen });
        }
    }

    fn keep(&mut self, seen: &[SeenNeighbour]) -> Range<usize> {
        let begin = self.seen.len();
        self.seen.extend_from_slice(seen);
        begin..self.seen.len()
    }
}

/// The torn of some bands, whose numbers of particles say how many are summed up at a time.
struct Torns<'a, 'b> {
    bands: &'a [Band],
    reference: &'a Vectors,
    components: &'a mut [Component<'b, f64>; 2],
}

impl InLanes for Torns<'_, '_> {
    const BYTES: usize = 8;
    const MULTIPLIES: bool = true;

    #[inline(always)]
    fn run<const W: usize>(self) {
        sweep_bands(self.bands, self.reference, self.components);
    }
}

#[inline(always)]
fn sweep_bands(bands: &[Band], reference: &Vectors, components: &mut [Component<'_, f64>; 2]) {
    for band in bands {
        for Alike { particles, seen } in &band.runs {
            for (axis, component) in components.iter_mut().enumerate() {
                let look = RowTerms { seen: &band.seen[seen.clone()], axis, reference };
                if particles.len() < LONG {
                    sweep_run::<SHORT>(particles.clone(), look, component);
                } else {
                    sweep_run::<LONG>(particles.clone(), look, component);
                }
            }
        }
        for Alike { particles, seen } in &band.groups {
            for (axis, component) in components.iter_mut().enumerate() {
                let look = RowTerms { seen: &band.seen[seen.clone()], axis, reference };
                sweep_group(&band.members[particles.clone()], look, component);
            }
        }
    }
}

/// At least `W` particles, `W` at a time.
#[inline(always)]
fn sweep_run<const W: usize>(
    particles: Range<usize>,
    look: RowTerms<'_>,
    component: &mut Component<'_, f64>,
) {
    for from in particles.clone().step_by(W) {
        // The last ones overlap those before them, which come out the same again.
        let from = from.min(particles.end - W);
        let lanes = |of: &[f64], first: usize, distance: isize| -> [f64; W] {
            let at = (from - first).wrapping_add_signed(distance);
            of[at..at + W].try_into().expect("as many as asked for")
        };
        let targets = look.targets(lanes, component);
        component.next[from - component.begin..][..W].copy_from_slice(&targets.0);
    }
}

/// Not compiled for wide vectors, which would gather what they hold more slowly than it is loaded.
#[inline(never)]
fn sweep_group(particles: &[u32], look: RowTerms<'_>, component: &mut Component<'_, f64>) {
    for piece in particles.chunks(SCATTERED) {
        // A last piece too short is filled up with one of its own.
        let mut which = [piece[0] as usize; SCATTERED];
        which.iter_mut().zip(piece).for_each(|(which, &j)| *which = j as usize);
        let lanes = |of: &[f64], first: usize, distance: isize| {
            which.map(|j| of[(j - first).wrapping_add_signed(distance)])
        };
        let targets = look.targets(lanes, component);
        piece
            .iter()
            .zip(targets.0)
            .for_each(|(&j, target)| component.next[j as usize - component.begin] = target);
    }
}

/// Numbers of so many particles, each vector of them within one cache line.
#[repr(align(64))]
struct Lanes<const W: usize>([f64; W]);

/// One coordinate of the neighbours that some particles see.
#[derive(Clone, Copy)]
struct RowTerms<'a> {
    seen: &'a [SeenNeighbour],
    axis: usize,
    reference: &'a Vectors,
}

impl RowTerms<'_> {
    /// Computes what [`Rule::target`](crate::flock::rules::Rule::target) does: the rest offset is added to the mean,
    /// also where it is zero, which makes 0.0 of -0.0; a particle that sees none stays. `of` reads numbers, those of
    /// particle number `first` first, at a distance of indices from the particles.
    #[inline(always)]
    fn targets<const W: usize>(
        &self,
        of: impl Fn(&[f64], usize, isize) -> [f64; W],
        component: &Component<'_, f64>,
    ) -> Lanes<W> {
        let present = |distance| of(component.present, component.seen_from, distance);
        let here = present(0);
        if self.seen.is_empty() {
            return Lanes(here);
        }
        let reference = if self.axis == 0 { &self.reference.x } else { &self.reference.y };
        let mut sum = Lanes([-0.0; W]);
        for &seen in self.seen {
            match seen {
                SeenNeighbour::At(distance) => {
                    let there = present(distance);
                    (0..W).for_each(|k| sum.0[k] += there[k]);
                }
                SeenNeighbour::Offset(_, lost) => (0..W).for_each(|k| sum.0[k] += here[k] + lost[self.axis]),
                SeenNeighbour::Reference(distance) => {
                    let [there, own] = [distance, 0].map(|distance| of(reference, 0, distance));
                    (0..W).for_each(|k| sum.0[k] += here[k] + (there[k] - own[k]));
                }
                SeenNeighbour::Opposite(distance) => {
                    let there = present(distance);
                    (0..W).for_each(|k| sum.0[k] += 2.0 * here[k] - there[k]);
                }
            }
        }
        let count = self.seen.len() as f64;
        if self.seen.len().is_power_of_two() {
            // The same number to the bit, and no division.
            (0..W).for_each(|k| sum.0[k] *= 1.0 / count);
        } else {
            (0..W).for_each(|k| sum.0[k] /= count);
        }
        let rest = component.rest.map_or([0.0; W], |rest| of(rest, 0, 0));
        (0..W).for_each(|k| sum.0[k] += rest[k]);
        sum
    }
}
