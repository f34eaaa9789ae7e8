//! Thresholds predicted and measured, and extremes that end right or refused.

use flockform::engine::Engine;
use flockform::flock::role::Role;
use flockform::flock::vectors::Vectors;
use flockform::scene::bundled;
use flockform::solve::spectrum::scatter;
use flockform::study::stability::bisection::{Effort, growth};
use flockform::study::stability::extremes::{self, Case, Outcome};
use flockform::study::stability::study::{Linear, Options, Study, run};
use flockform::study::stability::subject::{Parameter, Subject};
use flockform::study::stability::thresholds::Side;

use scenes::{load, planned, try_load};

#[path = "common/scenes.rs"]
mod scenes;

/// A body without its frame has fewer particles.
const NO_PROBES: &str = "record.probes=[]";
const HEXAGONAL: &str = r#"lattice={kind="hexagonal",spacing=1.0}"#;

fn study(name: &str, overrides: &[&str], no_extremes: bool) -> Study {
    let effort = Effort { samples: 3, ..Effort::quick() };
    let load = |more: &[String]| {
        let more: Vec<&str> = more.iter().map(String::as_str).collect();
        try_load(name, &[overrides, &more].concat())
    };
    run(&load, Options { effort, no_extremes }, &mut |_| {}).unwrap_or_else(|error| panic!("{error}"))
}

fn linear(name: &str, overrides: &[&str]) -> Linear {
    study(name, overrides, true).linear.expect("linear")
}

/// Predicted and found, which must agree.
fn threshold(linear: &Linear, parameter: Parameter, side: Side) -> [f64; 2] {
    let is_it = |t: &&_| -> bool {
        let t: &flockform::study::stability::study::Threshold = t;
        t.parameter == parameter && t.side == side
    };
    let one = linear.thresholds.iter().find(is_it).expect("looked for");
    assert!(one.agrees(), "{one:?}");
    let predicted = one.predicted.as_ref().expect("predicted");
    assert!(predicted.converged, "{predicted:?}");
    [predicted.value, one.found.as_ref().expect("found").value]
}

#[test]
fn the_released_sample_grows_where_its_spectrum_says_whatever_its_frame_remembers() {
    // A clamped chain with a free end, nine of which follow: tests/waves.rs.
    let chain = 2.0 / (1.0 + (std::f64::consts::PI / 19.0).cos()) - 1.0;
    for frame in ["frame=lagged", "frame=immediate"] {
        let linear = linear("tension", &[frame]);
        for value in threshold(&linear, Parameter::Feedback, Side::Upper) {
            assert!((value - chain).abs() < 1e-5, "{frame}: {value}, not {chain}");
        }
        let [lower, _] = threshold(&linear, Parameter::Feedback, Side::Lower);
        // A frame that lags keeps the two-cycle from growing for longer.
        let expected = if frame == "frame=lagged" { -2.054 } else { -2.006 };
        assert!((lower - expected).abs() < 1e-3, "{frame}: {lower}");
        threshold(&linear, Parameter::Damping, Side::Upper);
    }
}

#[test]
fn roots_of_the_radius_are_the_formulas_where_the_sweep_has_no_memory() {
    for frame in ["frame=none", "frame=lagged"] {
        let linear = linear("tension", &[frame, NO_PROBES]);
        assert!(!linear.thresholds.is_empty(), "{frame}");
        for one in &linear.thresholds {
            let predicted = one.predicted.as_ref().expect("predicted");
            assert_eq!(predicted.closed_form.is_some(), frame == "frame=none", "{one:?}");
            if let Some(formula) = predicted.closed_form {
                assert!((formula - predicted.value).abs() < 1e-8, "{one:?}");
            }
        }
    }
}

#[test]
fn a_finite_body_of_a_material_bears_a_little_more_damping_than_its_waves() {
    let grid = "body.shape={kind=\"grid\",columns=8,rows=7}";
    for (lattice, infinite) in [(None, 2.0 / 2.24), (Some(HEXAGONAL), f64::NAN)] {
        let overrides = [Some(grid), lattice, Some("body.anchor=[0.0,0.0]")];
        let overrides: Vec<&str> = overrides.into_iter().flatten().collect();
        let scene = load("grips", &overrides);
        let elastic = scene.material.expect("has one");
        let crystal = flockform::material::homogenise::Crystal::material(&scene.lattice, &elastic);
        let limit = crystal.and_then(|crystal| crystal.zone()).expect("has waves").damping_limit;
        assert!(infinite.is_nan() || (limit - infinite).abs() < 5e-3, "{limit}");
        let linear = linear("grips", &overrides);
        for found in threshold(&linear, Parameter::Damping, Side::Upper) {
            assert!(found > limit && found < 1.1 * limit, "{lattice:?}: {found}, waves {limit}");
        }
        threshold(&linear, Parameter::Feedback, Side::Upper);
    }
}

#[test]
fn over_relaxation_and_sequential_sweeps_have_their_textbook_thresholds() {
    let previous = "rule.feedback={factor=0.0,reference=\"previous\"}";
    let relaxed = linear("tension", &["frame=none", NO_PROBES, previous]);
    let [lower, _] = threshold(&relaxed, Parameter::Feedback, Side::Lower);
    assert!((lower + 1.0).abs() < 1e-6, "{lower}");
    threshold(&relaxed, Parameter::Feedback, Side::Upper);
    // A frame that lags has a spectrum of its own beside that of the body, which stands still there.
    let [lower, _] = threshold(&linear("feedback-overrelax", &[]), Parameter::Feedback, Side::Lower);
    assert!((lower + 1.0).abs() < 1e-6, "{lower}");
    // Gauss-Seidel of a symmetric positive system converges up to 2 (A. M. Ostrowski, 1954).
    let sequential = linear("tension", &["frame=none", NO_PROBES, "update.order=\"sequential\""]);
    for found in threshold(&sequential, Parameter::Damping, Side::Upper) {
        assert!((found - 2.0).abs() < 1e-4, "{found}");
    }
}

/// Of two rows of three, one end held, the followers' means have the spectral radius 5/6; what is moved comes to rest elsewhere.
#[test]
fn a_body_that_does_not_rest_where_it_is_laid_out_has_its_thresholds_too() {
    let shape = "body.shape={kind=\"grid\",columns=3,rows=2}";
    let held = "roles=[{region={kind=\"edge\",side=\"left\"},role=\"clamped\"}]";
    let literal = linear("tension", &["frame=none", NO_PROBES, "rule.rest=\"literal\"", shape, held]);
    for found in threshold(&literal, Parameter::Feedback, Side::Upper) {
        assert!((found - 0.2).abs() < 1e-4, "{found}");
    }
}

/// One axis drives the other and is not driven back: what a disturbance grows by is that of each alone.
#[test]
fn the_poisson_term_changes_no_factor_of_growth() {
    let shape = "body.shape={kind=\"grid\",columns=5,rows=4}";
    let held = "roles=[{region={kind=\"edge\",side=\"left\"},role=\"clamped\"}]";
    for how in [["frame=none", "rule.rest=\"literal\""], ["frame=lagged", "rule.rest=\"balanced\""]] {
        for order in ["update.order=\"synchronous\"", "update.order=\"sequential\""] {
            let with = |more: &[&str]| {
                let scene = load("tension", &[&[NO_PROBES, shape, held, order], &how[..], more].concat());
                let radius = Subject::of(&scene).expect("linear").sweep().radius();
                assert!(radius.converged, "{how:?} {order} {more:?}: {radius:?}");
                radius.radius
            };
            let plain = with(&[]);
            assert!(plain < 1.0, "weights that are a mean: {plain}");
            for k in ["0.0", "1.0", "20.0"] {
                let found = with(&[&format!("rule.poisson={{k={k},axis=\"y\"}}")]);
                assert!((found - plain).abs() < 1e-9, "{how:?} {order} k = {k}: {found}, {plain}");
            }
        }
    }
}

#[test]
fn the_measured_factor_is_the_spectral_radius() {
    let scene = load("tension", &[]);
    let subject = Subject::of(&scene).expect("linear");
    for (parameter, value) in
        [(Parameter::Feedback, 0.02), (Parameter::Feedback, -0.5), (Parameter::Damping, 1.1)]
    {
        let run = growth(&subject, parameter, value, 10_000);
        let spectrum = subject.with(parameter, value).sweep().radius();
        assert!(run.settled && spectrum.converged, "{run:?} {spectrum:?}");
        assert!((run.per_step - spectrum.radius).abs() < 2e-3, "{run:?} {spectrum:?}");
    }
}

#[test]
fn a_nonlinear_rule_has_no_threshold_but_its_extremes() {
    for (change, reason) in [
        ("rule.mean={kind=\"distance\"}", "weighted by distance"),
        ("rule.mean={kind=\"geometric\"}", "geometric mean"),
        ("rule.mean={kind=\"spaced\",spacing=1.0}", "separation"),
        ("fracture={stretch=1.5}", "bonds that break"),
    ] {
        let study = study("tension", &[change], false);
        assert!(study.linear.is_none(), "{change}");
        assert!(
            study.refused.as_ref().is_some_and(|why| why.contains(reason)),
            "{change}: {:?}",
            study.refused
        );
        assert!(study.extremes.iter().any(|case| case.body == "the scene"), "{change}");
        assert_none_wrong(&study.extremes);
    }
}

#[test]
fn a_body_that_nobody_holds_is_refused_by_name() {
    let scene = load("tension", &["roles=[]"]);
    let refused = Subject::of(&scene).expect_err("free").to_string();
    assert!(refused.contains("no leader and no clamp") && refused.contains("help"), "{refused}");
    let all = "roles=[{region={kind=\"all\"},role=\"clamped\"}]";
    let refused = Subject::of(&load("tension", &[all, "frame=none", NO_PROBES])).expect_err("none follow");
    assert!(refused.to_string().contains("no followers"), "{refused}");
}

/// Damping does not save a body whose frame, which lags, makes it grow whatever it is damped by.
#[test]
fn a_body_that_grows_at_every_damping_is_said_to() {
    let linear = linear("feedback-grow", &[]);
    let of = |side| linear.thresholds.iter().find(|t| (t.parameter, t.side) == (Parameter::Damping, side));
    let upper = of(Side::Upper).expect("asked for");
    assert!(upper.grows_everywhere && upper.predicted.is_none() && upper.found.is_none(), "{upper:?}");
    let study = study("feedback-grow", &[], true).to_string();
    assert!(study.contains("everywhere     everywhere") && !study.contains("nowhere"), "{study}");
}

/// A component that is held takes no particle out of the sweep. Truth is the decay of the scene's own run, which the study has no part in.
#[test]
fn followers_of_which_one_component_is_held_are_in_the_spectrum() {
    let scene = load("bar", &["lattice.spacing=5.0", "loads=[]"]);
    let plan = planned(&scene);
    let mut engine = Engine::new(plan.setup);
    let disturbed = engine
        .present()
        .iter()
        .enumerate()
        .map(|(i, [x, y])| [x + scatter(2 * i as u64), y + scatter(2 * i as u64 + 1)]);
    let disturbed = disturbed.collect();
    engine.place_at_rest(0, &disturbed);
    let size =
        |engine: &Engine| engine.displacements().iter().map(|[x, y]| x * x + y * y).sum::<f64>().sqrt();
    (0..1000).for_each(|_| engine.advance());
    let before = size(&engine);
    engine.advance();
    let decay = size(&engine) / before;
    let subject = Subject::of(&scene).expect("linear");
    let radius = subject.sweep().radius().radius;
    let followers = engine.roles().iter().filter(|role| **role == Role::Follower).count();
    assert_eq!(subject.followers(), followers);
    assert!((radius - decay).abs() < 1e-7, "{radius}, {decay} in a run");
}

fn assert_none_wrong(cases: &[Case]) {
    let wrong: Vec<&Case> = cases.iter().filter(|c| matches!(c.outcome, Outcome::Wrong { .. })).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

fn cases(name: &str) -> Vec<Case> {
    let scene = load(name, &[]);
    let load = |more: &[String]| bundled(name).expect("bundled").load(more);
    extremes::run(&load, &scene, &mut |_| {})
}

/// The cases whose names begin so; there must be some.
fn named<'a>(cases: &'a [Case], begin: &str) -> Vec<&'a Case> {
    let found: Vec<&Case> = cases.iter().filter(|case| case.name.starts_with(begin)).collect();
    assert!(!found.is_empty(), "{begin}");
    found
}

fn assert_right(cases: &[Case], begin: &str) {
    for case in named(cases, begin) {
        assert!(matches!(case.outcome, Outcome::Right { .. }), "{case:?}");
    }
}

fn assert_refused(cases: &[Case], begin: &str, words: &str) {
    for case in named(cases, begin) {
        let Outcome::Refused { message } = &case.outcome else { panic!("{case:?}") };
        assert!(message.contains(words), "{words}: {message}");
    }
}

#[test]
fn a_second_gradient_and_a_drop_are_the_same_in_any_unit() {
    for name in ["gradient-layer", "drop"] {
        let all = cases(name);
        assert_none_wrong(&all);
        for case in ["coordinates times 1e-150", "coordinates times 1e150", "spacing 1e-9", "spacing 1e9"] {
            assert_right(&all, case);
        }
    }
}

#[test]
fn extremes_end_right_or_refused() {
    for scene in ["tension", "grips"] {
        let all = cases(scene);
        assert_none_wrong(&all);
        for name in [
            "coordinates times 1e-150",
            "coordinates times 1e150",
            "spacing 1e-9",
            "spacing 1e9",
            "coincident leaders",
            "a body of one follower",
            "no leaders, stepped",
            "one particle and no leader, stepped",
            "1e9 spacings from the origin",
            "nu = -0.99, plane stress:",
            "nu = 0.499, plane stress:",
            "nu = -0.99, plane strain:",
            "nu = 0.499, plane strain:",
            "stiffness contrast 1e6, multigrid",
            "cells of 1000.0 by 1.0",
            "cells of 1.0 by 1000.0",
            "a strip of aspect ratio 1000, pulled",
            "stiffness contrast 1e12, conjugate-gradients",
            "loads and stiffness times 1e39",
            "loads and stiffness times 1e-39",
            "loads and stiffness times 1e200",
            "loads and stiffness times 1e-200",
            "coordinates times 1e39",
            "coordinates times 1e-50",
            // Held against a factorisation:
            "a strip of aspect ratio 1000, bent, auto",
            "a strip of aspect ratio 1000, bent, multigrid",
            "stiffness contrast 1e12, direct",
        ] {
            assert_right(&all, name);
        }
        for (name, words) in [
            ("spacing 1e-310", "double"),
            ("spacing 1e-320", "double"),
            ("spacing 1e300", "double"),
            ("spacing 1e308", ""),
            ("1e12 spacings from the origin", "steps of"),
            ("1e300 spacings from the origin", "steps of"),
            ("no leaders, solved", "particle 1"),
            ("no leaders, material, solved", "particle 1"),
            ("no leaders, thresholds", "particle 1"),
            ("followers in a part of their own", "particle 1 and particle"),
            ("nu = -1, plane stress", "cost no energy"),
            ("nu = 0.5, plane strain", "incompressible"),
            ("stiffness contrast 1e12, jacobi", "short of its tolerance"),
            ("stiffness contrast 1e12, multigrid", "further apart than the digits of a double"),
            ("a load 1e600 times the stiffness", "not finite"),
        ] {
            assert_refused(&all, name, words);
        }
    }
}

/// The body after some steps from a disturbance, in units of a power of two.
fn stepped(name: &str, overrides: &[&str], factor: f64) -> Vectors {
    let spacing = format!("lattice.spacing={factor:e}");
    let plan = planned(&load(name, &[overrides, &[&spacing]].concat()));
    let mut engine = Engine::new(plan.setup);
    let push = |k: usize| factor * scatter(k as u64);
    let disturbed = (0..engine.present().len()).map(|i| [push(2 * i), push(2 * i + 1)]).collect();
    engine.place_at_rest(0, &disturbed);
    (0..30).for_each(|_| engine.advance());
    engine.present().clone()
}

#[test]
fn a_linear_run_in_other_units_has_the_same_bits() {
    let held = "roles=[{region={kind=\"edge\",side=\"left\"},role=\"clamped\"}]";
    let sheet = "material={kind=\"isotropic\",young=1000.0,poisson=0.3}";
    let fed = "rule.feedback={factor=-0.25,reference=\"initial\"}";
    for overrides in [
        &[held, "frame=lagged"][..],
        &[held, "frame=mirror", fed],
        &[held, "frame=none", NO_PROBES, "update.order=\"sequential\""],
        &[
            held,
            "frame=none",
            NO_PROBES,
            sheet,
            "rule={mean={kind=\"material\"}}",
            "neighbours={kind=\"cells\"}",
        ],
    ] {
        let here = stepped("tension", overrides, 1.0);
        for power in [-490, -30, 1, 30, 490] {
            let factor = f64::from(power).exp2();
            let there = stepped("tension", overrides, factor);
            let bits = |points: &Vectors, by: f64| -> Vec<u64> {
                points.x.iter().chain(&points.y).map(|v| (by * v).to_bits()).collect()
            };
            assert_eq!(bits(&here, factor), bits(&there, 1.0), "{overrides:?} times 2^{power}");
        }
    }
}
