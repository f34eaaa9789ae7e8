//! Quadratic triangles on a shape given by its outline, and their nested refinement.
//!
//! Middles of sides on arcs lie on the arc, so the cells follow it to third order (isoparametric). Cells shrink
//! towards the singular points of the body, and go on doing so when the mesh is refined: every cell becomes
//! four, and a side that ends at a singular point is not cut in its middle but nearer to that point, so that the
//! error keeps the order that it has on smooth bodies (C. Bacuta, V. Nistor and L. T. Zikatanov, Numer. Math.
//! 100 (2005) 165).

use std::collections::HashMap;

use super::curves::{Curve, Curves};
use super::delaunay::{Stretch, triangulate};
use super::element::NODES;
use super::error::FemError;
use super::mesh::{Mesh, Side};
use crate::geometry::Point;
use crate::geometry::outline::{Outline, Place};
use crate::geometry::piece::Piece;

/// Shortest first part of a side that is cut towards a singular point.
const STRONGEST_CUT: f64 = 0.25;

/// Requirements on the mesh of a shape.
#[derive(Debug, Clone, Default)]
pub struct MeshRequest<'a> {
    /// Lines and arcs inside the body that sides of cells shall follow, as the edge of a region that is held. They
    /// may leave the body: what is outside is left out. No two may overlap.
    pub lines: &'a [Piece],
    /// Places of the outline that shall be nodes, each with its grading: the size of the cells goes with this power
    /// of the distance (0: no grading; 0.5: for a jump of a load; 0.75: for the end of a support).
    pub places: &'a [(Place, f64)],
    /// Points inside or on the outline \[m\] that shall be nodes, with their gradings. Those outside are left out.
    pub points: &'a [(Point, f64)],
    /// About how many cells a compact shape gets at level 0, without those that singular points add.
    pub cells: usize,
}

/// A side of a cell on a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutlineSide {
    /// The cell and which of its sides.
    pub side: Side,
    /// Number of the loop of the outline.
    pub ring: usize,
    /// Number of the piece in its loop.
    pub piece: usize,
    /// How far along the piece the side begins and ends, in the direction of the piece, ascending.
    pub t: [f64; 2],
}

/// A mesh of a shape, which knows which side of which cell is which part of the outline.
#[derive(Debug, Clone)]
pub struct OutlineMesh {
    /// The cells and nodes.
    pub mesh: Mesh,
    curves: Vec<Curve>,
    /// Sides of cells on curves, by their end nodes in the direction of the curve.
    stretches: HashMap<[u32; 2], Stretch>,
    /// Gradings of singular nodes.
    singular: HashMap<u32, f64>,
    /// The sides of cells on the outline, in the order of cells.
    pub sides: Vec<OutlineSide>,
}

impl OutlineMesh {
    /// Meshes a shape, level 0.
    ///
    /// # Errors
    /// [`FemError::Unmeshable`] where curves come too close to each other, [`FemError::InvertedCell`] where an arc
    /// is too bent for the cells beside it, [`FemError::NoCells`] if no cells are asked for.
    pub fn new(outline: &Outline, request: &MeshRequest<'_>) -> Result<OutlineMesh, FemError> {
        if request.cells == 0 {
            return Err(FemError::NoCells);
        }
        let curves = Curves::new(outline, request.lines, request.places, request.points);
        // Equilateral triangles of side a have the area 0.433 a^2.
        let size = (outline.area() / (0.433 * request.cells as f64)).sqrt();
        let triangles = triangulate(&curves, size)?;
        let graded = curves.junctions.iter().zip(&triangles.junctions).filter(|(j, _)| j.grading > 0.0);
        let singular = graded.map(|(junction, &node)| (node as u32, junction.grading)).collect();
        let stretches =
            triangles.stretches.into_iter().map(|(ends, s)| (ends.map(|v| v as u32), s)).collect();
        let cells = triangles.triangles.into_iter().map(|t| t.map(|v| v as u32)).collect();
        Self::build(curves.curves, triangles.vertices, cells, stretches, singular)
    }

    /// The mesh in which each cell has become four, cell k the cells 4k to 4k + 3. Vertices keep their numbers.
    ///
    /// # Errors
    /// [`FemError::InvertedCell`] where an arc is too bent for the cells beside it.
    pub fn refined(&self) -> Result<OutlineMesh, FemError> {
        let mut vertices: Vec<Point> = Vec::new();
        let is_vertex = |cell: usize| &self.mesh.cell(cell)[..3];
        let count = (0..self.mesh.cell_count()).flat_map(is_vertex).max().map_or(0, |&v| v as usize + 1);
        vertices.extend((0..count).map(|v| [self.mesh.x()[v], self.mesh.y()[v]]));
        let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
        let mut stretches = HashMap::with_capacity(2 * self.stretches.len());
        let mut cells = Vec::with_capacity(4 * self.mesh.cell_count());
        for cell in 0..self.mesh.cell_count() {
            let corners = [0, 1, 2].map(|k| self.mesh.cell(cell)[k]);
            let [d, e, f] = [0, 1, 2].map(|k| {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                *middles
                    .entry([a.min(b), a.max(b)])
                    .or_insert_with(|| self.cut_side([a, b], &mut vertices, &mut stretches))
            });
            let [a, b, c] = corners;
            cells.extend([[a, d, f], [d, b, e], [f, e, c], [d, e, f]]);
        }
        Self::build(self.curves.clone(), vertices, cells, stretches, self.singular.clone())
    }

    fn cut_side(
        &self,
        [a, b]: [u32; 2],
        vertices: &mut Vec<Point>,
        stretches: &mut HashMap<[u32; 2], Stretch>,
    ) -> u32 {
        let along = |ends: [u32; 2]| self.stretches.get_key_value(&ends);
        let on_curve = along([a, b]).or_else(|| along([b, a]));
        let ends = on_curve.map_or([a.min(b), a.max(b)], |(ends, _)| *ends);
        let node = vertices.len() as u32;
        let share = match ends.map(|end| self.singular.get(&end)) {
            [Some(grading), None] => first_part(*grading),
            [None, Some(grading)] => 1.0 - first_part(*grading),
            _ => 0.5,
        };
        match on_curve {
            Some((_, &Stretch { curve, t })) => {
                let middle = t[0] + share * (t[1] - t[0]);
                vertices.push(self.curves[curve].piece.point(middle));
                stretches.insert([ends[0], node], Stretch { curve, t: [t[0], middle] });
                stretches.insert([node, ends[1]], Stretch { curve, t: [middle, t[1]] });
            }
            None => {
                let [p, q] = ends.map(|v| vertices[v as usize]);
                vertices.push([0, 1].map(|k| p[k] + share * (q[k] - p[k])));
            }
        }
        node
    }

    fn build(
        curves: Vec<Curve>,
        vertices: Vec<Point>,
        triangles: Vec<[u32; 3]>,
        stretches: HashMap<[u32; 2], Stretch>,
        singular: HashMap<u32, f64>,
    ) -> Result<OutlineMesh, FemError> {
        let (mut x, mut y): (Vec<f64>, Vec<f64>) = vertices.iter().map(|p| (p[0], p[1])).unzip();
        let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
        let mut cells: Vec<[u32; NODES]> = Vec::with_capacity(triangles.len());
        let mut sides = Vec::new();
        for (cell, corners) in triangles.iter().enumerate() {
            let middles = [0, 1, 2].map(|k| {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                let on_curve = stretches.get(&[a, b]).or_else(|| stretches.get(&[b, a]));
                let node = *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                    let [mx, my] = match on_curve {
                        Some(Stretch { curve, t }) => curves[*curve].piece.point(0.5 * (t[0] + t[1])),
                        None => {
                            [0.5 * (x[a as usize] + x[b as usize]), 0.5 * (y[a as usize] + y[b as usize])]
                        }
                    };
                    x.push(mx);
                    y.push(my);
                    (x.len() - 1) as u32
                });
                if let Some(Stretch { curve, t }) = on_curve
                    && let Some([ring, piece]) = curves[*curve].on_outline
                {
                    let side = Side { cell: cell as u32, side: k as u32 };
                    sides.push(OutlineSide { side, ring, piece, t: *t });
                }
                node
            });
            let ([a, b, c], [ab, bc, ca]) = (*corners, middles);
            cells.push([a, b, c, ab, bc, ca]);
        }
        let mesh = Mesh::new(x, y, cells)?;
        Ok(OutlineMesh { mesh, curves, stretches, singular, sides })
    }
}

/// The size at distance r is r^grading, so n times smaller cells begin n^(1 / (1 - grading)) times nearer.
fn first_part(grading: f64) -> f64 {
    0.5f64.powf(1.0 / (1.0 - grading)).max(STRONGEST_CUT)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::element::Rule;
    use crate::geometry::shape::Shape;
    use crate::geometry::specimen::Specimen;

    fn area(mesh: &Mesh) -> f64 {
        let rule = Rule::fine();
        let of_cell = |cell| -> f64 {
            let at = mesh.positions(cell);
            rule.points.iter().map(|(shape, weight)| weight * shape.determinant(&at)).sum()
        };
        (0..mesh.cell_count()).map(of_cell).sum()
    }

    /// Smallest angle of the straight triangles \[degree\].
    fn sharpest(mesh: &Mesh) -> f64 {
        let mut least = f64::INFINITY;
        for cell in 0..mesh.cell_count() {
            let p = mesh.positions(cell);
            for k in 0..3 {
                let (a, b, c) = (p[k], p[(k + 1) % 3], p[(k + 2) % 3]);
                let (u, v) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
                least = least.min((u[0] * v[1] - u[1] * v[0]).atan2(u[0] * v[0] + u[1] * v[1]));
            }
        }
        least.to_degrees()
    }

    fn shapes() -> Vec<(Shape, f64)> {
        let plate = Shape::Rectangle { min: [0.0; 2], max: [40.0, 40.0] };
        let l = vec![[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [2.0, 2.0], [2.0, 4.0], [0.0, 4.0]];
        let with = |holes: Vec<Shape>| Shape::WithHoles { body: Box::new(plate.clone()), holes };
        let disc = |x: f64, y: f64, radius: f64| Shape::Disc { centre: [x, y], radius };
        vec![
            (plate.clone(), 20.0),
            (disc(3.0, -2.0, 1.5), 20.0),
            (Shape::Polygon { vertices: l }, 20.0),
            (with(vec![disc(20.0, 20.0, 4.0)]), 20.0),
            (with(vec![disc(20.0, 20.0, 19.7)]), 15.0),
            (with(vec![disc(10.0, 20.0, 4.0), disc(18.2, 20.0, 4.0), disc(30.0, 30.0, 0.1)]), 15.0),
            (
                Shape::WithHoles { body: Box::new(disc(0.0, 0.0, 2.0)), holes: vec![disc(0.0, 0.0, 1.0)] },
                20.0,
            ),
            (Shape::Specimen(Specimen::e8_sheet(1.0)), 15.0),
            (Shape::Specimen(Specimen { lying: true, ..Specimen::d638_type_i(0.1) }), 15.0),
            (Shape::Polygon { vertices: vec![[0.0, 0.0], [48.0, 44.0], [48.0, 60.0], [0.0, 44.0]] }, 15.0),
            (Shape::Rectangle { min: [1e6, -1e6], max: [1e6 + 100.0, -1e6 + 1.0] }, 20.0),
            // A needle: its tip has 5 degrees.
            (Shape::Polygon { vertices: vec![[0.0, 0.0], [10.0, 0.0], [10.0, 0.875]] }, 2.0),
        ]
    }

    #[test]
    fn meshes_cover_their_shape_with_sound_cells_and_every_side_of_the_outline_once() {
        for (shape, least) in shapes() {
            let outline = Outline::of_shape(&shape).unwrap();
            let request = MeshRequest { cells: 200, ..MeshRequest::default() };
            let mut mesh = OutlineMesh::new(&outline, &request).unwrap_or_else(|e| panic!("{shape:?}: {e}"));
            assert!(sharpest(&mesh.mesh) > least, "{shape:?}: {}", sharpest(&mesh.mesh));
            let mut off = Vec::new();
            for level in 0..2 {
                let length: f64 = mesh
                    .sides
                    .iter()
                    .map(|s| (s.t[1] - s.t[0]) * outline.piece(s.ring, s.piece).length())
                    .sum();
                assert!((length / outline.length() - 1.0).abs() < 1e-12, "{shape:?} {level}: {length}");
                assert_eq!(mesh.sides.len(), mesh.mesh.boundary().len(), "{shape:?}");
                off.push((area(&mesh.mesh) / outline.area() - 1.0).abs());
                assert!(mesh.mesh.cell_count() < 9000, "{shape:?}: {}", mesh.mesh.cell_count());
                mesh = mesh.refined().unwrap_or_else(|e| panic!("{shape:?}: {e}"));
            }
            assert!(off[0] < 1e-5, "{shape:?}: area off by {off:?}");
            assert!(off[1] < 1e-9 || off[1] < off[0] / 10.0, "{shape:?}: area off by {off:?}");
        }
    }

    #[test]
    fn lines_and_points_inside_are_followed() {
        let outline = Outline::of_shape(&shapes()[3].0).unwrap();
        let circle = Piece::arc([8.0, 8.0], 5.0, 0.0, std::f64::consts::TAU);
        let across = Piece::edge([-5.0, 30.0], [50.0, 30.0]);
        let place = Place { ring: 0, piece: 1, t: 0.3 };
        let points = [([33.3, 7.7], 0.5), ([40.0, 3.0], 0.75)];
        let request =
            MeshRequest { lines: &[circle, across], places: &[(place, 0.75)], points: &points, cells: 300 };
        let mesh = OutlineMesh::new(&outline, &request).unwrap().refined().unwrap();
        let nodes = |inside: &dyn Fn(f64, f64) -> bool| mesh.mesh.nodes_where(inside).len();
        for p in [[33.3, 7.7], [40.0, 3.0], [40.0, 12.0]] {
            assert_eq!(nodes(&|x, y| x == p[0] && (y - p[1]).abs() < 1e-12), 1, "{p:?}");
        }
        assert!(nodes(&|_, y| (y - 30.0).abs() < 1e-9) > 20);
        assert!(nodes(&|x, y| ((x - 8.0).hypot(y - 8.0) - 5.0).abs() < 1e-9) > 20);
        let crossed = (0..mesh.mesh.cell_count()).any(|cell| {
            let y = mesh.mesh.positions(cell)[..3].iter().map(|p| p[1] - 30.0).collect::<Vec<_>>();
            y.iter().any(|&d| d > 1e-9) && y.iter().any(|&d| d < -1e-9)
        });
        assert!(!crossed, "no cell is on both sides of a line");
    }

    #[test]
    fn the_same_shape_has_the_same_mesh() {
        let outline = Outline::of_shape(&shapes()[5].0).unwrap();
        let request = MeshRequest { cells: 300, ..MeshRequest::default() };
        let [a, b] = [0, 1].map(|_| OutlineMesh::new(&outline, &request).unwrap().refined().unwrap());
        assert!(a.mesh == b.mesh && a.sides == b.sides);
    }
}
