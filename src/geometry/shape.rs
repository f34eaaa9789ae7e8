//! Regions of the plane from which a body is cut (the paper's samples and ASTM specimens).

use super::piece::{Piece, is_inside};
use super::point::{Point, bounds};
use super::specimen::Specimen;

/// A solid region \[length, world frame\]; its boundary belongs to it, within the tolerance given to
/// [`Shape::contains`].
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Sides along the axes.
    Rectangle {
        /// Lower left corner.
        min: [f64; 2],
        /// Upper right corner.
        max: [f64; 2],
    },
    /// A full disc.
    Disc {
        /// Coordinates of the middle \[length\].
        centre: [f64; 2],
        /// Distance of the boundary from the middle \[length\].
        radius: f64,
    },
    /// Vertices in order, either way round; the last joins the first.
    Polygon {
        /// Coordinates of the corners \[length\].
        vertices: Vec<[f64; 2]>,
    },
    /// Edges and arcs, each beginning where the one before ends, in a closed loop either way round.
    Path {
        /// The first begins where the last ends.
        pieces: Vec<Piece>,
    },
    /// A standard tensile specimen.
    Specimen(Specimen),
    /// The first shape without the others, whose boundaries stay with the body.
    WithHoles {
        /// The shape that the others are taken out of.
        body: Box<Shape>,
        /// Solid shapes that are taken out of it.
        holes: Vec<Shape>,
    },
}

impl Shape {
    /// Whether `point` lies inside or within `tolerance` \[length\] of the boundary.
    pub fn contains(&self, point: [f64; 2], tolerance: f64) -> bool {
        match self {
            Shape::Rectangle { min, max } => {
                (0..2).all(|k| point[k] >= min[k] - tolerance && point[k] <= max[k] + tolerance)
            }
            Shape::Disc { centre, radius } => {
                (point[0] - centre[0]).hypot(point[1] - centre[1]) <= radius + tolerance
            }
            Shape::Polygon { vertices } => polygon_contains(vertices, point, tolerance),
            Shape::Path { pieces } => path_contains(pieces.iter(), point, tolerance),
            Shape::Specimen(specimen) => specimen.contains(point, tolerance),
            Shape::WithHoles { body, holes } => {
                body.contains(point, tolerance) && !holes.iter().any(|hole| hole.contains(point, -tolerance))
            }
        }
    }

    /// Lowest and highest coordinate on each axis \[length\].
    pub fn bounds(&self) -> ([f64; 2], [f64; 2]) {
        match self {
            Shape::Rectangle { min, max } => (*min, *max),
            Shape::Disc { centre: [x, y], radius: r } => ([x - r, y - r], [x + r, y + r]),
            Shape::Polygon { vertices } => bounds(vertices.iter().copied()),
            Shape::Path { pieces } => {
                bounds(pieces.iter().flat_map(|piece| <[Point; 2]>::from(piece.bounds())))
            }
            Shape::Specimen(specimen) => specimen.bounds(),
            Shape::WithHoles { body, .. } => body.bounds(),
        }
    }

    /// Where a lattice is anchored by default: the centre of a disc, the end of a
    /// specimen's axis, else the lower left corner of the bounds.
    pub fn anchor(&self) -> [f64; 2] {
        match self {
            Shape::Disc { centre, .. } => *centre,
            Shape::Specimen(_) => [0.0; 2],
            Shape::WithHoles { body, .. } => body.anchor(),
            _ => self.bounds().0,
        }
    }
}

/// The two ends of a straight line \[length\].
pub type Segment = ([f64; 2], [f64; 2]);

/// Where an edge crosses the line at this height; its lower end belongs to it, its upper one does not.
pub fn crossing(([ax, ay], [bx, by]): Segment, y: f64) -> Option<f64> {
    ((ay > y) != (by > y)).then(|| ax + (y - ay) / (by - ay) * (bx - ax))
}

/// Even-odd test; a negative tolerance shrinks the polygon.
fn polygon_contains(vertices: &[[f64; 2]], [x, y]: [f64; 2], tolerance: f64) -> bool {
    let mut inside = false;
    let mut nearest = f64::INFINITY;
    for (k, &a) in vertices.iter().enumerate() {
        let b = vertices[(k + 1) % vertices.len()];
        inside ^= crossing((a, b), y).is_some_and(|crossing| x < crossing);
        nearest = nearest.min(segment_distance([x, y], a, b));
    }
    if tolerance >= 0.0 { inside || nearest <= tolerance } else { inside && nearest > -tolerance }
}

/// Whether a point lies in a polygon, by even and odd.
pub(crate) fn is_in_polygon(vertices: &[[f64; 2]], point: [f64; 2]) -> bool {
    polygon_contains(vertices, point, 0.0)
}

/// As [`polygon_contains`], with arcs as they are.
pub(super) fn path_contains<'a>(
    pieces: impl Iterator<Item = &'a Piece> + Clone,
    [x, y]: [f64; 2],
    tolerance: f64,
) -> bool {
    let inside = is_inside(pieces.clone(), [x, y]);
    let away = |piece: &Piece| {
        let [px, py] = piece.point(piece.nearest([x, y]));
        (px - x).hypot(py - y)
    };
    let nearest = pieces.map(away).fold(f64::INFINITY, f64::min);
    if tolerance >= 0.0 { inside || nearest <= tolerance } else { inside && nearest > -tolerance }
}

/// Distance of a point from the segment between two others \[length\].
pub(crate) fn segment_distance(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    let length = dx.hypot(dy);
    // Along the segment from 0 at `a` to 1 at `b`; a segment of no length is its point.
    let along = if length > 0.0 {
        (((p[0] - a[0]) * (dx / length) + (p[1] - a[1]) * (dy / length)) / length).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (p[0] - a[0] - along * dx).hypot(p[1] - a[1] - along * dy)
}

/// How far apart segments touch, over the largest coordinate or distance: some thousand times what rounding makes.
const TOUCHES: f64 = 1e-13;

/// Whether the segments `a`-`b` and `c`-`d` cross or touch.
pub(crate) fn segments_cross(a: [f64; 2], b: [f64; 2], c: [f64; 2], d: [f64; 2]) -> bool {
    let apart = |p: [f64; 2], q: [f64; 2]| [q[0] - p[0], q[1] - p[1]];
    // In units of the largest distance, and by sign: their products would be fourth powers of lengths.
    let largest = |of: &[[f64; 2]]| of.iter().flatten().fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()));
    let unit = largest(&[b, c, d].map(|end| apart(a, end)));
    // What differs by rounding touches: in any unit, and wherever the axes are.
    let rounding = TOUCHES * largest(&[a, b, c, d]).max(unit);
    let side = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
        let ([x, y], [u, v]) = (apart(p, q).map(|v| v / unit), apart(p, r).map(|v| v / unit));
        let twice_area = x * v - y * u;
        let size = [x, y, u, v].iter().fold(0.0, |most: f64, part| most.max(part.abs()));
        if twice_area.abs() <= rounding / unit * size { 0.0 } else { twice_area.signum() }
    };
    let (abc, abd, cda, cdb) = (side(a, b, c), side(a, b, d), side(c, d, a), side(c, d, b));
    // On one line, or hardly longer than a point, they meet where their projections overlap.
    let reaches = |low: f64, high: f64| low <= high + rounding;
    let mut overlap =
        (0..2).map(|k| reaches(a[k].min(b[k]), c[k].max(d[k])) && reaches(c[k].min(d[k]), a[k].max(b[k])));
    abc * abd <= 0.0 && cda * cdb <= 0.0 && overlap.all(|overlap| overlap)
}

#[cfg(test)]
mod tests {
    use super::*;

    const L_SHAPE: [[f64; 2]; 6] = [[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [2.0, 2.0], [2.0, 4.0], [0.0, 4.0]];

    #[test]
    fn a_polygon_keeps_its_boundary_and_loses_its_reentrant_corner() {
        let shape = Shape::Polygon { vertices: L_SHAPE.to_vec() };
        assert!(shape.contains([1.0, 3.0], 1e-9));
        assert!(shape.contains([4.0, 1.0], 1e-9));
        assert!(shape.contains([2.0, 2.0], 1e-9));
        assert!(!shape.contains([3.0, 3.0], 1e-9));
        assert!(!shape.contains([4.1, 1.0], 1e-9));
    }

    #[test]
    fn a_hole_takes_its_inside_but_leaves_its_rim() {
        let shape = Shape::WithHoles {
            body: Box::new(Shape::Rectangle { min: [0.0, 0.0], max: [4.0, 4.0] }),
            holes: vec![Shape::Disc { centre: [2.0, 2.0], radius: 1.0 }],
        };
        assert!(!shape.contains([2.0, 2.5], 1e-9));
        assert!(shape.contains([2.0, 3.0], 1e-9));
        assert!(shape.contains([0.0, 0.0], 1e-9));
    }

    #[test]
    fn segments_cross_in_any_unit() {
        for unit in [1e-150, 1e-90, 1.0, 1e90, 1e150] {
            let cross = |ends: [[f64; 2]; 4]| {
                let [a, b, c, d] = ends.map(|end| end.map(|v| v * unit));
                segments_cross(a, b, c, d)
            };
            assert!(cross([[0.0, 0.0], [2.0, 2.0], [0.0, 2.0], [2.0, 0.0]]), "{unit}");
            assert!(!cross([[0.0, 0.0], [1.0, 1.0], [3.0, 2.0], [3.5, 0.0]]), "{unit}");
        }
    }

    #[test]
    fn crossing_and_touching_segments_meet_and_parallel_ones_do_not() {
        assert!(segments_cross([0.0, 0.0], [2.0, 2.0], [0.0, 2.0], [2.0, 0.0]));
        assert!(segments_cross([0.0, 0.0], [2.0, 0.0], [1.0, 0.0], [1.0, 1.0]));
        assert!(!segments_cross([0.0, 0.0], [2.0, 0.0], [0.0, 1.0], [2.0, 1.0]));
        assert!(segments_cross([0.0, 0.0], [2.0, 0.0], [1.0, 0.0], [3.0, 0.0]));
        assert!(!segments_cross([0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]));
        // Hardly longer than a point: on a slanted segment, beside it within its box, and beyond its end.
        let slant = ([1.0, -2.0], [3.0, 2.0]);
        let short = |x: f64, y: f64| ([x, y], [x, y + 2e-16]);
        for (x, y, crosses) in [(2.0, 0.0, true), (1.7, 0.1, false), (2.4, 0.1, false), (3.5, 3.0, false)] {
            let (a, b) = short(x, y);
            assert_eq!(segments_cross(a, b, slant.0, slant.1), crosses, "{x} {y}");
            assert_eq!(segments_cross(slant.0, slant.1, a, b), crosses, "{x} {y}");
        }
        // A row of particles along a cut, with spacings that are no doubles.
        for unit in [1.0, 0.1, 0.3, 0.07] {
            let [y, low, high] = [3.0, 2.0, 4.0].map(|row| unit * row);
            let cut = ([2.5 * unit, 3.0 * unit], [8.5 * unit, 0.1 * (30.0 * unit)]);
            let is_cut = |a: [f64; 2], b: [f64; 2]| segments_cross(a, b, cut.0, cut.1);
            for x in [3.0, 5.0, 8.0].map(|column| unit * column) {
                assert!(is_cut([x, y], [x, low]) && is_cut([x, y], [x, high]), "{unit} {x}");
                assert!(is_cut([x, y], [x + unit, y]) && !is_cut([x, low], [x + unit, low]), "{unit} {x}");
            }
        }
    }
}
