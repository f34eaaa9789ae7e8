//! The finite elements against closed-form elasticity: errors, and the rates at which they fall.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use flockform::fem::{Axis, CellKind, Material, Mesh, Plane, Problem, Solution, solve};

use crate::reference::beam_rows;

/// Observed order between two meshes, the second with cells half as wide.
fn rate(coarse: f64, fine: f64) -> f64 {
    (coarse / fine).log2()
}

/// Relative L2 displacement errors on meshes with n, 2n and 4n cells a side, and the rate of the last
/// halving, which must reach the degree plus one to within 0.1.
fn assert_rate(kind: CellKind, mut error: impl FnMut(usize) -> f64, last_below: f64) {
    let errors = [1, 2, 4].map(&mut error);
    let (found, expected) = (rate(errors[1], errors[2]), kind.degree() as f64 + 1.0);
    println!("{kind:?}: errors {errors:?}, rate {found:.3}, expected {expected}");
    assert!((found - expected).abs() < 0.1, "{kind:?}: rate {found}, errors {errors:?}");
    assert!(errors[2] < last_below, "{kind:?}: error {} is not below {last_below}", errors[2]);
}

fn relative(solution: &Solution, exact: impl Fn(f64, f64) -> [f64; 2]) -> f64 {
    let [error, size] = solution.l2_error(exact);
    error / size
}

/// Timoshenko and Goodier, article 21, as written out by Augarde and Deeks, Finite Elem. Anal. Des. 44
/// (2008) 595-601: length L, depth D about y = 0, end load P downwards, plane stress, thickness 1.
fn timoshenko(x: f64, y: f64) -> [f64; 2] {
    let (p, l, d, e, nu) = (1000.0, 8.0, 2.0, 30e6, 0.3);
    let ei = e * d * d * d / 12.0;
    let ux = p * y / (6.0 * ei) * ((6.0 * l - 3.0 * x) * x + (2.0 + nu) * (y * y - d * d / 4.0));
    let bending = 3.0 * nu * y * y * (l - x) + (4.0 + 5.0 * nu) * d * d * x / 4.0 + (3.0 * l - x) * x * x;
    [ux, -p / (6.0 * ei) * bending]
}

fn cantilever(kind: CellKind, n: usize) -> Solution {
    let mesh = Mesh::rectangle(kind, [8 * n, n], [0.0, -1.0], [8.0, 1.0]).unwrap();
    let mut problem = Problem::new(mesh, Material::isotropic(30e6, 0.3, Plane::Stress, 1.0).unwrap());
    let root = problem.mesh.nodes_where(|x, _| x == 0.0);
    let end = problem.mesh.boundary_where(|x, _| x == 8.0);
    problem.prescribe(&root, timoshenko);
    let (load, inertia) = (1000.0, 8.0 / 12.0);
    problem.pull_with(&end, |[_, y], _| [0.0, -load / (2.0 * inertia) * (1.0 - y * y)]);
    solve(&problem).unwrap()
}

#[test]
fn the_timoshenko_cantilever_converges_with_the_degree_plus_one() {
    for (kind, below) in
        [(CellKind::Tri3, 3.2e-3), (CellKind::Quad4, 2.5e-4), (CellKind::Tri6, 5e-8), (CellKind::Quad9, 5e-8)]
    {
        assert_rate(kind, |n| relative(&cantilever(kind, 8 * n), timoshenko), below);
    }
}

/// Lame's ring in plane strain: inner radius 1, outer radius 2, pressure p inside. Timoshenko and Goodier,
/// article 28: u_r = (1 + nu) p a^2 / (E (b^2 - a^2)) ((1 - 2 nu) r + b^2 / r).
fn lame(x: f64, y: f64) -> [f64; 2] {
    let (p, a, b, e, nu) = (10.0, 1.0, 2.0, 1000.0, 0.3);
    let r = x.hypot(y);
    let u = (1.0 + nu) * p * a * a / (e * (b * b - a * a)) * ((1.0 - 2.0 * nu) * r + b * b / r);
    [u * x / r, u * y / r]
}

fn ring(kind: CellKind, n: usize) -> Solution {
    let square = Mesh::rectangle(kind, [n, 2 * n], [1.0, 0.0], [2.0, FRAC_PI_2]).unwrap();
    let quarter = square.mapped(|r, t| [r * t.cos(), r * t.sin()]).unwrap();
    let mut problem = Problem::new(quarter, Material::isotropic(1000.0, 0.3, Plane::Strain, 3.0).unwrap());
    let (on_x, on_y) = (problem.mesh.nodes_where(|_, y| y < 1e-9), problem.mesh.nodes_where(|x, _| x < 1e-9));
    problem.fix(&on_x, Axis::Y, 0.0);
    problem.fix(&on_y, Axis::X, 0.0);
    let bore = problem.mesh.boundary_where(|x, y| x.hypot(y) < 1.0 + 1e-9);
    problem.pull_with(&bore, |_, n| [-10.0 * n[0], -10.0 * n[1]]);
    solve(&problem).unwrap()
}

#[test]
fn the_lame_ring_converges_with_the_degree_plus_one() {
    for (kind, below) in
        [(CellKind::Tri3, 9e-4), (CellKind::Quad4, 3e-4), (CellKind::Tri6, 7e-7), (CellKind::Quad9, 6e-7)]
    {
        assert_rate(kind, |n| relative(&ring(kind, 8 * n), lame), below);
    }
}

#[test]
fn the_lame_ring_opens_at_its_bore_by_the_closed_form_and_its_stress_follows() {
    let found = ring(CellKind::Quad9, 8);
    let bore = found.mesh().nodes_where(|x, y| x > 1.0 - 1e-9 && x < 1.0 + 1e-9 && y < 1e-9)[0] as usize;
    assert!((found.ux()[bore] / lame(1.0, 0.0)[0] - 1.0).abs() < 1e-4, "{}", found.ux()[bore]);
    // At the bore: radial -p, hoop p (a^2 + b^2) / (b^2 - a^2), out of the plane nu times their sum.
    let (stress, hoop) = (found.stress_at_points()[bore], 50.0 / 3.0);
    println!("bore: {stress:?}");
    assert!((stress.yy / hoop - 1.0).abs() < 0.01 && (stress.xx / -10.0 - 1.0).abs() < 0.03, "{stress:?}");
    assert!((stress.zz / (0.3 * (hoop - 10.0)) - 1.0).abs() < 0.03, "{stress:?}");
}

/// Kirsch's stress around a hole of radius 1 under unit tension along x; Timoshenko and Goodier,
/// article 35.
fn kirsch([x, y]: [f64; 2]) -> [f64; 3] {
    let (q, t) = (1.0 / (x * x + y * y), y.atan2(x));
    let (c2, s2, c4, s4) = ((2.0 * t).cos(), (2.0 * t).sin(), (4.0 * t).cos(), (4.0 * t).sin());
    let xx = 1.0 - q * (1.5 * c2 + c4) + 1.5 * q * q * c4;
    let yy = -q * (0.5 * c2 - c4) - 1.5 * q * q * c4;
    let xy = -q * (0.5 * s2 + s4) + 1.5 * q * q * s4;
    [xx, yy, xy]
}

/// A quarter of a 10 x 10 plate: n cells along the quarter circle, n outwards, graded towards the hole.
fn plate_with_hole(kind: CellKind, n: usize) -> Solution {
    let square = Mesh::rectangle(kind, [n, n], [0.0, 0.0], [1.0, 1.0]).unwrap();
    let quarter = square.mapped(|s, t| {
        let (angle, s) = (FRAC_PI_2 * t, s * s * 0.7 + s * 0.3);
        let (c, i) = (angle.cos(), angle.sin());
        let rim = if angle <= FRAC_PI_4 { 5.0 / c } else { 5.0 / i };
        let r = 1.0 + s * (rim - 1.0);
        [r * c, r * i]
    });
    let mut problem =
        Problem::new(quarter.unwrap(), Material::isotropic(1000.0, 0.3, Plane::Stress, 1.0).unwrap());
    let (on_x, on_y) = (problem.mesh.nodes_where(|_, y| y < 1e-9), problem.mesh.nodes_where(|x, _| x < 1e-9));
    problem.fix(&on_x, Axis::Y, 0.0);
    problem.fix(&on_y, Axis::X, 0.0);
    let mut rim = problem.mesh.boundary_where(|x, _| x > 5.0 - 1e-9);
    rim.extend(problem.mesh.boundary_where(|_, y| y > 5.0 - 1e-9));
    problem.pull_with(&rim, |at, n| {
        let [xx, yy, xy] = kirsch(at);
        [xx * n[0] + xy * n[1], xy * n[0] + yy * n[1]]
    });
    solve(&problem).unwrap()
}

#[test]
fn the_kirsch_plate_concentrates_stress_by_three_on_24_by_24_cells() {
    for kind in [CellKind::Quad4, CellKind::Tri6, CellKind::Quad9] {
        let found = plate_with_hole(kind, 24);
        let top = found.mesh().nodes_where(|x, y| x < 1e-9 && y < 1.0 + 1e-9)[0] as usize;
        let factor = found.stress_at_points()[top].xx;
        println!("{kind:?}: K_t = {factor:.4}");
        assert!((factor / 3.0 - 1.0).abs() < 0.03, "{kind:?}: K_t = {factor}");
    }
}

/// Root mean square error of xx at the nodes within two radii of the hole's edge.
#[test]
fn recovered_stress_around_the_hole_converges_at_least_with_the_degree() {
    for kind in CellKind::ALL {
        let errors = [12, 24].map(|n| {
            let found = plate_with_hole(kind, n);
            let (mesh, stress) = (found.mesh(), found.stress_at_points());
            let near = mesh.nodes_where(|x, y| x.hypot(y) < 3.0);
            let square = |&i: &u32| {
                (stress[i as usize].xx - kirsch([mesh.x()[i as usize], mesh.y()[i as usize]])[0]).powi(2)
            };
            (near.iter().map(square).sum::<f64>() / near.len() as f64).sqrt()
        });
        let found = rate(errors[0], errors[1]);
        println!("{kind:?}: recovered stress errors {errors:?}, rate {found:.2}");
        assert!(found > kind.degree() as f64, "{kind:?}: rate {found}, errors {errors:?}");
    }
}

/// R. D. Cook, J. Struct. Div. ASCE 100 (1974) 1851-1863: panel 48 wide, 44 deep at the wall, 16 at the
/// end, unit shear load spread over the end.
fn cook(kind: CellKind, n: usize) -> f64 {
    let square = Mesh::rectangle(kind, [n, n], [0.0, 0.0], [1.0, 1.0]).unwrap();
    let panel = square.mapped(|s, t| [48.0 * s, 44.0 * s + t * (44.0 - 28.0 * s)]).unwrap();
    let mut problem = Problem::new(panel, Material::isotropic(1.0, 1.0 / 3.0, Plane::Stress, 1.0).unwrap());
    let wall = problem.mesh.nodes_where(|x, _| x == 0.0);
    let end = problem.mesh.boundary_where(|x, _| x == 48.0);
    problem.prescribe(&wall, |_, _| [0.0; 2]);
    problem.pull(&end, [0.0, 1.0 / 16.0]);
    solve(&problem).unwrap().displacements_at(&[48.0], &[52.0]).unwrap()[0][1]
}

#[test]
fn the_middle_of_cooks_membrane_rises_by_23_96() {
    for (kind, n) in [(CellKind::Quad4, 64), (CellKind::Tri6, 16), (CellKind::Quad9, 16)] {
        let rise = cook(kind, n);
        println!("{kind:?} {n} x {n}: {rise:.4}");
        assert!((rise / 23.96 - 1.0).abs() < 0.005, "{kind:?}: {rise}");
    }
}

/// The paper's beam: 11 aspect wide, 11 deep, clamped left, 50 Pa upwards on the right end; relative L2
/// distance from the reference at its lattice points.
fn distance_from_reference(aspect: usize, mesh: Mesh) -> f64 {
    let rows = beam_rows(aspect as u32);
    let [x, y, ux, uy] = [0, 1, 2, 3].map(|k| rows.iter().map(|row| row[k]).collect::<Vec<f64>>());
    let mut problem = Problem::new(mesh, Material::isotropic(1000.0, 0.33, Plane::Stress, 1.0).unwrap());
    let right = 10.0 + 11.0 * aspect as f64;
    let clamped = problem.mesh.nodes_where(|x, _| x == 10.0);
    let pulled = problem.mesh.boundary_where(|x, _| x == right);
    problem.prescribe(&clamped, |_, _| [0.0; 2]);
    problem.pull(&pulled, [0.0, 50.0]);
    let found = solve(&problem).unwrap().displacements_at(&x, &y).unwrap();
    let (mut error, mut size) = (0.0, 0.0);
    for (i, [fx, fy]) in found.into_iter().enumerate() {
        error += (fx - ux[i]).powi(2) + (fy - uy[i]).powi(2);
        size += ux[i].powi(2) + uy[i].powi(2);
    }
    let distance = (error / size).sqrt();
    println!("aspect {aspect}: relative L2 distance {distance:.3e}");
    distance
}

/// Cells a side of a unit square of the beam's lattice: `per`.
fn beam(aspect: usize, per: usize) -> Mesh {
    let right = 10.0 + 11.0 * aspect as f64;
    Mesh::rectangle(CellKind::Quad9, [11 * aspect * per, 11 * per], [10.0, 10.0], [right, 21.0]).unwrap()
}

#[test]
fn the_square_beam_of_the_paper_agrees_with_the_reference() {
    assert!(distance_from_reference(1, beam(1, 8)) < 1e-4);
}

#[test]
fn the_slender_beams_of_the_paper_agree_with_the_reference() {
    assert!(distance_from_reference(5, beam(5, 4)) < 3e-5);
    assert!(distance_from_reference(10, beam(10, 3)) < 1.2e-5);
}
