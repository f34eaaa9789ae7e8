//! How large the cells of a mesh shall be at each place of its curves.
//!
//! Away from everything cells have one size; along arcs they turn by a bounded angle; a short stretch has short
//! cells, and so has what lies beside it; towards a singular point the size goes with a power of the distance, so
//! that the singularity's error falls as fast as that of the rest (G. Raugel, C. R. Acad. Sci. Paris A 286 (1978)
//! 791; I. Babuska, Computing 6 (1970) 264).

use std::f64::consts::TAU;

use super::curves::{Curves, Span};
use crate::geometry::piece::Piece;
use crate::geometry::point::{Point, distance};

/// Growth of the size with the distance from something small.
pub(crate) const GROWTH: f64 = 0.4;
/// Angle of an arc that one cell covers at most \[rad\].
const TURN: f64 = TAU / 16.0;
/// Size over distance close to a singular point.
const STEEPEST: f64 = 0.8;
/// Smallest cell at a singular point over the reach of the singularity, where that is a quarter of the body.
const DEEPEST: f64 = 3e-4;

/// The size function of a body's curves.
pub(crate) struct Sizes<'c> {
    curves: &'c Curves,
    most: f64,
    /// Of each span, how large the cells along it may be \[m\].
    of_span: Vec<f64>,
    singular: Vec<Singular>,
}

struct Singular {
    at: Point,
    reach: f64,
    grading: f64,
    /// At the reach, and at the point itself \[m\].
    far: f64,
    near: f64,
}

impl<'c> Sizes<'c> {
    /// Cells of at most size `most` \[m\].
    pub fn new(curves: &'c Curves, most: f64) -> Self {
        let of_span = |span: &Span| {
            let piece = &curves.curves[span.curve].piece;
            let length = (span.t[1] - span.t[0]) * piece.length();
            let bent = piece.arc.map_or(f64::INFINITY, |arc| TURN * arc.radius);
            most.min(bent).min(length)
        };
        let of_span: Vec<f64> = curves.spans.iter().map(of_span).collect();
        let mut sizes = Sizes { curves, most, of_span, singular: Vec::new() };
        sizes.singular = (0..curves.junctions.len()).filter_map(|k| sizes.singular(k)).collect();
        sizes
    }

    fn singular(&self, junction: usize) -> Option<Singular> {
        let own = &self.curves.junctions[junction];
        if own.grading <= 0.0 {
            return None;
        }
        let others = self.curves.junctions.iter().enumerate().filter(|&(k, _)| k != junction);
        let apart = others.map(|(_, other)| distance(other.at, own.at)).fold(f64::INFINITY, f64::min);
        let foreign = self.curves.spans.iter().filter(|span| !span.ends.contains(&junction));
        let near_span = foreign.map(|span| self.distance(span, own.at)).fold(f64::INFINITY, f64::min);
        let reach = (0.5 * apart.min(near_span)).min(4.0 * self.most).min(self.curves.size);
        let far = self.smooth(own.at).min(0.5 * reach);
        let share = DEEPEST * (0.25 * self.curves.size / reach).powi(2);
        let near = reach * share.clamp(DEEPEST, 0.1);
        Some(Singular { at: own.at, reach, grading: own.grading, far, near })
    }

    fn distance(&self, span: &Span, p: Point) -> f64 {
        let piece = &self.curves.curves[span.curve].piece;
        let t = piece.nearest(p);
        if span.t[0] <= t && t <= span.t[1] {
            return distance(piece.point(t), p);
        }
        let ends = span.t.map(|t| distance(piece.point(t), p));
        ends[0].min(ends[1])
    }

    /// Without regard to singular points.
    fn smooth(&self, p: Point) -> f64 {
        let spans = self.curves.spans.iter().zip(&self.of_span).filter(|(_, size)| **size < self.most);
        spans.map(|(span, size)| size + GROWTH * self.distance(span, p)).fold(self.most, f64::min)
    }

    /// The size \[m\] at a point of the curves.
    pub fn at(&self, p: Point) -> f64 {
        let graded = |s: &Singular| {
            let r = distance(s.at, p);
            if r >= s.reach {
                return s.far + GROWTH * (r - s.reach);
            }
            (s.far * (r / s.reach).powf(s.grading)).min(STEEPEST * r).max(s.near)
        };
        self.singular.iter().map(graded).fold(self.smooth(p), f64::min)
    }

    /// The cuts of a span, as places along its curve without its ends.
    pub fn cuts(&self, span: &Span) -> Vec<f64> {
        let piece = &self.curves.curves[span.curve].piece;
        let mut leaves = Vec::new();
        self.measure(piece, span.t, 0, &mut leaves);
        let total: f64 = leaves.iter().map(|leaf| leaf.1).sum();
        // A closed curve needs three points, and a stretch that both ends grade one in its middle.
        let least = if piece.from == piece.to && span.ends[0] == span.ends[1] { 6 } else { 1 };
        let count = (total.ceil() as usize).max(least);
        let (mut cuts, mut sum, mut next) = (Vec::with_capacity(count), 0.0, 1);
        for (t, cells) in leaves {
            while next < count && (next as f64 / count as f64) * total <= sum + cells {
                let share = ((next as f64 / count as f64) * total - sum) / cells;
                cuts.push(t[0] + share * (t[1] - t[0]));
                next += 1;
            }
            sum += cells;
        }
        cuts
    }

    /// Halves a stretch until it is as short as the cells there; leaves with the number of cells in each.
    fn measure(&self, piece: &Piece, t: [f64; 2], depth: u32, leaves: &mut Vec<([f64; 2], f64)>) {
        let middle = 0.5 * (t[0] + t[1]);
        let length = (t[1] - t[0]) * piece.length();
        let size = [t[0], middle, t[1]].map(|t| self.at(piece.point(t)));
        let least = size.iter().copied().fold(f64::INFINITY, f64::min);
        if length <= 0.7 * least || depth > 40 {
            let mean = (size[0] + 4.0 * size[1] + size[2]) / 6.0;
            leaves.push((t, length / mean));
        } else {
            self.measure(piece, [t[0], middle], depth + 1, leaves);
            self.measure(piece, [middle, t[1]], depth + 1, leaves);
        }
    }
}
