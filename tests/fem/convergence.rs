//! The finite elements against closed-form elasticity: errors, and the rates at which they fall.

use std::f64::consts::FRAC_PI_2;

use flockform::fem::{
    Effort, Holding, Material, Plane, ShapeProblem, ShapeSolution, Support, TractionField, solve_shape,
};
use flockform::geometry::outline::Outline;
use flockform::geometry::piece::Piece;
use flockform::geometry::portion::Portion;
use flockform::geometry::shape::Shape;

use crate::reference::beam_rows;
use crate::shapes::{Point, error, lame, outline, pieces, timoshenko};

/// Solutions on the four coarsest of the nested meshes.
fn levels(problem: &ShapeProblem<'_>, cells: usize) -> [ShapeSolution; 4] {
    let mut most_nodes = 0;
    [1, 2, 3, 4].map(|count| {
        let solved = solve_shape(problem, &Effort { target: 0.0, most_nodes, cells }).unwrap();
        assert_eq!(solved.levels().len(), count);
        // From the third on, a mesh is refined if four times its nodes are no more than the most.
        most_nodes = solved.levels()[count - 1].nodes * if count == 3 { 4 } else { 1 };
        solved
    })
}

/// Observed order between two meshes, the second with cells half as wide.
fn rate(coarse: f64, fine: f64) -> f64 {
    (coarse / fine).log2()
}

/// Relative L2 displacement errors on four meshes, each with cells half as wide as those before: the rate of the last
/// halving must reach the degree plus one to within 0.1.
fn assert_rate(solved: &[ShapeSolution; 4], exact: impl Fn(f64, f64) -> Point, last_below: f64) {
    let errors = solved.each_ref().map(|solved| error(solved, &exact));
    let (found, nodes) = (rate(errors[2], errors[3]), solved[3].levels()[3].nodes);
    println!("errors {errors:?}, rate {found:.3}, {nodes} nodes");
    assert!((found - 3.0).abs() < 0.1, "rate {found}, errors {errors:?}");
    assert!(errors[3] < last_below, "error {} is not below {last_below}", errors[3]);
}

#[test]
fn the_timoshenko_cantilever_converges_with_the_degree_plus_one() {
    let outline = outline(&Shape::Rectangle { min: [0.0, -1.0], max: [8.0, 1.0] });
    let mut problem =
        ShapeProblem::new(&outline, Material::isotropic(30e6, 0.3, Plane::Stress, 1.0).unwrap());
    problem.hold(pieces(&outline, 0, &[3]), |p| timoshenko(p[0], p[1]));
    problem.pull(pieces(&outline, 0, &[1]), |p, _| [0.0, -1000.0 / (4.0 / 3.0) * (1.0 - p[1] * p[1])]);
    assert_rate(&levels(&problem, 1024), timoshenko, 5e-9);
}

/// A quarter of a body with a hole of radius 1 about the origin, between the axes, which are lines of symmetry, and the rim.
fn quarter(rim: &[Piece]) -> Outline {
    let [first, last] = [rim[0].from, rim[rim.len() - 1].to];
    let mut pieces = vec![Piece::edge([1.0, 0.0], first)];
    pieces.extend(rim);
    pieces.push(Piece::edge(last, [0.0, 1.0]));
    pieces.push(Piece::arc([0.0; 2], 1.0, FRAC_PI_2, -FRAC_PI_2));
    outline(&Shape::Path { pieces })
}

/// The quarter held at its lines of symmetry, under a traction on some of its pieces.
fn of_quarter<'a>(
    outline: &'a Outline,
    material: Material,
    pulled: &[usize],
    traction: TractionField<'a>,
) -> ShapeProblem<'a> {
    let mut problem = ShapeProblem::new(outline, material);
    for (piece, components) in [(0, [false, true]), (outline.rings()[0].len() - 2, [true, false])] {
        let on = Holding::Portions(vec![Portion::whole(0, piece)]);
        problem.supports.push(Support { on, components, displacement: Box::new(|_| [0.0; 2]), way: None });
    }
    problem.pull(pulled.iter().map(|&piece| Portion::whole(0, piece)).collect(), traction);
    problem
}

#[test]
fn the_lame_ring_converges_with_the_degree_plus_one_and_its_stress_at_the_bore_follows() {
    let outline = quarter(&[Piece::arc([0.0; 2], 2.0, 0.0, FRAC_PI_2)]);
    let material = Material::isotropic(1000.0, 0.3, Plane::Strain, 3.0).unwrap();
    let problem = of_quarter(&outline, material, &[3], Box::new(|_, n| n.map(|n| -10.0 * n)));
    let solved = levels(&problem, 512);
    let exact = lame(Plane::Strain);
    assert_rate(&solved, &exact, 1e-7);
    let bore = solved[0].displacements_at(&[[1.0, 0.0]]).unwrap()[0][0];
    assert!((bore / exact(1.0, 0.0)[0] - 1.0).abs() < 1e-4, "{bore}");
    // At the bore: radial -p, hoop p (a^2 + b^2) / (b^2 - a^2), out of the plane nu times their sum.
    let (stress, hoop) = (solved[0].stress_at(&[[1.0, 0.0]]).unwrap()[0], 50.0 / 3.0);
    println!("bore: {stress:?}");
    assert!((stress.yy / hoop - 1.0).abs() < 0.01 && (stress.xx / -10.0 - 1.0).abs() < 0.03, "{stress:?}");
    assert!((stress.zz / (0.3 * (hoop - 10.0)) - 1.0).abs() < 0.03, "{stress:?}");
}

/// Kirsch's stress around a hole of radius 1 under unit tension along x; Timoshenko and Goodier,
/// article 35.
fn kirsch([x, y]: Point) -> [f64; 3] {
    let (q, t) = (1.0 / (x * x + y * y), y.atan2(x));
    let (c2, s2, c4, s4) = ((2.0 * t).cos(), (2.0 * t).sin(), (4.0 * t).cos(), (4.0 * t).sin());
    let xx = 1.0 - q * (1.5 * c2 + c4) + 1.5 * q * q * c4;
    let yy = -q * (0.5 * c2 - c4) - 1.5 * q * q * c4;
    let xy = -q * (0.5 * s2 + s4) + 1.5 * q * q * s4;
    [xx, yy, xy]
}

/// A quarter of a 10 x 10 plate, on its rim under the stress of an endless one.
#[test]
fn stress_in_the_kirsch_plate_is_concentrated_by_three_and_converges_at_least_with_the_degree() {
    let corners: [Point; 3] = [[5.0, 0.0], [5.0, 5.0], [0.0, 5.0]];
    let outline = quarter(&[0, 1].map(|k| Piece::edge(corners[k], corners[k + 1])));
    let material = Material::isotropic(1000.0, 0.3, Plane::Stress, 1.0).unwrap();
    let traction = |at: Point, n: Point| {
        let [xx, yy, xy] = kirsch(at);
        [xx * n[0] + xy * n[1], xy * n[0] + yy * n[1]]
    };
    let problem = of_quarter(&outline, material, &[1, 2], Box::new(traction));
    // Root mean square error of xx at the nodes within two radii of the hole's edge.
    let off = |solved: &ShapeSolution| {
        let mesh = solved.solution().mesh();
        let at = mesh.x().iter().zip(mesh.y()).map(|(&x, &y)| [x, y]);
        let near: Vec<Point> = at.filter(|p| p[0].hypot(p[1]) < 3.0).collect();
        let stress = solved.stress_at(&near).unwrap();
        let square: f64 = stress.iter().zip(&near).map(|(s, p)| (s.xx - kirsch(*p)[0]).powi(2)).sum();
        (square / near.len() as f64).sqrt()
    };
    let solved = levels(&problem, 72);
    for solved in &solved[2..] {
        let factor = solved.stress_at(&[[0.0, 1.0]]).unwrap()[0].xx;
        println!("K_t = {factor:.4}");
        assert!((factor / 3.0 - 1.0).abs() < 0.03, "K_t = {factor}");
    }
    let errors = solved.each_ref().map(off);
    let found = rate(errors[2], errors[3]);
    println!("stress errors {errors:?}, rate {found:.2}");
    assert!(found > 2.0, "rate {found}, errors {errors:?}");
}

/// The paper's beam: 11 aspect wide, 11 deep, clamped left, 50 Pa upwards on the right end; relative L2
/// distance from the reference at its lattice points.
fn distance_from_reference(aspect: u32, effort: &Effort) -> f64 {
    let rows = beam_rows(aspect);
    let outline = outline(&Shape::Rectangle { min: [10.0; 2], max: [10.0 + 11.0 * f64::from(aspect), 21.0] });
    let mut problem =
        ShapeProblem::new(&outline, Material::isotropic(1000.0, 0.33, Plane::Stress, 1.0).unwrap());
    problem.hold(pieces(&outline, 0, &[3]), |_| [0.0; 2]);
    problem.pull(pieces(&outline, 0, &[1]), |_, _| [0.0, 50.0]);
    let solved = solve_shape(&problem, effort).unwrap();
    let places: Vec<Point> = rows.iter().map(|row| [row[0], row[1]]).collect();
    let (mut error, mut size) = (0.0, 0.0);
    for ([fx, fy], [_, _, ux, uy]) in solved.displacements_at(&places).unwrap().into_iter().zip(rows) {
        error += (fx - ux).powi(2) + (fy - uy).powi(2);
        size += ux.powi(2) + uy.powi(2);
    }
    let distance = (error / size).sqrt();
    println!(
        "aspect {aspect}: relative L2 distance {distance:.3e}, {:?} {:?}",
        solved.error(),
        solved.levels()
    );
    distance
}

/// The reference is known to 2e-4 where the beam is square, else to 6e-5.
#[test]
fn the_beams_of_the_paper_are_as_near_to_the_reference_as_that_is_to_the_truth() {
    let effort = Effort { target: 1e-6, ..Effort::default() };
    for (aspect, known_to) in [(1, 2e-4), (5, 6e-5), (10, 6e-5)] {
        let distance = distance_from_reference(aspect, &effort);
        assert!(distance < known_to, "aspect {aspect}: {distance}");
    }
}
