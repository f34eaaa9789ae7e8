//! The problem to be solved: mesh, material, supports and loads.

use super::element::{GAUSS_3, side_shape};
use super::error::FemError;
use super::material::{Inclusions, Material};
use super::mesh::{Mesh, Side};
use super::strain::Strain;

/// A displacement component.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Axis {
    /// Along x.
    X = 0,
    /// Along y.
    Y = 1,
}

/// One prescribed displacement component.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fixed {
    /// The node, from 0.
    pub node: u32,
    /// The component.
    pub axis: Axis,
    /// The displacement \[m\].
    pub value: f64,
}

/// A force on a node \[N\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointForce {
    /// The node, from 0.
    pub node: u32,
    /// Components along x and y \[N\].
    pub force: [f64; 2],
}

/// A force per area on one side of a cell, given at the side's three Gauss points, so a traction of
/// degree 3 along a straight side loads linear and quadratic sides exactly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Traction {
    /// Where.
    pub side: Side,
    /// Components along x and y [N/m2] at s = -sqrt(3/5), 0, sqrt(3/5) from start to end.
    pub at_gauss: [[f64; 2]; 3],
}

impl Traction {
    /// The same traction [N/m2] all along a side.
    pub fn uniform(side: Side, traction: [f64; 2]) -> Traction {
        Traction { side, at_gauss: [traction; 3] }
    }

    /// A traction that varies: `traction(point, normal)` [N/m2] is sampled at the side's Gauss points;
    /// `normal` is the outward unit normal there, so `|_, n| [-p * n[0], -p * n[1]]` is a pressure p.
    ///
    /// # Panics
    /// If `mesh` has no such side.
    pub fn sampled(mesh: &Mesh, side: Side, traction: impl Fn([f64; 2], [f64; 2]) -> [f64; 2]) -> Traction {
        let at_gauss = GAUSS_3.map(|[s, _]| {
            let (point, tangent) = along_side(mesh, side, s);
            let length = tangent[0].hypot(tangent[1]);
            traction(point, [tangent[1] / length, -tangent[0] / length])
        });
        Traction { side, at_gauss }
    }
}

/// Position \[m\] and its derivative along s at `s` in [-1, 1] of a side.
pub(crate) fn along_side(mesh: &Mesh, side: Side, s: f64) -> ([f64; 2], [f64; 2]) {
    let (mut point, mut tangent) = ([0.0; 2], [0.0; 2]);
    for (node, [n, dn]) in mesh.side_nodes(side).zip(side_shape(mesh.kind().degree(), s)) {
        for (i, v) in [mesh.x()[node], mesh.y()[node]].into_iter().enumerate() {
            point[i] += n * v;
            tangent[i] += dn * v;
        }
    }
    (point, tangent)
}

/// A plane elastic body in equilibrium. All lists start empty; the order of their entries
/// changes nothing but rounding.
#[derive(Debug, Clone)]
pub struct Problem {
    /// The body, undeformed.
    pub mesh: Mesh,
    /// The material of all cells that are in no inclusion.
    pub material: Material,
    /// The measure of strain; loads keep direction and place of application wherever the body turns.
    pub strain: Strain,
    /// Cells of other materials; none unless given.
    pub inclusions: Inclusions,
    /// Prescribed displacements. The same component may appear twice with the same value.
    pub fixed: Vec<Fixed>,
    /// Forces on sides.
    pub tractions: Vec<Traction>,
    /// Forces on nodes.
    pub forces: Vec<PointForce>,
    /// Force per volume [N/m3], the same everywhere.
    pub body_force: [f64; 2],
}

impl Problem {
    /// A body with nothing held and nothing that pulls.
    pub fn new(mesh: Mesh, material: Material) -> Problem {
        let (fixed, tractions, forces) = (Vec::new(), Vec::new(), Vec::new());
        let inclusions = Inclusions::default();
        let strain = Strain::Small;
        Problem { mesh, material, inclusions, strain, fixed, tractions, forces, body_force: [0.0; 2] }
    }

    /// Holds one component of `nodes` at `value` \[m\].
    pub fn fix(&mut self, nodes: &[u32], axis: Axis, value: f64) {
        self.fixed.extend(nodes.iter().map(|&node| Fixed { node, axis, value }));
    }

    /// Prescribes both components of `nodes` as `displacement(x, y)` \[m\] of the undeformed position.
    ///
    /// # Panics
    /// If a node does not exist.
    pub fn prescribe(&mut self, nodes: &[u32], displacement: impl Fn(f64, f64) -> [f64; 2]) {
        for &node in nodes {
            let [x, y] = displacement(self.mesh.x()[node as usize], self.mesh.y()[node as usize]);
            self.fixed.extend([(Axis::X, x), (Axis::Y, y)].map(|(axis, value)| Fixed { node, axis, value }));
        }
    }

    /// Pulls `sides` with the same `traction` [N/m2].
    pub fn pull(&mut self, sides: &[Side], traction: [f64; 2]) {
        self.tractions.extend(sides.iter().map(|&side| Traction::uniform(side, traction)));
    }

    /// Pulls `sides` with a traction sampled as in [`Traction::sampled`].
    ///
    /// # Panics
    /// If a side does not exist.
    pub fn pull_with(&mut self, sides: &[Side], traction: impl Fn([f64; 2], [f64; 2]) -> [f64; 2]) {
        self.tractions.extend(sides.iter().map(|&side| Traction::sampled(&self.mesh, side, &traction)));
    }

    /// Refuses what does not exist and what is not finite.
    pub(crate) fn check(&self) -> Result<(), FemError> {
        let exists = |what, index: u32, count: usize| match (index as usize) < count {
            true => Ok(()),
            false => Err(FemError::NoSuch { what, index: index as usize, count }),
        };
        let finite = |what, index, values: &[f64]| match values.iter().all(|v| v.is_finite()) {
            true => Ok(()),
            false => Err(FemError::NotFinite { what, index }),
        };
        let nodes = self.mesh.node_count();
        for (i, f) in self.fixed.iter().enumerate() {
            exists("node", f.node, nodes)?;
            finite("fixed displacement", i, &[f.value])?;
        }
        for (i, f) in self.forces.iter().enumerate() {
            exists("node", f.node, nodes)?;
            finite("point force", i, &f.force)?;
        }
        for (i, t) in self.tractions.iter().enumerate() {
            exists("cell", t.side.cell, self.mesh.cell_count())?;
            exists("side", t.side.side, self.mesh.kind().corners())?;
            finite("traction", i, t.at_gauss.as_flattened())?;
        }
        finite("body force", 0, &self.body_force)
    }

    /// The prescribed value of each component, shape [2 * nodes], x and y of a node together.
    pub(crate) fn prescribed(&self) -> Result<Vec<Option<f64>>, FemError> {
        let mut values = vec![None; 2 * self.mesh.node_count()];
        for f in &self.fixed {
            let slot: &mut Option<f64> = &mut values[2 * f.node as usize + f.axis as usize];
            match *slot {
                Some(first) if first != f.value => {
                    return Err(FemError::Conflict {
                        node: f.node as usize,
                        axis: f.axis,
                        first,
                        second: f.value,
                    });
                }
                _ => *slot = Some(f.value),
            }
        }
        Ok(values)
    }
}
