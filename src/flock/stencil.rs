//! The plain barycentre over runs of particles whose neighbours lie at the same index distances.
//!
//! In the lattice's numbering every interior particle of a column finds its neighbours a fixed
//! number of places before and after itself, so a column needs one stencil and no lists. The index
//! lists are compressed into such runs wherever they allow it; edges, holes and irregular bodies
//! keep their lists. Both ways sum in the neighbours' order and divide once, which is what
//! [`Rule::target`](super::rules::Rule::target) does: the bits are the same.

use super::neighbourhood::Neighbours;
use super::points::Points;

/// Particles per chunk: the unit of work for one thread.
pub const CHUNK: usize = 1 << 14;

/// Shorter runs are not worth the set-up of one.
const SHORTEST_RUN: usize = 8;

/// The particles that follow, as runs and lists, chunk by chunk.
#[derive(Clone, Debug, Default)]
pub struct Stencil {
    chunks: Vec<Chunk>,
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
        let mut stencil = Self { chunks: Vec::new(), distances: Vec::new() };
        for begin in (0..follows.len()).step_by(CHUNK) {
            let end = (begin + CHUNK).min(follows.len());
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
        let (begin, chunk) = (index * CHUNK, &self.chunks[index]);
        for run in &chunk.runs {
            let distances = &self.distances[run.stencil as usize..(run.stencil + run.neighbours) as usize];
            let (start, len) = (run.start as usize, run.len as usize);
            let place = start - begin..start - begin + len;
            sum_run(&present.x, distances, start, &mut x[place.clone()]);
            sum_run(&present.y, distances, start, &mut y[place.clone()]);
            if let Some(rest) = rest {
                add(&rest.x[start..start + len], &mut x[place.clone()]);
                add(&rest.y[start..start + len], &mut y[place]);
            }
        }
        for &j in &chunk.listed {
            let j = j as usize;
            let [tx, ty] = listed_mean(neighbours.of(j), present, j);
            let [rx, ry] = rest.map_or([0.0; 2], |rest| rest.get(j));
            x[j - begin] = tx + rx;
            y[j - begin] = ty + ry;
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

fn listed_mean(list: &[u32], present: &Points, j: usize) -> [f64; 2] {
    let (mut x, mut y) = (-0.0, -0.0);
    for &k in list {
        x += present.x[k as usize];
        y += present.y[k as usize];
    }
    let count = list.len() as f64;
    if list.is_empty() { present.get(j) } else { [x / count, y / count] }
}

fn sum_run(source: &[f64], distances: &[isize], start: usize, target: &mut [f64]) {
    match distances.len() {
        2 => sum_of::<2>(source, distances, start, target),
        3 => sum_of::<3>(source, distances, start, target),
        4 => sum_of::<4>(source, distances, start, target),
        5 => sum_of::<5>(source, distances, start, target),
        6 => sum_of::<6>(source, distances, start, target),
        8 => sum_of::<8>(source, distances, start, target),
        12 => sum_of::<12>(source, distances, start, target),
        18 => sum_of::<18>(source, distances, start, target),
        24 => sum_of::<24>(source, distances, start, target),
        count => {
            let shifted = |k: usize| &source[start.wrapping_add_signed(distances[k])..][..target.len()];
            let first: Vec<&[f64]> = (0..count).map(shifted).collect();
            for (i, target) in target.iter_mut().enumerate() {
                *target = first.iter().fold(-0.0, |sum, slice| sum + slice[i]) / count as f64;
            }
        }
    }
}

/// `N` known when compiled: the loop over the run vectorises and the sum unrolls.
fn sum_of<const N: usize>(source: &[f64], distances: &[isize], start: usize, target: &mut [f64]) {
    let len = target.len();
    let shifted: [&[f64]; N] =
        std::array::from_fn(|k| &source[start.wrapping_add_signed(distances[k])..][..len]);
    for i in 0..len {
        let mut sum = shifted[0][i];
        for slice in &shifted[1..] {
            sum += slice[i];
        }
        target[i] = sum / N as f64;
    }
}

fn add(rest: &[f64], target: &mut [f64]) {
    for (target, rest) in target.iter_mut().zip(rest) {
        *target += rest;
    }
}
