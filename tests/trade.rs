//! What accuracy costs, and what is taken for an accuracy.

use std::ops::ControlFlow;

use flockform::compare::run::compare;
use flockform::scene::raw::RawLattice;
use flockform::scene::{Scene, SceneError, bundled};
use flockform::solve::equilibrium::{Precision, Solver};
use flockform::trade::{Grid, Outcome, RuleChoice, Study, choose, run};

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

/// A bundled scene in the setting chosen for an accuracy.
fn chosen(name: &str, overrides: &[&str], accuracy: &str) -> Result<Scene, SceneError> {
    let scene = bundled(name).expect("bundled");
    let mut base: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
    base.push(format!("equilibrium.accuracy={accuracy}"));
    let load = |more: &[String]| scene.load(&[&base, more].concat());
    choose(load(&[])?, &load).map(|chosen| chosen.scene)
}

#[test]
fn the_setting_chosen_for_an_accuracy_has_it() {
    let mut spacings = Vec::new();
    for (accuracy, bound) in [("5%", 0.05), ("1 %", 0.01), ("0.002", 0.002)] {
        let scene = chosen("beam-loaded", &[], accuracy).unwrap_or_else(|error| panic!("{error}"));
        let compared = compare(&scene, None, &mut |_, _| ControlFlow::Continue(())).expect("compares");
        let error = compared.comparison.displacement_rel_l2;
        assert!(error <= bound, "{accuracy}: {error}");
        let Some(RawLattice::Square { spacing, .. }) = scene.raw.lattice else { panic!("square") };
        spacings.push(spacing);
    }
    assert!(spacings[0] > spacings[1] && spacings[1] > spacings[2], "no finer than needed: {spacings:?}");
}

#[test]
fn singles_are_taken_where_the_accuracy_allows_them_and_the_rule_where_it_is_open() {
    let precision = |accuracy: &str| {
        let scene = chosen("grips", &[], accuracy).unwrap_or_else(|error| panic!("{error}"));
        scene.equilibrium.expect("solved for").request.precision
    };
    assert_eq!([precision("1%"), precision("0.1%")], [Precision::F32, Precision::F64]);
}

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
        (refused("lattice-honeycomb", &HONEYCOMB, "0.1%"), "after 5 halvings of the spacing"),
    ] {
        assert!(message.contains(words) && message.contains("help: "), "{message}");
    }
}

const HONEYCOMB: [&str; 4] = [
    "material={kind=\"isotropic\",young=1.0,poisson=0.3}",
    "rule.mean={kind=\"material\"}",
    "neighbours={kind=\"cells\"}",
    "roles=[{region={kind=\"edge\",side=\"left\",depth=2.0},role=\"clamped\"},\
     {region={kind=\"edge\",side=\"right\",depth=2.0},role=\"leader\",motion={kind=\"velocity\",per_step=[0.01,0.0]}}]",
];
