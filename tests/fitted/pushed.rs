//! Stress where forces act on single particles, after a material has changed, and before anything has moved.

use flockform::continuum::mechanics::{Mechanics, Stresses};
use flockform::continuum::plan::Plan;
use flockform::continuum::record::LoadStep;
use flockform::engine::Engine;
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

#[test]
fn a_body_that_has_not_moved_bears_nothing() {
    let row = LoadStep::of(&engine(&stepped("", 0.3))).expect("has cells");
    assert_eq!(row.mechanics.largest_von_mises.expect("has cells").von_mises, 0.0);
}
