//! How far a body moved in a step, and how far it is from where it began.

use std::ops::Range;

use rayon::prelude::*;

use crate::flock::vectors::{Vectors, distance};

/// The largest distances of a step over the lattice's spacing \[1\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Movement {
    /// Largest one-step motion.
    pub largest_move: f64,
    /// Largest distance from the reference place.
    pub largest_displacement: f64,
    /// Whether every position is finite.
    pub is_finite: bool,
}

/// Particles per piece of work; the largest of all does not depend on how they are shared out.
const PIECE: usize = 1 << 14;

/// Independent maxima side by side, so that the loop vectorises.
const LANES: usize = 8;

impl Movement {
    /// Looks over a step from `previous` to `present`.
    pub fn of(present: &Vectors, previous: &Vectors, reference: &Vectors, spacing: f64) -> Self {
        Self::among(0..present.len(), [present, previous, reference], spacing, |own| own)
    }

    /// Looks over a step, from the second to the first, of a part of a body; `largest` finds the largest of the numbers of
    /// all parts.
    pub fn among(
        part: Range<usize>,
        all: [&Vectors; 3],
        spacing: f64,
        largest: impl Fn([f64; 3]) -> [f64; 3],
    ) -> Self {
        let pieces = part.len().div_ceil(PIECE);
        let one = |piece: usize| {
            let begin = part.start + piece * PIECE;
            Squares::of(all, begin..(begin + PIECE).min(part.end), spacing.recip())
        };
        let squares = if pieces > 4 {
            (0..pieces).into_par_iter().map(one).reduce(Squares::default, Squares::or)
        } else {
            (0..pieces).map(one).fold(Squares::default(), Squares::or)
        };
        let is_poisoned = f64::from(u8::from(squares.poison != 0.0));
        let [moved, displaced, is_poisoned] = largest([squares.moved, squares.displaced, is_poisoned]);
        if is_poisoned == 0.0 {
            return Self {
                largest_move: moved.sqrt(),
                largest_displacement: displaced.sqrt(),
                is_finite: true,
            };
        }
        let [largest_move, largest_displacement, is_lost] = largest(exactly(part, all, spacing));
        Self { largest_move, largest_displacement, is_finite: is_lost == 0.0 }
    }
}

/// Largest motion and displacement over the spacing, and 1 where a position is not finite, for positions that are lost or so
/// far away that a square overflows.
fn exactly(part: Range<usize>, [present, previous, reference]: [&Vectors; 3], spacing: f64) -> [f64; 3] {
    let largest = |from: &Vectors| {
        part.clone().map(|i| distance(present.get(i), from.get(i)) / spacing).fold(0.0, f64::max)
    };
    let is_lost = part.clone().any(|i| !present.get(i).iter().all(|place| place.is_finite()));
    [largest(previous), largest(reference), f64::from(u8::from(is_lost))]
}

/// Index of the first of these particles whose position is not finite.
pub(crate) fn first_lost(present: &Vectors, mut among: Range<usize>) -> Option<usize> {
    among.find(|&i| !present.get(i).iter().all(|place| place.is_finite()))
}

/// Index of the one of these particles that is farthest from its reference place, the first of several.
pub fn farthest(present: &Vectors, reference: &Vectors, among: Range<usize>) -> Option<usize> {
    let from_reference = |i: usize| distance(present.get(i), reference.get(i));
    let farther = |best: usize, i: usize| if from_reference(i) > from_reference(best) { i } else { best };
    among.reduce(farther)
}

/// Largest squared distances over the squared spacing; `poison` is not 0 where one is not finite.
#[derive(Clone, Copy, Default)]
struct Squares {
    moved: f64,
    displaced: f64,
    poison: f64,
}

impl Squares {
    fn or(self, other: Self) -> Self {
        Self {
            moved: self.moved.max(other.moved),
            displaced: self.displaced.max(other.displaced),
            // Not a number once it ever was.
            poison: self.poison + other.poison,
        }
    }

    fn of([present, previous, reference]: [&Vectors; 3], piece: Range<usize>, scale: f64) -> Self {
        let [x, y] = [&present.x[piece.clone()], &present.y[piece.clone()]];
        let [px, py] = [&previous.x[piece.clone()], &previous.y[piece.clone()]];
        let [rx, ry] = [&reference.x[piece.clone()], &reference.y[piece]];
        let mut lanes = [Squares::default(); LANES];
        let whole = x.len() - x.len() % LANES;
        for i in (0..whole).step_by(LANES) {
            for (lane, squares) in lanes.iter_mut().enumerate() {
                let k = i + lane;
                squares.see([x[k] - px[k], y[k] - py[k]], [x[k] - rx[k], y[k] - ry[k]], scale);
            }
        }
        for k in whole..x.len() {
            lanes[0].see([x[k] - px[k], y[k] - py[k]], [x[k] - rx[k], y[k] - ry[k]], scale);
        }
        lanes.into_iter().fold(Squares::default(), Squares::or)
    }

    fn see(&mut self, step: [f64; 2], displacement: [f64; 2], scale: f64) {
        let square = |[x, y]: [f64; 2]| (x * scale) * (x * scale) + (y * scale) * (y * scale);
        let (moved, displaced) = (square(step), square(displacement));
        self.moved = if moved > self.moved { moved } else { self.moved };
        self.displaced = if displaced > self.displaced { displaced } else { self.displaced };
        self.poison += 0.0 * displaced;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(count: usize) -> Vectors {
        (0..count).map(|i| [i as f64, 0.0]).collect()
    }

    #[test]
    fn the_largest_of_all_is_found_wherever_it_stands() {
        let reference = line(100_003);
        for at in [0, 7, PIECE, 70_000, 100_002] {
            let (mut previous, mut present) = (reference.clone(), reference.clone());
            previous.x[at] += 1.0;
            present.x[at] += 1.0;
            present.y[at] += 3.0;
            let movement = Movement::of(&present, &previous, &reference, 2.0);
            assert_eq!(movement.largest_move, 1.5, "at {at}");
            assert!((movement.largest_displacement - 10f64.sqrt() / 2.0).abs() < 1e-15, "at {at}");
            assert_eq!(farthest(&present, &reference, 0..reference.len()), Some(at));
        }
    }

    #[test]
    fn a_lost_particle_is_noticed_and_named() {
        for value in [f64::NAN, f64::INFINITY] {
            let reference = line(50_000);
            let mut present = reference.clone();
            present.y[33_333] = value;
            assert!(!Movement::of(&present, &reference, &reference, 1.0).is_finite);
            assert_eq!(first_lost(&present, 0..present.len()), Some(33_333));
        }
    }

    #[test]
    fn distances_whose_squares_overflow_or_vanish_are_still_reported() {
        for scale in [1e200, 1e-200] {
            let reference: Vectors = line(9).iter().map(|[x, y]| [x * scale, y]).collect();
            let mut present = reference.clone();
            present.y[4] = 3.0 * scale;
            let movement = Movement::of(&present, &reference, &reference, scale);
            assert!((movement.largest_move - 3.0).abs() < 1e-12 && movement.is_finite, "{movement:?}");
        }
        let (reference, mut present) = (line(9), line(9));
        present.x[2] = 1e300;
        let movement = Movement::of(&present, &reference, &reference, 1.0);
        assert!(movement.is_finite && (movement.largest_move / 1e300 - 1.0).abs() < 1e-12);
    }
}
