//! The measures are zero for equal fields and known for fields that differ in a known way.

use flockform::flock::law::{Flock, Weights};
use flockform::flock::rules::{Mean, Rotation, Rule};
use flockform::flock::vectors::Vectors;
use flockform::material::cells::Cells;
use flockform::material::elastic::Plane;
use flockform::material::stress::strain_energy;
use flockform::material::weights::assemble;
use flockform::study::compare::measures::{Comparison, Sides, von_mises};

use crate::support::*;

fn bent(reference: &Vectors) -> Vectors {
    reference.iter().map(|[x, y]| [0.01 * x * y, -0.005 * x * x + 0.002 * y]).collect()
}

fn scaled(field: &Vectors, by: f64) -> Vectors {
    field.iter().map(|u| u.map(|u| by * u)).collect()
}

fn compare(cells: &Cells, rule: &Vectors, truth: &Vectors, follows: &[bool]) -> Comparison {
    let elastic = sheet(1000.0, 0.33, Plane::Stress);
    let [of_rule, of_truth] = [rule, truth].map(|u| von_mises(cells, &elastic, u, Rotation::Small));
    let (elastic, von_mises) = (&elastic, [&of_rule[..], &of_truth]);
    Comparison::of(&Sides { cells, elastic, rotation: Rotation::Small, rule, truth, von_mises, follows })
        .expect("measures")
}

#[test]
fn equal_fields_are_no_distance_apart() {
    for kind in KINDS {
        let (body, cells) = sample(kind);
        let field = bent(&body.reference);
        let found = compare(&cells, &field, &field, &vec![true; body.count()]);
        let distances = [
            found.displacement_rel_l2,
            found.displacement_max,
            found.displacement_max_rel,
            found.von_mises_rel_l2,
            found.energy_rel,
        ];
        assert_eq!(distances, [0.0; 5], "{kind:?}");
        assert_eq!(found.strain_energy_rule, found.strain_energy_truth_in_cells);
        assert_eq!((found.followers, found.cells), (body.count(), cells.count()));
    }
}

#[test]
fn a_field_that_is_a_tenth_too_large_is_a_tenth_apart_in_every_measure() {
    for kind in KINDS {
        let (body, cells) = sample(kind);
        let truth = bent(&body.reference);
        let found = compare(&cells, &scaled(&truth, 1.1), &truth, &vec![true; body.count()]);
        for part in
            [found.displacement_rel_l2, found.displacement_max_rel, found.von_mises_rel_l2, found.energy_rel]
        {
            assert!((part - 0.1).abs() < 1e-12, "{kind:?}: {found}");
        }
        assert!((found.strain_energy_rule / found.strain_energy_truth_in_cells - 1.21).abs() < 1e-12);
        let largest = truth.iter().map(|[x, y]| x.hypot(y)).fold(0.0, f64::max);
        assert!((found.displacement_max / largest - 0.1).abs() < 1e-12);
    }
}

#[test]
fn leaders_do_not_count_in_the_displacement_but_their_cells_do_in_the_stress() {
    let (body, cells) = sample(KINDS[0]);
    let truth = bent(&body.reference);
    let mut rule = truth.clone();
    rule.x[0] += 0.3;
    let mut follows = vec![true; body.count()];
    let counted = compare(&cells, &rule, &truth, &follows);
    assert!((counted.displacement_max - 0.3).abs() < 1e-15 && counted.displacement_rel_l2 > 0.0);
    follows[0] = false;
    let left_out = compare(&cells, &rule, &truth, &follows);
    assert_eq!((left_out.displacement_max, left_out.displacement_rel_l2), (0.0, 0.0));
    assert_eq!(left_out.von_mises_rel_l2, counted.von_mises_rel_l2);
    assert!(counted.von_mises_rel_l2 > 0.01 && counted.followers == left_out.followers + 1);
}

#[test]
fn the_energy_is_that_of_the_material_weights() {
    for kind in KINDS {
        let (body, cells) = sample(kind);
        let elastic = fibres();
        let cell_neighbours = cells.cell_neighbours(body.count());
        let weights = assemble(&cells, &body, &cell_neighbours, &elastic, Rotation::Small);
        let weights = Weights::Matrix(weights.expect("assembles"));
        let rule = Rule { mean: Mean::Material { rotation: Rotation::Small }, ..Rule::BARYCENTRE };
        let felt = Flock::new(rule, body.reference.clone(), cell_neighbours, weights);
        let field = bent(&body.reference);
        let energy = strain_energy(&cells, &elastic, &field, Rotation::Small).expect("has stiffness");
        let work = |i: usize| {
            let ([fx, fy], [x, y]) = (felt.force_under(i, &field), field.get(i));
            fx * x + fy * y
        };
        let of_weights = -0.5 * (0..body.count()).map(work).sum::<f64>();
        assert!((energy / of_weights - 1.0).abs() < 1e-11, "{kind:?}");
    }
}

#[test]
fn a_rigid_motion_costs_no_energy_and_no_stress() {
    for kind in KINDS {
        let (body, cells) = sample(kind);
        let turned: Vectors = body.reference.iter().map(|[x, y]| [5.0 - 0.3 * y, 0.3 * x - 7.0]).collect();
        // The same followed by a turn of a right angle and more.
        let far: Vectors =
            body.reference.iter().map(|[x, y]| [-1.6 * x - 0.8 * y, 0.8 * x - 1.6 * y]).collect();
        for (field, rotation) in [(turned, Rotation::Small), (far, Rotation::Corotated)] {
            let energy = strain_energy(&cells, &fibres(), &field, rotation).expect("has stiffness");
            assert!(energy.abs() < 1e-13, "{kind:?} {energy}");
            assert!(
                von_mises(&cells, &fibres(), &field, rotation).iter().all(|s| s.abs() < 1e-13),
                "{kind:?}"
            );
        }
    }
}

#[test]
fn the_table_names_every_measure_and_json_has_the_six_keys() {
    let (body, cells) = sample(KINDS[0]);
    let truth = bent(&body.reference);
    let found = compare(&cells, &scaled(&truth, 1.1), &truth, &vec![true; body.count()]);
    let table = found.to_string();
    assert!(table.contains("displacement, relative L2    10.000 %"), "{table}");
    assert_eq!(table.lines().count(), 13);
    let json = serde_json::to_value(found).expect("numbers");
    for key in [
        "displacement_rel_l2",
        "displacement_max",
        "von_mises_rel_l2",
        "energy_rel",
        "seconds_rule",
        "seconds_truth",
    ] {
        assert!(json[key].is_f64(), "{key}");
    }
}
