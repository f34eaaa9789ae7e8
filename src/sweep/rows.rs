//! A rule compiled for a body: rows of a matrix, as runs and gathers.
//!
//! In the lattice's numbering every interior particle of a column finds its neighbours a fixed
//! number of places before and after itself, so a column needs one row of distances and no lists. The index
//! lists are compressed into such *runs* wherever they allow it; edges, holes and irregular bodies
//! keep theirs, as *gathers*. Coefficients of neighbours are kept by class, for all particles that share it. Both ways
//! sum in the neighbours' order and divide once, as [`Rule::target`](crate::flock::rules::Rule::target) does: the
//! bits are the same.
//!
//! The particles are parted into *bands* in their numbering, at least as long as a particle sees far. A
//! particle then sees nothing beyond the next band on either side, which is what lets a sweep take several
//! steps while a few bands are in the caches, and leave out those where nothing moves.

#[cfg(test)]
mod tests;

use std::ops::Range;

use super::caches::Caches;
use super::domain::Share;
use super::gathers::Gathers;
use super::kernel::{self, Component, MOST_KEPT, Tables};
use super::terms::Terms;
use crate::flock::law::{Flock, Weights};
use crate::flock::neighbourhood::Neighbours;
use crate::flock::real::Real;
use crate::flock::rules::{Mean, Rotation};
use crate::flock::vectors::Vectors;

/// Shorter runs are not worth the set-up of one.
const SHORTEST_RUN: usize = 8;

/// Fewest particles in a band of a small body, and of a large one: less is not worth looking after.
const SMALLEST_BAND: [usize; 2] = [1 << 10, 1 << 11];

/// Bands that a body has before they become larger.
const FEW_BANDS: usize = 1 << 7;

/// Bands that each rank has before they become larger, where a body is shared: below that they are as small as is allowed.
const FEW_BANDS_A_RANK: usize = 1 << 6;

/// Most distances and coefficients that are looked through for a row that is known already.
const MOST_LOOKED_THROUGH: usize = 4096;

/// Most particles in a band, and how far particles may see for bands to be made: beyond that they are of
/// this size and bound nothing.
const LARGEST_BAND: usize = 1 << 17;

/// Longest gap between two runs that is swept over rather than stopped at, and most particles in the gaps of
/// one run.
const GAPS: [usize; 2] = [6, MOST_KEPT];

/// Coefficients of neighbours, row after row.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Coefficients {
    /// All the same.
    #[default]
    Equal,
    /// Of each neighbour, then their sum.
    Scalar(Vec<f64>),
    /// Matrices of each neighbour by rows \[1\], then the compliance \[length / force\].
    Matrix(Vec<f64>),
}

impl Coefficients {
    pub(super) fn all(&self) -> &[f64] {
        match self {
            Coefficients::Equal => &[],
            Coefficients::Scalar(all) | Coefficients::Matrix(all) => all,
        }
    }
}

/// The particles that follow, as runs and gathers, band by band.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    bands: Vec<Band>,
    runs: Vec<Run>,
    gathers: Gathers,
    /// Index distances of all runs, one row after the other.
    distances: Vec<isize>,
    coefficients: Coefficients,
    /// Particles in gaps of runs that keep what stands there.
    kept: Vec<u32>,
    /// Whether no particle sees beyond the next band.
    is_local: bool,
    is_in_cache: bool,
    band_size: usize,
    followers: usize,
    /// How many times as far from the reference a mean takes a particle as any was that it sees, at most \[1\].
    gain: f64,
}

/// Where a band begins; it ends where the next one begins.
#[derive(Clone, Copy, Debug, Default)]
struct Band {
    particle: u32,
    run: u32,
    /// The first group of its lists.
    group: u32,
    followers: u32,
}

/// Consecutive particles that see the same, but for the place.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Run {
    pub start: u32,
    pub len: u32,
    /// Where the run's row begins in `distances`, and its size.
    pub distances: u32,
    pub neighbours: u32,
    /// Where what they count begins.
    pub coefficients: u32,
    /// Where the particles in its gaps begin in `kept`, and how many they are.
    pub kept: u32,
    pub gaps: u32,
    /// Whether any of it has a rest offset: where edges alone do, the others' zeros need not be read.
    pub rests: bool,
}

/// Coefficients of each particle's neighbours, before they are compiled.
#[derive(Clone, Copy)]
enum Source<'a> {
    Equal,
    Scalar(&'a [f64]),
    /// Class of each particle, and where its coefficients begin, by class.
    Classes(&'a [u32], &'a [u32]),
}

impl Rows {
    /// Compiles the rule for the particles that follow; `None` where its mean is not affine in the positions.
    pub fn compile(flock: &Flock, follows: &[bool], share: Share) -> Option<Self> {
        let neighbours = &flock.neighbours;
        let mut starts: Vec<u32> = Vec::new();
        let (source, coefficients, gain) = match (flock.rule.mean, &flock.weights) {
            (Mean::Barycentre, Weights::Equal) => (Source::Equal, Coefficients::Equal, 1.0),
            (Mean::Barycentre, Weights::Scalar(weights)) => {
                let gain = |j: usize| {
                    let own = &weights[neighbours.bonds(j)];
                    own.iter().map(|w| w.abs()).sum::<f64>() / own.iter().sum::<f64>().abs()
                };
                let finite = (0..neighbours.count()).map(gain).filter(|gain| gain.is_finite());
                (Source::Scalar(weights), Coefficients::Scalar(Vec::new()), finite.fold(1.0, f64::max))
            }
            (Mean::Material { rotation: Rotation::Small }, Weights::Matrix(weights)) => {
                let (mut all, mut gain) = (Vec::new(), 1.0f64);
                for (class, ends) in weights.starts.windows(2).enumerate() {
                    starts.push(all.len() as u32);
                    let blocks = &weights.blocks[ends[0] as usize..ends[1] as usize];
                    all.extend(blocks.iter().flatten().flatten());
                    all.extend(weights.compliance[class].iter().flatten());
                    let row = |k: usize| blocks.iter().map(|b| b[k][0].abs() + b[k][1].abs()).sum::<f64>();
                    gain = gain.max(row(0)).max(row(1));
                }
                (Source::Classes(&weights.class, &starts), Coefficients::Matrix(all), gain)
            }
            _ => return None,
        };
        let rows = Self { coefficients, gain, ..Self::default() };
        Some(rows.compiled(neighbours, follows, (source, flock.rest.as_ref()), share))
    }

    fn compiled(
        mut self,
        neighbours: &Neighbours,
        follows: &[bool],
        (source, rest): (Source<'_>, Option<&Vectors>),
        share: Share,
    ) -> Self {
        let reach = reach(neighbours, follows);
        self.is_local = reach <= LARGEST_BAND / 3;
        let total = share.part.map_or(follows.len(), |held| held.total);
        self.is_in_cache = follows.len() <= share.caches.whole_body;
        self.band_size = if self.is_local { usual_band(reach, total, share) } else { LARGEST_BAND };
        let size = self.band_size;
        let is_in_cache = self.is_in_cache;
        let is_alike = |j: usize, k: usize| {
            follows[k]
                && is_translate(neighbours, j, k)
                && match source {
                    Source::Equal => true,
                    Source::Scalar(weights) => {
                        let [of_j, of_k] = [j, k].map(|j| &weights[neighbours.bonds(j)]);
                        of_j.iter().zip(of_k).all(|(a, b)| a.to_bits() == b.to_bits())
                    }
                    Source::Classes(class, _) => class[j] == class[k],
                }
        };
        let mut j = 0;
        let mut listed = Vec::new();
        let mut cuts = share.cuts().into_iter().filter(|&cut| (1..follows.len()).contains(&cut)).peekable();
        self.open_band(0);
        while j < follows.len() {
            while cuts.next_if(|&cut| cut <= j).is_some() {}
            let cut = cuts.peek().copied();
            let end = (j + size).min(cut.unwrap_or(follows.len()));
            let same = |&k: &usize| !(follows[j] && is_alike(j, k));
            let len = (j + 1..end).find(same).unwrap_or(end) - j;
            let weighs = follows[j] && weighs(neighbours, j, source);
            if weighs && len >= SHORTEST_RUN {
                let rests = rest.is_some_and(|rest| (j..j + len).any(|j| rest.get(j) != [0.0; 2]));
                let coefficients = self.coefficients_of(neighbours, j, source);
                self.push_run(neighbours, (j, len, rests), coefficients, is_in_cache.then_some(&listed));
            } else if follows[j] {
                listed.extend(j as u32..(j + len) as u32);
            }
            j += len;
            let begin = self.bands.last().map_or(0, |band| band.particle as usize);
            // A band that ends before a cut leaves a whole one to it, or particles would see past what is left.
            let is_full = j - begin >= size && cut.is_none_or(|cut| cut >= j + size);
            if (is_full && j < follows.len()) || (Some(j) == cut && j > begin) {
                self.close_band(neighbours, &listed, source);
                listed.clear();
                self.open_band(j);
            }
        }
        self.close_band(neighbours, &listed, source);
        self.open_band(follows.len());
        for band in 0..self.band_count() {
            let count = self.particles(band..band + 1).filter(|&j| follows[j]).count();
            self.bands[band].followers = count as u32;
            self.followers += count;
        }
        // Those at the ends of what is here are seen from one side alone.
        let inner = 1..self.band_count().saturating_sub(1);
        self.is_local &= share.part.is_none()
            || inner.into_iter().all(|band| self.particles(band..band + 1).len() >= reach);
        self
    }

    fn close_band(&mut self, neighbours: &Neighbours, listed: &[u32], source: Source<'_>) {
        let starts: Vec<u32> = match source {
            Source::Equal => Vec::new(),
            _ => listed.iter().map(|&j| self.coefficients_of(neighbours, j as usize, source)).collect(),
        };
        let list = |j: u32| {
            // Without neighbours, or with weights that add up to nothing, a particle stays.
            if weighs(neighbours, j as usize, source) { neighbours.of(j as usize) } else { &[] }
        };
        self.gathers.push_band(listed, &starts, list);
    }

    /// Where what the neighbours of a particle count stands among the coefficients: found or added.
    fn coefficients_of(&mut self, neighbours: &Neighbours, j: usize, source: Source<'_>) -> u32 {
        match (source, &mut self.coefficients) {
            (Source::Classes(class, starts), _) => starts[class[j] as usize],
            (Source::Scalar(weights), Coefficients::Scalar(all)) => {
                let own = &weights[neighbours.bonds(j)];
                let total = own.iter().fold(0.0, |sum, weight| sum + weight);
                let row = || own.iter().copied().chain([total]).map(f64::to_bits);
                // A body has few different rows, or one for each particle: a few are looked through.
                let size = own.len() + 1;
                let looked = all.len().min(MOST_LOOKED_THROUGH);
                let known = (0..(looked + 1).saturating_sub(size))
                    .find(|&at| all[at..at + size].iter().map(|w| w.to_bits()).eq(row()));
                known.unwrap_or_else(|| {
                    all.extend(own.iter().copied().chain([total]));
                    all.len() - size
                }) as u32
            }
            _ => 0,
        }
    }

    fn open_band(&mut self, particle: usize) {
        let (run, group) = (self.runs.len() as u32, self.gathers.group_count() as u32);
        self.bands.push(Band { particle: particle as u32, run, group, followers: 0 });
    }

    /// Adds a run, or makes the band's last one longer if those `listed` in the band are given.
    fn push_run(
        &mut self,
        neighbours: &Neighbours,
        (j, len, rests): (usize, usize, bool),
        coefficients: u32,
        listed: Option<&Vec<u32>>,
    ) {
        let (distances, size) = self.distances_of(neighbours, j);
        let first_of_band = self.bands.last().map_or(0, |band| band.run as usize);
        let kept = self.kept.len();
        if let Some(listed) = listed.filter(|_| self.runs.len() > first_of_band) {
            let last = self.runs.last_mut().expect("the band has one");
            let gap = (last.start + last.len)..j as u32;
            // Followers in the gap that have lists are computed after the runs; the others must not change.
            let still = gap.clone().filter(|i| listed.binary_search(i).is_err());
            let same =
                (last.distances, last.neighbours, last.coefficients) == (distances, size, coefficients);
            let alike = same && gap.len() <= GAPS[0];
            if alike && last.gaps as usize + still.clone().count() <= GAPS[1] {
                self.kept.extend(still);
                last.gaps += (self.kept.len() - kept) as u32;
                last.len = (j + len) as u32 - last.start;
                last.rests |= rests;
                return;
            }
        }
        let (start, len, kept) = (j as u32, len as u32, kept as u32);
        self.runs.push(Run { start, len, distances, neighbours: size, coefficients, kept, gaps: 0, rests });
    }

    pub(crate) fn band_count(&self) -> usize {
        self.bands.len().saturating_sub(1)
    }

    /// Whether particles so many places apart are in one band or in bands beside each other, wherever they are.
    pub(crate) fn are_near(&self, apart: usize) -> bool {
        let inner = 1..self.band_count().saturating_sub(1);
        !self.is_local || inner.into_iter().all(|band| self.particles(band..band + 1).len() >= apart)
    }

    /// Whether no particle sees farther than into the bands beside its own.
    pub(crate) fn is_local(&self) -> bool {
        self.is_local
    }

    /// Whether the caches hold the whole body.
    pub(crate) fn is_in_cache(&self) -> bool {
        self.is_in_cache
    }

    /// Fewest particles in a band, but for the last.
    pub(crate) fn band_size(&self) -> usize {
        self.band_size
    }

    /// Whether the second cache holds the bands that take several steps together.
    pub(crate) fn front_stays(&self) -> bool {
        self.is_in_cache || Caches::here().band.is_some_and(|most| self.band_size <= most)
    }

    /// The particles of some bands.
    pub fn particles(&self, bands: Range<usize>) -> Range<usize> {
        self.bands[bands.start].particle as usize..self.bands[bands.end].particle as usize
    }

    /// How many particles of a band follow.
    pub fn followers(&self, band: usize) -> usize {
        self.bands[band].followers as usize
    }

    /// Share of the following particles that need no neighbour list.
    pub fn share_in_runs(&self) -> f64 {
        (self.followers - self.gathers.particles()) as f64 / self.followers.max(1) as f64
    }

    /// Whether both coordinates have to be swept together for these terms.
    pub fn couples<T: Real>(&self, terms: &Terms<'_, T>) -> bool {
        terms.couples_along().is_some() || matches!(self.coefficients, Coefficients::Matrix(_))
    }

    /// How many times as far from the reference a mean takes a particle as any was that it sees, at most \[1\].
    pub fn gain(&self) -> f64 {
        self.gain
    }

    /// Computes some coordinates of the targets of those in some bands, `tile` of a column at a time. One coordinate alone
    /// only where the rows do not [couple](Rows::couples) it with the other.
    pub fn sweep<T: Real, const P: usize>(
        &self,
        bands: Range<usize>,
        tile: usize,
        components: &mut [Component<'_, T>; P],
        terms: &Terms<'_, T>,
    ) {
        debug_assert!(P == 2 || !self.couples(terms));
        let runs = &self.runs[self.bands[bands.start].run as usize..self.bands[bands.end].run as usize];
        let Self { distances, coefficients, kept, .. } = self;
        let tables = Tables { distances, coefficients, kept };
        for alike in runs.chunk_by(|a, b| a.neighbours == b.neighbours) {
            kernel::sweep(alike, tables, tile, components, terms);
        }
        // After the runs, which write over those in their gaps.
        let groups = self.bands[bands.start].group as usize..self.bands[bands.end].group as usize;
        self.gathers.sweep(groups, coefficients, components, terms);
    }

    /// Finds or adds the index distances of particle `j`.
    fn distances_of(&mut self, neighbours: &Neighbours, j: usize) -> (u32, u32) {
        let list = neighbours.of(j);
        let distance = |&k: &u32| k as isize - j as isize;
        let size = list.len();
        let known = (0..=self.distances.len().saturating_sub(size))
            .find(|&at| self.distances[at..].iter().take(size).copied().eq(list.iter().map(distance)));
        // A body has few different stencils, so the scan is short; but never let it grow with the body.
        let at = known.filter(|_| self.distances.len() < MOST_LOOKED_THROUGH).unwrap_or_else(|| {
            self.distances.extend(list.iter().map(distance));
            self.distances.len() - size
        });
        (at as u32, size as u32)
    }
}

/// Particles of a band of a body whose particles see so far: three columns of a lattice, which are swept abreast, or
/// fewer if more do not stay in the second cache; cut where a run ends anyway.
fn band_size(reach: usize, caches: Caches) -> usize {
    let three = reach * 5 / 2;
    match caches.band {
        Some(most) if reach <= most => three.min((most * 2 / 3 / reach.max(1)).max(1) * reach),
        // In a front that no cache holds, columns abreast serve each other.
        _ => three,
    }
}

/// Fewest particles in a band, but for the last, of a body of so many whose particles see so far.
pub fn usual_band(reach: usize, total: usize, share: Share) -> usize {
    band_size(reach, share.caches).max(smallest_band(total, share.ranks))
}

/// Fewest particles in a band of a body of so many, shared by so many ranks.
fn smallest_band(particles: usize, ranks: usize) -> usize {
    let alone = (particles / FEW_BANDS).clamp(SMALLEST_BAND[0], SMALLEST_BAND[1]);
    if ranks == 1 { alone } else { alone.min(particles / (ranks * FEW_BANDS_A_RANK)).max(1) }
}

/// Index distance to the farthest neighbour of any follower.
fn reach(neighbours: &Neighbours, follows: &[bool]) -> usize {
    let farthest = |j: usize| neighbours.of(j).iter().map(|&k| j.abs_diff(k as usize)).max().unwrap_or(0);
    (0..follows.len()).filter(|&j| follows[j]).map(farthest).max().unwrap_or(0)
}

/// Whether the neighbours of a particle count anything.
fn weighs(neighbours: &Neighbours, j: usize, source: Source<'_>) -> bool {
    match source {
        Source::Scalar(weights) => weights[neighbours.bonds(j)].iter().fold(0.0, |sum, w| sum + w) != 0.0,
        _ => !neighbours.of(j).is_empty(),
    }
}

/// Whether the neighbours of `k` are those of `j` moved by `k - j` places.
fn is_translate(neighbours: &Neighbours, j: usize, k: usize) -> bool {
    let (a, b) = (neighbours.of(j), neighbours.of(k));
    let shift = (k - j) as u32;
    !a.is_empty() && a.len() == b.len() && a.iter().zip(b).all(|(&a, &b)| a + shift == b)
}
