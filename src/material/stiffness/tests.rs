use super::*;
use crate::material::elastic::{Constants, Elastic, Plane};

fn sheets() -> Vec<Voigt> {
    let isotropic = |poisson, plane| Constants::Isotropic { young: 2.0, poisson, plane };
    [
        isotropic(0.33, Plane::Stress),
        isotropic(-0.9, Plane::Stress),
        isotropic(0.4, Plane::Strain),
        Constants::Orthotropic { young: [9.0, 1.0], poisson_12: 0.4, shear: 0.6, angle: 0.5 },
    ]
    .map(|constants| *Elastic::new(constants, 0.7).expect("admissible").stiffness())
    .to_vec()
}

/// Straight and distorted cells of 3 to 7 corners, and a parallelogram.
fn shapes() -> Vec<Vec<[f64; 2]>> {
    let ring = |m: usize, stretch: f64| {
        let corner = |k: usize| {
            let angle = std::f64::consts::TAU * k as f64 / m as f64 + 0.2 * stretch;
            let radius = 1.0 + 0.2 * stretch * (3.0 * k as f64).sin();
            [7.0 + radius * angle.cos(), 2.0 + radius * angle.sin() * (1.0 + stretch)]
        };
        (0..m).map(corner).collect::<Vec<_>>()
    };
    let oblique = vec![[7.0, 2.0], [8.0, 2.2], [8.3, 3.3], [7.3, 3.1]];
    (3..=7).flat_map(|m| [ring(m, 0.0), ring(m, 1.0)]).chain([oblique]).collect()
}

fn moved(corners: &[[f64; 2]], field: impl Fn([f64; 2]) -> [f64; 2]) -> DVector<f64> {
    DVector::from_iterator(2 * corners.len(), corners.iter().flat_map(|&p| field(p)))
}

#[test]
fn a_cell_is_free_in_exactly_three_ways_and_resists_in_all_others() {
    for corners in shapes() {
        for c in sheets() {
            let k = element(&corners, &c).expect("a cell");
            assert_eq!(k, k.transpose());
            let mut values: Vec<f64> = k.symmetric_eigenvalues().iter().copied().collect();
            values.sort_by(f64::total_cmp);
            let scale = values[values.len() - 1];
            assert!(values[..3].iter().all(|v| v.abs() < 1e-13 * scale), "{} corners", corners.len());
            assert!(values[3] > 1e-3 * scale, "{} corners: {values:?}", corners.len());
        }
    }
}

#[test]
fn translation_and_infinitesimal_rotation_cost_no_force() {
    for corners in shapes() {
        for c in sheets() {
            let k = element(&corners, &c).expect("a cell");
            for rigid in [
                moved(&corners, |_| [1.0, 0.0]),
                moved(&corners, |_| [0.0, 1.0]),
                moved(&corners, |[x, y]| [-y, x]),
            ] {
                assert!((&k * &rigid).amax() < 1e-12 * k.amax() * rigid.amax().max(1.0));
            }
        }
    }
}

#[test]
fn a_constant_strain_has_its_exact_energy_and_its_exact_forces_on_any_shape() {
    let strain = Vector3::new(0.3, -0.2, 0.5);
    for corners in shapes() {
        for c in sheets() {
            let k = element(&corners, &c).expect("a cell");
            let u = moved(&corners, |[x, y]| [0.3 * x + 0.4 * y, 0.1 * x - 0.2 * y]);
            let energy = u.dot(&(&k * &u));
            let exact = area(&corners) * strain.dot(&(c * strain));
            assert!((energy - exact).abs() < 1e-12 * exact, "{} corners", corners.len());
            // Each side hands half the traction on it to either end.
            let stress = c * strain;
            let forces = &k * &u;
            let m = corners.len();
            for j in 0..m {
                let ([x0, y0], [x1, y1]) = (corners[(j + m - 1) % m], corners[(j + 1) % m]);
                let n = [0.5 * (y1 - y0), 0.5 * (x0 - x1)];
                let exact = [stress[0] * n[0] + stress[2] * n[1], stress[2] * n[0] + stress[1] * n[1]];
                assert!((forces[2 * j] - exact[0]).abs() < 1e-12 * forces.amax());
                assert!((forces[2 * j + 1] - exact[1]).abs() < 1e-12 * forces.amax());
            }
        }
    }
}

#[test]
fn the_mean_strain_of_an_affine_displacement_is_its_strain() {
    for corners in shapes() {
        let strain = mean_strain(&corners, |k| {
            let [x, y] = corners[k];
            [5.0 + 0.3 * x + 0.4 * y, 0.1 * x - 0.2 * y]
        });
        for (got, exact) in strain.iter().zip([0.3, -0.2, 0.5]) {
            assert!((got - exact).abs() < 1e-13);
        }
    }
}

#[test]
fn pure_bending_of_a_hexagon_costs_what_it_costs_in_the_continuum() {
    for turn in [0.0, 0.3] {
        let hexagon: Vec<[f64; 2]> = (0..6)
            .map(|k| {
                let angle = std::f64::consts::FRAC_PI_3 * k as f64 + turn;
                [angle.cos(), angle.sin()]
            })
            .collect();
        let c = *Elastic::new(Constants::Isotropic { young: 1.0, poisson: 0.3, plane: Plane::Stress }, 1.0)
            .expect("admissible")
            .stiffness();
        let k = polygon(&hexagon, &c).expect("a cell");
        let u = moved(&hexagon, |[x, y]| [x * y, -0.5 * (x * x + 0.3 * y * y)]);
        let inertia = 5.0 * 3f64.sqrt() / 16.0;
        assert!((u.dot(&(&k * &u)) - inertia).abs() < 1e-13, "E I, turned by {turn}");
    }
}

#[test]
fn the_stiffness_of_a_cell_does_not_change_with_its_size_and_place() {
    let c = sheets()[3];
    for corners in shapes() {
        let k = element(&corners, &c).expect("a cell");
        for scale in [1e-150, 1e-9, 1e9, 1e150] {
            let scaled: Vec<[f64; 2]> = corners.iter().map(|p| p.map(|x| x * scale)).collect();
            assert!((element(&scaled, &c).expect("a cell") - &k).amax() < 1e-12 * k.amax());
        }
    }
}

#[test]
fn load_shares_add_up_to_the_area_and_balance_about_the_centre() {
    for corners in shapes() {
        let shares = load_shares(&corners);
        let (total, centre) = (area(&corners), centroid(&corners));
        assert!((shares.iter().sum::<f64>() - total).abs() < 1e-12 * total);
        for d in 0..2 {
            let moment: f64 = shares.iter().zip(&corners).map(|(share, corner)| share * corner[d]).sum();
            assert!((moment - total * centre[d]).abs() < 1e-12 * total * 10.0);
        }
    }
}

#[test]
fn what_is_no_cell_is_refused() {
    let c = sheets()[0];
    let (o, x, y) = ([0.0, 0.0], [1.0, 0.0], [0.0, 1.0]);
    assert_eq!(element(&[o, x], &c), Err(ShapeError::TooFew { corners: 2 }));
    assert_eq!(element(&[o, y, x], &c), Err(ShapeError::NoArea));
    assert_eq!(element(&[o, x, [2.0, 0.0]], &c), Err(ShapeError::NoArea));
    assert_eq!(element(&[o, o, o], &c), Err(ShapeError::NoArea));
    assert_eq!(element(&[o, x, [0.2, 0.2], y], &c), Err(ShapeError::Folded { corner: 2 }));
}

/// Cells as outlines leave them: with corners in straight sides, not convex, almost triangles, slender.
fn cut_shapes() -> Vec<Vec<[f64; 2]>> {
    let mut shapes = shapes();
    shapes.extend([
        vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
        vec![[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 1.0]],
        vec![[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]],
        vec![[0.0, 0.0], [2.0, 0.0], [0.6, 0.5], [0.0, 2.0]],
        vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1e-6], [0.0, 1.0]],
        vec![[0.0, 0.0], [9.0, 0.0], [9.0, 0.5], [9.0, 1.0], [4.0, 1.0], [0.0, 1.0]],
    ]);
    shapes.push((0..13).map(|k| [k as f64, 0.0]).chain([[6.0, 9.0]]).collect());
    shapes
}

#[test]
fn a_cut_cell_is_free_in_three_ways_and_gives_a_constant_strain_its_energy() {
    let strain = Vector3::new(0.3, -0.2, 0.5);
    for corners in cut_shapes() {
        for c in sheets() {
            let k = cut_cell(&corners, &c).expect("a cell");
            assert_eq!(k, k.transpose());
            let mut values: Vec<f64> = k.symmetric_eigenvalues().iter().copied().collect();
            values.sort_by(f64::total_cmp);
            let scale = values[values.len() - 1];
            assert!(values[..3].iter().all(|v| v.abs() < 1e-12 * scale), "{corners:?}");
            assert!(values[3] > 1e-12 * scale, "{corners:?}: {values:?}");
            let u = moved(&corners, |[x, y]| [0.3 * x + 0.4 * y, 0.1 * x - 0.2 * y]);
            let exact = area(&corners) * strain.dot(&(c * strain));
            assert!((u.dot(&(&k * &u)) - exact).abs() < 1e-12 * exact, "{corners:?}");
        }
    }
}

#[test]
fn a_cut_rectangle_is_bent_about_its_own_axes_as_the_continuum_is() {
    for plane in [Plane::Stress, Plane::Strain] {
        let constants = Constants::Isotropic { young: 1.0, poisson: 0.3, plane };
        let c = *Elastic::new(constants, 1.0).expect("admissible").stiffness();
        let modulus = if plane == Plane::Stress { 1.0 } else { 1.0 / (1.0 - 0.09) };
        for [a, b] in [[1.0, 1.0], [3.0, 1.0], [0.5, 1.7]] {
            let corners = [[-a, -b], [a, -b], [a, b], [-a, b]];
            let k = cut_cell(&corners, &c).expect("a cell");
            let hourglass = moved(&corners, |[x, y]| [x * y, 0.0]);
            let exact = modulus * 4.0 / 3.0 * a * b * b * b;
            assert!((hourglass.dot(&(&k * &hourglass)) - exact).abs() < 1e-13 * exact, "{a} x {b}");
        }
    }
}

#[test]
fn a_triangle_is_no_different_for_being_cut_and_a_hexagon_is_not_bound() {
    let c = sheets()[0];
    let triangle = [[0.0, 0.0], [1.0, 0.2], [0.3, 0.9]];
    assert_eq!(cut_cell(&triangle, &c), element(&triangle, &c));
    let moments = |m: usize| {
        let corner = |k: usize| (std::f64::consts::TAU * (k as f64 + 0.5) / m as f64).sin_cos().into();
        second_moments(&(0..m).rev().map(corner).collect::<Vec<_>>())
    };
    assert!((least_residual(&moments(6)) - 0.8 * moments(6)[(0, 0)]).abs() < 1e-14);
    assert!(0.75 > 1.7 * least_residual(&moments(6)));
}

#[test]
fn an_almost_triangular_polygon_is_not_resisted_without_bound() {
    let c = sheets()[0];
    let regular = element(&cut_shapes()[6], &c).expect("a hexagon").amax();
    for far in [0.1, 1e-3, 1e-6] {
        // A triangle two of whose corners are cut off.
        let corners = [[0.0, 0.0], [1.0 - far, 0.0], [1.0, far], [far, 1.0], [0.0, 1.0 - far]];
        for k in [polygon(&corners, &c), cut_cell(&corners, &c)] {
            assert!(k.expect("a cell").amax() < 4.0 * regular, "{far}");
        }
    }
}
