//! Stress at the nodes by superconvergent patch recovery.
//!
//! Around each corner node a quadratic polynomial is fitted by least squares to
//! the stress at the most accurate points of the surrounding cells; its value at a node is the recovered
//! stress, averaged where several patches reach a node. Source: O. C. Zienkiewicz and J. Z. Zhu, Int. J.
//! Numer. Meth. Engng 33 (1992) 1331-1364. Patches at the boundary, too small for the fit, are grown by
//! the next ring of cells.

use super::element::{CORNERS, Rule};
use super::material::Stress;
use super::mesh::Mesh;
use super::solution::Solution;
use crate::geometry::lists::distinct;

/// Terms of the quadratic polynomial 1, x, y, x2, xy, y2; the linear one uses the first three.
const TERMS: usize = 6;

/// A stress sample and where it was taken.
type Sample = ([f64; 2], [f64; 4]);

impl Solution {
    /// Stress at each node of a mesh whose cells share nodes with cells of their own material alone, shape \[nodes\]; one order more
    /// accurate inside than the stress of a single cell. Near a singular corner it spreads the peak.
    pub(super) fn recovered_stress(&self) -> Vec<Stress> {
        self.recovered_from(&Rule::of_stress())
    }

    /// The same from the stress at other points of the cells.
    pub(super) fn recovered_from(&self, rule: &Rule) -> Vec<Stress> {
        let mesh = self.mesh();
        let samples = self.samples(rule);
        let cells = mesh.cells_of_nodes();
        let around = |node: usize| cells.of(node);
        let mut sums = vec![([0.0; 4], 0.0); mesh.node_count()];
        let corners = corner_nodes(mesh);
        for vertex in (0..mesh.node_count()).filter(|&n| corners[n]) {
            let fit = fit_patch(mesh, vertex, around, &samples);
            for node in reached(mesh, vertex, around(vertex), &corners) {
                let value = fit.at([mesh.x()[node], mesh.y()[node]]);
                for (sum, v) in sums[node].0.iter_mut().zip(value) {
                    *sum += v;
                }
                sums[node].1 += 1.0;
            }
        }
        let mean = |(s, count): ([f64; 4], f64)| s.map(|v| v / count);
        sums.into_iter().map(mean).map(|[xx, yy, xy, zz]| Stress { xx, yy, xy, zz }).collect()
    }

    /// The samples of each cell, shape \[cells\]\[points\].
    fn samples(&self, rule: &Rule) -> Vec<Vec<Sample>> {
        let mesh = self.mesh();
        let of_cell = |cell: usize| {
            let at = mesh.positions(cell);
            let points = rule.points.iter().map(|(s, _)| s.interpolate(&at));
            points.zip(self.stress_in(cell, rule).map(|s| [s.xx, s.yy, s.xy, s.zz])).collect()
        };
        (0..mesh.cell_count()).map(of_cell).collect()
    }
}

fn corner_nodes(mesh: &Mesh) -> Vec<bool> {
    let mut corner = vec![false; mesh.node_count()];
    for cell in 0..mesh.cell_count() {
        for &node in &mesh.cell(cell)[..CORNERS] {
            corner[node as usize] = true;
        }
    }
    corner
}

/// The vertex itself and the nodes of its cells that are no corners, ascending.
fn reached(mesh: &Mesh, vertex: usize, cells: &[u32], corners: &[bool]) -> Vec<usize> {
    let nodes = cells.iter().flat_map(|&c| mesh.cell(c as usize)).map(|&n| n as usize);
    distinct(nodes.filter(|&n| n == vertex || !corners[n]))
}

/// A fitted polynomial in scaled coordinates (x - x0) / size.
struct Fit {
    origin: [f64; 2],
    size: f64,
    coefficients: [[f64; TERMS]; 4],
}

impl Fit {
    fn terms(&self, p: [f64; 2]) -> [f64; TERMS] {
        let (x, y) = ((p[0] - self.origin[0]) / self.size, (p[1] - self.origin[1]) / self.size);
        [1.0, x, y, x * x, x * y, y * y]
    }

    fn at(&self, p: [f64; 2]) -> [f64; 4] {
        let terms = self.terms(p);
        self.coefficients.map(|c| c.iter().zip(terms).map(|(c, t)| c * t).sum())
    }
}

/// Grows the patch until the fit is determined; if the whole part is too small for that, lowers the
/// degree, down to the mean.
fn fit_patch<'a>(
    mesh: &Mesh,
    vertex: usize,
    around: impl Fn(usize) -> &'a [u32],
    samples: &[Vec<Sample>],
) -> Fit {
    let origin = [mesh.x()[vertex], mesh.y()[vertex]];
    let mut patch = around(vertex).to_vec();
    loop {
        let points: Vec<&Sample> = patch.iter().flat_map(|&c| &samples[c as usize]).collect();
        if points.len() > TERMS
            && let Some(fit) = least_squares(origin, &points, TERMS)
        {
            return fit;
        }
        let nodes = patch.iter().flat_map(|&c| mesh.cell(c as usize));
        let grown = distinct(nodes.flat_map(|&n| around(n as usize)).copied());
        if grown.len() == patch.len() {
            return [TERMS, 3, 1]
                .into_iter()
                .filter_map(|terms| least_squares(origin, &points, terms))
                .next()
                .expect("the mean of at least one sample exists");
        }
        patch = grown;
    }
}

/// Normal equations in scaled coordinates; `None` if the points do not determine the polynomial.
fn least_squares(origin: [f64; 2], points: &[&Sample], terms: usize) -> Option<Fit> {
    let reach = points.iter().map(|(p, _)| (p[0] - origin[0]).hypot(p[1] - origin[1])).fold(0.0, f64::max);
    let mut fit = Fit { origin, size: reach, coefficients: [[0.0; TERMS]; 4] };
    let (mut matrix, mut sides) = ([[0.0; TERMS]; TERMS], [[0.0; TERMS]; 4]);
    for (p, stress) in points {
        let row = fit.terms(*p);
        for i in 0..terms {
            for j in 0..=i {
                matrix[i][j] += row[i] * row[j];
            }
            for (side, s) in sides.iter_mut().zip(stress) {
                side[i] += row[i] * s;
            }
        }
    }
    cholesky(&mut matrix, terms)?;
    fit.coefficients = sides.map(|side| substitute(&matrix, terms, side));
    Some(fit)
}

/// Overwrites the lower triangle of the leading n x n block with its Cholesky factor; `None` if a pivot
/// falls below 1e-8 of its diagonal entry.
fn cholesky(m: &mut [[f64; TERMS]; TERMS], n: usize) -> Option<()> {
    for j in 0..n {
        let pivot = m[j][j] - (0..j).map(|k| m[j][k] * m[j][k]).sum::<f64>();
        if pivot <= 1e-8 * m[j][j] {
            return None;
        }
        m[j][j] = pivot.sqrt();
        for i in j + 1..n {
            m[i][j] = (m[i][j] - (0..j).map(|k| m[i][k] * m[j][k]).sum::<f64>()) / m[j][j];
        }
    }
    Some(())
}

/// Solves L L' x = b.
fn substitute(l: &[[f64; TERMS]; TERMS], n: usize, mut x: [f64; TERMS]) -> [f64; TERMS] {
    for i in 0..n {
        x[i] = (x[i] - (0..i).map(|k| l[i][k] * x[k]).sum::<f64>()) / l[i][i];
    }
    for i in (0..n).rev() {
        x[i] = (x[i] - (i + 1..n).map(|k| l[k][i] * x[k]).sum::<f64>()) / l[i][i];
    }
    x
}
