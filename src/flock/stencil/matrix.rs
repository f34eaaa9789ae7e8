//! The rule of a material over runs of particles that have the same matrices at the same index distances.
//!
//! What [`Rule::target_of_material`](crate::flock::rules::Rule::target_of_material) does, many particles at a time and
//! in the same order: sum, rest offset, push of the load, damping. The bits are the same.

use super::{SHORTEST_RUN, is_translate};
use crate::flock::block::Block;
use crate::flock::interaction::MatrixWeights;
use crate::flock::neighbourhood::Neighbours;
use crate::flock::points::Points;

/// The particles that follow, as runs and lists, chunk by chunk.
#[derive(Clone, Debug, Default)]
pub struct MatrixStencil {
    /// By chunk: runs, and particles that are in none.
    chunks: Vec<(Vec<Run>, Vec<u32>)>,
    chunk_size: usize,
}

#[derive(Clone, Copy, Debug)]
struct Run {
    start: u32,
    len: u32,
}

/// What the matrices are applied to.
#[derive(Clone, Copy, Debug)]
pub struct Body<'a> {
    pub neighbours: &'a Neighbours,
    pub weights: &'a MatrixWeights,
    /// Loads \[force\].
    pub forces: Option<&'a Points>,
    /// Rest offsets \[length\].
    pub rest: Option<&'a Points>,
    /// Positions before the step \[length\].
    pub present: &'a Points,
    pub damping: f64,
}

impl MatrixStencil {
    /// Finds the runs; none goes on beyond a multiple of `chunk_size`.
    pub fn compile(
        neighbours: &Neighbours,
        weights: &MatrixWeights,
        follows: &[bool],
        chunk_size: usize,
    ) -> Self {
        let mut stencil = Self { chunks: Vec::new(), chunk_size };
        let class = &weights.class;
        for begin in (0..follows.len()).step_by(chunk_size) {
            let end = (begin + chunk_size).min(follows.len());
            let (mut runs, mut listed) = (Vec::new(), Vec::new());
            let mut j = begin;
            while j < end {
                let alike = |&k: &usize| follows[k] && class[k] == class[j] && is_translate(neighbours, j, k);
                let len = (j + 1..end).find(|k| !(follows[j] && alike(k))).unwrap_or(end) - j;
                if follows[j] && len >= SHORTEST_RUN {
                    runs.push(Run { start: j as u32, len: len as u32 });
                } else if follows[j] {
                    listed.extend(j as u32..(j + len) as u32);
                }
                j += len;
            }
            stencil.chunks.push((runs, listed));
        }
        stencil
    }

    /// Computes the next positions of those of chunk number `index` that are in runs into `x` and `y`, the chunk's part
    /// of the next positions, and names the others.
    pub fn sweep_chunk(&self, index: usize, body: &Body<'_>, (x, y): (&mut [f64], &mut [f64])) -> &[u32] {
        let (runs, listed) = &self.chunks[index];
        let begin = index * self.chunk_size;
        for run in runs {
            let (from, to) = (run.start as usize - begin, (run.start + run.len) as usize - begin);
            sweep_run(run.start as usize, body, &mut x[from..to], &mut y[from..to]);
        }
        listed
    }
}

fn sweep_run(start: usize, body: &Body<'_>, x: &mut [f64], y: &mut [f64]) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx512f") {
        // SAFETY: the processor has AVX-512, which is all that the callee asks for. Measured, see AVX2.
        return unsafe { sweep_avx512(start, body, x, y) };
    } else if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2, which is all that the callee asks for. Measured: wider vectors sweep
        // a body within the caches up to twice as fast.
        return unsafe { sweep_avx2(start, body, x, y) };
    }
    sweep_in_lanes::<4>(start, body, x, y);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn sweep_avx512(start: usize, body: &Body<'_>, x: &mut [f64], y: &mut [f64]) {
    sweep_in_lanes::<16>(start, body, x, y);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn sweep_avx2(start: usize, body: &Body<'_>, x: &mut [f64], y: &mut [f64]) {
    sweep_in_lanes::<8>(start, body, x, y);
}

/// Blocks of a run's particles: two pieces of vectors of both coordinates stay in the registers.
#[inline(always)]
fn sweep_in_lanes<const W: usize>(start: usize, body: &Body<'_>, x: &mut [f64], y: &mut [f64]) {
    let len = x.len();
    let mut at = 0;
    while at + W <= len {
        sweep_lanes::<W>(start + at, start, body, &mut x[at..at + W], &mut y[at..at + W]);
        at += W;
    }
    if at < len && len >= W {
        // The last ones overlap those before them, which come out the same again.
        sweep_lanes::<W>(start + len - W, start, body, &mut x[len - W..], &mut y[len - W..]);
    } else {
        for at in at..len {
            sweep_lanes::<1>(start + at, start, body, &mut x[at..=at], &mut y[at..=at]);
        }
    }
}

/// `W` particles from number `j` on of the run that begins with number `first`.
#[inline(always)]
fn sweep_lanes<const W: usize>(j: usize, first: usize, body: &Body<'_>, x: &mut [f64], y: &mut [f64]) {
    let (list, blocks) = (body.neighbours.of(first), body.weights.of(first));
    // Negative zero is what adding the first neighbour to changes no bit.
    let mut sum = [[-0.0; W]; 2];
    for (&k, block) in list.iter().zip(blocks) {
        add(block, body.present, k as usize + (j - first), &mut sum);
    }
    // Zero is added as well: the rule does, and it makes 0.0 of -0.0.
    let rest: [[f64; W]; 2] = body.rest.map_or([[0.0; W]; 2], |rest| [lanes(&rest.x, j), lanes(&rest.y, j)]);
    for k in 0..W {
        sum[0][k] += rest[0][k];
        sum[1][k] += rest[1][k];
    }
    if let Some(forces) = body.forces {
        add(&body.weights.compliance(first), forces, j, &mut sum);
    }
    if body.damping != 1.0 {
        let here: [[f64; W]; 2] = [lanes(&body.present.x, j), lanes(&body.present.y, j)];
        for axis in 0..2 {
            for k in 0..W {
                sum[axis][k] = here[axis][k] + body.damping * (sum[axis][k] - here[axis][k]);
            }
        }
    }
    x.copy_from_slice(&sum[0]);
    y.copy_from_slice(&sum[1]);
}

/// Adds `block * vector` of the vectors from number `from` on.
#[inline(always)]
fn add<const W: usize>(block: &Block, vectors: &Points, from: usize, sum: &mut [[f64; W]; 2]) {
    let x: [f64; W] = lanes(&vectors.x, from);
    let y: [f64; W] = lanes(&vectors.y, from);
    let [[xx, xy], [yx, yy]] = *block;
    for k in 0..W {
        sum[0][k] += xx * x[k] + xy * y[k];
    }
    for k in 0..W {
        sum[1][k] += yx * x[k] + yy * y[k];
    }
}

#[inline(always)]
fn lanes<const W: usize>(slice: &[f64], at: usize) -> [f64; W] {
    slice[at..at + W].try_into().expect("as many as asked for")
}
