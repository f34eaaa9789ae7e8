//! Several steps while the particles are in the caches.
//!
//! A body larger than the caches is swept at the speed of its memory, once for every step. But nobody sees
//! farther than into the bands beside its own, so a band may take its next step as soon as its neighbours
//! have taken the last: the first band takes step 1; then the second takes step 1 and the first step 2;
//! and so on, a front of a few bands that runs through the body once for all steps together. Two arrays
//! suffice, as for single steps: what a step writes over was last needed by the step before it, one band
//! ahead. Each target is computed from the same numbers as ever, so the bits are those of single steps.
//!
//! Threads share the coordinates first, which know nothing of each other, and then the bands: each thread
//! takes a segment, of which every step leaves off one more band at the cuts between segments; then the
//! wedges left at the cuts are filled in.
//!
//! A band that did not change in a step, beside others that did not either, will not change in the next:
//! it is left out. So a body costs what of it moves.

use std::ops::Range;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::flock::real::Real;
use crate::flock::stencil::{Plane, Stencil};

/// Most steps taken together: more gain nothing, their front no longer fits the second cache. Measured on
/// 4096 squared: 4 steps are 1.75 times, 8 steps 2.1, 16 steps 2.2 and 32 steps 2.2 times as fast as one at a time.
pub const MOST_STEPS: usize = 16;

/// Particles of a column swept before it is the next one's turn, if several steps are taken together, or one.
const TILES: [usize; 2] = [512, 64];

/// Who is led from outside while several steps are taken.
#[derive(Clone, Copy)]
pub struct Led<'a> {
    /// Their indices, ascending.
    pub particles: &'a [usize],
    /// Where number `which` of them stands after so many steps, counted from 1 \[length\].
    pub place: &'a (dyn Fn(usize, usize) -> [f64; 2] + Sync),
}

impl Led<'_> {
    pub const NOBODY: Led<'static> = Led { particles: &[], place: &|_, _| [f64::NAN; 2] };
}

/// Which bands changed in the last step, and what was swept so far.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Activity {
    /// For each coordinate and band; empty where nothing is known.
    changed: [Vec<bool>; 2],
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

    /// Counts steps of a whole body of so many followers.
    pub fn count_whole(&mut self, followers: usize) {
        self.computed += 2 * followers as u64;
        self.due += 2 * followers as u64;
    }
}

/// What several steps are taken by.
#[derive(Clone, Copy)]
pub struct Steps<'a, T> {
    pub stencil: &'a Stencil,
    pub rest: Option<[&'a [T]; 2]>,
    pub led: Led<'a>,
    /// How many, from 1 to [`MOST_STEPS`].
    pub count: usize,
    /// Where it is asked after each step whether somebody moved farther than this \[length\].
    pub farther: Option<f64>,
    /// Threads to share the work among.
    pub threads: usize,
}

impl<T: Real> Steps<'_, T> {
    /// Takes the steps. After an odd number of them the result stands in `odd`, after an even number in
    /// `even`, which holds the present positions; the other holds those one step before. For each step, whether somebody
    /// moved farther in it than asked along an axis.
    pub fn take(&self, activity: &mut Activity, even: [&mut [T]; 2], odd: [&mut [T]; 2]) -> Vec<bool> {
        let bands = self.stencil.band_count();
        let [changed_x, changed_y] = &mut activity.changed;
        let ([even_x, even_y], [odd_x, odd_y]) = (even, odd);
        let mut x = || self.take_axis(0, changed_x, even_x, odd_x);
        let mut y = || self.take_axis(1, changed_y, even_y, odd_y);
        let (x, y) = if self.threads > 1 { rayon::join(x, y) } else { (x(), y()) };
        let followers: usize = (0..bands).map(|band| self.stencil.followers(band)).sum();
        activity.due += 2 * (followers * self.count) as u64;
        activity.computed += x.computed + y.computed;
        x.farther.iter().zip(y.farther).map(|(x, y)| *x || y).collect()
    }

    fn take_axis(&self, axis: usize, changed: &mut Vec<bool>, even: &mut [T], odd: &mut [T]) -> Seen {
        let (bands, levels) = (self.stencil.band_count(), self.count + 1);
        changed.resize(bands, true);
        let mut flags = vec![false; bands * levels];
        for (flags, changed) in flags.chunks_mut(levels).zip(&*changed) {
            flags[0] = *changed;
        }
        let rows = Rows { even, odd, flags: &mut flags };
        let mut seen = Seen { computed: 0, farther: vec![false; self.count] };
        let cuts = self.cuts(bands);
        if cuts.len() == 2 {
            let front = Front { steps: self, axis, stretch: 0..bands, rows };
            front.run(|_| 0..bands, &mut seen);
            keep_last(&flags, levels, changed);
            return seen;
        }
        let segments: Vec<Range<usize>> = cuts.windows(2).map(|ends| ends[0]..ends[1]).collect();
        let shrinking = |segment: &Range<usize>, level: usize| {
            let from = if segment.start == 0 { 0 } else { segment.start + level };
            from..if segment.end == bands { bands } else { segment.end - level }
        };
        self.take_fronts(axis, rows, &segments, shrinking, &mut seen);
        let rows = Rows { even, odd, flags: &mut flags };
        let inner = &cuts[1..cuts.len() - 1];
        let wedges: Vec<Range<usize>> = inner.iter().map(|cut| cut - levels..cut + levels).collect();
        let growing = |wedge: &Range<usize>, level: usize| {
            let cut = wedge.start + levels;
            cut - level..cut + level
        };
        self.take_fronts(axis, rows, &wedges, growing, &mut seen);
        keep_last(&flags, levels, changed);
        seen
    }

    /// Where the body is cut for the threads, its ends included.
    fn cuts(&self, bands: usize) -> Vec<usize> {
        // Half of them are at the other coordinate. A segment must outlast the steps, and a wedge fit in.
        let most = if self.stencil.is_local() { bands / (3 * (self.count + 1)) } else { 1 };
        let segments = self.threads.div_ceil(2).clamp(1, most.max(1));
        (0..=segments).map(|k| k * bands / segments).collect()
    }

    /// Takes the steps in disjoint stretches of bands at once; `range` says which bands of a stretch take a step.
    fn take_fronts(
        &self,
        axis: usize,
        rows: Rows<'_, T>,
        stretches: &[Range<usize>],
        range: impl Fn(&Range<usize>, usize) -> Range<usize> + Sync,
        seen: &mut Seen,
    ) {
        let fronts: Vec<_> = rows
            .part(stretches, self.stencil, self.count + 1)
            .into_iter()
            .zip(stretches)
            .map(|(rows, stretch)| Front { steps: self, axis, stretch: stretch.clone(), rows })
            .collect();
        let run = |front: Front<'_, T>| {
            let stretch = front.stretch.clone();
            let mut seen = Seen { computed: 0, farther: vec![false; self.count] };
            front.run(|level| range(&stretch, level), &mut seen);
            seen
        };
        let all: Vec<Seen> = fronts.into_par_iter().map(run).collect();
        all.into_iter().for_each(|one| seen.add(one));
    }
}

/// What was seen on the way.
struct Seen {
    computed: u64,
    farther: Vec<bool>,
}

impl Seen {
    fn add(&mut self, other: Seen) {
        self.computed += other.computed;
        self.farther.iter_mut().zip(other.farther).for_each(|(all, one)| *all |= one);
    }
}

/// One coordinate of a stretch of bands, and for each band and level whether it changed.
struct Rows<'a, T> {
    even: &'a mut [T],
    odd: &'a mut [T],
    flags: &'a mut [bool],
}

impl<'a, T> Rows<'a, T> {
    /// The rows of some stretches, ascending and apart.
    fn part(self, stretches: &[Range<usize>], stencil: &Stencil, levels: usize) -> Vec<Self> {
        let Rows { mut even, mut odd, mut flags } = self;
        let (mut particle, mut band) = (0, 0);
        let mut parts = Vec::with_capacity(stretches.len());
        for stretch in stretches {
            let particles = stencil.particles(stretch.clone());
            let of_particles = particles.start - particle..particles.end - particle;
            let part = Rows {
                even: take_part(&mut even, of_particles.clone()),
                odd: take_part(&mut odd, of_particles),
                flags: take_part(&mut flags, (stretch.start - band) * levels..(stretch.end - band) * levels),
            };
            parts.push(part);
            (particle, band) = (particles.end, stretch.end);
        }
        parts
    }
}

/// Which bands changed in the last step.
fn keep_last(flags: &[bool], levels: usize, changed: &mut [bool]) {
    for (flags, changed) in flags.chunks(levels).zip(changed) {
        *changed = flags[levels - 1];
    }
}

/// Cuts `range` out of a slice, which goes on behind it.
fn take_part<'a, T>(slice: &mut &'a mut [T], range: Range<usize>) -> &'a mut [T] {
    let (head, tail) = std::mem::take(slice).split_at_mut(range.end);
    *slice = tail;
    &mut head[range.start..]
}

/// The steps of one coordinate in a stretch of bands.
struct Front<'a, T> {
    steps: &'a Steps<'a, T>,
    axis: usize,
    stretch: Range<usize>,
    rows: Rows<'a, T>,
}

impl<T: Real> Front<'_, T> {
    /// Runs through the bands; `range` names those that take a level, whose ends move by one band a level or not at all.
    fn run(mut self, range: impl Fn(usize) -> Range<usize>, seen: &mut Seen) {
        let count = self.steps.count;
        // No band may get ahead of the one behind it if nothing binds who sees whom.
        if !self.steps.stencil.is_local() {
            for level in 1..=count {
                range(level).for_each(|band| self.sweep(level, band, seen));
            }
            return;
        }
        let (one, all) = (range(1), range(count));
        let (first, last) = ((one.start + 1).min(all.start + count), (one.end + 1).max(all.end + count));
        for at in first..last {
            for level in 1..=count.min(at) {
                if range(level).contains(&(at - level)) {
                    self.sweep(level, at - level, seen);
                }
            }
        }
    }

    /// Takes step number `level` of a band.
    fn sweep(&mut self, level: usize, band: usize, seen: &mut Seen) {
        let Self { steps, axis, stretch, rows } = self;
        let (stencil, levels) = (steps.stencil, steps.count + 1);
        let origin = stencil.particles(stretch.clone()).start;
        let all = stencil.particles(band..band + 1);
        let particles = all.start - origin..all.end - origin;
        let (present, next) =
            if level % 2 == 1 { (&*rows.even, &mut *rows.odd) } else { (&*rows.odd, &mut *rows.even) };
        let is_led = place_led(&steps.led, *axis, level, all, (origin, present, &mut *next));
        let flag = |band: usize| rows.flags[(band - stretch.start) * levels + level - 1];
        let beside = band.saturating_sub(1).max(stretch.start)..(band + 2).min(stretch.end);
        let is_moved =
            if stencil.is_local() { beside.into_iter().any(flag) } else { stretch.clone().any(flag) };
        let mut changed = false;
        if is_led || is_moved {
            let tile = TILES[usize::from(steps.count == 1)];
            let rest = steps.rest.map(|rest| rest[*axis]);
            let mut plane = [Plane { seen_from: origin, present, rest, begin: origin, next: &mut *next }];
            stencil.sweep_runs(band..band + 1, tile, &mut plane[0]);
            stencil.sweep_listed(band..band + 1, &mut plane);
            seen.computed += stencil.followers(band) as u64;
            let (before, after) = (&present[particles.clone()], &next[particles]);
            changed = differ(before, after);
            let farther = &mut seen.farther[level - 1];
            *farther = *farther || steps.farther.is_some_and(|limit| is_farther(before, after, limit));
        }
        rows.flags[(band - stretch.start) * levels + level] = changed;
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
    let from = led.particles.partition_point(|&particle| particle < band.start);
    let mut moved = false;
    for (which, &particle) in led.particles.iter().enumerate().skip(from) {
        if particle >= band.end {
            break;
        }
        let place = T::of((led.place)(which, level)[axis]);
        next[particle - origin] = place;
        moved |= place.bits() != present[particle - origin].bits();
    }
    moved
}

/// Particles compared before looking whether it is enough.
const PIECE: usize = 64;

/// Whether any bit differs.
fn differ<T: Real>(before: &[T], after: &[T]) -> bool {
    let mut pieces = before.chunks(PIECE).zip(after.chunks(PIECE));
    pieces.any(|(a, b)| a.iter().zip(b).fold(0, |bits, (a, b)| bits | (a.bits() ^ b.bits())) != 0)
}

/// Whether anyone moved farther than `limit`.
fn is_farther<T: Real>(before: &[T], after: &[T], limit: f64) -> bool {
    let mut pieces = before.chunks(PIECE).zip(after.chunks(PIECE));
    pieces
        .any(|(a, b)| a.iter().zip(b).fold(false, |far, (a, b)| far | ((b.wide() - a.wide()).abs() > limit)))
}

#[cfg(test)]
mod tests {
    use super::super::{Sweep, Update};
    use super::*;
    use crate::flock::body::{Body, Cut};
    use crate::flock::interaction::{Interaction, Weights};
    use crate::flock::lattice::{Lattice, LatticeKind};
    use crate::flock::neighbourhood::Neighbourhood;
    use crate::flock::points::Points;
    use crate::flock::role::Role;
    use crate::flock::rules::Rule;

    struct Case {
        interaction: Interaction,
        roles: Vec<Role>,
        led: Vec<usize>,
    }

    impl Case {
        fn new(kind: LatticeKind, columns: usize, rows: usize) -> Self {
            let lattice = Lattice::new(kind, [0.0, 0.0], 0.1);
            let cut = Cut::Count { columns: columns as u32, rows: rows as u32 };
            let first = Neighbourhood::First { keep: None };
            let (body, neighbours) = Body::build(lattice, &cut, &first, None).expect("fits");
            let reference = body.reference;
            let mut roles = vec![Role::Follower; reference.len()];
            let held = rows.min(reference.len() / 4);
            roles[..held].fill(Role::Clamped);
            let led: Vec<usize> = (reference.len() - held..reference.len()).step_by(2).collect();
            led.iter().for_each(|&i| roles[i] = Role::Leader);
            let (rule, weights) = (Rule::BARYCENTRE, Weights::Equal);
            let mut interaction =
                Interaction { rule, reference, neighbours, weights, forces: None, rest: None, bonds: None };
            interaction.keep_rest();
            Self { interaction, roles, led }
        }

        fn place(&self, which: usize, step: usize) -> [f64; 2] {
            let [x, y] = self.interaction.reference.get(self.led[which]);
            [x + 0.1 * step.min(9) as f64, y + 0.003 * (which * step.min(20)) as f64]
        }

        /// Where everybody is, and was before the last step, after single steps of everybody.
        fn singly(&self, steps: usize) -> [Points; 2] {
            let sweep = Sweep::compile(Update::default(), &self.interaction, &self.roles);
            let mut present = Points::clone(&self.interaction.reference);
            let mut next = present.clone();
            for step in 1..=steps {
                for which in 0..self.led.len() {
                    next.set(self.led[which], self.place(which, step));
                }
                sweep.step(&self.interaction, None, &present, &mut next);
                std::mem::swap(&mut present, &mut next);
            }
            [present, next]
        }

        /// The same by so many steps at once.
        fn together(&self, counts: &[usize], threads: usize) -> ([Points; 2], Activity) {
            let sweep = Sweep::compile(Update::default(), &self.interaction, &self.roles);
            let mut present = Points::clone(&self.interaction.reference);
            let mut next = present.clone();
            let (mut activity, mut done) = (Activity::default(), 0);
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            for &count in counts {
                let place = |which: usize, level: usize| self.place(which, done + level);
                let led = Led { particles: &self.led, place: &place };
                let rest = self.interaction.rest.as_ref().map(|rest| [&rest.x[..], &rest.y[..]]);
                let stencil = sweep.stencil.as_ref().expect("plain");
                let steps = Steps { stencil, rest, led, count, farther: None, threads };
                let even = [&mut present.x[..], &mut present.y[..]];
                let odd = [&mut next.x[..], &mut next.y[..]];
                pool.install(|| steps.take(&mut activity, even, odd));
                if count % 2 == 1 {
                    std::mem::swap(&mut present, &mut next);
                }
                done += count;
            }
            ([present, next], activity)
        }
    }

    fn bits(places: &[Points; 2]) -> Vec<u64> {
        places.iter().flat_map(|p| p.x.iter().chain(&p.y)).map(|value| value.to_bits()).collect()
    }

    #[test]
    fn steps_taken_together_have_the_bits_of_single_ones_for_any_threads() {
        for kind in LatticeKind::SAMPLES {
            // Long enough to be cut for the threads, and for one and several wedges at the cuts.
            let case = Case::new(kind, 3600, 61);
            let expected = case.singly(25);
            for counts in [&[16usize, 9][..], &[1, 2, 3, 16, 3], &[1; 25]] {
                for threads in [1, 2, 4, 8] {
                    let (places, _) = case.together(counts, threads);
                    assert!(bits(&places) == bits(&expected), "{kind:?} {counts:?}, {threads} threads");
                }
            }
        }
    }

    #[test]
    fn threads_beyond_two_cut_the_body_in_segments() {
        let case = Case::new(LatticeKind::Square { spacing: 1.0 }, 3600, 61);
        let sweep = Sweep::compile(Update::default(), &case.interaction, &case.roles);
        let (stencil, neighbours) = (sweep.stencil.as_ref().expect("plain"), &case.interaction.neighbours);
        let segments = |threads| {
            let (led, count, farther) = (Led::NOBODY, 16, None);
            let steps = Steps::<f64> { stencil, neighbours, rest: None, led, count, farther, threads };
            steps.cuts(stencil.band_count()).len() - 1
        };
        assert_eq!([1, 2, 4, 8].map(segments), [1, 1, 2, 4]);
    }

    #[test]
    fn only_what_moves_is_swept_and_the_bits_are_the_same() {
        let square = LatticeKind::Square { spacing: 1.0 };
        let case = Case::new(square, 300, 61);
        let (places, activity) = case.together(&[16; 4], 1);
        assert!(bits(&places) == bits(&case.singly(64)));
        // The front is 64 of 300 columns in.
        let share = activity.share_computed();
        assert!(share > 0.05 && share < 0.3, "{share}");
        // Nobody led, and everything at rest: the first step finds out, and no other is made.
        let resting = Case { led: Vec::new(), ..case };
        let (_, activity) = resting.together(&[1, 16, 16], 2);
        assert_eq!(activity.share_computed(), 1.0 / 33.0);
    }

    #[test]
    fn motion_that_comes_from_either_end_is_met_in_time() {
        let mut case = Case::new(LatticeKind::Square { spacing: 1.0 }, 300, 61);
        for led in [(0..61).collect::<Vec<usize>>(), (0..61).chain(299 * 61..300 * 61).collect()] {
            case.roles.fill(Role::Follower);
            led.iter().for_each(|&i| case.roles[i] = Role::Leader);
            case.led = led;
            let (places, activity) = case.together(&[16, 16, 16, 9], 1);
            assert!(bits(&places) == bits(&case.singly(57)));
            assert!(activity.share_computed() < 0.5, "{}", activity.share_computed());
        }
    }

    #[test]
    fn a_body_in_which_some_see_far_is_stepped_all_the_same() {
        let mut case = Case::new(LatticeKind::Square { spacing: 1.0 }, 5000, 61);
        // The far end hears of the near one.
        let last = case.interaction.reference.len() as u32 - 70;
        let lists: Vec<Vec<u32>> = (0..case.interaction.reference.len())
            .map(|j| {
                case.interaction.neighbours.of(j).iter().copied().chain((j == 70).then_some(last)).collect()
            })
            .collect();
        case.interaction.neighbours = Neighbours::from_lists(lists);
        case.interaction.rest = None;
        case.interaction.keep_rest();
        let (places, activity) = case.together(&[16, 4], 3);
        assert!(bits(&places) == bits(&case.singly(20)));
        assert_eq!(activity.share_computed(), 1.0);
    }

    #[test]
    fn it_is_told_in_which_steps_somebody_moved_farther_than_asked() {
        let case = Case::new(LatticeKind::Square { spacing: 1.0 }, 12, 12);
        let sweep = Sweep::compile(Update::default(), &case.interaction, &case.roles);
        let mut present = Points::clone(&case.interaction.reference);
        let mut next = present.clone();
        let place = |which: usize, level: usize| case.place(which, if level < 3 { 0 } else { 1 });
        let led = Led { particles: &case.led, place: &place };
        let places = (&mut present, &mut next);
        let farther = sweep.steps(&case.interaction, places, (5, led, Some(0.09)), &mut Activity::default());
        // The leaders jump by 0.1 in the third; whoever follows moves by less.
        assert_eq!(farther, [false, false, true, false, false]);
    }
}
