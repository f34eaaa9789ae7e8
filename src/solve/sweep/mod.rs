//! One step of the body: every follower takes its target.
//!
//! The synchronous sweep (the paper's) reads the positions before the step and writes the next ones;
//! it runs in parallel above a size where that pays, and each particle's target depends on the old
//! positions alone, so the bits are the same for any number of threads. The sequential sweep moves
//! the particles one after the other in their numbering, each seeing the new places of those before
//! it (Gauss-Seidel).

mod several;
#[cfg(test)]
mod tests;

use std::ops::Range;

use rayon::prelude::*;

pub use several::{Activity, Following, Led, MOST_STEPS, Steps};

use crate::flock::fracture::torn::Torn;
use crate::flock::frame::Frame;
use crate::flock::interaction::{Interaction, Weights};
use crate::flock::points::Points;
use crate::flock::role::Role;
use crate::flock::rules::Rule;
use crate::flock::stencil::matrix::{self, MatrixStencil};
use crate::flock::stencil::{Plane, Stencil};

/// Who sees whose new position within one step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Everybody sees the old positions (the paper).
    Synchronous,
    /// Each sees the new positions of the particles numbered before it.
    Sequential,
}

/// How targets become positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Update {
    pub order: Order,
    /// `x <- x + damping (target - x)` \[1\]; 1 takes the target itself.
    pub damping: f64,
}

impl Default for Update {
    fn default() -> Self {
        Self { order: Order::Synchronous, damping: 1.0 }
    }
}

/// Bodies below this many particles are swept by one thread: handing out work costs more.
const PARALLEL_FROM: usize = 1 << 16;

/// From so many particles on that are swept one by one, threads share them.
const ASIDE_IN_PARALLEL: usize = 1 << 11;

/// Particles of a column that are swept before it is the next one's turn.
const TILE: usize = 64;

/// The followers of a body, made ready to be swept.
#[derive(Clone, Debug)]
pub struct Sweep {
    update: Update,
    follows: Vec<bool>,
    followers: usize,
    /// Present where the rule is the plain barycentre.
    stencil: Option<Stencil>,
    /// Present where the rule is a material and nothing else.
    matrices: Option<MatrixStencil>,
    /// Followers with a broken bond, whom the stencil does not fit.
    torn: Torn,
    /// The same where no stencil is: whom the matrices do not fit, ascending.
    aside: Vec<u32>,
}

impl Sweep {
    /// Compile anew whenever roles or neighbours change; whoever loses a bond is [set aside](Sweep::set_aside).
    pub fn compile(update: Update, interaction: &Interaction, roles: &[Role]) -> Self {
        let follows = followers(roles);
        let Interaction { rule, neighbours, weights, .. } = interaction;
        let plain = rule.is_plain_barycentre() && matches!(weights, Weights::Equal);
        let stencil = (plain && update == Update::default())
            .then(|| Stencil::compile(neighbours, &follows, interaction.rest.as_ref()));
        let matrices = match weights {
            Weights::Matrix(weights) if *rule == Rule::MATERIAL && update.order == Order::Synchronous => {
                let chunk = chunk_size(follows.len());
                Some(MatrixStencil::compile(neighbours, weights, &follows, chunk))
            }
            _ => None,
        };
        let bands = stencil.iter().flat_map(|s| (0..s.band_count()).map(|band| s.particles(band..band + 1)));
        let (torn, aside) = (Torn::new(bands), Vec::new());
        let mut sweep = Self { update, followers: count(&follows), follows, stencil, matrices, torn, aside };
        if let Some(bonds) = interaction.bonds.as_ref().filter(|bonds| bonds.any_broken()) {
            let is_torn = |&j: &usize| bonds.is_torn(j, neighbours);
            sweep.set_aside((0..neighbours.count()).filter(is_torn), interaction);
        }
        sweep
    }

    /// Sweeps these by themselves from now on: they have lost a bond.
    pub fn set_aside(&mut self, particles: impl IntoIterator<Item = usize>, interaction: &Interaction) {
        let follows = &self.follows;
        if let (Some(_), Some(bonds)) = (&self.stencil, &interaction.bonds) {
            self.torn.renew(particles, follows, (bonds, &interaction.neighbours, &interaction.reference));
            return;
        }
        self.aside.extend(particles.into_iter().filter(|&j| follows[j]).map(|j| j as u32));
        self.aside.sort_unstable();
        self.aside.dedup();
    }

    /// For neighbours that change at every step: nothing is compiled from them.
    pub fn uncompiled(update: Update, roles: &[Role]) -> Self {
        let follows = followers(roles);
        let (stencil, matrices, torn, aside) = (None, None, Torn::default(), Vec::new());
        Self { update, followers: count(&follows), follows, stencil, matrices, torn, aside }
    }

    /// Share of the followers swept without neighbour lists.
    pub fn share_in_runs(&self) -> f64 {
        self.stencil.as_ref().map_or(0.0, Stencil::share_in_runs)
    }

    /// Writes the followers' next positions, then the frame's. Leaders must stand in `next` already;
    /// whoever neither follows nor is frame keeps what stands there. The sequential sweep starts from
    /// what `next` holds, so it must hold the present positions.
    pub fn step(
        &self,
        interaction: &Interaction,
        frame: Option<&Frame>,
        present: &Points,
        next: &mut Points,
    ) {
        if let Some(stencil) = &self.stencil {
            sweep_whole(stencil, &self.torn, interaction, present, next);
        } else if let Some(matrices) = &self.matrices {
            let Weights::Matrix(weights) = &interaction.weights else {
                unreachable!("compiled from matrices")
            };
            let Interaction { neighbours, forces, rest, .. } = interaction;
            let (forces, rest, damping) = (forces.as_ref(), rest.as_ref(), self.update.damping);
            let body = matrix::Body { neighbours, weights, forces, rest, present, damping };
            for_chunks(next, |chunk, x, y| {
                let begin = chunk * chunk_size(present.len());
                for &j in matrices.sweep_chunk(chunk, &body, (&mut *x, &mut *y)) {
                    let i = j as usize - begin;
                    [x[i], y[i]] = self.moved(j as usize, interaction, present);
                }
            });
            self.step_aside(interaction, present, next);
        } else if self.update.order == Order::Synchronous {
            for_chunks(next, |chunk, x, y| {
                let begin = chunk * chunk_size(present.len());
                for i in (0..x.len()).filter(|i| self.follows[begin + i]) {
                    [x[i], y[i]] = self.moved(begin + i, interaction, present);
                }
            });
        } else {
            for j in (0..self.follows.len()).filter(|&j| self.follows[j]) {
                next.set(j, self.moved(j, interaction, next));
            }
        }
        if let Some(frame) = frame {
            frame.follow(&interaction.reference, present, next);
        }
    }

    /// Those whom no matrices fit; what these left in their places is written over.
    fn step_aside(&self, interaction: &Interaction, present: &Points, next: &mut Points) {
        let moved = |&j: &u32| (j, self.moved(j as usize, interaction, present));
        if self.aside.len() >= ASIDE_IN_PARALLEL && rayon::current_num_threads() > 1 {
            let moved: Vec<(u32, [f64; 2])> = self.aside.par_iter().map(moved).collect();
            moved.into_iter().for_each(|(j, place)| next.set(j as usize, place));
        } else {
            self.aside.iter().map(moved).for_each(|(j, place)| next.set(j as usize, place));
        }
    }

    /// Takes up to [`MOST_STEPS`] steps at once, by a sweep that [`Sweep::takes_several`]; the bits are those of single steps. `next` must hold the positions before the last step, but for those who are led. For
    /// each step, whether somebody moved farther in it than `farther` \[length\] along an axis.
    pub fn steps(
        &self,
        interaction: &Interaction,
        frame: Option<&Frame>,
        (present, next): (&mut Points, &mut Points),
        (count, led, farther): (usize, Led<'_>, Option<f64>),
        activity: &mut Activity,
    ) -> Vec<bool> {
        let stencil = self.stencil.as_ref().expect("a sweep that takes several steps has a stencil");
        let rest = interaction.rest.as_ref().map(|rest| [&rest.x[..], &rest.y[..]]);
        let threads = rayon::current_num_threads();
        let reference = [&interaction.reference.x[..], &interaction.reference.y[..]];
        let frame = frame.map(|frame| Following { frame, reference });
        let steps = Steps { stencil, rest, frame, led, count, farther, threads };
        let even = [&mut present.x[..], &mut present.y[..]];
        let farther = steps.take(activity, even, [&mut next.x[..], &mut next.y[..]]);
        if count % 2 == 1 {
            std::mem::swap(present, next);
        }
        farther
    }

    /// How many particles follow.
    pub fn followers(&self) -> usize {
        self.followers
    }

    /// Whether [`Sweep::steps`] can take the steps of a body with this frame, if it has one: not if something looks at a
    /// step as it ends.
    pub fn takes_several(&self, frame: Option<&Frame>) -> bool {
        let keeps_up = |frame: &Frame, stencil: &Stencil| {
            frame.rule.looks_before_the_sweep() && stencil.are_near(frame.reach())
        };
        self.torn.is_empty()
            && self.stencil.as_ref().is_some_and(|stencil| frame.is_none_or(|frame| keeps_up(frame, stencil)))
    }

    fn moved(&self, j: usize, interaction: &Interaction, seen: &Points) -> [f64; 2] {
        let target = interaction.target(j, seen);
        let damping = self.update.damping;
        if damping == 1.0 {
            return target;
        }
        let here = seen.get(j);
        [0, 1].map(|k| here[k] + damping * (target[k] - here[k]))
    }
}

fn followers(roles: &[Role]) -> Vec<bool> {
    roles.iter().map(|&role| role == Role::Follower).collect()
}

fn count(follows: &[bool]) -> usize {
    follows.iter().filter(|&&follows| follows).count()
}

/// Particles per piece of work in a body of so many: every thread gets several.
fn chunk_size(particles: usize) -> usize {
    (particles / 64).clamp(1 << 14, 1 << 17)
}

fn is_parallel(particles: usize) -> bool {
    particles >= PARALLEL_FROM && rayon::current_num_threads() > 1
}

/// Runs `work(chunk, x, y)` on every chunk of the points, in parallel where that pays.
fn for_chunks(points: &mut Points, work: impl Fn(usize, &mut [f64], &mut [f64]) + Sync) {
    let (parallel, size) = (is_parallel(points.len()), chunk_size(points.len()));
    let Points { x, y } = points;
    if parallel {
        x.par_chunks_mut(size)
            .zip(y.par_chunks_mut(size))
            .enumerate()
            .for_each(|(chunk, (x, y))| work(chunk, x, y));
    } else {
        x.chunks_mut(size).zip(y.chunks_mut(size)).enumerate().for_each(|(chunk, (x, y))| work(chunk, x, y));
    }
}

/// One step of everybody, in pieces of whole bands.
fn sweep_whole(
    stencil: &Stencil,
    torn: &Torn,
    interaction: &Interaction,
    present: &Points,
    next: &mut Points,
) {
    let bands = stencil.band_count();
    let size = if is_parallel(present.len()) { chunk_size(present.len()) } else { usize::MAX };
    let mut pieces = Vec::new();
    let (mut x, mut y) = (&mut next.x[..], &mut next.y[..]);
    let mut first = 0;
    for band in 0..bands {
        let particles = stencil.particles(first..band + 1);
        if particles.len() >= size || band + 1 == bands {
            let (head_x, tail_x) = x.split_at_mut(particles.len());
            let (head_y, tail_y) = y.split_at_mut(particles.len());
            pieces.push((first..band + 1, particles.start, head_x, head_y));
            (x, y, first) = (tail_x, tail_y, band + 1);
        }
    }
    let [rest_x, rest_y] = [0, 1]
        .map(|axis| interaction.rest.as_ref().map(|rest| if axis == 0 { &rest.x[..] } else { &rest.y[..] }));
    let work = |(bands, begin, x, y): (Range<usize>, usize, &mut [f64], &mut [f64])| {
        let mut planes = [
            Plane { seen_from: 0, present: &present.x, rest: rest_x, begin, next: x },
            Plane { seen_from: 0, present: &present.y, rest: rest_y, begin, next: y },
        ];
        let mut sweep = |bands: Range<usize>| {
            planes.iter_mut().for_each(|plane| stencil.sweep_runs(bands.clone(), TILE, plane));
            stencil.sweep_listed(bands.clone(), &mut planes);
            torn.sweep(bands, &interaction.reference, &mut planes);
        };
        // The torn are swept over, and then again while what they see is in the caches.
        if torn.is_empty() { sweep(bands) } else { bands.for_each(|band| sweep(band..band + 1)) }
    };
    match pieces.len() {
        0 | 1 => pieces.into_iter().for_each(work),
        _ => pieces.into_par_iter().for_each(work),
    }
}
