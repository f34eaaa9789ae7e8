//! A body given by its shape: what holds it and what pulls it, on parts of its outline and in its inside.

use std::f64::consts::TAU;

use super::Mesh;
use super::curves::MERGED;
use super::error::FemError;
use super::material::{Inclusions, Material};
use super::outline_mesh::{OutlineMesh, OutlineSide};
use super::problem::{Problem, Traction};
use super::strain::Strain;
use crate::geometry::outline::{Outline, Place};
use crate::geometry::piece::Piece;
use crate::geometry::point::{Point, distance};
use crate::geometry::portion::{Area, Portion};

/// Grading of the mesh at the ends of supports, and at those of loads.
const AT_SUPPORT: f64 = 0.75;
const AT_LOAD: f64 = 0.5;

/// The mesh is not graded towards more single points than this: each counts for little among so many.
const MOST_GRADED: usize = 16;

/// A displacement \[m\] or a force of the place \[m\].
pub type Field<'a> = Box<dyn Fn(Point) -> Point + 'a>;

/// A displacement \[m\] after a part of the way \[1\], of the place \[m\].
pub type WayField<'a> = Box<dyn Fn(f64, Point) -> Point + 'a>;

/// A traction [N/m2] of the place \[m\] and of the outward normal there, which has length 1.
pub type TractionField<'a> = Box<dyn Fn(Point, Point) -> Point + 'a>;

/// A support of a body.
#[derive(Debug, Clone, PartialEq)]
pub enum Holding {
    /// Along portions of its outline.
    Portions(Vec<Portion>),
    /// Throughout what a region has of it.
    Region(Area),
    /// Along a straight line between two points of it \[m\].
    Segment([Point; 2]),
    /// At a single point \[m\]. Elasticity yields there without limit under a force, so a body that needs the
    /// reaction of a point has no exact solution.
    Point(Point),
}

/// Which support prescribes each component of each node, shape \[nodes\].
pub(crate) type Holders = Vec<[Option<usize>; 2]>;

/// A support: prescribed displacements.
pub struct Support<'a> {
    /// Where.
    pub on: Holding,
    /// Whether the displacement along x, and along y, is prescribed.
    pub components: [bool; 2],
    /// Of the place in the undeformed body \[m\].
    pub displacement: Field<'a>,
    /// How a support of a body that turns far gets there; straight if not given.
    pub way: Option<WayField<'a>>,
}

/// A traction on parts of the outline.
pub struct PortionTraction<'a> {
    /// Where it acts.
    pub on: Vec<Portion>,
    /// The load there.
    pub traction: TractionField<'a>,
}

/// A plane elastic body in equilibrium, given by its shape. Where supports overlap the later one
/// holds; loads add up.
pub struct ShapeProblem<'a> {
    /// The outline of the undeformed body \[m\].
    pub outline: &'a Outline,
    /// Material of the body without its inclusions.
    pub material: Material,
    /// The measure of strain.
    pub strain: Strain,
    /// Parts that are of other materials; the later one counts where they overlap.
    pub inclusions: Vec<(&'a Outline, Material)>,
    /// Lines inside the body along which materials meet. They may not overlap.
    pub interfaces: Vec<Piece>,
    /// Supports of the body.
    pub supports: Vec<Support<'a>>,
    /// Loads on its outline.
    pub tractions: Vec<PortionTraction<'a>>,
    /// Forces \[N\] at points \[m\]. The displacement has no limit at the point itself.
    pub point_forces: Vec<(Point, Point)>,
    /// Force per volume [N/m3], the same everywhere.
    pub body_force: Point,
    /// How far outside the outline a point may lie and still be answered, by the nearest place of the body \[m\].
    pub reach: f64,
}

impl<'a> ShapeProblem<'a> {
    /// A body with nothing held and nothing that pulls, and a reach of a millionth of its size.
    pub fn new(outline: &'a Outline, material: Material) -> Self {
        ShapeProblem {
            outline,
            material,
            strain: Strain::Small,
            inclusions: Vec::new(),
            interfaces: Vec::new(),
            supports: Vec::new(),
            tractions: Vec::new(),
            point_forces: Vec::new(),
            body_force: [0.0; 2],
            reach: MERGED * outline.size(),
        }
    }

    /// Holds both components on portions of the outline at a displacement \[m\] of the place.
    pub fn hold(&mut self, on: Vec<Portion>, displacement: impl Fn(Point) -> Point + 'a) {
        let displacement = Box::new(displacement);
        let on = Holding::Portions(on);
        self.supports.push(Support { on, components: [true; 2], displacement, way: None });
    }

    /// Pulls portions of the outline by a traction [N/m2] of the place \[m\] and the outward normal.
    pub fn pull(&mut self, on: Vec<Portion>, traction: impl Fn(Point, Point) -> Point + 'a) {
        self.tractions.push(PortionTraction { on, traction: Box::new(traction) });
    }

    /// Lines that the mesh follows: the edges of inclusions and of regions that are held, and segments.
    pub(crate) fn lines(&self) -> Vec<Piece> {
        let of_support = |support: &Support<'_>| match &support.on {
            Holding::Region(Area::Box { min: [a, b], max: [c, d] }) => {
                let corners = [[*a, *b], [*c, *b], [*c, *d], [*a, *d]];
                (0..4).map(|k| Piece::edge(corners[k], corners[(k + 1) % 4])).collect()
            }
            Holding::Region(Area::Disc { centre, radius }) => {
                vec![Piece::arc(*centre, *radius, 0.0, TAU)]
            }
            Holding::Segment([from, to]) => vec![Piece::edge(*from, *to)],
            _ => Vec::new(),
        };
        self.interfaces.iter().copied().chain(self.supports.iter().flat_map(of_support)).collect()
    }

    /// Ends of portions, with the grading of the mesh there.
    pub(crate) fn places(&self) -> Vec<(Place, f64)> {
        let mut places = Vec::new();
        for support in &self.supports {
            if let Holding::Portions(portions) = &support.on {
                places.extend(self.ends(portions, AT_SUPPORT));
            }
        }
        for traction in &self.tractions {
            places.extend(self.ends(&traction.on, AT_LOAD));
        }
        places
    }

    /// An end at which another portion goes on is none.
    fn ends(&self, portions: &[Portion], grading: f64) -> Vec<(Place, f64)> {
        let ends: Vec<Place> = portions.iter().flat_map(Portion::ends).collect();
        let near = MERGED * self.outline.size();
        let at: Vec<Point> = ends.iter().map(|&place| self.outline.point(place)).collect();
        let goes_on = |k: usize| (0..at.len()).any(|j| j != k && distance(at[j], at[k]) <= near);
        (0..ends.len()).map(|k| (ends[k], if goes_on(k) { 0.0 } else { grading })).collect()
    }

    /// Points that have to be nodes, moved onto the outline where they are a little outside.
    pub(crate) fn points(&self) -> Result<Vec<(Point, f64)>, FemError> {
        let held: Vec<Point> = self
            .supports
            .iter()
            .filter_map(|support| match support.on {
                Holding::Point(at) => Some(at),
                _ => None,
            })
            .collect();
        let of_held = if held.len() <= MOST_GRADED { AT_SUPPORT } else { 0.0 };
        let grading = if self.point_forces.len() <= MOST_GRADED { AT_SUPPORT } else { 0.0 };
        let pulled = self.point_forces.iter().map(|&(at, _)| (at, grading));
        let on_body = |(index, (at, grading)): (usize, (Point, f64))| Ok((self.on_body(index, at)?, grading));
        // Stress is singular, though less so, where the edge of an inclusion turns or ends.
        let corners: Vec<Point> = self
            .interfaces
            .iter()
            .flat_map(|piece| [piece.from, piece.to].into_iter().filter(|_| piece.begins_at_corner))
            .collect();
        let of_corners = if corners.len() <= 2 * MOST_GRADED { AT_LOAD } else { 0.0 };
        let corners = corners.into_iter().map(|at| (at, of_corners));
        held.into_iter()
            .map(|at| (at, of_held))
            .chain(pulled)
            .chain(corners)
            .enumerate()
            .map(on_body)
            .collect()
    }

    /// The place of the body that a point stands for.
    fn on_body(&self, index: usize, at: Point) -> Result<Point, FemError> {
        let (place, apart) = self.outline.nearest(at);
        if apart <= self.reach {
            return Ok(self.outline.point(place));
        }
        if self.outline.contains(at) {
            return Ok(at);
        }
        Err(FemError::OutsideMesh { index, x: at[0], y: at[1] })
    }

    /// The problem on a mesh.
    ///
    /// # Errors
    /// [`FemError::EmptySupport`] for a support that holds no node, [`FemError::OutsideMesh`] for a point force
    /// or a held point outside the body.
    pub(crate) fn on_mesh(&self, mesh: &OutlineMesh) -> Result<(Problem, Holders), FemError> {
        let mut problem = Problem::new(mesh.mesh.clone(), self.material);
        problem.inclusions = self.inclusions_on(&mesh.mesh);
        let mut holder = vec![[None; 2]; mesh.mesh.node_count()];
        for (number, support) in self.supports.iter().enumerate() {
            let nodes = self.nodes(number, &support.on, mesh)?;
            if nodes.is_empty() {
                return Err(FemError::EmptySupport { index: number });
            }
            for node in nodes {
                for axis in (0..2).filter(|&axis| support.components[axis]) {
                    holder[node][axis] = Some(number);
                }
            }
        }
        for (node, holders) in holder.iter().enumerate() {
            let at = [mesh.mesh.x()[node], mesh.mesh.y()[node]];
            for (axis, number) in holders.iter().enumerate() {
                let value = number.map(|number| (self.supports[number].displacement)(at)[axis]);
                problem.prescribed[2 * node + axis] = value;
            }
        }
        for traction in &self.tractions {
            for side in mesh.sides.iter().filter(|side| is_in(&traction.on, side)) {
                problem.tractions.push(Traction::sampled(&mesh.mesh, side.side, &traction.traction));
            }
        }
        for (index, &(at, force)) in self.point_forces.iter().enumerate() {
            let at = self.on_body(index, at)?;
            let node =
                self.node_at(&mesh.mesh, at).ok_or(FemError::OutsideMesh { index, x: at[0], y: at[1] })?;
            problem.forces.push((node, force));
        }
        (problem.body_force, problem.strain) = (self.body_force, self.strain);
        Ok((problem, holder))
    }

    /// What supports prescribe after a part of the way, shape [2 * nodes].
    pub(crate) fn held_after(&self, part: f64, mesh: &Mesh, holders: &Holders) -> Vec<Option<f64>> {
        let of_node = |(node, holders): (usize, &[Option<usize>; 2])| {
            let at = [mesh.x()[node], mesh.y()[node]];
            [0, 1].map(|axis| {
                let support = &self.supports[holders[axis]?];
                Some(match &support.way {
                    Some(way) => way(part, at)[axis],
                    None => part * (support.displacement)(at)[axis],
                })
            })
        };
        holders.iter().enumerate().flat_map(of_node).collect()
    }

    /// Which cells are of other materials, by the middle of each.
    fn inclusions_on(&self, mesh: &Mesh) -> Inclusions {
        if self.inclusions.is_empty() {
            return Inclusions::default();
        }
        let of_cell = |cell: usize| {
            let at = mesh.positions(cell);
            let middle = [0, 1].map(|k| (at[0][k] + at[1][k] + at[2][k]) / 3.0);
            let last = (0..self.inclusions.len()).rev().find(|&k| self.inclusions[k].0.contains(middle));
            last.map_or(0, |k| k as u32 + 1)
        };
        let materials = self.inclusions.iter().map(|(_, material)| *material).collect();
        Inclusions { materials, of_cell: (0..mesh.cell_count()).map(of_cell).collect() }
    }

    fn nodes(&self, number: usize, on: &Holding, mesh: &OutlineMesh) -> Result<Vec<usize>, FemError> {
        let near = 2.0 * MERGED * self.outline.size();
        let within = |inside: &dyn Fn(Point) -> bool| {
            let nodes = mesh.mesh.nodes_where(|x, y| inside([x, y]));
            nodes.into_iter().map(|node| node as usize).collect()
        };
        Ok(match on {
            Holding::Portions(portions) => {
                let sides = mesh.sides.iter().filter(|side| is_in(portions, side));
                sides.flat_map(|side| mesh.mesh.side_nodes(side.side)).collect()
            }
            Holding::Region(area) => within(&|p| area.contains(p, near)),
            Holding::Segment([from, to]) => {
                let line = Piece::edge(*from, *to);
                within(&|p| distance(line.point(line.nearest(p)), p) <= near)
            }
            Holding::Point(at) => {
                let at = self.on_body(number, *at)?;
                self.node_at(&mesh.mesh, at).into_iter().collect()
            }
        })
    }

    fn node_at(&self, mesh: &Mesh, at: Point) -> Option<usize> {
        let apart = |node: usize| distance([mesh.x()[node], mesh.y()[node]], at);
        let nearest = (0..mesh.node_count()).min_by(|&a, &b| apart(a).total_cmp(&apart(b)));
        nearest.filter(|&node| apart(node) <= 2.0 * MERGED * self.outline.size())
    }
}

/// Whether the middle of a side lies in one of the portions.
fn is_in(portions: &[Portion], side: &OutlineSide) -> bool {
    let middle = Place { ring: side.ring, piece: side.piece, t: 0.5 * (side.t[0] + side.t[1]) };
    portions.iter().any(|portion| portion.has(middle))
}
