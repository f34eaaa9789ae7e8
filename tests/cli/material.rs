//! `flockform material` as a person meets it, and the numbers it reports.

use std::path::Path;
use std::process::Output;

use flockform::flock::lattice::{Lattice, LatticeKind};
use flockform::material::elastic::{Constants, Elastic, Plane};
use flockform::material::report::MaterialReport;
use serde_json::Value;

use crate::program::*;

fn material(arguments: &[&str]) -> Output {
    flockform(&[&["material"], arguments].concat(), Path::new("."))
}

fn said(arguments: &[&str]) -> String {
    done(&[&["material"], arguments].concat(), Path::new("."))
}

fn report_of(arguments: &[&str]) -> Value {
    json(&said(&[arguments, &["--json"]].concat()))
}

fn refused(arguments: &[&str], words: &[&str]) {
    let output = material(arguments);
    assert_refused(&output, &arguments.join(" "), words);
    assert!(output.stdout.is_empty());
}

fn close(value: &Value, expected: f64, tolerance: f64) -> bool {
    value.as_f64().is_some_and(|value| (value - expected).abs() <= tolerance)
}

/// Lattices by their options.
const LATTICES: [&[&str]; 6] = [
    &["--lattice", "square", "--spacing", "0.3"],
    &["--lattice", "rectangular", "--a", "1", "--b", "1.5"],
    &["--lattice", "centred-rectangular", "--a", "1", "--b", "1.4", "--orientation", "20"],
    &["--lattice", "hexagonal", "--spacing", "2"],
    &["--lattice", "oblique", "--a", "1", "--b", "1.2", "--angle", "70"],
    &["--lattice", "honeycomb"],
];

#[test]
fn poisson_and_young_are_recovered_on_every_lattice_by_the_command() {
    for lattice in LATTICES {
        for (nu, plane) in [("-0.9", "stress"), ("0", "strain"), ("0.33", "stress"), ("0.49", "strain")] {
            let constants = ["--young", "210e9", "--poisson", nu, "--plane", plane, "--thickness", "1e-3"];
            let report = report_of(&[lattice, &constants].concat());
            let found = &report["material"];
            let nu: f64 = nu.parse().expect("a number");
            let (poisson, young) = (format!("poisson_plane_{plane}"), format!("young_plane_{plane}"));
            assert!(close(&found[poisson], nu, 1e-6), "{lattice:?} {nu}: {found}");
            assert!(close(&found[young], 210e9, 210e3), "{lattice:?} {nu}: {found}");
            assert_eq!(found["isotropic"], true);
            assert_eq!(report["waves"]["stable"], true);
        }
    }
}

#[test]
fn poisson_is_recovered_to_a_millionth_from_minus_nine_tenths_to_almost_a_half() {
    for kind in LatticeKind::SAMPLES {
        let lattice = Lattice::new(kind, [0.0; 2], 0.2);
        for step in 0..=28 {
            let poisson = -0.9 + 1.39 * f64::from(step) / 28.0;
            for plane in [Plane::Stress, Plane::Strain] {
                let constants = Constants::Isotropic { young: 7.0, poisson, plane };
                let elastic = Elastic::new(constants, 0.5).expect("admissible");
                let found = MaterialReport::of_material(&lattice, &elastic).expect("a material").material;
                let (nu, young) = match plane {
                    Plane::Stress => (Some(found.poisson_plane_stress), Some(found.young_plane_stress)),
                    Plane::Strain => (found.poisson_plane_strain, found.young_plane_strain),
                };
                assert!((nu.expect("a solid") - poisson).abs() < 1e-6, "{kind:?} {poisson}: {nu:?}");
                assert!((young.expect("a solid") - 7.0).abs() < 1e-6, "{kind:?} {poisson}: {young:?}");
            }
        }
    }
}

#[test]
fn eq_1_on_a_square_lattice_is_a_material_of_poisson_ratio_minus_one() {
    let arguments = ["--lattice", "square"];
    let report = report_of(&arguments);
    let found = &report["material"];
    assert!(close(&found["poisson_plane_stress"], -1.0, 1e-12), "{found}");
    assert!(close(&found["young_plane_stress"], 0.0, 1e-12), "{found}");
    assert!(found["poisson_plane_strain"].is_null());
    assert_eq!(found["up_to_scale"], true);
    assert!(close(&report["gradient"]["longitudinal_x"], -1.0 / 12.0, 1e-12));
    assert_eq!(report["gradient"]["effect"], "softens");
    assert!(close(&report["waves"]["damping_limit"], 1.0, 1e-9));
    let said = said(&arguments);
    for words in [
        "nu in plane stress          -1.000000000",
        "no force",
        "isotropic",
        "stable",
        "not a second gradient",
    ] {
        assert!(said.contains(words), "no `{words}` in\n{said}");
    }
}

#[test]
fn a_lattice_of_any_size_has_its_digits() {
    let said = said(&["--lattice", "square", "--spacing", "1e-6"]);
    for words in [
        "[  1.00000e-6    0.00000e0]",
        "1.000000e-6 apart",
        "-8.33333333e-14 along",
        "1.0000 of what springs",
    ] {
        assert!(said.contains(words), "no `{words}` in\n{said}");
    }
}

#[test]
fn hexagonal_weights_have_the_closed_form() {
    for nu in ["-0.9", "0", "0.3333333333333333", "0.45"] {
        let report =
            report_of(&["--lattice", "hexagonal", "--spacing", "1", "--young", "3", "--poisson", nu]);
        let nu: f64 = nu.parse().expect("a number");
        let r = (1.0 - 3.0 * nu) / (5.0 + nu);
        let weights = report["weights"].as_array().expect("weights");
        assert_eq!(weights.len(), 6);
        for weight in weights {
            let [x, y] = [0, 1].map(|k| weight["vector"][k].as_f64().expect("a number"));
            let (n, t) = ([x, y], [-y, x]);
            for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let closed = (n[a] * n[b] + r * t[a] * t[b]) / (3.0 * (1.0 + r));
                assert!(close(&weight["weight"][a][b], closed, 1e-12), "{nu}: {weight} {closed}");
            }
        }
    }
}

#[test]
fn weights_of_a_particle_sum_to_the_identity() {
    for lattice in LATTICES {
        let report = report_of(&[lattice, &["--young", "2", "--poisson", "0.3"]].concat());
        let weights = report["weights"].as_array().expect("weights");
        let sublattices = report["diagonal"].as_array().expect("one a sublattice").len();
        for s in 0..sublattices {
            for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let own = weights.iter().filter(|w| w["sublattice"] == s);
                let sum: f64 = own.map(|w| w["weight"][a][b].as_f64().expect("a number")).sum();
                assert!((sum - if a == b { 1.0 } else { 0.0 }).abs() < 1e-12, "{lattice:?}: {sum}");
            }
        }
    }
}

#[test]
fn an_orthotropic_sheet_comes_back_along_its_fibres() {
    for lattice in LATTICES {
        let fibres = ["--young", "9,1", "--poisson", "0.4", "--shear", "0.6", "--fiber-angle", "30"];
        let report = report_of(&[lattice, &fibres].concat());
        let found = &report["material"]["engineering"];
        assert!(close(&found["angle"], 30.0, 1e-9) && close(&found["young"][0], 9.0, 1e-9), "{found}");
        assert!(close(&found["young"][1], 1.0, 1e-9) && close(&found["poisson_12"], 0.4, 1e-9), "{found}");
        assert!(close(&found["shear"], 0.6, 1e-9));
        assert_eq!(report["material"]["isotropic"], false);
    }
}

#[test]
fn a_rule_that_no_symmetric_stress_has_says_so() {
    let said = said(LATTICES[1]);
    assert!(said.contains("misfit") && said.contains("no symmetric stress"), "{said}");
}

#[test]
fn an_unstable_rule_says_so_and_offers_no_damping() {
    let weights = "1,1,1,1,-0.3,-0.3,-0.3,-0.3";
    let arguments = ["--lattice", "square", "--neighbours", "collinear", "--weights", weights];
    let report = report_of(&arguments);
    assert_eq!(report["waves"]["stable"], false);
    assert!(report["waves"]["damping_limit"].is_null());
    assert!(said(&arguments).contains("stable                      NO"));
}

#[test]
fn neighbours_that_leave_particles_loose_are_unstable() {
    for arguments in [["--neighbours", "offsets:2,0;-2,0;0,2;0,-2"], ["--weights", "1,1,0,0"]] {
        let report = report_of(&[&["--lattice", "square"][..], &arguments].concat());
        assert_eq!(report["waves"]["stable"], false, "{arguments:?}");
    }
}

#[test]
fn a_second_gradient_reports_a_positive_length_squared() {
    let report = report_of(&["--lattice", "hexagonal", "--weights", "gradient:4"]);
    assert_eq!(report["gradient"]["effect"], "stiffens");
    // l^2 - h^2 / 6 to the order of the lattice, h^2 = 3/4.
    assert!(close(&report["gradient"]["least"], 16.0 - 0.125, 1e-2), "{}", report["gradient"]);
    refused(&["--lattice", "square", "--weights", "gradient:0.3"], &["--weights", "too short"]);
    refused(&["--lattice", "honeycomb", "--weights", "gradient:3"], &["honeycomb", "Bravais"]);
    refused(&["--lattice", "square", "--weights", "gradient:3", "--neighbours", "chebyshev"], &["collinear"]);
}

#[test]
fn a_scene_is_asked_by_name_or_path_with_overrides() {
    let report = report_of(&["second-gradient"]);
    assert_eq!(report["weights"].as_array().map(Vec::len), Some(12));
    let report = report_of(&["gradient-layer", "--set", "rule.weights.length=5"]);
    assert!(close(&report["gradient"]["longitudinal_x"], 25.0 - 1.0 / 6.0, 1e-3));
    // Eq. 3 at rest: one along a bond, its derivative one more.
    let report = report_of(&["tension", "--set", "rule.mean={kind=\"distance\"}"]);
    assert!(close(&report["weights"][0]["weight"][0][0], 1.0 / 3.0, 1e-12));
    assert!(close(&report["weights"][0]["weight"][1][1], 1.0 / 6.0, 1e-12));
    // The update divides by the weights alone, so that its shortest waves change by three times themselves.
    assert!(close(&report["waves"]["damping_limit"], 2.0 / 3.0, 1e-9));
}

#[test]
fn scenes_without_fixed_weights_are_refused_with_the_reason() {
    refused(&["drop"], &["neighbours.kind", "no fixed weights", "help:"]);
    refused(&["tension", "--set", "rule.mean={kind=\"geometric\"}"], &["rule.mean", "no fixed weights"]);
    refused(&["tension", "--set", "rule.poisson={k=-0.3}"], &["rule.poisson", "Eq. 2", "homogeneous"]);
    refused(&["feedback-grow"], &["rule.feedback", "initial position"]);
    refused(&["tension", "--set", "neighbours={kind=\"first\",keep=3}"], &["not symmetric", "opposite"]);
    refused(&["tensoin"], &["`tension`"]);
}

#[test]
fn options_that_make_no_question_are_refused_with_the_remedy() {
    refused(&[], &["--lattice"]);
    refused(&["tension", "--lattice", "square"], &["cannot be used with"]);
    let beside = ["--spacing", "--a", "--b", "--angle", "--orientation", "--neighbours", "--weights"];
    let constants = ["--young", "--poisson", "--shear", "--fiber-angle", "--plane", "--thickness"];
    for option in beside.into_iter().chain(constants) {
        let value = if option == "--plane" { "strain" } else { "-7" };
        refused(&["tension", &format!("{option}={value}")], &["cannot be used with", option]);
    }
    for set in ["garbage", "rule.nosuch=1", "neighbours={kind=\"chebyshev\",radius=1}"] {
        refused(&["--lattice", "square", "--set", set], &["--set", "cannot be used with", "--lattice"]);
    }
    refused(&["--set", "lattice.spacing=2"], &["SCENE"]);
    refused(&["--lattice", "sqare"], &["square"]);
    refused(&["--lattice", "square", "--neighbours", "first:3"], &["not symmetric", "opposite neighbours"]);
    refused(&["--lattice", "square", "--neighbours", "nearest"], &["`nearest`", "first, first:3"]);
    refused(&["--lattice", "square", "--neighbours", "first:9"], &["`9`", "1 to 6"]);
    refused(&["--lattice", "square", "--neighbours", "within:0.5"], &["within 0.5"]);
    refused(&["--lattice", "square", "--neighbours", "within:1e9"], &["32 spacings"]);
    refused(&["--lattice", "square", "--neighbours", "offsets:1,0;1,0"], &["twice"]);
    refused(&["--lattice", "square", "--neighbours", "offsets:0,0"], &["not both 0"]);
    refused(&["--lattice", "honeycomb", "--neighbours", "chebyshev"], &["honeycomb"]);
    refused(&["--lattice", "square", "--weights", "1,1"], &["2 weights", "4 neighbours"]);
    refused(&["--lattice", "square", "--weights", "1,1,x,1"], &["`x`"]);
    refused(&["--lattice", "square", "--weights", "-1,-1,-1,-1"], &["positive"]);
    refused(&["--lattice", "square", "--weights", "1,2,1,1"], &["not symmetric"]);
    refused(&["--lattice", "square", "--weights", "nan,1,1,1"], &["finite"]);
    let cancels = "1,1,1,1,-0.25,-0.25,-0.25,-0.25";
    refused(
        &["--lattice", "square", "--neighbours", "collinear", "--weights", cancels],
        &["long waves cost nothing"],
    );
    refused(
        &["--lattice", "square", "--neighbours", "second", "--weights", "distance:1e9"],
        &["power", "double"],
    );
    refused(&["--lattice", "square", "--spacing", "1e-200"], &["too small", "units"]);
    refused(&["--lattice", "square", "--young", "1e300", "--poisson", "0.3"], &["too large", "units"]);
    refused(&["--lattice", "square", "--a", "2"], &["--a", "--spacing"]);
    refused(&["--lattice", "square", "--spacing", "-1"], &["--spacing", "positive"]);
    refused(&["--lattice", "rectangular", "--a", "2"], &["--b", "needs"]);
    refused(&["--lattice", "oblique", "--a", "1", "--b", "1", "--angle", "180"], &["--angle", "180"]);
    for (b, angle) in [("3e9", "40"), ("1e-9", "40"), ("1", "1e-5"), ("1", "179.99999")] {
        refused(&["--lattice", "oblique", "--a", "1", "--b", b, "--angle", angle], &["--b", "million times"]);
    }
}

#[test]
fn materials_that_cannot_be_are_refused_with_the_range() {
    let square = |more: &[&str], words: &[&str]| refused(&[&["--lattice", "square"], more].concat(), words);
    square(&["--young", "1", "--poisson", "-1"], &["--poisson", "between -1 and 1"]);
    square(&["--young", "1", "--poisson", "0.5", "--plane", "strain"], &["--poisson", "incompressible"]);
    square(&["--young", "0", "--poisson", "0.3"], &["--young", "positive"]);
    square(&["--young", "1", "--poisson", "0.3", "--thickness", "0"], &["--thickness"]);
    square(&["--young", "9,1", "--poisson", "0.3"], &["--young", "--shear"]);
    square(&["--young", "9,1", "--poisson", "3.5", "--shear", "1"], &["--poisson", "sqrt(E1/E2)"]);
    square(&["--young", "1"], &["--poisson"]);
    square(&["--young", "1", "--poisson", "0.3", "--weights", "1,1,1,1"], &["cannot be used with"]);
}
