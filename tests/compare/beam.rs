//! The truth against the reference files.

use std::path::Path;
use std::time::Instant;

use flockform::compare::measures::{Comparison, Sides};
use flockform::compare::mesh::TruthMesh;
use flockform::flock::body::Body;
use flockform::flock::neighbourhood::Neighbourhood;
use flockform::flock::points::Points;
use flockform::material::cells::Cells;
use flockform::material::weights::MaterialWeights;

use crate::support::*;

/// Displacements of a reference file at the particles.
fn reference(aspect: u32, body: &Body) -> Points {
    // Beside the checkout, or above it where the checkout is a worktree in a folder of such.
    let name = format!("shared/reference/beam_aspect{aspect}.csv");
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().skip(1).map(|folder| folder.join(&name));
    let path = above.clone().find(|path| path.exists()).or(above.clone().next()).expect("has a parent");
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let rows: Vec<[f64; 4]> = text
        .lines()
        .skip(1)
        .map(|line| {
            let values: Vec<f64> = line.split(',').map(|v| v.parse().expect("a number")).collect();
            values.try_into().expect("four columns")
        })
        .collect();
    let at = |p: [f64; 2]| rows.iter().find(|r| (r[0] - p[0]).hypot(r[1] - p[1]) < 1e-9).expect("listed");
    body.reference.iter().map(|p| [at(p)[2], at(p)[3]]).collect()
}

/// Distance of the truth from the reference, by the measures of a comparison.
fn distance_from_reference(aspect: u32, refine: Option<usize>) -> Comparison {
    let (body, cells) = beam(aspect);
    let refine = refine.unwrap_or_else(|| TruthMesh::default_refinement(&cells));
    let start = Instant::now();
    let truth = beam_truth(&body, &cells, refine);
    let seconds = start.elapsed().as_secs_f64();
    let follows: Vec<bool> = body.reference.x.iter().map(|&x| x > 10.5).collect();
    let sides = Sides {
        cells: &cells,
        elastic: &polypropylene(),
        rule: &truth.displacement,
        truth: &reference(aspect, &body),
        follows: &follows,
    };
    let found = Comparison::of(&sides).expect("measures");
    println!(
        "aspect {aspect}, refine {refine}, {} nodes: displacement {:.2e}, von Mises {:.2e}, energy {:.2e}, {seconds:.2} s",
        truth.mesh().mesh().node_count(),
        found.displacement_rel_l2,
        found.von_mises_rel_l2,
        found.energy_rel
    );
    found
}

#[test]
#[ignore = "needs ../shared/reference"]
fn the_truth_of_the_beam_is_that_of_the_reference() {
    for aspect in [1, 5, 10] {
        let found = distance_from_reference(aspect, None);
        assert!(found.displacement_rel_l2 < 5e-4 && found.von_mises_rel_l2 < 1e-3, "{aspect}: {found}");
    }
}

#[test]
#[ignore = "prints a table for choosing the default refinement; needs ../shared/reference"]
fn the_truth_of_the_beam_by_refinement() {
    for refine in [1, 2, 3, 4, 6, 8, 12, 16] {
        distance_from_reference(1, Some(refine));
    }
    for refine in [1, 2, 3, 4, 6] {
        distance_from_reference(5, Some(refine));
        distance_from_reference(10, Some(refine));
    }
}

/// What the rule makes of the beam whose end columns the truth leads.
fn led_by_the_truth(aspect: u32, weights: impl FnOnce(&Body) -> MaterialWeights) -> Comparison {
    let (body, cells) = beam(aspect);
    let truth = beam_truth(&body, &cells, 4).displacement;
    let follows = between_the_ends(&body);
    let rule = equilibrium(&weights(&body), &follows, &truth);
    let elastic = polypropylene();
    let sides = Sides { cells: &cells, elastic: &elastic, rule: &rule, truth: &truth, follows: &follows };
    Comparison::of(&sides).expect("measures")
}

#[test]
fn the_material_rule_on_the_beam_is_within_half_a_percent_of_the_truth() {
    let found = led_by_the_truth(1, |body| {
        let cells = Cells::of_body(body);
        MaterialWeights::assemble(&cells, body, cells.mates(body.count()), &polypropylene()).expect("fits")
    });
    assert!(found.displacement_rel_l2 < 0.005 && found.von_mises_rel_l2 < 0.025, "{found}");
    assert!((found.displacement_rel_l2 - 0.00387).abs() < 2e-4, "{found}");
    assert!((found.von_mises_rel_l2 - 0.0194).abs() < 1e-3, "{found}");
}

#[test]
fn the_papers_rule_on_the_beam_has_its_large_errors_whatever_the_neighbours() {
    for (neighbourhood, displacement, von_mises) in [
        (Neighbourhood::First { keep: None }, 0.262, 0.74),
        (Neighbourhood::Ring { radius: 1 }, 0.264, 0.76),
        (Neighbourhood::Second, 0.264, 0.75),
    ] {
        let found = led_by_the_truth(1, |body| barycentre(body, &neighbourhood));
        assert!((found.displacement_rel_l2 - displacement).abs() < 0.01, "{neighbourhood:?}\n{found}");
        assert!((found.von_mises_rel_l2 - von_mises).abs() < 0.01, "{neighbourhood:?}\n{found}");
    }
}
