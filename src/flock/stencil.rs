//! The plain barycentre over runs of particles whose neighbours lie at the same index distances.
//!
//! In the lattice's numbering every interior particle of a column finds its neighbours a fixed
//! number of places before and after itself, so a column needs one stencil and no lists. The index
//! lists are compressed into such runs wherever they allow it; edges, holes and irregular bodies
//! keep their lists. Both ways sum in the neighbours' order and divide once, which is what
//! [`Rule::target`](super::rules::Rule::target) does: the bits are the same.
//!
//! The particles are parted into *bands* in their numbering, at least as long as a particle sees far. A
//! particle then sees nobody beyond the next band on either side, which is what lets a sweep take several
//! steps while a few bands are in the caches, and leave out those where nothing moves.

mod kernel;
mod lists;
pub mod matrix;
#[cfg(test)]
mod tests;

use std::ops::Range;

pub use kernel::Plane;
use lists::Lists;

use super::neighbourhood::Neighbours;
use super::points::Points;
use super::real::Real;

/// Shorter runs are not worth the set-up of one.
const SHORTEST_RUN: usize = 8;

/// Fewest particles in a band of a small body, and of a large one: less is not worth looking after.
const SMALLEST_BAND: [usize; 2] = [1 << 10, 1 << 11];

/// Bands that a body has before they become larger.
const FEW_BANDS: usize = 1 << 7;

/// Most particles in a band, and how far particles may see for bands to be made: beyond that they are of
/// this size and bound nothing.
const LARGEST_BAND: usize = 1 << 17;

/// Most particles of a body that counts as within the caches: 8 MiB in four arrays. Its columns are swept one
/// after the other, and gaps between them swept over; and it is swept step by step, which streams best.
const IN_CACHE: usize = 1 << 18;

/// Longest gap between two runs that is swept over rather than stopped at, and most particles in the gaps of
/// one run.
const GAPS: [usize; 2] = [6, kernel::MOST_KEPT];

/// The particles that follow, as runs and lists, band by band.
#[derive(Clone, Debug, Default)]
pub struct Stencil {
    bands: Vec<Band>,
    runs: Vec<Run>,
    lists: Lists,
    /// Index distances of all runs, one stencil after the other.
    distances: Vec<isize>,
    /// Particles in gaps of runs that keep what stands there.
    kept: Vec<u32>,
    /// Whether nobody sees beyond the next band.
    is_local: bool,
    followers: usize,
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

#[derive(Clone, Copy, Debug)]
struct Run {
    start: u32,
    len: u32,
    /// Where the run's stencil begins in `distances`, and its size.
    stencil: u32,
    neighbours: u32,
    /// Where the particles in its gaps begin in `kept`, and how many they are.
    kept: u32,
    gaps: u32,
    /// Whether anyone in it has a rest offset: where edges alone do, the others' zeros need not be read.
    rests: bool,
}

impl Stencil {
    /// Compresses the lists of the particles that follow; `rest` are their rest offsets, if they have any.
    pub fn compile(neighbours: &Neighbours, follows: &[bool], rest: Option<&Points>) -> Self {
        let reach = reach(neighbours, follows);
        let is_local = reach <= LARGEST_BAND / 3;
        let smallest = (follows.len() / FEW_BANDS).clamp(SMALLEST_BAND[0], SMALLEST_BAND[1]);
        // Three columns of a lattice, which are swept abreast; cut where a run ends anyway.
        let size = if is_local { (reach * 5 / 2).max(smallest) } else { LARGEST_BAND };
        let mut stencil = Self { is_local, ..Self::default() };
        let mut j = 0;
        let mut listed = Vec::new();
        stencil.open_band(0);
        while j < follows.len() {
            let len = run_length(neighbours, follows, j, size);
            if follows[j] && len >= SHORTEST_RUN {
                let rests = rest.is_some_and(|rest| (j..j + len).any(|j| rest.get(j) != [0.0; 2]));
                let bridge = follows.len() <= IN_CACHE;
                stencil.push_run(neighbours, (j, len, rests), bridge.then_some(&listed));
            } else if follows[j] {
                listed.extend(j as u32..(j + len) as u32);
            }
            j += len;
            let begin = stencil.bands.last().map_or(0, |band| band.particle as usize);
            if j - begin >= size && j < follows.len() {
                stencil.lists.push_band(neighbours, &listed);
                listed.clear();
                stencil.open_band(j);
            }
        }
        stencil.lists.push_band(neighbours, &listed);
        stencil.open_band(follows.len());
        for band in 0..stencil.band_count() {
            let count = stencil.particles(band..band + 1).filter(|&j| follows[j]).count();
            stencil.bands[band].followers = count as u32;
            stencil.followers += count;
        }
        stencil
    }

    fn open_band(&mut self, particle: usize) {
        let (run, group) = (self.runs.len() as u32, self.lists.group_count() as u32);
        self.bands.push(Band { particle: particle as u32, run, group, followers: 0 });
    }

    /// Adds a run, or makes the band's last one longer if those `listed` in the band are given.
    fn push_run(
        &mut self,
        neighbours: &Neighbours,
        (j, len, rests): (usize, usize, bool),
        listed: Option<&Vec<u32>>,
    ) {
        let (stencil, size) = self.distances_of(neighbours, j);
        let first_of_band = self.bands.last().map_or(0, |band| band.run as usize);
        let kept = self.kept.len();
        if let Some(listed) = listed.filter(|_| self.runs.len() > first_of_band) {
            let last = self.runs.last_mut().expect("the band has one");
            let gap = (last.start + last.len)..j as u32;
            // Those in the gap who follow by lists are computed after the runs; the others must not change.
            let still = gap.clone().filter(|i| listed.binary_search(i).is_err());
            let alike = (last.stencil, last.neighbours) == (stencil, size) && gap.len() <= GAPS[0];
            if alike && last.gaps as usize + still.clone().count() <= GAPS[1] {
                self.kept.extend(still);
                last.gaps += (self.kept.len() - kept) as u32;
                last.len = (j + len) as u32 - last.start;
                last.rests |= rests;
                return;
            }
        }
        let (start, len, kept) = (j as u32, len as u32, kept as u32);
        self.runs.push(Run { start, len, stencil, neighbours: size, kept, gaps: 0, rests });
    }

    pub fn band_count(&self) -> usize {
        self.bands.len().saturating_sub(1)
    }

    /// Whether particles so many places apart are in one band or in bands beside each other, wherever they are.
    pub fn are_near(&self, apart: usize) -> bool {
        let inner = 1..self.band_count().saturating_sub(1);
        !self.is_local || inner.into_iter().all(|band| self.particles(band..band + 1).len() >= apart)
    }

    /// Whether no particle sees farther than into the bands beside its own.
    pub fn is_local(&self) -> bool {
        self.is_local
    }

    /// Whether the caches hold the whole body.
    pub fn is_in_cache(&self) -> bool {
        self.bands.last().is_none_or(|end| end.particle as usize <= IN_CACHE)
    }

    /// The particles of some bands.
    pub fn particles(&self, bands: Range<usize>) -> Range<usize> {
        self.bands[bands.start].particle as usize..self.bands[bands.end].particle as usize
    }

    /// How many particles of a band follow.
    pub fn followers(&self, band: usize) -> usize {
        self.bands[band].followers as usize
    }

    /// How many particles follow in all.
    pub fn all_followers(&self) -> usize {
        self.followers
    }

    /// Share of the following particles that need no neighbour list.
    pub fn share_in_runs(&self) -> f64 {
        (self.followers - self.lists.particles()) as f64 / self.followers.max(1) as f64
    }

    /// Computes one coordinate of the targets of those in some bands that follow without lists, `tile` of a
    /// column at a time. Call it before [`Stencil::sweep_listed`]: it writes over the listed ones in its gaps.
    pub fn sweep_runs<T: Real>(&self, bands: Range<usize>, tile: usize, plane: &mut Plane<'_, T>) {
        let runs = &self.runs[self.bands[bands.start].run as usize..self.bands[bands.end].run as usize];
        for alike in runs.chunk_by(|a, b| a.neighbours == b.neighbours) {
            kernel::sweep(alike, (&self.distances, &self.kept), tile, plane);
        }
    }

    /// Computes some coordinates of the targets of those in some bands that follow by lists.
    pub fn sweep_listed<T: Real, const P: usize>(&self, bands: Range<usize>, planes: &mut [Plane<'_, T>; P]) {
        let groups = self.bands[bands.start].group as usize..self.bands[bands.end].group as usize;
        self.lists.sweep(groups, planes);
    }

    /// Finds or adds the index distances of particle `j`.
    fn distances_of(&mut self, neighbours: &Neighbours, j: usize) -> (u32, u32) {
        let list = neighbours.of(j);
        let distance = |&k: &u32| k as isize - j as isize;
        let size = list.len();
        let known = (0..=self.distances.len().saturating_sub(size))
            .find(|&at| self.distances[at..].iter().take(size).copied().eq(list.iter().map(distance)));
        // A body has few different stencils, so the scan is short; but never let it grow with the body.
        let at = known.filter(|_| self.distances.len() < 4096).unwrap_or_else(|| {
            self.distances.extend(list.iter().map(distance));
            self.distances.len() - size
        });
        (at as u32, size as u32)
    }
}

/// How many places away the farthest neighbour of anybody who follows is.
fn reach(neighbours: &Neighbours, follows: &[bool]) -> usize {
    let farthest = |j: usize| neighbours.of(j).iter().map(|&k| j.abs_diff(k as usize)).max().unwrap_or(0);
    (0..follows.len()).filter(|&j| follows[j]).map(farthest).max().unwrap_or(0)
}

/// How many particles from `j` on have the same neighbours but for the place, at most `most`.
fn run_length(neighbours: &Neighbours, follows: &[bool], j: usize, most: usize) -> usize {
    if !follows[j] {
        return 1;
    }
    let end = (j + most).min(follows.len());
    let other = (j + 1..end).find(|&k| !(follows[k] && is_translate(neighbours, j, k)));
    other.unwrap_or(end) - j
}

/// Whether the neighbours of `k` are those of `j` moved by `k - j` places.
fn is_translate(neighbours: &Neighbours, j: usize, k: usize) -> bool {
    let (a, b) = (neighbours.of(j), neighbours.of(k));
    let shift = (k - j) as u32;
    !a.is_empty() && a.len() == b.len() && a.iter().zip(b).all(|(&a, &b)| a + shift == b)
}
