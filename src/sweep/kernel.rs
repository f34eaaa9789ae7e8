//! The loops that a sweep spends its time in: rows over runs of particles, a few runs abreast.
//!
//! A body larger than the caches is swept at the speed of its memory, and what stands in the way of
//! that is not arithmetic but the way back from the second cache: a column is read three times, as
//! itself and as the neighbour of the columns on both sides. Columns are therefore swept abreast, a
//! tile of each after the other, so that the second and third reading come from the first cache and
//! the memory has several streams to fetch at once. Bodies within the caches are bound by arithmetic,
//! where wider vectors pay: see [`crate::flock::lanes`].

mod means;

use std::marker::PhantomData;
use std::ops::Range;

use super::rows::{Coefficients, Run};
use super::terms::Terms;
use crate::flock::lanes::{InLanes, in_lanes};
use crate::flock::real::Real;
use means::{Any, AsTheyAre, Equal, Matrix, Mean, Part, Scalar};

/// Runs swept abreast. Measured on 4096 squared: one alone is swept at seven tenths of the speed of
/// three, and eight, whose streams get into each other's way, at three quarters.
const ABREAST: usize = 3;

/// Most particles in the gaps of a run: they are set aside on the stack.
pub(super) const MOST_KEPT: usize = 64;

/// One coordinate of a body, or of a stretch of one, before and after the step.
#[derive(Debug)]
pub struct Component<'a, T> {
    /// Which: 0 is x.
    pub axis: usize,
    /// Coordinates before the step, those of particle number `seen_from` first.
    pub seen_from: usize,
    pub present: &'a [T],
    /// Rest offsets of the whole body.
    pub rest: Option<&'a [T]>,
    /// Loads on the whole body, where the rows are of a material.
    pub force: Option<&'a [T]>,
    /// Coordinates after the step, those of particle number `begin` first.
    pub begin: usize,
    pub next: &'a mut [T],
}

/// The tables from which the rows of all runs are made.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tables<'a> {
    /// Index distances.
    pub distances: &'a [isize],
    pub coefficients: &'a Coefficients,
    /// Particles in gaps, which keep what stands there.
    pub kept: &'a [u32],
}

/// Computes some coordinates of runs that all have the same number of neighbours, `tile` particles of each at a
/// time (a power of two).
pub(super) fn sweep<T: Real, const P: usize>(
    runs: &[Run],
    tables: Tables<'_>,
    tile: usize,
    components: &mut [Component<'_, T>; P],
    terms: &Terms<'_, T>,
) {
    if let Coefficients::Matrix(_) = tables.coefficients {
        let after = if terms.overshoots() { After::Overshoot(terms) } else { After::Nothing };
        return Work { runs, tables, tile, components, after }.dispatch::<Matrix>();
    }
    // One after the other: fewer streams at once.
    let single = |component: &mut Component<'_, T>, after: After<'_, T>| {
        Work { runs, tables, tile, components: std::array::from_mut(component), after }.means();
    };
    if let (Some(along), [x, y]) = (terms.couples_along(), &mut components[..]) {
        let (along, across) = if along == 0 { (x, y) } else { (y, x) };
        single(along, After::Nothing);
        single(across, After::Contract(terms, along.next, along.begin));
        if terms.overshoots() {
            let components = std::array::from_mut(along);
            Work { runs, tables, tile, components, after: After::Overshoot(terms) }.dispatch::<AsTheyAre>();
        }
        return;
    }
    for component in components {
        single(component, if terms.overshoots() { After::Overshoot(terms) } else { After::Nothing });
    }
}

struct Work<'a, 'b, T, const P: usize> {
    runs: &'a [Run],
    tables: Tables<'a>,
    tile: usize,
    components: &'a mut [Component<'b, T>; P],
    after: After<'a, T>,
}

/// The terms that complete means while they are in the first cache.
#[derive(Clone, Copy)]
enum After<'a, T> {
    Nothing,
    /// Feedback and damping.
    Overshoot(&'a Terms<'a, T>),
    /// All terms, with the means along the axis of the Poisson term, those of particle number so many first.
    Contract(&'a Terms<'a, T>, &'a [T], usize),
}

impl<'a, T: Real> After<'a, T> {
    /// The terms, where there are any.
    #[inline(always)]
    fn terms(self) -> &'a Terms<'a, T> {
        match self {
            After::Nothing => unreachable!("a loop that completes means has terms"),
            After::Overshoot(terms) | After::Contract(terms, ..) => terms,
        }
    }

    /// The means along the axis of the Poisson term, of so many particles.
    #[inline(always)]
    fn along(self, from: usize, len: usize) -> &'a [T] {
        match self {
            After::Contract(_, along, begin) => &along[from - begin..][..len],
            After::Nothing | After::Overshoot(_) => {
                unreachable!("a loop that contracts has means to look at")
            }
        }
    }
}

/// The terms that loops apply to means while these are in the registers: none, feedback, damping, both, or the
/// Poisson term.
const BARE: u8 = 0;
const FED: u8 = 1;
const DAMPED: u8 = 2;
const BOTH: u8 = 3;
const CONTRACTED: u8 = 4;

impl<T: Real, const P: usize> Work<'_, '_, T, P> {
    fn means(self) {
        // Loops of their own for each: one function for all is swept at four fifths of the speed.
        match self.after {
            After::Overshoot(terms) => match [terms.is_fed(), terms.is_damped()] {
                [true, false] => self.means_and::<FED>(),
                [false, _] => self.means_and::<DAMPED>(),
                [true, true] => self.means_and::<BOTH>(),
            },
            After::Contract(..) => self.means_and::<CONTRACTED>(),
            After::Nothing => match (self.tables.coefficients, self.neighbours()) {
                (Coefficients::Equal, 3) => self.dispatch::<Equal<3, BARE>>(),
                (Coefficients::Equal, 5) => self.dispatch::<Equal<5, BARE>>(),
                (Coefficients::Equal, 12) => self.dispatch::<Equal<12, BARE>>(),
                (Coefficients::Equal, 18) => self.dispatch::<Equal<18, BARE>>(),
                (Coefficients::Equal, 24) => self.dispatch::<Equal<24, BARE>>(),
                _ => self.means_and::<BARE>(),
            },
        }
    }

    /// Of the most common neighbourhoods: each loop takes its time to compile.
    fn means_and<const A: u8>(self) {
        match (self.tables.coefficients, self.neighbours()) {
            (Coefficients::Equal, 4) => self.dispatch::<Equal<4, A>>(),
            (Coefficients::Equal, 6) => self.dispatch::<Equal<6, A>>(),
            (Coefficients::Equal, 8) => self.dispatch::<Equal<8, A>>(),
            (Coefficients::Scalar(_), 4) => self.dispatch::<Scalar<4, A>>(),
            (Coefficients::Scalar(_), 6) => self.dispatch::<Scalar<6, A>>(),
            (Coefficients::Scalar(_), 8) => self.dispatch::<Scalar<8, A>>(),
            _ => self.dispatch::<Any>(),
        }
    }

    fn neighbours(&self) -> u32 {
        self.runs.first().map_or(0, |run| run.neighbours)
    }

    fn dispatch<M: Mean>(self) {
        in_lanes(Loops::<M, T, P>(self, PhantomData));
    }
}

/// A tile that no body reaches the end of, of a size that 32 bits hold too.
pub(super) const WHOLE: usize = 1 << (usize::BITS - 2);

struct Loops<'a, 'b, M, T, const P: usize>(Work<'a, 'b, T, P>, PhantomData<M>);

impl<M: Mean, T: Real, const P: usize> InLanes for Loops<'_, '_, M, T, P> {
    const BYTES: usize = size_of::<T>();
    const MULTIPLIES: bool = M::MULTIPLIES;

    #[inline(always)]
    fn run<const W: usize>(self) {
        let Work { runs, tables, tile, components, after } = self.0;
        for abreast in runs.chunks(ABREAST) {
            // Runs with gaps are those of small bodies, which a tile gains nothing.
            let tile = if abreast.iter().any(|run| run.gaps > 0) { WHOLE } else { tile };
            let (mut corner, mut more) = (0, true);
            while more {
                more = false;
                for run in abreast {
                    let (start, end) = (run.start as usize, (run.start + run.len) as usize);
                    // Tiles end at multiples of their size in the array, not in the run: whole
                    // cache lines.
                    let begin = (start & !(tile - 1)) + corner;
                    let (from, to) = (start.max(begin), end.min(begin + tile));
                    more |= to < end;
                    if from < to {
                        let kept = &tables.kept[run.kept as usize..][..run.gaps as usize];
                        let aside = (!kept.is_empty()).then(|| set_aside(kept, from..to, components));
                        fill_part::<M, T, P, W>(Part { run, tables, from, to, components, after });
                        if let Some(aside) = aside {
                            put_back(kept, from..to, &aside, components);
                        }
                    }
                }
                corner += tile;
            }
        }
    }
}

/// The values in the gaps of a part.
fn set_aside<T: Real, const P: usize>(
    kept: &[u32],
    part: Range<usize>,
    components: &[Component<'_, T>; P],
) -> [[T; MOST_KEPT]; P] {
    let mut aside = [[T::default(); MOST_KEPT]; P];
    for (aside, component) in aside.iter_mut().zip(components) {
        for (aside, &j) in aside.iter_mut().zip(kept).filter(|(_, j)| part.contains(&(**j as usize))) {
            *aside = component.next[j as usize - component.begin];
        }
    }
    aside
}

/// Undoes what a sweep did to gaps.
fn put_back<T: Real, const P: usize>(
    kept: &[u32],
    part: Range<usize>,
    aside: &[[T; MOST_KEPT]; P],
    components: &mut [Component<'_, T>; P],
) {
    for (aside, component) in aside.iter().zip(components) {
        for (&aside, &j) in aside.iter().zip(kept).filter(|(_, j)| part.contains(&(**j as usize))) {
            component.next[j as usize - component.begin] = aside;
        }
    }
}

#[inline(always)]
fn fill_part<M: Mean, T: Real, const P: usize, const W: usize>(mut part: Part<'_, '_, T, P>) {
    M::fill::<T, P, W>(&mut part);
    let (from, to) = (part.from, part.to);
    let (terms, along) = match part.after {
        After::Nothing => return,
        After::Overshoot(_) if M::COMPLETES => return,
        After::Overshoot(terms) => (terms, None),
        After::Contract(terms, along, begin) => (terms, Some(&along[from - begin..])),
    };
    for component in part.components {
        let target = &mut component.next[from - component.begin..to - component.begin];
        if let Some(along) = along.filter(|_| !M::COMPLETES) {
            terms.contract(from, along, target);
        }
        terms.overshoot(component.axis, from, &component.present[from - component.seen_from..], target);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Swept by vectors of a width.
    fn swept<M: Mean, const W: usize>(runs: &[Run], tables: Tables<'_>, present: &[f64]) -> [Vec<f64>; 2] {
        let mut next = [vec![0.0; 1000], vec![0.0; 1000]];
        let (rest, mut axis) = (Some(present), 0..);
        let mut components = next.each_mut().map(|next| {
            let axis = axis.next().unwrap_or_default();
            Component { axis, seen_from: 0, present, rest, force: rest, begin: 0, next }
        });
        let components = &mut components;
        let work = Work { runs, tables, tile: 64, components, after: After::Nothing };
        Loops::<M, f64, 2>(work, PhantomData).run::<W>();
        next
    }

    #[test]
    fn the_width_of_the_vectors_and_loops_for_any_number_of_neighbours_change_no_bit() {
        let present: Vec<f64> = (0..1000).map(|i| f64::from(i * i % 991) / 7.0 - 50.0).collect();
        let distances = &[-30, 2, 1, -1, 30, 7];
        let weights = [0.3, -0.2, 1.5, 0.7, 1e-3, 2.0];
        let total = weights.iter().fold(0.0, |sum, w| sum + w);
        let scalar = Coefficients::Scalar(weights.into_iter().chain([total]).collect());
        let matrix = Coefficients::Matrix((0..28).map(|k| f64::from(k).sin()).collect());
        for len in [1, 2, 3, 4, 5, 7, 61, 300] {
            let runs = [Run { start: 37, len, distances: 0, neighbours: 6, rests: true, ..Run::default() }];
            let tables = |coefficients| Tables { distances, coefficients, kept: &[] };
            let equal = tables(&Coefficients::Equal);
            let all = |results: &[[Vec<f64>; 2]]| {
                assert!(results.iter().all(|result| *result == results[0]), "{len} particles");
                assert_eq!(results[0][1].iter().filter(|&&value| value != 0.0).count(), len as usize);
            };
            all(&[
                swept::<Equal<6, BARE>, 1>(&runs, equal, &present),
                swept::<Equal<6, BARE>, 2>(&runs, equal, &present),
                swept::<Equal<6, BARE>, 4>(&runs, equal, &present),
                swept::<Equal<6, BARE>, 8>(&runs, equal, &present),
                swept::<Any, 4>(&runs, equal, &present),
            ]);
            let scalar = tables(&scalar);
            all(&[
                swept::<Scalar<6, BARE>, 1>(&runs, scalar, &present),
                swept::<Scalar<6, BARE>, 4>(&runs, scalar, &present),
                swept::<Any, 8>(&runs, scalar, &present),
            ]);
            let matrix = tables(&matrix);
            all(&[
                swept::<Matrix, 1>(&runs, matrix, &present),
                swept::<Matrix, 8>(&runs, matrix, &present),
                swept::<Matrix, 16>(&runs, matrix, &present),
            ]);
        }
    }

    #[test]
    fn what_stands_in_a_gap_stays_there() {
        let present: Vec<f32> = (0..100).map(|i| i as f32).collect();
        let runs = [Run { start: 10, len: 60, neighbours: 3, kept: 1, gaps: 2, ..Run::default() }];
        let mut next = vec![-1.0; 70];
        let component = Component {
            axis: 0,
            seen_from: 0,
            present: &present,
            rest: None,
            force: None,
            begin: 5,
            next: &mut next,
        };
        let tables =
            Tables { distances: &[-3, 2, 4], coefficients: &Coefficients::Equal, kept: &[99, 30, 31] };
        sweep(&runs, tables, 64, &mut [component], &Terms::NONE);
        for (at, value) in (5..).zip(next) {
            let swept = (10..70).contains(&at) && at != 30 && at != 31;
            assert_eq!(value, if swept { at as f32 + 1.0 } else { -1.0 }, "{at}");
        }
    }
}
