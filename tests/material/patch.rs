//! Affine fields are followed exactly, rigid motions cost nothing.

use std::sync::Arc;

use flockform::flock::block::{Block, plus, transposed};
use flockform::flock::body::Cut;
use flockform::flock::lattice::{Lattice, LatticeKind};
use flockform::flock::vectors::{Vectors, distance};
use flockform::material::cells::neighbourhood;

use crate::support::*;
use crate::tractions;

fn affine([x, y]: [f64; 2]) -> [f64; 2] {
    [0.2 + 0.03 * x - 0.01 * y, -0.1 + 0.04 * x + 0.02 * y]
}

fn largest_difference(a: &Vectors, b: &Vectors) -> f64 {
    a.iter().zip(b.iter()).map(|(a, b)| (a[0] - b[0]).abs().max((a[1] - b[1]).abs())).fold(0.0, f64::max)
}

#[test]
fn an_affine_boundary_is_followed_exactly_on_every_lattice() {
    for kind in KINDS {
        for elastic in [sheet(1000.0, 0.33), sheet(1.0, -0.9), fibres()] {
            let (body, neighbours, cells) = sample(kind, 0.3);
            let weights = MaterialWeights::assemble(&cells, &body, neighbours, &elastic).expect("assembles");
            let exact: Vectors = body.reference.iter().map(affine).collect();
            let leads = on_boundary(&cells, body.count());
            assert!(leads.iter().filter(|&&leads| !leads).count() > 10, "{kind:?} has an interior");
            let led = (0..body.count()).map(|i| if leads[i] { exact.get(i) } else { [0.0; 2] }).collect();
            let found = equilibrium(&weights, &leads, &Vectors::zeros(body.count()), &led);
            assert!(largest_difference(&found, &exact) < 1e-12, "{kind:?}");
            for i in (0..body.count()).filter(|&i| !leads[i]) {
                let force = weights.force(i, &exact);
                assert!(force[0].hypot(force[1]) < 1e-12 * elastic.stiffness().norm(), "{kind:?}");
            }
        }
    }
}

#[test]
fn an_affine_boundary_is_followed_exactly_where_points_are_out_of_place() {
    for kind in KINDS {
        let (mut body, neighbours, cells) = sample(kind, 0.3);
        let shift = |i: usize| [0.11 * (7.3 * i as f64).sin(), 0.11 * (3.1 * i as f64 + 1.0).sin()];
        let points: Vectors = (0..body.count())
            .map(|i| {
                let (p, s) = (body.reference.get(i), shift(i));
                [p[0] + s[0], p[1] + s[1]]
            })
            .collect();
        body.reference = Arc::new(points.clone());
        let moved = cells.on_points(&points);
        let weights =
            MaterialWeights::assemble(&moved, &body, neighbours, &sheet(1000.0, 0.33)).expect("assembles");
        let exact: Vectors = points.iter().map(affine).collect();
        let leads = on_boundary(&cells, body.count());
        let led = (0..body.count()).map(|i| if leads[i] { exact.get(i) } else { [0.0; 2] }).collect();
        let found = equilibrium(&weights, &leads, &Vectors::zeros(body.count()), &led);
        assert!(largest_difference(&found, &exact) < 1e-12, "{kind:?}");
    }
}

#[test]
fn sweeping_the_rule_itself_reaches_the_affine_field() {
    // Positions, matrix-weighted mean plus rest offset: what a host will sweep.
    let (body, neighbours, cells) = sample(KINDS[5], 0.0);
    let weights =
        MaterialWeights::assemble(&cells, &body, neighbours, &sheet(1000.0, 0.33)).expect("assembles");
    let rule = flock(&body, &weights, None);
    let leads = on_boundary(&cells, body.count());
    let goal: Vectors = body
        .reference
        .iter()
        .map(|p| {
            let u = affine(p);
            [p[0] + u[0], p[1] + u[1]]
        })
        .collect();
    let mut x: Vectors =
        (0..body.count()).map(|i| if leads[i] { goal.get(i) } else { body.reference.get(i) }).collect();
    for _ in 0..500 {
        for i in (0..body.count()).filter(|&i| !leads[i]) {
            x.set(i, rule.target(i, &x));
        }
    }
    assert!(largest_difference(&x, &goal) < 1e-12);
}

#[test]
fn rigid_motions_cost_no_force_anywhere_free_edges_included() {
    for kind in KINDS {
        let (body, neighbours, cells) = sample(kind, 0.3);
        let weights = MaterialWeights::assemble(&cells, &body, neighbours, &fibres()).expect("assembles");
        let scale = fibres().stiffness().norm();
        let shifted: Vectors = body.reference.iter().map(|_| [0.7, -1.3]).collect();
        let turned: Vectors = body.reference.iter().map(|[x, y]| [-y, x]).collect();
        for i in 0..body.count() {
            assert_eq!(weights.force(i, &shifted), [0.0; 2]);
            let force = weights.force(i, &turned);
            assert!(force[0].hypot(force[1]) < 1e-12 * scale, "{kind:?} particle {i}: {force:?}");
        }
        assert!(weights.energy(&turned).abs() < 1e-12 * scale);
    }
}

#[test]
fn weights_sum_to_the_identity_and_forces_come_in_equal_and_opposite_pairs() {
    for kind in KINDS {
        let (body, neighbours, cells) = sample(kind, 0.3);
        let weights = MaterialWeights::assemble(&cells, &body, neighbours, &fibres()).expect("assembles");
        let as_applied = &weights.weights;
        for i in 0..body.count() {
            let mut sum: Block = [[0.0; 2]; 2];
            for ((j, &block), w) in weights.bonds(i).zip(as_applied.of(i)) {
                sum = plus(&sum, w);
                let back = weights.bonds(j).find(|(back, _)| *back == i).expect("seen back");
                assert_eq!(block, transposed(*back.1), "{kind:?}");
            }
            let error = (sum[0][0] - 1.0).abs() + sum[0][1].abs() + sum[1][0].abs() + (sum[1][1] - 1.0).abs();
            assert!(error < 1e-12, "{kind:?} {sum:?}");
        }
    }
}

#[test]
fn an_edge_column_under_uniform_tension_stretches_uniformly_and_contracts_freely() {
    // Traction on the right, symmetry on the left: u = s x / E, v = -nu s y / E, sides free.
    for (kind, right) in [(KINDS[0], 7.0), (KINDS[1], 7.0)] {
        let (body, neighbours, cells) =
            build(Lattice::new(kind, [0.0; 2], 0.0), &Cut::Count { columns: 8, rows: 5 });
        let weights =
            MaterialWeights::assemble(&cells, &body, neighbours, &sheet(1000.0, 0.33)).expect("assembles");
        let pulled =
            |&[a, b]: &[u32; 2]| [a, b].iter().all(|&i| (body.reference.x[i as usize] - right).abs() < 1e-9);
        let sides = cells.boundary_sides(&cells.incidence(body.count()));
        let pulls = sides.into_iter().filter(pulled).map(|side| (side, [[50.0, 0.0]; 2]));
        let forces = tractions::forces(&body.reference, pulls);
        let exact: Vectors = body.reference.iter().map(|[x, y]| [0.05 * x, -0.33 * 0.05 * y]).collect();
        for i in 0..body.count() {
            if body.reference.x[i] > 0.0 {
                let (pull, load) = (weights.force(i, &exact), forces.get(i));
                assert!((pull[0] + load[0]).abs() + (pull[1] + load[1]).abs() < 1e-11, "{kind:?} {i}");
            }
        }
    }
}

#[test]
fn weights_are_the_same_at_any_spacing() {
    let weights = |scale: f64, kind: fn(f64) -> LatticeKind| {
        let lattice = Lattice::new(kind(scale), [0.0; 2], 0.3);
        let cut = Cut::Count { columns: 4, rows: 4 };
        let (body, neighbours, cells) = of_whole_cells(&lattice, &cut, &neighbourhood(&lattice));
        MaterialWeights::assemble(&cells, &body, neighbours, &fibres()).expect("assembles").weights.blocks
    };
    for kind in
        [|s| LatticeKind::Rectangular { a: s, b: 1000.0 * s }, |s| LatticeKind::Honeycomb { spacing: s }]
    {
        let plain = weights(1.0, kind);
        for scale in [1e-9, 1e9] {
            for (a, b) in
                weights(scale, kind).iter().flatten().flatten().zip(plain.iter().flatten().flatten())
            {
                assert!((a - b).abs() < 1e-10, "{a} {b}");
            }
        }
    }
}

#[test]
fn the_equilibrium_under_loads_is_the_fixed_point_of_the_rule_and_stores_half_their_work() {
    for kind in KINDS {
        let (body, neighbours, cells) = sample(kind, 0.3);
        let weights = MaterialWeights::assemble(&cells, &body, neighbours, &fibres()).expect("assembles");
        // Loads everywhere, free edges included; three particles held.
        let forces: Vectors =
            (0..body.count()).map(|i| [(1.3 * i as f64).sin(), (0.7 * i as f64).cos()]).collect();
        let leads: Vec<bool> = (0..body.count()).map(|i| i % 20 == 0).collect();
        let held = Vectors::zeros(body.count());
        let found = equilibrium(&weights, &leads, &forces, &held);
        let rule = flock(&body, &weights, Some(forces.clone()));
        let at: Vectors =
            (0..body.count()).map(|i| [0, 1].map(|k| body.reference.get(i)[k] + found.get(i)[k])).collect();
        let size = found.x.iter().chain(&found.y).fold(1.0, |m: f64, u| m.max(u.abs()));
        let mut work = 0.0;
        for i in (0..body.count()).filter(|&i| !leads[i]) {
            let error = distance(rule.target(i, &at), at.get(i));
            assert!(error < 1e-12 * size, "{kind:?} particle {i}: {error}");
            work += forces.x[i] * found.x[i] + forces.y[i] * found.y[i];
        }
        assert!((weights.energy(&found) - 0.5 * work).abs() < 1e-11 * work, "{kind:?}");
    }
}
