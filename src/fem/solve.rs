//! The direct solve: sparse Cholesky with an approximate-minimum-degree ordering, from the library faer,
//! and the detection of bodies that are not held.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::ldlt::factor::{LdltError, LdltRegularization};
use faer::linalg::cholesky::llt::factor::LltError;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LdltRef, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

use super::assemble::{System, assemble, nodal_loads};
use super::error::FemError;
use super::mesh::Mesh;
use super::newton::{Held, solve_turning};
use super::problem::Problem;
use super::solution::Solution;
use super::strain::Strain;
use crate::geometry::disjoint_sets::DisjointSets;

/// Below this ratio of the softest motion's stiffness to the stiffness of the single components, at most
/// two digits of the answer would be left: the matrix counts as singular.
const SINGULAR: f64 = 1e-14;

/// Solves for the displacement in equilibrium, of a body of which displacements near it may be known \[m\], shape [2 * nodes],
/// which helps where it turns. Its supports are `led` there on a way that need not be straight.
///
/// The factorisation runs on the calling thread, whatever faer's global setting, so the same input gives
/// the same bits on one machine.
///
/// # Errors
/// [`FemError::NotFinite`] for input that makes no sense; [`FemError::Mechanism`] for a part that rigid motion leaves free;
/// [`FemError::Singular`] for parts that hang together by hinges; [`FemError::Lost`] for a body that turns and has no
/// equilibrium under all of its loads; [`FemError::Factorisation`] if memory does not suffice.
pub(crate) fn solve_near(
    problem: &Problem,
    start: Option<Vec<f64>>,
    led: Option<&Held<'_>>,
) -> Result<Solution, FemError> {
    problem.check()?;
    let prescribed = &problem.prescribed;
    check_rigid_motion(&problem.mesh, prescribed)?;
    if problem.strain == Strain::Stretch {
        return solve_turning(problem, start, led);
    }
    let system = assemble(problem, prescribed, &nodal_loads(problem), None);
    let unknowns = if system.load.is_empty() { Vec::new() } else { solve_reduced(&system, &problem.mesh)? };
    let component = |c: usize| match system.unknown[c] {
        Some(i) => unknowns[i],
        None => prescribed[c].unwrap_or(0.0),
    };
    let nodes = 0..problem.mesh.node_count();
    let ux = nodes.clone().map(|i| component(2 * i)).collect();
    let uy = nodes.map(|i| component(2 * i + 1)).collect();
    Solution::of(problem, ux, uy)
}

/// A part (cells joined through nodes) is held if x and y are prescribed somewhere in it, and if no point
/// of the plane can serve as centre of rotation: that needs all nodes held along x at one height and all
/// nodes held along y at one abscissa.
fn check_rigid_motion(mesh: &Mesh, prescribed: &[Option<f64>]) -> Result<(), FemError> {
    let part = parts(mesh);
    let mut held = vec![[f64::MAX, f64::MIN, f64::MAX, f64::MIN]; mesh.node_count()];
    for (c, _) in prescribed.iter().enumerate().filter(|(_, p)| p.is_some()) {
        let (node, lever) = (c / 2, 2 * (c % 2));
        let at = if lever == 0 { mesh.y()[node] } else { mesh.x()[node] };
        let range = &mut held[part[node] as usize][lever..lever + 2];
        (range[0], range[1]) = (range[0].min(at), range[1].max(at));
    }
    let size = |v: &[f64]| v.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let slack = 1e-12 * size(mesh.x()).max(size(mesh.y()));
    for node in (0..mesh.node_count()).filter(|&n| part[n] as usize == n) {
        let [y_low, y_high, x_low, x_high] = held[node];
        let motion = if y_low > y_high {
            "translate along x"
        } else if x_low > x_high {
            "translate along y"
        } else if y_high - y_low <= slack && x_high - x_low <= slack {
            "rotate"
        } else {
            continue;
        };
        return Err(FemError::Mechanism { node, at: place(mesh, node), motion });
    }
    Ok(())
}

/// For each node the lowest-numbered node of its part.
fn parts(mesh: &Mesh) -> Vec<u32> {
    let mut parts = DisjointSets::new(mesh.node_count());
    for cell in 0..mesh.cell_count() {
        let nodes = mesh.cell(cell);
        nodes[1..].iter().for_each(|&node| parts.join(nodes[0], node));
    }
    parts.labels()
}

/// The factor L of the permuted matrix.
struct Factor {
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f64>,
    memory: MemBuffer,
    is_definite: bool,
}

fn solve_reduced(system: &System, mesh: &Mesh) -> Result<Vec<f64>, FemError> {
    let mut factor = factorise(system, mesh, true)?;
    check_softest_motion(system, mesh, &mut factor)?;
    let mut u = system.load.clone();
    factor.solve(&mut u);
    Ok(u)
}

/// The same for a tangent that need not be positive definite: where a clamp ends, the stress of a fine mesh passes what
/// any material bears, and a few cells there give way.
pub(crate) fn solve_tangent(system: &System, mesh: &Mesh) -> Result<Vec<f64>, FemError> {
    let mut u = system.load.clone();
    if !u.is_empty() {
        factorise(system, mesh, false)?.solve(&mut u);
    }
    Ok(u)
}

/// L L' of a positive definite matrix, else L D L' without pivots.
fn factorise(system: &System, mesh: &Mesh, is_definite: bool) -> Result<Factor, FemError> {
    let n = system.load.len();
    let failed = |e: &dyn std::fmt::Debug| FemError::Factorisation { unknowns: n, reason: format!("{e:?}") };
    let pattern = SymbolicSparseColMatRef::new_checked(n, n, &system.starts, None, &system.rows);
    let matrix = SparseColMatRef::new(pattern, &system.values);
    let params = CholeskySymbolicParams::default();
    let symbolic = factorize_symbolic_cholesky(pattern, Side::Lower, SymmetricOrdering::Amd, params)
        .map_err(|e| failed(&e))?;
    let mut values = Vec::new();
    values.try_reserve_exact(symbolic.len_val()).map_err(|e| failed(&e))?;
    values.resize(symbolic.len_val(), 0.0);
    let need = match is_definite {
        true => symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default()),
        false => symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default()),
    };
    let need = need.or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
    let mut memory = MemBuffer::try_new(need).map_err(|e| failed(&e))?;
    let (stack, side) = (MemStack::new(&mut memory), Side::Lower);
    let at = match is_definite {
        true => {
            let done = symbolic.factorize_numeric_llt(
                &mut values,
                matrix,
                side,
                Default::default(),
                Par::Seq,
                stack,
                Default::default(),
            );
            done.err().map(|LltError::NonPositivePivot { index }| index)
        }
        false => {
            let done = symbolic.factorize_numeric_ldlt(
                &mut values,
                matrix,
                side,
                LdltRegularization::default(),
                Par::Seq,
                stack,
                Default::default(),
            );
            done.err().map(|LdltError::ZeroPivot { index }| index)
        }
    };
    if let Some(index) = at {
        let unknown = symbolic.perm().map_or(index, |p| p.arrays().0[index]);
        return Err(singular(system, mesh, unknown));
    }
    Ok(Factor { symbolic, values, memory, is_definite })
}

impl Factor {
    /// Overwrites `rhs` with the solution.
    fn solve(&mut self, rhs: &mut [f64]) {
        let n = rhs.len();
        let rhs = MatMut::from_column_major_slice_mut(rhs, n, 1);
        let (symbolic, values, stack) = (&self.symbolic, &self.values[..], MemStack::new(&mut self.memory));
        match self.is_definite {
            true => LltRef::new(symbolic, values).solve_in_place_with_conj(Conj::No, rhs, Par::Seq, stack),
            false => LdltRef::new(symbolic, values).solve_in_place_with_conj(Conj::No, rhs, Par::Seq, stack),
        }
    }
}

/// Two steps of inverse iteration on K z = lambda diag(K) z; lambda from the Rayleigh quotient. A hinge
/// leaves lambda at rounding level even where every pivot of the factorisation came out positive.
fn check_softest_motion(system: &System, mesh: &Mesh, factor: &mut Factor) -> Result<(), FemError> {
    let diagonal: Vec<f64> = system.starts[..system.load.len()].iter().map(|&d| system.values[d]).collect();
    // A fixed start without symmetry: the fractional parts of multiples of the golden ratio.
    let mut z: Vec<f64> =
        (1..=diagonal.len()).map(|i| (i as f64 * 0.618_033_988_749_895).fract() - 0.4).collect();
    let mut ratio = f64::MAX;
    for _ in 0..2 {
        let largest = z.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let load: Vec<f64> = z.iter().zip(&diagonal).map(|(z, d)| z / largest * d).collect();
        z.copy_from_slice(&load);
        factor.solve(&mut z);
        let energy: f64 = z.iter().zip(&load).map(|(z, f)| z * f).sum();
        ratio = energy / z.iter().zip(&diagonal).map(|(z, d)| z * z * d).sum::<f64>();
    }
    if ratio > SINGULAR {
        return Ok(());
    }
    let most = (0..z.len()).fold(0, |best, i| if z[i].abs() > z[best].abs() { i } else { best });
    Err(singular(system, mesh, most))
}

/// The refusal of a body that is softest in this unknown.
fn singular(system: &System, mesh: &Mesh, unknown: usize) -> FemError {
    let node = system.unknown.iter().position(|&u| u == Some(unknown)).map_or(0, |component| component / 2);
    FemError::Singular { node, at: place(mesh, node) }
}

fn place(mesh: &Mesh, node: usize) -> [f64; 2] {
    [mesh.x()[node], mesh.y()[node]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::by_hand::solve;
    use crate::fem::{Material, Plane};

    fn strip() -> Problem {
        let mesh = Mesh::rectangle([6, 2], [0.0, 0.0], [3.0, 1.0]);
        let mut problem = Problem::new(mesh, Material::isotropic(1000.0, 0.3, Plane::Stress, 0.5).unwrap());
        let end = problem.mesh.boundary_where(|x, _| x == 3.0);
        problem.pull(&end, |_, _| [0.0, 10.0]);
        problem
    }

    fn motion(problem: &Problem) -> &'static str {
        match solve(problem) {
            Err(FemError::Mechanism { node: 0, at: [0.0, 0.0], motion }) => motion,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn the_refusal_of_a_body_that_is_not_held_says_how_it_can_move() {
        let mut problem = strip();
        assert_eq!(motion(&problem), "translate along x");
        problem.fix(&[0, 1], 0, 0.0);
        assert_eq!(motion(&problem), "translate along y");
        problem.fix(&[0, 13], 1, 0.0);
        assert_eq!(motion(&problem), "rotate", "node 13 lies above node 0");
        problem.fix(&[12], 1, 0.0);
        assert!(solve(&problem).is_ok());
    }

    /// Two squares that share only the node at the origin, the left one clamped.
    fn hinged() -> Problem {
        let [left, right] = [-1.0, 0.0].map(|low| Mesh::rectangle([1, 1], [low; 2], [low + 1.0; 2]));
        let both = |a: &[f64], b: &[f64]| [a, &b[1..]].concat();
        // The last node of the one is the first of the other.
        let shifted = right.cells().iter().map(|cell| cell.map(|node| node + 8));
        let cells = left.cells().iter().copied().chain(shifted).collect();
        let mesh = Mesh::new(both(left.x(), right.x()), both(left.y(), right.y()), cells).unwrap();
        let mut problem = Problem::new(mesh, Material::isotropic(1000.0, 0.3, Plane::Stress, 1.0).unwrap());
        let left = problem.mesh.nodes_where(|x, _| x == -1.0);
        problem.prescribe(&left, |_, _| [0.0; 2]);
        problem.forces.push((problem.mesh.nodes_where(|x, y| x == 1.0 && y == 1.0)[0] as usize, [1.0, 0.0]));
        problem
    }

    #[test]
    fn a_hinge_is_found_though_every_part_touches_the_wall() {
        let mut problem = hinged();
        assert_eq!(
            (problem.mesh.node_count(), problem.mesh.nodes_where(|x, y| x == 0.0 && y == 0.0).len()),
            (17, 1)
        );
        let refused = solve(&problem);
        assert!(
            matches!(refused, Err(FemError::Singular { node, at })
                if at[0] >= 0.0 && at == place(&problem.mesh, node)),
            "{refused:?}"
        );
        let corner = problem.mesh.nodes_where(|x, y| x == 1.0 && y == 0.0);
        problem.fix(&corner, 1, 0.0);
        assert!(solve(&problem).is_ok());
    }

    #[test]
    fn a_very_slender_but_held_beam_is_not_called_singular() {
        let mesh = Mesh::rectangle([400, 1], [0.0, 0.0], [400.0, 1.0]);
        let mut problem = Problem::new(mesh, Material::isotropic(1.0, 0.3, Plane::Stress, 1.0).unwrap());
        let wall = problem.mesh.nodes_where(|x, _| x == 0.0);
        let end = problem.mesh.boundary_where(|x, _| x == 400.0);
        problem.prescribe(&wall, |_, _| [0.0; 2]);
        problem.pull(&end, |_, _| [0.0, 1e-9]);
        let tip = solve(&problem).unwrap().displacements_within(&[[400.0, 0.5]], 0.0).unwrap()[0][1];
        // Euler-Bernoulli: P L^3 / (3 E I).
        assert!((tip / (1e-9 * 400.0_f64.powi(3) * 4.0) - 1.0).abs() < 1e-3, "{tip}");
    }

    #[test]
    fn input_that_is_not_finite_is_refused_by_list_and_index() {
        let mut p = strip();
        p.fix(&[0, 13], 0, 0.0);
        p.fix(&[0], 1, 0.0);
        let refused = |change: &dyn Fn(&mut Problem)| {
            let mut spoiled = p.clone();
            change(&mut spoiled);
            solve(&spoiled).unwrap_err()
        };
        let not_finite = |what, index| FemError::NotFinite { what, index };
        assert_eq!(refused(&|p| p.body_force[1] = f64::NAN), not_finite("body force", 0));
        assert_eq!(refused(&|p| p.fix(&[0], 1, f64::INFINITY)), not_finite("fixed displacement", 1));
        assert_eq!(refused(&|p| p.tractions[1].at_gauss[2][0] = f64::NAN), not_finite("traction", 1));
        assert_eq!(refused(&|p| p.forces.push((1, [f64::NAN, 0.0]))), not_finite("point force", 0));
    }

    #[test]
    fn the_same_problem_gives_the_same_bits() {
        let mut p = strip();
        let wall = p.mesh.nodes_where(|x, _| x == 0.0);
        p.prescribe(&wall, |_, y| [0.01 * y, 0.0]);
        let [first, second] = [0, 1].map(|_| solve(&p).unwrap());
        assert!(first.ux() == second.ux() && first.uy() == second.uy());
    }

    #[test]
    fn a_body_with_every_node_prescribed_needs_no_factorisation() {
        let mut p = strip();
        let all = p.mesh.nodes_where(|_, _| true);
        p.prescribe(&all, |x, y| [x * y, -x]);
        let found = solve(&p).unwrap();
        let last = p.mesh.nodes_where(|x, y| x == 3.0 && y == 1.0)[0] as usize;
        assert!((found.ux()[last] - 3.0).abs() < 1e-15 && (found.uy()[last] + 3.0).abs() < 1e-15);
    }
}
