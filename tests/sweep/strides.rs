//! Runs that are looked at now and then end with the bits of those that are looked at after every step.

use std::ops::ControlFlow;

use flockform::continuum::report::PlanReport;
use flockform::continuum::run::{Outcome, run, run_watched};
use flockform::engine::Engine;
use flockform::engine::observer::Observer;
use flockform::scene::Scene;

use crate::scenes::{load, planned};

/// Looks at the steps that a function names, and remembers them.
struct Looks<'a> {
    next: &'a dyn Fn(usize) -> usize,
    at: Vec<usize>,
}

impl Observer for Looks<'_> {
    fn next(&mut self, step: usize) -> usize {
        (self.next)(step)
    }

    fn see(&mut self, engine: &Engine, _: f64) -> ControlFlow<()> {
        self.at.push(engine.step());
        ControlFlow::Continue(())
    }
}

fn watched(scene: &Scene, next: &dyn Fn(usize) -> usize) -> (Outcome, Vec<usize>) {
    let mut looks = Looks { next, at: Vec::new() };
    let outcome = run_watched(planned(scene), &mut looks);
    (outcome, looks.at)
}

fn bits(outcome: &Outcome) -> Vec<u64> {
    let engine = &outcome.engine;
    let all = [engine.present(), engine.previous()];
    all.iter().flat_map(|points| points.x.iter().chain(&points.y)).map(|value| value.to_bits()).collect()
}

fn assert_same(scene: &Scene, next: &dyn Fn(usize) -> usize, what: &str) -> (Outcome, Vec<usize>) {
    let every = run(planned(scene), &mut |_, _| ControlFlow::Continue(()));
    let (some, looks) = watched(scene, next);
    assert_eq!(some.engine.step(), every.engine.step(), "{what}");
    assert_eq!(some.reason, every.reason, "{what}");
    assert_eq!(some.residual.to_bits(), every.residual.to_bits(), "{what}");
    assert!(bits(&some) == bits(&every), "{what}");
    (some, looks)
}

#[test]
fn every_lattice_settles_at_the_same_step_with_the_same_bits() {
    for lattice in ["square", "rectangular", "centred-rectangular", "hexagonal", "oblique", "honeycomb"] {
        let scene = load(&format!("lattice-{lattice}"), &[]);
        let (outcome, looks) = assert_same(&scene, &|_| usize::MAX, lattice);
        assert!(outcome.engine.step() > 100, "{lattice}");
        // The start, and the step in which it settled.
        assert_eq!(looks, [0, outcome.engine.step()], "{lattice}");
    }
}

#[test]
fn leaders_on_their_way_and_roles_that_change_are_met_at_their_steps() {
    let free = load("tension", &["frame=\"none\"", "record.probes=[]"]);
    let (outcome, looks) = assert_same(&free, &|step| (step / 50 + 1) * 50, "tension without a frame");
    assert_eq!(looks, [0, 50, 100, 150, 200, 250, 300, 350, 400, 401]);
    // Pulled 12 units and let go: nothing would be left to see if the motion had gone on, or not begun.
    let first = outcome.engine.displacement(99);
    assert!(first[0] > 0.01 && first[0] < 6.0, "{first:?}");
    // A frame that looks after the sweep, fracture and terms that look at every step are stepped one at a time.
    for name in ["tension-immediate", "fracture-hexagonal", "feedback-grow"] {
        let scene = load(name, &["stop.steps=60"]);
        // The next look is named from where the last one was, whether or not a step at a time leads there.
        let (_, looks) = assert_same(&scene, &|step| step + 25, name);
        assert_eq!(looks, [0, 25, 50, 60], "{name}");
    }
}

#[test]
fn a_body_that_leaves_its_bounds_is_caught_at_the_same_step() {
    let overrides = ["frame=\"none\"", "stop.divergence_ratio=0.2", "record.probes=[]"];
    let scene = load("tension", &overrides);
    let (outcome, _) = assert_same(&scene, &|_| usize::MAX, "pulled out of its bounds");
    assert_eq!(outcome.reason.name(), "diverged");
    assert_eq!(outcome.engine.step(), 4);
}

#[test]
fn what_is_swept_is_what_moves_and_the_plan_foresees_it() {
    let grid = "body.shape={kind=\"grid\",columns=400,rows=30}";
    let scene =
        load("tension", &["frame=\"none\"", grid, "stop.steps=20", "record.probes=[]", "record.figures=[]"]);
    let (outcome, _) = assert_same(&scene, &|_| usize::MAX, "a long strip");
    let swept = outcome.engine.activity().share_computed();
    // All once, to find out that they stand still; and of 400 columns half of 20 on average, whole bands.
    assert!((0.05..0.15).contains(&swept), "{swept}");
    let plan = planned(&scene);
    let report = PlanReport::new(&scene, &plan).expect("a plan").to_string();
    assert!(report.contains("about 3 % of the updates"), "{report}");
}

#[test]
fn a_frame_that_looks_before_the_sweep_is_taken_along() {
    let scene = load("tension", &["stop.steps=300"]);
    assert_same(&scene, &|_| usize::MAX, "the paper's frame");
    let steps_at_once = |scene: &Scene| Engine::new(planned(scene).setup).steps_at_once(16);
    assert_eq!(steps_at_once(&scene), 16);
    assert_eq!(steps_at_once(&load("tension-immediate", &[])), 0);
}
