//! Which pieces of an outline and of the lines inside are near: a grid of buckets.

use std::collections::HashMap;

use crate::geometry::outline::Piece;
use crate::geometry::partition::Partition;

/// Pieces by the buckets that they pass.
#[derive(Debug)]
pub struct Buckets {
    /// Side of a bucket \[length\].
    side: f64,
    origin: [f64; 2],
    pieces: HashMap<[i32; 2], Vec<[usize; 2]>>,
}

/// Parts of a piece, each about as long as `length`: lowest and highest coordinates \[length\].
pub fn stretches(piece: &Piece, length: f64) -> impl Iterator<Item = ([f64; 2], [f64; 2])> + '_ {
    let whole = piece.length();
    let count = (whole / length).ceil().clamp(1.0, 1e8) as usize;
    // An arc leaves the box of its ends by no more than half of its length.
    let bulge = if piece.arc.is_some() { 0.5 * whole / count as f64 } else { 0.0 };
    (0..count).map(move |k| {
        let ends = [k, k + 1].map(|k| piece.point(k as f64 / count as f64));
        let low = [0, 1].map(|axis| ends[0][axis].min(ends[1][axis]) - bulge);
        (low, [0, 1].map(|axis| ends[0][axis].max(ends[1][axis]) + bulge))
    })
}

impl Buckets {
    /// Buckets of this side \[length\].
    pub fn new(outline: &Partition, side: f64) -> Self {
        let mut buckets = Self { side, origin: outline.outline().bounds().0, pieces: HashMap::new() };
        for (ring, number, piece) in outline.pieces() {
            for (low, high) in stretches(piece, side) {
                let [from, to] = [low, high].map(|p| buckets.bucket(p));
                for bucket in (from[0]..=to[0]).flat_map(|i| (from[1]..=to[1]).map(move |j| [i, j])) {
                    let known = buckets.pieces.entry(bucket).or_default();
                    if known.last() != Some(&[ring, number]) {
                        known.push([ring, number]);
                    }
                }
            }
        }
        buckets
    }

    fn bucket(&self, p: [f64; 2]) -> [i32; 2] {
        [0, 1].map(|k| ((p[k] - self.origin[k]) / self.side).floor() as i32)
    }

    /// Numbers of loop and piece of all pieces that may pass the box between two points, ascending.
    pub fn around(&self, a: [f64; 2], b: [f64; 2], margin: f64) -> Vec<[usize; 2]> {
        let from = self.bucket([0, 1].map(|k| a[k].min(b[k]) - margin));
        let to = self.bucket([0, 1].map(|k| a[k].max(b[k]) + margin));
        let all = (from[0]..=to[0]).flat_map(|i| (from[1]..=to[1]).map(move |j| [i, j]));
        let mut found: Vec<_> =
            all.filter_map(|bucket| self.pieces.get(&bucket)).flatten().copied().collect();
        found.sort_unstable();
        found.dedup();
        found
    }
}
