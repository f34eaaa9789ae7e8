//! What a scene says is what happens: roles, motions, updates, fracture, stopping.

use std::ops::ControlFlow;
use std::path::Path;

use flockform::continuum::bulk_response::material;
use flockform::continuum::plan::Plan;
use flockform::continuum::report::PlanReport;
use flockform::continuum::run::{Outcome, StopReason, run};
use flockform::engine::Engine;
use flockform::flock::role::Role;
use flockform::flock::vectors::distance;
use flockform::scene::swarm::Swarm;
use flockform::scene::{Scene, bundled};

use folders::temporary;
use scenes::{load, planned};

#[path = "common/folders.rs"]
mod folders;
#[path = "common/scenes.rs"]
mod scenes;

fn outcome(name: &str, overrides: &[&str]) -> Outcome {
    watched(name, overrides, |_| {})
}

fn watched(name: &str, overrides: &[&str], mut watch: impl FnMut(&Engine)) -> Outcome {
    let mut looks = 0;
    let outcome = run(planned(&load(name, overrides)), &mut |engine, _| {
        watch(engine);
        looks += 1;
        ControlFlow::Continue(())
    });
    assert!(looks >= outcome.engine.step().max(1), "every step is looked at: {looks}");
    outcome
}

fn displacement(engine: &Engine, id: usize) -> [f64; 2] {
    let (now, then) = (engine.present().get(id - 1), engine.body().reference.get(id - 1));
    [now[0] - then[0], now[1] - then[1]]
}

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
    // Whoever has moved 1.5 is clamped there and then.
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

/// A grid on a square lattice of spacing 1, its left side clamped and its right one led, with more keys; each with a `;` a line.
fn pulled(size: [usize; 2], per_step: f64, more: &str) -> Scene {
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

fn parsed(text: &str) -> Scene {
    Scene::parse("scene", "scene.toml", text, &[], None).unwrap_or_else(|error| panic!("{error}"))
}

fn run_out(scene: &Scene) -> Outcome {
    run(planned(scene), &mut |_, _| ControlFlow::Continue(()))
}

const RIGHT: &str = "[[roles]]; region = { kind = 'edge', side = 'right' };";

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
fn a_ghost_among_neighbours_that_are_found_anew_is_seen_by_none() {
    let outcome =
        outcome("drop", &["roles=[{region={kind='ids',ids=[9]},role='ghost',from=3}]", "stop.steps=6"]);
    let engine = &outcome.engine;
    let ghost = engine.roles().iter().position(|role| *role == Role::Ghost).expect("a ghost");
    assert!(!engine.flock().neighbours.index.contains(&(ghost as u32)));
    assert_eq!(engine.step(), 6);
}

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
fn a_plan_and_a_run_caution_against_what_does_not_suit_the_body() {
    let cautions =
        |scene: &Scene| PlanReport::new(scene, &planned(scene)).expect("planned").cautions.join("\n");
    let short = cautions(&pulled([6, 4], 0.1, "[fracture]; distance = 0.9"));
    assert!(short.contains("fracture.distance = 0.9") && short.contains("38 bonds"), "{short}");
    assert!(!cautions(&pulled([6, 4], 0.1, "[fracture]; distance = 1.1")).contains("fracture.distance"));
    let framed = cautions(&load("tension", &["record.probes=[67,12,1]"]));
    assert!(framed.contains("record.probes has points of the frame, 2 in all, the first 12:"), "{framed}");
    assert!(!cautions(&load("second-gradient", &[])).contains("record.probes"));
    let mirrored = |kind: &str| cautions(&load(kind, &["fracture={distance=3.0,ghosts=\"mirrored\"}"]));
    assert!(mirrored("lattice-honeycomb").contains("do not lie opposite each other: fracture.ghosts"));
    assert!(!mirrored("lattice-square").contains("fracture.ghosts"));
    // The lattice ends 0.9 before the shape does, along both axes.
    let short = "body={shape={kind='rectangle',max=[6.9,6.9]},outline='lattice'}";
    let short = cautions(&load("bar", &["lattice={kind='square',spacing=1.0}", short, "record={}"]));
    assert!(short.contains("its boundary lies up to 1.273 "), "{short}");
    let world = "[rule]; mean = { kind = 'geometric', origin = 'world' };";
    let unmoved = cautions(&pulled([4, 3], 0.1, world));
    assert!(!unmoved.contains("followers"), "{unmoved}");
    let negative = parsed(&negative(world));
    let unmoved = cautions(&negative);
    assert!(unmoved.contains("4 of 6 followers"), "{unmoved}");
    // Along the other axis they do.
    let moved = run_out(&negative);
    let [dx, dy] = displacement(&moved.engine, 4);
    assert!(dx > 0.0 && dy == 0.0, "{dx} {dy}");
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

#[test]
fn a_motion_that_ends_at_the_last_step_there_is_goes_on() {
    let last = format!(
        "motion = {{ kind = 'keyframes', frames = [{{ step = {}, displacement = [0.1, 0.0] }}] }}",
        u64::MAX
    );
    let more = format!("{RIGHT} role = 'leader'; from = 5; {last}; [stop]; steps = 30; tolerance = 1e-6");
    assert_eq!(run_out(&pulled([4, 3], 0.0, &more)).engine.step(), 30);
}

#[test]
fn the_energy_of_a_body_that_is_all_gone_is_zero_without_a_sign() {
    let gone = "[fracture]; [[roles]]; region = { kind = 'all' }; role = 'ghost'; [stop]; steps = 1";
    let energies = run_out(&pulled([3, 3], 0.1, gone)).engine.energies();
    assert_eq!(energies.map(f64::to_bits), [0; 2]);
}

#[test]
fn a_material_whose_cells_lock_in_shear_is_a_caution() {
    let is_cautioned = |more: &str| {
        let more = format!(
            "[rule]; mean.kind = 'material'; [material]; kind = 'isotropic'; young = 1.0; poisson = {more}"
        );
        let scene = pulled([6, 4], 0.1, &more);
        PlanReport::new(&scene, &planned(&scene)).expect("planned").cautions.join("\n").contains("cells lock")
    };
    assert!(is_cautioned("-0.9"));
    assert!(!is_cautioned("-0.7") && !is_cautioned("-0.9; plane = 'strain'"));
}

/// Off their axis a cantilever of whole cells bends by three quarters of what it should with fibres 14 times as stiff, by the truth of
/// `compare`; along it by all of it.
#[test]
fn fibres_across_the_sides_of_cells_are_a_caution() {
    let is_cautioned = |fibres: &str, lattice: &str| {
        let text = format!(
            "title = 'ply'\nlattice = {{ {lattice} }}\nbody.shape = {{ kind = 'rectangle', max = [8.0, 4.0] }}\n\
             rule.mean.kind = 'material'\nmaterial = {{ kind = 'orthotropic', poisson_12 = 0.3, {fibres} }}\n\
             roles = [{{ region = {{ kind = 'edge', side = 'left' }}, role = 'clamped' }}]\n\
             loads = [{{ kind = 'traction', region = {{ kind = 'edge', side = 'right' }}, traction = [0.0, 0.001] }}]\n\
             equilibrium = {{}}\nstop.steps = 1"
        );
        let scene =
            Scene::parse("ply", "ply.toml", &text, &[], None).unwrap_or_else(|error| panic!("{error}"));
        PlanReport::new(&scene, &planned(&scene)).expect("planned").cautions.join("\n").contains("fibres")
    };
    let ply = |angle: f64| format!("young = [140.0, 10.0], shear = 5.0, angle = {angle:?}");
    let square = |turn: f64| format!("kind = 'square', spacing = 1.0, orientation = {turn:?}");
    assert!(is_cautioned(&ply(30.0), &square(0.0)) && is_cautioned(&ply(0.0), &square(30.0)));
    assert!(is_cautioned(&ply(0.0), "kind = 'hexagonal', spacing = 1.0"));
    for angle in [0.0, 90.0, -90.0] {
        assert!(!is_cautioned(&ply(angle), &square(0.0)), "{angle}");
    }
    assert!(!is_cautioned(&ply(30.0), &square(30.0)) && !is_cautioned(&ply(30.0), &square(-60.0)));
    assert!(!is_cautioned("young = [9.0, 5.0], shear = 2.0, angle = 30.0", &square(0.0)));
}

#[test]
fn whole_cells_of_a_grid_are_cautioned_as_those_of_a_rectangle() {
    let cautions = |shape: &str| {
        let text = format!(
            "title = 'grid'\nlattice = {{ kind = 'square', spacing = 1.0 }}\nbody = {{ {shape} }}\nrule.mean.kind = 'material'\n\
             material = {{ kind = 'isotropic', young = 1.0, poisson = 0.3 }}\nequilibrium = {{}}\nstop.steps = 1\n\
             roles = [{{ region = {{ kind = 'edge', side = 'left' }}, role = 'clamped' }},\n{{ region = {{ kind = 'edge', side = 'right' }}, \
             role = 'leader', motion = {{ kind = 'keyframes', frames = [{{ step = 1, displacement = [0.1, 0.0] }}] }} }}]"
        );
        let scene =
            Scene::parse("grid", "grid.toml", &text, &[], None).unwrap_or_else(|error| panic!("{error}"));
        let cautions = PlanReport::new(&scene, &planned(&scene)).expect("planned").cautions;
        ["along the edges", "one or two cells thick"]
            .map(|words| cautions.iter().any(|one| one.contains(words)))
    };
    assert_eq!(cautions("shape = { kind = 'grid', columns = 21, rows = 3 }"), [true, true]);
    assert_eq!(cautions("shape = { kind = 'grid', columns = 21, rows = 5 }"), [true, false]);
    let rectangle = |height: f64| {
        format!("outline = 'lattice', shape = {{ kind = 'rectangle', max = [20.0, {height:?}] }}")
    };
    assert_eq!(cautions(&rectangle(2.0)), [true, true]);
    assert_eq!(cautions(&rectangle(4.0)), [true, false]);
}

/// The lowest row and its particles' neighbours below zero.
fn negative(world: &str) -> String {
    format!(
        "title = 'negative'\nlattice = {{ kind = 'square', spacing = 1.0 }}\n\
         body = {{ shape = {{ kind = 'grid', columns = 4, rows = 3 }}, anchor = [1.0, -0.5] }}\n\
         roles = [\n{{ region = {{ kind = 'edge', side = 'left' }}, role = 'clamped' }},\n\
         {{ region = {{ kind = 'edge', side = 'right' }}, role = 'leader', \
         motion = {{ kind = 'velocity', per_step = [0.1, 0.0] }} }}]\nstop.steps = 4\n{}",
        world.replace(';', "\n")
    )
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
    let marginal = between("update={}");
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
fn rest_is_no_equilibrium_while_something_is_scheduled() {
    let late = r#"roles[1].motion={kind="keyframes",interpolation="hold",frames=[{step=40,displacement=[1.0,0.0]}]}"#;
    let outcome = outcome("shear", &[late, "stop={steps=4000,tolerance=1e-7}"]);
    assert_eq!(outcome.reason, StopReason::Equilibrium);
    assert!(outcome.engine.step() > 40, "stopped at {}", outcome.engine.step());
    let [dx, _] = displacement(&outcome.engine, 400);
    assert_eq!(dx, 1.0);
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
fn a_ghost_leaves_the_body_and_the_rest_stays_in_place() {
    let ghosts = r#"roles=[{from=3,region={kind="box",min=[5,5],max=[7,7]},role="ghost"}]"#;
    for kind in ["lattice", "mirrored"] {
        let fracture = format!("fracture={{ghosts=\"{kind}\"}}");
        let outcome = outcome("shear", &[ghosts, &fracture, "stop={steps=30}", "record={}"]);
        assert_eq!(outcome.engine.roles().iter().filter(|&&role| role == Role::Ghost).count(), 9);
        // 9 particles have 12 bonds among them and 12 to the others.
        assert_eq!(outcome.engine.breaks().len(), 24);
        assert!(outcome.engine.breaks().iter().all(|b| b.step == 3));
        assert_eq!(
            outcome.engine.present(),
            &*outcome.engine.body().reference,
            "{kind} ghosts keep the balance"
        );
    }
    let fracture = "fracture={ghosts=\"none\"}";
    let outcome = outcome(
        "shear",
        &[ghosts, fracture, "rule.rest=literal", "frame=immediate", "stop={steps=30}", "record={}"],
    );
    assert_ne!(
        outcome.engine.present(),
        &*outcome.engine.body().reference,
        "without ghosts the flanks draw together"
    );
}

#[test]
fn a_broken_pair_never_influences_each_other_again() {
    // A row of six: torn between a held and a led half, then brought back together.
    let row = r#"body={shape={kind="grid",columns=6,rows=1}}"#;
    let roles = r#"roles=[{region={kind="edge",side="left"},role="clamped"},{region={kind="edge",side="right"},role="leader",motion={kind="keyframes",interpolation="hold",frames=[{step=1,displacement=[9,0]},{step=60,displacement=[0.0,0.0]}]}}]"#;
    let mut broken_at_50 = 0;
    let outcome =
        watched("lattice-square", &[row, roles, "fracture={stretch=3.0}", "stop={steps=400}"], |engine| {
            if engine.step() == 50 {
                broken_at_50 = engine.breaks().len();
            }
        });
    let engine = &outcome.engine;
    assert_eq!(broken_at_50, 1);
    assert_eq!(engine.breaks().len(), 1, "a bond broke twice or another did: {:?}", engine.breaks());
    assert_eq!(engine.breaks()[0].pair, [4, 5]);
    // The leader came back to its place beside its old neighbour, which does not mind.
    assert_eq!(displacement(engine, 6), [0.0, 0.0]);
    assert!(displacement(engine, 5)[0].abs() < 1e-6);
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
fn the_liquid_drop_stays_in_one_piece_and_rounds_itself() {
    let oblong = |engine: &Engine| {
        let (low, high) = engine.present().bounds(0..engine.present().len()).expect("has particles");
        (high[0] - low[0]) / (high[1] - low[1])
    };
    let mut start = 0.0;
    let outcome = watched("drop", &[], |engine| {
        if engine.step() == 0 {
            start = oblong(engine);
        }
    });
    let engine = &outcome.engine;
    // Everybody has somebody near and nobody on top of it.
    for (i, here) in engine.present().iter().enumerate() {
        let nearest = engine
            .present()
            .iter()
            .enumerate()
            .filter(|&(k, _)| k != i)
            .map(|(_, there)| distance(here, there));
        let nearest = nearest.fold(f64::INFINITY, f64::min);
        assert!((0.3..1.2).contains(&nearest), "particle {}: {nearest}", i + 1);
    }
    let end = oblong(engine);
    assert!(start > 1.8 && end < 1.4, "{start} became {end}");
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

/// A strip without ghosts, clamped on its left, under these further lines.
fn without_ghosts(name: &str, more: &str) -> Scene {
    let text = format!(
        "title = \"A strip without ghosts\"\nlattice = {{ kind = \"hexagonal\", spacing = 1.0, orientation = 17 }}\n\
         body = {{ shape = {{ kind = \"rectangle\", max = [12.0, 8.0] }} }}\nneighbours = {{ kind = \"first\" }}\n\
         fracture = {{ stretch = 1.3, ghosts = \"none\" }}\n{more}"
    );
    Scene::parse(name, "strip.toml", &text, &[], None).unwrap_or_else(|error| panic!("{error}"))
}

const CLAMPED: &str =
    "[[roles]]\nregion = { kind = \"edge\", side = \"left\", depth = 1.2 }\nrole = \"clamped\"\n";

#[test]
fn a_cut_body_at_rest_stays_where_it_is_without_ghosts() {
    let cuts = [
        // Into the body, and through it: nothing leads the loose half.
        "cuts = [{ from = [4.0, 4.1], to = [20.0, 4.1] }]",
        "cuts = [{ from = [6.2, -1.0], to = [6.2, 9.0] }]",
        // By a scattered mean, one by one in order, and by weights: other ways to the same targets.
        "cuts = [{ from = [4.0, 4.1], to = [20.0, 4.1] }]\nrule = { mean = { kind = \"distance\", power = -1.0 } }",
        "cuts = [{ from = [4.0, 4.1], to = [20.0, 4.1] }]\nupdate = { order = \"sequential\" }",
        "cuts = [{ from = [4.0, 4.1], to = [20.0, 4.1] }]\nrule = { poisson = { k = 0.03, axis = \"x\" } }",
    ];
    for cut in cuts {
        let scene = without_ghosts("cut", &format!("{cut}\nstop = {{ steps = 300 }}\n{CLAMPED}"));
        let outcome = run(planned(&scene), &mut |_, _| ControlFlow::Continue(()));
        let engine = &outcome.engine;
        assert!(engine.breaks().len() > 10, "{cut}: {} are cut", engine.breaks().len());
        let moved = (1..=engine.body().count()).flat_map(|id| displacement(engine, id));
        let farthest = moved.fold(0.0, |most: f64, d| most.max(d.abs()));
        assert!(farthest < 1e-12, "{cut}: {farthest}");
    }
}

#[test]
fn a_strip_torn_in_two_without_ghosts_comes_to_rest_in_two_unstrained_pieces_whenever_it_is_resumed() {
    use flockform::continuum::run::run_shared;
    use flockform::engine::observer::EachStep;
    use flockform::engine::state::EngineState;
    use flockform::ranks::Team;
    let led = "[[roles]]\nregion = { kind = \"edge\", side = \"right\", depth = 1.2 }\nrole = \"leader\"\n\
               motion = { kind = \"keyframes\", frames = [{ step = 200, displacement = [4.0, 1.0] }] }\n";
    let scene = without_ghosts("torn", &format!("stop = {{ steps = 4000 }}\n{CLAMPED}{led}"));
    let mut kept = None;
    let outcome = run(planned(&scene), &mut |engine, residual| {
        if engine.step() == 150 {
            kept = Some((EngineState::of(engine).into_owned(), residual));
        }
        ControlFlow::Continue(())
    });
    let engine = &outcome.engine;
    assert!(!engine.breaks().is_empty());
    // Each goes with what holds it, as a rigid body; what broke off altogether stays undeformed too.
    let pieces = (1..=engine.body().count()).filter(|&id| {
        let [x, y] = displacement(engine, id);
        x.hypot(y) < 1e-6 || (x - 4.0).hypot(y - 1.0) < 1e-6
    });
    let count = pieces.count();
    assert!(count + 4 > engine.body().count(), "{count} of {}", engine.body().count());
    let (state, residual) = kept.expect("came that far");
    let mut see = |_: &Engine, _: f64| ControlFlow::Continue(());
    let from = Some((state, residual));
    let resumed =
        run_shared(planned(&scene), from, None::<&Team>, &mut EachStep(&mut see)).expect("the same body");
    let bits =
        |engine: &Engine| -> Vec<[u64; 2]> { engine.present().iter().map(|p| p.map(f64::to_bits)).collect() };
    assert!(bits(&resumed.engine) == bits(engine));
}
