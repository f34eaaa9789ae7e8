//! One step of the body: every follower takes its target.
//!
//! The synchronous sweep (the paper's) reads the positions before the step and writes the next ones;
//! it runs in parallel above a size where that pays, and each particle's target depends on the old
//! positions alone, so the bits are the same for any number of threads. The sequential sweep moves
//! the particles one after the other in their numbering, each seeing the new places of those before
//! it (Gauss-Seidel).

//!
//! * `rows`: a rule compiled for a body, as runs and gathers with coefficients.
//! * `kernel`, `gathers`: the loops over rows; `terms`: what is made of a mean while it is in the registers.
//! * `schedule`: which bands take which step when, on which thread; `caches`: how large a band is on this computer.
//! * `domain`: the part of a body that a rank moves; `torn`: particles that have lost bonds.

pub mod caches;
pub mod domain;
mod gathers;
pub(crate) mod kernel;
pub(crate) mod rows;
mod schedule;
pub(crate) mod terms;
#[cfg(test)]
mod tests;
pub(crate) mod torn;

use std::ops::Range;

use rayon::prelude::*;

use schedule::LaggedFrame;
pub use schedule::{Activity, Led, MOST_STEPS};
pub(crate) use schedule::{Stage, Steps};

use crate::flock::frame::Frame;
use crate::flock::lanes::vectors;
use crate::flock::law::{Flock, Weights};
use crate::flock::role::Role;
use crate::flock::vectors::Vectors;
use caches::Caches;
use domain::{Domain, Held, Share};
use kernel::Component;
use rows::Rows;
use terms::Compiled;
use torn::DamagedRows;

/// The positions, old or new, that particles see within one step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Every particle sees the old positions (the paper).
    Synchronous,
    /// Each sees the new positions of the particles numbered before it.
    Sequential,
}

/// How targets become positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Update {
    /// Which places of the neighbours a particle sees.
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

/// The choices made for sweeps on this computer, in words: vectors, and how bodies are cut.
pub fn chosen_here() -> String {
    format!("vectors: {}; {}", vectors(), Caches::here())
}

/// The followers of a body, made ready to be swept.
#[derive(Clone, Debug)]
pub struct Sweep {
    update: Update,
    follows: Vec<bool>,
    followers: usize,
    /// Present where the mean is affine in the positions and the sweep synchronous.
    rows: Option<Rows>,
    terms: Compiled,
    /// Followers with a broken bond, which the rows do not fit, where the rule is the plain barycentre.
    torn: DamagedRows,
    /// The same where it is not, ascending: they are swept one by one.
    aside: Vec<u32>,
    /// The part of the body that is swept here, where it is shared.
    domain: Option<Domain>,
}

impl Sweep {
    /// Compiles the rows, anew whenever roles or neighbours change; particles that lose a bond are
    /// [set aside](Sweep::set_aside).
    pub fn compile(update: Update, flock: &Flock, roles: &[Role]) -> Self {
        Self::compile_share(update, flock, roles, Share::whole())
    }

    /// The same for one of the ranks that share the body.
    pub(crate) fn compile_share(update: Update, flock: &Flock, roles: &[Role], share: Share) -> Self {
        let mut sweep = Self::uncompiled(update, flock, roles);
        if update.order == Order::Synchronous {
            sweep.rows = Rows::compile(flock, &sweep.follows, share);
        }
        sweep.share_with(share);
        let neighbours = &flock.neighbours;
        if let Some(rows) = sweep.rows.as_ref().filter(|_| sweep.is_plain(flock)) {
            sweep.torn = DamagedRows::new((0..rows.band_count()).map(|band| rows.particles(band..band + 1)));
        }
        if let Some(bonds) = flock.bonds.as_ref().filter(|bonds| bonds.any_broken()) {
            let is_torn = |&j: &usize| bonds.is_torn(j, neighbours);
            sweep.set_aside((0..neighbours.count()).filter(is_torn), flock);
        }
        sweep
    }

    /// For neighbours that change at every step: nothing is compiled from them.
    pub fn uncompiled(update: Update, flock: &Flock, roles: &[Role]) -> Self {
        let follows: Vec<bool> = roles.iter().map(|&role| role == Role::Follower).collect();
        Self {
            update,
            followers: follows.iter().filter(|&&follows| follows).count(),
            follows,
            rows: None,
            terms: Compiled::new(update, flock),
            torn: DamagedRows::default(),
            aside: Vec::new(),
            domain: None,
        }
    }

    /// Leaves to the other ranks what is theirs; to be called before anything is swept. A sequential sweep moves
    /// all of them all the same: each particle waits for the one before it.
    pub(crate) fn share_with(&mut self, share: Share) {
        if let Some(Held { owned: [start, end], .. }) = share.part {
            self.followers = self.follows[start..end].iter().filter(|&&follows| follows).count();
        }
        self.domain = (share.ranks > 1).then(|| match &self.rows {
            Some(rows) => Domain::of_rows(rows, share),
            None => Domain::of_particles(&self.follows, share),
        });
    }

    /// The part of the body that is swept here, where it is shared.
    pub fn domain(&self) -> Option<&Domain> {
        self.domain.as_ref()
    }

    /// The same, for what is to be learned of the other ranks.
    pub(crate) fn domain_mut(&mut self) -> Option<&mut Domain> {
        self.domain.as_mut()
    }

    /// How many particles each rank receives before so many steps, shape \[ranks\]; nothing where the body is not shared.
    pub(crate) fn halo_sizes(&self, steps: usize) -> Vec<usize> {
        self.domain.as_ref().map_or_else(Vec::new, |domain| domain.halo_sizes(steps))
    }

    /// Most steps that are worth taking together.
    pub(crate) fn steps_together(&self) -> usize {
        self.domain.as_ref().map_or(MOST_STEPS, Domain::steps_together)
    }

    /// The particles that are swept here.
    fn owned(&self) -> Range<usize> {
        self.domain.as_ref().map_or(0..self.follows.len(), Domain::owned)
    }

    /// The bands that are swept here.
    fn bands(&self, rows: &Rows) -> Range<usize> {
        self.domain.as_ref().map_or(0..rows.band_count(), Domain::bands)
    }

    /// Whether targets are nothing but means of neighbours that count the same.
    fn is_plain(&self, flock: &Flock) -> bool {
        self.terms.is_empty() && matches!(flock.weights, Weights::Equal)
    }

    /// Sweeps these by themselves from now on: they have lost a bond.
    pub fn set_aside(&mut self, particles: impl IntoIterator<Item = usize>, flock: &Flock) {
        let follows = &self.follows;
        if let (Some(_), Some(bonds), true) = (&self.rows, &flock.bonds, self.is_plain(flock)) {
            self.torn.renew(particles, follows, (bonds, &flock.neighbours, &flock.reference));
            return;
        }
        self.aside.extend(particles.into_iter().filter(|&j| follows[j]).map(|j| j as u32));
        self.aside.sort_unstable();
        self.aside.dedup();
    }

    /// Share of the followers swept without neighbour lists.
    pub fn share_in_runs(&self) -> f64 {
        self.rows.as_ref().map_or(0.0, Rows::share_in_runs)
    }

    /// Writes the followers' next positions, then the frame's. Leaders must stand in `next` already;
    /// what neither follows nor is frame keeps what stands there. The sequential sweep starts from
    /// what `next` holds, so it must hold the present positions. Of a shared body only this rank's
    /// followers move.
    pub fn step(&self, flock: &Flock, frame: Option<&Frame>, present: &Vectors, next: &mut Vectors) {
        let owned = self.owned();
        if let Some(rows) = &self.rows {
            self.sweep_whole(rows, flock, present, next);
            self.step_aside(flock, present, next);
        } else if self.update.order == Order::Synchronous {
            for_chunks(next, |chunk, x, y| {
                let begin = chunk * chunk_size(present.len());
                let chunk = begin..begin + x.len();
                for j in owned.start.max(chunk.start)..owned.end.min(chunk.end) {
                    if self.follows[j] {
                        [x[j - begin], y[j - begin]] = self.moved(j, flock, present);
                    }
                }
            });
        } else {
            for j in (0..self.follows.len()).filter(|&j| self.follows[j]) {
                next.set(j, self.moved(j, flock, next));
            }
        }
        if let Some(frame) = frame {
            frame.follow(&flock.reference, present, next);
        }
    }

    /// Moves the particles that the rows do not fit any more; the values that the rows left there are overwritten.
    fn step_aside(&self, flock: &Flock, present: &Vectors, next: &mut Vectors) {
        let moved = |&j: &u32| (j, self.moved(j as usize, flock, present));
        let owned = self.owned();
        let before = |end: usize| self.aside.partition_point(|&j| (j as usize) < end);
        let aside = &self.aside[before(owned.start)..before(owned.end)];
        if aside.len() >= ASIDE_IN_PARALLEL && rayon::current_num_threads() > 1 {
            let moved: Vec<(u32, [f64; 2])> = aside.par_iter().map(moved).collect();
            moved.into_iter().for_each(|(j, place)| next.set(j as usize, place));
        } else {
            aside.iter().map(moved).for_each(|(j, place)| next.set(j as usize, place));
        }
    }

    /// Takes up to [`MOST_STEPS`] steps at once, by a sweep that [`Sweep::takes_several`]; the bits are those of single
    /// steps. `next` must hold the positions before the last step, but for led particles. Returns for each step
    /// whether any particle moved farther in it than `farther` \[length\] along an axis.
    pub fn steps(
        &self,
        flock: &Flock,
        frame: Option<&Frame>,
        (present, next): (&mut Vectors, &mut Vectors),
        (count, led, farther): (usize, Led<'_>, Option<f64>),
        activity: &mut Activity,
    ) -> Vec<bool> {
        let steps = self.steps_to_take(flock, frame, (count, led, farther), 0);
        let farther = steps.take(activity, present.components_mut(), next.components_mut());
        if count % 2 == 1 {
            std::mem::swap(present, next);
        }
        farther
    }

    /// The steps of [`Sweep::steps`], before they are taken, with so many bands around those of this rank, which are moved along.
    pub(crate) fn steps_to_take<'a>(
        &'a self,
        flock: &'a Flock,
        frame: Option<&'a Frame>,
        (count, led, farther): (usize, Led<'a>, Option<f64>),
        beyond: usize,
    ) -> Steps<'a, f64> {
        let rows = self.rows.as_ref().expect("a sweep that takes several steps has rows");
        let [rest, force] =
            [&flock.rest, &flock.forces].map(|points| points.as_ref().map(Vectors::components));
        let frame = frame.map(|frame| LaggedFrame { frame, reference: flock.reference.components() });
        let (terms, threads) = (self.terms.of(flock), rayon::current_num_threads());
        let Range { start, end } = self.bands(rows);
        // A rank without bands has none around them.
        let beyond = if start < end { beyond } else { 0 };
        let owned = start.saturating_sub(beyond)..(end + beyond).min(rows.band_count());
        Steps { rows, owned, terms, rest, force, frame, led, count, farther, threads }
    }

    /// How many particles follow; of a part of a body, of its own.
    pub fn followers(&self) -> usize {
        self.followers
    }

    /// Whether [`Sweep::steps`] can take the steps of a body with this frame, if it has one: not if something looks at a
    /// step as it ends.
    pub fn takes_several(&self, frame: Option<&Frame>) -> bool {
        let keeps_up =
            |frame: &Frame, rows: &Rows| frame.rule.looks_before_the_sweep() && rows.are_near(frame.reach());
        let is_parted = |rows: &Rows| self.domain.is_none() || rows.is_local();
        self.torn.is_empty()
            && self.aside.is_empty()
            && self.rows.as_ref().is_some_and(is_parted)
            && self.rows.as_ref().is_some_and(|rows| frame.is_none_or(|frame| keeps_up(frame, rows)))
    }

    /// How many times as far from the reference a step may take a particle as any was that it sees, but for loads and
    /// leaders \[1\].
    pub fn gain(&self) -> Option<f64> {
        self.rows.as_ref().map(|rows| self.terms.gain(rows.gain()))
    }

    /// One step of all rows, in pieces of whole bands.
    fn sweep_whole(&self, rows: &Rows, flock: &Flock, present: &Vectors, next: &mut Vectors) {
        let (bands, owned) = (self.bands(rows), self.owned());
        let size = if is_parallel(owned.len()) { chunk_size(owned.len()) } else { usize::MAX };
        let mut pieces = Vec::new();
        let (mut x, mut y) = (&mut next.x[owned.clone()], &mut next.y[owned]);
        let mut first = bands.start;
        for band in bands.clone() {
            let particles = rows.particles(first..band + 1);
            if particles.len() >= size || band + 1 == bands.end {
                let (head_x, tail_x) = x.split_at_mut(particles.len());
                let (head_y, tail_y) = y.split_at_mut(particles.len());
                pieces.push((first..band + 1, particles.start, head_x, head_y));
                (x, y, first) = (tail_x, tail_y, band + 1);
            }
        }
        let (rest, force) = (flock.rest.as_ref(), flock.forces.as_ref());
        let terms = self.terms.of(flock);
        let work = |(bands, begin, next_x, next_y): (Range<usize>, usize, &mut [f64], &mut [f64])| {
            let mut components = [(0, next_x), (1, next_y)].map(|(axis, next)| {
                let [rest, force] =
                    [rest, force].map(|points| points.map(|points| points.components()[axis]));
                let present = present.components()[axis];
                Component { axis, seen_from: 0, present, rest, force, begin, next }
            });
            if self.torn.is_empty() {
                return rows.sweep(bands, TILE, &mut components, &terms);
            }
            // The torn are swept over, and then again while what they see is in the caches.
            for band in bands {
                rows.sweep(band..band + 1, TILE, &mut components, &terms);
                self.torn.sweep(band..band + 1, &flock.reference, &mut components);
            }
        };
        match pieces.len() {
            0 | 1 => pieces.into_iter().for_each(work),
            _ => pieces.into_par_iter().for_each(work),
        }
    }

    fn moved(&self, j: usize, flock: &Flock, seen: &Vectors) -> [f64; 2] {
        let target = flock.target(j, seen);
        let damping = self.update.damping;
        if damping == 1.0 {
            return target;
        }
        let here = seen.get(j);
        [0, 1].map(|k| here[k] + damping * (target[k] - here[k]))
    }
}

/// Particles per piece of work in a body of so many: every thread gets several.
fn chunk_size(particles: usize) -> usize {
    (particles / 64).clamp(1 << 14, 1 << 17)
}

fn is_parallel(particles: usize) -> bool {
    particles >= PARALLEL_FROM && rayon::current_num_threads() > 1
}

/// Runs `work(chunk, x, y)` on every chunk of the points, in parallel where that pays.
fn for_chunks(points: &mut Vectors, work: impl Fn(usize, &mut [f64], &mut [f64]) + Sync) {
    let (parallel, size) = (is_parallel(points.len()), chunk_size(points.len()));
    let Vectors { x, y } = points;
    if parallel {
        x.par_chunks_mut(size)
            .zip(y.par_chunks_mut(size))
            .enumerate()
            .for_each(|(chunk, (x, y))| work(chunk, x, y));
    } else {
        x.chunks_mut(size).zip(y.chunks_mut(size)).enumerate().for_each(|(chunk, (x, y))| work(chunk, x, y));
    }
}
