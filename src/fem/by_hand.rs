//! Meshes and problems by hand, for the tests of this room: bodies that no outline has.

use super::error::FemError;
use super::mesh::{Mesh, Side};
use super::problem::{Problem, Traction};
use super::solution::Solution;
use super::solve::solve_near;

impl Mesh {
    /// The rectangle from corner `low` to corner `high` \[m\], cut into `cells` = [nx, ny] equal ones, each of them into two
    /// triangles by the diagonal from its low corner to its high one. Node (i, j) of the grid of corners and middles has
    /// number j (2 nx + 1) + i.
    pub fn rectangle(cells: [usize; 2], low: [f64; 2], high: [f64; 2]) -> Mesh {
        let [wide, deep] = cells.map(|n| 2 * n + 1);
        let at = |i: usize, n: usize, axis: usize| {
            let t = i as f64 / (n - 1) as f64;
            low[axis] * (1.0 - t) + high[axis] * t
        };
        let (x, y) = (0..wide * deep).map(|k| (at(k % wide, wide, 0), at(k / wide, deep, 1))).unzip();
        let halves = [
            [[0, 0], [2, 0], [2, 2], [1, 0], [2, 1], [1, 1]],
            [[0, 0], [2, 2], [0, 2], [1, 1], [1, 2], [0, 1]],
        ];
        let of_cell = |k: usize| {
            let first = 2 * (k / cells[0]) * wide + 2 * (k % cells[0]);
            halves.map(|half| half.map(|[i, j]| (first + j * wide + i) as u32))
        };
        Mesh::new(x, y, (0..cells[0] * cells[1]).flat_map(of_cell).collect()).unwrap()
    }

    /// The same cells with every node moved to `map(x, y)` \[m\], which curves their sides.
    pub fn mapped(&self, map: impl Fn(f64, f64) -> [f64; 2]) -> Result<Mesh, FemError> {
        let (x, y) = self.x().iter().zip(self.y()).map(|(&x, &y)| map(x, y).into()).unzip();
        Mesh::new(x, y, self.cells().to_vec())
    }

    /// Sides of the boundary all of whose nodes satisfy `inside`.
    pub fn boundary_where(&self, inside: impl Fn(f64, f64) -> bool) -> Vec<Side> {
        let mut sides = self.boundary();
        sides.retain(|&s| self.side_nodes(s).iter().all(|&n| inside(self.x()[n], self.y()[n])));
        sides
    }

    /// Positions of the nodes \[m\].
    pub fn points(&self) -> Vec<[f64; 2]> {
        self.x().iter().zip(self.y()).map(|(&x, &y)| [x, y]).collect()
    }
}

impl Problem {
    /// Holds one component of `nodes`, 0 along x and 1 along y, at `value` \[m\].
    pub fn fix(&mut self, nodes: &[u32], axis: usize, value: f64) {
        nodes.iter().for_each(|&node| self.prescribed[2 * node as usize + axis] = Some(value));
    }

    /// Prescribes both components of `nodes` as `displacement(x, y)` \[m\] of the undeformed position.
    pub fn prescribe(&mut self, nodes: &[u32], displacement: impl Fn(f64, f64) -> [f64; 2]) {
        for &node in nodes {
            let u = displacement(self.mesh.x()[node as usize], self.mesh.y()[node as usize]);
            (0..2).for_each(|axis| self.fix(&[node], axis, u[axis]));
        }
    }

    /// Pulls `sides` with a traction sampled as in [`Traction::sampled`].
    pub fn pull(&mut self, sides: &[Side], traction: impl Fn([f64; 2], [f64; 2]) -> [f64; 2]) {
        self.tractions.extend(sides.iter().map(|&side| Traction::sampled(&self.mesh, side, &traction)));
    }
}

/// In equilibrium, without a state to begin with.
pub fn solve(problem: &Problem) -> Result<Solution, FemError> {
    solve_near(problem, None, None)
}
