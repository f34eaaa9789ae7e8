//! What a scene says is what happens: roles, motions, updates, fracture, stopping.

use std::path::Path;

use flockform::continuum::plan::Plan;
use flockform::continuum::report::PlanReport;
use flockform::continuum::run::StopReason;
use flockform::engine::Engine;
use flockform::flock::role::Role;
use flockform::flock::vectors::distance;
use flockform::scene::Scene;
use flockform::scene::swarm::Swarm;

use support::*;

mod cautions;
#[path = "../common/folders.rs"]
mod folders;
mod leaders;
mod lost;
#[path = "../common/scenes.rs"]
mod scenes;
mod support;
mod updates;

#[test]
fn a_radius_that_is_a_spacing_holds_the_nearest_now_as_at_rest() {
    let text = |kind: &str| {
        format!(
            "title = 'radius'\nlattice = {{ kind = 'square', spacing = 0.1 }}\nstop.steps = 1\n\
             body = {{ shape = {{ kind = 'grid', columns = 8, rows = 6 }} }}\n\
             neighbours = {{ kind = '{kind}', radius = 0.1 }}\n\
             roles = [{{ region = {{ kind = 'all' }}, role = 'clamped' }}]"
        )
    };
    let entries = |kind: &str| run_out(&parsed(&text(kind))).engine.flock().neighbours.index.len();
    assert_eq!([entries("within"), entries("dynamic")], [164; 2]);
}

#[test]
fn every_particle_of_a_narrow_body_is_on_its_boundary() {
    for (lattice, size, count) in [
        ("square", [8, 1], 8),
        ("square", [8, 2], 16),
        ("hexagonal", [8, 2], 16),
        ("honeycomb", [8, 2], 11),
        ("square", [8, 3], 18),
    ] {
        let [columns, rows] = size;
        let text = format!(
            "title = 'narrow'\nlattice = {{ kind = '{lattice}', spacing = 1.0 }}\n\
             body = {{ shape = {{ kind = 'grid', columns = {columns}, rows = {rows} }} }}\n\
             roles = [{{ region = {{ kind = 'boundary' }}, role = 'clamped' }}]"
        );
        let roles = planned(&parsed(&text)).setup.roles;
        let clamped = roles.iter().filter(|role| **role == Role::Clamped).count();
        assert_eq!(clamped, count, "{lattice} {size:?}");
    }
}

#[test]
fn without_anything_to_do_the_body_rests_at_once() {
    let outcome = outcome("shear", &["roles=[]", "stop={steps=100,tolerance=1e-12}"]);
    assert_eq!((outcome.reason, outcome.engine.step()), (StopReason::Equilibrium, 1));
}

#[test]
fn a_literal_barycentre_without_a_frame_draws_the_body_together_and_the_rest_offset_does_not() {
    let shrinks = |rest: &str| {
        let outcome = outcome("shear", &["roles=[]", "stop={steps=50}", rest]);
        let (low, high) = outcome.engine.present().bounds(0..400).expect("has particles");
        high[0] - low[0]
    };
    assert_eq!(shrinks("rule.rest=balanced"), 19.0);
    assert!(shrinks("rule.rest=literal") < 15.0);
}

#[test]
fn pseudo_energies_are_those_of_the_formulas() {
    let outcome = outcome("tension", &["stop.steps=1"]);
    let engine = &outcome.engine;
    assert_eq!(engine.step(), 1);
    // Particle 127's left neighbour has not moved; the frame point right of it lags too.
    assert!((engine.pe1(126) - (0.6 * 0.6 + 0.6 * 0.6) - expected_above_and_below(engine)).abs() < 1e-12);
    assert!((engine.pe2(126) - 0.6).abs() < 1e-12);
    assert_eq!(engine.pe2(13), 0.0);
}

/// Share of particle 127's PE1 from the bonds to the leaders above and below, which move with it.
fn expected_above_and_below(engine: &Engine) -> f64 {
    let here = engine.present().get(126);
    [125, 127].into_iter().map(|k| (distance(here, engine.present().get(k)) - 1.0).powi(2)).sum()
}

#[test]
fn a_plan_counts_what_it_says() {
    let scene = load("tension", &[]);
    let report = PlanReport::new(&scene, &planned(&scene)).expect("plans").to_string();
    for words in
        ["144 (80 follower, 10 leader, 10 clamped, 44 frame)", "lagged frame of 44 points", "401 steps"]
    {
        assert!(report.contains(words), "no `{words}` in\n{report}");
    }
}

#[test]
fn a_specimen_has_the_standard_s_outline_on_every_lattice() {
    for lattice in ["square", "hexagonal", "honeycomb"] {
        for shape in ["e8-sheet", "d638-type-i"] {
            let body = format!("body={{shape={{kind=\"{shape}\"}}}}");
            let plan = planned(&load(&format!("lattice-{lattice}"), &[&body]));
            let width = |low: f64, high: f64| {
                let reference = &plan.setup.body.reference;
                let band = (0..plan.count()).filter(|&i| (low..high).contains(&reference.y[i]));
                let (min, max) = reference.bounds(band).expect("not empty");
                max[0] - min[0]
            };
            let (overall, gauge, grip) =
                if shape == "e8-sheet" { (200.0, 12.5, 20.0) } else { (165.0, 13.0, 19.0) };
            let near = |value: f64, expected: f64| value <= expected && value > expected - 2.0;
            assert!(
                near(width(overall / 2.0 - 20.0, overall / 2.0 + 20.0), gauge),
                "{lattice} {shape} gauge"
            );
            assert!(near(width(0.0, 20.0), grip), "{lattice} {shape} grip");
        }
    }
}

/// The TOML blocks of a document.
fn toml_blocks(document: &str) -> impl Iterator<Item = &str> {
    document.split("\n```toml\n").skip(1).map(|rest| rest.split("\n```").next().expect("a block"))
}

#[test]
fn every_toml_block_of_readme_and_guides_is_a_scene_or_a_swarm() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let guides = std::fs::read_dir(root.join("src/guide")).expect("guides");
    let guides = guides.map(|entry| entry.expect("readable").path());
    let folder = temporary();
    let cloud: String = (0..64).map(|k| format!("{},{}\n", k / 8, k % 8)).collect();
    std::fs::write(folder.path().join("cloud.csv"), format!("x,y\n{cloud}")).expect("written");
    let (mut scenes, mut swarms) = (0, 0);
    for path in guides.chain([root.join("README.md")]) {
        let (file, document) =
            (path.display().to_string(), std::fs::read_to_string(&path).expect("readable"));
        for text in toml_blocks(&document) {
            let outcome = if text.contains("\n[flight") {
                swarms += 1;
                Swarm::parse("guide", &file, text, &[], Some(folder.path())).map(|_| ())
            } else {
                scenes += 1;
                let scene = Scene::parse("guide", &file, text, &[], Some(folder.path()));
                scene.and_then(|scene| Plan::new(&scene)).map(|_| ())
            };
            outcome.unwrap_or_else(|error| panic!("{file}: {error}\nin\n{text}"));
        }
    }
    assert!(scenes >= 7 && swarms >= 2, "{scenes} scenes, {swarms} swarms");
}
