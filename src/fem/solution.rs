//! The displacement found, and what follows from it: strain, stress, energy, forces, values at points.

use super::element::{Gradient, Rule, Shape};
use super::error::FemError;
use super::locate::Locator;
use super::material::{Inclusions, Material, Stress};
use super::mesh::Mesh;
use super::strain::Strain;

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
    /// A field from displacements that came from elsewhere: `ux`, `uy` \[m\], shape \[nodes\]. This is how
    /// another method's displacements on the same mesh are put through the same stress formula.
    ///
    /// # Errors
    /// [`FemError::Length`] if the arrays do not have one entry per node, [`FemError::NotFinite`] for a
    /// NaN or an infinity.
    pub(crate) fn from_displacements(
        mesh: Mesh,
        material: Material,
        ux: Vec<f64>,
        uy: Vec<f64>,
    ) -> Result<Solution, FemError> {
        for (what, u) in [("ux", &ux), ("uy", &uy)] {
            if u.len() != mesh.node_count() {
                let expected = mesh.node_count().to_string();
                return Err(FemError::Length { what, found: u.len(), expected });
            }
        }
        if let Some(index) = (0..ux.len()).find(|&i| !(ux[i].is_finite() && uy[i].is_finite())) {
            return Err(FemError::NotFinite { what: "displacement of node", index });
        }
        let (strain, inclusions) = (Strain::Small, Inclusions::default());
        Ok(Solution { mesh, material, strain, inclusions, ux, uy })
    }

    /// The same displacements, another strain.
    pub(crate) fn with_strain(self, strain: Strain) -> Solution {
        Solution { strain, ..self }
    }

    /// The measure of strain. Of stretches, strain and stress are those in axes that turn with the body, from the
    /// mesh's.
    pub fn strain(&self) -> Strain {
        self.strain
    }

    /// The undeformed mesh.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The same field where some cells are of other materials.
    pub(super) fn with_inclusions(self, inclusions: Inclusions) -> Self {
        Solution { inclusions, ..self }
    }

    /// The material of a cell.
    fn material_of(&self, cell: usize) -> &Material {
        self.inclusions.material(cell, &self.material)
    }

    /// The material, outside inclusions.
    pub fn material(&self) -> &Material {
        &self.material
    }

    /// Displacement along x at the nodes \[m\], shape \[nodes\].
    pub fn ux(&self) -> &[f64] {
        &self.ux
    }

    /// Displacement along y at the nodes \[m\], shape \[nodes\].
    pub fn uy(&self) -> &[f64] {
        &self.uy
    }

    /// Displacement \[m\] at each point (x, y) \[m\] of the undeformed body, by the shape functions of the
    /// cell that holds it; shape \[points\].
    ///
    /// # Errors
    /// [`FemError::Length`] if `x` and `y` differ in length; [`FemError::OutsideMesh`] names the first
    /// point that lies in no cell.
    pub fn displacements_at(&self, x: &[f64], y: &[f64]) -> Result<Vec<[f64; 2]>, FemError> {
        self.displacements_within(x, y, 0.0)
    }

    /// The same, where points no further outside than `reach` \[m\] take the nearest cell, continued to them.
    ///
    /// # Errors
    /// As for [`Solution::displacements_at`].
    pub(crate) fn displacements_within(
        &self,
        x: &[f64],
        y: &[f64],
        reach: f64,
    ) -> Result<Vec<[f64; 2]>, FemError> {
        let n = self.mesh.kind().nodes();
        let first = |cells: &[(usize, Shape)]| {
            let (cell, shape) = &cells[0];
            shape.interpolate(&self.of_cell(*cell)[..n])
        };
        self.at_places(x, y, [0.0, reach], first)
    }

    /// The same field on a mesh where cells share nodes with cells of their own material alone, so that stress at a node is
    /// that of one side; the second array has the node of this mesh that each is at.
    pub(super) fn parted(&self) -> (Solution, Vec<u32>) {
        let (mesh, at) = self.mesh.parted(|cell| self.inclusions.kind(cell, &self.material));
        let of = |values: &[f64]| at.iter().map(|&node| values[node as usize]).collect();
        let Self { material, strain, inclusions, .. } = self;
        let (ux, uy, inclusions) = (of(&self.ux), of(&self.uy), inclusions.clone());
        (Solution { mesh, material: *material, strain: *strain, inclusions, ux, uy }, at)
    }

    /// Stress known at the nodes, shape \[nodes\], at each point (x, y) \[m\]; points no further outside than `reach` \[m\]
    /// take the nearest cell, continued to them. No further than `between` \[m\] from cells of several materials it is the one of the largest
    /// von Mises stress.
    ///
    /// # Errors
    /// As for [`Solution::displacements_at`].
    pub(super) fn interpolated_within(
        &self,
        at_nodes: &[Stress],
        [x, y]: [&[f64]; 2],
        [between, reach]: [f64; 2],
    ) -> Result<Vec<Stress>, FemError> {
        let all = |component: fn(&Stress) -> f64| at_nodes.iter().map(component).collect::<Vec<f64>>();
        let (xx, yy, xy, zz) = (all(|s| s.xx), all(|s| s.yy), all(|s| s.xy), all(|s| s.zz));
        let n = self.mesh.kind().nodes();
        let in_cell = |(cell, shape): &(usize, Shape)| {
            let [in_x, in_y] = shape.interpolate(&self.mesh.gather(*cell, &xx, &yy)[..n]);
            let [shear, out] = shape.interpolate(&self.mesh.gather(*cell, &xy, &zz)[..n]);
            Stress { xx: in_x, yy: in_y, xy: shear, zz: out }
        };
        let kind = |cell: usize| self.inclusions.kind(cell, &self.material);
        let by_size = |a: &Stress, b: &Stress| a.von_mises().total_cmp(&b.von_mises());
        let largest = |cells: &[(usize, Shape)]| {
            let is_nearest = |&k: &usize| cells[..k].iter().all(|nearer| kind(nearer.0) != kind(cells[k].0));
            let of_kinds = (0..cells.len()).filter(is_nearest).map(|k| in_cell(&cells[k]));
            of_kinds.max_by(by_size).unwrap_or_default()
        };
        self.at_places(x, y, [between, reach], largest)
    }

    /// `value` of the cells that hold each point or are no further than `near` from it, the nearest first and never none, with their shape
    /// functions there.
    fn at_places<T>(
        &self,
        x: &[f64],
        y: &[f64],
        [near, reach]: [f64; 2],
        value: impl Fn(&[(usize, Shape)]) -> T,
    ) -> Result<Vec<T>, FemError> {
        if x.len() != y.len() {
            return Err(FemError::Length { what: "y", found: y.len(), expected: x.len().to_string() });
        }
        let locator = Locator::new(&self.mesh);
        let at = |(index, (&x, &y)): (usize, (&f64, &f64))| {
            let mut cells = locator.near([x, y], near);
            if cells.is_empty() && reach > near {
                cells = locator.near([x, y], reach);
                cells.truncate(1);
            }
            let cells = cells.into_iter().map(|(cell, place)| (cell, self.mesh.kind().shape(place)));
            let cells: Vec<(usize, Shape)> = cells.collect();
            if cells.is_empty() { Err(FemError::OutsideMesh { index, x, y }) } else { Ok(value(&cells)) }
        };
        x.iter().zip(y).enumerate().map(at).collect()
    }

    /// Stress at the centre of each cell, shape \[cells\]. For the linear kinds the centre is where it is
    /// most accurate (J. Barlow, 1976).
    pub fn stress_at_cells(&self) -> Vec<Stress> {
        let shape = self.mesh.kind().shape(self.mesh.kind().reference_centre());
        let rule = Rule { points: vec![(shape, 1.0)] };
        (0..self.mesh.cell_count()).map(|c| self.stress_in(c, &rule).next().unwrap_or_default()).collect()
    }

    /// Stress at a node of a cell by that cell alone; `local` is the node's number in the cell.
    pub(crate) fn stress_at_node(&self, cell: usize, local: usize) -> Stress {
        let kind = self.mesh.kind();
        let shape = kind.shape(kind.reference_nodes()[local]);
        let (n, at, u) = (kind.nodes(), self.mesh.positions(cell), self.of_cell(cell));
        self.material_of(cell).stress(self.strain.of(shape.gradient(&at[..n]).of(&u[..n])))
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

    /// Distance from a known displacement `exact(x, y)` \[m\] and that displacement's own size, both in the
    /// L2 norm over the body's area, sqrt(integral of |u|^2) \[m2\], by quadrature of degree 8.
    pub fn l2_error(&self, exact: impl Fn(f64, f64) -> [f64; 2]) -> [f64; 2] {
        let (n, rule) = (self.mesh.kind().nodes(), self.mesh.kind().fine_rule());
        let mut sums = [0.0; 2];
        for cell in 0..self.mesh.cell_count() {
            let (at, u) = (self.mesh.positions(cell), self.of_cell(cell));
            for (shape, weight) in &rule.points {
                let area = weight * shape.determinant(&at[..n]);
                let ([x, y], found) = (shape.interpolate(&at[..n]), shape.interpolate(&u[..n]));
                let true_u = exact(x, y);
                for i in 0..2 {
                    sums[0] += area * (found[i] - true_u[i]).powi(2);
                    sums[1] += area * true_u[i].powi(2);
                }
            }
        }
        sums.map(f64::sqrt)
    }

    /// Nodal displacements of a cell, padded.
    pub(crate) fn of_cell(&self, cell: usize) -> [[f64; 2]; super::element::MAX_NODES] {
        self.mesh.gather(cell, &self.ux, &self.uy)
    }

    /// Stress at the points of `rule` in one cell.
    pub(crate) fn stress_in(&self, cell: usize, rule: &Rule) -> impl Iterator<Item = Stress> {
        let (n, at, u) = (self.mesh.kind().nodes(), self.mesh.positions(cell), self.of_cell(cell));
        let strain = move |s: &Shape| self.strain.of(s.gradient(&at[..n]).of(&u[..n]));
        rule.points.iter().map(move |(s, _)| self.material_of(cell).stress(strain(s)))
    }

    /// Calls `visit(cell, gradient, gradient of the displacement, volume)` at every stiffness quadrature point.
    fn for_each_point(&self, mut visit: impl FnMut(usize, &Gradient, [f64; 4], f64)) {
        let (n, rule) = (self.mesh.kind().nodes(), self.mesh.kind().stiffness_rule());
        for cell in 0..self.mesh.cell_count() {
            let (at, u) = (self.mesh.positions(cell), self.of_cell(cell));
            for (shape, weight) in &rule.points {
                let g = shape.gradient(&at[..n]);
                visit(cell, &g, g.of(&u[..n]), self.material.thickness() * weight * g.det);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::{Axis, CellKind, Orthotropic, Plane, Problem, solve};

    /// An affine displacement: its strain, and so its stress, is the same everywhere.
    fn affine(x: f64, y: f64) -> [f64; 2] {
        [0.3 + 0.02 * x - 0.01 * y, -0.1 + 0.04 * x + 0.03 * y]
    }
    const STRAIN: [f64; 3] = [0.02, 0.03, 0.03];

    /// The unit square in 4 x 3 cells, every inner node moved by an amount that differs from node to node:
    /// no cell keeps its shape, and the quadratic ones get curved sides.
    fn distorted(kind: CellKind) -> Mesh {
        let straight = Mesh::rectangle(kind, [4, 3], [0.0, 0.0], [1.0, 1.0]).unwrap();
        let bend = 0.06 / kind.degree() as f64;
        let moved = straight.mapped(|x, y| {
            let bubble = 16.0 * x * (1.0 - x) * y * (1.0 - y) * bend;
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

    fn assert_affine(found: &Solution, label: &str) {
        for (i, (&x, &y)) in found.mesh.x().iter().zip(found.mesh.y()).enumerate() {
            let exact = affine(x, y);
            let off = (found.ux[i] - exact[0]).abs().max((found.uy[i] - exact[1]).abs());
            assert!(off < 1e-12, "{label}: node {i} off by {off:e}");
        }
        let exact = found.material.stress(STRAIN);
        for s in found.stress_at_cells().iter().chain(&found.stress_at_points()) {
            let off = [s.xx - exact.xx, s.yy - exact.yy, s.xy - exact.xy, s.zz - exact.zz];
            assert!(off.iter().all(|v| v.abs() < 1e-11), "{label}: stress {s:?}, not {exact:?}");
        }
    }

    #[test]
    fn an_affine_displacement_of_the_boundary_is_followed_exactly_inside() {
        for (kind, material) in CellKind::ALL.into_iter().flat_map(|k| materials().map(|m| (k, m))) {
            let mut problem = Problem::new(distorted(kind), material);
            let on_edge = |t: f64| t == 0.0 || t == 1.0;
            let rim = problem.mesh.nodes_where(|x, y| on_edge(x) || on_edge(y));
            problem.prescribe(&rim, affine);
            assert_affine(&solve(&problem).unwrap(), &format!("{kind:?}, held rim"));
        }
    }

    #[test]
    fn tractions_of_a_uniform_stress_on_three_sides_return_the_affine_displacement() {
        for (kind, material) in CellKind::ALL.into_iter().flat_map(|k| materials().map(|m| (k, m))) {
            let bent = |x: f64, y: f64| [x + 0.1 * y * y, y + 0.08 * x * x];
            let mut problem = Problem::new(distorted(kind).mapped(bent).unwrap(), material);
            let (low, high) = (problem.mesh.nodes_where(|x, y| x == 0.0 && y == 0.0), 1.0 - 1e-12);
            problem.prescribe(&low, affine);
            let corner = problem.mesh.nodes_where(|x, y| y < high && y > 0.07 && x >= high);
            let corner = &corner[..1];
            let [x, y] = [problem.mesh.x(), problem.mesh.y()].map(|v| v[corner[0] as usize]);
            problem.fix(corner, Axis::Y, affine(x, y)[1]);
            let (all, s) = (problem.mesh.boundary(), material.stress(STRAIN));
            problem.pull_with(&all, |_, n| [s.xx * n[0] + s.xy * n[1], s.xy * n[0] + s.yy * n[1]]);
            assert_affine(&solve(&problem).unwrap(), &format!("{kind:?}, pulled rim"));
        }
    }

    fn loaded(kind: CellKind) -> (Problem, Solution) {
        let mut problem = Problem::new(distorted(kind), materials()[0]);
        let (wall, end) =
            (problem.mesh.nodes_where(|x, _| x == 0.0), problem.mesh.boundary_where(|x, _| x == 1.0));
        problem.prescribe(&wall, |_, _| [0.0; 2]);
        problem.pull(&end, [0.1, 0.2]);
        problem.body_force = [0.0, -0.3];
        let found = solve(&problem).unwrap();
        (problem, found)
    }

    #[test]
    fn strain_energy_is_half_the_work_of_the_loads_and_reactions_balance_them() {
        for kind in CellKind::ALL {
            let (problem, found) = loaded(kind);
            let (load, force) = (crate::fem::assemble::nodal_loads(&problem), found.nodal_forces());
            let work: f64 =
                (0..load.len()).map(|i| load[i][0] * found.ux[i] + load[i][1] * found.uy[i]).sum();
            assert!((found.strain_energy() / (0.5 * work) - 1.0).abs() < 1e-12, "{kind:?}");
            let mut reaction = [0.0; 2];
            for (i, (f, l)) in force.iter().zip(&load).enumerate() {
                let off = [f[0] - l[0], f[1] - l[1]];
                reaction = [reaction[0] + off[0], reaction[1] + off[1]];
                let held = problem.mesh.x()[i] == 0.0;
                assert!(
                    held || off[0].abs().max(off[1].abs()) < 1e-12,
                    "{kind:?}: node {i} pulled by {off:?}"
                );
            }
            // Thickness 0.7: tractions 0.1 and 0.2 on a side of length 1, weight -0.3 on area 1.
            let expected = [-0.07, 0.07];
            assert!((0..2).all(|i| (reaction[i] - expected[i]).abs() < 1e-12), "{kind:?}: {reaction:?}");
        }
    }

    #[test]
    fn thickness_scales_the_stiffness_and_leaves_the_stress_of_a_traction_alone() {
        let stress = |thickness: f64| {
            let mut problem = loaded(CellKind::Quad9).0;
            problem.material = Material::isotropic(1.0, 0.3, Plane::Stress, thickness).unwrap();
            solve(&problem).unwrap().stress_at_cells()
        };
        for (thin, thick) in stress(0.1).into_iter().zip(stress(3.0)) {
            assert!((thin.von_mises() / thick.von_mises() - 1.0).abs() < 1e-11);
        }
    }

    #[test]
    fn values_at_points_interpolate_and_points_outside_are_named() {
        for kind in CellKind::ALL {
            let mesh = distorted(kind);
            let (ux, uy) = mesh.x().iter().zip(mesh.y()).map(|(&x, &y)| affine(x, y).into()).unzip();
            let field = Solution::from_displacements(mesh, materials()[0], ux, uy).unwrap();
            let (x, y) = ([0.0, 0.37, 0.5, 1.0], [1.0, 0.81, 0.5, 0.2]);
            for (i, u) in field.displacements_at(&x, &y).unwrap().into_iter().enumerate() {
                let exact = affine(x[i], y[i]);
                assert!((0..2).all(|c| (u[c] - exact[c]).abs() < 1e-12), "{kind:?}: point {i}");
            }
            let outside = field.displacements_at(&[0.5, 1.5], &[0.5, 0.5]);
            assert_eq!(outside, Err(FemError::OutsideMesh { index: 1, x: 1.5, y: 0.5 }));
        }
    }

    #[test]
    fn a_field_one_degree_up_is_recovered_exactly_on_squares_and_closely_on_triangles() {
        for kind in CellKind::ALL {
            let mesh = Mesh::rectangle(kind, [8, 8], [0.0, 0.0], [1.0, 1.0]).unwrap();
            let (ux, uy) = mesh.x().iter().map(|&x| (x.powi(kind.degree() as i32 + 1), 0.0)).unzip();
            let field = Solution::from_displacements(mesh, materials()[0], ux, uy).unwrap();
            let exact = |x: f64| {
                let slope = (kind.degree() + 1) as f64 * x.powi(kind.degree() as i32);
                field.material.stress([slope, 0.0, 0.0]).xx
            };
            let at_points = field.stress_at_points();
            let off = |i: usize| (at_points[i].xx - exact(field.mesh.x()[i])).abs();
            let worst = (0..field.mesh.node_count()).map(off).fold(0.0, f64::max);
            // Squares are superconvergent at the sample points, so the fit is exact, also at the boundary.
            let bound = if kind.corners() == 4 { 1e-12 } else { 0.06 };
            assert!(worst < bound, "{kind:?}: off by {worst}");
        }
    }
}
