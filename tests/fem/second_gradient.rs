//! A second gradient as it is measured: how a boundary layer decays in a strip that is run to rest.

use std::ops::ControlFlow;

use flockform::continuum::bulk_response;
use flockform::continuum::plan::Plan;
use flockform::continuum::report::PlanReport;
use flockform::continuum::run::{StopReason, run};
use flockform::engine::Engine;
use flockform::material::report::Effect;
use flockform::scene::Scene;

use crate::scenes::{load, planned, try_load};

fn scene(overrides: &[&str]) -> Scene {
    load("gradient-layer", overrides)
}

fn refusal(overrides: &[&str]) -> String {
    try_load("gradient-layer", overrides)
        .and_then(|scene| Plan::new(&scene))
        .expect_err("refused")
        .to_string()
}

/// The scene at rest.
fn at_rest(scene: &Scene) -> Engine {
    let outcome = run(planned(scene), &mut |_, _| ControlFlow::Continue(()));
    assert_eq!(outcome.reason, StopReason::Equilibrium, "residual {}", outcome.residual);
    outcome.engine
}

/// Places across the layer \[length\] and displacements along `axis` of one line of particles: those whose
/// other coordinate is nearest to the middle.
fn profile(engine: &Engine, across: usize, axis: usize) -> Vec<(f64, f64)> {
    let body = engine.body();
    let places: Vec<[f64; 2]> = body.reference.iter().collect();
    let middle = |k: usize| {
        let values = places.iter().map(|place| place[k]);
        0.5 * (values.clone().fold(f64::INFINITY, f64::min) + values.fold(f64::NEG_INFINITY, f64::max))
    };
    let centre = middle(1 - across);
    let mut layers: Vec<(f64, f64, f64)> = Vec::new();
    for (i, place) in places.iter().enumerate() {
        let off = (place[1 - across] - centre).abs();
        let moved = engine.present().get(i)[axis] - place[axis];
        match layers.iter_mut().find(|layer| (layer.0 - place[across]).abs() < 1e-9) {
            Some(layer) if layer.1 <= off => {}
            Some(layer) => *layer = (place[across], off, moved),
            None => layers.push((place[across], off, moved)),
        }
    }
    layers.sort_by(|a, b| a.0.total_cmp(&b.0));
    layers.into_iter().map(|(x, _, u)| (x, u)).collect()
}

/// Slope and intercept of the least-squares line.
fn line(points: &[(f64, f64)]) -> (f64, f64) {
    let n = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let (sxy, sxx) =
        points.iter().fold((0.0, 0.0), |(a, b), p| (a + (p.0 - x) * (p.1 - y), b + (p.0 - x).powi(2)));
    (sxy / sxx, y - sxy / sxx * x)
}

/// Decay length of the deviation from the line that the far third follows \[length\]; the last place is
/// led, the first is where the layer begins.
fn decay_length(profile: &[(f64, f64)]) -> f64 {
    let (slope, start) = line(&profile[2 * profile.len() / 3..]);
    let layer: Vec<(f64, f64)> = profile.iter().map(|&(x, u)| (x, u - start - slope * x)).collect();
    let largest = layer[1].1.abs();
    let logs: Vec<(f64, f64)> = layer[1..]
        .iter()
        .take_while(|(_, deviation)| deviation.abs() > 0.005 * largest)
        .map(|&(x, deviation)| (x, deviation.abs().ln()))
        .collect();
    assert!(logs.len() >= 3, "{layer:?}");
    -1.0 / line(&logs).0
}

fn assert_measures(overrides: &[&str], across: usize, axis: usize, length: f64) {
    let prescribed = format!("rule.weights.length={length}");
    let all: Vec<&str> = overrides.iter().copied().chain([prescribed.as_str()]).collect();
    let measured = decay_length(&profile(&at_rest(&scene(&all)), across, axis));
    let error = (measured / length).powi(2) - 1.0;
    println!("prescribed {length}: l^2 off by {error:.1e}");
    assert!(error.abs() < 0.02, "{overrides:?}: l^2 = {} instead of {}", measured.powi(2), length * length);
}

const LONG: [&str; 4] =
    ["stop.tolerance=1e-12", "stop.steps=400000", "update.damping=1.9", "record.probes=[]"];

#[test]
fn the_measured_length_squared_is_the_prescribed_one_within_two_per_cent() {
    for (length, columns) in [(0.5, 20), (1.0, 24), (2.0, 40), (4.5, 80)] {
        for rows in [1, 4] {
            let shape = format!("body.shape={{kind=\"grid\",columns={columns},rows={rows}}}");
            assert_measures(&[&[shape.as_str()], &LONG[..]].concat(), 0, 0, length);
        }
    }
}

#[test]
fn a_layer_has_the_same_length_across_and_along_a_rectangular_lattice() {
    let lattice = "lattice={kind=\"rectangular\",a=1.0,b=1.6}";
    let right = [&[lattice, "body.shape={kind=\"grid\",columns=40,rows=3}"], &LONG[..]].concat();
    assert_measures(&right, 0, 0, 2.0);
    let up = [
        lattice,
        "body.shape={kind=\"grid\",columns=3,rows=30}",
        "roles[0].region={kind=\"edge\",side=\"bottom\",depth=2.4}",
        "roles[1].region.side=top",
        "roles[1].motion.frames=[{step=1,displacement=[0.0,1.0]}]",
    ];
    assert_measures(&[&up, &LONG[..]].concat(), 1, 1, 2.0);
}

#[test]
fn on_a_hexagonal_lattice_a_layer_along_the_rows_has_the_prescribed_length() {
    // Wide, for the ragged sides bend the layer near them.
    let up = [
        "lattice={kind=\"hexagonal\",spacing=1.0}",
        "body.shape={kind=\"grid\",columns=150,rows=28}",
        "roles[0].region={kind=\"edge\",side=\"bottom\",depth=1.3}",
        "roles[1].region.side=top",
        "roles[1].motion.frames=[{step=1,displacement=[0.0,1.0]}]",
    ];
    assert_measures(&[&up, &LONG[..]].concat(), 1, 1, 1.5);
}

#[test]
fn the_paper_s_neighbours_of_neighbours_have_a_negative_length_squared_and_no_layer() {
    let paper = scene(&[
        "rule={mean={kind=\"barycentre\"}}",
        "neighbours={kind=\"second\"}",
        "stop.tolerance=1e-12",
        "stop.steps=400000",
    ]);
    let report = bulk_response::material(&paper).expect("a material");
    assert_eq!(report.gradient.effect, Effect::Softens);
    // A chain of the rows' sums, 3 at 1 and 1 at 2: l^2 = -(3 + 16) / (12 (3 + 4)).
    assert!((report.gradient.length.longitudinal_x + 19.0 / 84.0).abs() < 1e-12);
    // Where there would be a layer the second differences change their sign from column to column.
    let profile = profile(&at_rest(&paper), 0, 0);
    let second = |k: usize| profile[k + 1].1 - 2.0 * profile[k].1 + profile[k - 1].1;
    for k in 1..4 {
        assert!(second(k) * second(k + 1) < 0.0, "{}, {}", second(k), second(k + 1));
        assert!(second(k + 1).abs() < 0.5 * second(k).abs());
    }
    let gradient = self::profile(&at_rest(&scene(&[])), 0, 0);
    let second = |k: usize| gradient[k + 1].1 - 2.0 * gradient[k].1 + gradient[k - 1].1;
    assert!((1..8).all(|k| second(k) > 0.0 && second(k + 1) > 0.6 * second(k)));
}

#[test]
fn a_free_edge_of_a_stretched_strip_has_no_layer() {
    // Pulled at both ends by one column each: nothing holds the slope, so the strain is uniform.
    let free = scene(&["roles[0].region.depth=0.5", "stop.tolerance=1e-12", "stop.steps=400000"]);
    let profile = profile(&at_rest(&free), 0, 0);
    assert!(profile.len() > 8, "{profile:?}");
    let (slope, start) = line(&profile);
    for (x, u) in profile {
        assert!((u - start - slope * x).abs() < 1e-7, "{x}: {u}");
    }
}

#[test]
fn what_cannot_be_a_stable_second_gradient_is_refused_with_the_remedy() {
    for (overrides, words) in [
        (
            vec![
                "body={shape={kind=\"rectangle\",max=[9,4]},holes=[{kind=\"rectangle\",min=[4.5,-1],max=[5.5,5]}]}",
            ],
            vec!["body.shape", "not connected", "close the gap"],
        ),
        (vec!["rule.weights.length=0.3"], vec!["rule.weights.length", "too short", "0.3803 or more"]),
        (vec!["rule.weights.length=2e4"], vec!["10000 times", "shorter"]),
        (vec!["rule.weights.length=0"], vec!["rule.weights.length", "greater than 0"]),
        (vec!["neighbours={kind=\"second\"}"], vec!["neighbours", "collinear"]),
        (vec!["rule.mean={kind=\"distance\"}"], vec!["rule.mean", "barycentre"]),
        (vec!["fracture={stretch=1.5}"], vec!["fracture", "leave fracture out"]),
        (
            vec!["update={order=\"synchronous\",damping=1.0}"],
            vec!["update.damping", "diverges", "leave update.damping out", "0.65", "sequential"],
        ),
        (vec!["lattice={kind=\"honeycomb\",spacing=1.0}"], vec!["honeycomb", "twice as far", "neighbours"]),
    ] {
        let said = refusal(&overrides);
        for word in words {
            assert!(said.contains(word), "{overrides:?} does not say `{word}`:\n{said}");
        }
    }
}

#[test]
fn a_synchronous_update_damped_below_two_thirds_settles() {
    let damped = scene(&[
        "update={order=\"synchronous\",damping=0.65}",
        "body.shape={kind=\"grid\",columns=12,rows=5}",
        "record.probes=[]",
        "stop.tolerance=1e-10",
        "stop.steps=400000",
    ]);
    at_rest(&damped);
}

#[test]
fn unstable_and_underdamped_lists_of_weights_are_cautioned_against() {
    let cautions = |weights: &str, update: &str| {
        let weights = format!("rule.weights={{kind=\"list\",values={weights}}}");
        let scene = scene(&[&weights, update]);
        PlanReport::new(&scene, &planned(&scene)).expect("plans").cautions.join("\n")
    };
    let sequential = "update.order=sequential";
    let synchronous = "update={order=\"synchronous\",damping=1.0}";
    let unstable = "[1,1,1,1,-0.3,-0.3,-0.3,-0.3]";
    assert!(cautions(unstable, sequential).contains("unstable"));
    assert!(cautions("[1,1,1,1,-0.25,-0.25,-0.25,-0.25]", sequential).contains("unstable"));
    let stable = "[1,1,1,1,-0.1,-0.1,-0.1,-0.1]";
    assert_eq!(cautions(stable, sequential), "");
    assert!(cautions(stable, synchronous).contains("damped below 0.9"), "{}", cautions(stable, synchronous));
    assert_eq!(cautions("[1,1,1,1,1,1,1,1]", synchronous), "");
}
