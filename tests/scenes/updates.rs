//! Updates, damping and feedback: what settles, and what does not.

use std::ops::ControlFlow;

use flockform::continuum::bulk_response::material;
use flockform::continuum::report::PlanReport;
use flockform::continuum::run::{StopReason, run};
use flockform::flock::vectors::distance;
use flockform::scene::Scene;

use crate::support::*;

#[test]
fn a_body_that_diverged_has_the_energies_of_its_last_good_step() {
    let grown = "[rule]; feedback = { factor = 0.8 }; [stop]; steps = 500";
    let mut seen = Vec::new();
    let outcome = run(planned(&pulled([6, 5], 0.1, grown)), &mut |engine, _| {
        seen.push(engine.energies());
        ControlFlow::Continue(())
    });
    assert!(matches!(outcome.reason, StopReason::Diverged(_)), "{:?}", outcome.reason);
    let [_, pe2] = outcome.engine.energies();
    assert!(pe2 > 0.0);
    assert_eq!(outcome.engine.energies(), seen[outcome.engine.step()]);
}

#[test]
fn what_over_relaxes_counts_in_the_damping_that_is_stated_and_taken() {
    let cautions = |more: &str| {
        let over = format!("[rule]; feedback = {{ factor = 0.5, reference = 'previous' }}; {more}");
        let scene = pulled([8, 8], 0.1, &over);
        PlanReport::new(&scene, &planned(&scene)).expect("planned").cautions.join("\n")
    };
    let stated = cautions("[update]; damping = 0.9");
    assert!(stated.contains("may diverge unless damped below 0.6667"), "{stated}");
    assert_eq!(cautions("[update]; damping = 0.6"), "");
    let gradient = "[neighbours]; kind = 'collinear'
                    [rule]; weights = { kind = 'gradient', length = 0.6 }; feedback = { factor = 0.5, reference = 'previous' }
                    [stop]; steps = 600";
    let outcome = run_out(&pulled([9, 9], 1e-3, gradient));
    assert!((outcome.engine.update().damping - 0.4).abs() < 1e-15);
    assert_eq!(outcome.reason, StopReason::Steps);
}

/// At free edges a particle has fewer cells, and fewer of them share a mean dilatation: what suits the waves inside grows by up to 2 a step.
#[test]
fn bodies_with_free_edges_come_to_rest_with_the_damping_that_is_taken() {
    let nearly_incompressible = ["square", "hexagonal", "honeycomb"]
        .into_iter()
        .flat_map(|kind| [0.42, 0.45].map(|nu| (kind, [16, 8], nu)));
    let auxetic = [("square", [8, 2], -0.5), ("square", [8, 2], -0.9), ("honeycomb", [12, 12], -0.5)];
    for (lattice, [columns, rows], poisson) in nearly_incompressible.chain(auxetic) {
        let text = format!(
            "title = \"free edges\"\nlattice = {{ kind = \"{lattice}\", spacing = 1.0 }}\n\
             body = {{ shape = {{ kind = \"grid\", columns = {columns}, rows = {rows} }} }}\nstop = {{ steps = 6000, tolerance = 1e-9 }}\n\
             material = {{ kind = \"isotropic\", young = 1.0, poisson = {poisson}, plane = \"strain\" }}\n\
             rule = {{ mean = {{ kind = \"material\" }} }}\n\
             [[roles]]\nregion = {{ kind = \"edge\", side = \"left\" }}\nrole = \"clamped\"\n\
             [[roles]]\nregion = {{ kind = \"edge\", side = \"right\" }}\nrole = \"leader\"\n\
             motion = {{ kind = \"keyframes\", frames = [{{ step = 1, displacement = [0.003, -0.01] }}] }}\n"
        );
        let scene =
            Scene::parse("free", "free.toml", &text, &[], None).unwrap_or_else(|error| panic!("{error}"));
        let outcome = run_out(&scene);
        assert_eq!(outcome.reason, StopReason::Equilibrium, "{lattice} {poisson}: {}", outcome.residual);
    }
}

#[test]
fn every_update_reaches_the_same_equilibrium_and_the_sequential_one_sooner() {
    let ended = |update: &str| {
        let outcome = outcome("shear", &[update, "stop={steps=50000,tolerance=1e-12}"]);
        assert_eq!(outcome.reason, StopReason::Equilibrium, "{update}");
        (outcome.engine.step(), outcome.engine.present().clone())
    };
    let (synchronous, expected) = ended("update={}");
    for update in [r#"update={order="sequential"}"#, "update={damping=0.5}"] {
        let (steps, places) = ended(update);
        let apart = places.iter().zip(expected.iter()).map(|(a, b)| distance(a, b)).fold(0.0, f64::max);
        assert!(apart < 1e-8, "{update}: {apart}");
        assert_eq!(
            steps < synchronous,
            update.contains("sequential"),
            "{update}: {steps} against {synchronous}"
        );
    }
}

#[test]
fn weights_that_grow_with_distance_settle_only_sequentially_or_damped() {
    // A chain of three: two held ends and one particle between them, pushed off its middle.
    let between = |update: &str| {
        outcome(
            "lattice-square",
            &[
                r#"body={shape={kind="grid",columns=3,rows=1}}"#,
                r#"roles=[{region={kind="edge",side="left"},role="clamped"},{region={kind="edge",side="right"},role="leader",motion={kind="keyframes",frames=[{step=1,displacement=[2.0,0.0]}]}}]"#,
                r#"rule.mean={kind="distance"}"#,
                "stop={steps=400,tolerance=1e-9}",
                update,
            ],
        )
    };
    let marginal = between("update={damping=1.0}");
    assert_eq!(marginal.reason, StopReason::Steps, "the synchronous update settled");
    assert!(marginal.residual > 0.1, "{}", marginal.residual);
    let damped = between("update={damping=0.5}");
    assert_eq!(damped.reason, StopReason::Equilibrium);
    assert!((damped.engine.present().x[1] - 2.0).abs() < 1e-6);
}

/// The largest eigenvalue of `d^p (1 + p n n')` over the sum of `d^p` on a square lattice is `2 + p`, of a wave along its bonds.
#[test]
fn weights_by_distance_settle_below_the_damping_that_is_said_and_not_above() {
    for power in [1.0, 2.0, 3.0] {
        let limit = 2.0 / (2.0 + power);
        let set = |damping: f64| {
            [
                format!("rule.mean={{kind=\"distance\",power={power:?}}}"),
                format!("update.damping={damping:?}"),
                "stop={steps=3000,tolerance=1e-9}".to_owned(),
            ]
        };
        let of = |damping: f64| {
            let set = set(damping);
            let scene = load("distance-weights", &set.each_ref().map(String::as_str));
            let cautions = PlanReport::new(&scene, &planned(&scene)).expect("planned").cautions.join("\n");
            (cautions.contains(&format!("damped below {limit:.4}")), run_out(&scene).reason, material(&scene))
        };
        let (is_cautioned, reason, report) = of(0.95 * limit);
        assert!(!is_cautioned && reason == StopReason::Equilibrium, "{power}: {reason:?}");
        let found = report.expect("a material").waves.damping_limit.expect("stable");
        assert!((found / limit - 1.0).abs() < 1e-9, "{power}: {found}");
        let (is_cautioned, reason, _) = of(1.06 * limit);
        assert!(is_cautioned && reason == StopReason::Steps, "{power}: {reason:?}");
    }
    for power in [-1.0, -2.0, -2.5, -8.0] {
        let scene = load("distance-weights", &[&format!("rule.mean={{kind=\"distance\",power={power:?}}}")]);
        let cautions = PlanReport::new(&scene, &planned(&scene)).expect("planned").cautions.join("\n");
        assert!(cautions.contains("unstable") && cautions.contains("rule.mean.power above -1"), "{cautions}");
        let is_stable = material(&scene).map(|report| report.waves.stable);
        assert_eq!(is_stable.ok(), Some(false).filter(|_| power > -2.0), "{power}");
    }
}

#[test]
fn feedback_that_overshoots_swings_a_particle_about_its_place() {
    let mut moved = Vec::new();
    watched("feedback-oscillate", &[], |engine| moved.push((engine.step(), displacement(engine, 67)[0])));
    let drawn_out = moved.iter().filter(|(step, _)| *step <= 20);
    assert!(drawn_out.clone().zip(drawn_out.skip(1)).all(|((_, a), (_, b))| b > a), "is drawn to the right");
    let free: Vec<f64> = moved.iter().filter(|(step, _)| *step > 20).map(|(_, x)| *x).collect();
    let swings: Vec<f64> = free.chunk_by(|a, b| a.signum() == b.signum()).map(largest).collect();
    println!("{} swings: {swings:.3?}", swings.len());
    assert!(swings.len() > 20, "{swings:?}");
    // To either side, and out.
    assert!(swings[0] > 1.0 && swings[swings.len() - 1] < 0.1 * swings[0], "{swings:?}");
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, value| most.max(value.abs()))
}

/// A disc clamped on its left and led on its right, which follows by this rule.
fn disc(lattice: &str, radius: f64, rule: &str) -> Scene {
    let text = format!(
        "title = 'disc'\nlattice = {{ {lattice} }}\nbody.shape = {{ kind = 'disc', radius = {radius:?} }}\n{rule}\n\
         stop = {{ steps = 5000, tolerance = 1e-9 }}\n\
         roles = [{{ region = {{ kind = 'edge', side = 'left', depth = 0.6 }}, role = 'clamped' }},\n\
         {{ region = {{ kind = 'edge', side = 'right', depth = 0.6 }}, role = 'leader', motion = {{ kind = 'keyframes', \
         frames = [{{ step = 10, displacement = [0.03, 0.02] }}] }} }}]"
    );
    Scene::parse("disc", "disc.toml", &text, &[], None).unwrap_or_else(|error| panic!("{error}"))
}

/// Undamped the least eigenvalues of their sweeps are -1.178, -1.153 and -1.062: they must be damped below these limits.
#[test]
fn weights_that_are_solved_for_come_to_rest_with_the_damping_that_is_taken() {
    let first = "neighbours.kind = 'first'";
    let ring = "neighbours = { kind = 'chebyshev', radius = 1 }";
    let turned = "kind = 'square', spacing = 1.0, orientation = 30.0";
    let hexagonal = "kind = 'hexagonal', spacing = 1.0";
    for (lattice, radius, neighbours, limit) in
        [(hexagonal, 3.0, first, 0.918), (hexagonal, 8.0, first, 0.929), (turned, 6.3, ring, 0.970)]
    {
        let of = |more: &str| {
            disc(lattice, radius, &format!("{neighbours}\nrule.weights.kind = 'solved'\n{more}"))
        };
        let outcome = run_out(&of(""));
        assert_eq!(outcome.reason, StopReason::Equilibrium, "{lattice} {radius}: {}", outcome.residual);
        let damping = outcome.engine.update().damping;
        assert!((damping / (0.9 * limit) - 1.0).abs() < 2e-3, "{lattice} {radius}: {damping}");
        let over = run_out(&of("rule.feedback = { factor = 0.5, reference = 'previous' }"));
        assert_eq!(over.reason, StopReason::Equilibrium, "{lattice} {radius}: {}", over.residual);
        let sequential = run_out(&of("update.order = 'sequential'"));
        assert_eq!((sequential.reason, sequential.engine.update().damping), (StopReason::Equilibrium, 1.0));
        // As written it stays, and is named as the cause.
        let written = run_out(&of("update.damping = 1.0"));
        let StopReason::Diverged(divergence) = &written.reason else { panic!("{:?}", written.reason) };
        let cause = &divergence.likely_cause;
        assert!(cause.contains("smaller update.damping") && cause.contains("sequential"), "{cause}");
    }
    // None has a negative weight.
    let whole =
        run_out(&pulled([6, 4], 0.1, "[neighbours]; kind = 'second'; [rule]; weights = { kind = 'solved' }"));
    assert_eq!(whole.engine.update().damping, 1.0);
}

/// Undamped these go on for ever, without a word.
#[test]
fn means_that_depend_on_distances_come_to_rest_with_the_damping_that_is_taken() {
    let oblique = "kind = 'oblique', a = 1.0, b = 1.5, angle = 110.0, orientation = 73.3";
    let collinear = "frame = 'mirror'\nneighbours.kind = 'collinear'";
    let spaced = |power: f64| format!("{{ kind = 'spaced', spacing = 1.0, power = {power:?} }}");
    let distance = |power: f64| format!("{{ kind = 'distance', power = {power:?} }}");
    let square = "kind = 'square', spacing = 1.0";
    for (lattice, neighbours, mean, damping) in [
        (oblique, collinear, spaced(2.0), 0.5),
        (oblique, collinear, distance(2.0), 1.0 / 3.0),
        (square, "", distance(0.5), 0.5),
    ] {
        let of =
            |more: &str| run_out(&disc(lattice, 3.0, &format!("{neighbours}\nrule.mean = {mean}\n{more}")));
        let outcome = of("");
        assert_eq!(outcome.reason, StopReason::Equilibrium, "{mean}: {}", outcome.residual);
        assert_eq!(outcome.engine.update().damping, damping, "{mean}");
        assert_eq!(of("update.damping = 1.0").reason, StopReason::Steps, "{mean}");
        assert_eq!(of("update.order = 'sequential'").engine.update().damping, 1.0, "{mean}");
    }
    for mean in [spaced(0.0), distance(0.0), distance(-0.5)] {
        let scene = disc(oblique, 3.0, &format!("{collinear}\nrule.mean = {mean}"));
        assert_eq!(scene.update.damping, 1.0, "{mean}");
    }
}
