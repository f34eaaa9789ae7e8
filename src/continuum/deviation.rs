//! How far a body is from the shape that its scene asks for.

use super::plan::Plan;
use crate::flock::vectors::distance;
use crate::geometry::locate::{Finder, tree_of};
use crate::geometry::outline::Outline;
use crate::geometry::piece::Piece;
use crate::geometry::point::area;
use crate::material::cells::Cells;

/// Distances from sides to pieces that are computed at most: beyond, some of the sides stand for all.
const MOST_DISTANCES: usize = 10_000_000;

/// The deviation of a body's cells from its shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Area of the cells over that of the shape, less one \[1\].
    pub area: f64,
    /// Largest distance of the cells' boundary from the outline, and of the outline from that boundary \[length\].
    pub distance: f64,
    /// The same over the square root of the shape's area \[1\].
    pub distance_rel: f64,
}

impl Deviation {
    /// Of a planned body that has cells and an outline.
    pub fn of(plan: &Plan) -> Option<Self> {
        let (cells, outline) = (plan.setup.cells.as_ref()?, plan.outline.as_ref()?);
        let whole = outline.area();
        let shapes: Vec<f64> = cells.shapes.iter().map(area).collect();
        let covered: f64 = cells.kind.iter().map(|&kind| shapes[kind as usize]).sum();
        let distance = farthest(plan, cells, outline);
        Some(Self { area: covered / whole - 1.0, distance, distance_rel: distance / whole.sqrt() })
    }
}

/// Largest distance of ends and middles of the boundary's sides from the outline, and of places on that, half a spacing
/// apart, from the sides \[length\].
fn farthest(plan: &Plan, cells: &Cells, outline: &Outline) -> f64 {
    let reference = &plan.setup.body.reference;
    let sides = cells.boundary_sides(&cells.incidence(reference.len()));
    let pieces = outline.pieces().count();
    let stride = (sides.len().saturating_mul(3 * pieces) / MOST_DISTANCES).max(1);
    let finder = Finder::new(outline);
    let off = |side: &[u32; 2]| {
        let [a, b] = side.map(|i| reference.get(i as usize));
        let middle = [0, 1].map(|k| 0.5 * (a[k] + b[k]));
        [a, middle].into_iter().map(|p| finder.nearest(p).1).fold(0.0, f64::max)
    };
    let of_sides = sides.iter().step_by(stride).map(off).fold(0.0, f64::max);
    let edge = |[a, b]: &[u32; 2]| Piece::edge(reference.get(*a as usize), reference.get(*b as usize));
    let edges: Vec<Piece> = sides.iter().map(edge).collect();
    let tree = tree_of(edges.iter());
    let away =
        |p| tree.nearest(p, |k| distance(edges[k].point(edges[k].nearest(p)), p)).map(|(_, away)| away);
    let grain = 0.5 * plan.setup.body.lattice.spacing();
    let places = outline.pieces().flat_map(|(.., piece)| {
        let parts = (piece.length() / grain).ceil().clamp(2.0, MOST_DISTANCES as f64) as usize;
        (0..parts).map(move |k| piece.point(k as f64 / parts as f64))
    });
    places.filter_map(away).fold(of_sides, f64::max)
}

/// The pieces of an outline as a scene names them, a line each, at most so many.
pub fn pieces(outline: &Outline, most: usize) -> Vec<String> {
    let point = |[x, y]: [f64; 2]| format!("({x:.6}, {y:.6})").replace(".000000", "");
    let line = |(ring, piece): (usize, &Piece)| {
        let hole = if ring == 0 { String::new() } else { format!("hole {ring}, ") };
        let ends = format!("from {} to {}", point(piece.from), point(piece.to));
        let what = match &piece.arc {
            None => format!("edge {ends}"),
            Some(arc) if distance(piece.from, piece.to) == 0.0 => {
                format!("circle about {}, radius {:.6}", point(arc.centre), arc.radius)
            }
            Some(arc) => format!("arc about {}, radius {:.6}, {ends}", point(arc.centre), arc.radius),
        };
        (ring, piece.number, format!("{hole}{}: {what}", piece.number + 1))
    };
    let mut pieces: Vec<(usize, &Piece)> = outline.pieces().map(|(ring, _, piece)| (ring, piece)).collect();
    pieces.sort_by_key(|(ring, piece)| (*ring, piece.number));
    let left_out = pieces.len().saturating_sub(most);
    // The parts of a piece that is divided have one number: all of them are needed to say which lines come first.
    let last = pieces.get(most).map(|(ring, piece)| (*ring, piece.number));
    let first =
        pieces.iter().take_while(|(ring, piece)| last.is_none_or(|last| (*ring, piece.number) <= last));
    let mut lines: Vec<(usize, usize, String)> = first.copied().map(line).collect();
    lines.sort();
    let mut lines: Vec<String> = lines.into_iter().take(most).map(|(.., line)| line).collect();
    if left_out > 0 {
        lines.push(format!("and {left_out} more"));
    }
    lines
}
