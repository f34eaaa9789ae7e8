//! The truth against the reference files.

use flockform::fem::Effort;
use flockform::flock::rules::Rotation;
use flockform::study::compare::measures::{Comparison, Sides, von_mises};
use flockform::study::compare::run::{SceneReference, reference_of};

use crate::reference::beam_displacements;
use crate::scenes::load;
use crate::support::*;

/// Distance of the truth from the reference, by the measures of a comparison.
fn distance_from_reference(name: &str, aspect: u32) -> Comparison {
    let scene = load(name, &[]);
    let SceneReference { solution: truth, layout, elastic, time } =
        reference_of(&scene, &Effort::default()).unwrap_or_else(|e| panic!("{e}"));
    let (body, cells) = (&layout.body, layout.cells.as_ref().expect("has cells"));
    let follows: Vec<bool> = body.reference.x.iter().map(|&x| x > 10.5).collect();
    let known = beam_displacements(aspect, &body.reference);
    let [of_truth, of_known] =
        [&truth.displacement, &known].map(|u| von_mises(cells, &elastic, u, Rotation::Small));
    let sides = Sides {
        cells,
        elastic: &elastic,
        rotation: Rotation::Small,
        rule: &truth.displacement,
        truth: &known,
        von_mises: [&of_truth, &of_known],
        follows: &follows,
    };
    let found = Comparison::of(&sides).expect("measures");
    println!(
        "aspect {aspect}, {} nodes, stated {:.1e}: displacement {:.2e}, von Mises {:.2e}, energy {:.2e}, {time:?}",
        truth.nodes(),
        truth.error().displacement,
        found.displacement_rel_l2,
        found.von_mises_rel_l2,
        found.energy_rel
    );
    found
}

#[test]
fn the_truth_of_the_beam_is_that_of_the_reference() {
    for (name, aspect) in [("beam-loaded", 1), ("beam-5", 5), ("beam-10", 10)] {
        let found = distance_from_reference(name, aspect);
        assert!(found.displacement_rel_l2 < 5e-4 && found.von_mises_rel_l2 < 1e-3, "{aspect}: {found}");
    }
}

/// Displacement and von Mises errors of a bundled scene.
fn errors(name: &str, overrides: &[&str]) -> [f64; 2] {
    let found = compared(name, overrides);
    assert_eq!(found.outcome.reason.name(), "equilibrium", "{name}");
    println!("{name} {overrides:?}\n{}", found.comparison);
    [found.comparison.displacement_rel_l2, found.comparison.von_mises_rel_l2]
}

fn assert_errors(name: &str, overrides: &[&str], expected: [f64; 2], slack: f64) {
    let found = errors(name, overrides);
    for k in 0..2 {
        assert!((found[k] - expected[k]).abs() < slack, "{name} {overrides:?}: {found:?}");
    }
}

#[test]
fn the_material_rule_led_by_the_truth_is_within_half_a_percent_of_it() {
    for (name, displacement, von_mises) in
        [("beam", 0.005, 0.025), ("beam-5", 0.005, 0.01), ("beam-10", 0.005, 0.01)]
    {
        let found = errors(name, &[]);
        assert!(found[0] < displacement && found[1] < von_mises, "{name}: {found:?}");
    }
    assert_errors("beam", &[], [0.0039, 0.0224], 3e-4);
    // Stress is the same all over a triangle, which no bent body's is.
    assert_errors("beam-hexagonal", &[], [0.0039, 0.0823], 1e-3);
}

#[test]
fn the_material_rule_under_its_load_is_within_two_percent_of_the_truth() {
    let found = errors("beam-loaded", &[]);
    assert!(found[0] < 0.02 && found[1] < 0.03, "{found:?}");
}

#[test]
fn the_papers_rule_has_its_large_errors_whatever_the_neighbours() {
    assert_errors("beam-paper", &[], [0.262, 0.758], 0.01);
    assert_errors("beam-paper-ring", &[], [0.264, 0.773], 0.01);
    assert_errors("beam-paper-second", &[], [0.264, 0.769], 0.01);
    assert_errors("beam-paper-reduced", &[], [0.437, 1.464], 0.01);
    assert_errors("beam-paper-hexagonal", &[], [0.235, 0.816], 0.01);
    assert_errors("beam-paper-hexagonal-reduced", &[], [0.237, 0.787], 0.01);
    for (name, von_mises) in [("beam-paper-5", 5.85), ("beam-paper-10", 12.36)] {
        let found = errors(name, &[]);
        assert!((found[1] - von_mises).abs() < 0.01, "{name}: {found:?}");
    }
}

#[test]
fn neighbours_beyond_those_of_the_cells_change_nothing_in_the_material_rule() {
    let few = compared("beam", &[]);
    let ring = "neighbours={ kind = \"chebyshev\", radius = 2 }";
    for many in [compared("beam-second", &[]), compared("beam", &[ring])] {
        assert!(largest_difference(&few.rule, &many.rule) < 1e-6);
    }
}

#[test]
fn followers_on_plane_strain_and_fibres_are_near_their_own_truth_too() {
    for material in [
        "material={ kind = \"isotropic\", young = 1000.0, poisson = 0.33, plane = \"strain\", thickness = 0.1 }",
        "material={ kind = \"orthotropic\", young = [1000.0, 300.0], poisson_12 = 0.3, shear = 200.0, angle = 30.0 }",
    ] {
        let found = errors("beam", &[material]);
        assert!(found[0] < 0.006 && found[1] < 0.04, "{material}: {found:?}");
    }
}
