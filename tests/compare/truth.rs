//! The truth is that of the shape: the same whatever lattice stands on it, and that of closed forms.

use flockform::fem::Effort;
use flockform::flock::vectors::Vectors;
use flockform::study::compare::measures::Comparison;
use flockform::study::compare::run::{SceneReference, reference_of};
use flockform::study::compare::split::ErrorParts;

use crate::scenes::load;
use crate::support::*;

fn truth(name: &str, overrides: &[&str]) -> SceneReference {
    reference_of(&load(name, overrides), &Effort::default()).unwrap_or_else(|e| panic!("{e}"))
}

const LATTICES: [&str; 6] = [
    "lattice={ kind = \"square\", spacing = 1.0 }",
    "lattice={ kind = \"rectangular\", a = 1.0, b = 1.3 }",
    "lattice={ kind = \"centred-rectangular\", a = 1.0, b = 1.4 }",
    "lattice={ kind = \"hexagonal\", spacing = 1.0 }",
    "lattice={ kind = \"oblique\", a = 1.0, b = 1.2, angle = 70.0 }",
    "lattice={ kind = \"honeycomb\", spacing = 0.7 }",
];

/// However it is written, a push is one point of the truth's mesh; what single points push has no truth, and that is said.
#[test]
fn forces_that_push_one_particle_are_one_and_are_warned_of() {
    let entry = "{ kind = \"force\", region = { kind = \"edge\", side = \"right\" }, force = [0.0, -0.005] }";
    let [once, often] = [1, 20].map(|times| {
        let whole = entry.replace("0.005", &format!("{:?}", 0.1 / f64::from(times)));
        compared("beam-loaded", &[&format!("loads=[{}]", vec![whole; times as usize].join(", "))])
    });
    let [a, b] = [&once, &often].map(|found| found.reference.solution.strain_energy());
    assert!((a / b - 1.0).abs() < 1e-9, "{a} and {b}");
    assert!(
        once.cautions.iter().any(|caution| caution.contains("loads[0] pushes single points")),
        "{:?}",
        once.cautions
    );
    assert_eq!(compared("beam-loaded", &[]).cautions, [""; 0]);
}

#[test]
fn the_truth_is_the_same_on_every_lattice() {
    let corner = |found: &SceneReference| {
        let places = [[21.0, 10.0], [21.0, 21.0], [15.3, 12.1]].into_iter().collect();
        found.solution.displacements_at(&places).unwrap_or_else(|e| panic!("{e}"))
    };
    let first = corner(&truth("beam-loaded", &[]));
    for lattice in LATTICES {
        let found = truth("beam-loaded", &[lattice]);
        assert!(largest_difference(&corner(&found), &first) < 1e-9, "{lattice}");
        assert!(found.solution.error().displacement < 1e-4, "{lattice}: {:?}", found.solution.error());
    }
}

#[test]
fn the_truth_of_a_bar_turned_between_two_grips_is_led_around_as_they_are() {
    let led = "motion = { kind = \"affine\", rotate = 120.0, about = [5.0, 0.5], steps = 100 }";
    let grips = ["left", "right"].map(|side| {
        format!("{{ region = {{ kind = \"edge\", side = \"{side}\" }}, role = \"leader\", {led} }}")
    });
    let bar = [
        "body={ shape = { kind = \"rectangle\", max = [10.0, 1.0] } }",
        "lattice={ kind = \"square\", spacing = 0.5 }",
        "rule.mean={ kind = \"material\", rotation = \"corotated\" }",
        &format!("roles=[{}]", grips.join(", ")),
        "loads=[]",
        "stop.steps=100",
    ];
    let found = truth("beam-loaded", &bar);
    let places: Vectors = [[0.0, 0.5], [3.0, 0.0], [5.0, 0.5], [8.0, 1.0]].into_iter().collect();
    let (sin, cos) = 120f64.to_radians().sin_cos();
    let turned = |[x, y]: [f64; 2]| {
        let [a, b] = [x - 5.0, y - 0.5];
        [cos * a - sin * b - a, sin * a + cos * b - b]
    };
    let known: Vectors = places.iter().map(turned).collect();
    let displaced = found.solution.displacements_at(&places).unwrap_or_else(|e| panic!("{e}"));
    assert!(largest_difference(&displaced, &known) < 1e-7);
}

const COOK: [&str; 5] = [
    "body={ shape = { kind = \"polygon\", vertices = [[0.0, 0.0], [48.0, 44.0], [48.0, 60.0], [0.0, 44.0]] } }",
    "lattice={ kind = \"square\", spacing = 4.0 }",
    "material={ kind = \"isotropic\", young = 1.0, poisson = 0.3333333333333333 }",
    "roles=[{ region = { kind = \"edge\", side = \"left\" }, role = \"clamped\" }]",
    "loads=[{ kind = \"traction\", region = { kind = \"edge\", side = \"right\" }, traction = [0.0, 0.0625] }]",
];

#[test]
fn cooks_membrane_has_the_published_displacement_in_truth() {
    let found = truth("beam-loaded", &COOK);
    let middle = [[48.0, 52.0]].into_iter().collect();
    let tip = found.solution.displacements_at(&middle).unwrap_or_else(|e| panic!("{e}")).get(0)[1];
    assert!((tip / 23.965 - 1.0).abs() < 3e-4, "{tip}");
}

fn measured(overrides: &[&str]) -> Comparison {
    let found = compared("beam-loaded", overrides).comparison;
    println!("{overrides:?}\n{found}");
    found
}

#[test]
fn a_body_of_whole_cells_is_held_against_the_shape_and_its_outline_is_blamed() {
    let compared = |outline: &str| measured(&[COOK.as_slice(), &[outline]].concat());
    let (staircase, fitted) = (compared("body.outline=\"lattice\""), compared("body.outline=\"fitted\""));
    assert!(staircase.displacement_rel_l2 > 0.2, "{staircase}");
    assert!(fitted.displacement_rel_l2 < 0.05, "{fitted}");
    let [of_staircase, of_fitted] = [&staircase, &fitted].map(|found| found.parts.outline.expect("told"));
    assert!(of_staircase > 0.1 && of_fitted < 1e-9, "{of_staircase} {of_fitted}");
    let solver = fitted.parts.solver.expect("told");
    assert!(
        solver < 1e-4
            && (fitted.parts.discretisation.expect("told") / fitted.displacement_rel_l2 - 1.0).abs() < 0.01
    );
}

#[test]
fn chords_for_arcs_and_a_coarse_tolerance_are_told_from_the_cells() {
    let hole = "body={ shape = { kind = \"rectangle\", max = [20.0, 12.0] }, holes = [{ kind = \"disc\", centre = [9.0, 6.0], radius = 2.5 }] }";
    let found = measured(&[hole, "equilibrium={ solver = \"conjugate-gradients\", tolerance = 1e-2 }"]);
    let ErrorParts { discretisation, outline, solver } = found.parts;
    let (outline, solver) = (outline.expect("told"), solver.expect("told"));
    assert!(outline > 1e-3 && outline < 0.02 && solver > 1e-6, "{found}");
    assert!(discretisation.expect("told") < found.displacement_rel_l2 + outline + solver);
}

#[test]
fn regions_of_whole_cells_hold_from_their_first_particle_to_their_last() {
    let block =
        "roles=[{ region = { kind = \"box\", min = [9.0, 9.0], max = [13.4, 30.0] }, role = \"clamped\" }]";
    let found = truth("beam-loaded", &[block]);
    let places = [[12.9, 15.0], [13.0, 20.0], [13.3, 15.0]].into_iter().collect();
    let moved = found.solution.displacements_at(&places).unwrap_or_else(|e| panic!("{e}"));
    assert!(moved.get(0)[0].hypot(moved.get(0)[1]) < 1e-12 && moved.get(1)[0].hypot(moved.get(1)[1]) < 1e-12);
    assert!(moved.get(2)[0].hypot(moved.get(2)[1]) > 1e-4, "{:?}", moved.get(2));
}

#[test]
fn particles_picked_one_by_one_hold_the_lines_between_them() {
    let column: Vec<String> = (1..=12).map(|id| id.to_string()).collect();
    let ids = format!(
        "roles=[{{ region = {{ kind = \"ids\", ids = [{}] }}, role = \"clamped\" }}]",
        column.join(", ")
    );
    let (edge, by_id) = (truth("beam-loaded", &[]), truth("beam-loaded", &[&ids]));
    let off = largest_difference(&edge.solution.displacement, &by_id.solution.displacement);
    assert!(off < 1e-9, "{off}");
}

#[test]
fn planes_of_symmetry_hold_one_component() {
    // A strip pulled along x: u = (sigma x / E, -nu sigma y / E) from its lower left corner.
    let rollers = "roles=[\
        { region = { kind = \"edge\", side = \"left\" }, role = \"clamped\", axis = \"x\" },\
        { region = { kind = \"edge\", side = \"bottom\" }, role = \"clamped\", axis = \"y\" }]";
    let pull = "loads=[{ kind = \"traction\", region = { kind = \"edge\", side = \"right\" }, traction = [50.0, 0.0] }]";
    let found = truth("beam-loaded", &[rollers, pull]);
    let places = &found.layout.body.reference;
    assert_eq!(found.solution.displacement.len(), places.len());
    for (u, [x, y]) in found.solution.displacement.iter().zip(places.iter()) {
        let exact = [0.05 * (x - 10.0), -0.33 * 0.05 * (y - 10.0)];
        assert!((0..2).all(|k| (u[k] - exact[k]).abs() < 1e-9), "({x}, {y}): {u:?}, not {exact:?}");
    }
}

/// Displacements far below the rounding of places are the solver's too.
#[test]
fn the_error_of_a_linear_body_does_not_depend_on_the_size_of_its_load() {
    let [heavy, light] = [1.0, 1e-14].map(|size| {
        let load = format!(
            "loads=[{{ kind = \"traction\", region = {{ kind = \"edge\", side = \"right\" }}, traction = [0.0, {:?}] }}]",
            -0.1 * size
        );
        let found = compared("beam-loaded", &[&load, "record.places=[[15.3, 12.1]]"]);
        let of = &found.comparison;
        let [ux, uy] = found.places[0].rule.displacement.map(|along| along / size);
        [of.displacement_rel_l2, of.von_mises_rel_l2, of.energy_rel, ux, uy]
    });
    for (heavy, light) in heavy.iter().zip(light) {
        assert!((light / heavy - 1.0).abs() < 1e-6, "{heavy} and {light}");
    }
}
