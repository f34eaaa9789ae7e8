//! The node's services, asked as a ROS 2 tool on Cyclone DDS asks.

use std::time::Duration;

use flockform::messages::flockform_msgs::FormationState;
use serde_json::{Value as Json, json};

use super::support::*;

/// A node with robots that hear it, and somebody who asks.
struct Asked {
    watch: Peer,
    robots: Peer,
    names: Vec<String>,
    square: Square,
    _node: Running,
}

impl Asked {
    fn open(overrides: &[&str]) -> Self {
        let (square, domain) = (Square::new(&[&PATIENT, overrides]), domain());
        let node = square.start(domain, "node", &[]);
        let (watch, robots) = (watch(domain), square.robots(domain));
        watch.until("everybody is heard", |line| state::all_fresh(state::of(line)?).then_some(()));
        let names = square.control().formation().names.clone();
        Self { watch, robots, names, square, _node: node }
    }

    fn ask(&mut self, service: &str, body: Json) -> Json {
        self.watch.send(json!({"call": service, "with": body}));
        self.watch.until(service, |line| line.get("reply").cloned())
    }

    /// Targets that come to all robots in this time.
    fn targets(&self, time: Duration) -> u64 {
        let total = |report: &Json| received(report).values().sum::<u64>();
        self.robots.skip();
        let before = self.robots.until("a report", |report| Some(total(report)));
        let mut after = before;
        self.robots.during(time, |report| after = total(report));
        after - before
    }

    /// What the node says of itself after a change; one report may have been on its way.
    fn mode(&self) -> u64 {
        self.watch.skip();
        let mode = || self.watch.until("a state", |line| state::of(line)?["mode"].as_u64());
        mode();
        mode()
    }

    /// Waits until every robot stands where `posture` takes its place.
    fn until_there(&self, what: &str, posture: impl Fn([f64; 2]) -> [f64; 2]) {
        let places = self.square.control().formation().places.clone();
        self.robots.until(what, |report| {
            (apart(report, &self.names, |m| posture(places.get(m))) < 1e-9).then_some(())
        });
    }
}

#[test]
#[ignore = "needs the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn parameters_are_listed_described_and_changed_within_their_ranges() {
    // The leaders are far ahead of what the speed limit allows, so the limit is what everybody flies at.
    let far = "manoeuvres[0].legs=[{ seconds = 0.05, translate = [1000.0, 0.0] }]";
    let mut asked = Asked::open(&[far, "limits.speed=1.0"]);
    let listed = asked.ask("list_parameters", json!(null));
    let names = ["rate", "state_rate", "speed_limit", "acceleration_limit", "clearance", "damping"];
    let listed: Vec<&str> =
        listed["names"].as_array().expect("names").iter().filter_map(Json::as_str).collect();
    names.iter().for_each(|name| assert!(listed.contains(name), "{name} is not among {listed:?}"));

    let described = asked.ask("describe_parameters", json!(["speed_limit", "rate"]));
    let range = |k: usize| described["descriptors"][k]["floating_point_range"].clone();
    assert_eq!(range(0), json!([{"from_value": 0.0, "to_value": 1.0, "step": 0.0}]));
    assert_eq!(range(1), json!([{"from_value": 1.0, "to_value": 500.0, "step": 0.0}]));
    assert!(described["descriptors"][0]["description"].as_str().is_some_and(|text| text.contains("[m/s]")));

    // A robot of the peer is at its target a period later: each step is what the limit allows.
    assert!((asked.step() - 0.05).abs() < 1e-9);
    let set = asked.ask("set_parameters", json!({"speed_limit": 0.4}));
    assert_eq!(set["results"], json!([{"successful": true, "reason": ""}]));
    asked.until_step(0.02);
    let refused = asked.ask("set_parameters", json!({"speed_limit": -1.0}));
    assert_eq!(refused["results"][0]["successful"], json!(false));
    let reason = refused["results"][0]["reason"].as_str().expect("a reason");
    assert!(reason.contains("0.0 to 1.0"), "{reason}");
    let unknown = asked.ask("set_parameters", json!({"no_such_parameter": 1.0}));
    assert_eq!(unknown["results"][0]["successful"], json!(false));
    let got = asked.ask("get_parameters", json!(["speed_limit"]));
    assert_eq!(got["values"][0]["double_value"], json!(0.4));

    // Half the rate, twice the step.
    let set = asked.ask("set_parameters", json!({"rate": 10.0}));
    assert_eq!(set["results"][0]["successful"], json!(true));
    asked.until_step(0.04);
    asked.watch.until("diagnostics tell the new rate", |line| {
        let rate = state::diagnostic(line, "rate [Hz]")?;
        ((rate - 10.0).abs() < 1.5).then_some(())
    });
}

impl Asked {
    /// How far before its robot the target of robot_13 is in a state that was computed with all poses new.
    fn step(&self) -> f64 {
        self.watch.skip();
        self.watch.until("a state", |line| Some(ahead(state::of(line)?)))
    }

    fn until_step(&self, step: f64) {
        self.watch.until(&format!("targets {step} m ahead"), |line| {
            ((ahead(state::of(line)?) - step).abs() < 1e-9).then_some(())
        });
    }
}

fn ahead(state: &Json) -> f64 {
    let member = &state["members"][12];
    let x = |point: &str| member[point]["x"].as_f64().expect("a number");
    x("target") - x("position")
}

#[test]
#[ignore = "needs the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn the_lifecycle_switches_targets_off_and_on() {
    let mut asked = Asked::open(&SHORT);
    let second = Duration::from_secs(1);
    assert_eq!(asked.ask("get_state", json!(null))["current_state"], json!({"id": 3, "label": "active"}));
    assert!(asked.targets(second) > 100);
    assert_eq!(asked.ask("change_state", json!("deactivate"))["success"], json!(true));
    assert_eq!(asked.ask("get_state", json!(null))["current_state"]["label"], json!("inactive"));
    assert_eq!(asked.mode(), u64::from(FormationState::INACTIVE));
    assert_eq!(asked.targets(second), 0);
    assert_eq!(asked.ask("change_state", json!("deactivate"))["success"], json!(false), "it is inactive");
    assert_eq!(asked.ask("change_state", json!("activate"))["success"], json!(true));
    assert!(asked.targets(second) > 100);
    assert_eq!(asked.mode(), u64::from(FormationState::RUNNING));
}

#[test]
#[ignore = "needs the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn the_lines_of_the_log_come_by_topic_even_to_a_late_joiner() {
    let (square, domain) = (Square::new(&[&PATIENT]), domain());
    let _node = square.start(domain, "node", &[]);
    let _robots = square.robots(domain);
    let early = watch(domain);
    early.until("everybody is heard", |line| state::all_fresh(state::of(line)?).then_some(()));
    let line = watch(domain).until("the first lines", |line| {
        line.get("log")
            .filter(|log| log["message"].as_str().is_some_and(|text| text.contains("25 robots")))
            .cloned()
    });
    assert_eq!((&line["level"], &line["name"]), (&json!(20), &json!("flockform")));
    assert!(line["file"].as_str().is_some_and(|file| file.ends_with(".rs")), "{line}");
    // Of a node that leaves it out no line comes.
    let quiet = square.start(domain, "node", &["--ros-args", "-r", "__node:=quiet", "--disable-rosout-logs"]);
    early.skip();
    early.during(Duration::from_secs(2), |line| assert_ne!(line["log"]["name"], json!("quiet"), "{line}"));
    drop(quiet);
}

#[test]
#[ignore = "needs the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn an_emergency_stop_holds_everybody_whatever_else_is_asked_until_it_is_lifted() {
    let slow = ["manoeuvres[0].legs=[{ seconds = 100.0, translate = [50.0, 0.0] }]", "limits.speed=2.0"];
    let mut asked = Asked::open(&slow);
    assert_eq!(asked.ask("emergency_stop", json!(null))["success"], json!(true));
    assert_eq!(asked.mode(), u64::from(FormationState::EMERGENCY_STOPPED));
    let rest = |asked: &Asked| {
        asked.robots.skip();
        asked.robots.until("a report", |report| Some(report["places"].clone()))
    };
    // One report may have been on its way.
    asked.robots.during(Duration::from_millis(500), |_| ());
    let before = rest(&asked);
    let moved = asked.ask("set_formation", json!({"translate": [9.0, 9.0], "duration": 10.0}));
    assert_eq!(moved["success"], json!(true), "it is under way once the stop is lifted");
    asked.ask("change_state", json!("deactivate"));
    asked.ask("change_state", json!("activate"));
    assert_eq!(asked.mode(), u64::from(FormationState::EMERGENCY_STOPPED), "the stop is latched");
    asked.robots.during(Duration::from_millis(500), |_| ());
    assert_eq!(rest(&asked), before);
    let status = asked.watch.until("diagnostics", |line| line.get("diagnostics").cloned());
    assert_eq!((&status["level"], &status["message"]), (&json!(2), &json!("emergency stop")));
    assert_eq!(asked.ask("resume", json!(null))["success"], json!(true));
    asked.until_there("the formation goes on", |[x, y]| [x + 9.0, y + 9.0]);
    assert_eq!(asked.ask("resume", json!(null))["success"], json!(false), "there is nothing left to lift");
}

#[test]
#[ignore = "needs the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn the_formation_is_set_by_name_and_by_numbers_and_nonsense_is_refused() {
    let mut asked = Asked::open(&[SHORT[0], "limits.speed=20.0"]);
    let control = asked.square.control();
    let formation = control.formation();
    let turned = formation.affine(formation.programs_end()).expect("a manoeuvre");
    asked.until_there("the file's own manoeuvre is flown", |place| turned.apply(place));
    let by_numbers = json!({"translate": [-1.0, 2.0], "stretch": [1.2, 1.1], "duration": 6.0});
    assert_eq!(asked.ask("set_formation", by_numbers)["success"], json!(true));
    let [x0, y0] = formation.middle();
    let stretched = |[x, y]: [f64; 2]| [x0 - 1.0 + 1.2 * (x - x0), y0 + 2.0 + 1.1 * (y - y0)];
    asked.until_there("everybody is where the numbers say", stretched);
    let nonsense = [
        (json!({"name": "no such manoeuvre"}), "there are: turn"),
        (json!({"duration": 0.0}), "give a positive one"),
        (json!({"duration": -1.0}), "give a positive one"),
        // JSON has no such numbers; the peer makes them of these words.
        (json!({"rotate": "inf", "duration": 1.0}), "not finite"),
        (json!({"translate": ["nan", 0.0], "duration": 1.0}), "not finite"),
        (json!({"stretch": [0.0, 1.0], "duration": 1.0}), "one line or point"),
    ];
    for (body, reason) in nonsense {
        let refused = asked.ask("set_formation", body.clone());
        assert_eq!(refused["success"], json!(false), "{body}");
        assert!(refused["message"].as_str().is_some_and(|said| said.contains(reason)), "{refused}");
    }
    asked.robots.during(Duration::from_millis(500), |_| ());
    asked.until_there("nonsense moves nobody", stretched);
    assert_eq!(asked.ask("set_formation", json!({"name": "turn"}))["success"], json!(true));
    asked.until_there("everybody is where the manoeuvre leads", |place| turned.apply(place));
}
