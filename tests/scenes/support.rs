//! Scenes that are run to their end.

use std::ops::ControlFlow;

use flockform::continuum::run::{Outcome, run};
use flockform::engine::Engine;
use flockform::scene::Scene;

pub use crate::folders::temporary;
pub use crate::scenes::{load, planned};

pub fn outcome(name: &str, overrides: &[&str]) -> Outcome {
    watched(name, overrides, |_| {})
}

pub fn watched(name: &str, overrides: &[&str], mut watch: impl FnMut(&Engine)) -> Outcome {
    let mut looks = 0;
    let outcome = run(planned(&load(name, overrides)), &mut |engine, _| {
        watch(engine);
        looks += 1;
        ControlFlow::Continue(())
    });
    assert!(looks >= outcome.engine.step().max(1), "every step is looked at: {looks}");
    outcome
}

pub fn displacement(engine: &Engine, id: usize) -> [f64; 2] {
    let (now, then) = (engine.present().get(id - 1), engine.body().reference.get(id - 1));
    [now[0] - then[0], now[1] - then[1]]
}

/// A grid on a square lattice of spacing 1, its left side clamped and its right one led, with more keys; each with a `;` a line.
pub fn pulled(size: [usize; 2], per_step: f64, more: &str) -> Scene {
    let [columns, rows] = size;
    let text = format!(
        "title = 'pulled'; lattice = {{ kind = 'square', spacing = 1.0 }}
         body = {{ shape = {{ kind = 'grid', columns = {columns}, rows = {rows} }} }}
         [[roles]]; region = {{ kind = 'edge', side = 'left' }}; role = 'clamped'
         [[roles]]; region = {{ kind = 'edge', side = 'right' }}; role = 'leader'
         motion = {{ kind = 'velocity', per_step = [{per_step}, 0.0] }}
         {more}"
    );
    parsed(&text.replace(';', "\n"))
}

pub fn parsed(text: &str) -> Scene {
    Scene::parse("scene", "scene.toml", text, &[], None).unwrap_or_else(|error| panic!("{error}"))
}

pub fn run_out(scene: &Scene) -> Outcome {
    run(planned(scene), &mut |_, _| ControlFlow::Continue(()))
}

pub const RIGHT: &str = "[[roles]]; region = { kind = 'edge', side = 'right' };";

/// The lowest row and its particles' neighbours below zero.
pub fn negative(world: &str) -> String {
    format!(
        "title = 'negative'\nlattice = {{ kind = 'square', spacing = 1.0 }}\n\
         body = {{ shape = {{ kind = 'grid', columns = 4, rows = 3 }}, anchor = [1.0, -0.5] }}\n\
         roles = [\n{{ region = {{ kind = 'edge', side = 'left' }}, role = 'clamped' }},\n\
         {{ region = {{ kind = 'edge', side = 'right' }}, role = 'leader', \
         motion = {{ kind = 'velocity', per_step = [0.1, 0.0] }} }}]\nstop.steps = 4\n{}",
        world.replace(';', "\n")
    )
}
