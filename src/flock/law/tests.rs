use super::super::rules::{Axis, Poisson};
use super::*;

/// Three particles that see each other by matrices with no symmetry to hide behind.
fn triangle() -> (Flock, Vectors) {
    let reference: Vectors = [[0.0, 0.0], [1.0, 0.25], [0.5, 1.0]].into_iter().collect();
    let first: Block = [[0.7, -0.2], [0.1, 0.4]];
    let second: Block = [[0.3, 0.2], [-0.1, 0.6]];
    let weights = MatrixWeights {
        class: vec![0; 3],
        starts: vec![0, 2],
        blocks: vec![first, second],
        stiffness: vec![first, second],
        compliance: vec![[[0.5, 0.1], [0.1, 0.3]]],
        cells: None,
    };
    let mut flock = Flock {
        rule: Rule { mean: SMALL, ..Rule::BARYCENTRE },
        reference: reference.into(),
        neighbours: Neighbours::from_lists([[1, 2], [2, 0], [0, 1]]),
        weights: Weights::Matrix(weights),
        forces: Some([[1.0, 0.0], [0.0, -2.0], [0.3, 0.3]].into_iter().collect()),
        rest: None,
        keeps_rest: false,
        bonds: None,
    };
    flock.keep_rest();
    let present = [[0.1, 0.0], [1.1, 0.3], [0.4, 0.9]].into_iter().collect();
    (flock, present)
}

#[test]
fn a_target_among_all_neighbours_is_the_target() {
    let (material, present) = triangle();
    let weights = Weights::Scalar(vec![1.0, 3.0, 0.5, 2.0, 1.0, 1.0]);
    let mut scalar = Flock { rule: Rule::BARYCENTRE, weights, forces: None, ..material };
    scalar.keep_rest();
    for i in 0..3 {
        let target = scalar.target_among(i, &present, |_| true, None).expect("has neighbours");
        assert_eq!(target.map(f64::to_bits), scalar.target(i, &present).map(f64::to_bits));
    }
}

#[test]
fn weights_of_both_signs_that_are_left_do_not_magnify_what_the_neighbours_do() {
    let (material, present) = triangle();
    let weights = Weights::Scalar(vec![-1.05, 1.0, 1.0, 1.0, 1.0, 1.0]);
    let mut flock = Flock {
        rule: Rule::BARYCENTRE,
        weights,
        forces: None,
        neighbours: Neighbours::from_lists([vec![1, 2, 0], vec![0], vec![0]]),
        ..material
    };
    flock.keep_rest();
    let target = flock.target_among(0, &present, |k| k != 0, None).expect("two are left");
    let moved = |k: usize| [0, 1].map(|axis| present.get(k)[axis] - flock.reference.get(k)[axis]);
    for axis in [0, 1] {
        let mean = (1.05 * moved(1)[axis] + moved(2)[axis]) / 2.05;
        let gone = target[axis] - flock.reference.get(0)[axis];
        assert!((gone - mean).abs() < 1e-15, "{gone}, of {mean}");
    }
}

#[test]
fn losing_a_neighbour_leaves_the_particle_at_rest() {
    let (mut material, present) = triangle();
    material.forces = None;
    let mut scalar = Flock { rule: Rule::BARYCENTRE, weights: Weights::Equal, ..material.clone() };
    scalar.keep_rest();
    for flock in [&material, &scalar] {
        let reference = &flock.reference;
        let here = flock.target_among(0, reference, |k| k != 2, None).expect("one is left");
        assert!(crate::flock::vectors::distance(here, reference.get(0)) < 1e-15, "{here:?}");
        assert_eq!(flock.target_among(0, reference, |_| false, None), None);
        // The one that is left is followed wherever it goes.
        let target = flock.target_among(0, &present, |k| k == 1, None).expect("one is left");
        let moved = [0, 1].map(|axis| target[axis] - reference.get(0)[axis]);
        let led = [0, 1].map(|axis| present.get(1)[axis] - reference.get(1)[axis]);
        assert!(crate::flock::vectors::distance(moved, led) < 1e-15, "{moved:?} {led:?}");
    }
}

#[test]
fn the_short_way_to_a_material_s_target_gives_the_bits_of_the_rule() {
    let (flock, present) = triangle();
    for i in 0..3 {
        let own = ParticleState {
            present: present.get(i),
            reference: flock.reference.get(i),
            rest: flock.rest.as_ref().expect("kept").get(i),
            load: flock.load(i),
        };
        let by_rule = flock.rule.target(&own, flock.seen(i, &present));
        assert_eq!(flock.target(i, &present).map(f64::to_bits), by_rule.map(f64::to_bits));
    }
}

#[test]
fn the_short_way_to_a_plain_mean_gives_the_bits_of_the_rule() {
    let (material, present) = triangle();
    let with_rest = |rule: Rule| {
        let (weights, neighbours) =
            (Weights::Equal, Neighbours::from_lists([vec![1, 2, 2, 1, 0, 2, 0, 0], vec![0], vec![]]));
        let mut flock = Flock { rule, weights, neighbours, forces: None, ..material.clone() };
        flock.keep_rest();
        flock
    };
    let across = Poisson { k: 0.3, axis: Axis::X, centre: 0.2, half_width: 1.5, exponent: 1.0 };
    let composed = Rule { poisson: Some(across), ..Rule::BARYCENTRE };
    // Negative zeros, and what rounds: a short way with other operations would show.
    let zeros: Vectors = [[-0.0, 1e3 / 7.0], [-0.0, 0.1], [-0.0, 7e-3 / 3.0]].into_iter().collect();
    for flock in [with_rest(Rule::BARYCENTRE), with_rest(composed)] {
        for points in [&present, &zeros] {
            for i in 0..3 {
                let own = ParticleState {
                    present: points.get(i),
                    reference: flock.reference.get(i),
                    rest: flock.rest.as_ref().map_or([0.0; 2], |rest| rest.get(i)),
                    load: None,
                };
                let by_rule = flock.rule.target(&own, flock.seen(i, points));
                let short = flock.target(i, points);
                assert_eq!(short.map(f64::to_bits), by_rule.map(f64::to_bits), "{i}");
            }
        }
    }
}
