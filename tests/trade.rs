//! What accuracy costs, and what is taken for an accuracy.

#![cfg(feature = "fem")]

use std::ops::ControlFlow;

use flockform::fem::Effort;
use flockform::scene::raw::RawLattice;
use flockform::scene::{Scene, SceneError, bundled};
use flockform::solve::equilibrium::{Precision, Solver};
use flockform::study::compare::run::compare;
use flockform::study::trade::{Chosen, Grid, Outcome, RuleChoice, Study, choose, run};
use rayon::prelude::*;

fn study(name: &str, grid: &Grid) -> Study {
    let scene = bundled(name).expect("bundled");
    run(&|more| scene.load(more), grid, &mut |_| {}).unwrap_or_else(|error| panic!("{error}"))
}

fn errors(study: &Study, rule: RuleChoice) -> Vec<f64> {
    let of_rule = study.points.iter().filter(|point| point.setting.rule == rule);
    of_rule.filter(|point| point.setting.tolerance <= 1e-6).filter_map(|point| point.error).collect()
}

#[test]
fn between_grips_the_paper_s_rule_stays_at_eight_percent_and_the_material_rule_converges() {
    let study = study("grips", &Grid::quick());
    let (paper, material) = (errors(&study, RuleChoice::Paper), errors(&study, RuleChoice::Material));
    assert!(!paper.is_empty() && paper.iter().all(|e| (0.07..0.09).contains(e)), "{paper:?}");
    assert!(!material.is_empty() && material.iter().all(|e| *e < 1e-3), "{material:?}");
    assert!(study.cheapest(0.1).is_some() && study.cheapest(1e-9).is_none());
}

#[test]
fn the_error_of_the_material_rule_falls_with_the_spacing_and_solvers_agree() {
    let grid = Grid {
        spacings: vec![1.0, 0.5, 0.25],
        tolerances: vec![1e-8],
        solvers: Solver::ALL.to_vec(),
        most_particles_to_sweep: 200,
        repeats: 1,
        ..Grid::default()
    };
    let study = study("beam-loaded", &grid);
    let error_at = |spacing: f64| {
        let here = study.points.iter().filter(|p| p.setting.spacing == spacing && p.error.is_some());
        let errors: Vec<f64> = here.filter_map(|p| p.error).collect();
        assert!(errors.len() >= 4, "{errors:?}");
        assert!(errors.iter().all(|e| (e / errors[0] - 1.0).abs() < 1e-3), "solvers agree: {errors:?}");
        errors[0]
    };
    let errors = [1.0, 0.5, 0.25].map(error_at);
    assert!(errors[0] < 0.02 && errors[0] / errors[1] > 2.5 && errors[1] / errors[2] > 2.5, "{errors:?}");
    let refused = study.points.iter().find(|p| p.setting.rule == RuleChoice::Paper).expect("tried");
    assert!(
        matches!(&refused.outcome, Outcome::Refused { reason } if reason.contains("without a stiffness"))
    );
}

#[test]
fn other_spacings_that_are_held_or_pushed_otherwise_are_no_part_of_a_study() {
    let errors = |sets: &[&str], words: &str| {
        let scene = bundled("beam-loaded").expect("bundled");
        let base: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        let study = run(&|more| scene.load(&[&base[..], more].concat()), &Grid::quick(), &mut |_| {});
        let study = study.unwrap_or_else(|error| panic!("{error}"));
        let at = |spacing: f64| {
            let here = move |point: &&flockform::study::trade::Point| {
                point.setting.spacing == spacing && point.setting.rule == RuleChoice::Material
            };
            study.points.iter().filter(here)
        };
        assert!(study.to_string().contains(words), "{study}");
        for point in at(0.5) {
            assert!(matches!(&point.outcome, Outcome::Refused { reason } if reason.contains(words)));
        }
        let whole = scene.load(&base).unwrap_or_else(|error| panic!("{error}"));
        let compared = compare(&whole, &Effort::default(), &mut |_, _| ControlFlow::Continue(()));
        let compared = compared.unwrap_or_else(|error| panic!("{error}")).comparison.displacement_rel_l2;
        let errors: Vec<f64> =
            at(1.0).filter(|point| point.setting.tolerance <= 1e-6).filter_map(|p| p.error).collect();
        assert!(!errors.is_empty(), "{study}");
        for error in errors {
            assert!((error / compared - 1.0).abs() < 0.01, "{error}, {compared}");
        }
    };
    errors(&[PUSHED], "in which it pushes more particles");
    errors(
        &["roles=[{region={kind=\"ids\",ids=[1,2,3,4,5,6]},role=\"clamped\"}]"],
        "these ids are other particles",
    );
}

#[test]
fn a_study_of_a_body_that_is_changed_on_its_way_names_what_changes_it() {
    let scene = bundled("tension").expect("bundled");
    let sets = ["material={ kind = \"isotropic\", young = 1.0, poisson = 0.3 }".to_owned()];
    let refused = run(&|more| scene.load(&[&sets[..], more].concat()), &Grid::quick(), &mut |_| {});
    let said = refused.expect_err("refused").to_string();
    assert!(said.contains("roles[2].from") && said.contains("leave this entry out to compare"), "{said}");
}

/// A bundled scene in the setting chosen for an accuracy, and the error estimated for it.
fn chosen_for(name: &str, overrides: &[&str], accuracy: &str) -> Result<Chosen, SceneError> {
    let scene = bundled(name).expect("bundled");
    let mut base: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
    base.push(format!("equilibrium.accuracy={accuracy}"));
    let load = |more: &[String]| scene.load(&[&base, more].concat());
    choose(load(&[])?, &load)
}

fn chosen(name: &str, overrides: &[&str], accuracy: &str) -> Result<Scene, SceneError> {
    chosen_for(name, overrides, accuracy).map(|chosen| chosen.scene)
}

#[test]
fn the_setting_chosen_for_an_accuracy_has_it() {
    let mut spacings = Vec::new();
    for (accuracy, bound) in [("5%", 0.05), ("1 %", 0.01), ("0.002", 0.002)] {
        let scene = chosen("beam-loaded", &[], accuracy).unwrap_or_else(|error| panic!("{error}"));
        let compared =
            compare(&scene, &Effort::default(), &mut |_, _| ControlFlow::Continue(())).expect("compares");
        let error = compared.comparison.displacement_rel_l2;
        assert!(error <= bound, "{accuracy}: {error}");
        let Some(RawLattice::Square { spacing, .. }) = scene.raw.lattice else { panic!("square") };
        spacings.push(spacing);
    }
    assert!(spacings[0] > spacings[1] && spacings[1] > spacings[2], "no finer than needed: {spacings:?}");
}

const HEXAGONAL: &str = "lattice={ kind = \"hexagonal\", spacing = 1.0 }";
const HONEYCOMB_LATTICE: &str = "lattice={ kind = \"honeycomb\", spacing = 1.0 }";
const TURNED: &str = "lattice={ kind = \"square\", spacing = 1.0, orientation = 30.0 }";
const SLENDER: &str = "body={ shape = { kind = \"rectangle\", max = [40.0, 1.0] } }";
const ODD: &str = "body={ shape = { kind = \"rectangle\", max = [10.0, 1.9] } }";
const HALF: &str = "lattice={ kind = \"square\", spacing = 0.5 }";
const HOLE: &str = "body={ shape = { kind = \"rectangle\", max = [20.0, 12.0] }, holes = [{ kind = \"disc\", centre = [9.0, 6.0], radius = 2.5 }] }";
const L_SHAPE: &str = "body={ shape = { kind = \"polygon\", vertices = [[0.0, 0.0], [12.0, 0.0], [12.0, 5.0], [5.0, 5.0], [5.0, 12.0], [0.0, 12.0]] } }";
const STIFF: &str = "material={ kind = \"isotropic\", young = 1000.0, poisson = 0.45, plane = \"strain\" }";
const WEIGHT: &str = "loads=[{ kind = \"body\", force = [0.0, -1.0] }]";

#[test]
fn what_is_delivered_is_at_most_what_was_asked_and_about_what_was_estimated() {
    let cases: [(&str, &[&str], &str, f64); 24] = [
        ("beam-loaded", &[SLENDER, HALF], "5%", 0.05),
        ("beam-loaded", &[SLENDER, HALF], "2%", 0.02),
        ("beam-loaded", &[SLENDER, HALF], "1%", 0.01),
        ("beam-loaded", &[SLENDER, HALF], "0.1%", 0.001),
        ("beam-loaded", &[ODD, HALF], "5%", 0.05),
        ("beam-loaded", &[HEXAGONAL], "2%", 0.02),
        ("beam-loaded", &[HONEYCOMB_LATTICE], "3%", 0.03),
        ("beam-loaded", &[TURNED], "2%", 0.02),
        ("beam-loaded", &[HOLE, TURNED], "2%", 0.02),
        ("beam-loaded", &[L_SHAPE, HEXAGONAL, WEIGHT], "3%", 0.03),
        ("beam-loaded", &[STIFF], "3%", 0.03),
        ("grips", &[HEXAGONAL], "0.5%", 0.005),
        ("cook", &[], "2%", 0.02),
        ("cook", &["lattice={ kind = \"hexagonal\", spacing = 2.0, orientation = 20.0 }"], "2%", 0.02),
        ("cook", &["lattice={ kind = \"honeycomb\", spacing = 1.5 }"], "1%", 0.01),
        ("ring", &[], "1%", 0.01),
        ("ring", &["lattice={ kind = \"oblique\", a = 1.0, b = 1.0, angle = 70.0 }"], "2%", 0.02),
        ("ring", &["material.poisson=0.49", "lattice={ kind = \"square\", spacing = 1.0 }"], "3%", 0.03),
        ("plate-hole", &["lattice={ kind = \"square\", spacing = 1.0, orientation = 30.0 }"], "1%", 0.01),
        ("plate-hole", &["lattice={ kind = \"centred-rectangular\", a = 1.5, b = 1.5 }"], "1%", 0.01),
        ("plate-hole", &[HEXAGONAL], "1%", 0.01),
        ("elastica", &["lattice.spacing=0.25"], "1%", 0.01),
        ("l-bracket", &["lattice={ kind = \"square\", spacing = 8.0 }"], "3%", 0.03),
        ("l-bracket", &["lattice={ kind = \"hexagonal\", spacing = 8.0 }"], "3%", 0.03),
    ];
    // Each takes one thread for seconds.
    cases.into_par_iter().for_each(|(name, overrides, asked, bound)| {
        let Chosen { scene, estimate, .. } = chosen_for(name, overrides, asked)
            .unwrap_or_else(|error| panic!("{overrides:?} {asked}: {error}"));
        let effort = Effort { target: 1e-6, ..Effort::default() };
        let found = compare(&scene, &effort, &mut |_, _| ControlFlow::Continue(()));
        let found = found.unwrap_or_else(|error| panic!("{overrides:?}: {error}"));
        let error = found.comparison.displacement_rel_l2;
        let request = scene.equilibrium.expect("solved for").request;
        let ratio = estimate.expect("was measured") / error;
        assert!(error <= bound, "{name} {overrides:?} {asked}: {error}, {request:?}");
        assert!(
            (0.5..2.0).contains(&ratio),
            "{name} {overrides:?} {asked}: {error}, estimated {ratio} times that"
        );
        let solved = found.outcome.solved.as_ref().expect("solved");
        assert!(solved.converged, "{name} {overrides:?} {asked} ends short of its tolerance");
    });
}

#[test]
fn an_accuracy_that_the_truth_itself_lacks_is_refused_with_that_reason() {
    let pinned = "roles=[{ region = { kind = \"ids\", ids = [1, 12] }, role = \"clamped\" }]";
    let message = chosen("beam-loaded", &[pinned], "1%").expect_err("refused").to_string();
    assert!(
        message.contains("the truth states an error of") && message.contains("single points"),
        "{message}"
    );
}

#[test]
fn singles_are_taken_where_the_accuracy_allows_them_and_the_rule_where_it_is_open() {
    let precision = |accuracy: &str| {
        let scene = chosen("grips", &[], accuracy).unwrap_or_else(|error| panic!("{error}"));
        scene.equilibrium.expect("solved for").request.precision
    };
    assert_eq!([precision("1%"), precision("0.1%")], [Precision::F32, Precision::F64]);
}

const PUSHED: &str =
    "loads=[{ kind = \"force\", region = { kind = \"edge\", side = \"right\" }, force = [0.0, -0.1] }]";
/// Holds the first column, and at less than 0.4 of the spacing the second one too.
const BOX: &str =
    "roles=[{ region = { kind = \"box\", min = [10.0, 10.0], max = [10.4, 21.0] }, role = \"clamped\" }]";
const DISC: &str = "body.shape={ kind = \"disc\", centre = [0.0, 0.0], radius = 10.0 }";

#[test]
fn an_accuracy_that_cannot_be_had_is_refused_with_the_reason() {
    let refused = |name: &str, overrides: &[&str], accuracy: &str| {
        chosen(name, overrides, accuracy).expect_err("refused").to_string()
    };
    let paper = "rule.mean={kind=\"barycentre\"}";
    for (message, words) in [
        (refused("grips", &[paper], "1%"), "not sure to come nearer to elasticity than 30 %"),
        (refused("grips", &[], "1.5"), "more than 0 and less than 1"),
        (refused("grips", &[], "much"), "more than 0 and less than 1"),
        (refused("lattice-square", &[], "1%"), "the scene has none"),
        (refused("beam-loaded", &["record.probes=[3]"], "1%"), "these ids are other particles"),
        (refused("beam-loaded", &[PUSHED], "1%"), "in which it pushes more particles"),
        (refused("beam-loaded", &["load_steps={schedule=[1.0,0.5]}"], "1%"), "the last part is 0.5"),
        (
            refused("beam-loaded", &[DISC, "lattice.spacing=2.0"], "0.5%"),
            "less of a side that is not straight is outermost",
        ),
        (
            refused("beam-loaded", &[BOX], "0.1%"),
            "particles from [10.0, 10.0] to [10.25, 21.0] instead of [10.0, 10.0] to [10.0, 21.0]",
        ),
        (refused("beam-loaded", &["lattice.spacing=2.75"], "0.0001"), "after 5 halvings of the spacing"),
    ] {
        assert!(message.contains(words) && message.contains("help: "), "{message}");
    }
}
