//! The same body in another unit, direction or mirror: rounding decides nothing.

use flockform::continuum::mechanics::{Mechanics, Stresses};
use flockform::continuum::plan::Plan;
use flockform::continuum::run::Outcome;
use flockform::flock::vectors::distance;

use crate::support::{scene, solved};

/// A plate clamped at its left and pulled at its right, lengths in another unit.
fn plate(
    kind: &str,
    spacing: f64,
    [length, height]: [f64; 2],
    hole: Option<f64>,
    unit: f64,
) -> (Plan, Outcome) {
    let [spacing, length, height] = [spacing, length, height].map(|v| v * unit);
    let hole = hole.map_or(String::new(), |radius| {
        let [x, y, radius] = [length / 2.0, height / 2.0, radius * unit];
        format!("holes = [{{ kind = \"disc\", centre = [{x:?}, {y:?}], radius = {radius:?} }}]")
    });
    let parts = format!(
        r#"
material = {{ kind = "isotropic", young = 1000.0, poisson = 0.3 }}
roles = [{{ region = {{ kind = "edge", side = "left" }}, role = "clamped" }}]
loads = [{{ kind = "traction", region = {{ kind = "edge", side = "right" }}, traction = [1.0, 0.3] }}]
[body]
shape = {{ kind = "rectangle", max = [{length:?}, {height:?}] }}
{hole}
"#
    );
    solved(
        &scene(&format!("lattice = {{ kind = \"{kind}\", spacing = {spacing:?} }}"), &parts)
            .expect("a scene"),
    )
}

fn largest_stress(outcome: &Outcome) -> f64 {
    Mechanics::of(&outcome.engine).and_then(|all| all.largest_von_mises).expect("is stressed").von_mises
}

#[test]
fn a_body_has_the_same_cells_and_the_same_answer_in_any_unit() {
    for (kind, spacing, size, hole) in
        [("honeycomb", 0.88, [20.0, 10.0], Some(3.46)), ("hexagonal", 0.5, [30.0, 8.0], None)]
    {
        let of = |unit: f64| plate(kind, spacing, size, hole, unit);
        let (plan, outcome) = of(1.0);
        let largest = (0..plan.count()).map(|i| distance(outcome.engine.displacement(i), [0.0; 2]));
        let largest = largest.fold(0.0, f64::max);
        let stress = largest_stress(&outcome);
        // A hole is cut as finely as doubles go only where they are of ordinary size.
        let extremes: &[f64] = if hole.is_none() { &[1e-100, 1e100] } else { &[] };
        for &unit in [1e-3, 0.3048].iter().chain(extremes) {
            let (other_plan, other) = of(unit);
            assert_eq!(other_plan.count(), plan.count(), "{kind}, {unit}");
            for i in 0..plan.count() {
                let there = other_plan.setup.body.reference.get(i).map(|x| x / unit);
                assert!(distance(there, plan.setup.body.reference.get(i)) < 1e-9, "{kind}, {unit}: {i}");
                let moved = other.engine.displacement(i).map(|u| u / unit);
                let off = distance(moved, outcome.engine.displacement(i));
                assert!(off < 1e-7 * largest, "{kind}, {unit}: particle {i} off by {off:e}");
            }
            let off = largest_stress(&other) / stress - 1.0;
            assert!(off.abs() < 1e-6, "{kind}, {unit}: stress off by {off:e}");
        }
    }
}

#[test]
fn a_body_that_is_turned_with_its_lattice_has_the_same_largest_stress() {
    let largest = |degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let turned = |[x, y]: [f64; 2]| format!("[{:?}, {:?}]", cos * x - sin * y, sin * x + cos * y);
        let corners = [[0.0, 0.0], [30.0, 0.0], [30.0, 10.0], [0.0, 10.0]].map(turned).join(", ");
        let parts = format!(
            r#"
body = {{ shape = {{ kind = "polygon", vertices = [{corners}] }}, anchor = [0.0, 0.0] }}
material = {{ kind = "isotropic", young = 1000.0, poisson = 0.3 }}
roles = [{{ region = {{ kind = "outline", pieces = [4] }}, role = "clamped" }}]
loads = [{{ kind = "traction", region = {{ kind = "outline", pieces = [2] }}, traction = {} }}]
"#,
            turned([0.2, -1.0])
        );
        let lattice = format!("lattice = {{ kind = \"square\", spacing = 1.0, orientation = {degrees} }}");
        let (_, outcome) = solved(&scene(&lattice, &parts).expect("a scene"));
        largest_stress(&outcome)
    };
    let straight = largest(0.0);
    for degrees in [15.0, 30.0, 45.0, 90.0] {
        let off = largest(degrees) / straight - 1.0;
        assert!(off.abs() < 1e-6, "{degrees} degrees: off by {off:e}");
    }
}

#[test]
fn a_symmetric_body_has_symmetric_stress() {
    let parts = r#"
body = { shape = { kind = "rectangle", max = [20.0, 9.7] }, anchor = [10.0, 4.85], holes = [{ kind = "disc", centre = [10.0, 4.85], radius = 3.0 }] }
material = { kind = "isotropic", young = 1000.0, poisson = 0.3 }
roles = [{ region = { kind = "edge", side = "bottom" }, role = "clamped" }]
loads = [{ kind = "traction", region = { kind = "edge", side = "top" }, traction = [0.0, 1.0] }]
"#;
    let (plan, outcome) =
        solved(&scene("lattice = { kind = \"square\", spacing = 0.7 }", parts).expect("a scene"));
    let stresses = Stresses::at_present(&outcome.engine).expect("a material");
    let von_mises = |i: usize| stresses.particles[i].expect("in cells").von_mises;
    let reference = &plan.setup.body.reference;
    for (i, [x, y]) in reference.iter().enumerate() {
        let mirrored = reference.iter().position(|p| distance(p, [20.0 - x, y]) < 1e-6);
        let other = mirrored.expect("a symmetric body");
        let off = von_mises(i) / von_mises(other) - 1.0;
        assert!(off.abs() < 1e-5, "at ({x}, {y}): off by {off:e}");
    }
}

#[test]
fn whether_a_shape_is_wide_enough_does_not_depend_on_where_an_arc_begins() {
    for degrees in (0..360).step_by(45) {
        let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
        let centre = [3.5 * cos, 3.5 * sin];
        let parts = format!(
            r#"
body = {{ shape = {{ kind = "disc", radius = 8.0 }}, anchor = [0, 0], holes = [{{ kind = "disc", centre = [0.0, 0.0], radius = 1.5 }}], inclusions = [{{ shape = {{ kind = "disc", centre = {centre:?}, radius = 2.5 }}, material = {{ kind = "isotropic", young = 10.0, poisson = 0.3 }} }}] }}
material = {{ kind = "isotropic", young = 1.0, poisson = 0.3 }}
roles = [{{ region = {{ kind = "outline", angles = [100, 200] }}, role = "clamped" }}]
loads = [{{ kind = "body", force = [0.0, -0.01] }}]
"#
        );
        let scene = scene("lattice = { kind = \"hexagonal\", spacing = 0.6 }", &parts).expect("a scene");
        Plan::new(&scene).unwrap_or_else(|error| panic!("{degrees} degrees: {error}"));
    }
}
