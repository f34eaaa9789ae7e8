//! Outlines that cross or touch themselves: found by the chords of their pieces.

use super::box_tree::BoxTree;
use super::outline::OutlineError;
use super::piece::Piece;
use super::point::{Point, bounds, cross, distance, dot, minus};

/// A straight part of the outline, where it is tested for crossings.
#[derive(Clone, Copy, Debug)]
struct Chord {
    ends: [Point; 2],
    ring: usize,
    /// Its number in its loop.
    number: usize,
    low: Point,
    high: Point,
}

/// Comparisons of two chords that are made at most: some tenths of a second.
const MOST_PAIRS: usize = 10_000_000;

/// Refuses loops of which two chords come nearer than `near` \[length\] and are not neighbours.
pub(super) fn check(rings: &[Vec<Piece>], near: f64) -> Result<(), OutlineError> {
    let chords = chords(rings);
    let tree = BoxTree::new(chords.iter().map(|chord| (chord.low, chord.high)));
    // Twice as far as what is too near: sums are rounded.
    let reach = 2.0 * near;
    check_pairs(&chords, near, |chord| {
        tree.overlapping(chord.low.map(|v| v - reach), chord.high.map(|v| v + reach))
    })
}

/// The chords of all pieces, from left to right.
fn chords(rings: &[Vec<Piece>]) -> Vec<Chord> {
    let mut chords = Vec::new();
    for (ring, pieces) in rings.iter().enumerate() {
        for (number, ends) in pieces.iter().flat_map(Piece::chords).enumerate() {
            let (low, high) = bounds(ends);
            chords.push(Chord { ends, ring, number, low, high });
        }
    }
    chords.sort_by(|a, b| a.low[0].total_cmp(&b.low[0]));
    chords
}

/// Compares each chord with those around it, in their order: of many crossings the leftmost is named. `around` names
/// at least the chords whose boxes are as near as the chord's own.
fn check_pairs<I: Iterator<Item = usize>>(
    chords: &[Chord],
    near: f64,
    around: impl Fn(&Chord) -> I,
) -> Result<(), OutlineError> {
    let mut counts = vec![0; chords.iter().map(|chord| chord.ring + 1).max().unwrap_or(0)];
    chords.iter().for_each(|chord| counts[chord.ring] += 1);
    let mut ahead: Vec<usize> = Vec::new();
    let mut compared = 0;
    for (k, a) in chords.iter().enumerate() {
        ahead.clear();
        ahead.extend(around(a).filter(|&other| other > k));
        compared += ahead.len();
        if compared > MOST_PAIRS {
            return Err(OutlineError::TooDense { count: chords.len() });
        }
        ahead.sort_unstable();
        let ahead = ahead.iter().map(|&other| &chords[other]);
        let is_near = |b: &&Chord| {
            let within =
                |axis: usize| b.low[axis] <= a.high[axis] + near && a.low[axis] <= b.high[axis] + near;
            within(0) && within(1)
        };
        for b in ahead.filter(is_near) {
            let Some(place) = meeting(a.ends, b.ends, near) else { continue };
            if a.ring != b.ring {
                let rings = [a.ring.min(b.ring), a.ring.max(b.ring)];
                return Err(OutlineError::Touching { rings, place });
            }
            let (apart, count) = (a.number.abs_diff(b.number), counts[a.ring]);
            if apart > 1 && apart + 1 < count || folds_back(a.ends, b.ends, near) {
                return Err(OutlineError::SelfCrossing { ring: a.ring, place });
            }
        }
    }
    Ok(())
}

/// Where two chords cross or come nearer than `near` \[length\].
fn meeting(a: [Point; 2], b: [Point; 2], near: f64) -> Option<Point> {
    // Most chords that are compared are beside each other: all of one lies to one side of the other.
    let is_beside = |[from, to]: [Point; 2], other: [Point; 2]| {
        let along = minus(to, from);
        // Twice as far as what is too near: sums are rounded.
        let reach = 4.0 * near * near * dot(along, along);
        let [one, two] = other.map(|p| cross(along, minus(p, from)));
        one * two > 0.0 && (one * one).min(two * two) > reach
    };
    if is_beside(a, b) || is_beside(b, a) {
        return None;
    }
    let [along, other] = [a, b].map(|[from, to]| minus(to, from));
    let off = minus(b[0], a[0]);
    let turn = cross(along, other);
    if turn != 0.0 {
        let (s, t) = (cross(off, other) / turn, cross(off, along) / turn);
        if (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
            return Some([0, 1].map(|k| a[0][k] + s * along[k]));
        }
    }
    let touch = |p: Point, [from, to]: [Point; 2]| {
        let edge = Piece::edge(from, to);
        let is_near = from != to && distance(edge.point(edge.nearest(p)), p) <= near;
        is_near.then_some(p)
    };
    touch(a[0], b).or_else(|| touch(a[1], b)).or_else(|| touch(b[0], a)).or_else(|| touch(b[1], a))
}

/// Whether two chords that share an end lie on each other.
fn folds_back(a: [Point; 2], b: [Point; 2], near: f64) -> bool {
    let reaches = |p: Point, [from, to]: [Point; 2]| {
        let edge = Piece::edge(from, to);
        let t = edge.nearest(p);
        let at = edge.point(t);
        distance(at, p) <= near && distance(at, from) > near && distance(at, to) > near
    };
    a.iter().any(|&p| reaches(p, b)) || b.iter().any(|&p| reaches(p, a))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::geometry::box_tree::tests::chance;
    use crate::geometry::outline::edges;
    use crate::geometry::piece::reversed;

    #[test]
    fn the_crossing_that_is_named_is_the_one_that_a_look_at_every_pair_finds() {
        let mut next = chance(1);
        let mut verdicts = [0; 3];
        for round in 0..600 {
            // Stars about the middle of a square do not cross themselves, and do not touch it but where one of their
            // arms is that long; of some, one corner lies elsewhere, of others all lie on a raster.
            let count = 5 + round % 60;
            let mut star: Vec<Point> = (0..count)
                .map(|k| {
                    let (sin, cos) = (TAU * k as f64 / count as f64).sin_cos();
                    let length = 1.0 + 3.0 * next();
                    [length * cos, length * sin]
                })
                .collect();
            match round % 6 {
                1 => star[0] = [10.0 * next() - 5.0, 10.0 * next() - 5.0],
                2 => star[0] = [5.0, 0.0],
                3 => star[2] = star[0],
                4 => star.iter_mut().for_each(|p| *p = p.map(f64::round)),
                5 => star[3] = [0, 1].map(|k| 0.5 * (star[0][k] + star[1][k])),
                _ => {}
            }
            let square = [[-5.0, -5.0], [5.0, -5.0], [5.0, 5.0], [-5.0, 5.0]];
            let rings = [edges(&square), reversed(&edges(&star))];
            let (chords, near) = (chords(&rings), 1e-8);
            let plain = check_pairs(&chords, near, |_| 0..chords.len());
            assert_eq!(check(&rings, near), plain, "{star:?}");
            verdicts[match plain {
                Ok(()) => 0,
                Err(OutlineError::Touching { .. }) => 1,
                Err(_) => 2,
            }] += 1;
        }
        assert!(verdicts.iter().all(|&count| count > 50), "of each kind some: {verdicts:?}");
    }
}
