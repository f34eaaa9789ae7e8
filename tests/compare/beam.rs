//! The truth against the reference files.

use std::path::Path;
use std::time::Instant;

use flockform::compare::measures::{Comparison, Sides};
use flockform::compare::mesh::TruthMesh;
use flockform::flock::body::Body;
use flockform::flock::points::Points;

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

#[test]
fn table() {
    for name in [
        "beam",
        "beam-loaded",
        "beam-hexagonal",
        "beam-paper",
        "beam-paper-ring",
        "beam-paper-second",
        "beam-paper-reduced",
        "beam-paper-hexagonal",
        "beam-paper-hexagonal-reduced",
        "beam-5",
        "beam-paper-5",
        "beam-10",
        "beam-paper-10",
    ] {
        let f = compared(name, &[]);
        let c = f.comparison;
        println!(
            "TAB {name:30} d {:.3} max {:.3} vm {:.3} en {:.3} steps {} res {:.1e} {:.2} s, truth {:.2} s {}",
            100.0 * c.displacement_rel_l2,
            100.0 * c.displacement_max_rel,
            100.0 * c.von_mises_rel_l2,
            100.0 * c.energy_rel,
            f.outcome.engine.step(),
            f.outcome.residual,
            c.seconds_rule,
            c.seconds_truth,
            f.outcome.reason.name()
        );
    }
    for name in ["beam-paper", "beam-paper-ring", "beam-paper-second"] {
        for frame in ["lagged", "immediate", "mirror"] {
            let f = compared(name, &[&format!("frame={frame}"), "update.damping=1.0"]);
            let c = f.comparison;
            println!(
                "TAB {name:30} {frame} d {:.3} max {:.3} vm {:.3} en {:.3} steps {} res {:.1e} {:.2} s, truth {:.2} s",
                100.0 * c.displacement_rel_l2,
                100.0 * c.displacement_max_rel,
                100.0 * c.von_mises_rel_l2,
                100.0 * c.energy_rel,
                f.outcome.engine.step(),
                f.outcome.residual,
                c.seconds_rule,
                c.seconds_truth
            );
        }
    }
}
