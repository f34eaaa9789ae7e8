//! The displacement of a shape in equilibrium, with an estimate of its own error.
//!
//! The body is solved on nested meshes ([`OutlineMesh`]). Where the error falls with the power p of the size of
//! cells, that of the finest is the distance to the one before over 2^p - 1 (L. F. Richardson, Phil. Trans. R. Soc.
//! A 210 (1911) 307); p is observed from the last two distances, and never taken as higher than what quadratic
//! triangles have on smooth bodies: 3 in displacement, 4 in energy.

use std::collections::BTreeMap;

use super::element::{Rule, Shape, side_nodes};
use super::error::FemError;
use super::locate::invert;
use super::material::Stress;
use super::mesh::Mesh;
use super::newton::Held;
use super::outline_mesh::{MeshRequest, OutlineMesh};
use super::shape_problem::ShapeProblem;
use super::solution::Solution;
use super::solve::solve_near;
use super::strain::Strain;
use crate::geometry::Point;

/// How far a solution goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Relative L2 error of the displacement at which refinement ends \[1\]. Default: 1e-4.
    pub target: f64,
    /// Meshes of more nodes are not solved on, unless fewer than three are smaller. Default: 100 000.
    pub most_nodes: usize,
    /// Cells of the coarsest mesh, besides those that singular points add. Default: 80.
    pub cells: usize,
}

impl Default for Effort {
    fn default() -> Self {
        Self { target: 1e-4, most_nodes: 100_000, cells: 80 }
    }
}

/// One of the nested meshes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Nodes of its mesh.
    pub nodes: usize,
    /// Strain energy \[J\].
    pub energy: f64,
    /// Relative L2 distance of the displacement from that of the level before \[1\]; zero on the first.
    pub change: f64,
}

/// The error that a solution states of itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EstimatedError {
    /// Of the displacement, relative, in the L2 norm over the body's area \[1\].
    pub displacement: f64,
    /// Of the strain energy, relative \[1\].
    pub energy: f64,
    /// The power of the size of cells with which the displacement's error was seen to fall.
    pub order: f64,
}

/// The reaction of a support, acting on the body.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Reaction {
    /// \[N\]
    pub force: Point,
    /// About the origin of the coordinates \[N m\].
    pub moment: f64,
}

/// A solved shape.
#[derive(Debug, Clone)]
pub struct ShapeSolution {
    solution: Solution,
    levels: Vec<Level>,
    error: EstimatedError,
    reactions: Vec<Reaction>,
    reach: f64,
}

/// Solves a shape on finer and finer meshes until its error is estimated to be at the target.
///
/// # Errors
/// Errors that keep the shape from being meshed ([`FemError::Unmeshable`], [`FemError::InvertedCell`]); a support
/// without a node ([`FemError::EmptySupport`]), a point outside ([`FemError::OutsideMesh`]); a body that is not
/// held ([`FemError::Mechanism`], [`FemError::Singular`]) or, if it turns, has no equilibrium ([`FemError::Lost`]); input that is
/// not finite; memory.
pub fn solve_shape(problem: &ShapeProblem<'_>, effort: &Effort) -> Result<ShapeSolution, FemError> {
    match refine(problem, effort, true) {
        Err(FemError::Lost { .. }) => refine(problem, effort, false),
        found => found,
    }
}

/// Stress has no bound where a clamp ends. Cells that bear a finite one at most, as those of bodies that turn do, are crushed
/// there by a large load as soon as they are small enough: then the finest mesh is taken on which none is, and meshes
/// that are not graded towards such places have more of these.
fn refine(problem: &ShapeProblem<'_>, effort: &Effort, is_graded: bool) -> Result<ShapeSolution, FemError> {
    let (lines, mut places, mut points) = (problem.lines(), problem.places(), problem.points()?);
    if !is_graded {
        places.iter_mut().for_each(|(_, grading)| *grading = 0.0);
        points.iter_mut().for_each(|(_, grading)| *grading = 0.0);
    }
    let request = MeshRequest { lines: &lines, places: &places, points: &points, cells: effort.cells };
    let mut mesh = OutlineMesh::new(problem.outline, &request)?;
    let mut levels: Vec<Level> = Vec::new();
    let mut last: Option<(Solution, Vec<Reaction>)> = None;
    let solved = |(solution, reactions), levels: Vec<Level>| {
        let error = estimate(&levels);
        ShapeSolution { solution, levels, error, reactions, reach: problem.reach }
    };
    loop {
        let (on_mesh, holder) = problem.on_mesh(&mesh)?;
        let turns = problem.strain == Strain::Stretch;
        let start = last.as_ref().filter(|_| turns).map(|(coarse, _)| carried(coarse, &on_mesh.mesh));
        let led = |part: f64| problem.held_after(part, &on_mesh.mesh, &holder);
        let is_led = problem.supports.iter().any(|support| support.way.is_some());
        let solution = match (solve_near(&on_mesh, start, is_led.then_some(&led as &Held<'_>)), last) {
            (Err(FemError::Lost { .. }), Some(coarser)) if levels.len() >= 2 => {
                return Ok(solved(coarser, levels));
            }
            (found, coarser) => {
                last = coarser;
                found?
            }
        };
        let change = last.as_ref().map_or(0.0, |(coarse, _)| change(coarse, &solution));
        let reactions = reactions(problem.supports.len(), &on_mesh, &holder, &solution);
        levels.push(Level { nodes: mesh.mesh.node_count(), energy: solution.strain_energy(), change });
        let error = estimate(&levels);
        let is_enough = levels.len() >= 3 && error.displacement <= effort.target;
        // Singular points by the hundred make even the coarsest mesh a large one.
        let is_large = mesh.mesh.node_count() > effort.most_nodes;
        let is_all = is_large || levels.len() >= 3 && 4 * mesh.mesh.node_count() > effort.most_nodes;
        if is_enough || is_all {
            return Ok(solved((solution, reactions), levels));
        }
        mesh = mesh.refined()?;
        last = Some((solution, reactions));
    }
}

/// A displacement at the components of the next finer mesh: cell k of the coarse one became the cells 4k to 4k + 3 of
/// that.
fn carried(coarse: &Solution, mesh: &Mesh) -> Vec<f64> {
    let mut u = vec![0.0; 2 * mesh.node_count()];
    for cell in 0..mesh.cell_count() {
        let before = coarse.of_cell(cell / 4);
        for (&node, p) in mesh.cell(cell).iter().zip(mesh.positions(cell)) {
            if let Some(place) = invert(coarse.mesh(), cell / 4, p) {
                let at = Shape::at(place).interpolate(&before);
                u[2 * node as usize..][..2].copy_from_slice(&at);
            }
        }
    }
    u
}

/// Relative L2 distance of two levels.
fn change(coarse: &Solution, fine: &Solution) -> f64 {
    let (mesh, rule) = (fine.mesh(), Rule::of_stress());
    let (mut off, mut size) = (0.0, 0.0);
    for cell in 0..mesh.cell_count() {
        let (at, u) = (mesh.positions(cell), fine.of_cell(cell));
        let parent = cell / 4;
        let before = coarse.of_cell(parent);
        for (shape, weight) in &rule.points {
            let area = weight * shape.determinant(&at);
            let (p, u) = (shape.interpolate(&at), shape.interpolate(&u));
            let Some(place) = invert(coarse.mesh(), parent, p) else { continue };
            let v = Shape::at(place).interpolate(&before);
            off += area * ((u[0] - v[0]).powi(2) + (u[1] - v[1]).powi(2));
            size += area * (u[0] * u[0] + u[1] * u[1]);
        }
    }
    ratio(off.sqrt(), size.sqrt())
}

/// No difference is none, whatever it is measured by.
fn ratio(difference: f64, size: f64) -> f64 {
    if difference == 0.0 { 0.0 } else { difference / size }
}

fn estimate(levels: &[Level]) -> EstimatedError {
    let changes: Vec<f64> = levels.iter().skip(1).map(|level| level.change).collect();
    let energies: Vec<f64> = levels
        .windows(2)
        .map(|pair| ratio((pair[1].energy - pair[0].energy).abs(), pair[1].energy.abs()))
        .collect();
    let (displacement, order) = richardson(&changes, 3.0);
    let (energy, _) = richardson(&energies, 4.0);
    EstimatedError { displacement, energy, order }
}

/// The error that the last of a series of distances leaves, and the order with which they fall.
fn richardson(distances: &[f64], highest: f64) -> (f64, f64) {
    let (last, order) = match *distances {
        [] => return (f64::INFINITY, 0.0),
        [only] => (only, 1.0),
        [.., before, last] => (last, if last > 0.0 { (before / last).log2() } else { highest }),
    };
    // Slower than the square root of the size: what is left may be as much as what has gone.
    let order = order.clamp(0.5, highest);
    (last / (2f64.powf(order) - 1.0), order)
}

fn reactions(
    supports: usize,
    problem: &super::problem::Problem,
    holder: &[[Option<usize>; 2]],
    solution: &Solution,
) -> Vec<Reaction> {
    let (forces, loads) = (solution.nodal_forces(), super::assemble::nodal_loads(problem));
    let mut reactions = vec![Reaction::default(); supports];
    for (node, holders) in holder.iter().enumerate() {
        // Loads on a body that turns act where it has them go.
        let [x, y] = match problem.strain {
            Strain::Small => [0.0; 2],
            Strain::Stretch => [solution.ux()[node], solution.uy()[node]],
        };
        let lever = [-solution.mesh().y()[node] - y, solution.mesh().x()[node] + x];
        for axis in 0..2 {
            if let Some(support) = holders[axis] {
                let force = forces[node][axis] - loads[node][axis];
                reactions[support].force[axis] += force;
                reactions[support].moment += lever[axis] * force;
            }
        }
    }
    reactions
}

impl ShapeSolution {
    /// The solution on the finest mesh.
    pub fn solution(&self) -> &Solution {
        &self.solution
    }

    /// The meshes solved on, the coarsest first.
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// The error of the finest mesh.
    pub fn error(&self) -> EstimatedError {
        self.error
    }

    /// Of each support, in the order of the problem's.
    pub fn reactions(&self) -> &[Reaction] {
        &self.reactions
    }

    /// Strain energy \[J\].
    pub fn strain_energy(&self) -> f64 {
        self.levels.last().map_or(0.0, |level| level.energy)
    }

    /// Displacement \[m\] at points \[m\] of the undeformed body, shape \[points\]; points outside it, but nearer than
    /// the problem's reach, take that of the nearest cell, continued to them.
    ///
    /// # Errors
    /// [`FemError::OutsideMesh`] names the first point further outside.
    pub fn displacements_at(&self, points: &[Point]) -> Result<Vec<Point>, FemError> {
        self.displacements_within(points, self.reach)
    }

    /// The same for points no further outside than another `reach` \[m\].
    ///
    /// # Errors
    /// As [`ShapeSolution::displacements_at`].
    pub(crate) fn displacements_within(&self, points: &[Point], reach: f64) -> Result<Vec<Point>, FemError> {
        self.solution.displacements_within(points, reach)
    }

    /// Stress [N/m2] at points \[m\] of the undeformed body, shape \[points\]: inside recovered from the cells around
    /// (O. C. Zienkiewicz and J. Z. Zhu, 1992), on the boundary, where that has cells on one side only and is less accurate
    /// than the cells themselves, the mean of the cells that have a side there. Where materials meet, it is that of the
    /// side where von Mises stress is larger.
    ///
    /// # Errors
    /// As [`ShapeSolution::displacements_at`].
    pub fn stress_at(&self, points: &[Point]) -> Result<Vec<Stress>, FemError> {
        self.stress_within(points, self.reach)
    }

    /// The same for points no further outside than another `reach` \[m\].
    ///
    /// # Errors
    /// As [`ShapeSolution::displacements_at`].
    pub(crate) fn stress_within(&self, points: &[Point], reach: f64) -> Result<Vec<Stress>, FemError> {
        let parted = self.solution.parted();
        parted.interpolated_within(&nodal_stress(&parted), points, [self.reach, reach])
    }
}

/// At the nodes of a mesh whose cells share nodes with cells of their own material alone: where materials meet there is a
/// boundary for either. On boundaries it is that of the cells there, but for its mean, which is recovered from the middles of the cells
/// around: a cell that can hardly change its volume has the right pressure in its middle alone.
fn nodal_stress(parted: &Solution) -> Vec<Stress> {
    let (mesh, mut stress) = (parted.mesh(), parted.recovered_stress());
    let of_middles = parted.recovered_from(&Rule::of_centre());
    let mut sums: BTreeMap<u32, (Stress, f64)> = BTreeMap::new();
    for side in mesh.boundary() {
        for local in side_nodes(side.side as usize) {
            let node = mesh.cell(side.cell as usize)[local];
            let own = parted.stress_at_node(side.cell as usize, local);
            let (sum, count) = sums.entry(node).or_default();
            let Stress { xx, yy, xy, zz } = *sum;
            *sum = Stress { xx: xx + own.xx, yy: yy + own.yy, xy: xy + own.xy, zz: zz + own.zz };
            *count += 1.0;
        }
    }
    for (node, (Stress { xx, yy, xy, .. }, n)) in sums {
        let middle = of_middles[node as usize];
        let (apart, mean) = (0.5 * (xx - yy) / n, 0.5 * (middle.xx + middle.yy));
        stress[node as usize] = Stress { xx: mean + apart, yy: mean - apart, xy: xy / n, zz: middle.zz };
    }
    stress
}
