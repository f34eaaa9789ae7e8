//! Triangles between curves: constrained Delaunay refinement.
//!
//! The triangulation itself is the crate spade's. Triangles too large for the size function or too flat get a vertex
//! at the centre of their circumscribed circle; where a curve is in the way of that centre, or the centre comes
//! too close to it, the curve is cut instead, at a point that lies on it (L. P. Chew, Proc. 9th Symp. Comput.
//! Geom. (1993) 274; J. Ruppert, J. Algorithms 18 (1995) 548).

use std::collections::HashMap;

use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, PositionInTriangulation, Triangulation};

use super::curves::Curves;
use super::error::FemError;
use super::size::{GROWTH, Sizes};
use crate::geometry::point::{Point, area, distance, dot};

/// Radius of the circumscribed circle over the size asked for, above which a triangle is too large.
const LARGE: f64 = 0.75;
/// Radius of the circumscribed circle over the shortest side, above which a triangle is too flat: 24 degrees.
const FLAT: f64 = 1.25;
/// Height of an arc over its chord as a part of the triangle's, above which the arc is cut.
const BULGE: f64 = 0.15;
/// Passes over all triangles; twenty are usual.
const MOST_PASSES: usize = 200;
/// More vertices than this are not put into a mesh.
const MOST_VERTICES: usize = 200_000;

/// A vertex: where it is, in the body's coordinates and in those of the triangulation, which have size 1.
#[derive(Debug, Clone, Copy)]
struct Vertex {
    at: Point,
    scaled: Point2<f64>,
    size: f64,
}

impl HasPosition for Vertex {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        self.scaled
    }
}

/// A side of triangles that lies on a curve, from one vertex to another in the direction of the curve.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stretch {
    pub curve: usize,
    pub t: [f64; 2],
}

/// Triangles that fill a body.
#[derive(Debug)]
pub(crate) struct Triangles {
    /// \[m\]
    pub vertices: Vec<Point>,
    /// The vertex of each junction of the curves.
    pub junctions: Vec<usize>,
    /// Counter-clockwise.
    pub triangles: Vec<[usize; 3]>,
    /// The sides on curves, by their ends in the direction of the curve.
    pub stretches: HashMap<[usize; 2], Stretch>,
}

struct Mesher<'c> {
    curves: &'c Curves,
    sizes: Sizes<'c>,
    cdt: ConstrainedDelaunayTriangulation<Vertex>,
    stretches: HashMap<[usize; 2], Stretch>,
    junctions: Vec<usize>,
    origin: Point,
    most: f64,
}

/// The defect of a triangle.
enum Flaw {
    None,
    /// It gets a vertex at this centre of its circumscribed circle \[m\].
    Centre(Point),
    /// A curve is cut between these vertices.
    Cut([usize; 2]),
}

/// Fills the inside of `curves` with triangles of size `most` \[m\] and smaller.
///
/// # Errors
/// [`FemError::Unmeshable`] where two curves come closer than the triangulation can follow.
pub(crate) fn triangulate(curves: &Curves, most: f64) -> Result<Triangles, FemError> {
    let origin = curves.junctions.first().map_or([0.0; 2], |junction| junction.at);
    let mut mesher = Mesher {
        curves,
        sizes: Sizes::new(curves, most),
        cdt: ConstrainedDelaunayTriangulation::new(),
        stretches: HashMap::new(),
        junctions: Vec::new(),
        origin,
        most,
    };
    mesher.follow_curves()?;
    mesher.refine()?;
    Ok(mesher.collect())
}

impl Mesher<'_> {
    fn insert(&mut self, at: Point, size: f64) -> Result<usize, FemError> {
        let vertex = Vertex { at, scaled: spade::mitigate_underflow(self.scaled(at)), size };
        let inserted = self.cdt.insert(vertex);
        inserted.map(|handle| handle.index()).map_err(|_| unmeshable(at))
    }

    fn follow_curves(&mut self) -> Result<(), FemError> {
        let mut number = Vec::with_capacity(self.curves.junctions.len());
        for junction in &self.curves.junctions {
            let size = self.sizes.at(junction.at);
            number.push(self.insert(junction.at, size)?);
        }
        self.junctions.clone_from(&number);
        for span in &self.curves.spans {
            let piece = &self.curves.curves[span.curve].piece;
            let mut last = (span.t[0], number[span.ends[0]]);
            for t in self.sizes.cuts(span) {
                let at = piece.point(t);
                let vertex = self.insert(at, self.sizes.at(at))?;
                self.constrain([last.1, vertex], Stretch { curve: span.curve, t: [last.0, t] })?;
                last = (t, vertex);
            }
            let end = number[span.ends[1]];
            self.constrain([last.1, end], Stretch { curve: span.curve, t: [last.0, span.t[1]] })?;
        }
        Ok(())
    }

    fn constrain(&mut self, ends: [usize; 2], stretch: Stretch) -> Result<(), FemError> {
        let [a, b] = ends.map(FixedVertexHandle::from_index);
        let added = self.cdt.try_add_constraint(a, b);
        if added.len() != 1 {
            return Err(unmeshable(self.cdt.vertex(a).data().at));
        }
        self.stretches.insert(ends, stretch);
        Ok(())
    }

    fn at(&self, vertex: usize) -> Vertex {
        *self.cdt.vertex(FixedVertexHandle::from_index(vertex)).data()
    }

    fn stretch(&self, a: usize, b: usize) -> Option<([usize; 2], Stretch)> {
        let found = |ends: [usize; 2]| self.stretches.get(&ends).map(|&stretch| (ends, stretch));
        found([a, b]).or_else(|| found([b, a]))
    }

    fn is_outline(&self, a: usize, b: usize) -> bool {
        self.stretch(a, b).is_some_and(|(_, s)| self.curves.curves[s.curve].on_outline.is_some())
    }

    /// Triangles inside the outline, counter-clockwise: what can be reached from the left of its stretches.
    fn inside(&self) -> Vec<[usize; 3]> {
        let mut is_inside = vec![false; self.cdt.num_all_faces()];
        let mut front: Vec<_> = Vec::new();
        let mut ends: Vec<_> = self.stretches.keys().filter(|[a, b]| self.is_outline(*a, *b)).collect();
        ends.sort_unstable();
        for &[a, b] in ends {
            let [a, b] = [a, b].map(FixedVertexHandle::from_index);
            let face = self.cdt.get_edge_from_neighbors(a, b).and_then(|edge| edge.face().as_inner());
            front.extend(face);
        }
        let mut found = Vec::new();
        while let Some(face) = front.pop() {
            if std::mem::replace(&mut is_inside[face.index()], true) {
                continue;
            }
            found.push(face.vertices().map(|v| v.index()));
            for edge in face.adjacent_edges() {
                if !self.is_outline(edge.from().index(), edge.to().index()) {
                    front.extend(edge.rev().face().as_inner());
                }
            }
        }
        found.sort_unstable();
        found
    }

    fn refine(&mut self) -> Result<(), FemError> {
        for _ in 0..MOST_PASSES {
            let mut flawed: Vec<(f64, [usize; 3])> = Vec::new();
            for triangle in self.inside() {
                if !matches!(self.flaw(triangle), Flaw::None) {
                    flawed.push((circle(triangle.map(|v| self.at(v).at)).1, triangle));
                }
            }
            if flawed.is_empty() {
                return Ok(());
            }
            flawed.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            for (_, triangle) in flawed {
                if self.cdt.num_vertices() >= MOST_VERTICES {
                    return Ok(());
                }
                if self.exists(triangle) {
                    self.mend(triangle)?;
                }
            }
        }
        Ok(())
    }

    fn exists(&self, [a, b, c]: [usize; 3]) -> bool {
        let [a, b] = [a, b].map(FixedVertexHandle::from_index);
        let edge = self.cdt.get_edge_from_neighbors(a, b);
        edge.is_some_and(|edge| !edge.is_outer_edge() && edge.next().to().index() == c)
    }

    fn flaw(&self, triangle: [usize; 3]) -> Flaw {
        let corners = triangle.map(|v| self.at(v));
        let at = corners.map(|v| v.at);
        let sides = [0, 1, 2].map(|k| distance(at[k], at[(k + 1) % 3]));
        let (centre, radius) = circle(at);
        let twice_area = 2.0 * area(&at);
        for (k, side) in sides.into_iter().enumerate() {
            let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
            if let Some((ends, stretch)) = self.stretch(a, b)
                && let Some(arc) = self.curves.curves[stretch.curve].piece.arc
            {
                let height = arc.radius * (1.0 - (0.5 * arc.sweep * (stretch.t[1] - stretch.t[0])).cos());
                if height > BULGE * twice_area / side {
                    return Flaw::Cut(ends);
                }
            }
        }
        let middle = [0, 1].map(|k| (at[0][k] + at[1][k] + at[2][k]) / 3.0);
        let size = corners.iter().map(|v| v.size + GROWTH * distance(v.at, middle)).fold(self.most, f64::min);
        let shortest = (0..3).fold(0, |best, k| if sides[k] < sides[best] { k } else { best });
        let is_flat = radius > FLAT * sides[shortest] && !self.is_at_sharp_corner(triangle, shortest);
        if radius > LARGE * size || is_flat { Flaw::Centre(centre) } else { Flaw::None }
    }

    /// Whether a flat triangle is what two curves that meet at a sharp angle leave of the plane between them: its
    /// shortest side goes from one to the other, and cutting it would never end.
    fn is_at_sharp_corner(&self, triangle: [usize; 3], shortest: usize) -> bool {
        let (a, b, tip) = (triangle[shortest], triangle[(shortest + 1) % 3], triangle[(shortest + 2) % 3]);
        if self.stretch(a, b).is_some() {
            return false;
        }
        let curves_at = |v: usize| -> Vec<usize> {
            let handle = FixedVertexHandle::from_index(v);
            let around = self.cdt.vertex(handle).out_edges();
            let stretches = around.filter_map(|edge| self.stretch(edge.from().index(), edge.to().index()));
            stretches.map(|(_, stretch)| stretch.curve).collect()
        };
        let (of_a, of_b) = (curves_at(a), curves_at(b));
        if of_a.is_empty() || of_b.is_empty() {
            return false;
        }
        let is_tip = self.stretch(tip, a).is_some() && self.stretch(tip, b).is_some();
        let meet = |a: usize, b: usize| {
            let [a, b] = [a, b].map(|k| &self.curves.curves[k].piece);
            let length = distance(self.at(triangle[0]).at, self.at(triangle[1]).at);
            let ends = [a.from, a.to].into_iter().flat_map(|p| [b.from, b.to].map(|q| distance(p, q)));
            ends.fold(f64::INFINITY, f64::min) < 1e-6 * length.max(self.curves.size)
        };
        is_tip
            || of_a.iter().any(|&p| of_b.iter().any(|&q| p != q && meet(p, q) && is_sharp(self.curves, p, q)))
    }

    fn mend(&mut self, triangle: [usize; 3]) -> Result<(), FemError> {
        let centre = match self.flaw(triangle) {
            Flaw::None => return Ok(()),
            Flaw::Cut(ends) => return self.cut(ends),
            Flaw::Centre(centre) => centre,
        };
        let at = triangle.map(|v| self.at(v));
        let middle = [0, 1].map(|k| (at[0].at[k] + at[1].at[k] + at[2].at[k]) / 3.0);
        if let Some(ends) = self.obstacle(middle, centre) {
            return self.cut(ends);
        }
        let size = at.iter().map(|v| v.size + GROWTH * distance(v.at, centre)).fold(self.most, f64::min);
        self.insert(centre, size)?;
        Ok(())
    }

    fn scaled(&self, p: Point) -> Point2<f64> {
        let [x, y] = [0, 1].map(|k| (p[k] - self.origin[k]) / self.curves.size);
        Point2::new(x, y)
    }

    /// The curve that `centre` cannot be seen past from inside a triangle, or in whose diametral circle it lies.
    fn obstacle(&self, from: Point, centre: Point) -> Option<[usize; 2]> {
        let (a, b) = (self.scaled(from), self.scaled(centre));
        if let Some(edge) = self.cdt.get_conflicting_edges_between_points(a, b).next() {
            return self.stretch(edge.from().index(), edge.to().index()).map(|(ends, _)| ends);
        }
        let face = match self.cdt.locate(b) {
            PositionInTriangulation::OnFace(face) => self.cdt.face(face),
            PositionInTriangulation::OnEdge(edge) => {
                let edge = self.cdt.directed_edge(edge);
                if let Some((ends, _)) = self.stretch(edge.from().index(), edge.to().index()) {
                    return Some(ends);
                }
                edge.face().as_inner()?
            }
            _ => return None,
        };
        let near = face.adjacent_edges();
        let further = near.iter().filter_map(|edge| edge.rev().face().as_inner());
        let edges = near.into_iter().chain(further.flat_map(|face| face.adjacent_edges()));
        let mut found = None;
        for edge in edges {
            let (p, q) = (edge.from().index(), edge.to().index());
            let Some((ends, _)) = self.stretch(p, q) else { continue };
            let (p, q) = (self.at(p).at, self.at(q).at);
            let inside =
                (p[0] - centre[0]) * (q[0] - centre[0]) + (p[1] - centre[1]) * (q[1] - centre[1]) < 0.0;
            if inside && found.is_none_or(|(length, _)| distance(p, q) > length) {
                found = Some((distance(p, q), ends));
            }
        }
        found.map(|(_, ends)| ends)
    }

    /// Cuts a stretch of a curve in half, on the curve.
    fn cut(&mut self, ends: [usize; 2]) -> Result<(), FemError> {
        let Some(stretch) = self.stretches.get(&ends).copied() else { return Ok(()) };
        let [a, b] = ends.map(FixedVertexHandle::from_index);
        let t = 0.5 * (stretch.t[0] + stretch.t[1]);
        let at = self.curves.curves[stretch.curve].piece.point(t);
        let (from, to) = (self.at(ends[0]), self.at(ends[1]));
        // A stretch as short as this is where two curves meet; the triangles there are as good as they get.
        if distance(from.at, to.at) < 1e-3 * from.size.min(to.size) {
            return Ok(());
        }
        let size = self.sizes.at(at).min(0.5 * (from.size + to.size));
        if let Some(edge) = self.cdt.get_edge_from_neighbors(a, b).map(|edge| edge.as_undirected().fix()) {
            self.cdt.remove_constraint_edge(edge);
        }
        self.stretches.remove(&ends);
        let middle = self.insert(at, size)?;
        self.constrain([ends[0], middle], Stretch { t: [stretch.t[0], t], ..stretch })?;
        self.constrain([middle, ends[1]], Stretch { t: [t, stretch.t[1]], ..stretch })
    }

    /// Drops the vertices that no triangle inside uses.
    fn collect(self) -> Triangles {
        let triangles = self.inside();
        let mut number = vec![usize::MAX; self.cdt.num_vertices()];
        triangles.iter().flatten().for_each(|&v| number[v] = 0);
        let mut vertices = Vec::new();
        for (v, slot) in number.iter_mut().enumerate().filter(|(_, slot)| **slot == 0) {
            *slot = vertices.len();
            vertices.push(self.at(v).at);
        }
        let stretches = self.stretches.iter().map(|(ends, stretch)| (ends.map(|v| number[v]), *stretch));
        let triangles = triangles.into_iter().map(|t| t.map(|v| number[v])).collect();
        let junctions = self.junctions.iter().map(|&v| number[v]).collect();
        Triangles { vertices, junctions, triangles, stretches: stretches.collect() }
    }
}

/// Whether two curves with a common end turn less than 60 degrees from one to the other there.
fn is_sharp(curves: &Curves, p: usize, q: usize) -> bool {
    let [a, b] = [p, q].map(|k| curves.curves[k].piece.leaving());
    let mut pairs = a.into_iter().flat_map(|one| b.map(|other| (one, other)));
    pairs.any(|((p, u), (q, v))| distance(p, q) < 1e-6 * curves.size && dot(u, v) > 0.5)
}

/// Centre and radius of the circumscribed circle.
fn circle(p: [Point; 3]) -> (Point, f64) {
    let (b, c) = ([p[1][0] - p[0][0], p[1][1] - p[0][1]], [p[2][0] - p[0][0], p[2][1] - p[0][1]]);
    let (bb, cc) = (b[0] * b[0] + b[1] * b[1], c[0] * c[0] + c[1] * c[1]);
    let d = 2.0 * (b[0] * c[1] - b[1] * c[0]);
    let off = [(c[1] * bb - b[1] * cc) / d, (b[0] * cc - c[0] * bb) / d];
    ([p[0][0] + off[0], p[0][1] + off[1]], off[0].hypot(off[1]))
}

fn unmeshable(at: Point) -> FemError {
    FemError::Unmeshable { x: at[0], y: at[1] }
}
