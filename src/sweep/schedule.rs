//! Several steps while the particles are in the caches.
//!
//! A body larger than the caches is swept at the speed of its memory, once for every step. But no particle sees
//! farther than into the bands beside its own, so a band may take its next step as soon as its neighbours
//! have taken the last: the first band takes step 1; then the second takes step 1 and the first step 2;
//! and so on, a front of a few bands that runs through the body once for all steps together. Two arrays
//! suffice, as for single steps: what a step writes over was last needed by the step before it, one band
//! ahead. Each target is computed from the same numbers as ever, so the bits are those of single steps.
//!
//! Threads share the coordinates first, which know nothing of each other, and then the bands: each thread
//! takes a segment, of which every step leaves off one more band at the cuts between segments; then the
//! wedges left at the cuts are filled in. A body that ranks share is cut in the same way where they meet: what lies between is
//! swept while the bands of the others are on their way ([`Stage`]).
//!
//! A band that did not change in a step, beside others that did not either, will not change in the next:
//! it is left out. So a body costs what of it moves.

#[cfg(test)]
mod tests;

use std::ops::Range;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::PARALLEL_FROM;
use super::kernel::{self, Component};
use super::rows::Rows;
use super::terms::Terms;
use crate::flock::frame::Frame;
use crate::flock::real::Real;

/// Most steps taken together: more gain nothing. Measured on 4096 squared: 4 steps are 1.75 times, 8 steps 2.1, 16 steps 2.2
/// and 32 steps 2.2 times as fast as one at a time on an EPYC, 1.6, 1.9, 2.3 and 1.8 times on a Xeon.
pub const MOST_STEPS: usize = 16;

/// Particles of a column swept before it is the next one's turn: if several steps are taken together, while the second
/// cache holds their bands or not, or one.
const TILES: [usize; 3] = [kernel::WHOLE, 512, 64];

/// Bands swept in one go where each step is taken by itself: enough for what is asked of each band not to count.
const MOST_BANDS: usize = 8;

/// The particles that are led from outside while several steps are taken.
#[derive(Clone, Copy)]
pub struct Led<'a> {
    /// Their indices, ascending.
    pub particles: &'a [usize],
    /// Where they stand after each step \[length\], shape \[steps\]\[particles\].
    pub places: &'a [[f64; 2]],
}

impl Led<'_> {
    /// Nothing is led.
    pub const NONE: Led<'static> = Led { particles: &[], places: &[] };
}

/// A frame that looks before the sweep, and where it stands around the body at rest \[length\].
#[derive(Clone, Copy)]
pub struct LaggedFrame<'a, T> {
    pub frame: &'a Frame,
    pub reference: [&'a [T]; 2],
}

/// Which bands changed in the last step, and what was swept so far.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Activity {
    /// For each coordinate and band; empty where nothing is known.
    changed: [Vec<bool>; 2],
    /// The size of those bands \[particles\]: another computer may cut others.
    band_size: usize,
    /// Coordinates computed, and those that sweeps of the whole body would have computed.
    computed: u64,
    due: u64,
}

impl Activity {
    /// To be called when positions are changed by anything but the sweep: what stands still is not known any more.
    pub fn forget(&mut self) {
        self.changed = Default::default();
    }

    /// Share of the followers' updates that were computed \[1\]; the others were known to change nothing.
    pub fn share_computed(&self) -> f64 {
        if self.due == 0 { 1.0 } else { self.computed as f64 / self.due as f64 }
    }

    /// Takes the counts out, to be added up with those of other ranks: computed and due.
    pub(crate) fn take_counts(&mut self) -> [u64; 2] {
        [std::mem::take(&mut self.computed), std::mem::take(&mut self.due)]
    }

    /// Adds counts of other steps, or of other parts of the body.
    pub(crate) fn add_counts(&mut self, [computed, due]: [u64; 2]) {
        self.computed = self.computed.saturating_add(computed);
        self.due = self.due.saturating_add(due);
    }

    /// Counts steps of a whole body of so many followers.
    pub(crate) fn count_whole(&mut self, followers: usize) {
        self.add_counts([2 * followers as u64; 2]);
    }
}

/// Several steps to be taken, and their input.
#[derive(Clone)]
pub struct Steps<'a, T> {
    pub rows: &'a Rows,
    /// The bands that are to be moved; all but where the body is shared. Those around them are moved as long as they are
    /// needed.
    pub owned: Range<usize>,
    pub terms: Terms<'a, T>,
    pub rest: Option<[&'a [T]; 2]>,
    /// Loads, where the rows are of a material.
    pub force: Option<[&'a [T]; 2]>,
    pub frame: Option<LaggedFrame<'a, T>>,
    pub led: Led<'a>,
    /// How many, from 1 to [`MOST_STEPS`].
    pub count: usize,
    /// Distance with which the movement of each step is compared, along each axis \[length\].
    pub farther: Option<f64>,
    /// Threads to share the work among, if the body is worth it.
    pub threads: usize,
}

/// Which of the work is done: all of it at once, or in turn what needs nothing of the bands around those owned, and the rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    All,
    Inside,
    Rim,
}

/// Steps that have begun.
pub struct UnderWay {
    /// Whether bands changed, for each band and level, of x and of y, or of both where they are swept together.
    flags: [Vec<bool>; 2],
    seen: Seen,
}

impl<T: Real> Steps<'_, T> {
    /// Takes the steps. After an odd number of them the result stands in `odd`, after an even number in
    /// `even`, which holds the present positions; the other holds those one step before. Returns for each step whether
    /// any particle moved farther in it than `farther` along an axis.
    pub fn take(&self, activity: &mut Activity, even: [&mut [T]; 2], odd: [&mut [T]; 2]) -> Vec<bool> {
        let mut under_way = self.begin(activity);
        self.go_on(&mut under_way, Stage::All, even, odd);
        self.end(under_way, activity)
    }

    /// Whether coordinates are swept together: a list that has been read serves both.
    fn sweeps_both(&self) -> bool {
        self.rows.share_in_runs() < 0.5 || self.rows.couples(&self.terms)
    }

    /// Whether the inside can be swept before the rim: each is to be wide enough for a front.
    pub fn has_inside(&self) -> bool {
        self.rows.is_local() && self.owned.len() >= 3 * (self.count + 1)
    }

    /// Begins the steps.
    pub fn begin(&self, activity: &mut Activity) -> UnderWay {
        if activity.band_size != self.rows.band_size() {
            activity.forget();
            activity.band_size = self.rows.band_size();
        }
        let (bands, levels) = (self.rows.band_count(), self.count + 1);
        let first = |changed: &mut [Vec<bool>]| {
            let mut flags = vec![false; bands * levels];
            for changed in changed {
                changed.resize(bands, true);
                flags.iter_mut().step_by(levels).zip(&*changed).for_each(|(flag, changed)| *flag |= changed);
            }
            flags
        };
        let changed = &mut activity.changed;
        let flags = if self.sweeps_both() {
            [first(changed), Vec::new()]
        } else {
            let [x, y] = changed;
            [first(std::slice::from_mut(x)), first(std::slice::from_mut(y))]
        };
        UnderWay { flags, seen: Seen::default() }
    }

    /// Does one stage of the work, in the arrays of [`Steps::take`].
    pub fn go_on(&self, under_way: &mut UnderWay, stage: Stage, even: [&mut [T]; 2], odd: [&mut [T]; 2]) {
        if self.owned.is_empty() {
            return;
        }
        let UnderWay { flags: [flags, flags_of_y], seen } = under_way;
        let ([even_x, even_y], [odd_x, odd_y]) = (even, odd);
        let threads = if even_x.len() < PARALLEL_FROM { 1 } else { self.threads };
        if self.sweeps_both() {
            let rows = Stretch { even: [even_x, even_y], odd: [odd_x, odd_y], flags };
            seen.add(self.take_axes(stage, [0, 1], rows, threads));
        } else {
            let each = threads.div_ceil(2);
            let x = Stretch { even: [even_x], odd: [odd_x], flags };
            let y = Stretch { even: [even_y], odd: [odd_y], flags: flags_of_y };
            let x = || self.take_axes(stage, [0], x, each);
            let y = || self.take_axes(stage, [1], y, each);
            let (x, y) = if threads > 1 { rayon::join(x, y) } else { (x(), y()) };
            seen.add(x);
            seen.add(y);
        }
    }

    /// Ends the steps; see [`Steps::take`].
    pub fn end(&self, under_way: UnderWay, activity: &mut Activity) -> Vec<bool> {
        let UnderWay { flags: [flags, flags_of_y], seen } = under_way;
        let of_y = if flags_of_y.is_empty() { &flags } else { &flags_of_y };
        for (flags, changed) in [&flags, of_y].into_iter().zip(&mut activity.changed) {
            let last = flags.iter().skip(self.count).step_by(self.count + 1);
            // Those of others move on without being seen.
            let last = last.enumerate().map(|(band, flag)| *flag || !self.owned.contains(&band));
            last.zip(changed).for_each(|(flag, changed)| *changed = flag);
        }
        let followers: usize = self.owned.clone().map(|band| self.rows.followers(band)).sum();
        let due = 2 * (followers * self.count) as u64;
        activity.due = activity.due.saturating_add(due);
        activity.computed = activity.computed.saturating_add(seen.computed);
        seen.farther[..self.count].to_vec()
    }

    fn take_axes<const P: usize>(
        &self,
        stage: Stage,
        axes: [usize; P],
        mut rows: Stretch<'_, T, P>,
        threads: usize,
    ) -> Seen {
        let levels = self.count + 1;
        let (all, Range { start, end }) = (self.due(0), self.owned.clone());
        let mut seen = Seen::default();
        if stage == Stage::Rim {
            let before = (all.start < start).then(|| all.start..start + levels);
            let after = (end < all.end).then(|| end - levels..all.end);
            let sloping = |rim: &Range<usize>, level: usize| {
                let due = self.due(level);
                if rim.start == all.start { due.start..start + level } else { end - level..due.end }
            };
            let rims: Vec<Range<usize>> = before.into_iter().chain(after).collect();
            self.take_fronts(axes, rows, &rims, sloping, &mut seen);
            return seen;
        }
        let outer = if stage == Stage::All { all.clone() } else { start..end };
        let cuts = self.cuts(outer.clone(), threads);
        if cuts.len() == 2 && outer == all {
            let stretch = 0..self.rows.band_count();
            Wavefront { steps: self, axes, stretch, rows }.run(|level| self.due(level), &mut seen);
            return seen;
        }
        let segments: Vec<Range<usize>> = cuts.windows(2).map(|ends| ends[0]..ends[1]).collect();
        let shrinking = |segment: &Range<usize>, level: usize| {
            let due = self.due(level);
            let from = if segment.start == all.start { due.start } else { segment.start + level };
            from..if segment.end == all.end { due.end } else { segment.end - level }
        };
        self.take_fronts(axes, rows.lend(), &segments, shrinking, &mut seen);
        let inner = &cuts[1..cuts.len() - 1];
        let wedges: Vec<Range<usize>> = inner.iter().map(|cut| cut - levels..cut + levels).collect();
        let growing = |wedge: &Range<usize>, level: usize| {
            let cut = wedge.start + levels;
            cut - level..cut + level
        };
        self.take_fronts(axes, rows, &wedges, growing, &mut seen);
        seen
    }

    /// The bands that take step number `level`, so that those owned can take the last one; number 0 is what the first
    /// step needs.
    fn due(&self, level: usize) -> Range<usize> {
        let still_needed = self.count - level;
        let end = (self.owned.end + still_needed).min(self.rows.band_count());
        self.owned.start.saturating_sub(still_needed)..end
    }

    /// Where these bands are cut for the threads, their ends included.
    fn cuts(&self, bands: Range<usize>, threads: usize) -> Vec<usize> {
        // A segment must outlast the steps, and a wedge fit in.
        let most = if self.rows.is_local() { bands.len() / (3 * (self.count + 1)) } else { 1 };
        let segments = threads.clamp(1, most.max(1));
        (0..=segments).map(|k| bands.start + k * bands.len() / segments).collect()
    }

    /// Takes the steps in disjoint stretches of bands at once; `range` says which bands of a stretch take a step.
    fn take_fronts<const P: usize>(
        &self,
        axes: [usize; P],
        rows: Stretch<'_, T, P>,
        stretches: &[Range<usize>],
        range: impl Fn(&Range<usize>, usize) -> Range<usize> + Sync,
        seen: &mut Seen,
    ) {
        let fronts: Vec<_> = rows
            .part(stretches, self.rows, self.count + 1)
            .into_iter()
            .zip(stretches)
            .map(|(rows, stretch)| Wavefront { steps: self, axes, stretch: stretch.clone(), rows })
            .collect();
        let run = |front: Wavefront<'_, T, P>| {
            let stretch = front.stretch.clone();
            let mut seen = Seen::default();
            front.run(|level| range(&stretch, level), &mut seen);
            seen
        };
        let all: Vec<Seen> = fronts.into_par_iter().map(run).collect();
        all.into_iter().for_each(|one| seen.add(one));
    }
}

/// Counts and flags collected on the way.
#[derive(Default)]
struct Seen {
    computed: u64,
    farther: [bool; MOST_STEPS],
}

impl Seen {
    fn add(&mut self, other: Seen) {
        self.computed += other.computed;
        self.farther.iter_mut().zip(other.farther).for_each(|(all, one)| *all |= one);
    }
}

/// Some coordinates of a stretch of bands, and for each band and level whether it changed.
struct Stretch<'a, T, const P: usize> {
    even: [&'a mut [T]; P],
    odd: [&'a mut [T]; P],
    flags: &'a mut [bool],
}

impl<'a, T, const P: usize> Stretch<'a, T, P> {
    /// The rows that a level reads, those it writes, and the flags.
    #[allow(clippy::type_complexity)]
    fn at(&mut self, level: usize) -> (&[&'a mut [T]; P], &mut [&'a mut [T]; P], &mut [bool]) {
        let Self { even, odd, flags } = self;
        if level % 2 == 1 { (even, odd, flags) } else { (odd, even, flags) }
    }

    fn lend(&mut self) -> Stretch<'_, T, P> {
        let Self { even, odd, flags } = self;
        let (even, odd) = (even.each_mut().map(|row| &mut **row), odd.each_mut().map(|row| &mut **row));
        Stretch { even, odd, flags }
    }

    /// The rows of some stretches, ascending and apart.
    fn part(self, stretches: &[Range<usize>], of: &Rows, levels: usize) -> Vec<Self> {
        let Stretch { mut even, mut odd, mut flags } = self;
        let (mut particle, mut band) = (0, 0);
        let mut parts = Vec::with_capacity(stretches.len());
        for stretch in stretches {
            let particles = of.particles(stretch.clone());
            let of_particles = particles.start - particle..particles.end - particle;
            let part = Stretch {
                even: even.each_mut().map(|row| take_part(row, of_particles.clone())),
                odd: odd.each_mut().map(|row| take_part(row, of_particles.clone())),
                flags: take_part(&mut flags, (stretch.start - band) * levels..(stretch.end - band) * levels),
            };
            parts.push(part);
            (particle, band) = (particles.end, stretch.end);
        }
        parts
    }
}

/// Cuts `range` out of a slice, which goes on behind it.
fn take_part<'a, T>(slice: &mut &'a mut [T], range: Range<usize>) -> &'a mut [T] {
    let (head, tail) = std::mem::take(slice).split_at_mut(range.end);
    *slice = tail;
    &mut head[range.start..]
}

/// The steps of some coordinates in a stretch of bands.
struct Wavefront<'a, T, const P: usize> {
    steps: &'a Steps<'a, T>,
    axes: [usize; P],
    stretch: Range<usize>,
    rows: Stretch<'a, T, P>,
}

impl<T: Real, const P: usize> Wavefront<'_, T, P> {
    /// Runs through the bands; `range` names those that take a level, whose ends move by one band a level or not at all.
    fn run(mut self, range: impl Fn(usize) -> Range<usize>, seen: &mut Seen) {
        let count = self.steps.count;
        // No band may get ahead of the one behind it if nothing bounds how far particles see. A single step has no
        // front, and a body within the caches needs none.
        if count == 1 || !self.steps.rows.is_local() || self.steps.rows.is_in_cache() {
            (1..=count).for_each(|level| self.sweep(level, range(level), seen));
            return;
        }
        let (one, all) = (range(1), range(count));
        let (first, last) = ((one.start + 1).min(all.start + count), (one.end + 1).max(all.end + count));
        for at in first..last {
            for level in 1..=count.min(at) {
                let band = at - level;
                if range(level).contains(&band) {
                    self.sweep(level, band..band + 1, seen);
                }
            }
        }
    }

    /// Takes step number `level` of some bands, those that may change.
    fn sweep(&mut self, level: usize, bands: Range<usize>, seen: &mut Seen) {
        let mut from = bands.start;
        while from < bands.end {
            let most = bands.end.min(from + MOST_BANDS);
            let still = (from..most).find(|&band| !self.may_change(level, band));
            let to = still.unwrap_or(most);
            if from < to {
                self.sweep_all(level, from..to, seen);
            }
            if let Some(still) = still {
                self.rows.flags[(still - self.stretch.start) * (self.steps.count + 1) + level] = false;
            }
            from = still.map_or(most, |still| still + 1);
        }
    }

    /// Puts the led particles of a band in their places. Returns whether one of them moves, or whether a particle that
    /// the band sees moved in the step before.
    fn may_change(&mut self, level: usize, band: usize) -> bool {
        let Self { steps, axes, stretch, rows } = self;
        let (compiled, levels) = (steps.rows, steps.count + 1);
        let origin = compiled.particles(stretch.clone()).start;
        let (present, next, flags) = rows.at(level);
        let mut moves = false;
        for ((&axis, present), next) in axes.iter().zip(present).zip(next) {
            moves |= place_led(
                &steps.led,
                axis,
                level,
                compiled.particles(band..band + 1),
                (origin, present, next),
            );
        }
        let moved = |band: usize| flags[(band - stretch.start) * levels + level - 1];
        let beside = band.saturating_sub(1).max(stretch.start)..(band + 2).min(stretch.end);
        moves || if compiled.is_local() { beside.into_iter().any(moved) } else { stretch.clone().any(moved) }
    }

    fn sweep_all(&mut self, level: usize, bands: Range<usize>, seen: &mut Seen) {
        let Self { steps, axes, stretch, rows } = self;
        let (compiled, levels) = (steps.rows, steps.count + 1);
        let origin = compiled.particles(stretch.clone()).start;
        let tile = TILES[if steps.count == 1 { 2 } else { usize::from(!compiled.front_stays()) }];
        let (present, next, flags) = rows.at(level);
        let mut axis = axes.iter().zip(present);
        let mut components = next.each_mut().map(|next| {
            let (&axis, present) = axis.next().expect("as many as rows");
            let (rest, force) = (steps.rest.map(|rest| rest[axis]), steps.force.map(|force| force[axis]));
            Component { axis, seen_from: origin, present, rest, force, begin: origin, next }
        });
        compiled.sweep(bands.clone(), tile, &mut components, &steps.terms);
        if let Some(LaggedFrame { frame, reference }) = steps.frame {
            for (component, &axis) in components.iter_mut().zip(&*axes) {
                follow(frame, compiled.particles(bands.clone()), reference[axis], component);
            }
        }
        let farther = &mut seen.farther[level - 1];
        for band in bands {
            let particles = compiled.particles(band..band + 1);
            let particles = particles.start - origin..particles.end - origin;
            let mut changed = false;
            for of in &components {
                let (before, after) = (&of.present[particles.clone()], &of.next[particles.clone()]);
                changed = changed || differ(before, after);
                *farther = *farther || steps.farther.is_some_and(|limit| is_farther(before, after, limit));
            }
            if steps.owned.contains(&band) {
                seen.computed += (P * compiled.followers(band)) as u64;
            }
            flags[(band - stretch.start) * levels + level] = changed;
        }
    }
}

/// One coordinate of what [`Frame::follow`] does for the frame points among some particles, by a rule that looks
/// before the sweep; `reference` is that coordinate of the whole body.
fn follow<T: Real>(
    frame: &Frame,
    particles: Range<usize>,
    reference: &[T],
    component: &mut Component<'_, T>,
) {
    let from = frame.points.partition_point(|&point| (point as usize) < particles.start);
    for (k, &point) in frame.points.iter().enumerate().skip(from) {
        let point = point as usize;
        if point >= particles.end {
            break;
        }
        let moved = |s: usize| component.present[s - component.seen_from] - reference[s];
        component.next[point - component.begin] = reference[point] + frame.mean_of_served(k, moved);
    }
}

/// Puts the led ones of a band in their places; whether one of them moved.
fn place_led<T: Real>(
    led: &Led<'_>,
    axis: usize,
    level: usize,
    band: Range<usize>,
    (origin, present, next): (usize, &[T], &mut [T]),
) -> bool {
    if led.particles.is_empty() {
        return false;
    }
    let from = led.particles.partition_point(|&particle| particle < band.start);
    let places = &led.places[(level - 1) * led.particles.len()..];
    let mut moved = false;
    for (&particle, place) in led.particles.iter().zip(places).skip(from) {
        if particle >= band.end {
            break;
        }
        let place = T::of(place[axis]);
        next[particle - origin] = place;
        moved |= place.bits() != present[particle - origin].bits();
    }
    moved
}

/// Particles compared before looking whether it is enough.
const PIECE: usize = 64;

/// Whether any bit differs.
fn differ<T: Real>(before: &[T], after: &[T]) -> bool {
    // One value suffices in most cases; not one at the end or the middle of a column, which may be held.
    let one = before.len() * 5 / 13;
    if before.get(one).map(|value| value.bits()) != after.get(one).map(|value| value.bits()) {
        return true;
    }
    let mut pieces = before.chunks(PIECE).zip(after.chunks(PIECE));
    pieces.any(|(a, b)| a.iter().zip(b).fold(0, |bits, (a, b)| bits | (a.bits() ^ b.bits())) != 0)
}

/// Whether any particle moved farther than `limit`.
fn is_farther<T: Real>(before: &[T], after: &[T], limit: f64) -> bool {
    let mut pieces = before.chunks(PIECE).zip(after.chunks(PIECE));
    pieces
        .any(|(a, b)| a.iter().zip(b).fold(false, |far, (a, b)| far | ((b.wide() - a.wide()).abs() > limit)))
}
