//! The problem to be solved: mesh, material, supports and loads.

use super::element::{GAUSS_3, side_shape};
use super::error::FemError;
use super::material::{Inclusions, Material};
use super::mesh::{Mesh, Side};
use super::strain::Strain;

/// A force per area on one side of a cell, given at the side's three Gauss points, so a traction of
/// degree 3 along a straight side is loaded exactly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Traction {
    /// Where.
    pub side: Side,
    /// Components along x and y [N/m2] at s = -sqrt(3/5), 0, sqrt(3/5) from start to end.
    pub at_gauss: [[f64; 2]; 3],
}

impl Traction {
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
    for (node, [n, dn]) in mesh.side_nodes(side).into_iter().zip(side_shape(s)) {
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
    /// The prescribed value of each component \[m\], shape [2 * nodes], x and y of a node together.
    pub prescribed: Vec<Option<f64>>,
    /// Forces on sides.
    pub tractions: Vec<Traction>,
    /// Nodes and the forces on them \[N\].
    pub forces: Vec<(usize, [f64; 2])>,
    /// Force per volume [N/m3], the same everywhere.
    pub body_force: [f64; 2],
}

impl Problem {
    /// A body with nothing held and nothing that pulls.
    pub fn new(mesh: Mesh, material: Material) -> Problem {
        let (prescribed, tractions, forces) = (vec![None; 2 * mesh.node_count()], Vec::new(), Vec::new());
        let inclusions = Inclusions::default();
        let strain = Strain::Small;
        Problem { mesh, material, inclusions, strain, prescribed, tractions, forces, body_force: [0.0; 2] }
    }

    /// Refuses what is not finite.
    pub(crate) fn check(&self) -> Result<(), FemError> {
        let finite = |what, index, values: &[f64]| match values.iter().all(|v| v.is_finite()) {
            true => Ok(()),
            false => Err(FemError::NotFinite { what, index }),
        };
        for (i, value) in self.prescribed.iter().flatten().enumerate() {
            finite("fixed displacement", i, &[*value])?;
        }
        for (i, (_, force)) in self.forces.iter().enumerate() {
            finite("point force", i, force)?;
        }
        for (i, t) in self.tractions.iter().enumerate() {
            finite("traction", i, t.at_gauss.as_flattened())?;
        }
        finite("body force", 0, &self.body_force)
    }
}
