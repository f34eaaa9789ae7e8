//! A body led by hand, cut and changed, and the scene that replays it.

use std::ops::ControlFlow;

use flockform::continuum::equilibrium::run_to_equilibrium;
use flockform::continuum::plan::Plan;
use flockform::engine::Engine;
use flockform::flock::role::Role;
use flockform::live::body::Body;
use flockform::live::command::Command;
use flockform::live::session::Session;
use flockform::scene::raw::RawSide;
use flockform::scene::{Scene, bundled};

use super::folders::temporary;

fn begun(name: &str, set: &[&str]) -> Body {
    let set: Vec<String> = set.iter().map(|&text| text.to_owned()).collect();
    let scene = bundled(name).expect("bundled").load(&set).unwrap_or_else(|error| panic!("{error}"));
    Body::new(scene, None).unwrap_or_else(|error| panic!("{error}"))
}

fn ask(body: &mut Body, text: &str) {
    let command = Command::parse(text).unwrap_or_else(|error| panic!("{text}: {error}"));
    body.perform(0, &command).unwrap_or_else(|refused| panic!("{text}: {}", refused.0));
}

fn step(body: &mut Body, count: usize) {
    (0..count).for_each(|_| body.advance().expect("goes on"));
}

/// The end of the run of a saved scene.
fn replayed(text: &str) -> Engine {
    let scene = Scene::parse("saved", "saved.toml", text, &[], None)
        .unwrap_or_else(|error| panic!("{error}\n{text}"));
    let plan = Plan::new(&scene).unwrap_or_else(|error| panic!("{error}"));
    let outcome = run_to_equilibrium(&scene, plan, &mut |_, _| ControlFlow::Continue(()));
    outcome.unwrap_or_else(|error| panic!("{error}")).engine
}

/// That a saved scene ends where the body is, bit by bit.
fn assert_replays(body: &Body) {
    let text = body.saved(None).expect("can be written");
    let (now, then) = (body.engine(), replayed(&text));
    assert_eq!(now.step(), then.step());
    let bits = |engine: &Engine| -> Vec<[u64; 2]> {
        engine.present().iter().map(|[x, y]| [x.to_bits(), y.to_bits()]).collect()
    };
    assert_eq!(now.roles(), then.roles());
    assert_eq!(now.breaks(), then.breaks());
    assert!(bits(now) == bits(&then), "the same positions to the last bit");
}

fn drag(body: &mut Body, particle: usize, by: [f64; 2], steps: usize) {
    ask(body, &format!(r#"{{"do":"grab","particle":{particle}}}"#));
    for k in 1..=steps {
        let [x, y] = by.map(|along| along * k as f64 / steps as f64);
        ask(body, &format!(r#"{{"do":"drag","by":[{x},{y}]}}"#));
        step(body, 1);
    }
    ask(body, r#"{"do":"release"}"#);
}

#[test]
fn a_dragged_leader_and_a_dragged_follower_are_replayed_to_the_bit() {
    let mut body = begun("tension", &[]);
    step(&mut body, 10);
    // A leader of the tenth body column, with all that are led as it is.
    let leader = (0..144).find(|&i| body.engine().roles()[i].name() == "leader").expect("led");
    drag(&mut body, leader, [1.0 / 3.0, 0.7], 17);
    step(&mut body, 9);
    drag(&mut body, 66, [-0.4, 1.1], 12);
    step(&mut body, 20);
    assert!(
        body.engine().displacement(66)[1] > 0.05,
        "it has been moved: {:?}",
        body.engine().displacement(66)
    );
    assert_replays(&body);
}

#[test]
fn a_drag_from_the_very_beginning_and_one_under_way_are_replayed() {
    let mut body = begun("tension", &[]);
    drag(&mut body, 66, [0.3, 0.2], 5);
    ask(&mut body, r#"{"do":"grab","particle":70,"alone":true}"#);
    ask(&mut body, r#"{"do":"drag","by":[0.25,0.5]}"#);
    step(&mut body, 3);
    assert_replays(&body);
}

#[test]
fn cuts_and_changed_keys_are_replayed_to_the_bit() {
    let mut body = begun("tension", &[]);
    step(&mut body, 25);
    ask(&mut body, r#"{"do":"cut","from":[4.5,2.0],"to":[4.6,8.0]}"#);
    assert!(body.engine().breaks().len() > 3, "{}", body.engine().breaks().len());
    step(&mut body, 15);
    ask(&mut body, r#"{"do":"set","key":"rule.feedback.factor","value":"-0.05"}"#);
    ask(&mut body, r#"{"do":"set","key":"update.damping","value":"0.8"}"#);
    step(&mut body, 15);
    ask(&mut body, r#"{"do":"cut","from":[7.5,9.0],"to":[7.5,20.0]}"#);
    step(&mut body, 5);
    assert_replays(&body);
}

#[test]
fn a_material_and_a_body_that_breaks_are_replayed_to_the_bit() {
    let mut body = begun("beam-loaded", &[]);
    step(&mut body, 30);
    let free = body.engine().body().count() - 1;
    drag(&mut body, free, [0.1, 0.3], 8);
    ask(&mut body, r#"{"do":"set","key":"material.young","value":"2000.0"}"#);
    step(&mut body, 30);
    assert_replays(&body);

    let mut body = begun("fracture", &[]);
    step(&mut body, 40);
    ask(&mut body, r#"{"do":"set","key":"fracture.distance","value":"1.9"}"#);
    step(&mut body, 60);
    assert_replays(&body);
}

#[test]
fn an_undone_deed_leaves_nothing_behind() {
    let mut body = begun("tension", &[]);
    step(&mut body, 30);
    let before = body.engine().present().clone();
    ask(&mut body, r#"{"do":"cut","from":[4.5,2.0],"to":[4.6,8.0]}"#);
    step(&mut body, 10);
    drag(&mut body, 66, [1.0, 0.0], 5);
    ask(&mut body, r#"{"do":"undo"}"#);
    assert_eq!(body.engine().step(), 40);
    ask(&mut body, r#"{"do":"set","key":"update.damping","value":"0.7"}"#);
    assert_eq!(body.sets(), ["update.damping=0.7"]);
    ask(&mut body, r#"{"do":"undo"}"#);
    assert!(body.sets().is_empty());
    ask(&mut body, r#"{"do":"undo"}"#);
    assert_eq!((body.engine().step(), body.engine().breaks().len()), (30, 0));
    assert!(*body.engine().present() == before);
    step(&mut body, 10);
    assert_replays(&body);
    assert!(body.perform(0, &Command::Undo {}).is_err(), "nothing else was done");
}

#[test]
fn keys_that_change_the_body_begin_anew_and_wrong_ones_change_nothing() {
    let mut body = begun("tension", &[]);
    step(&mut body, 5);
    let layout = body.layout();
    for (key, value) in [
        ("update.damping", "-1.0"),
        ("update.damping", "nan"),
        ("rule.feedbak.factor", "1.0"),
        ("lattice.spacing", "0.0"),
        ("rule", "3"),
        ("", "1"),
        ("roles[99].from", "2"),
    ] {
        let command = Command::Set { key: key.into(), value: value.into() };
        let refused = body.perform(0, &command).expect_err(key);
        assert!(!refused.0.is_empty() && body.engine().step() == 5 && body.layout() == layout, "{key}");
    }
    ask(&mut body, r#"{"do":"set","key":"update.damping","value":"0.8"}"#);
    ask(&mut body, r#"{"do":"set","key":"lattice.spacing","value":"0.5"}"#);
    assert!(body.engine().step() == 0 && body.layout() != layout);
    assert_eq!(body.sets(), ["update.damping=0.8", "lattice.spacing=0.5"]);
    ask(&mut body, r#"{"do":"undo"}"#);
    ask(&mut body, r#"{"do":"undo"}"#);
    ask(&mut body, r#"{"do":"set","key":"lattice.spacing","value":"0.5"}"#);
    step(&mut body, 12);
    assert_replays(&body);
    ask(&mut body, r#"{"do":"undo"}"#);
    assert!(body.engine().step() == 5 && body.layout() != layout, "the page has to be built anew once more");
}

#[test]
fn hands_that_hold_nothing_or_the_frame_are_refused() {
    let mut body = begun("tension", &[]);
    let refused = |body: &mut Body, command: Command| body.perform(0, &command).expect_err("refused").0;
    assert!(refused(&mut body, Command::Grab { particle: 0, alone: false }).contains("frame"));
    assert!(refused(&mut body, Command::Grab { particle: 144, alone: false }).contains("no such particle"));
    assert!(refused(&mut body, Command::Drag { by: [1.0, 0.0] }).contains("nothing is held"));
    ask(&mut body, r#"{"do":"grab","particle":66}"#);
    ask(&mut body, r#"{"do":"drag","by":[1e300,-1e300]}"#);
    step(&mut body, 5);
    assert!(body.engine().present().iter().all(|[x, y]| x.abs() < 1e4 && y.abs() < 1e4));
}

/// Ten columns that the leaders tear apart, and then throw out of bounds.
#[test]
fn a_step_that_diverged_is_replayed_as_if_it_had_not_been_taken() {
    let thrown = "roles[1].motion={kind=\"keyframes\",interpolation=\"linear\",frames=[{step=4,displacement=[0.4,0.0]},\
         {step=5,displacement=[0.8,0.0]},{step=6,displacement=[5.0,0.0]}]}";
    let sets = [
        "frame=none",
        "record={}",
        "roles[2].from=30",
        "fracture={stretch=1.5,ghosts=\"none\"}",
        "stop.divergence_ratio=0.2",
        thrown,
    ];
    let mut body = begun("tension", &sets);
    step(&mut body, 5);
    let (previous, pe2) = (body.engine().previous().clone(), body.engine().energies()[1]);
    let stopped = body.advance().expect_err("diverges");
    assert!(stopped.contains("diverged at step 6"), "{stopped}");
    assert_eq!((body.engine().step(), body.engine().breaks().len()), (5, 0));
    assert_eq!((body.engine().previous(), body.engine().energies()[1]), (&previous, pe2));
    ask(&mut body, r#"{"do":"set","key":"fracture.stretch","value":"3.0"}"#);
    // The last column, led by hand from here on.
    let leader = body.engine().roles().iter().position(|role| *role == Role::Leader).expect("led");
    drag(&mut body, leader, [-0.1, 0.0], 2);
    assert_replays(&body);
}

#[test]
fn a_body_saved_in_another_folder_names_its_files_as_they_are_found_from_there() {
    let folder = temporary();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("writable");
    write("points.csv", "id,x,y\n1,0,0\n2,1,0\n3,0,1\n4,1,1\n");
    write("pulled.csv", "id,ux,uy\n2,0.5,0\n4,0.5,0\n");
    write(
        "mine.toml",
        "title = 'T'\nneighbours = { kind = 'within', radius = 1.5 }\n\
         body = { shape = { kind = 'points', file = 'points.csv' } }\n\
         roles = [{ region = { kind = 'ids', ids = [1, 3] }, role = 'clamped' },\n\
         { region = { kind = 'ids', ids = [2, 4] }, role = 'leader', motion = { kind = 'csv', file = 'pulled.csv' } }]\n",
    );
    let scene =
        Scene::from_file(&folder.path().join("mine.toml"), &[]).unwrap_or_else(|error| panic!("{error}"));
    let mut body = Body::new(scene, Some(folder.path().into())).unwrap_or_else(|error| panic!("{error}"));
    step(&mut body, 1);
    let other = folder.path().join("saved/here");
    std::fs::create_dir_all(&other).expect("writable");
    let text = body.saved(Some(&other)).expect("found from there");
    std::fs::write(other.join("again.toml"), &text).expect("writable");
    let again = Scene::from_file(&other.join("again.toml"), &[]);
    assert_eq!(again.unwrap_or_else(|error| panic!("{error}\n{text}")).stop.steps, 1);
    assert!(text.contains("file = \"../../points.csv\""), "{text}");
}

#[test]
fn a_file_that_is_edited_meanwhile_changes_nothing() {
    let folder = temporary();
    let path = folder.path().join("mine.toml");
    let text = bundled("tension").expect("bundled").text;
    std::fs::write(&path, text).expect("writable");
    let scene = Scene::from_file(&path, &[]).unwrap_or_else(|error| panic!("{error}"));
    let mut body = Body::new(scene, path.parent().map(Into::into)).unwrap_or_else(|error| panic!("{error}"));
    step(&mut body, 5);
    std::fs::write(&path, text.replace("spacing = 1.0", "spacing = 2.0").replace("[lattice]", "[latice]"))
        .expect("writable");
    ask(&mut body, r#"{"do":"set","key":"update.damping","value":"0.8"}"#);
    assert_eq!(body.engine().step(), 5);
    ask(&mut body, r#"{"do":"reset"}"#);
    step(&mut body, 3);
    assert_replays(&body);
}

#[test]
fn hands_that_take_and_take_are_refused_before_they_fill_the_memory() {
    let mut body = begun("tension", &["body.shape={ kind = \"grid\", columns = 2, rows = 30000 }"]);
    let clamped = (0..body.engine().body().count()).find(|&i| body.engine().roles()[i].name() == "clamped");
    let grab = Command::Grab { particle: clamped.expect("held"), alone: false };
    let drag = Command::Drag { by: [0.1, 0.0] };
    let refused = (0..1000).find_map(|_| body.perform(0, &grab).and_then(|()| body.perform(0, &drag)).err());
    assert!(refused.expect("refused in the end").0.contains("too much"));
    ask(&mut body, r#"{"do":"undo"}"#);
}

#[test]
fn a_side_that_is_loaded_by_hand_goes_there_and_is_replayed_to_the_bit() {
    let mut body = begun("beam-loaded", &["loads=[]"]);
    step(&mut body, 5);
    let corner = body.engine().body().count() - 1;
    ask(&mut body, r#"{"do":"load","side":"right","by":[1.1,0.0]}"#);
    step(&mut body, 400);
    let [x, _] = body.engine().displacement(corner);
    // It contracts, so it goes farther than it would without: by 1 / (1 - nu^2) in a long bar.
    assert!((1.0..1.4).contains(&x), "{x}");
    ask(&mut body, r#"{"do":"load","side":"top","by":[0.2,0.0]}"#);
    step(&mut body, 3);
    ask(&mut body, r#"{"do":"load","side":"right","by":[-1.1,0.0]}"#);
    let sets = body.sets();
    assert!(sets.last().expect("set").starts_with("loads[0].traction=[-"), "{sets:?}");
    step(&mut body, 400);
    assert!(body.engine().displacement(corner)[0] < -0.8, "{:?}", body.engine().displacement(corner));
    assert_replays(&body);
    let mut body = begun("tension", &[]);
    let load = Command::Load { side: RawSide::Right, by: [1.0, 0.0] };
    assert!(body.perform(0, &load).expect_err("refused").0.contains("only a material"));
}

#[test]
fn tools_are_those_that_the_body_takes() {
    let cut = Command::Cut { from: [0.5, -100.0], to: [0.6, 100.0] };
    for (name, tools) in [("tension", &["cut"][..]), ("beam-loaded", &["load"]), ("drop", &[])] {
        assert_eq!(begun(name, &[]).tools(), tools, "{name}");
        assert_eq!(begun(name, &[]).perform(0, &cut).is_ok(), tools.contains(&"cut"), "{name}");
    }
}

/// Where the page shows a particle, from where it was at first.
fn shown(body: &Body, particle: usize) -> [f64; 2] {
    body.frame(&[]).displacements.get(particle)
}

fn assert_near(found: [f64; 2], expected: [f64; 2]) {
    assert!((0..2).all(|k| (found[k] - expected[k]).abs() < 1e-6), "{found:?}, not {expected:?}");
}

/// Drags a particle to each of these displacements and lets it go, while the body stands still.
fn pull(body: &mut Body, particle: usize, by: &[&str]) {
    ask(body, &format!(r#"{{"do":"grab","particle":{particle}}}"#));
    by.iter().for_each(|by| ask(body, &format!(r#"{{"do":"drag","by":{by}}}"#)));
    ask(body, r#"{"do":"release"}"#);
}

#[test]
fn a_drag_while_a_body_stands_still_is_shown_at_once_and_the_next_step_goes_there() {
    // No role is taken before the second step.
    for (before, steps) in [(0, 2), (10, 1)] {
        let mut body = begun("tension", &[]);
        step(&mut body, before);
        let [x, y] = shown(&body, 66);
        let (undoable, there) = (body.undoable(), [x + 1.0, y + 0.5]);
        ask(&mut body, r#"{"do":"grab","particle":66}"#);
        ask(&mut body, r#"{"do":"drag","by":[0.5,0.25]}"#);
        assert_near(shown(&body, 66), [x + 0.5, y + 0.25]);
        ask(&mut body, r#"{"do":"drag","by":[1.0,0.5]}"#);
        ask(&mut body, r#"{"do":"release"}"#);
        assert_eq!(body.undoable(), undoable + 1);
        assert_near(shown(&body, 66), there);
        if before > 0 {
            // A run takes one step at least.
            assert_replays(&body);
        }
        ask(&mut body, r#"{"do":"undo"}"#);
        assert_near(shown(&body, 66), [x, y]);

        pull(&mut body, 66, &["[1.0,0.5]"]);
        step(&mut body, steps);
        assert_near(body.engine().displacement(66), there);
        assert_near(shown(&body, 66), there);
        assert_replays(&body);
        step(&mut body, 1);
        assert_eq!(body.engine().roles()[66].name(), "follower");
        assert!(body.engine().displacement(66)[0] < there[0], "its neighbours pull it back");
        step(&mut body, 7);
        assert_replays(&body);
    }
}

#[test]
fn drags_one_after_another_while_a_body_stands_still_add_up() {
    let mut body = begun("tension", &[]);
    step(&mut body, 10);
    let leader = (0..144).find(|&i| body.engine().roles()[i].name() == "leader").expect("led");
    for particle in [66, leader] {
        let [x, y] = shown(&body, particle);
        for by in ["[0.5,0.0]", "[0.25,0.5]"] {
            pull(&mut body, particle, &[by]);
        }
        assert_near(shown(&body, particle), [x + 0.75, y + 0.5]);
        step(&mut body, 1);
        assert_near(body.engine().displacement(particle), [x + 0.75, y + 0.5]);
        assert_replays(&body);
    }
    // Back to where it is: nothing is to come, and it is shown so.
    let here = shown(&body, leader);
    for by in ["[0.5,0.0]", "[-0.5,0.0]"] {
        pull(&mut body, leader, &[by]);
    }
    assert_near(shown(&body, leader), here);
    step(&mut body, 3);
    assert_near(shown(&body, leader), here);
    assert_replays(&body);
}

#[test]
fn a_particle_that_was_just_let_go_follows_after_another_hand_too() {
    let mut body = begun("tension", &[]);
    step(&mut body, 10);
    drag(&mut body, 66, [0.4, 0.2], 4);
    assert_eq!(body.engine().roles()[66].name(), "leader", "until the next step");
    drag(&mut body, 66, [0.4, 0.2], 3);
    step(&mut body, 2);
    assert_eq!(body.engine().roles()[66].name(), "follower");
    assert_replays(&body);
}

#[test]
fn a_drag_that_changes_nothing_is_nothing_to_undo() {
    let mut body = begun("tension", &[]);
    step(&mut body, 10);
    let saved = body.saved(None).expect("can be written");
    for by in [&[][..], &["[0.0,0.0]"], &["[0.5,0.5]", "[0.0,0.0]"]] {
        pull(&mut body, 66, by);
        assert_eq!(body.undoable(), 0, "{by:?}");
    }
    assert_eq!(body.saved(None).expect("can be written"), saved);
    step(&mut body, 2);
    assert_replays(&body);
}
