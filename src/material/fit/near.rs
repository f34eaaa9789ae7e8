//! Which pieces of an outline and of the lines inside are near.

use crate::geometry::box_tree::BoxTree;
use crate::geometry::locate::tree_of;
use crate::geometry::partition::Partition;
use crate::geometry::piece::Piece;

/// The part of a cell's diameter by which boxes are widened: lines that are parallel but for rounding meet where a ten
/// thousandth of their distance is lost.
const MARGIN: f64 = 1e-3;

/// Pieces sorted by where they are.
#[derive(Debug)]
pub struct NearPieces {
    tree: BoxTree,
    /// Loop and number of each piece of the tree, ascending.
    numbers: Vec<[usize; 2]>,
    /// \[length\]
    margin: f64,
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

impl NearPieces {
    /// Pieces among cells of this diameter \[length\].
    pub fn new(outline: &Partition, diameter: f64) -> Self {
        Self {
            tree: tree_of(outline.pieces().map(|(.., piece)| piece)),
            numbers: outline.pieces().map(|(ring, number, _)| [ring, number]).collect(),
            margin: MARGIN * diameter,
        }
    }

    /// Numbers of loop and piece of all pieces that may pass the box between two points, ascending.
    pub fn around(&self, a: [f64; 2], b: [f64; 2]) -> impl Iterator<Item = [usize; 2]> + '_ {
        let low = [0, 1].map(|k| a[k].min(b[k]) - self.margin);
        let high = [0, 1].map(|k| a[k].max(b[k]) + self.margin);
        let mut found: Vec<usize> = self.tree.overlapping(low, high).collect();
        found.sort_unstable();
        found.into_iter().map(|k| self.numbers[k])
    }
}
