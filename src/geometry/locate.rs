//! Shapes and outlines that are asked about many points: their pieces are sorted once, and each point looks at few of them.

use super::box_tree::BoxTree;
use super::outline::{Outline, Place};
use super::piece::{Piece, is_inside};
use super::point::{Point, distance};
use super::shape::{Segment, Shape, crossing, path_contains, segment_distance};

/// A shape to be asked about points in rows: where a row crosses the boundary is found once for all of its points.
#[derive(Clone, Debug)]
pub struct RowLocator<'a> {
    located: RowLocated<'a>,
    /// Cosine and sine of the rows' direction.
    turn: Point,
}

#[derive(Clone, Debug)]
enum RowLocated<'a> {
    Polygon {
        /// Along and across the rows.
        vertices: Vec<Point>,
        tree: BoxTree,
        /// Rounding of the coordinates.
        slack: f64,
    },
    WithHoles {
        body: Box<RowLocator<'a>>,
        holes: Vec<RowLocator<'a>>,
    },
    Path {
        pieces: &'a [Piece],
        tree: BoxTree,
    },
    /// Of few pieces.
    Simple(&'a Shape),
}

impl<'a> RowLocator<'a> {
    /// Sorts the boundary of a shape for rows in this direction, of any length but 0.
    pub fn new(shape: &'a Shape, direction: Point) -> Self {
        let length = direction[0].hypot(direction[1]);
        let turn = direction.map(|along| along / length);
        let located = match shape {
            Shape::Polygon { vertices } => {
                let vertices: Vec<Point> = vertices.iter().map(|&vertex| turned(turn, vertex)).collect();
                let tree = tree_of_edges(&vertices);
                let largest = vertices.iter().flatten().fold(0.0, |most: f64, along| most.max(along.abs()));
                RowLocated::Polygon { vertices, tree, slack: 1e-12 * largest }
            }
            Shape::WithHoles { body, holes } => RowLocated::WithHoles {
                body: Box::new(Self::new(body, direction)),
                holes: holes.iter().map(|hole| Self::new(hole, direction)).collect(),
            },
            Shape::Path { pieces } => RowLocated::Path { pieces, tree: tree_of(pieces.iter()) },
            simple => RowLocated::Simple(simple),
        };
        Self { located, turn }
    }

    /// The row through a point, for tolerances up to this one or its opposite.
    pub fn row(&self, through: Point, tolerance: f64) -> Row<'_> {
        let [_, across] = turned(self.turn, through);
        let parts = match &self.located {
            RowLocated::Polygon { vertices, tree, slack } => {
                let near = tolerance.abs() + slack;
                let (low, high) = (across - near, across + near);
                let mut crossings = Vec::new();
                let mut stretches = Vec::new();
                for k in tree.overlapping([f64::NEG_INFINITY, low], [f64::INFINITY, high]) {
                    let ends = edge(vertices, k);
                    crossings.extend(crossing(ends, across));
                    let [from, to] = between(ends, low, high);
                    stretches.push(Stretch { from: from - near, to: to + near, edge: k as u32 });
                }
                crossings.sort_unstable_by(f64::total_cmp);
                stretches.sort_unstable_by(|a, b| a.from.total_cmp(&b.from));
                let longest = stretches.iter().map(|one| one.to - one.from).fold(0.0, f64::max);
                RowParts::Polygon { vertices, crossings, stretches, longest }
            }
            RowLocated::WithHoles { body, holes } => RowParts::WithHoles {
                body: Box::new(body.row(through, tolerance)),
                holes: holes.iter().map(|hole| hole.row(through, tolerance)).collect(),
            },
            RowLocated::Path { pieces, tree } => RowParts::Path { pieces, tree },
            RowLocated::Simple(shape) => RowParts::Simple(shape),
        };
        Row { parts, turn: self.turn }
    }
}

/// A row of points, and where it crosses the boundary of a shape.
pub struct Row<'r> {
    parts: RowParts<'r>,
    turn: Point,
}

enum RowParts<'r> {
    Polygon {
        vertices: &'r [Point],
        /// Along the row, ascending.
        crossings: Vec<f64>,
        /// By ascending beginnings.
        stretches: Vec<Stretch>,
        longest: f64,
    },
    WithHoles {
        body: Box<Row<'r>>,
        holes: Vec<Row<'r>>,
    },
    Path {
        pieces: &'r [Piece],
        tree: &'r BoxTree,
    },
    Simple(&'r Shape),
}

/// Where on a row an edge may be within the tolerance.
struct Stretch {
    from: f64,
    to: f64,
    edge: u32,
}

impl Row<'_> {
    /// As [`Shape::contains`], of a point of the row.
    pub fn contains(&self, point: Point, tolerance: f64) -> bool {
        match &self.parts {
            RowParts::Polygon { vertices, crossings, stretches, longest } => {
                let [along, across] = turned(self.turn, point);
                let behind = crossings.len() - crossings.partition_point(|&crossing| crossing <= along);
                let first = stretches.partition_point(|one| one.from < along - longest);
                let beside = stretches[first..].iter().take_while(|one| one.from <= along);
                let away = |one: &Stretch| {
                    let (a, b) = edge(vertices, one.edge as usize);
                    segment_distance([along, across], a, b)
                };
                let nearest = beside.filter(|one| along <= one.to).map(away).fold(f64::INFINITY, f64::min);
                let inside = behind % 2 == 1;
                if tolerance >= 0.0 { inside || nearest <= tolerance } else { inside && nearest > -tolerance }
            }
            RowParts::WithHoles { body, holes } => {
                body.contains(point, tolerance) && !holes.iter().any(|hole| hole.contains(point, -tolerance))
            }
            RowParts::Path { pieces, tree } => {
                let near = right_of(tree, point, tolerance).map(|k| &pieces[k]);
                path_contains(near, point, tolerance)
            }
            RowParts::Simple(shape) => shape.contains(point, tolerance),
        }
    }
}

/// Coordinates along and across rows.
fn turned([cos, sin]: Point, [x, y]: Point) -> Point {
    [cos * x + sin * y, cos * y - sin * x]
}

/// How far the part of an edge between two heights reaches to the left and to the right.
fn between((a, b): Segment, low: f64, high: f64) -> [f64; 2] {
    let rise = b[1] - a[1];
    // One that is level lies wholly between them, or it would not be asked about.
    let at = |height: f64| a[0] + ((height - a[1]) / rise).clamp(0.0, 1.0) * (b[0] - a[0]);
    let ends = if rise == 0.0 { [a[0], b[0]] } else { [at(low), at(high)] };
    [ends[0].min(ends[1]), ends[0].max(ends[1])]
}

fn edge(vertices: &[Point], k: usize) -> Segment {
    (vertices[k], vertices[(k + 1) % vertices.len()])
}

/// Of the edges of a polygon, each numbered as the vertex at which it begins.
fn tree_of_edges(vertices: &[Point]) -> BoxTree {
    BoxTree::new((0..vertices.len()).map(|k| {
        let (a, b) = edge(vertices, k);
        ([0, 1].map(|axis| a[axis].min(b[axis])), [0, 1].map(|axis| a[axis].max(b[axis])))
    }))
}

/// An outline to be asked about many points.
#[derive(Clone, Debug)]
pub struct Finder<'a> {
    outline: &'a Outline,
    /// Loop and number of each piece of the tree.
    numbers: Vec<[usize; 2]>,
    tree: BoxTree,
}

impl<'a> Finder<'a> {
    /// Sorts the pieces of an outline.
    pub fn new(outline: &'a Outline) -> Self {
        Self {
            outline,
            numbers: outline.pieces().map(|(ring, piece, _)| [ring, piece]).collect(),
            tree: tree_of(outline.pieces().map(|(.., piece)| piece)),
        }
    }

    /// As [`Outline::nearest`].
    pub fn nearest(&self, p: Point) -> (Place, f64) {
        let piece = |k: usize| self.outline.piece(self.numbers[k][0], self.numbers[k][1]);
        let away = |k: usize| distance(piece(k).point(piece(k).nearest(p)), p);
        match self.tree.nearest(p, away) {
            Some((k, away)) => {
                let [ring, number] = self.numbers[k];
                (Place { ring, piece: number, t: piece(k).nearest(p) }, away)
            }
            // No distance is a number.
            None => self.outline.nearest(p),
        }
    }

    /// As [`Outline::contains`].
    pub fn contains(&self, p: Point) -> bool {
        let near = right_of(&self.tree, p, 0.0).map(|k| self.numbers[k]);
        is_inside(near.map(|[ring, piece]| self.outline.piece(ring, piece)), p)
    }
}

/// A tree of the boxes around pieces.
pub(crate) fn tree_of<'a>(pieces: impl Iterator<Item = &'a Piece>) -> BoxTree {
    BoxTree::new(pieces.map(|piece| {
        let (low, high) = piece.bounds();
        // A flat arc is known to no better than a part of its radius.
        let slack = piece.arc.map_or(0.0, |arc| 1e-8 * arc.radius);
        (low.map(|v| v - slack), high.map(|v| v + slack))
    }))
}

/// Numbers of what may be near a point or cross the ray from it to the right: nothing else decides whether it is inside.
fn right_of(tree: &BoxTree, [x, y]: Point, tolerance: f64) -> impl Iterator<Item = usize> + Clone + '_ {
    // Twice the tolerance, as distances are rounded.
    let near = 2.0 * tolerance.abs();
    tree.overlapping([x - near, y - near], [f64::INFINITY, y + near])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::box_tree::tests::chance;
    use std::f64::consts::TAU;

    /// A polygon that need not be simple, its vertices on a raster: edges cross, touch, overlap and have no length.
    fn tangle(count: usize, seed: u64) -> Vec<Point> {
        let mut next = chance(seed);
        (0..count).map(|_| [0, 1].map(|_| (next() * 12.0).floor())).collect()
    }

    /// A star about the origin with arms of random lengths.
    fn star(count: usize, seed: u64) -> Vec<Point> {
        let mut next = chance(seed);
        let corner = |k: usize, length: f64| {
            let (sin, cos) = (TAU * k as f64 / count as f64).sin_cos();
            [length * cos, length * sin]
        };
        (0..count).map(|k| corner(k, 2.0 + 3.0 * next())).collect()
    }

    fn shapes(seed: u64) -> Vec<Shape> {
        let polygon = |vertices| Shape::Polygon { vertices };
        let arcs = Outline::of_shape(&Shape::WithHoles {
            body: Box::new(Shape::Disc { centre: [1.0, 1.0], radius: 7.0 }),
            holes: vec![polygon(star(30, seed))],
        });
        let arcs = arcs.expect("an outline").rings().concat();
        vec![
            polygon(tangle(40, seed)),
            polygon(star(300, seed)),
            Shape::Path { pieces: arcs },
            Shape::WithHoles {
                body: Box::new(polygon(tangle(60, seed))),
                holes: vec![polygon(star(9, seed)), Shape::Disc { centre: [6.0; 2], radius: 2.0 }],
            },
        ]
    }

    #[test]
    fn few_pieces_say_of_a_point_what_all_say() {
        for seed in 0..20 {
            for shape in shapes(seed) {
                let locator = RowLocator::new(&shape, [2.0, 0.0]);
                let mut next = chance(seed + 100);
                let mut verdicts = [0; 2];
                for tolerance in [0.0, 1e-9, 0.3, -1e-9, -0.3] {
                    // Half of the points lie on the raster, on which vertices and edges of tangles do.
                    for k in 0..200 {
                        let p = [0, 1].map(|_| 16.0 * next() - 3.0);
                        let p = if k % 2 == 0 { p } else { p.map(f64::round) };
                        let expected = shape.contains(p, tolerance);
                        // A row in any direction goes through it; along x the answer is the same to the last bit.
                        assert_eq!(
                            locator.row(p, tolerance).contains(p, tolerance),
                            expected,
                            "{seed} {tolerance} {p:?} {shape:?}"
                        );
                        let (sin, cos) = (0.1 * k as f64).sin_cos();
                        let turned =
                            RowLocator::new(&shape, [cos, sin]).row(p, tolerance).contains(p, tolerance);
                        assert!(turned == expected || k % 2 == 1, "{seed} {tolerance} {p:?} {shape:?}");
                        verdicts[usize::from(expected)] += 1;
                    }
                }
                assert!(verdicts.iter().all(|&count| count > 20), "points inside and outside: {verdicts:?}");
            }
        }
    }

    #[test]
    fn the_nearest_piece_and_the_inside_are_those_that_a_look_at_every_piece_finds() {
        for seed in 0..20 {
            let shape = Shape::WithHoles {
                body: Box::new(Shape::Disc { centre: [0.0; 2], radius: 8.0 }),
                holes: vec![Shape::Polygon { vertices: star(200, seed) }],
            };
            let outline = Outline::of_shape(&shape).expect("an outline");
            let finder = Finder::new(&outline);
            let mut next = chance(seed);
            // Corners are as near to the piece before as to the one after.
            let corners: Vec<Point> = outline.corners().collect();
            let others = (0..200).map(|_| [0, 1].map(|_| 24.0 * next() - 12.0));
            for p in others.chain(corners.iter().copied()).chain([[0.0; 2]]) {
                assert_eq!(finder.nearest(p), outline.nearest(p), "{seed} {p:?}");
                assert_eq!(finder.contains(p), outline.contains(p), "{seed} {p:?}");
            }
        }
    }
}
