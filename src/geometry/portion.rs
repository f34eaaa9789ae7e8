//! Parts of an outline: what a load acts on and what a support holds.

use std::collections::HashSet;
use std::f64::consts::TAU;

use super::outline::{Outline, Place};
use super::piece::{Arc, Piece};
use super::point::{Point, distance, dot};

/// A stretch of one piece of an outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Portion {
    /// Number of the loop: 0 is the outer one, others are holes.
    pub ring: usize,
    /// Number of the piece in its loop.
    pub piece: usize,
    /// How far along the piece it begins and ends, from 0 to 1, ascending.
    pub t: [f64; 2],
}

/// A part of the plane, its boundary included \[length\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Area {
    /// An upright rectangle; it may have no width.
    Box {
        /// Lowest coordinates.
        min: Point,
        /// Highest coordinates.
        max: Point,
    },
    /// A full disc.
    Disc {
        /// Coordinates of the middle.
        centre: Point,
        /// Distance of the rim from the middle.
        radius: f64,
    },
}

impl Area {
    /// Whether a point lies inside or within `tolerance` \[length\] of the boundary.
    pub fn contains(&self, point: Point, tolerance: f64) -> bool {
        match *self {
            Area::Box { min, max } => {
                (0..2).all(|k| point[k] >= min[k] - tolerance && point[k] <= max[k] + tolerance)
            }
            Area::Disc { centre, radius } => distance(point, centre) <= radius + tolerance,
        }
    }
}

/// Which parts of an outline.
#[derive(Clone, Debug, PartialEq)]
pub enum Selection {
    /// The outer loop and those of all holes.
    All,
    /// The parts in a box or a disc.
    In(Area),
    /// Pieces by number.
    Pieces {
        /// The loop: 0 is the outer one, then holes in their order.
        ring: usize,
        /// Numbers of the pieces as the shape describes them ([`Piece::number`]), from 0; all of them where empty.
        pieces: Vec<usize>,
        /// Of arcs alone, what lies between these directions from their centres, counter-clockwise \[rad\].
        angles: Option<[f64; 2]>,
    },
    /// From the place of the outline nearest to one point to that nearest to the other, the shorter way
    /// \[length\].
    Between {
        /// One point; it need not lie on the outline.
        from: Point,
        /// The other point.
        to: Point,
    },
}

impl Portion {
    /// The whole of a piece.
    pub fn whole(ring: usize, piece: usize) -> Self {
        Self { ring, piece, t: [0.0, 1.0] }
    }

    /// Where it begins and ends.
    pub fn ends(&self) -> [Place; 2] {
        self.t.map(|t| Place { ring: self.ring, piece: self.piece, t })
    }

    /// Whether a place lies in it.
    pub fn has(&self, place: Place) -> bool {
        (self.ring, self.piece) == (place.ring, place.piece) && self.t[0] <= place.t && place.t <= self.t[1]
    }

    /// \[length\]
    pub fn length(&self, outline: &Outline) -> f64 {
        (self.t[1] - self.t[0]) * outline.piece(self.ring, self.piece).length()
    }
}

impl Outline {
    /// The portions of the outline that are selected, in the order of its pieces; what is no longer than `grain`
    /// \[length\] is left out. Of boxes and discs, a piece that leaves one by no more than `grain` lies in it, one that reaches
    /// in no deeper does not, and any other is cut at the edge itself.
    pub fn portions(&self, selection: &Selection, grain: f64) -> Vec<Portion> {
        let within = |inside: &dyn Fn(&Piece) -> Vec<[f64; 2]>| {
            let of_piece = |(ring, number, piece): (usize, usize, &Piece)| {
                let stretches = inside(piece).into_iter();
                stretches.map(move |t| Portion { ring, piece: number, t }).collect::<Vec<_>>()
            };
            self.pieces().flat_map(of_piece).collect::<Vec<_>>()
        };
        let mut found = match selection {
            Selection::All => within(&|_| vec![[0.0, 1.0]]),
            Selection::In(Area::Box { min, max }) => within(&|piece| {
                let sides = [
                    ([1.0, 0.0], max[0]),
                    ([-1.0, 0.0], -min[0]),
                    ([0.0, 1.0], max[1]),
                    ([0.0, -1.0], -min[1]),
                ];
                let within = |(normal, offset)| cut_at(grain, |grown| below(piece, normal, offset + grown));
                sides.map(within).into_iter().fold(vec![[0.0, 1.0]], |kept, side| common(&kept, &side))
            }),
            Selection::In(Area::Disc { centre, radius }) => {
                within(&|piece| cut_at(grain, |grown| within_disc(piece, *centre, (radius + grown).max(0.0))))
            }
            Selection::Pieces { ring, pieces, angles } => {
                let asked: HashSet<usize> = pieces.iter().copied().collect();
                let is_asked = |number: usize| asked.is_empty() || asked.contains(&number);
                let stretches = |piece: &Piece| match (angles, &piece.arc) {
                    (None, _) => vec![[0.0, 1.0]],
                    (Some(_), None) => Vec::new(),
                    (Some([from, to]), Some(arc)) => between_angles(arc, *from, *to),
                };
                let of_ring = self.pieces().filter(|(r, _, piece)| r == ring && is_asked(piece.number));
                let portions = |(ring, number, piece): (usize, usize, &Piece)| {
                    stretches(piece).into_iter().map(move |t| Portion { ring, piece: number, t })
                };
                of_ring.flat_map(portions).collect()
            }
            Selection::Between { from, to } => self.between(*from, *to),
        };
        found.retain(|portion| portion.length(self) > grain);
        found
    }

    fn between(&self, from: Point, to: Point) -> Vec<Portion> {
        let (a, _) = self.nearest(from);
        let pieces = self.rings()[a.ring].len();
        let same_ring = (0..pieces).map(|piece| [a.ring, piece]);
        let Some((b, _)) = self.nearest_among(to, same_ring) else { return Vec::new() };
        let [there, back] = [self.run(a, b), self.run(b, a)];
        let length = |run: &[Portion]| run.iter().map(|portion| portion.length(self)).sum::<f64>();
        if length(&there) <= length(&back) { there } else { back }
    }

    /// The portions passed on the way from one place to another of the same loop, in the direction of travel.
    fn run(&self, a: Place, b: Place) -> Vec<Portion> {
        let (ring, count) = (a.ring, self.rings()[a.ring].len());
        if a.piece == b.piece && a.t <= b.t {
            return vec![Portion { ring, piece: a.piece, t: [a.t, b.t] }];
        }
        let mut run = vec![Portion { ring, piece: a.piece, t: [a.t, 1.0] }];
        let mut piece = (a.piece + 1) % count;
        while piece != b.piece {
            run.push(Portion::whole(ring, piece));
            piece = (piece + 1) % count;
        }
        run.push(Portion { ring, piece, t: [0.0, b.t] });
        run
    }
}

/// The stretches of a piece on one side of an edge, which `inside` names for that edge moved outwards by a length. A piece
/// along the edge, which rounding may put on either side of it, is taken whole, and one that touches it not at all; any
/// other is cut at the edge itself: a cut as far off as the grain would be off by much more where it meets the edge at a
/// small angle.
fn cut_at(grain: f64, inside: impl Fn(f64) -> Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let widened = inside(grain);
    match widened == [[0.0, 1.0]] {
        true => widened,
        false if inside(-grain).is_empty() => Vec::new(),
        false => inside(0.0),
    }
}

/// Where two sets of ascending stretches overlap.
fn common(a: &[[f64; 2]], b: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let pairs = a.iter().flat_map(|a| b.iter().map(move |b| [a[0].max(b[0]), a[1].min(b[1])]));
    pairs.filter(|[from, to]| from <= to).collect()
}

/// Where `normal . p <= offset` along a piece.
fn below(piece: &Piece, normal: Point, offset: f64) -> Vec<[f64; 2]> {
    let along = |p: Point| normal[0] * p[0] + normal[1] * p[1];
    match &piece.arc {
        None => {
            let (a, b) = (along(piece.from) - offset, along(piece.to) - offset);
            match (a <= 0.0, b <= 0.0) {
                (true, true) => vec![[0.0, 1.0]],
                (true, false) => vec![[0.0, a / (a - b)]],
                (false, true) => vec![[a / (a - b), 1.0]],
                (false, false) => Vec::new(),
            }
        }
        Some(arc) => {
            // r cos(angle - direction) <= rest: all but a range about the direction.
            let size = normal[0].hypot(normal[1]) * arc.radius;
            let rest = (offset - along(arc.centre)) / size;
            if rest >= 1.0 {
                return vec![[0.0, 1.0]];
            }
            if rest < -1.0 {
                return Vec::new();
            }
            let (direction, half) = (normal[1].atan2(normal[0]), rest.acos());
            between_angles(arc, direction + half, direction + TAU - half)
        }
    }
}

fn within_disc(piece: &Piece, centre: Point, radius: f64) -> Vec<[f64; 2]> {
    let Some(arc) = &piece.arc else {
        let off = [0, 1].map(|k| piece.from[k] - centre[k]);
        let along = [0, 1].map(|k| piece.to[k] - piece.from[k]);
        let (a, b, c) = (dot(along, along), dot(off, along), dot(off, off) - radius * radius);
        let root = (b * b - a * c).max(0.0).sqrt();
        if b * b < a * c {
            return Vec::new();
        }
        return common(&[[0.0, 1.0]], &[[(-b - root) / a, (root - b) / a]]);
    };
    // |m + r e - c|^2 <= R^2 is a half plane in e.
    let apart = [0, 1].map(|k| arc.centre[k] - centre[k]);
    if apart == [0.0; 2] {
        return if arc.radius <= radius { vec![[0.0, 1.0]] } else { Vec::new() };
    }
    let rest = (radius * radius - dot(apart, apart) - arc.radius * arc.radius) / 2.0;
    below(piece, apart, dot(apart, arc.centre) + rest)
}

/// Where the direction from the centre lies between two angles, counter-clockwise \[rad\].
fn between_angles(arc: &Arc, from: f64, to: f64) -> Vec<[f64; 2]> {
    let wide = (to - from).min(TAU);
    let (low, high) = (arc.start.min(arc.start + arc.sweep), arc.start.max(arc.start + arc.sweep));
    let mut found = Vec::new();
    let mut turn = from + ((low - from) / TAU).floor() * TAU - TAU;
    while turn <= high {
        let (a, b) = (turn.max(low), (turn + wide).min(high));
        if a < b {
            let share = |angle: f64| (angle - arc.start) / arc.sweep;
            let (s, t) = (share(a), share(b));
            found.push([s.min(t).max(0.0), s.max(t).min(1.0)]);
        }
        turn += TAU;
    }
    found.sort_by(|a, b| a[0].total_cmp(&b[0]));
    found
}

#[cfg(test)]
mod tests {
    use super::super::shape::Shape;
    use super::*;

    fn plate() -> Outline {
        let shape = Shape::WithHoles {
            body: Box::new(Shape::Rectangle { min: [0.0; 2], max: [4.0, 2.0] }),
            holes: vec![Shape::Disc { centre: [2.0, 1.0], radius: 0.5 }],
        };
        Outline::of_shape(&shape).expect("an outline")
    }

    fn length(outline: &Outline, selection: &Selection) -> f64 {
        outline.portions(selection, 1e-9).iter().map(|portion| portion.length(outline)).sum()
    }

    #[test]
    fn what_lies_in_a_region_is_measured_along_edges_and_arcs() {
        let outline = plate();
        let all = 12.0 + TAU * 0.5;
        assert!((length(&outline, &Selection::All) - all).abs() < 1e-12);
        let right = Selection::In(Area::Box { min: [4.0, 0.5], max: [4.0, 2.0] });
        assert!((length(&outline, &right) - 1.5).abs() < 1e-12);
        let half = Selection::In(Area::Box { min: [2.0, 0.25], max: [3.0, 1.75] });
        assert!((length(&outline, &half) - TAU * 0.25).abs() < 1e-12, "half of the hole");
        let disc = Selection::In(Area::Disc { centre: [0.0, 0.0], radius: 1.0 });
        assert!((length(&outline, &disc) - 2.0).abs() < 1e-12);
        // A circle through the centre of the hole's circle, of the same radius, has a third of it inside.
        let lens = Selection::In(Area::Disc { centre: [2.5, 1.0], radius: 0.5 });
        assert!((length(&outline, &lens) - TAU * 0.5 / 3.0).abs() < 1e-12);
        // An edge that only touches the hole takes in none of it or all of it, though rounding moves the edge.
        for off in [-1e-12, 0.0, 1e-12] {
            let beside = Selection::In(Area::Box { min: [1.0, 1.5 + off], max: [3.0, 1.9] });
            assert_eq!(outline.portions(&beside, 1e-9), []);
            let around = Selection::In(Area::Box { min: [1.0, 0.1], max: [3.0, 1.5 + off] });
            assert!((length(&outline, &around) - TAU * 0.5).abs() < 1e-12);
        }
    }

    #[test]
    fn pieces_are_selected_by_number_angle_and_ends() {
        let outline = plate();
        let pieces =
            |ring, pieces: &[usize], angles| Selection::Pieces { ring, pieces: pieces.to_vec(), angles };
        assert_eq!(outline.portions(&pieces(0, &[1], None), 1e-9), [Portion::whole(0, 1)]);
        assert!((length(&outline, &pieces(1, &[], None)) - TAU * 0.5).abs() < 1e-12);
        for [from, to] in [[0.0, 90.0], [-45.0, 45.0], [300.0, 390.0], [170.0, 260.0]] {
            let angles = Some([f64::to_radians(from), f64::to_radians(to)]);
            let found = length(&outline, &pieces(1, &[], angles));
            assert!((found - TAU / 8.0).abs() < 1e-9, "{from} {to}: {found}");
        }
        let around = Selection::Between { from: [3.0, 0.0], to: [4.0, 1.0] };
        assert!((length(&outline, &around) - 2.0).abs() < 1e-12);
        let backwards = Selection::Between { from: [4.0, 1.0], to: [3.0, 0.0] };
        assert!((length(&outline, &backwards) - 2.0).abs() < 1e-12);
        let over_the_start = Selection::Between { from: [0.0, 0.5], to: [0.5, 0.0] };
        assert!((length(&outline, &over_the_start) - 1.0).abs() < 1e-12);
    }
}
