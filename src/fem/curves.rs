//! The curves that a mesh has to follow: the pieces of an outline and lines inside the body, cut where they meet
//! and where something begins or ends.

use crate::geometry::meeting::crossings;
use crate::geometry::outline::{Outline, Place};
use crate::geometry::piece::Piece;
use crate::geometry::point::{Point, cross, distance, dot};

/// Points nearer than this part of the body's size are one.
pub(crate) const MERGED: f64 = 1e-6;

/// Grading at the end of a line, which is the edge of something that is held.
const LINE_END: f64 = 0.75;

/// A line that a mesh follows.
#[derive(Debug, Clone)]
pub(crate) struct Curve {
    pub piece: Piece,
    /// Numbers of the loop and of the piece, if it belongs to the outline.
    pub on_outline: Option<[usize; 2]>,
}

/// A point of a mesh's curves, or a single point of the body, that has to be a vertex.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Junction {
    pub at: Point,
    /// How strongly cells shrink towards it: their size goes with this power of the distance, below 1.
    pub grading: f64,
}

/// A stretch of a curve between two junctions, without one between them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Span {
    pub curve: usize,
    pub t: [f64; 2],
    pub ends: [usize; 2],
}

/// All curves of a body, cut into spans.
#[derive(Debug, Clone, Default)]
pub(crate) struct Curves {
    pub curves: Vec<Curve>,
    pub junctions: Vec<Junction>,
    pub spans: Vec<Span>,
    /// Diagonal of the body's bounds \[m\].
    pub size: f64,
}

impl Curves {
    /// Cuts the outline at `places`, its corners and where `lines` end on it or cross it; keeps of the lines what
    /// lies inside the body and not on its outline, and of `points` those that are not outside.
    pub fn new(outline: &Outline, lines: &[Piece], places: &[(Place, f64)], points: &[(Point, f64)]) -> Self {
        let mut all = Curves { size: outline.size(), ..Self::default() };
        let near = MERGED * all.size;
        let of_outline = |(ring, number, piece): (usize, usize, &Piece)| Curve {
            piece: *piece,
            on_outline: Some([ring, number]),
        };
        all.curves.extend(outline.pieces().map(of_outline));
        let outer = all.curves.len();
        let inner = lines.iter().filter(|line| line.length() > near);
        all.curves.extend(inner.map(|&piece| Curve { piece, on_outline: None }));
        let mut cuts = all.cuts(outline, outer, near);
        for (place, grading) in places {
            let curve = all.curves.iter().position(|c| c.on_outline == Some([place.ring, place.piece]));
            if let Some(curve) = curve {
                cuts[curve].push((place.t, *grading));
            }
        }
        all.take_points(outline, points, near, &mut cuts);
        for (curve, cuts) in cuts.iter_mut().enumerate() {
            all.cut(outline, outer, curve, cuts, near);
        }
        all
    }

    /// The cuts of curves, as places along each with a grading: their ends, and where lines meet anything.
    fn cuts(&self, outline: &Outline, outer: usize, near: f64) -> Vec<Vec<(f64, f64)>> {
        let mut cuts: Vec<Vec<(f64, f64)>> =
            self.curves.iter().map(|_| vec![(0.0, 0.0), (1.0, 0.0)]).collect();
        for (k, curve) in self.curves[..outer].iter().enumerate() {
            if let Some([ring, number]) = curve.on_outline {
                let count = outline.rings()[ring].len();
                let before = outline.piece(ring, (number + count - 1) % count);
                let grading =
                    if curve.piece.begins_at_corner { of_corner(before, &curve.piece) } else { 0.0 };
                cuts[k][0].1 = grading;
            }
        }
        for inner in outer..self.curves.len() {
            let piece = &self.curves[inner].piece;
            for (end, (at, inward)) in piece.leaving().into_iter().enumerate() {
                cuts[inner][end].1 = self.of_line_end(outer, inner, at, inward);
            }
            for other in (0..self.curves.len()).filter(|&other| other < outer || other > inner) {
                for [t, s] in crossings(piece, &self.curves[other].piece, near) {
                    let grading = if other < outer { LINE_END } else { 0.0 };
                    cuts[inner].push((t, grading));
                    cuts[other].push((s, grading));
                }
            }
        }
        cuts
    }

    /// Cells shrink towards the end of a line, unless it is closed or another line goes on there; `inward` is the
    /// direction from the end into the line.
    fn of_line_end(&self, outer: usize, line: usize, end: Point, inward: Point) -> f64 {
        let near = MERGED * self.size;
        let goes_on = |other: &Curve| {
            let ends = other.piece.leaving();
            ends.into_iter().any(|(at, to)| distance(at, end) <= near && dot(to, inward) < -0.9)
        };
        let others = self.curves[outer..].iter().enumerate().filter(|&(k, _)| outer + k != line);
        let own = &self.curves[line].piece;
        if own.from == own.to || others.map(|(_, other)| other).any(goes_on) { 0.0 } else { LINE_END }
    }

    /// Points close to a curve lie on it, others become junctions of their own.
    fn take_points(
        &mut self,
        outline: &Outline,
        points: &[(Point, f64)],
        near: f64,
        cuts: &mut [Vec<(f64, f64)>],
    ) {
        for &(at, grading) in points {
            let along = self.curves.iter().map(|curve| curve.piece.nearest(at));
            let close = |(curve, t): &(usize, f64)| distance(self.curves[*curve].piece.point(*t), at) <= near;
            match along.enumerate().find(close) {
                Some((curve, t)) => cuts[curve].push((t, grading)),
                None if outline.contains(at) => {
                    self.junction(at, grading, near);
                }
                None => {}
            }
        }
    }

    fn cut(&mut self, outline: &Outline, outer: usize, curve: usize, cuts: &mut [(f64, f64)], near: f64) {
        let piece = self.curves[curve].piece;
        cuts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut kept: Vec<(f64, f64)> = Vec::new();
        for &(t, grading) in cuts.iter() {
            match kept.last_mut() {
                // The ends stay where they are.
                Some(last) if (t - last.0) * piece.length() <= near => {
                    last.1 = last.1.max(grading);
                    if t == 1.0 && last.0 > 0.0 {
                        last.0 = 1.0;
                    }
                }
                _ => kept.push((t, grading)),
            }
        }
        let mut last: Option<(f64, usize)> = None;
        for stretch in kept.windows(2) {
            let [from, to] = [stretch[0], stretch[1]];
            let middle = piece.point(0.5 * (from.0 + to.0));
            let is_kept = curve < outer || self.is_inner(outline, curve, middle, near);
            if !is_kept {
                last = None;
                continue;
            }
            let start = match last {
                Some((t, junction)) if t == from.0 => junction,
                _ => self.junction(piece.point(from.0), from.1, near),
            };
            let end = self.junction(piece.point(to.0), to.1, near);
            self.spans.push(Span { curve, t: [from.0, to.0], ends: [start, end] });
            last = Some((to.0, end));
        }
    }

    /// Whether a point of a line is inside the body, and on no curve that comes before the line.
    fn is_inner(&self, outline: &Outline, curve: usize, p: Point, near: f64) -> bool {
        let apart = |other: &Curve| distance(other.piece.point(other.piece.nearest(p)), p) > near;
        outline.contains(p) && self.curves[..curve].iter().all(apart)
    }

    fn junction(&mut self, at: Point, grading: f64, near: f64) -> usize {
        match self.junctions.iter().position(|known| distance(known.at, at) <= near) {
            Some(known) => {
                let slot = &mut self.junctions[known].grading;
                *slot = slot.max(grading);
                known
            }
            None => {
                self.junctions.push(Junction { at, grading });
                self.junctions.len() - 1
            }
        }
    }
}

/// Cells shrink towards a corner that points into the body, the more the sharper it is: the displacement goes with
/// a power of the distance between 1 (straight) and 1/2 (a crack) (M. L. Williams, J. Appl. Mech. 19 (1952) 526).
fn of_corner(before: &Piece, after: &Piece) -> f64 {
    let (a, b) = (before.tangent(1.0), after.tangent(0.0));
    let turn = cross(a, b).atan2(dot(a, b));
    // 20 degrees of a polygon that stands for an arc are no corner.
    if turn < -0.35 { 0.75 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shape::Shape;

    fn plate() -> Outline {
        let body = Box::new(Shape::Rectangle { min: [0.0; 2], max: [4.0, 4.0] });
        let holes = vec![Shape::Disc { centre: [2.0, 2.0], radius: 1.0 }];
        Outline::of_shape(&Shape::WithHoles { body, holes }).unwrap()
    }

    fn inner_length(curves: &Curves) -> f64 {
        let inner = curves.spans.iter().filter(|s| curves.curves[s.curve].on_outline.is_none());
        inner.map(|s| (s.t[1] - s.t[0]) * curves.curves[s.curve].piece.length()).sum()
    }

    #[test]
    fn lines_are_kept_where_they_are_inside_and_cut_the_outline_where_they_cross_it() {
        let across = Piece::edge([-1.0, 2.0], [5.0, 2.0]);
        let curves = Curves::new(&plate(), &[across], &[], &[]);
        assert!((inner_length(&curves) - 2.0).abs() < 1e-12);
        assert_eq!(
            curves.spans.len(),
            4 + 2 + 2 + 2,
            "both uprights, the circle and the line are cut in two"
        );
        let along = Piece::edge([1.0, 0.0], [3.0, 0.0]);
        let curves = Curves::new(&plate(), &[along], &[], &[]);
        assert_eq!(inner_length(&curves), 0.0, "a line on the outline is the outline");
        assert_eq!(curves.junctions.len(), 4 + 1 + 2);
    }

    #[test]
    fn a_circle_that_crosses_another_is_kept_where_it_is_outside_the_hole() {
        let around = Piece::arc([2.0, 3.0], 0.5, 0.0, std::f64::consts::TAU);
        let curves = Curves::new(&plate(), &[around], &[], &[]);
        // The circles meet at angle acos(7/8) from the line of centres of the hole.
        let (dx, dy) = ((1.0f64 - (7.0f64 / 8.0).powi(2)).sqrt(), 7.0 / 8.0 - 1.0);
        let free = std::f64::consts::PI + 2.0 * f64::atan2(-dy, dx);
        assert!((inner_length(&curves) - 0.5 * free).abs() < 1e-9, "{}", inner_length(&curves));
    }

    #[test]
    fn points_of_the_outline_cut_it_and_points_outside_are_left_out() {
        let points = [([2.0, 0.0], 0.5), ([0.5, 0.5], 0.5), ([2.0, 2.0], 0.5), ([4.0, 4.0], 0.5)];
        let curves = Curves::new(&plate(), &[], &[], &points);
        assert_eq!((curves.junctions.len(), curves.spans.len()), (4 + 1 + 2, 6));
        assert_eq!(curves.junctions.iter().filter(|j| j.grading == 0.5).count(), 3);
    }
}
