//! The plain barycentre over runs of particles whose neighbours lie at the same index distances.
//!
//! In the lattice's numbering every interior particle of a column finds its neighbours a fixed
//! number of places before and after itself, so a column needs one stencil and no lists. The index
//! lists are compressed into such runs wherever they allow it; edges, holes and irregular bodies
//! keep their lists. Both ways sum in the neighbours' order and divide once, which is what
//! [`Rule::target`](super::rules::Rule::target) does: the bits are the same.

mod kernel;
#[cfg(test)]
mod tests;

use super::neighbourhood::Neighbours;
use super::points::Points;

/// Fewest and most particles in a chunk.
const CHUNKS: [usize; 2] = [1 << 14, 1 << 17];

/// Shorter runs are not worth the set-up of one.
const SHORTEST_RUN: usize = 8;

/// Particles per chunk, the unit of work for one thread, in a body of so many: large enough to hold
/// many columns, small enough that every thread gets several.
pub fn chunk_size(particles: usize) -> usize {
    (particles / 64).clamp(CHUNKS[0], CHUNKS[1])
}

/// The particles that follow, as runs and lists, chunk by chunk.
#[derive(Clone, Debug, Default)]
pub struct Stencil {
    chunks: Vec<Chunk>,
    chunk_size: usize,
    /// Index distances of all runs, one stencil after the other.
    distances: Vec<isize>,
}

#[derive(Clone, Debug, Default)]
struct Chunk {
    runs: Vec<Run>,
    listed: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Run {
    start: u32,
    len: u32,
    /// Where the run's stencil begins in `distances`, and its size.
    stencil: u32,
    neighbours: u32,
}

impl Stencil {
    /// Compresses the lists of the particles that follow.
    pub fn compile(neighbours: &Neighbours, follows: &[bool]) -> Self {
        let chunk_size = chunk_size(follows.len());
        let mut stencil = Self { chunks: Vec::new(), chunk_size, distances: Vec::new() };
        for begin in (0..follows.len()).step_by(chunk_size) {
            let end = (begin + chunk_size).min(follows.len());
            let mut chunk = Chunk::default();
            let mut j = begin;
            while j < end {
                if !follows[j] {
                    j += 1;
                    continue;
                }
                let same = (j + 1..end).find(|&k| !(follows[k] && is_translate(neighbours, j, k)));
                let len = same.unwrap_or(end) - j;
                if len >= SHORTEST_RUN {
                    let (at, size) = stencil.distances_of(neighbours, j);
                    chunk.runs.push(Run { start: j as u32, len: len as u32, stencil: at, neighbours: size });
                } else {
                    chunk.listed.extend(j as u32..(j + len) as u32);
                }
                j += len;
            }
            stencil.chunks.push(chunk);
        }
        stencil
    }

    /// Share of the following particles that need no neighbour list.
    pub fn share_in_runs(&self) -> f64 {
        let in_runs: u64 = self.chunks.iter().flat_map(|c| &c.runs).map(|run| u64::from(run.len)).sum();
        let listed: u64 = self.chunks.iter().map(|c| c.listed.len() as u64).sum();
        in_runs as f64 / (in_runs + listed).max(1) as f64
    }

    /// Computes the targets of chunk number `index` into `x` and `y`, the chunk's part of the next
    /// positions.
    pub fn sweep_chunk(
        &self,
        index: usize,
        neighbours: &Neighbours,
        (present, rest): (&Points, Option<&Points>),
        (x, y): (&mut [f64], &mut [f64]),
    ) {
        let (begin, chunk) = (index * self.chunk_size, &self.chunks[index]);
        for alike in chunk.runs.chunk_by(|a, b| a.neighbours == b.neighbours) {
            let rest_x = rest.map(|rest| &rest.x[..]);
            let rest_y = rest.map(|rest| &rest.y[..]);
            kernel::sweep(alike, &self.distances, (&present.x, rest_x), begin, x);
            kernel::sweep(alike, &self.distances, (&present.y, rest_y), begin, y);
        }
        for &j in &chunk.listed {
            let j = j as usize;
            [x[j - begin], y[j - begin]] = listed_target(neighbours.of(j), present, rest, j);
        }
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

/// Whether the neighbours of `k` are those of `j` moved by `k - j` places.
fn is_translate(neighbours: &Neighbours, j: usize, k: usize) -> bool {
    let (a, b) = (neighbours.of(j), neighbours.of(k));
    let shift = (k - j) as u32;
    !a.is_empty() && a.len() == b.len() && a.iter().zip(b).all(|(&a, &b)| a + shift == b)
}

/// What [`Rule::target`](super::rules::Rule::target) computes: the rest offset is added to the mean,
/// also where it is zero, which makes 0.0 of -0.0.
fn listed_target(list: &[u32], present: &Points, rest: Option<&Points>, j: usize) -> [f64; 2] {
    if list.is_empty() {
        return present.get(j);
    }
    let (mut x, mut y) = (-0.0, -0.0);
    for &k in list {
        x += present.x[k as usize];
        y += present.y[k as usize];
    }
    let count = list.len() as f64;
    let [rx, ry] = rest.map_or([0.0; 2], |rest| rest.get(j));
    [x / count + rx, y / count + ry]
}
