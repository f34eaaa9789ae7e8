//! Leaders, motions and conditions.

use std::ops::ControlFlow;

use flockform::continuum::equilibrium::run_to_equilibrium;
use flockform::continuum::run::{StopReason, run};
use flockform::flock::role::Role;
use flockform::flock::vectors::distance;
use flockform::scene::{Scene, bundled};

use crate::support::*;

#[test]
fn leaders_move_while_they_lead_and_the_clamped_never_do() {
    // Particle 127 is a leader in column 11, 14 is clamped in column 2.
    watched("tension", &["stop.steps=30"], |engine| {
        let step = engine.step();
        assert_eq!(displacement(engine, 14), [0.0, 0.0]);
        if step <= 20 {
            let [dx, _] = displacement(engine, 127);
            assert!((dx - 0.6 * step as f64).abs() < 1e-12, "step {step}: {dx}");
        }
        assert_eq!(
            engine.roles()[126],
            if step <= 20 { Role::Leader } else { Role::Follower },
            "step {step}"
        );
    });
}

#[test]
fn a_role_can_be_taken_by_rule_particle_by_particle() {
    // What has moved 1.5 is clamped there and then.
    let when = r#"roles[2]={region={kind="all"},role="clamped",when={quantity="displacement",above=1.5}}"#;
    let mut held: Vec<Option<[f64; 2]>> = vec![None; 144];
    let outcome = watched("tension", &[when, "stop.steps=60"], |engine| {
        for (i, held) in held.iter_mut().enumerate() {
            if let Some(place) = held {
                assert_eq!(engine.present().get(i), *place, "particle {} moved on", i + 1);
            }
            let was_clamped = engine.body().sites[i][0] == engine.body().sites[13][0];
            if engine.roles()[i] == Role::Clamped && !was_clamped && held.is_none() {
                *held = Some(engine.present().get(i));
            }
        }
    });
    let clamped = held.iter().flatten().count();
    assert!(clamped >= 10, "{clamped} were clamped");
    // The leaders were, at the first step after they had passed 1.5: the third moved them to 1.8.
    let [dx, _] = displacement(&outcome.engine, 127);
    assert!((dx - 1.8).abs() < 1e-12, "{dx}");
}

#[test]
fn a_leader_turns_to_another_motion_on_a_condition() {
    let turn = "role = 'leader'; motion = { kind = 'velocity', per_step = [0.0, 0.1] }";
    let more = format!("{RIGHT} {turn}; when = {{ quantity = 'x', above = 3.95 }}; [stop]; steps = 30");
    let outcome = run_out(&pulled([4, 3], 0.1, &more));
    let [x, y] = outcome.engine.present().get(11);
    assert!((x - 4.0).abs() < 1e-12 && (y - 4.0).abs() < 1e-12, "{x} {y}");
}

#[test]
fn a_condition_takes_no_particle_from_a_later_entry() {
    let hold = "role = 'clamped'; when = { quantity = 'displacement', above = 0.5 }";
    let more = format!("{RIGHT} {hold}; {RIGHT} role = 'follower'; from = 30; [stop]; steps = 31");
    let outcome = run_out(&pulled([4, 3], 0.1, &more));
    assert!(outcome.engine.roles()[9..].iter().all(|role| *role == Role::Follower));
}

#[test]
fn rest_is_no_equilibrium_before_the_step_of_a_condition() {
    let led = "role = 'leader'; motion = { kind = 'keyframes', frames = [{ step = 1, displacement = [1.0, 0.0] }] }";
    let freed = "role = 'follower'; from = 100; when = { quantity = 'displacement', above = 0.5 }";
    let more = format!("{RIGHT} {led}; {RIGHT} {freed}; [stop]; steps = 2000; tolerance = 1e-3");
    let outcome = run_out(&pulled([9, 2], 0.0, &more));
    assert_eq!(outcome.reason, StopReason::Equilibrium);
    assert!(outcome.engine.step() > 100 && outcome.engine.step() < 2000, "step {}", outcome.engine.step());
    assert_eq!(outcome.engine.roles()[17], Role::Follower);
}

#[test]
fn a_motion_that_ends_at_the_last_step_there_is_goes_on() {
    let last = format!(
        "motion = {{ kind = 'keyframes', frames = [{{ step = {}, displacement = [0.1, 0.0] }}] }}",
        u64::MAX
    );
    let more = format!("{RIGHT} role = 'leader'; from = 5; {last}; [stop]; steps = 30; tolerance = 1e-6");
    assert_eq!(run_out(&pulled([4, 3], 0.0, &more)).engine.step(), 30);
}

/// The later entry wins, though one of a single component leaves alone what an earlier one holds altogether: stepped or solved.
#[test]
fn components_that_entries_share_are_led_as_a_solver_has_them() {
    let edge = |side: &str, role: &str| {
        format!("{{ region = {{ kind = \"edge\", side = \"{side}\" }}, role = {role} }}")
    };
    let led = |axis: &str, by: &str| {
        format!(
            "\"leader\"{axis}, motion = {{ kind = \"keyframes\", frames = [{{ step = 5, displacement = {by} }}] }}"
        )
    };
    let up = edge("bottom", &led(", axis = \"y\"", "[0.0, 0.01]"));
    let right = "{ region = { kind = \"box\", min = [1.5, -0.1], max = [3.1, 0.1] }, role = \"clamped\", axis = \"y\" }";
    let held = edge("left", "\"clamped\"");
    for roles in [
        [held.clone(), up.clone()].join(", "),
        [up.clone(), held.clone()].join(", "),
        [held.clone(), up.clone(), right.to_owned()].join(", "),
        [edge("left", &led("", "[0.02, 0.0]")), edge("right", "\"clamped\""), up].join(", "),
    ] {
        let places = |more: &str| {
            let text = format!(
                "title = \"shared\"\nlattice = {{ kind = \"square\", spacing = 1.0 }}\n\
                 body = {{ shape = {{ kind = \"rectangle\", max = [3.0, 2.0] }} }}\nstop = {{ steps = 2000, tolerance = 1e-13 }}\n\
                 material = {{ kind = \"isotropic\", young = 1.0, poisson = 0.3 }}\nrule = {{ mean = {{ kind = \"material\" }} }}\n\
                 roles = [{roles}]\n{more}"
            );
            let scene = Scene::parse("shared", "shared.toml", &text, &[], None)
                .unwrap_or_else(|error| panic!("{error}"));
            let outcome = run_to_equilibrium(&scene, planned(&scene), &mut |_, _| ControlFlow::Continue(()))
                .unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(outcome.reason, StopReason::Equilibrium, "{roles}");
            outcome.engine.present().clone()
        };
        let (stepped, solved) = (places(""), places("equilibrium = {}\n"));
        let apart = stepped.iter().zip(solved.iter()).map(|(a, b)| distance(a, b)).fold(0.0, f64::max);
        assert!(apart < 1e-10, "{roles}: {apart}");
    }
}

#[test]
fn a_new_motion_starts_from_where_the_leader_stands() {
    let second = r#"roles[2]={from=11,region={kind="edge",side="right"},role="leader",motion={kind="keyframes",frames=[{step=5,displacement=[0.0,2.0]}]}}"#;
    let outcome = outcome("tension", &[second, "stop.steps=15"]);
    let [dx, dy] = displacement(&outcome.engine, 127);
    assert!((dx - 6.0).abs() < 1e-12 && (dy - 2.0).abs() < 1e-12, "{dx} {dy}");
}

#[test]
fn a_displacement_file_leads_its_particles() {
    let folder = temporary();
    let rows: String = (0..10).map(|row| format!("9,{row},0.5,{}\n", 0.1 * f64::from(row))).collect();
    std::fs::write(folder.path().join("led.csv"), format!("x,y,ux,uy\n{rows}")).expect("written");
    let csv = r#"roles[1].motion={kind="csv",file="led.csv",scale=2.0,steps=4}"#;
    let text = bundled("tension").expect("bundled").text;
    let scene =
        Scene::parse("csv", "csv.toml", text, &[csv.into(), "stop.steps=8".into()], Some(folder.path()));
    let plan = planned(&scene.unwrap_or_else(|error| panic!("{error}")));
    let mut half = [0.0; 2];
    let outcome = run(plan, &mut |engine, _| {
        if engine.step() == 2 {
            half = displacement(engine, 125);
        }
        ControlFlow::Continue(())
    });
    // Particle 125 stands in the fourth row of the body.
    assert!((half[0] - 0.5).abs() < 1e-12 && (half[1] - 0.3).abs() < 1e-12, "{half:?}");
    let whole = displacement(&outcome.engine, 125);
    assert!((whole[0] - 1.0).abs() < 1e-12 && (whole[1] - 0.6).abs() < 1e-12, "{whole:?}");
}

#[test]
fn rest_is_no_equilibrium_while_something_is_scheduled() {
    let late = r#"roles[1].motion={kind="keyframes",interpolation="hold",frames=[{step=40,displacement=[1.0,0.0]}]}"#;
    let outcome = outcome("shear", &[late, "stop={steps=4000,tolerance=1e-7}"]);
    assert_eq!(outcome.reason, StopReason::Equilibrium);
    assert!(outcome.engine.step() > 40, "stopped at {}", outcome.engine.step());
    let [dx, _] = displacement(&outcome.engine, 400);
    assert_eq!(dx, 1.0);
}
