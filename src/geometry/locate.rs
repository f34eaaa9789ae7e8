//! Shapes and outlines that are asked about many points: their pieces are sorted once, and each point looks at few of them.

use super::box_tree::BoxTree;
use super::outline::{Outline, Place};
use super::piece::{Piece, distance, is_inside};
use super::shape::{Shape, path_contains, polygon_contains};

type Point = [f64; 2];

/// A shape to be asked about many points: of its boundary, what is near a point is known without a look at the rest.
#[derive(Clone, Debug)]
pub struct Locator<'a>(Located<'a>);

#[derive(Clone, Debug)]
enum Located<'a> {
    /// One of few pieces.
    Simple(&'a Shape),
    Polygon {
        vertices: &'a [Point],
        /// Of the edges, each numbered as the vertex at which it begins.
        tree: BoxTree,
    },
    Path {
        pieces: &'a [Piece],
        tree: BoxTree,
    },
    WithHoles {
        body: Box<Locator<'a>>,
        holes: Vec<Locator<'a>>,
    },
}

impl<'a> Locator<'a> {
    /// Sorts the boundary of a shape.
    pub fn new(shape: &'a Shape) -> Self {
        Self(match shape {
            Shape::Polygon { vertices } => {
                let bounds = |k: usize| {
                    let (a, b) = (vertices[k], vertices[(k + 1) % vertices.len()]);
                    ([0, 1].map(|axis| a[axis].min(b[axis])), [0, 1].map(|axis| a[axis].max(b[axis])))
                };
                Located::Polygon { vertices, tree: BoxTree::new((0..vertices.len()).map(bounds)) }
            }
            Shape::Path { pieces } => Located::Path { pieces, tree: tree_of(pieces.iter()) },
            Shape::WithHoles { body, holes } => Located::WithHoles {
                body: Box::new(Self::new(body)),
                holes: holes.iter().map(Self::new).collect(),
            },
            simple => Located::Simple(simple),
        })
    }

    /// As [`Shape::contains`] of the shape.
    pub fn contains(&self, point: Point, tolerance: f64) -> bool {
        match &self.0 {
            Located::Simple(shape) => shape.contains(point, tolerance),
            Located::Polygon { vertices, tree } => {
                polygon_contains(vertices, right_of(tree, point, tolerance), point, tolerance)
            }
            Located::Path { pieces, tree } => {
                let near = right_of(tree, point, tolerance).map(|k| &pieces[k]);
                path_contains(near, point, tolerance)
            }
            Located::WithHoles { body, holes } => {
                body.contains(point, tolerance) && !holes.iter().any(|hole| hole.contains(point, -tolerance))
            }
        }
    }
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
pub fn tree_of<'a>(pieces: impl Iterator<Item = &'a Piece>) -> BoxTree {
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
                let locator = Locator::new(&shape);
                let mut next = chance(seed + 100);
                let mut verdicts = [0; 2];
                for tolerance in [0.0, 1e-9, 0.3, -1e-9, -0.3] {
                    // Half of the points lie on the raster, on which vertices and edges of tangles do.
                    for k in 0..200 {
                        let p = [0, 1].map(|_| 16.0 * next() - 3.0);
                        let p = if k % 2 == 0 { p } else { p.map(f64::round) };
                        let expected = shape.contains(p, tolerance);
                        assert_eq!(
                            locator.contains(p, tolerance),
                            expected,
                            "{seed} {tolerance} {p:?} {shape:?}"
                        );
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
