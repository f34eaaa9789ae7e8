//! Whether a shape is everywhere as wide as the lattice is fine.

use super::near::NearPieces;
use super::{FitError, Part, ROUNDING};
use crate::flock::vectors::distance;
use crate::geometry::meeting::meetings;
use crate::geometry::partition::Partition;
use crate::geometry::piece::Piece;
use crate::geometry::point::bounds;

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
    for (ring, number, piece) in outline.pieces() {
        let count = (2.0 * piece.length() / spacing).ceil().clamp(1.0, 1e8) as usize;
        // Pieces that meet at a corner are as narrow as the corner is sharp.
        let ends = ends(outline.ring(ring), piece, ROUNDING * spacing);
        let is_beside = |other: &Piece| touches(&ends, other, ROUNDING * spacing);
        let sides: &[f64] = if outline.is_bounding(ring) { &[-1.0] } else { &[-1.0, 1.0] };
        for t in (0..count).map(|k| (k as f64 + 0.5) / count as f64) {
            let (place, normal) = (piece.point(t), piece.normal(t));
            for across in sides.iter().map(|side| [0, 1].map(|k| place[k] + side * spacing * normal[k])) {
                for [other_ring, other] in near.around(place, across) {
                    let is_same = [other_ring, other] == [ring, number];
                    let other = outline.piece(other_ring, other);
                    let is_round = are_of_one_circle(piece, other, ROUNDING * spacing);
                    if !is_round && (is_same || is_beside(other)) {
                        continue;
                    }
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

/// Ends of a piece and, on both sides of it, of those that go on along its circle.
fn ends(ring: &[Piece], piece: &Piece, near: f64) -> Vec<[f64; 2]> {
    let mut ends = vec![piece.from, piece.to];
    let mut others: Vec<&Piece> = ring.iter().filter(|other| are_of_one_circle(piece, other, near)).collect();
    while let Some(next) = others.iter().position(|other| touches(&ends, other, near)) {
        let next = others.swap_remove(next);
        ends.extend([next.from, next.to]);
    }
    ends
}

fn touches(ends: &[[f64; 2]], other: &Piece, near: f64) -> bool {
    ends.iter().any(|&end| distance(end, other.from) < near || distance(end, other.to) < near)
}

fn are_of_one_circle(a: &Piece, b: &Piece, near: f64) -> bool {
    let (Some(a), Some(b)) = (a.arc, b.arc) else { return false };
    distance(a.centre, b.centre) < near && (a.radius - b.radius).abs() < near
}
