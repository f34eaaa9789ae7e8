//! From the problem to K u = f: element stiffness, consistent loads, and the sparse matrix over the
//! components that are not prescribed.
//!
//! Source: Zienkiewicz, Taylor and Zhu, "The Finite Element Method: Its Basis and Fundamentals",
//! 7th ed. (2013), chapters 2 (K = integral of B' D B) and 7 (consistent loads). Prescribed components are
//! eliminated, K_ff u_f = f_f - K_fc u_c; no penalty enters. Every sum runs in the order of cells, points
//! and nodes, so the same input gives the same bits.

use super::element::{GAUSS_3, Gradient, NODES, Rule, side_shape};
use super::mesh::Mesh;
use super::problem::{Problem, along_side};
use super::solution::Solution;
use super::strain::Strain;

/// Number of displacement components of a cell.
const COMPONENTS: usize = 2 * NODES;

/// Stiffness of one cell, components x and y of a node together [N/m]; only i >= j is filled.
type CellMatrix = [[f64; COMPONENTS]; COMPONENTS];

/// The reduced system: lower triangle by columns, right-hand side, and where each component went.
pub(crate) struct System {
    /// Number of each component among the unknowns, `None` if prescribed; shape [2 * nodes].
    pub unknown: Vec<Option<usize>>,
    /// Column starts, shape [unknowns + 1].
    pub starts: Vec<usize>,
    /// Row of each stored entry, ascending in a column, the diagonal first.
    pub rows: Vec<usize>,
    /// Value of each stored entry [N/m].
    pub values: Vec<f64>,
    /// f_f - K_fc u_c \[N\], shape \[unknowns\].
    pub load: Vec<f64>,
}

/// Builds the reduced system of the nodal forces \[N\], shape \[nodes\]; at a displacement that of a step from there: its
/// tangent, the forces that are left, and the steps of prescribed components.
pub(crate) fn assemble(
    problem: &Problem,
    prescribed: &[Option<f64>],
    forces: &[[f64; 2]],
    at: Option<&Solution>,
) -> System {
    let mut count = 0;
    let mut number = || {
        count += 1;
        count - 1
    };
    let unknown: Vec<_> = prescribed.iter().map(|p| p.is_none().then(&mut number)).collect();
    let (starts, rows) = pattern(&problem.mesh, &unknown, count);
    let load = (0..unknown.len()).filter(|&c| unknown[c].is_some()).map(|c| forces[c / 2][c % 2]).collect();
    let values = vec![0.0; rows.len()];
    let mut system = System { unknown, starts, rows, values, load };
    system.add_cells(problem, prescribed, at);
    system
}

/// The pattern of the lower triangle: two components couple if a cell holds both their nodes.
fn pattern(mesh: &Mesh, unknown: &[Option<usize>], count: usize) -> (Vec<usize>, Vec<usize>) {
    let cells = mesh.cells_of_nodes();
    let (mut starts, mut rows) = (Vec::with_capacity(count + 1), Vec::new());
    let mut neighbours: Vec<u32> = Vec::new();
    starts.push(0);
    for node in 0..mesh.node_count() {
        neighbours.clear();
        for &cell in cells.of(node) {
            neighbours.extend(mesh.cell(cell as usize).iter().filter(|&&n| n as usize >= node));
        }
        neighbours.sort_unstable();
        neighbours.dedup();
        for column in unknown[2 * node..2 * node + 2].iter().flatten() {
            let components = neighbours.iter().flat_map(|&n| &unknown[2 * n as usize..2 * n as usize + 2]);
            rows.extend(components.flatten().filter(|row| *row >= column));
            starts.push(rows.len());
        }
    }
    (starts, rows)
}

impl System {
    fn add_cells(&mut self, problem: &Problem, prescribed: &[Option<f64>], solved: Option<&Solution>) {
        let (mesh, rule) = (&problem.mesh, Rule::of_stiffness());
        for cell in 0..mesh.cell_count() {
            let at = mesh.positions(cell);
            let mut k = [[0.0; COMPONENTS]; COMPONENTS];
            let material = problem.inclusions.material(cell, &problem.material);
            for (shape, weight) in &rule.points {
                let g = shape.gradient(&at);
                let (d, weight) = (material.stiffness(), weight * g.det);
                match solved {
                    None => add_stiffness(&mut k, &g, d, weight),
                    Some(solved) => {
                        let h = g.of(&solved.of_cell(cell));
                        add_tangent(&mut k, &g, &Strain::Stretch.tangent(h, d), weight);
                    }
                }
            }
            let mut component = [0; COMPONENTS];
            for (a, &node) in mesh.cell(cell).iter().enumerate() {
                component[2 * a] = 2 * node as usize;
                component[2 * a + 1] = 2 * node as usize + 1;
            }
            self.scatter(&k, &component, problem.material.thickness(), prescribed);
        }
    }

    fn scatter(
        &mut self,
        k: &CellMatrix,
        component: &[usize; COMPONENTS],
        thickness: f64,
        prescribed: &[Option<f64>],
    ) {
        for (i, j) in (0..COMPONENTS).flat_map(|i| (0..=i).map(move |j| (i, j))) {
            let (a, b, value) = (component[i], component[j], thickness * k[i][j]);
            match (self.unknown[a], self.unknown[b]) {
                (Some(p), Some(q)) => {
                    let (row, column) = (p.max(q), p.min(q));
                    let span = self.starts[column]..self.starts[column + 1];
                    let place = self.rows[span.clone()].binary_search(&row).expect("a pair of one cell");
                    self.values[span.start + place] += value;
                }
                (Some(p), None) => self.load[p] -= value * prescribed[b].unwrap_or(0.0),
                (None, Some(q)) => self.load[q] -= value * prescribed[a].unwrap_or(0.0),
                (None, None) => {}
            }
        }
    }
}

/// Adds `weight` B' D B. The column of B of node a is [dx, 0, dy] for x and [0, dy, dx] for y.
fn add_stiffness(k: &mut CellMatrix, g: &Gradient, d: &[[f64; 3]; 3], weight: f64) {
    for b in 0..NODES {
        let (bx, by) = (weight * g.dx[b], weight * g.dy[b]);
        let sx = [0, 1, 2].map(|r| d[r][0] * bx + d[r][2] * by);
        let sy = [0, 1, 2].map(|r| d[r][1] * by + d[r][2] * bx);
        for a in b..NODES {
            k[2 * a][2 * b] += g.dx[a] * sx[0] + g.dy[a] * sx[2];
            k[2 * a + 1][2 * b] += g.dy[a] * sx[1] + g.dx[a] * sx[2];
            k[2 * a][2 * b + 1] += g.dx[a] * sy[0] + g.dy[a] * sy[2];
            k[2 * a + 1][2 * b + 1] += g.dy[a] * sy[1] + g.dx[a] * sy[2];
        }
    }
}

/// Adds `weight` times the second derivatives of the energy density `d`, by the gradient (xx, xy, yx, yy).
fn add_tangent(k: &mut CellMatrix, g: &Gradient, d: &[[f64; 4]; 4], weight: f64) {
    for (b, j) in (0..NODES).flat_map(|b| [(b, 0), (b, 1)]) {
        let (bx, by) = (weight * g.dx[b], weight * g.dy[b]);
        let s: [f64; 4] = std::array::from_fn(|r| d[r][2 * j] * bx + d[r][2 * j + 1] * by);
        for (a, i) in (b..NODES).flat_map(|a| [(a, 0), (a, 1)]) {
            k[2 * a + i][2 * b + j] += g.dx[a] * s[2 * i] + g.dy[a] * s[2 * i + 1];
        }
    }
}

/// Point forces, consistent side loads (integral of N t) and body force (integral of N b), \[N\] per node.
pub(crate) fn nodal_loads(problem: &Problem) -> Vec<[f64; 2]> {
    let (mesh, thickness) = (&problem.mesh, problem.material.thickness());
    let mut load = vec![[0.0; 2]; mesh.node_count()];
    let mut add = |node: usize, weight: f64, force: [f64; 2]| {
        load[node][0] += weight * force[0];
        load[node][1] += weight * force[1];
    };
    for &(node, force) in &problem.forces {
        add(node, 1.0, force);
    }
    for t in &problem.tractions {
        for ([s, weight], traction) in GAUSS_3.into_iter().zip(t.at_gauss) {
            let (_, tangent) = along_side(mesh, t.side, s);
            let area = thickness * weight * tangent[0].hypot(tangent[1]);
            for (node, [shape, _]) in mesh.side_nodes(t.side).into_iter().zip(side_shape(s)) {
                add(node, area * shape, traction);
            }
        }
    }
    if problem.body_force != [0.0; 2] {
        let rule = Rule::fine();
        for cell in 0..mesh.cell_count() {
            let at = mesh.positions(cell);
            for (shape, weight) in &rule.points {
                let volume = thickness * weight * shape.determinant(&at);
                for (a, &node) in mesh.cell(cell).iter().enumerate() {
                    add(node as usize, volume * shape.n[a], problem.body_force);
                }
            }
        }
    }
    load
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::{Material, Plane};

    fn unit() -> Problem {
        let mesh = Mesh::rectangle([1, 1], [0.0, 0.0], [1.0, 1.0]);
        Problem::new(mesh, Material::isotropic(1.0, 0.3, Plane::Stress, 2.0).unwrap())
    }

    #[test]
    fn a_uniform_traction_splits_as_one_sixth_four_sixths_one_sixth() {
        let mut p = unit();
        let side = p.mesh.boundary_where(|x, _| x == 1.0);
        p.pull(&side, |_, _| [0.0, 3.0]);
        let load = nodal_loads(&p);
        for (node, share) in p.mesh.side_nodes(side[0]).into_iter().zip([1.0, 1.0, 4.0]) {
            assert!((load[node][1] - share).abs() < 1e-14 && load[node][0] == 0.0, "{:?}", load[node]);
        }
    }

    #[test]
    fn body_force_and_point_forces_add_up_to_their_resultant() {
        let mut p = unit();
        p.body_force = [1.5, -9.81];
        p.forces.push((2, [0.0, 1.0]));
        let sum = nodal_loads(&p).iter().fold([0.0; 2], |s, f| [s[0] + f[0], s[1] + f[1]]);
        assert!((sum[0] - 3.0).abs() < 1e-13 && (sum[1] + 18.62).abs() < 1e-13, "{sum:?}");
    }

    #[test]
    fn the_free_stiffness_has_no_force_for_translations_and_rotation() {
        let p = unit();
        let system = assemble(&p, &p.prescribed, &nodal_loads(&p), None);
        for motion in [|_| [1.0, 0.0], |_| [0.0, 1.0], |[x, y]: [f64; 2]| [-y, x]] {
            let u: Vec<f64> = p.mesh.points().into_iter().flat_map(motion).collect();
            let mut force = vec![0.0; u.len()];
            for j in 0..u.len() {
                for at in system.starts[j]..system.starts[j + 1] {
                    let i = system.rows[at];
                    force[i] += system.values[at] * u[j];
                    force[j] += if i == j { 0.0 } else { system.values[at] * u[i] };
                }
            }
            assert!(force.iter().all(|f| f.abs() < 1e-13), "{force:?}");
        }
    }
}
