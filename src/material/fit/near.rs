//! Which pieces of an outline are near: a grid of buckets.

use std::collections::HashMap;

use crate::geometry::outline::{Outline, Piece};

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
    pub fn new(outline: &Outline, side: f64) -> Self {
        let mut buckets = Self { side, origin: outline.bounds().0, pieces: HashMap::new() };
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

/// Where the segment from `a` to `b` meets a piece: shares of the way along either, from 0 to 1.
pub fn meetings(a: [f64; 2], b: [f64; 2], piece: &Piece) -> Vec<[f64; 2]> {
    let along = [b[0] - a[0], b[1] - a[1]];
    let cross = |u: [f64; 2], v: [f64; 2]| u[0] * v[1] - u[1] * v[0];
    let within = |s: &f64| (0.0..=1.0).contains(s);
    match &piece.arc {
        None => {
            let other = [piece.to[0] - piece.from[0], piece.to[1] - piece.from[1]];
            let off = [piece.from[0] - a[0], piece.from[1] - a[1]];
            let turn = cross(along, other);
            let parallel = 1e-12 * along[0].hypot(along[1]) * other[0].hypot(other[1]);
            if turn.abs() <= parallel {
                return Vec::new();
            }
            let (s, t) = (cross(off, other) / turn, cross(off, along) / turn);
            let slack = 1e-12;
            let is_on = within(&s) && (-slack..=1.0 + slack).contains(&t);
            if is_on { vec![[s, t.clamp(0.0, 1.0)]] } else { Vec::new() }
        }
        Some(arc) => {
            let off = [a[0] - arc.centre[0], a[1] - arc.centre[1]];
            let dot = |u: [f64; 2], v: [f64; 2]| u[0] * v[0] + u[1] * v[1];
            let (p, q) = (dot(along, along), dot(off, along));
            let r = (off[0].hypot(off[1]) - arc.radius) * (off[0].hypot(off[1]) + arc.radius);
            let under = q * q - p * r;
            if under <= 0.0 {
                return Vec::new();
            }
            let root = under.sqrt();
            let of = |s: f64| {
                let point = [a[0] + s * along[0], a[1] + s * along[1]];
                let t = piece.nearest(point);
                let at = piece.point(t);
                // Beyond the ends of the arc its circle goes on.
                let is_on = (at[0] - point[0]).hypot(at[1] - point[1]) <= 1e-9 * arc.radius;
                is_on.then_some([s, t])
            };
            [(-q - root) / p, (root - q) / p].into_iter().filter(within).filter_map(of).collect()
        }
    }
}
