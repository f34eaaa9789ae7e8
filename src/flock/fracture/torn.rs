//! The plain barycentre of particles that have lost neighbours: over those who are left and the ghosts.
//!
//! Along a crack consecutive particles have mostly lost the same neighbours, so that they are swept as runs, like those
//! of a [stencil](super::super::stencil) but for what stands in for the lost. Whoever is alone in this is a run of
//! one. The sums are those of [`Interaction::target`](super::super::interaction::Interaction::target) in the same
//! order: the bits are the same. What broke renews the runs of its band alone.

use std::ops::Range;

use super::super::neighbourhood::Neighbours;
use super::super::points::Points;
use super::super::stencil::Plane;
use super::{Bonds, StandIn};

/// Particles that are summed up together in short runs and in long ones; one by one in still shorter ones.
const SHORT: usize = 8;
const LONG: usize = 64;

/// The followers that have lost a neighbour, as runs, band by band.
#[derive(Clone, Debug, Default)]
pub struct Torn {
    bands: Vec<Band>,
}

#[derive(Clone, Debug)]
struct Band {
    particles: Range<usize>,
    runs: Vec<Run>,
    /// What each run sees, one after the other.
    seen: Vec<Seen>,
}

#[derive(Clone, Debug)]
struct Run {
    particles: Range<usize>,
    /// Where what it sees lies in the band's `seen`.
    seen: Range<usize>,
}

/// One of those that a particle of a run sees; distances are of indices.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Seen {
    /// A neighbour.
    At(isize),
    /// The ghost of a neighbour, at an offset that is the same in the whole run \[length\].
    Offset(isize, [f64; 2]),
    /// The ghost of a neighbour, at its reference offset: that of a run's particles may differ by rounding.
    Reference(isize),
    /// The mirror image of a neighbour.
    Opposite(isize),
}

impl Seen {
    /// What stands for both this, seen by some, and `other`, seen by the next particle.
    fn shared(self, other: Seen) -> Option<Seen> {
        match (self, other) {
            (Seen::Offset(a, of_a), Seen::Offset(b, of_b)) if a == b => {
                let same = of_a.map(f64::to_bits) == of_b.map(f64::to_bits);
                Some(if same { self } else { Seen::Reference(a) })
            }
            (Seen::Reference(a), Seen::Offset(b, _)) => (a == b).then_some(self),
            _ => (self == other).then_some(self),
        }
    }
}

impl Torn {
    /// Nobody yet, in these bands one after the other.
    pub fn new(bands: impl Iterator<Item = Range<usize>>) -> Self {
        let empty = |particles| Band { particles, runs: Vec::new(), seen: Vec::new() };
        Self { bands: bands.map(empty).collect() }
    }

    pub fn is_empty(&self) -> bool {
        self.bands.iter().all(|band| band.runs.is_empty())
    }

    /// How many particles.
    pub fn len(&self) -> usize {
        self.bands.iter().flat_map(|band| &band.runs).map(|run| run.particles.len()).sum()
    }

    /// Finds the runs anew where these particles are, who have lost a bond since.
    pub fn renew(
        &mut self,
        particles: impl IntoIterator<Item = usize>,
        follows: &[bool],
        (bonds, neighbours, reference): (&Bonds, &Neighbours, &Points),
    ) {
        let band_of = |j| self.bands.partition_point(|band| band.particles.end <= j);
        let mut stale: Vec<usize> = particles.into_iter().map(band_of).collect();
        stale.sort_unstable();
        stale.dedup();
        for band in stale {
            let band = &mut self.bands[band];
            band.runs.clear();
            band.seen.clear();
            let torn = |&j: &usize| follows[j] && bonds.is_torn(j, neighbours);
            for j in band.particles.clone().filter(torn) {
                band.push(j, seen_by(j, bonds, neighbours, reference));
            }
        }
    }

    /// Computes both coordinates of the targets of those in some bands, whatever stands there.
    pub fn sweep(&self, bands: Range<usize>, reference: &Points, planes: &mut [Plane<'_, f64>; 2]) {
        let bands = &self.bands[bands];
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx512f") {
            // SAFETY: the processor has AVX-512, which is all that the callee asks for.
            return unsafe { sweep_avx512(bands, reference, planes) };
        } else if is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2, which is all that the callee asks for.
            return unsafe { sweep_avx2(bands, reference, planes) };
        }
        sweep_bands(bands, reference, planes);
    }
}

/// What a particle sees, in the order in which it is summed.
fn seen_by<'a>(
    j: usize,
    bonds: &'a Bonds,
    neighbours: &'a Neighbours,
    reference: &'a Points,
) -> impl Iterator<Item = Seen> + Clone + 'a {
    let distance = move |k: usize| k as isize - j as isize;
    neighbours.bonds(j).filter_map(move |bond| {
        let there = distance(neighbours.index[bond] as usize);
        if !bonds.is_broken(bond) {
            return Some(Seen::At(there));
        }
        Some(match bonds.stand_in(j, bond, neighbours, reference)? {
            StandIn::Offset(lost) => Seen::Offset(there, lost),
            StandIn::Opposite(k) => Seen::Opposite(distance(k)),
        })
    })
}

impl Band {
    /// Adds the next particle, to the last run if it fits there.
    fn push(&mut self, j: usize, seen: impl Iterator<Item = Seen> + Clone) {
        let last = self.runs.last_mut().filter(|last| last.particles.end == j);
        if let Some(last) = last {
            let known = &mut self.seen[last.seen.clone()];
            let shared = || known.iter().zip(seen.clone()).map(|(&a, b)| a.shared(b));
            if seen.clone().count() == known.len() && shared().all(|shared| shared.is_some()) {
                known.iter_mut().zip(seen).for_each(|(a, b)| *a = a.shared(b).unwrap_or(*a));
                last.particles.end = j + 1;
                return;
            }
        }
        let begin = self.seen.len();
        self.seen.extend(seen);
        self.runs.push(Run { particles: j..j + 1, seen: begin..self.seen.len() });
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn sweep_avx512(bands: &[Band], reference: &Points, planes: &mut [Plane<'_, f64>; 2]) {
    sweep_bands(bands, reference, planes);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn sweep_avx2(bands: &[Band], reference: &Points, planes: &mut [Plane<'_, f64>; 2]) {
    sweep_bands(bands, reference, planes);
}

#[inline(always)]
fn sweep_bands(bands: &[Band], reference: &Points, planes: &mut [Plane<'_, f64>; 2]) {
    for band in bands {
        for run in &band.runs {
            let seen = &band.seen[run.seen.clone()];
            for (axis, plane) in planes.iter_mut().enumerate() {
                let body = (axis, if axis == 0 { &reference.x[..] } else { &reference.y[..] });
                match run.particles.len() {
                    0..SHORT => sweep_pieces::<1>(run.particles.clone(), seen, body, plane),
                    SHORT..LONG => sweep_pieces::<SHORT>(run.particles.clone(), seen, body, plane),
                    _ => sweep_pieces::<LONG>(run.particles.clone(), seen, body, plane),
                }
            }
        }
    }
}

/// `W` particles at a time, and no fewer.
#[inline(always)]
fn sweep_pieces<const W: usize>(
    particles: Range<usize>,
    seen: &[Seen],
    body: (usize, &[f64]),
    plane: &mut Plane<'_, f64>,
) {
    for from in particles.clone().step_by(W) {
        // The last ones overlap those before them, which come out the same again.
        sweep_piece::<W>(from.min(particles.end - W), seen, body, plane);
    }
}

/// What [`Rule::target`](super::super::rules::Rule::target) computes: the rest offset is added to the mean, also where
/// it is zero, which makes 0.0 of -0.0; whoever sees nobody stays.
#[inline(always)]
fn sweep_piece<const W: usize>(
    from: usize,
    seen: &[Seen],
    (axis, reference): (usize, &[f64]),
    plane: &mut Plane<'_, f64>,
) {
    let (present, at) = (plane.present, from - plane.seen_from);
    let seen_at = |distance| lanes::<W>(present, at.wrapping_add_signed(distance));
    let here = seen_at(0);
    let target = &mut plane.next[from - plane.begin..][..W];
    if seen.is_empty() {
        target.copy_from_slice(here);
        return;
    }
    let mut sum = [-0.0; W];
    for &seen in seen {
        match seen {
            Seen::At(distance) => {
                let there = seen_at(distance);
                (0..W).for_each(|k| sum[k] += there[k]);
            }
            Seen::Offset(_, lost) => (0..W).for_each(|k| sum[k] += here[k] + lost[axis]),
            Seen::Reference(distance) => {
                let there = lanes::<W>(reference, from.wrapping_add_signed(distance));
                let own = lanes::<W>(reference, from);
                (0..W).for_each(|k| sum[k] += here[k] + (there[k] - own[k]));
            }
            Seen::Opposite(distance) => {
                let there = seen_at(distance);
                (0..W).for_each(|k| sum[k] += 2.0 * here[k] - there[k]);
            }
        }
    }
    let count = seen.len() as f64;
    if seen.len().is_power_of_two() {
        // The same number to the bit, and no division.
        (0..W).for_each(|k| sum[k] *= 1.0 / count);
    } else {
        (0..W).for_each(|k| sum[k] /= count);
    }
    let rest = plane.rest.map_or([0.0; W], |rest| *lanes(rest, from));
    (0..W).for_each(|k| target[k] = sum[k] + rest[k]);
}

#[inline(always)]
fn lanes<const W: usize>(slice: &[f64], at: usize) -> &[f64; W] {
    slice[at..at + W].try_into().expect("as many as asked for")
}
