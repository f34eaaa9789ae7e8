//! An arch under more than it bears: no equilibrium that it grows into, but one on the other side, which Newton's method finds.

use std::f64::consts::PI;
use std::ops::ControlFlow;

use flockform::continuum::equilibrium::run_to_equilibrium;
use flockform::continuum::plan::Plan;
use flockform::scene::Scene;

/// Where an arch of this rise, clamped at both ends under a pressure on all of it, comes to rest: how far its crown has gone
/// down, or what is said instead. The pressure is a little more on one side than on the other.
fn pressed(pressure: f64, parts: &str) -> Result<f64, String> {
    let (angle, radius, thickness) = (12.0 * PI / 180.0, 80.0, 0.4);
    let at = |r: f64, side: f64| [side * r * angle.sin(), r * angle.cos()];
    let (outer, inner) = (radius + thickness / 2.0, radius - thickness / 2.0);
    let text = format!(
        "title = \"arch\"\n\
         lattice = {{ kind = \"square\", spacing = 0.2 }}\n\
         body = {{ shape = {{ kind = \"path\", from = {:?}, steps = [{{ to = {:?} }}, \
         {{ to = {:?}, centre = [0.0, 0.0] }}, {{ to = {:?} }}, {{ to = {:?}, centre = [0.0, 0.0], clockwise = true }}] }} }}\n\
         material = {{ kind = \"isotropic\", young = 1000.0, poisson = 0.0 }}\n\
         rule = {{ mean = {{ kind = \"material\", rotation = \"corotated\" }} }}\n\
         roles = [{{ region = {{ kind = \"outline\", pieces = [1] }}, role = \"clamped\" }}, \
         {{ region = {{ kind = \"outline\", pieces = [3] }}, role = \"clamped\" }}]\n\
         loads = [{{ kind = \"traction\", region = {{ kind = \"outline\", pieces = [2] }}, traction = [0.0, {:?}], \
         profile = {{ from = [-16.0, 0.0], to = [16.0, 0.0], factors = [0.98, 1.02] }} }}]\n\
         equilibrium = {{ }}\n{parts}\n",
        at(inner, 1.0),
        at(outer, 1.0),
        at(outer, -1.0),
        at(inner, -1.0),
        at(inner, 1.0),
        -pressure
    );
    let scene = Scene::parse("arch", "arch.toml", &text, &[], None).unwrap_or_else(|error| panic!("{error}"));
    let plan = Plan::new(&scene).unwrap_or_else(|error| panic!("{error}"));
    let outcome = run_to_equilibrium(&scene, plan, &mut |_, _| ControlFlow::Continue(()));
    let outcome = outcome.map_err(|error| error.to_string())?;
    let solved = outcome.solved.expect("solved");
    Ok(-solved.displacement.iter().map(|u| u[1]).fold(0.0, f64::min))
}

/// The part of the way that a refusal names \[1\].
fn part_in(said: &str) -> f64 {
    let after = said.split("beyond ").nth(1).and_then(|rest| rest.split(" %").next());
    after.and_then(|part| part.parse::<f64>().ok()).unwrap_or_else(|| panic!("{said}")) / 100.0
}

#[test]
fn an_arch_bears_the_same_load_however_much_is_asked_of_it() {
    let bends = pressed(0.002, "").expect("borne");
    assert!(bends < 0.2, "{bends}");
    let limits: Vec<f64> = [0.01, 0.02, 0.04, 0.1]
        .map(|pressure| pressure * part_in(&pressed(pressure, "").expect_err("more than it bears")))
        .to_vec();
    let limit = limits[0];
    // As exactly as the least part of the way.
    assert!(limits.iter().all(|other| (other - limit).abs() < 0.02 * limit), "{limits:?}");
    assert!(pressed(0.95 * limit, "").is_ok(), "{limit}");
}
