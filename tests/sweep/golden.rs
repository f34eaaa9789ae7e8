//! The paper's tension test against numbers computed independently of this program.

use std::ops::ControlFlow;

use flockform::continuum::record::ProbeSeries;
use flockform::continuum::run::run;
use flockform::engine::Engine;

use crate::scenes::{load, planned};

/// What the oracle says of one frame rule.
struct Oracle {
    scene: &'static str,
    largest: (f64, usize),
    at_401: f64,
    edge_row: f64,
    centre_row: f64,
}

const ORACLES: [Oracle; 2] = [
    Oracle {
        scene: "tension",
        largest: (2.265537, 63),
        at_401: 0.314566,
        edge_row: 0.3436,
        centre_row: 0.4198,
    },
    Oracle {
        scene: "tension-immediate",
        largest: (2.200423, 60),
        at_401: 0.239103,
        edge_row: 0.4256,
        centre_row: 0.4256,
    },
];

fn displacement(engine: &Engine, column: i32, row: i32) -> f64 {
    let body = engine.body();
    // The paper counts columns and rows from 1, the frame included.
    let first = body.sites[0];
    let site = [first[0] + column - 1, first[1] + row - 1];
    let i = body.sites.iter().position(|&s| s == site).expect("in the sample");
    engine.present().x[i] - body.reference.x[i]
}

#[test]
fn the_tension_test_gives_the_oracle_s_numbers_with_both_frames() {
    for oracle in ORACLES {
        let plan = planned(&load(oracle.scene, &[]));
        let mut centre = ProbeSeries::new(66);
        let (mut edge_row, mut centre_row, mut peak_column) = (0.0, 0.0, 0);
        let outcome = run(plan, &mut |engine, _| {
            centre.record(engine);
            if engine.step() == 20 {
                edge_row = displacement(engine, 6, 2);
                centre_row = displacement(engine, 6, 6);
                let peak =
                    (0..engine.present().len()).max_by(|&a, &b| engine.pe1(a).total_cmp(&engine.pe1(b)));
                peak_column = peak.expect("has particles") / 12 + 1;
            }
            ControlFlow::Continue(())
        });
        let start = centre.positions.x[0];
        let moved: Vec<f64> = centre.positions.x.iter().map(|x| x - start).collect();
        let (at, largest) =
            moved.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).expect("has steps");
        let near = |value: f64, expected: f64, tolerance: f64, what: &str| {
            assert!(
                (value - expected).abs() <= tolerance,
                "{} {what}: {value}, not {expected}",
                oracle.scene
            );
        };
        assert_eq!(outcome.engine.step(), 401);
        assert_eq!(moved.iter().position(|&d| d != 0.0), Some(6), "first move");
        near(largest, oracle.largest.0, 1e-6, "largest displacement");
        assert_eq!(at, oracle.largest.1, "{} step of the largest displacement", oracle.scene);
        near(moved[401], oracle.at_401, 1e-6, "displacement at step 401");
        // The oracle gives these two to four places.
        near(edge_row, oracle.edge_row, 5e-5, "edge row");
        near(centre_row, oracle.centre_row, 5e-5, "centre row");
        // Leaders stand in column 11.
        assert_eq!(peak_column, 10, "{} column of the largest PE1", oracle.scene);
    }
}
