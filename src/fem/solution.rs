//! The displacement found, and what follows from it: strain, stress, energy, forces, values at points.

use super::element::{Gradient, Pairs, REFERENCE_NODES, Rule, Shape};
use super::error::FemError;
use super::locate::cells_near;
use super::material::{Inclusions, Material, Stress};
use super::mesh::Mesh;
use super::problem::Problem;
use super::strain::Strain;
use crate::geometry::Point;

/// A displacement field on a mesh with its material.
#[derive(Debug, Clone)]
pub struct Solution {
    mesh: Mesh,
    material: Material,
    strain: Strain,
    inclusions: Inclusions,
    ux: Vec<f64>,
    uy: Vec<f64>,
}

impl Solution {
    /// A field of the body of a problem from its displacements `ux`, `uy` \[m\], shape \[nodes\].
    ///
    /// # Errors
    /// [`FemError::NotFinite`] for a NaN or an infinity.
    pub(crate) fn of(problem: &Problem, ux: Vec<f64>, uy: Vec<f64>) -> Result<Solution, FemError> {
        if let Some(index) = (0..ux.len()).find(|&i| !(ux[i].is_finite() && uy[i].is_finite())) {
            return Err(FemError::NotFinite { what: "displacement of node", index });
        }
        let Problem { mesh, material, strain, inclusions, .. } = problem;
        let (mesh, inclusions) = (mesh.clone(), inclusions.clone());
        Ok(Solution { mesh, material: *material, strain: *strain, inclusions, ux, uy })
    }

    /// The undeformed mesh.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The material of a cell.
    fn material_of(&self, cell: usize) -> &Material {
        self.inclusions.material(cell, &self.material)
    }

    /// Displacement along x at the nodes \[m\], shape \[nodes\].
    pub fn ux(&self) -> &[f64] {
        &self.ux
    }

    /// Displacement along y at the nodes \[m\], shape \[nodes\].
    pub fn uy(&self) -> &[f64] {
        &self.uy
    }

    /// Displacement \[m\] at each point \[m\] of the undeformed body, by the shape functions of the cell that holds it, shape
    /// \[points\]; points no further outside than `reach` \[m\] take the nearest cell, continued to them.
    ///
    /// # Errors
    /// [`FemError::OutsideMesh`] names the first point further outside.
    pub(crate) fn displacements_within(&self, points: &[Point], reach: f64) -> Result<Vec<Point>, FemError> {
        let first = |cells: &[(usize, Shape)]| cells[0].1.interpolate(&self.of_cell(cells[0].0));
        self.at_places(points, [0.0, reach], first)
    }

    /// The same field on a mesh where cells share nodes with cells of their own material alone, so that stress at a node is
    /// that of one side.
    pub(super) fn parted(&self) -> Solution {
        let (mesh, at) = self.mesh.parted(|cell| self.inclusions.kind(cell, &self.material));
        let of = |values: &[f64]| at.iter().map(|&node| values[node as usize]).collect();
        let (ux, uy, inclusions) = (of(&self.ux), of(&self.uy), self.inclusions.clone());
        Solution { mesh, ux, uy, inclusions, ..*self }
    }

    /// Stress known at the nodes, shape \[nodes\], at each point \[m\]; points no further outside than `reach` \[m\]
    /// take the nearest cell, continued to them. No further than `between` \[m\] from cells of several materials it is the one of the largest
    /// von Mises stress.
    ///
    /// # Errors
    /// As for [`Solution::displacements_within`].
    pub(super) fn interpolated_within(
        &self,
        at_nodes: &[Stress],
        points: &[Point],
        [between, reach]: [f64; 2],
    ) -> Result<Vec<Stress>, FemError> {
        let all = |component: fn(&Stress) -> f64| at_nodes.iter().map(component).collect::<Vec<f64>>();
        let (xx, yy, xy, zz) = (all(|s| s.xx), all(|s| s.yy), all(|s| s.xy), all(|s| s.zz));
        let in_cell = |(cell, shape): &(usize, Shape)| {
            let [in_x, in_y] = shape.interpolate(&self.mesh.gather(*cell, &xx, &yy));
            let [shear, out] = shape.interpolate(&self.mesh.gather(*cell, &xy, &zz));
            Stress { xx: in_x, yy: in_y, xy: shear, zz: out }
        };
        let kind = |cell: usize| self.inclusions.kind(cell, &self.material);
        let by_size = |a: &Stress, b: &Stress| a.von_mises().total_cmp(&b.von_mises());
        let largest = |cells: &[(usize, Shape)]| {
            let is_nearest = |&k: &usize| cells[..k].iter().all(|nearer| kind(nearer.0) != kind(cells[k].0));
            let of_kinds = (0..cells.len()).filter(is_nearest).map(|k| in_cell(&cells[k]));
            of_kinds.max_by(by_size).unwrap_or_default()
        };
        self.at_places(points, [between, reach], largest)
    }

    /// `value` of the cells that hold each point or are no further than `near` from it, the nearest first and never none, with their shape
    /// functions there.
    fn at_places<T>(
        &self,
        points: &[Point],
        [near, reach]: [f64; 2],
        value: impl Fn(&[(usize, Shape)]) -> T,
    ) -> Result<Vec<T>, FemError> {
        let mut cells = cells_near(&self.mesh, points, near);
        let outside: Vec<usize> = (0..points.len()).filter(|&k| cells[k].is_empty()).collect();
        if !outside.is_empty() && reach > near {
            let places: Vec<Point> = outside.iter().map(|&k| points[k]).collect();
            for (k, mut found) in outside.into_iter().zip(cells_near(&self.mesh, &places, reach)) {
                found.truncate(1);
                cells[k] = found;
            }
        }
        let at = |(index, cells): (usize, Vec<(usize, Point)>)| {
            let [x, y] = points[index];
            let cells: Vec<_> = cells.into_iter().map(|(cell, place)| (cell, Shape::at(place))).collect();
            if cells.is_empty() { Err(FemError::OutsideMesh { index, x, y }) } else { Ok(value(&cells)) }
        };
        cells.into_iter().enumerate().map(at).collect()
    }

    /// Stress at a node of a cell by that cell alone; `local` is the node's number in the cell.
    pub(crate) fn stress_at_node(&self, cell: usize, local: usize) -> Stress {
        let (shape, at) = (Shape::at(REFERENCE_NODES[local]), self.mesh.positions(cell));
        self.material_of(cell).stress(self.strain.of(shape.gradient(&at).of(&self.of_cell(cell))))
    }

    /// Elastic energy \[J\]: half the integral of stress times strain over the volume.
    pub fn strain_energy(&self) -> f64 {
        let mut sum = 0.0;
        self.for_each_point(|cell, _, h, volume| {
            let strain = self.strain.of(h);
            let stress = self.material_of(cell).stress(strain);
            let work = stress.xx * strain[0] + stress.yy * strain[1] + stress.xy * strain[2];
            sum += 0.5 * volume * work;
        });
        sum
    }

    /// How far the surroundings of each quadrature point are turned \[rad\], in an order that depends on the mesh alone.
    pub(crate) fn turns(&self) -> Vec<f64> {
        let mut turns = Vec::new();
        self.for_each_point(|_, _, h, _| turns.push(Strain::turn(h)));
        turns
    }

    /// Force that must act on each node to keep this displacement \[N\], shape \[nodes\]: the applied
    /// load at free nodes, load plus reaction at held ones.
    pub(crate) fn nodal_forces(&self) -> Vec<[f64; 2]> {
        let mut force = vec![[0.0; 2]; self.mesh.node_count()];
        self.for_each_point(|cell, gradient, h, volume| {
            let (stress, slope) = (self.material_of(cell).stress(self.strain.of(h)), self.strain.slope(h));
            // Energy by gradient: the first stress of G. Piola and G. Kirchhoff.
            let p: [f64; 4] = std::array::from_fn(|i| {
                volume * (slope[0][i] * stress.xx + slope[1][i] * stress.yy + slope[2][i] * stress.xy)
            });
            for (a, &node) in self.mesh.cell(cell).iter().enumerate() {
                let (dx, dy) = (gradient.dx[a], gradient.dy[a]);
                force[node as usize][0] += dx * p[0] + dy * p[1];
                force[node as usize][1] += dx * p[2] + dy * p[3];
            }
        });
        force
    }

    /// Nodal displacements of a cell.
    pub(crate) fn of_cell(&self, cell: usize) -> Pairs {
        self.mesh.gather(cell, &self.ux, &self.uy)
    }

    /// Stress at the points of `rule` in one cell.
    pub(crate) fn stress_in(&self, cell: usize, rule: &Rule) -> impl Iterator<Item = Stress> {
        let (at, u) = (self.mesh.positions(cell), self.of_cell(cell));
        let strain = move |s: &Shape| self.strain.of(s.gradient(&at).of(&u));
        rule.points.iter().map(move |(s, _)| self.material_of(cell).stress(strain(s)))
    }

    /// Calls `visit(cell, gradient, gradient of the displacement, volume)` at every stiffness quadrature point.
    fn for_each_point(&self, mut visit: impl FnMut(usize, &Gradient, [f64; 4], f64)) {
        let rule = Rule::of_stiffness();
        for cell in 0..self.mesh.cell_count() {
            let (at, u) = (self.mesh.positions(cell), self.of_cell(cell));
            for (shape, weight) in &rule.points {
                let g = shape.gradient(&at);
                visit(cell, &g, g.of(&u), self.material.thickness() * weight * g.det);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::by_hand::solve;
    use crate::fem::{Orthotropic, Plane};

    /// An affine displacement: its strain, and so its stress, is the same everywhere.
    fn affine(x: f64, y: f64) -> [f64; 2] {
        [0.3 + 0.02 * x - 0.01 * y, -0.1 + 0.04 * x + 0.03 * y]
    }
    const STRAIN: [f64; 3] = [0.02, 0.03, 0.03];

    /// The unit square in 4 x 3 cells cut in two, every inner node moved by an amount that differs from node to node:
    /// no cell keeps its shape, and sides are curved.
    fn distorted() -> Mesh {
        let moved = Mesh::rectangle([4, 3], [0.0, 0.0], [1.0, 1.0]).mapped(|x, y| {
            let bubble = 16.0 * x * (1.0 - x) * y * (1.0 - y) * 0.03;
            [x + bubble * (37.0 * x + 11.0 * y).sin(), y + bubble * (23.0 * y - 17.0 * x).cos()]
        });
        moved.unwrap()
    }

    fn materials() -> [Material; 3] {
        let sheet = Orthotropic { e1: 10.0, e2: 2.0, nu12: 0.3, g12: 1.5 };
        [
            Material::isotropic(1.0, 0.3, Plane::Stress, 0.7).unwrap(),
            Material::isotropic(1.0, 0.4, Plane::Strain, 1.0).unwrap(),
            Material::orthotropic(sheet, 0.6, 2.0).unwrap(),
        ]
    }

    fn in_middles(found: &Solution) -> Vec<Stress> {
        let rule = Rule::of_centre();
        (0..found.mesh.cell_count()).flat_map(|cell| found.stress_in(cell, &rule)).collect()
    }

    fn assert_affine(found: &Solution, label: &str) {
        for (i, [x, y]) in found.mesh.points().into_iter().enumerate() {
            let exact = affine(x, y);
            let off = (found.ux[i] - exact[0]).abs().max((found.uy[i] - exact[1]).abs());
            assert!(off < 1e-12, "{label}: node {i} off by {off:e}");
        }
        let exact = found.material.stress(STRAIN);
        let of_cell = |cell: usize| (0..6).map(move |local| found.stress_at_node(cell, local));
        let of_cells = (0..found.mesh.cell_count()).flat_map(of_cell);
        for s in in_middles(found).into_iter().chain(of_cells).chain(found.recovered_stress()) {
            let off = [s.xx - exact.xx, s.yy - exact.yy, s.xy - exact.xy, s.zz - exact.zz];
            assert!(off.iter().all(|v| v.abs() < 1e-11), "{label}: stress {s:?}, not {exact:?}");
        }
    }

    #[test]
    fn an_affine_displacement_of_the_boundary_is_followed_exactly_inside() {
        for material in materials() {
            let mut problem = Problem::new(distorted(), material);
            let on_edge = |t: f64| t == 0.0 || t == 1.0;
            let rim = problem.mesh.nodes_where(|x, y| on_edge(x) || on_edge(y));
            problem.prescribe(&rim, affine);
            assert_affine(&solve(&problem).unwrap(), "held rim");
        }
    }

    #[test]
    fn tractions_of_a_uniform_stress_on_three_sides_return_the_affine_displacement() {
        for material in materials() {
            let bent = |x: f64, y: f64| [x + 0.1 * y * y, y + 0.08 * x * x];
            let mut problem = Problem::new(distorted().mapped(bent).unwrap(), material);
            let (low, high) = (problem.mesh.nodes_where(|x, y| x == 0.0 && y == 0.0), 1.0 - 1e-12);
            problem.prescribe(&low, affine);
            let corner = problem.mesh.nodes_where(|x, y| y < high && y > 0.07 && x >= high);
            let corner = &corner[..1];
            let [x, y] = problem.mesh.points()[corner[0] as usize];
            problem.fix(corner, 1, affine(x, y)[1]);
            let (all, s) = (problem.mesh.boundary(), material.stress(STRAIN));
            problem.pull(&all, |_, n| [s.xx * n[0] + s.xy * n[1], s.xy * n[0] + s.yy * n[1]]);
            assert_affine(&solve(&problem).unwrap(), "pulled rim");
        }
    }

    fn loaded() -> (Problem, Solution) {
        let mut problem = Problem::new(distorted(), materials()[0]);
        let (wall, end) =
            (problem.mesh.nodes_where(|x, _| x == 0.0), problem.mesh.boundary_where(|x, _| x == 1.0));
        problem.prescribe(&wall, |_, _| [0.0; 2]);
        problem.pull(&end, |_, _| [0.1, 0.2]);
        problem.body_force = [0.0, -0.3];
        let found = solve(&problem).unwrap();
        (problem, found)
    }

    #[test]
    fn strain_energy_is_half_the_work_of_the_loads_and_reactions_balance_them() {
        let (problem, found) = loaded();
        let (load, force) = (crate::fem::assemble::nodal_loads(&problem), found.nodal_forces());
        let work: f64 = (0..load.len()).map(|i| load[i][0] * found.ux[i] + load[i][1] * found.uy[i]).sum();
        assert!((found.strain_energy() / (0.5 * work) - 1.0).abs() < 1e-12);
        let mut reaction = [0.0; 2];
        for (i, (f, l)) in force.iter().zip(&load).enumerate() {
            let off = [f[0] - l[0], f[1] - l[1]];
            reaction = [reaction[0] + off[0], reaction[1] + off[1]];
            let held = problem.mesh.x()[i] == 0.0;
            assert!(held || off[0].abs().max(off[1].abs()) < 1e-12, "node {i} pulled by {off:?}");
        }
        // Thickness 0.7: tractions 0.1 and 0.2 on a side of length 1, weight -0.3 on area 1.
        let expected = [-0.07, 0.07];
        assert!((0..2).all(|i| (reaction[i] - expected[i]).abs() < 1e-12), "{reaction:?}");
    }

    #[test]
    fn thickness_scales_the_stiffness_and_leaves_the_stress_of_a_traction_alone() {
        let stress = |thickness: f64| {
            let mut problem = loaded().0;
            problem.material = Material::isotropic(1.0, 0.3, Plane::Stress, thickness).unwrap();
            in_middles(&solve(&problem).unwrap())
        };
        for (thin, thick) in stress(0.1).into_iter().zip(stress(3.0)) {
            assert!((thin.von_mises() / thick.von_mises() - 1.0).abs() < 1e-11);
        }
    }

    fn field(mesh: Mesh, u: impl Fn(f64, f64) -> [f64; 2]) -> Solution {
        let (ux, uy) = mesh.points().into_iter().map(|[x, y]| u(x, y).into()).unzip();
        Solution::of(&Problem::new(mesh, materials()[0]), ux, uy).unwrap()
    }

    #[test]
    fn values_at_points_interpolate_and_points_outside_are_named() {
        let field = field(distorted(), affine);
        let points = [[0.0, 1.0], [0.37, 0.81], [0.5, 0.5], [1.0, 0.2]];
        for (u, [x, y]) in field.displacements_within(&points, 0.0).unwrap().into_iter().zip(points) {
            let exact = affine(x, y);
            assert!((0..2).all(|c| (u[c] - exact[c]).abs() < 1e-12), "({x}, {y})");
        }
        let outside = field.displacements_within(&[[0.5, 0.5], [1.5, 0.5]], 0.0);
        assert_eq!(outside, Err(FemError::OutsideMesh { index: 1, x: 1.5, y: 0.5 }));
    }

    #[test]
    fn a_field_one_degree_up_is_recovered_closely() {
        let field = field(Mesh::rectangle([8, 8], [0.0, 0.0], [1.0, 1.0]), |x, _| [x.powi(3), 0.0]);
        let exact = |x: f64| field.material.stress([3.0 * x * x, 0.0, 0.0]).xx;
        let off = |(stress, x): (&Stress, &f64)| (stress.xx - exact(*x)).abs();
        let worst = field.recovered_stress().iter().zip(field.mesh.x()).map(off).fold(0.0, f64::max);
        assert!(worst < 0.06, "off by {worst}");
    }
}
