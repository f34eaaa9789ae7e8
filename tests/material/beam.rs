//! The paper's beam against the truth in the reference files.

use flockform::flock::body::{Body, Cut};
use flockform::flock::lattice::Lattice;
use flockform::flock::law::MatrixWeights;
use flockform::flock::neighbourhood::{Neighbourhood, Neighbours};
use flockform::flock::rules::Rotation;
use flockform::flock::vectors::Vectors;
use flockform::material::cells::Cells;
use flockform::material::elastic::Elastic;
use flockform::material::stress;

use crate::reference::beam_displacements;
use crate::support::*;
use crate::tractions;

/// Points and displacements of a reference file, and the body with the same particles in its numbering.
fn beam(aspect: u32) -> (Body, Neighbours, Cells, Vectors) {
    let lattice = Lattice::new(KINDS[0], [10.0, 10.0], 0.0);
    let (body, neighbours, cells) = build(lattice, &Cut::Count { columns: 11 * aspect + 1, rows: 12 });
    let truth = beam_displacements(aspect, &body.reference);
    (body, neighbours, cells, truth)
}

fn end_columns(body: &Body) -> Vec<bool> {
    let (low, high) = body.reference.bounds(0..body.count()).expect("particles");
    body.reference.x.iter().map(|&x| x < low[0] + 0.5 || x > high[0] - 0.5).collect()
}

fn von_mises_error(cells: &Cells, elastic: &Elastic, found: &Vectors, truth: &Vectors) -> f64 {
    let stress = |u: &Vectors| {
        let of_cells = stress::of_cells(cells, elastic, u, Rotation::Small);
        of_cells.into_iter().map(|state| state.von_mises).collect::<Vec<_>>()
    };
    let (found, truth) = (stress(found), stress(truth));
    let error: f64 = found.iter().zip(&truth).map(|(f, t)| (f - t).powi(2)).sum();
    (error / truth.iter().map(|t| t * t).sum::<f64>()).sqrt()
}

/// Displacement and von Mises errors of the material rule, both end columns led by the truth.
fn beam_errors(aspect: u32) -> [f64; 2] {
    let (body, neighbours, cells, truth) = beam(aspect);
    let elastic = sheet(1000.0, 0.33);
    let weights = MaterialWeights::assemble(&cells, &body, neighbours, &elastic).expect("assembles");
    let leads = end_columns(&body);
    let found = equilibrium(&weights, &leads, &Vectors::zeros(body.count()), &truth);
    [relative_l2(&found, &truth, |i| !leads[i]), von_mises_error(&cells, &elastic, &found, &truth)]
}

#[test]
fn the_beam_led_by_the_truth_matches_it() {
    for (aspect, displacement, von_mises) in [(1, 0.005, 0.025), (5, 0.01, 0.01), (10, 0.01, 0.01)] {
        let errors = beam_errors(aspect);
        println!(
            "aspect {aspect}: displacement {:.4} %, von Mises {:.4} %",
            100.0 * errors[0],
            100.0 * errors[1]
        );
        assert!(errors[0] <= displacement && errors[1] <= von_mises, "aspect {aspect}: {errors:?}");
    }
}

#[test]
fn the_beam_loaded_by_traction_matches_it() {
    let (body, neighbours, cells, truth) = beam(1);
    let elastic = sheet(1000.0, 0.33);
    let weights = MaterialWeights::assemble(&cells, &body, neighbours, &elastic).expect("assembles");
    let leads: Vec<bool> = body.reference.x.iter().map(|&x| x < 10.5).collect();
    let end = |i: u32| body.reference.x[i as usize] > 20.5;
    let sides = cells.boundary_sides(&cells.incidence(body.count()));
    let loaded = sides.into_iter().filter(|&[a, b]| end(a) && end(b));
    let forces = tractions::forces(&body.reference, loaded.map(|side| (side, [[0.0, 50.0]; 2])));
    let found = equilibrium(&weights, &leads, &forces, &truth);
    let errors =
        [relative_l2(&found, &truth, |i| !leads[i]), von_mises_error(&cells, &elastic, &found, &truth)];
    println!("traction: displacement {:.4} %, von Mises {:.4} %", 100.0 * errors[0], 100.0 * errors[1]);
    assert!(errors[0] <= 0.02 && errors[1] <= 0.03, "{errors:?}");
}

#[test]
fn the_barycentre_on_the_beam_has_the_errors_of_the_paper() {
    let (body, _, cells, truth) = beam(1);
    let first = Neighbourhood::First { keep: None };
    let (_, neighbours) =
        Body::build(body.lattice.clone(), &Cut::Count { columns: 12, rows: 12 }, &first, None)
            .expect("builds");
    let one = [[1.0, 0.0], [0.0, 1.0]];
    let scaled = |by: f64| one.map(|row| row.map(|x| by * x));
    let shares: Vec<_> = (0..body.count()).map(|i| scaled(1.0 / neighbours.of(i).len() as f64)).collect();
    let share_of_each = |i: usize| vec![shares[i]; neighbours.of(i).len()];
    let weights = MatrixWeights {
        class: (0..body.count() as u32).collect(),
        starts: neighbours.starts.clone(),
        blocks: (0..body.count()).flat_map(share_of_each).collect(),
        stiffness: vec![one; neighbours.index.len()],
        compliance: shares.clone(),
        cells: None,
    };
    let weights = MaterialWeights { neighbours, weights };
    let leads = end_columns(&body);
    let found = equilibrium(&weights, &leads, &Vectors::zeros(body.count()), &truth);
    let displacement = relative_l2(&found, &truth, |i| !leads[i]);
    let von_mises = von_mises_error(&cells, &sheet(1000.0, 0.33), &found, &truth);
    println!("Eq. 1: displacement {:.3} %, von Mises {:.3} %", 100.0 * displacement, 100.0 * von_mises);
    assert!((displacement - 0.262).abs() < 0.01 && (von_mises - 0.74).abs() < 0.01);
}
