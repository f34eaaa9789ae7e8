//! The outline of a shape: closed loops of straight edges and circular arcs, the shape to the left of each.
//!
//! The first loop bounds the shape from outside and runs counter-clockwise, the others bound its holes and run
//! clockwise. Loads and supports of a body act on parts of its outline ([`super::portion`]), bodies are
//! fitted to it, and finite elements are refined towards it.

use std::f64::consts::TAU;

use super::crossings;
use super::piece::{Piece, is_inside, numbered, reversed};
use super::point::{Point, bounds, distance, minus};
use super::shape::Shape;
use super::specimen;

/// A place on an outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Number of the loop: 0 is the outer one, others are holes.
    pub ring: usize,
    /// Number of the piece in its loop.
    pub piece: usize,
    /// How far along the piece, from 0 to 1.
    pub t: f64,
}

/// Closed loops of pieces; see the module.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    rings: Vec<Vec<Piece>>,
}

/// Why a shape has no outline that a body can be fitted to. Pieces and holes are counted from 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OutlineError {
    /// A loop that bounds no area, up to rounding.
    #[error("{} has no area near ({:.6}, {:.6})", ring_name(*.ring), .place[0], .place[1])]
    NoArea {
        /// Number of the loop: 0 is the outer one, others are holes.
        ring: usize,
        /// Where its first piece begins \[length\].
        place: Point,
    },
    /// Two pieces of one loop cross or touch elsewhere than where one ends and the next begins, or fold back on each
    /// other.
    #[error(
        "{} crosses or touches itself near ({:.6}, {:.6})", ring_name(*.ring), .place[0], .place[1]
    )]
    SelfCrossing {
        /// Number of the loop: 0 is the outer one, others are holes.
        ring: usize,
        /// Where they meet \[length\].
        place: Point,
    },
    /// Two loops cross or touch.
    #[error(
        "{} and {} cross or touch near ({:.6}, {:.6})", ring_name(.rings[0]), ring_name(.rings[1]), .place[0], .place[1]
    )]
    Touching {
        /// Numbers of the loops, the lower first: 0 is the outer one, others are holes.
        rings: [usize; 2],
        /// Where they meet \[length\].
        place: Point,
    },
    /// So many pieces run side by side that to compare each with those beside it would take minutes.
    #[error(
        "too many of its {count} pieces run side by side to be checked for crossings: give fewer corners"
    )]
    TooDense {
        /// Number of straight parts of all loops.
        count: usize,
    },
    /// A hole that begins outside the outer loop.
    #[error("hole {hole} does not lie inside the outer outline, but at ({:.6}, {:.6})", .place[0], .place[1])]
    Outside {
        /// Number of the hole, from 1.
        hole: usize,
        /// Where its first piece begins \[length\].
        place: Point,
    },
    /// A hole within another hole.
    #[error("hole {inner} lies inside hole {outer}")]
    Nested {
        /// Number of the hole that lies inside, from 1.
        inner: usize,
        /// Number of the hole around it, from 1.
        outer: usize,
    },
}

/// How messages name a loop.
pub(crate) fn ring_name(ring: usize) -> String {
    if ring == 0 { "the outer outline".into() } else { format!("the outline of hole {ring}") }
}

/// Lengths below this part of the outline's size are none.
const NOTHING: f64 = 1e-9;

impl Outline {
    /// The outline of a shape.
    ///
    /// # Errors
    /// A shape whose outline crosses or touches itself or has no area, and holes that touch each other or the
    /// outside.
    pub fn of_shape(shape: &Shape) -> Result<Self, OutlineError> {
        let rings = match shape {
            Shape::WithHoles { body, holes } => {
                let holes = holes.iter().map(|hole| reversed(&ring_of(hole)));
                std::iter::once(ring_of(body)).chain(holes).collect()
            }
            solid => vec![ring_of(solid)],
        };
        Self::of_rings(rings)
    }

    /// The outline of a region bounded by polygons, the outer one first; each either way round.
    ///
    /// # Errors
    /// As [`Outline::of_shape`].
    pub fn of_polygons(polygons: &[Vec<Point>]) -> Result<Self, OutlineError> {
        let ring = |(k, polygon): (usize, &Vec<Point>)| {
            let ring = edges(polygon);
            if k == 0 { ring } else { reversed(&ring) }
        };
        Self::of_rings(polygons.iter().enumerate().map(ring).collect())
    }

    fn of_rings(rings: Vec<Vec<Piece>>) -> Result<Self, OutlineError> {
        let outline = Self { rings };
        outline.check()?;
        Ok(outline)
    }

    /// The same outline, its pieces divided.
    pub(super) fn with_rings(&self, rings: Vec<Vec<Piece>>) -> Self {
        Self { rings }
    }

    /// Loops of pieces, the outer one first, shape \[loops\].
    pub fn rings(&self) -> &[Vec<Piece>] {
        &self.rings
    }

    /// Every piece with the number of its loop and its own.
    pub fn pieces(&self) -> impl Iterator<Item = (usize, usize, &Piece)> {
        numbered(self.rings.iter().map(Vec::as_slice))
    }

    /// The piece with this number of its loop and its own, both from 0.
    pub fn piece(&self, ring: usize, piece: usize) -> &Piece {
        &self.rings[ring][piece]
    }

    /// \[length\]
    pub fn point(&self, place: Place) -> Point {
        self.piece(place.ring, place.piece).point(place.t)
    }

    /// Corners, in the order of the pieces that begin there \[length\].
    pub fn corners(&self) -> impl Iterator<Item = Point> + '_ {
        self.pieces().filter(|(.., piece)| piece.begins_at_corner).map(|(.., piece)| piece.from)
    }

    /// \[length\]
    pub fn length(&self) -> f64 {
        self.pieces().map(|(.., piece)| piece.length()).sum()
    }

    /// Area of the shape \[length^2\].
    pub fn area(&self) -> f64 {
        // About a point of the outline: far from the origin of the coordinates no digits are lost.
        let o = self.rings[0][0].from;
        self.pieces().map(|(.., piece)| 0.5 * piece.twice_area(o)).sum()
    }

    /// Lowest and highest coordinates \[length\].
    pub fn bounds(&self) -> (Point, Point) {
        bounds(self.rings[0].iter().flat_map(|piece| <[Point; 2]>::from(piece.bounds())))
    }

    /// Diagonal of the bounds \[length\].
    pub fn size(&self) -> f64 {
        let (low, high) = self.bounds();
        distance(low, high)
    }

    /// The place nearest to `p`, and how far it is \[length\].
    pub fn nearest(&self, p: Point) -> (Place, f64) {
        self.nearest_among(p, self.pieces().map(|(ring, piece, _)| [ring, piece]))
            .expect("an outline has pieces")
    }

    /// The same among pieces given by the numbers of their loop and their own.
    pub(crate) fn nearest_among(
        &self,
        p: Point,
        pieces: impl Iterator<Item = [usize; 2]>,
    ) -> Option<(Place, f64)> {
        let place = |[ring, number]: [usize; 2]| {
            let piece = self.piece(ring, number);
            let t = piece.nearest(p);
            (Place { ring, piece: number, t }, distance(piece.point(t), p))
        };
        pieces.map(place).reduce(|best, next| if next.1 < best.1 { next } else { best })
    }

    /// Whether `p` lies inside: in the polygon of the chords, or else in a segment between a chord and its arc.
    pub fn contains(&self, p: Point) -> bool {
        is_inside(self.pieces().map(|(.., piece)| piece), p)
    }

    fn check(&self) -> Result<(), OutlineError> {
        let is_finite = |piece: &Piece| piece.from.iter().all(|x| x.is_finite());
        let is_none = |ring: &Vec<Piece>| ring.is_empty() || !ring.iter().all(is_finite);
        let none = if self.rings.is_empty() { Some(0) } else { self.rings.iter().position(is_none) };
        if let Some(ring) = none {
            return Err(OutlineError::NoArea { ring, place: [f64::NAN; 2] });
        }
        let near = NOTHING * self.size();
        let flat = (0..self.rings.len()).find(|&ring| is_flat(&self.rings[ring], near));
        // The halves of a bow tie cancel: what is wrong with it is the crossing.
        if flat.is_none() {
            crossings::check(&self.rings, near)?;
        }
        let least = NOTHING * self.size().powi(2);
        let has_none = |&ring: &usize| twice_area(&self.rings[ring]).abs() <= 2.0 * least;
        if let Some(ring) = flat.or_else(|| (0..self.rings.len()).find(has_none)) {
            let place = self.rings[ring].first().map_or([0.0; 2], |piece| piece.from);
            return Err(OutlineError::NoArea { ring, place });
        }
        for (hole, pieces) in self.rings.iter().enumerate().skip(1) {
            let place = pieces[0].from;
            if !is_inside(self.rings[0].iter(), place) {
                return Err(OutlineError::Outside { hole, place });
            }
            let within = |&other: &usize| other != hole && is_inside(self.rings[other].iter(), place);
            if let Some(outer) = (1..self.rings.len()).find(within) {
                return Err(OutlineError::Nested { inner: hole, outer });
            }
        }
        Ok(())
    }
}

fn ring_of(shape: &Shape) -> Vec<Piece> {
    match shape {
        Shape::Rectangle { min, max } => edges(&[*min, [max[0], min[1]], *max, [min[0], max[1]]]),
        Shape::Disc { centre, radius } => vec![Piece::arc(*centre, *radius, 0.0, TAU)],
        Shape::Polygon { vertices } => edges(vertices),
        Shape::Path { pieces } => counter_clockwise(pieces.clone()),
        Shape::Specimen(specimen) => specimen::profile(specimen),
        Shape::WithHoles { body, .. } => ring_of(body),
    }
}

/// The edges of a polygon, counter-clockwise; corners that fall together are one.
pub(super) fn edges(vertices: &[Point]) -> Vec<Piece> {
    let mut corners: Vec<(usize, Point)> = vertices.iter().copied().enumerate().collect();
    corners.dedup_by_key(|(_, corner)| *corner);
    if corners.len() > 1 && corners[0].1 == corners[corners.len() - 1].1 {
        corners.pop();
    }
    let edge = |k: usize| {
        let ((number, from), (_, to)) = (corners[k], corners[(k + 1) % corners.len()]);
        Piece { number, ..Piece::edge(from, to) }
    };
    counter_clockwise((0..corners.len()).map(edge).collect())
}

fn counter_clockwise(ring: Vec<Piece>) -> Vec<Piece> {
    if twice_area(&ring) < 0.0 { reversed(&ring) } else { ring }
}

/// \[length^2\]
fn twice_area(ring: &[Piece]) -> f64 {
    let o = ring.first().map_or([0.0; 2], |piece| piece.from);
    ring.iter().map(|piece| piece.twice_area(o)).sum()
}

/// Whether a loop has straight edges alone that lie on one line, or no pieces at all.
fn is_flat(ring: &[Piece], near: f64) -> bool {
    let from = ring.first().map_or([0.0; 2], |piece| piece.from);
    let apart = |piece: &&Piece| distance(from, piece.from);
    let far = ring.iter().max_by(|a, b| apart(a).total_cmp(&apart(b))).map_or(from, |piece| piece.from);
    let (along, length) = (minus(far, from), distance(from, far));
    // The height of a point over the line, times the length of the base.
    let is_on = |piece: &Piece| {
        let off = minus(piece.from, from);
        piece.arc.is_none() && (along[0] * off[1] - along[1] * off[0]).abs() <= near * length
    };
    ring.iter().all(is_on)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::specimen::Specimen;

    fn square(low: f64, high: f64) -> Vec<Point> {
        vec![[low, low], [high, low], [high, high], [low, high]]
    }

    fn shapes() -> Vec<Shape> {
        let plate = Shape::Rectangle { min: [0.0; 2], max: [4.0, 3.0] };
        vec![
            plate.clone(),
            Shape::Disc { centre: [1.0, -2.0], radius: 1.5 },
            Shape::Polygon { vertices: vec![[0.0, 0.0], [0.0, 3.0], [1.0, 1.0], [4.0, 0.0]] },
            Shape::Specimen(Specimen::e8_sheet(0.1)),
            Shape::Specimen(Specimen { lying: true, ..Specimen::d638_type_i(0.1) }),
            Shape::WithHoles {
                body: Box::new(plate),
                holes: vec![
                    Shape::Disc { centre: [1.0, 1.0], radius: 0.5 },
                    Shape::Polygon { vertices: vec![[2.0, 1.0], [3.0, 1.0], [2.5, 2.0]] },
                ],
            },
        ]
    }

    #[test]
    fn polygons_that_are_none_have_no_outline() {
        let nan = vec![[0.0, 0.0], [1.0, f64::NAN], [1.0, 1.0]];
        let none = [vec![], vec![Vec::new()], vec![nan.clone()], vec![square(0.0, 9.0), nan]];
        for polygons in none {
            let refused = Outline::of_polygons(&polygons);
            assert!(matches!(refused, Err(OutlineError::NoArea { .. })), "{polygons:?}: {refused:?}");
        }
    }

    #[test]
    fn the_outline_of_each_shape_is_closed_and_has_the_shape_on_its_left() {
        for shape in shapes() {
            let outline = Outline::of_shape(&shape).expect("an outline");
            for (ring, piece, now) in outline.pieces() {
                let next = &outline.rings()[ring][(piece + 1) % outline.rings()[ring].len()];
                assert!(distance(now.to, next.from) < 1e-12, "{shape:?} {ring} {piece}");
                for t in [0.0, 0.3, 1.0] {
                    let (p, n) = (now.point(t), now.normal(t));
                    assert!((now.nearest(p) - t).abs() < 1e-9 || now.from == now.to, "{shape:?} {piece} {t}");
                    assert!((n[0].hypot(n[1]) - 1.0).abs() < 1e-12);
                }
                let (p, n) = (now.point(0.5), now.normal(0.5));
                let (inside, outside) =
                    ([0, 1].map(|k| p[k] - 1e-6 * n[k]), [0, 1].map(|k| p[k] + 1e-6 * n[k]));
                assert!(outline.contains(inside) && shape.contains(inside, 0.0), "{shape:?} {ring} {piece}");
                assert!(
                    !outline.contains(outside) && !shape.contains(outside, 0.0),
                    "{shape:?} {ring} {piece}"
                );
            }
        }
    }

    #[test]
    fn areas_and_bounds_are_those_of_the_shapes() {
        let disc = std::f64::consts::PI * 0.25;
        for (shape, area) in
            shapes().into_iter().zip([12.0, 9.0 * disc, 3.5, f64::NAN, f64::NAN, 12.0 - disc - 0.5])
        {
            let outline = Outline::of_shape(&shape).expect("an outline");
            assert!(area.is_nan() || (outline.area() - area).abs() < 1e-12, "{shape:?}: {}", outline.area());
            let (found, expected) = (outline.bounds(), shape.bounds());
            let off =
                (0..2).map(|k| (found.0[k] - expected.0[k]).abs().max((found.1[k] - expected.1[k]).abs()));
            assert!(off.fold(0.0, f64::max) < 1e-12, "{shape:?}");
        }
        // Grips, gauge and fillets of the standard, which narrow the specimen by what their circles leave.
        let e8 = Outline::of_shape(&Shape::Specimen(Specimen::e8_sheet(1.0))).expect("an outline");
        let slices = 2_000_000;
        let sheet = Specimen::e8_sheet(1.0);
        let width = |k: i32| 2.0 * sheet.half_width((f64::from(k) + 0.5) * 200.0 / f64::from(slices));
        let area = (0..slices).map(width).sum::<f64>() * 200.0 / f64::from(slices);
        assert!((e8.area() - area).abs() < 1e-4 * area, "{} {area}", e8.area());
        assert_eq!(e8.corners().count(), 8, "four of the grips, four where fillets end, none at the gauge");
    }

    #[test]
    fn outlines_that_bound_nothing_are_refused_with_the_place() {
        let bow = Outline::of_polygons(&[vec![[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 3.0]]]);
        assert!(matches!(bow, Err(OutlineError::SelfCrossing { ring: 0, .. })), "{bow:?}");
        // One whose halves have the same area.
        let even = Outline::of_polygons(&[vec![[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0]]]);
        assert_eq!(even, Err(OutlineError::SelfCrossing { ring: 0, place: [1.0, 1.0] }));
        let flat = Outline::of_polygons(&[vec![[1.0, 0.0], [0.0, 0.0], [2.0, 0.0]]]);
        assert!(matches!(flat, Err(OutlineError::NoArea { ring: 0, .. })), "{flat:?}");
        let spike = vec![[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 2.0], [4.0, 4.0], [0.0, 4.0]];
        let spike = Outline::of_polygons(&[spike]);
        assert!(matches!(spike, Err(OutlineError::SelfCrossing { .. })), "{spike:?}");
        let with = |hole: Vec<Point>| Outline::of_polygons(&[square(0.0, 4.0), hole]);
        let touching = with(vec![[1.0, 1.0], [4.0, 2.0], [1.0, 3.0]]);
        match touching {
            Err(OutlineError::Touching { rings: [0, 1], place }) => {
                assert!(distance(place, [4.0, 2.0]) < 1e-6)
            }
            other => panic!("{other:?}"),
        }
        assert!(matches!(with(square(5.0, 6.0)), Err(OutlineError::Outside { hole: 1, .. })));
        let nested = Outline::of_polygons(&[square(0.0, 4.0), square(1.0, 3.0), square(1.5, 2.5)]);
        assert!(matches!(nested, Err(OutlineError::Nested { inner: 2, outer: 1 })), "{nested:?}");
        assert!(with(square(1.0, 3.0)).is_ok());
    }
}
