//! Published figures: Cook's membrane, and the rows of a table of bodies that whole cells get wrong.

use flockform::continuum::mechanics::{Mechanics, Stresses};
use flockform::flock::vectors::distance;

use crate::scenes::load;
use crate::support::{KINDS, lattice, on_right_edge, scene, solved};

const COOK: &str = r#"
body = { shape = { kind = "polygon", vertices = [[0.0, 0.0], [48.0, 44.0], [48.0, 60.0], [0.0, 44.0]] } }
material = { kind = "isotropic", young = 1.0, poisson = 0.3333333333333333 }
roles = [{ region = { kind = "outline", pieces = [4] }, role = "clamped" }]
loads = [{ kind = "traction", region = { kind = "outline", pieces = [2] }, traction = [0.0, 0.0625] }]
"#;

/// R. D. Cook's membrane (J. Struct. Div. ASCE 100, 1974): middle of the loaded edge.
const COOK_TIP: f64 = 23.965;

fn cook(kind: &str, h: f64, orientation: f64) -> f64 {
    let scene = scene(&lattice(kind, h, orientation), COOK).expect("a scene");
    let (plan, outcome) = solved(&scene);
    on_right_edge(&plan, &outcome, 48.0, 52.0)[1] / COOK_TIP - 1.0
}

#[test]
fn cook_s_membrane_is_right_to_three_parts_in_a_thousand_on_every_lattice_turned_or_not() {
    for kind in KINDS {
        let aligned = [1.0, 0.5].map(|h| cook(kind, h, 0.0));
        assert!(aligned[0].abs() < 0.003 && aligned[1].abs() < 0.001, "{kind}: {aligned:?}");
        for orientation in [17.0, 41.0] {
            let turned = cook(kind, 1.0, orientation);
            assert!(turned.abs() < 0.003, "{kind} at {orientation} degrees: {turned}");
        }
    }
}

#[test]
fn uniform_traction_on_one_edge_gives_a_uniform_stress_on_every_lattice_in_any_direction() {
    let parts = r#"
body = { shape = { kind = "rectangle", max = [40.0, 20.0] } }
material = { kind = "isotropic", young = 1000.0, poisson = 0.3 }
roles = [
    { region = { kind = "outline", pieces = [4] }, role = "clamped", axis = "x" },
    { region = { kind = "outline", pieces = [1] }, role = "clamped", axis = "y" },
]
loads = [{ kind = "traction", region = { kind = "edge", side = "right" }, traction = [10.0, 0.0] }]
"#;
    for kind in KINDS {
        for orientation in [0.0, 30.0, 90.0] {
            let scene = scene(&lattice(kind, 1.7, orientation), parts).expect("a scene");
            let (plan, outcome) = solved(&scene);
            for (i, p) in plan.setup.body.reference.iter().enumerate() {
                let u = outcome.engine.displacement(i);
                let exact = [0.01 * p[0], -0.003 * p[1]];
                let off = (u[0] - exact[0]).hypot(u[1] - exact[1]);
                assert!(off < 1e-9, "{kind} at {orientation}: {p:?} goes {u:?}, not {exact:?}");
            }
        }
    }
}

#[test]
fn a_rectangle_that_is_no_multiple_of_the_spacing_has_its_height() {
    // A slender cantilever, by the beam of E. Reissner and S. Timoshenko: bending and shear.
    let parts = r#"
body = { shape = { kind = "rectangle", max = [10.0, 1.9] } }
material = { kind = "isotropic", young = 1000.0, poisson = 0.3 }
roles = [{ region = { kind = "edge", side = "left" }, role = "clamped" }]
loads = [{ kind = "traction", region = { kind = "edge", side = "right" }, traction = [0.0, 1.0] }]
"#;
    let scene = scene(&lattice("square", 0.25, 0.0), parts).expect("a scene");
    let (plan, outcome) = solved(&scene);
    let tip = on_right_edge(&plan, &outcome, 10.0, 0.95)[1];
    let (force, inertia, shear) = (1.9, 1.9f64.powi(3) / 12.0, 1000.0 / 2.6);
    let beam = force * 1000.0 / (3.0 * 1000.0 * inertia) + 1.2 * force * 10.0 / (shear * 1.9);
    assert!((tip / beam - 1.0).abs() < 0.02, "{tip} {beam}");
}

#[test]
fn the_crown_of_a_hole_carries_its_published_stress() {
    // A quarter of a plate 40 x 40 with a hole of radius 4: 3.36 times the tension (as `flockform run plate-hole`).
    for kind in KINDS {
        for (h, bound) in [(0.5, 0.03), (0.25, 0.02)] {
            for orientation in [0.0, 20.0] {
                let scene = load("plate-hole", &[&lattice(kind, h, orientation)]);
                let (plan, outcome) = solved(&scene);
                let stresses = Stresses::at_present(&outcome.engine).expect("a material");
                let crown = [0.0, 4.0];
                let at =
                    (0..plan.count()).find(|&i| distance(plan.setup.body.reference.get(i), crown) < 1e-9);
                let stress = stresses.particles[at.expect("a corner")].expect("in cells").components[0];
                assert!((stress / 3.36 - 1.0).abs() < bound, "{kind}, {h}, {orientation} degrees: {stress}");
            }
        }
    }
}

#[test]
fn the_largest_stress_of_a_plate_with_a_hole_does_not_grow_with_refinement() {
    // On whole cells the corners of the staircase carry more the finer they are. Here the largest is the crown's.
    for kind in KINDS {
        for orientation in [0.0, 20.0] {
            let largest = [1.0, 0.5, 0.25, 0.125].map(|h| {
                let scene = load("plate-hole", &[&lattice(kind, h, orientation)]);
                let (_, outcome) = solved(&scene);
                let peak = Mechanics::of(&outcome.engine).and_then(|all| all.largest_von_mises);
                let peak = peak.expect("is stressed");
                assert!(distance(peak.place, [0.0, 4.0]) < 1.0, "{kind}, {h}, {orientation}: {peak:?}");
                peak.von_mises / 3.36
            });
            println!("{kind} at {orientation}: {largest:.4?}");
            assert!(largest.iter().all(|part| *part < 1.06), "{kind} at {orientation}: {largest:?}");
            assert!((largest[3] - 1.0).abs() < 0.02, "{kind} at {orientation}: {largest:?}");
        }
    }
}
