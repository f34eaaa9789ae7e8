//! The live page in headless Chromium.

use std::ops::ControlFlow;
use std::path::Path;
use std::process::Command;

use flockform::continuum::plan::Plan;
use flockform::continuum::run::run;
use flockform::engine::Engine;
use flockform::scene::Scene;
use flockform::scene::bundled::bundled_swarm;
use flockform::scene::swarm::Swarm;
use flockform::swarm::flight::Flight;
use serde_json::{Value, json};

use super::folders::temporary;
use super::served::Served;

fn node(script: &str, arguments: &[&str]) -> Value {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/live").join(script);
    let output = Command::new("node").arg(script).args(arguments).output().expect("node starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {said}"))
}

fn tour(address: &str, asked: &Value) -> Value {
    let seen = node("tour.mjs", &[address, &asked.to_string()]);
    println!("{}", seen["words"]);
    assert_eq!(seen["errors"], json!([]), "the console has no errors");
    assert_eq!(seen["faults"], json!([]), "axe finds nothing serious");
    let (origin, _) = address.split_once('?').expect("with a token");
    let is_own = |url: &Value| {
        let url = url.as_str().unwrap_or_default();
        url.starts_with(origin) || url.starts_with("data:")
    };
    assert!(seen["requests"].as_array().expect("listed").iter().all(is_own), "{}", seen["requests"]);
    seen
}

/// That the page showed at the end what a replay of the saved file ends with, as single floats.
fn assert_shown(seen: &Value, displacements: impl Iterator<Item = [f64; 2]>) {
    for (i, u) in displacements.enumerate() {
        for (axis, along) in u.into_iter().enumerate() {
            let shown = seen["places"][axis][i].as_f64().expect("a number");
            assert_eq!((shown as f32).to_bits(), (along as f32).to_bits(), "particle {i}");
        }
    }
}

/// Where the page has saved.
fn saved(seen: &Value) -> &Path {
    Path::new(seen["saved"].as_str().expect("a path"))
}

/// The end of the run of the saved scene, which the page showed.
fn run_again(seen: &Value) -> Engine {
    let scene = Scene::from_file(saved(seen), &[]).unwrap_or_else(|error| panic!("{error}"));
    let plan = Plan::new(&scene).unwrap_or_else(|error| panic!("{error}"));
    let engine = run(plan, &mut |_, _| ControlFlow::Continue(())).engine;
    assert_shown(seen, (0..engine.body().count()).map(|i| engine.displacement(i)));
    engine
}

/// That the page showed the end of the flight of a saved swarm.
fn assert_flown(seen: &Value, swarm: &Swarm) {
    let mut flight = Flight::new(swarm).unwrap_or_else(|error| panic!("{error}"));
    (0..flight.periods()).for_each(|_| flight.step());
    assert_eq!(seen["clock"], flight.fleet().time());
    let (places, moved) = (&flight.control().formation().places, flight.fleet().places());
    assert_shown(seen, moved.iter().zip(places.iter()).map(|([x, y], [px, py])| [x - px, y - py]));
}

#[test]
#[ignore = "needs Chromium, Node, playwright-core and axe-core: see tests/browser/main.rs"]
fn a_body_is_dragged_cut_undone_and_saved_while_another_viewer_looks_on() {
    let folder = temporary();
    let served = Served::scene("tension", &[], folder.path());
    let asked = json!({
        "name": "tension", "drag": 66, "cut": [[4.5, 2.0], [4.6, 8.0]], "key": "rule.feedback.factor=-0.05",
    });
    let seen = tour(&served.address, &asked);
    let place =
        |when: &str| -> Vec<f64> { serde_json::from_value(seen["dragged"][when].clone()).expect("two") };
    assert!(place("after")[1] - place("before")[1] > 0.1, "{}", seen["dragged"]);
    assert!(place("there")[1] - place("before")[1] > 0.05, "the other viewer sees it: {}", seen["dragged"]);
    assert!(seen["broken"].as_u64() > Some(3), "{}", seen["broken"]);
    let undone: Vec<f64> = serde_json::from_value(seen["undone"].clone()).expect("two");
    assert!(undone[1] <= undone[0], "{undone:?}");
    assert!(
        seen["refused"].as_str().is_some_and(|words| words.contains("update.damping")),
        "{}",
        seen["refused"]
    );
    assert!(seen["refused"].as_str().is_some_and(|words| !words.starts_with("--set")), "{}", seen["refused"]);
    assert_eq!(seen["alert"], json!(["alert", "note bad", "rgb(179, 38, 30)"]));
    for key in ["update.damping", "rule.feedback.factor", "fracture.stretch"] {
        assert!(seen["offered"][key].is_string(), "{key} in {}", seen["offered"]);
    }
    assert_eq!([&seen["offered"]["update.damping"], &seen["offered"]["fracture.stretch"]], ["1", ""]);
    assert_eq!(seen["boxes"]["rule.feedback.factor"], "-0.05");
    assert_eq!(seen["command"], "flockform live tension --set rule.feedback.factor=-0.05");
    let hints = seen["hints"].as_object().expect("by tool");
    assert_eq!(hints.keys().collect::<Vec<_>>(), ["drag", "cut", "look"], "there is no material to load");
    assert!(hints["cut"].as_str().is_some_and(|words| words.contains("cut")), "{hints:?}");
    assert_eq!(hints["look"], "Drag to move the view");
    assert_eq!(seen["stepped"], 1.0);
    assert_eq!(saved(&seen), folder.path().join("tension_live.toml"));
    let engine = run_again(&seen);
    assert_eq!(seen["clock"], engine.step() as f64);
    assert!(!engine.breaks().is_empty());
}

#[test]
#[ignore = "needs Chromium, Node, playwright-core and axe-core: see tests/browser/main.rs"]
fn a_leader_is_dragged_and_a_robot_killed_and_the_flight_saved() {
    let folder = temporary();
    let served = Served::swarm("square", &[], folder.path());
    let seen = tour(&served.address, &json!({ "name": "square", "drag": 0, "fault": 12 }));
    assert_eq!(seen["hurt"], json!([[12, "dead"]]));
    let swarm = Swarm::from_file(saved(&seen), &[]).unwrap_or_else(|error| panic!("{error}"));
    assert!(swarm.raw.flight.commands.iter().filter(|one| one.after > 0).count() > 3);
    assert_flown(&seen, &swarm);
}

#[test]
#[ignore = "needs Chromium, Node, playwright-core and axe-core: see tests/browser/main.rs"]
fn an_obstacle_is_pushed_and_the_formation_squeezed_and_the_flight_saved() {
    let folder = temporary();
    let disc = "obstacles=[{ kind = \"disc\", centre = [-4.0, 3.0], radius = 1.0 }]".to_owned();
    let served = Served::swarm(
        "square",
        &[disc, "leaders[0].program={ kind = \"external\" }".to_owned()],
        folder.path(),
    );
    let pushed =
        json!({ "name": "pushed", "push": { "at": [-4.0, 3.0], "by": [3.5, 0.0] }, "squeeze": true });
    let seen = tour(&served.address, &pushed);
    assert!(seen["pushed"][0].as_f64() > Some(3.3), "{}", seen["pushed"]);
    assert!((4.0..5.6).contains(&seen["squeezed"].as_f64().expect("measured")), "{}", seen["squeezed"]);
    let swarm = Swarm::from_file(saved(&seen), &[]).unwrap_or_else(|error| panic!("{error}"));
    assert_flown(&seen, &swarm);
}

#[test]
#[ignore = "needs Chromium, Node, playwright-core and axe-core: see tests/browser/main.rs"]
fn a_formation_is_designed_and_the_file_is_the_design() {
    let folder = temporary();
    let served = Served::swarm("square", &["rule={}".to_owned()], folder.path());
    let asked = json!({ "name": "designed", "design": { "at": [7.5, 3.0], "by": [0.0, 1.5], "other": 12 } });
    let seen = tour(&served.address, &asked);
    let words = seen["exact"].as_array().expect("words");
    assert_eq!(words[0], "followers take part exactly in every shift of the leaders");
    assert_eq!(seen["removed"], 25);
    let swarm = Swarm::from_file(saved(&seen), &[]).unwrap_or_else(|error| panic!("{error}"));
    let scout = swarm.raw.robots.iter().find(|robot| robot.name == "scout").expect("named");
    assert!((scout.place[0] - 7.5).abs() < 0.05 && (scout.place[1] - 4.5).abs() < 0.05, "{:?}", scout.place);
    assert!(scout.neighbours.contains(&"robot_13".to_owned()), "{:?}", scout.neighbours);
    let led = |entry: &flockform::scene::swarm::raw::RawLeaders| entry.robots.contains(&"scout".to_owned());
    assert!(!swarm.raw.leaders.iter().any(led), "placed to lead, and told to follow");
    let bundled = bundled_swarm("square").expect("bundled").load_swarm(&[]).expect("loads");
    let durations = [&swarm, &bundled].map(|swarm| swarm.raw.flight.duration);
    assert_eq!((swarm.raw.robots.len(), durations[0]), (26, durations[1]));
    Flight::new(&swarm).unwrap_or_else(|error| panic!("{error}"));
}

#[test]
#[ignore = "needs Chromium, Node, playwright-core and axe-core: see tests/browser/main.rs"]
fn an_edge_is_loaded_by_hand_and_the_body_saved() {
    let folder = temporary();
    let served = Served::scene("beam-loaded", &["loads=[]".to_owned()], folder.path());
    let seen = tour(&served.address, &json!({ "name": "loaded", "load": 137 }));
    assert!(seen["loaded"][0].as_f64() > Some(0.3), "{}", seen["loaded"]);
    assert_eq!(seen["hints"]["load"], "Drag a side of the body to load it");
    run_again(&seen);
}

/// That the view is large and the clock below it in the window.
fn assert_in_windows(seen: &Value) {
    for (window, least) in seen["windows"].as_array().expect("measured").iter().zip([330.0, 500.0, 300.0]) {
        assert!(window["high"].as_f64() >= Some(least) && window["below"].as_f64() <= Some(0.0), "{window}");
        assert_eq!(window["isWide"], false);
    }
}

#[test]
#[ignore = "needs Chromium, Node, playwright-core and axe-core: see tests/browser/main.rs"]
fn a_body_that_stands_still_is_dragged_at_once_and_keys_do_what_is_said() {
    let folder = temporary();
    let served = Served::scene("tension", &[], folder.path());
    let seen = tour(&served.address, &json!({ "name": "first", "first": 66 }));
    assert_in_windows(&seen);
    let place =
        |when: &str| -> Vec<f64> { serde_json::from_value(seen["still"][when].clone()).expect("two") };
    let (before, after) = (place("before"), place("after"));
    assert!(after[0] > before[0] + 0.3 && after[1] > before[1] + 0.3, "{}", seen["still"]);
    assert_eq!(seen["still"]["clock"], 0.0);
    let stepped = place("stepped");
    assert!((0..2).all(|k| (stepped[k] - after[k]).abs() < 1e-6), "{}", seen["still"]);
    assert_eq!(place("undone"), before);
    assert_eq!(seen["words3"], json!(["Give KEY=VALUE, as --set takes it.", ""]));
    assert_eq!((&seen["emptied"], &seen["counted"]), (&json!("1"), &json!(["update.damping=0.801"])));
    let files = std::fs::read_dir(folder.path()).expect("a folder").count();
    assert_eq!((&seen["savedOnce"], files), (&json!(true), 1));
}

#[test]
#[ignore = "needs Chromium, Node, playwright-core and axe-core: see tests/browser/main.rs"]
fn a_follower_does_not_lead_and_the_page_goes_on_saying_so() {
    let folder = temporary();
    let served = Served::swarm("square", &[], folder.path());
    let seen = tour(&served.address, &json!({ "name": "follower", "follower": 12 }));
    assert_in_windows(&seen);
    let words = ["`robot_13` does not lead: drag a leader", "Click a robot first."];
    assert_eq!(seen["follower"], json!([words[0], 0, words[1], "", ""]));
    assert_eq!(seen["chosen"], json!([["robot_13", "dead"], ["robot_1", ""]]));
    assert_eq!(seen["target"], true);
    let offered = seen["offered"].as_array().expect("listed");
    assert!(offered.contains(&json!("speed")) && offered.contains(&json!("acceleration")), "{offered:?}");
    assert!(seen["hint"].as_str().is_some_and(|text| text.contains("click a robot")), "{}", seen["hint"]);
}

#[cfg(feature = "cli")]
#[test]
#[ignore = "needs Chromium, Node, playwright-core and axe-core: see tests/browser/main.rs"]
fn a_flying_swarm_is_stopped_resumed_and_moved_from_its_node_s_page() {
    let flown =
        super::node::Flown::begin(&["--allow-commands", "--set", "flight.bounds.affine_error=0.0001"]);
    let seen = tour(&flown.address(), &json!({ "name": "node", "node": 0 }));
    let words = seen["alarms"][0].as_str().expect("a broken bound");
    assert!(words.starts_with("affine_error: declared 0.0001 m"), "{words}");
    assert_eq!(seen["isThere"], true);
    assert_eq!(seen["isInView"], true, "the view follows the swarm");
    assert_eq!(seen["beyond"].as_f64(), Some(0.0), "in no frame a robot reaches beyond the view");
}

#[test]
#[ignore = "needs Chromium, Node, playwright-core and axe-core, and prints frames a second: see tests/browser/main.rs"]
fn frames_a_second_of_ten_thousand_and_a_hundred_thousand_particles_are_measured() {
    for (name, rows) in [("10^4", 100), ("10^5", 316)] {
        let folder = temporary();
        let set = [
            format!("body.shape={{ kind = \"grid\", columns = {rows}, rows = {rows} }}"),
            "record={}".to_owned(),
        ];
        let served = Served::scene("shear", &set, folder.path());
        let seen = node("frames.mjs", &[&served.address, "6000", "role", "pe1"]);
        let seen = seen.as_array().expect("one of each quantity");
        assert_eq!(seen.len(), 2);
        for one in seen {
            println!("{name} particles, {}: {}", one["quantity"], one["words"]);
            assert!(one["measured"]["rate"].as_f64() > Some(0.0), "{one}");
        }
    }
}
