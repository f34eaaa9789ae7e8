//! Whether a shape is everywhere as wide as the lattice is fine.

use std::f64::consts::TAU;

use super::near::NearPieces;
use super::{FitError, Part, ROUNDING};
use crate::flock::vectors::distance;
use crate::geometry::meeting::{meetings, on};
use crate::geometry::partition::Partition;
use crate::geometry::piece::{Arc, Piece};
use crate::geometry::point::{bounds, dot};

/// Looks across the shape, and across its regions, from places half a spacing apart along the outline and the lines inside.
///
/// # Errors
/// A hole smaller than the spacing; the first place where the opposite side is nearer than that.
pub fn require_wide(outline: &Partition, near: &NearPieces, spacing: f64) -> Result<(), FitError> {
    for hole in 1..outline.outline().rings().len() {
        let pieces = outline.ring(hole);
        let (low, high) = bounds(pieces.iter().map(Piece::bounds).flat_map(|(low, high)| [low, high]));
        let width = (high[0] - low[0]).max(high[1] - low[1]);
        if width < spacing {
            return Err(FitError::SmallHole { hole, width, spacing, place: pieces[0].from });
        }
    }
    let sides = Sides::new(outline, ROUNDING * spacing);
    for (ring, number, piece) in outline.pieces() {
        let count = (2.0 * piece.length() / spacing).ceil().clamp(1.0, 1e8) as usize;
        let ways: &[f64] = if outline.is_bounding(ring) { &[-1.0] } else { &[-1.0, 1.0] };
        for t in (0..count).map(|k| (k as f64 + 0.5) / count as f64) {
            let (place, normal) = (piece.point(t), piece.normal(t));
            for across in ways.iter().map(|side| [0, 1].map(|k| place[k] + side * spacing * normal[k])) {
                for [other_ring, other] in near.around(place, across) {
                    if sides.are_at_a_corner([ring, number], [other_ring, other]) {
                        continue;
                    }
                    let other = outline.piece(other_ring, other);
                    let opposite = meetings(place, across, other).into_iter().map(|[s, _]| s);
                    let opposite = opposite.filter(|s| *s > 1e-6 && *s < 1.0 - 1e-6);
                    if let Some(share) = opposite.reduce(f64::min) {
                        let part = Part::of(outline, ring).max(Part::of(outline, other_ring));
                        return Err(FitError::Narrow { width: share * spacing, spacing, place, part });
                    }
                }
            }
        }
    }
    Ok(())
}

/// The sides of an outline and of the lines inside: pieces that go on along one line or circle are one, however it was cut.
struct Sides {
    sides: Vec<Piece>,
    /// By ring and piece, its side.
    of: Vec<Vec<usize>>,
    near: f64,
}

impl Sides {
    fn new(outline: &Partition, near: f64) -> Self {
        let (mut sides, mut of) = (Vec::new(), Vec::new());
        for (ring, pieces) in outline.rings().enumerate() {
            let first = sides.len();
            let mut numbers = Vec::with_capacity(pieces.len());
            for piece in pieces {
                match sides.get_mut(first..).and_then(<[Piece]>::last_mut) {
                    Some(side) if let Some(both) = joined(side, piece, near) => *side = both,
                    _ => sides.push(*piece),
                }
                numbers.push(sides.len() - 1);
            }
            // The last one may go on as the first.
            let last = sides.len() - 1;
            if last > first
                && outline.is_closed(ring)
                && let Some(both) = joined(&sides[last], &sides[first], near)
            {
                sides[first] = both;
                sides.pop();
                numbers.iter_mut().filter(|number| **number == last).for_each(|number| *number = first);
            }
            of.push(numbers);
        }
        Self { sides, of, near }
    }

    /// Whether two pieces belong to one straight side, or to two that meet at a corner: those are as narrow as it is sharp.
    fn are_at_a_corner(&self, [ring, piece]: [usize; 2], [other_ring, other]: [usize; 2]) -> bool {
        let [a, b] = [self.of[ring][piece], self.of[other_ring][other]];
        let [one, two] = [a, b].map(|side| &self.sides[side]);
        if are_of_one_circle(one, two, self.near) {
            return false;
        }
        let ends_on =
            |a: &Piece, b: &Piece| [a.from, a.to].into_iter().any(|end| on(b, end, self.near).is_some());
        a == b || ends_on(one, two) || ends_on(two, one)
    }
}

/// Both as one piece, where the second goes on along the line or circle of the first.
fn joined(first: &Piece, second: &Piece, near: f64) -> Option<Piece> {
    let [before, after] = [first.tangent(1.0), second.tangent(0.0)];
    if distance(first.to, second.from) > near || dot(before, after) <= 0.0 {
        return None;
    }
    match (first.arc, second.arc) {
        (None, None) => {
            let both = Piece { to: second.to, ..*first };
            on(&both, second.from, near).map(|_| both)
        }
        (Some(arc), Some(more)) if are_of_one_circle(first, second, near) => {
            let sweep = (arc.sweep + more.sweep).clamp(-TAU, TAU);
            Some(Piece { to: second.to, arc: Some(Arc { sweep, ..arc }), ..*first })
        }
        _ => None,
    }
}

fn are_of_one_circle(a: &Piece, b: &Piece, near: f64) -> bool {
    let (Some(a), Some(b)) = (a.arc, b.arc) else { return false };
    distance(a.centre, b.centre) < near && (a.radius - b.radius).abs() < near
}
