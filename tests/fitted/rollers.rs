//! Single components that are held in a body that turns: rollers and planes of symmetry under `corotated`.

use std::ops::ControlFlow;

use flockform::continuum::equilibrium::run_to_equilibrium;
use flockform::continuum::mechanics::Mechanics;
use flockform::continuum::plan::Plan;
use flockform::continuum::run::{Outcome, run, run_shared};
use flockform::engine::Engine;
use flockform::engine::observer::EachStep;
use flockform::engine::state::EngineState;
use flockform::flock::vectors::distance;
use flockform::ranks::Team;
use flockform::scene::Scene;

use crate::scenes::load;
use crate::support::{KINDS, lattice, solved};

const COROTATED: &str = "rule.mean={ kind = \"material\", rotation = \"corotated\" }";

fn measured(outcome: &Outcome) -> Mechanics {
    Mechanics::of(&outcome.engine).expect("has cells")
}

fn largest(outcome: &Outcome) -> f64 {
    (0..outcome.engine.roles().len())
        .map(|i| distance(outcome.engine.displacement(i), [0.0; 2]))
        .fold(0.0, f64::max)
}

#[test]
fn a_ring_on_rollers_that_hardly_turns_is_that_of_small_rotations() {
    for kind in KINDS {
        let at = lattice(kind, 1.0, 20.0).replace(" = {", "={");
        let light = "loads[0].pressure=1e-4";
        let found = [&[&*at, light][..], &[&at, light, COROTATED]].map(|sets| {
            let scene = load("ring", &[sets, &["equilibrium.tolerance=1e-11"]].concat());
            let (_, outcome) = solved(&scene);
            (measured(&outcome), outcome)
        });
        let [(small, at_small), (turning, at_turning)] = &found;
        let apart = (0..at_small.engine.roles().len())
            .map(|i| distance(at_small.engine.displacement(i), at_turning.engine.displacement(i)))
            .fold(0.0, f64::max);
        // Strains of 3e-7, whose squares are what the rotations differ by.
        assert!(apart < 1e-5 * largest(at_small), "{kind}: {apart:e}");
        for mechanics in [small, turning] {
            // The pressure on a bore of radius 4 pushes each plane of symmetry away by 4 times as much, and nothing acts along it.
            let [below, left] = [0, 1].map(|k| mechanics.reactions[k].force);
            for (found, expected) in [(below, [0.0, -4e-4]), (left, [-4e-4, 0.0])] {
                let off = distance(found, expected);
                assert!(off < 1e-8 * 4e-4, "{kind}: {found:?}, off by {off:e}");
            }
        }
    }
}

/// Uniform stress behind a plane of symmetry that is moved: corners, and cells that the outline cuts, are pushed aside by it.
#[test]
fn a_roller_that_is_led_step_by_step_moves_the_body_as_one_that_is_solved_for() {
    for kind in KINDS {
        let roller = |side: &str, axis: &str, rest: &str| {
            format!("{{ region = {{ kind = \"edge\", side = \"{side}\" }}, axis = \"{axis}\", {rest} }}")
        };
        let up = "role = \"leader\", motion = { kind = \"keyframes\", frames = [{ step = 7, displacement = [0.0, 0.02] }] }";
        let roles =
            [("left", "x", "role = \"clamped\""), ("bottom", "y", "role = \"clamped\""), ("top", "y", up)];
        let roles = roles.map(|(side, axis, rest)| roller(side, axis, rest)).join(", ");
        let text = format!(
            "title = \"led\"\nstop = {{ steps = 20000 }}\nrule = {{ mean = {{ kind = \"material\" }} }}\n{}\n\
             body = {{ shape = {{ kind = \"rectangle\", max = [3.0, 2.0] }} }}\n\
             material = {{ kind = \"isotropic\", young = 1000.0, poisson = 0.3 }}\nroles = [{roles}]\n",
            lattice(kind, 0.5, 17.0)
        );
        let scene =
            Scene::parse("led", "led.toml", &text, &[], None).unwrap_or_else(|error| panic!("{error}"));
        let plan = Plan::new(&scene).unwrap_or_else(|error| panic!("{error}"));
        let outcome = run(plan, &mut |_, _| ControlFlow::Continue(()));
        let mechanics = measured(&outcome);
        // 1 % of 1000 on 3 by 1.
        let force = mechanics.reactions[2].force[1];
        assert!((force - 30.0).abs() < 1e-6 * 30.0, "{kind}: {force}");
        let [x, _] = mechanics.reactions[0].force;
        assert!(x.abs() < 1e-6 * 30.0, "{kind}: {x}");
    }
}

/// However the rule damps or feeds back, a component that is led is where its motion has it, after each step and when that has ended.
#[test]
fn a_led_component_is_where_its_motion_says() {
    let text = "title = \"led\"\nlattice = { kind = \"square\", spacing = 1.0 }\nrule = { mean = { kind = \"material\" } }\n\
        body = { shape = { kind = \"rectangle\", max = [6.0, 4.0] } }\nmaterial = { kind = \"isotropic\", young = 1000.0, poisson = 0.3 }\n\
        roles = [{ region = { kind = \"edge\", side = \"left\" }, role = \"clamped\" }, { region = { kind = \"edge\", side = \"right\" }, \
        role = \"leader\", axis = \"y\", motion = { kind = \"keyframes\", frames = [{ step = 40, displacement = [0.0, 0.1] }] } }]\n\
        stop = { steps = 90 }\n";
    for sets in [
        &[][..],
        &["update.damping=0.5"],
        &["update.damping=0.5", "rule.feedback={factor=-0.3}"],
        &["rule.feedback={factor=0.01,reference=\"previous\"}"],
        &["rule.feedback={factor=-0.3}", COROTATED],
        &["update.order=\"sequential\"", "rule.feedback={factor=-0.3}"],
    ] {
        let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
        let scene =
            Scene::parse("led", "led.toml", text, &sets, None).unwrap_or_else(|error| panic!("{error}"));
        let plan = Plan::new(&scene).unwrap_or_else(|error| panic!("{error}"));
        let led: Vec<usize> =
            (0..plan.count()).filter(|&i| plan.setup.body.reference.get(i)[0] == 6.0).collect();
        assert_eq!(led.len(), 5);
        let outcome = run(plan, &mut |engine, _| {
            let expected = 0.1 * (engine.step() as f64 / 40.0).min(1.0);
            for &i in &led {
                let [_, y] = engine.displacement(i);
                assert!(
                    (y - expected).abs() < 1e-14,
                    "{sets:?}, step {}: {y}, not {expected}",
                    engine.step()
                );
            }
            ControlFlow::Continue(())
        });
        assert_eq!(outcome.engine.step(), 90, "{sets:?}");
    }
}

/// A square of side 1 and modulus 1 stretched by 0.1 % along x, along y as well if so, by its edges; the corner between is led by both.
fn stretched(both: bool, sets: &[&str]) -> (Scene, Plan) {
    let entry = |side: &str, axis: &str, role: &str| {
        format!("{{ region = {{ kind = \"edge\", side = \"{side}\" }}, axis = \"{axis}\", role = {role} }}")
    };
    let led = |by: &str| {
        format!(
            "\"leader\", motion = {{ kind = \"keyframes\", frames = [{{ step = 100, displacement = {by} }}] }}"
        )
    };
    let mut roles = vec![
        entry("left", "x", "\"clamped\""),
        entry("bottom", "y", "\"clamped\""),
        entry("right", "x", &led("[1e-3, 0.0]")),
    ];
    roles.extend(both.then(|| entry("top", "y", &led("[0.0, 1e-3]"))));
    let text = format!(
        "title = \"stretched\"\nrule = {{ mean = {{ kind = \"material\" }} }}\nstop = {{ steps = 3000 }}\n\
         body = {{ shape = {{ kind = \"rectangle\", max = [1.0, 1.0] }} }}\nlattice = {{ kind = \"square\", spacing = 0.25 }}\n\
         material = {{ kind = \"isotropic\", young = 1.0, poisson = 0.3 }}\nroles = [{}]\n",
        roles.join(", ")
    );
    let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
    let scene = Scene::parse("stretched", "stretched.toml", &text, &sets, None)
        .unwrap_or_else(|error| panic!("{error}"));
    let plan = Plan::new(&scene).unwrap_or_else(|error| panic!("{error}"));
    (scene, plan)
}

/// How far the force on the edge that is led along x is from that of uniform stress, over it.
fn off_uniform(both: bool, outcome: &Outcome) -> f64 {
    let expected = if both { 1e-3 / 0.7 } else { 1e-3 };
    (measured(outcome).reactions[2].force[0] / expected - 1.0).abs()
}

#[test]
fn components_that_have_been_led_stay_where_they_are_a_corner_along_both_axes_and_resumed_too() {
    for both in [false, true] {
        let mut kept = None;
        let outcome = run(stretched(both, &[]).1, &mut |engine, residual| {
            if engine.step() == 1000 {
                kept = Some((engine.clone(), residual));
            }
            ControlFlow::Continue(())
        });
        assert!(off_uniform(both, &outcome) < 1e-9, "{both}: {:?}", measured(&outcome).reactions);
        let mut see = |_: &Engine, _: f64| ControlFlow::Continue(());
        let kept = kept.as_ref().map(|(engine, residual)| (EngineState::of(engine), *residual));
        let resumed = run_shared(stretched(both, &[]).1, kept, None::<&Team>, &mut EachStep(&mut see));
        let resumed = resumed.expect("the same body");
        let all = outcome.engine.present().iter().zip(resumed.engine.present().iter());
        assert!(all.into_iter().all(|(a, b)| a.map(f64::to_bits) == b.map(f64::to_bits)), "{both}");
    }
}

#[test]
fn an_equilibrium_under_led_components_leaves_no_residual() {
    for both in [false, true] {
        for sets in [&[][..], &[COROTATED], &["load_steps.schedule=[0.5, 1.0]"]] {
            let (scene, plan) = stretched(both, &[&["equilibrium={ tolerance = 1e-12 }"], sets].concat());
            let outcome = run_to_equilibrium(&scene, plan, &mut |_, _| ControlFlow::Continue(()));
            let outcome = outcome.unwrap_or_else(|error| panic!("{error}"));
            assert!(off_uniform(both, &outcome) < 1e-3, "{both}, {sets:?}");
            assert!(outcome.residual < 1e-12, "{both}, {sets:?}: {:e}", outcome.residual);
        }
    }
}

/// A beam of depth 1 on two supports 20 apart, loaded along its top, whole or its right half on a plane of symmetry.
fn bent(half: bool) -> (Scene, Plan, Outcome) {
    let from = if half { 0.0 } else { -10.0 };
    let end = |x: f64| {
        format!(
            "{{ region = {{ kind = \"disc\", centre = [{x:?}, 0.0], radius = 1e-3 }}, role = \"clamped\", axis = \"y\" }}"
        )
    };
    let middle = "{ region = { kind = \"box\", min = [-1e-3, -1.0], max = [1e-3, 2.0] }, role = \"clamped\", axis = \"x\" }";
    let supports = if half { vec![end(10.0)] } else { vec![end(-10.0), end(10.0)] };
    let parts = format!(
        "body = {{ shape = {{ kind = \"rectangle\", min = [{from:?}, 0.0], max = [10.0, 1.0] }} }}\n\
         material = {{ kind = \"isotropic\", young = 1000.0, poisson = 0.3 }}\n\
         roles = [{middle}, {}]\n\
         loads = [{{ kind = \"traction\", region = {{ kind = \"edge\", side = \"top\" }}, traction = [0.0, -0.2] }}]",
        supports.join(", ")
    );
    let text = format!(
        "title = \"bent\"\nstop = {{ steps = 1 }}\nequilibrium = {{ tolerance = 1e-12 }}\n\
         rule = {{ mean = {{ kind = \"material\", rotation = \"corotated\" }} }}\n\
         lattice = {{ kind = \"square\", spacing = 0.5 }}\n{parts}"
    );
    let scene = Scene::parse("bent", "bent.toml", &text, &[], None).unwrap_or_else(|error| panic!("{error}"));
    let (plan, outcome) = solved(&scene);
    (scene, plan, outcome)
}

#[test]
fn half_of_a_beam_on_a_plane_of_symmetry_bends_as_far_as_the_whole() {
    let (_, plan, outcome) = bent(true);
    let mechanics = measured(&outcome);
    assert!(mechanics.largest_turn > 0.2, "turns far: {}", mechanics.largest_turn);
    // What the supports return sums up to the load, component by component.
    let [symmetry, support] = [0, 1].map(|k| mechanics.reactions[k].force);
    let load = mechanics.load.expect("is loaded").force;
    assert!(symmetry[0].abs() < 1e-8 * 2.0 && symmetry[1] == 0.0, "{symmetry:?}");
    assert!(support[0] == 0.0 && (support[1] + load[1]).abs() < 1e-8 * 2.0, "{support:?} {load:?}");
    let moments = mechanics.reactions.iter().map(|reaction| reaction.moment_about_origin).sum::<f64>();
    let all = moments + mechanics.load.expect("is loaded").moment_about_origin;
    assert!(all.abs() < 1e-8 * 20.0, "{all:e} turns the body");

    let (_, whole_plan, whole) = bent(false);
    let reference = &whole_plan.setup.body.reference;
    for (i, p) in plan.setup.body.reference.iter().enumerate() {
        let twin =
            (0..whole_plan.count()).find(|&j| distance(reference.get(j), p) < 1e-9).expect("has a twin");
        let apart = distance(outcome.engine.displacement(i), whole.engine.displacement(twin));
        assert!(apart < 1e-7, "{p:?}: {apart:e} apart");
    }
}
