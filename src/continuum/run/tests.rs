//! Runs that go on from a state of the engine.

use std::ops::ControlFlow;

use super::*;
use crate::continuum::digest::digest;
use crate::continuum::equilibrium::solve_equilibrium;
use crate::scene::{Scene, bundled};

fn scene(name: &str, sets: &[&str]) -> Scene {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    bundled(name).expect("bundled").load(&sets).expect("valid")
}

fn plan(scene: &Scene) -> Plan {
    Plan::new(scene).expect("can be laid out")
}

fn resumed(
    plan: Plan,
    from: (EngineState<'_>, f64),
    see: &mut dyn FnMut(&Engine, f64) -> ControlFlow<()>,
) -> Outcome {
    run_shared(plan, Some(from), None::<&Team>, &mut EachStep(see)).expect("the same body")
}

/// A state as it comes back from a file.
fn through_bytes(engine: &Engine) -> EngineState<'static> {
    let bytes = postcard::to_stdvec(&EngineState::of(engine)).expect("writable");
    postcard::from_bytes(&bytes).expect("readable")
}

/// The state, and what depends on the neighbours: PE1 and the residual, then how the run ended.
fn bits(outcome: &Outcome) -> (EngineState<'static>, Vec<u64>, String) {
    let engine = &outcome.engine;
    let pe1 = (0..engine.body().count()).map(|i| engine.pe1(i));
    let numbers = pe1.chain([outcome.residual]).map(f64::to_bits).collect();
    (through_bytes(engine), numbers, format!("{:?}", outcome.reason))
}

/// Runs whole, and again broken off at every one of `at`, through bytes.
fn continues_to_the_same_end(name: &str, sets: &[&str], at: &[usize]) {
    let scene = scene(name, sets);
    let whole = run(plan(&scene), &mut |_, _| ControlFlow::Continue(()));
    for &step in at {
        let mut kept = None;
        let _ = run(plan(&scene), &mut |engine, residual| {
            if engine.step() == step {
                kept = Some((through_bytes(engine), residual));
                return ControlFlow::Break(());
            }
            ControlFlow::Continue(())
        });
        let (state, residual) = kept.expect("came that far");
        let mut seen = 0;
        let mut see = |_: &Engine, _: f64| {
            seen += 1;
            ControlFlow::Continue(())
        };
        let resumed = resumed(plan(&scene), (state, residual), &mut see);
        assert!(bits(&resumed) == bits(&whole), "{name} from step {step}");
        assert_eq!(seen, whole.engine.step() - step, "{name} from step {step}: every new step is shown once");
    }
}

#[test]
fn a_run_taken_up_again_at_any_step_ends_with_the_same_bits() {
    continues_to_the_same_end("tension", &["stop.steps=45"], &[0, 1, 19, 20, 21, 44, 45]);
    continues_to_the_same_end("tension", &["stop.steps=45", "update.order=sequential"], &[1, 20, 33]);
    continues_to_the_same_end("tension", &["stop.tolerance=1e-3"], &[20, 100]);
    // Without a frame only what moves is swept, and what is known of that comes back too.
    let free = ["frame=none", "record.probes=[]", "stop.steps=45"];
    continues_to_the_same_end("tension", &free, &[0, 1, 7, 20, 21, 45]);
}

/// Looks at every so many steps.
struct Every(usize);

impl Observer for Every {
    fn next(&mut self, step: usize) -> usize {
        step + self.0
    }

    fn see(&mut self, _: &Engine, _: f64) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

#[test]
fn a_rule_that_is_changed_on_the_way_diverges_at_the_same_step_however_often_it_is_looked_at() {
    let changed = [
        "frame=none",
        "body.shape={kind=\"grid\",columns=40,rows=40}",
        "roles=[{region={kind=\"edge\",side=\"left\"},role=\"clamped\"},\
         {region={kind=\"edge\",side=\"right\"},role=\"leader\",motion={kind=\"velocity\",per_step=[0.6,0.0]}}]",
        "record={}",
        "stop.steps=400",
        "actions=[{at=100,what={kind=\"set\",keys=[\"update.damping=1.5\"]}}]",
    ];
    let scene = scene("tension", &changed);
    let [each, some, all] = [1, 7, 400].map(|many| bits(&run_watched(plan(&scene), &mut Every(many))));
    assert!(each.2.starts_with("Diverged"), "{}", each.2);
    assert_eq!(each.2, some.2);
    assert_eq!(each.2, all.2);
    assert!(each == some && each == all);
}

#[test]
fn a_sweep_that_is_stable_is_not_blamed_for_a_load_or_a_leader() {
    let cause = |sets: &[&str]| {
        let material = [
            "frame=none",
            "neighbours={kind=\"cells\"}",
            "material={kind=\"isotropic\",young=1000.0,poisson=0.33}",
            "rule={mean={kind=\"material\"}}",
            "record={}",
            "stop.steps=5000",
        ];
        let scene = scene("tension", &[&material, sets].concat());
        let plan = plan(&scene);
        let outcome = match &scene.equilibrium {
            Some(asked) => solve_equilibrium(&scene, &asked.request, plan).expect("has one"),
            None => run(plan, &mut |_, _| ControlFlow::Continue(())),
        };
        let StopReason::Diverged(divergence) = outcome.reason else { panic!("{sets:?}: {}", outcome.reason) };
        divergence.likely_cause
    };
    let held = "roles=[{region={kind=\"edge\",side=\"left\"},role=\"clamped\"}]";
    let load = |force: &str| format!("loads=[{{kind=\"body\",force=[0.0,{force}]}}]");
    let [small, large, largest] = ["-1e-3", "-1e6", "-1e300"].map(load);
    for given in [&[][..], &["update.damping=0.5"]] {
        let cause = cause(&[&[held, &large], given].concat());
        assert!(cause.starts_with("the loads") && cause.ends_with("raise stop.divergence_ratio"), "{cause}");
    }
    let too_large = cause(&[held, &small, "update.damping=1.0"]);
    assert!(too_large.contains("damping = 1.000 lets its shortest waves grow"), "{too_large}");
    let led = cause(&["roles[1].motion.per_step=[1e3,0.0]"]);
    assert!(led.starts_with("a leader"), "{led}");
    let solved = cause(&[held, &largest, "equilibrium={solver=\"direct\"}"]);
    assert!(solved.starts_with("the loads") && !solved.contains("divergence_ratio"), "{solved}");
}

/// Everything that the end of a run is written from.
fn end(outcome: &Outcome) -> String {
    let engine = &outcome.engine;
    let targets: Vec<_> =
        (0..engine.body().count()).map(|i| engine.flock().target(i, engine.present())).collect();
    let places = (engine.step(), engine.present(), engine.previous(), outcome.residual.to_bits());
    let rest = (engine.roles(), engine.breaks(), engine.elastic(), engine.update(), targets);
    format!("{places:?}\n{rest:?}")
}

#[test]
fn a_step_that_diverged_leaves_nothing_behind() {
    let right = "region={kind=\"edge\",side=\"right\"},role=\"leader\"";
    let left = "{region={kind=\"edge\",side=\"left\"},role=\"clamped\"}";
    let pull = |by: &str| format!("{{{right},motion={{kind=\"velocity\",per_step=[{by},0.0]}}}}");
    let thrown = format!("{{{right},from=6,motion={{kind=\"velocity\",per_step=[100.0,0.0]}}}}");
    let ghosts = "{region={kind=\"ids\",ids=[14,15]},role=\"ghost\",from=6}";
    let taken = "{region={kind=\"box\",min=[0.5,-0.5],max=[8.5,9.5]},role=\"clamped\",when={quantity=\"pe2\",above=0.05}}";
    // Bonds break in the step in which they are out of bounds.
    let torn = format!(
        "{{{right},motion={{kind=\"keyframes\",interpolation=\"linear\",frames=[{{step=4,displacement=[0.4,0.0]}},\
         {{step=5,displacement=[0.8,0.0]}},{{step=6,displacement=[5.0,0.0]}}]}}}}"
    );
    let fracture = |ghosts: &str| format!("fracture={{stretch=1.5,ghosts=\"{ghosts}\"}}");
    let material = [
        "neighbours={kind=\"cells\"}",
        "material={kind=\"isotropic\",young=100.0,poisson=0.3}",
        "rule={mean={kind=\"material\"}}",
        "actions=[{at=6,what={kind=\"set\",keys=[\"material.young=5000.0\"]}}]",
    ];
    let of = |roles: &[&str], more: &[&str]| {
        let roles = format!("roles=[{}]", roles.join(","));
        let sets = ["frame=none", "record={}", "stop.steps=40", "stop.divergence_ratio=2.0", &*roles];
        let sets = [&sets[..], more].concat();
        let diverged = run(plan(&scene("tension", &sets)), &mut |_, _| ControlFlow::Continue(()));
        assert!(matches!(diverged.reason, StopReason::Diverged(_)), "{sets:?}: {}", diverged.reason);
        let last = diverged.engine.step();
        let before = run(plan(&scene("tension", &sets)), &mut |engine, _| match engine.step() {
            step if step == last => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        });
        assert_eq!(before.reason, StopReason::Interrupted, "{sets:?}");
        let [found, expected] = [&diverged, &before].map(end);
        assert!(found == expected, "{sets:?}\n{found}\n{expected}");
    };
    of(&[left, &thrown, ghosts], &[&fracture("none")]);
    of(&[left, &pull("0.01"), &thrown], &material);
    let bend = "stop.divergence_ratio=0.2";
    for ghosts in ["none", "lattice", "mirrored"] {
        of(&[left, &torn], &[&fracture(ghosts), bend]);
    }
    of(&[left, &pull("0.6"), taken], &[bend]);
    of(&[left, &pull("0.6")], &["update.order=\"sequential\"", bend]);
    of(&[left, &pull("0.6")], &["neighbours={kind=\"dynamic\",radius=1.1}", bend]);
}

#[test]
fn a_load_that_grows_goes_on_growing() {
    let growing = [
        "frame=none",
        "neighbours={kind=\"cells\"}",
        "material={kind=\"isotropic\",young=1000.0,poisson=0.33}",
        "rule={mean={kind=\"material\"}}",
        "roles=[{region={kind=\"edge\",side=\"left\"},role=\"clamped\"}]",
        "loads=[{kind=\"body\",force=[0.0,-1.0]}]",
        "record={}",
        "stop.steps=60",
        "load_steps={ramp={steps=40}}",
    ];
    continues_to_the_same_end("tension", &growing, &[0, 1, 39, 40, 60]);
}

#[test]
fn broken_bonds_and_ghosts_come_back() {
    continues_to_the_same_end("fracture", &[], &[0, 60, 100, 140]);
}

#[test]
fn neighbours_found_anew_at_every_step_are_found_again() {
    continues_to_the_same_end("drop", &["stop.steps=40"], &[0, 1, 20, 40]);
}

#[test]
fn a_run_that_had_come_to_rest_takes_no_further_step() {
    let scene = scene("tension", &["stop.tolerance=1e-3", "stop.steps=20000"]);
    let whole = run(plan(&scene), &mut |_, _| ControlFlow::Continue(()));
    assert_eq!(whole.reason, StopReason::Equilibrium);
    let state = EngineState::of(&whole.engine);
    let resumed = resumed(plan(&scene), (state, whole.residual), &mut |_, _| ControlFlow::Continue(()));
    assert!(bits(&resumed) == bits(&whole));
}

#[test]
fn a_state_of_another_body_is_refused() {
    let engine = Engine::new(plan(&scene("tension", &[])).setup);
    let error =
        EngineState::of(&engine).engine(plan(&scene("fracture", &[])).setup).expect_err("another body");
    assert!(error.to_string().contains("144 particles"), "{error}");
}

#[test]
fn a_state_with_a_role_added_by_hand_asks_for_it_and_goes_on_in_a_plan_that_has_it() {
    use crate::engine::setup::RoleChange;
    use crate::flock::condition::{Condition, Quantity};
    use crate::flock::motion::{Interpolation, Keyframe, Motion};
    use crate::flock::role::Role;
    let scene = scene("tension", &[]);
    let condition = Some(Condition { quantity: Quantity::X, above: Some(-100.0), below: None });
    for (when, leads) in [(None, true), (condition, true), (None, false)] {
        let mut engine = Engine::new(plan(&scene).setup);
        let particle = engine.roles().iter().position(|&role| role == Role::Follower).expect("a follower");
        let frames = vec![Keyframe { step: 9.0, displacement: [1.0, 0.0] }];
        let motion = leads.then_some(Motion::Keyframes { frames, interpolation: Interpolation::Linear });
        let added = RoleChange { when, motion, ..RoleChange::new(vec![particle], Role::Leader, 2) };
        engine.add_role_change(added.clone());
        (0..4).for_each(|_| engine.advance());
        let error = through_bytes(&engine).engine(plan(&scene).setup).expect_err("it lacks the change");
        assert!(error.to_string().contains("added by hand"), "{error}");
        let mut setup = plan(&scene).setup;
        setup.changes.push(added);
        let mut again = through_bytes(&engine).engine(setup).expect("it has the change");
        for engine in [&mut engine, &mut again] {
            (0..9).for_each(|_| engine.advance());
        }
        assert_eq!(EngineState::of(&again), EngineState::of(&engine));
    }
}

#[test]
fn the_digest_distinguishes_plans_by_what_a_run_depends_on() {
    let of = |sets: &[&str]| digest(&plan(&scene("tension", sets)));
    let plain = of(&[]);
    assert_eq!(plain, of(&["title=another", "record.figures=[3]"]));
    let others =
        ["lattice.spacing=2", "stop.steps=9", "roles[1].motion.per_step=[0.6, 1e-9]", "update.damping=0.9"];
    for other in others {
        assert_ne!(plain, of(&[other]), "{other}");
    }
}

/// Neither is a term of the rule that cannot grow.
#[test]
fn a_rule_is_not_blamed_for_a_leader_that_leaves_the_body_behind() {
    for rule in [
        "rule.feedback={factor=-0.05}",
        "rule.feedback={factor=-0.1,reference=\"previous\"}",
        "rule.mean={kind=\"distance\",power=-1.0}",
        "rule.mean={kind=\"distance\",power=1.0}",
        "rule.poisson={k=0.0}",
        "rule.poisson={k=-0.3}",
    ] {
        let scene = scene("tension", &["stop.divergence_ratio=0.01", rule]);
        let outcome = run(plan(&scene), &mut |_, _| ControlFlow::Continue(()));
        let StopReason::Diverged(divergence) = outcome.reason else { panic!("{rule}: {:?}", outcome.reason) };
        assert!(
            divergence.likely_cause.starts_with("a leader leaves the body behind"),
            "{rule}: {divergence:?}"
        );
    }
}

/// A run that a leader has torn apart says it of any rule; here each rule is asked for itself.
#[test]
fn a_sweep_is_said_to_grow_by_those_terms_alone_that_make_one_grow() {
    let cause = |sets: &[&str]| {
        let sets = [&["stop.steps=1", "update.damping=1.0"], sets].concat();
        let outcome = run(plan(&scene("tension", &sets)), &mut |_, _| ControlFlow::Continue(()));
        cause_in_sweep(&outcome.engine)
    };
    let unframed = cause(&["rule.feedback={factor=0.5}", "frame=none", "record.probes=[]"]);
    assert!(unframed.as_ref().is_some_and(|cause| cause.contains("spectral radius")), "{unframed:?}");
    for (rule, word) in [
        ("rule.feedback={factor=-0.05}", None),
        // A frame takes no feedback.
        ("rule.feedback={factor=0.5}", Some("flockform stability")),
        ("rule.feedback={factor=-0.1,reference=\"previous\"}", None),
        ("rule.feedback={factor=0.5,reference=\"previous\"}", Some("between -1 and 0")),
        ("rule.feedback={factor=-1.5,reference=\"previous\"}", Some("between -1 and 0")),
        ("rule.mean={kind=\"distance\",power=-1.0}", None),
        ("rule.mean={kind=\"distance\",power=1.0}", Some("grow with distance")),
        ("rule.poisson={k=0.0}", None),
        ("rule.poisson={k=-0.3}", Some("smaller K")),
        ("rule.weights={kind=\"list\",values=[1,2,1,2]}", None),
        ("rule.weights={kind=\"list\",values=[1,-0.5,1,1]}", Some("both signs")),
    ] {
        let cause = cause(&[rule]);
        let is_as_expected = match (&cause, word) {
            (Some(cause), Some(word)) => cause.contains(word),
            (cause, word) => cause.is_some() == word.is_some(),
        };
        assert!(is_as_expected, "{rule}: {cause:?}");
    }
}
