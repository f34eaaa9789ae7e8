use super::*;

/// A quadrilateral with any symmetric stiffness that no rigid motion feels, and its corners in the reference.
fn quadrilateral() -> (Element, Vec<[f64; 2]>) {
    let corners = vec![[0.0, 0.0], [1.1, 0.2], [0.9, 1.0], [-0.1, 0.8]];
    let twice: f64 = (0..4).map(|k| cross(corners[k], corners[(k + 1) % 4])).sum();
    let gradient = |k: usize| {
        let ([x0, y0], [x1, y1]) = (corners[(k + 3) % 4], corners[(k + 1) % 4]);
        [(y1 - y0) / twice, (x0 - x1) / twice]
    };
    // Springs between all pairs, none like another: no axis and no corner is spared.
    let mut stiffness = vec![Block::default(); 16];
    for (a, b, strength) in [(0, 1, 1.0), (1, 2, 2.5), (2, 3, 0.7), (3, 0, 1.9), (0, 2, 3.1), (1, 3, 0.4)] {
        let along = [0, 1].map(|d| corners[b][d] - corners[a][d]);
        let spring: Block = [0, 1].map(|d| [0, 1].map(|e| strength * along[d] * along[e]));
        let negative = spring.map(|row| row.map(|k| -k));
        for (i, j, block) in [(a, a, spring), (b, b, spring), (a, b, negative), (b, a, negative)] {
            stiffness[4 * i + j] = block::plus(&stiffness[4 * i + j], &block);
        }
    }
    (Element { stiffness, gradients: (0..4).map(gradient).collect() }, corners)
}

/// Displacements far from small: a turn by 130 degrees, a shift and a strain of some 20 %.
fn moved(corners: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let (sin, cos) = 130f64.to_radians().sin_cos();
    let strained = [[0.1, -0.2], [0.2, 0.1], [-0.15, 0.2], [0.05, -0.1]];
    let go = |k: usize| {
        let [x, y] = [corners[k][0] + strained[k][0], corners[k][1] + strained[k][1]];
        [cos * x - sin * y + 3.0 - corners[k][0], sin * x + cos * y - 7.0 - corners[k][1]]
    };
    (0..corners.len()).map(go).collect()
}

fn at<'a>(corners: &'a [[f64; 2]], u: &'a [[f64; 2]]) -> impl Fn(usize) -> Corner + 'a {
    |k| Corner { reference: corners[k], displacement: u[k] }
}

#[test]
fn forces_are_minus_the_gradient_of_the_energy_and_the_tangent_is_its_second() {
    let (element, corners) = quadrilateral();
    let u = moved(&corners);
    let step = 1e-5;
    for own in 0..4 {
        let row = element.row(own, at(&corners, &u)).expect("has a direction");
        let (_, force) = element.force_on(own, at(&corners, &u)).expect("has a direction");
        for d in 0..2 {
            let shifted = |corner: usize, by: f64| {
                let mut u = u.clone();
                u[corner][d] += by;
                u
            };
            let energy = |by: f64| element.row(own, at(&corners, &shifted(own, by))).expect("fits").energy;
            let gradient = (energy(step) - energy(-step)) / (2.0 * step);
            assert!((force[d] + gradient).abs() < 1e-8, "{force:?}");
            assert!((force[d] - row.force[d]).abs() < 1e-14, "{force:?}");
            for (k, block) in row.tangent.iter().enumerate() {
                let force = |by: f64| element.force_on(own, at(&corners, &shifted(k, by))).expect("fits").1;
                let (ahead, behind) = (force(step), force(-step));
                for e in 0..2 {
                    let numeric = (behind[e] - ahead[e]) / (2.0 * step);
                    assert!((block[e][d] - numeric).abs() < 1e-8, "{own} {k}: {block:?}");
                }
            }
        }
    }
}

#[test]
fn the_tangent_is_symmetric_to_the_bit_in_the_axes_of_the_cell_and_to_rounding_in_any() {
    let (element, corners) = quadrilateral();
    let u = moved(&corners);
    let rows: Vec<CellRow> = (0..4).map(|own| element.row(own, at(&corners, &u)).expect("fits")).collect();
    for i in 0..4 {
        for k in 0..4 {
            let (there, back) = (rows[i].tangent[k], transposed(rows[k].tangent[i]));
            assert!((0..4).all(|n| (there[n / 2][n % 2] - back[n / 2][n % 2]).abs() < 1e-14), "{there:?}");
        }
    }
}

#[test]
fn forces_and_moments_of_a_cell_balance_whatever_it_is_made_of() {
    let (element, corners) = quadrilateral();
    let u = moved(&corners);
    let (mut sum, mut moment, mut size) = ([0.0; 2], 0.0, 0.0f64);
    for own in 0..4 {
        let (_, force) = element.force_on(own, at(&corners, &u)).expect("fits");
        let place = [corners[own][0] + u[own][0], corners[own][1] + u[own][1]];
        sum = [sum[0] + force[0], sum[1] + force[1]];
        moment += cross(place, force);
        size = size.max(force[0].abs());
    }
    assert!(size > 0.1 && sum[0].hypot(sum[1]) < 1e-14 && moment.abs() < 1e-13, "{size} {sum:?} {moment}");
}

#[test]
fn a_rigid_motion_costs_nothing_and_the_reference_pulls_nothing_to_the_bit() {
    let (element, corners) = quadrilateral();
    for degrees in [0.0f64, 1e-7, 90.0, 180.0, 270.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let turned = |&[x, y]: &[f64; 2]| [cos * x - sin * y - x, sin * x + cos * y - y];
        let u: Vec<[f64; 2]> = corners.iter().map(turned).collect();
        for own in 0..4 {
            let (_, force) = element.force_on(own, at(&corners, &u)).expect("fits");
            assert!(force[0].abs() + force[1].abs() < 1e-14, "{degrees}: {force:?}");
            assert!(degrees != 0.0 || force == [0.0; 2]);
        }
    }
}

#[test]
fn small_displacements_are_pulled_back_as_by_the_stiffness() {
    let (element, corners) = quadrilateral();
    let u: Vec<[f64; 2]> = moved(&corners).iter().map(|u| u.map(|u| 1e-9 * u)).collect();
    for own in 0..4 {
        let linear = (0..4).fold([0.0; 2], |sum, k| {
            let [x, y] = apply(element.block(own, k), u[k]);
            [sum[0] - x, sum[1] - y]
        });
        let (_, force) = element.force_on(own, at(&corners, &u)).expect("fits");
        assert!((0..2).all(|d| (force[d] - linear[d]).abs() < 1e-16), "{force:?} {linear:?}");
    }
}

#[test]
fn a_cell_shrunk_to_a_point_has_no_rotation() {
    let (element, corners) = quadrilateral();
    let u: Vec<[f64; 2]> = corners.iter().map(|x| x.map(|x| -x)).collect();
    let turn = element.turn(at(&corners, &u));
    assert!(turn.is_none_or(|turn| turn.trace < 1e-15), "{turn:?}");
}
