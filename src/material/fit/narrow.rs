//! Whether a shape is everywhere as wide as the lattice is fine.

use super::FitError;
use super::near::{Buckets, meetings};
use crate::geometry::outline::Outline;

/// Looks across the shape from places half a spacing apart along its outline.
///
/// # Errors
/// The first place where the opposite side is nearer than the spacing.
pub fn require_wide(outline: &Outline, buckets: &Buckets, spacing: f64) -> Result<(), FitError> {
    for (ring, number, piece) in outline.pieces() {
        let count = (2.0 * piece.length() / spacing).ceil().clamp(1.0, 1e8) as usize;
        let pieces = outline.rings()[ring].len();
        let beside = [number, (number + 1) % pieces, (number + pieces - 1) % pieces];
        for t in (0..count).map(|k| (k as f64 + 0.5) / count as f64) {
            let (place, normal) = (piece.point(t), piece.normal(t));
            let across = [0, 1].map(|k| place[k] - spacing * normal[k]);
            for [other_ring, other] in buckets.around(place, across, 0.0) {
                // What meets at a corner is as narrow as the corner is sharp.
                let is_beside = other_ring == ring && beside.contains(&other);
                if is_beside && (other != number || piece.arc.is_none()) {
                    continue;
                }
                let opposite = meetings(place, across, outline.piece(other_ring, other));
                let opposite = opposite.into_iter().map(|[s, _]| s).filter(|s| *s > 1e-6 && *s < 1.0 - 1e-6);
                if let Some(share) = opposite.reduce(f64::min) {
                    return Err(FitError::Narrow { width: share * spacing, spacing, place });
                }
            }
        }
    }
    Ok(())
}
