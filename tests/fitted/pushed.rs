//! Stress where forces act on single particles, after a material has changed, and before anything has moved.

use std::ops::ControlFlow;

use flockform::continuum::equilibrium::run_to_equilibrium_watched;
use flockform::continuum::mechanics::{Mechanics, Stresses};
use flockform::continuum::plan::Plan;
use flockform::continuum::record::LoadStep;
use flockform::engine::Engine;
use flockform::engine::observer::EachStep;
use flockform::flock::vectors::Vectors;
use flockform::scene::Scene;

use crate::support::{lattice, scene, solved};

const BAR: &str = "body = { shape = { kind = \"rectangle\", max = [8.0, 4.0] } }";
const CLAMP: &str =
    "roles = [{ region = { kind = \"edge\", side = \"left\" }, axis = \"x\", role = \"clamped\" },
    { region = { kind = \"ids\", ids = [1] }, role = \"clamped\" }]";

/// Consistent nodal forces of a uniform traction: what they make of the body is exact.
#[test]
fn a_bar_pulled_by_forces_on_its_particles_has_the_same_stress_everywhere() {
    let force = |low: f64, high: f64, pull: f64| {
        format!(
            "{{ kind = \"force\", region = {{ kind = \"box\", min = [7.9, {low}], max = [8.1, {high}] }}, force = [{pull}, 0.0] }}"
        )
    };
    let loads = [force(-0.1, 0.1, 5.0), force(0.9, 3.1, 10.0), force(3.9, 4.1, 5.0)].join(", ");
    let material = "material = { kind = \"isotropic\", young = 1000.0, poisson = 0.3 }";
    let parts = format!("{material}\n{BAR}\n{CLAMP}\nloads = [{loads}]");
    let scene = scene(&lattice("square", 1.0, 0.0), &parts).unwrap_or_else(|error| panic!("{error}"));
    let (plan, outcome) = solved(&scene);
    let stresses = Stresses::at_present(&outcome.engine).expect("has cells");
    for (i, stress) in stresses.particles.iter().enumerate() {
        let [xx, yy, xy] = stress.as_ref().expect("in a cell").components;
        let place = plan.setup.body.reference.get(i);
        assert!((xx - 10.0).abs() < 1e-6 && yy.abs() < 1e-6 && xy.abs() < 1e-6, "{place:?}: {xx} {yy} {xy}");
    }
}

/// Stress jumps across a line of forces, and no field is to be fitted across it.
#[test]
fn beside_lines_of_forces_the_edges_have_the_stress_of_their_own_part() {
    let line = |x: f64, [low, high]: [f64; 2], pull: f64| {
        let (left, right) = (x - 0.1, x + 0.1);
        format!(
            "{{ kind = \"force\", region = {{ kind = \"box\", min = [{left}, {low}], max = [{right}, {high}] }}, force = [{pull}, 0.0] }}"
        )
    };
    let lines = [10.0, 20.0]
        .map(|x| [line(x, [-0.1, 0.1], 0.5), line(x, [0.9, 5.1], 1.0), line(x, [5.9, 6.1], 0.5)].join(", "));
    let traction =
        "{ kind = \"traction\", region = { kind = \"edge\", side = \"right\" }, traction = [1.0, 0.0] }";
    let parts = format!(
        "material = {{ kind = \"isotropic\", young = 1000.0, poisson = 0.0 }}\n\
         body = {{ shape = {{ kind = \"rectangle\", max = [30.0, 6.0] }} }}\n{CLAMP}\nloads = [{traction}, {}]",
        lines.join(", ")
    );
    let scene = scene(&lattice("square", 1.0, 0.0), &parts).unwrap_or_else(|error| panic!("{error}"));
    let (plan, outcome) = solved(&scene);
    let stresses = Stresses::at_present(&outcome.engine).expect("has cells");
    for (i, stress) in stresses.particles.iter().enumerate() {
        let [xx, yy, xy] = stress.as_ref().expect("in a cell").components;
        let [x, y] = plan.setup.body.reference.get(i);
        // On a line it is that between both sides.
        let expected =
            [10.0, 20.0].iter().map(|line| (line - x).signum() * f64::from(u8::from(line - x != 0.0)));
        let expected = 2.0 + 0.5 * expected.sum::<f64>();
        let apart = (xx - expected).abs().max(yy.abs()).max(xy.abs());
        assert!(apart < 1e-6, "({x}, {y}): {xx} {yy} {xy} and not {expected}");
    }
}

/// A stepped bar under a traction of 1.
fn stepped(actions: &str, poisson: f64) -> Scene {
    let text = format!(
        "title = \"test\"\nstop = {{ steps = 20000, tolerance = 1e-12 }}\nrule = {{ mean = {{ kind = \"material\" }} }}\n\
         {}\nmaterial = {{ kind = \"isotropic\", young = 1000.0, poisson = {poisson} }}\n{BAR}\n\
         roles = [{{ region = {{ kind = \"edge\", side = \"left\" }}, role = \"clamped\" }}]\n\
         loads = [{{ kind = \"traction\", region = {{ kind = \"edge\", side = \"right\" }}, traction = [1.0, 0.0] }}]\n\
         actions = [{actions}]\nload_steps = {{ every = 1000 }}",
        lattice("square", 1.0, 0.0)
    );
    Scene::parse("test", "test.toml", &text, &[], None).unwrap_or_else(|error| panic!("{error}"))
}

fn engine(scene: &Scene) -> Engine {
    Engine::new(Plan::new(scene).unwrap_or_else(|error| panic!("{error}")).setup)
}

fn highest(engine: &Engine) -> f64 {
    Mechanics::of(engine).and_then(|all| all.largest_von_mises).expect("has cells").von_mises
}

#[test]
fn stress_is_that_of_the_material_as_an_action_leaves_it() {
    let set = |key: &str| format!("{{ at = 10, what = {{ kind = \"set\", keys = [\"{key}\"] }} }}");
    for (key, poisson) in [("material.young=2000.0", 0.3), ("material.poisson=0.0", 0.0)] {
        let mut changed = engine(&stepped(&set(key), 0.3));
        let mut fresh = engine(&stepped("", poisson));
        let mut before = None;
        for step in 1..=8000 {
            changed.advance();
            fresh.advance();
            if step == 5 {
                before = Some((changed.displacements(), Stresses::at_present(&changed).expect("has cells")));
            }
        }
        let (found, wanted) = (highest(&changed), highest(&fresh));
        assert!((found / wanted - 1.0).abs() < 1e-6, "{key}: {found}, afresh {wanted}");
        // A picture of an earlier step is one of the material as it was then.
        let (displacement, then) = before.expect("stepped");
        let pictured = Stresses::of(&changed, 5, &displacement, &[]).expect("has cells");
        assert_eq!(pictured.cells, then.cells, "{key}");
    }
}

/// What stress at a step was found to be then, and is once the run has ended.
fn require_the_same_afterwards(what: &str, seen: &[(usize, Vectors, Stresses)], end: &Engine) {
    assert!(seen.len() > 1, "{what}");
    for (step, displacement, then) in seen {
        let pictured = Stresses::of(end, *step, displacement, &[]).expect("has cells");
        assert_eq!(pictured.recovered, then.recovered, "{what}, step {step}");
        assert_eq!(
            (pictured.cells, pictured.particles),
            (then.cells.clone(), then.particles.clone()),
            "{what}, step {step}"
        );
    }
}

fn see(engine: &Engine) -> (usize, Vectors, Stresses) {
    (engine.step(), engine.displacements(), Stresses::at_present(engine).expect("has cells"))
}

/// Along the edges it is found by what pulls there, of which there may be more or less later.
#[test]
fn a_picture_of_an_earlier_step_is_one_of_what_acted_then() {
    let set = |key: &str| format!("{{ at = 10, what = {{ kind = \"set\", keys = [\"{key}\"] }} }}");
    let cases = [
        set("loads[0].traction=[0.25, 0.5]"),
        set("rule.mean.rotation=corotated"),
        set("material.young=2000.0"),
        String::new(),
    ];
    for actions in cases {
        let mut scene = stepped(&actions, 0.3);
        if actions.is_empty() {
            let ramp = scene.with(&["load_steps.ramp={steps=15}".to_owned()], None);
            scene = ramp.unwrap_or_else(|error| panic!("{error}"));
        }
        let mut engine = engine(&scene);
        let mut seen = vec![see(&engine)];
        for step in 1..=20 {
            engine.advance();
            if [5, 9, 10, 20].contains(&step) {
                seen.push(see(&engine));
            }
        }
        assert_ne!(seen[1].2.particles, seen[4].2.particles, "{actions}");
        require_the_same_afterwards(&actions, &seen, &engine);
    }
}

#[test]
fn a_picture_of_an_increment_is_one_of_its_part_of_the_load() {
    let material = "material = { kind = \"isotropic\", young = 1000.0, poisson = 0.3 }";
    let pull =
        "{ kind = \"traction\", region = { kind = \"edge\", side = \"right\" }, traction = [1.0, 0.0] }";
    let parts = format!(
        "{material}\n{BAR}\n{CLAMP}\nloads = [{pull}]\nload_steps = {{ schedule = [0.25, 1.0, 0.0] }}"
    );
    let scene = scene(&lattice("square", 1.0, 0.0), &parts).unwrap_or_else(|error| panic!("{error}"));
    let plan = Plan::new(&scene).unwrap_or_else(|error| panic!("{error}"));
    let mut seen = Vec::new();
    let mut each = |engine: &Engine, _: f64| {
        seen.push(see(engine));
        ControlFlow::Continue(())
    };
    let outcome = run_to_equilibrium_watched(&scene, plan, &mut EachStep(&mut each))
        .unwrap_or_else(|error| panic!("{error}"));
    require_the_same_afterwards("increments", &seen, &outcome.engine);
    for (step, part) in [(0, 0.0), (1, 0.25), (2, 1.0), (3, 0.0)] {
        // A bar that is pulled has the same stress everywhere.
        let all = seen[step].2.particles.iter().flatten();
        assert!(all.into_iter().all(|stress| (stress.components[0] - part).abs() < 1e-6), "increment {step}");
    }
}

#[test]
fn a_body_that_has_not_moved_bears_nothing() {
    let row = LoadStep::of(&engine(&stepped("", 0.3))).expect("has cells");
    assert_eq!(row.mechanics.largest_von_mises.expect("has cells").von_mises, 0.0);
}
