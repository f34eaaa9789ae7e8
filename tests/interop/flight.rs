//! The whole node between robots that a peer flies and a peer that watches.

use flockform::flock::vectors::distance;
use flockform::messages::flockform_msgs::{FormationState, MemberState};
use serde_json::json;

use super::support::*;

#[test]
#[ignore = "needs the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn robots_of_a_peer_fly_the_manoeuvre_that_the_node_leads() {
    let (square, domain) = (Square::new(&[&PATIENT, &SHORT]), domain());
    let mut node = square.start(domain, "node", &[]);
    let watch = watch(domain);
    let robots = square.robots(domain);
    let control = square.control();
    let formation = control.formation();
    let map = formation.affine(formation.programs_end()).expect("a manoeuvre");
    let led = |m: usize| map.apply(formation.places.get(m));
    let report = robots.until("everybody is where it was led", |report| {
        (apart(report, &formation.names, led) < 1e-9).then(|| report.clone())
    });
    assert_eq!(report["not_finite"], json!(0));
    let told = watch.until("the state says so", |line| {
        let state = state::of(line)?;
        let is_there = |member: &serde_json::Value, m: usize| {
            let at = [&member["position"]["x"], &member["position"]["y"]].map(|x| x.as_f64());
            let at = at[0].zip(at[1]);
            at.is_some_and(|(x, y)| distance([x, y], led(m)) < 1e-9)
        };
        let there = state::members(state).enumerate().all(|(m, member)| is_there(member, m));
        (there && state::all_fresh(state)).then(|| state.clone())
    });
    assert_eq!(told["formation"], json!("square"));
    assert_eq!(told["header"]["frame_id"], json!("map"));
    assert_eq!(told["mode"], json!(FormationState::RUNNING));
    assert_eq!(told["members"].as_array().map(Vec::len), Some(25));
    assert!(told["formation_error"].as_f64().is_some_and(|error| error < 1e-9), "{told}");
    let leads = |member: &serde_json::Value| member["role"] == json!(MemberState::LEADER);
    assert_eq!(state::who(&told, leads), ["robot_1", "robot_5", "robot_21", "robot_25"]);
    // A computer that is busy for a moment has the node warn of deadlines for a second.
    watch.until("diagnostics without a warning", |line| {
        (line.get("diagnostics")?["level"] == json!(0)).then_some(())
    });
    assert_eq!(node.terminate(), Some(0));
}

#[test]
#[ignore = "needs the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn a_member_s_own_node_hears_its_neighbours_alone_and_takes_its_robot_to_where_they_lead_it() {
    let alone = ["control.sweeps=1", "node.hears=\"neighbours\""];
    let (square, domain) = (Square::new(&[&PATIENT, &SHORT, &alone]), domain());
    let _node = square.start(domain, "node", &["--member", "robot_7"]);
    // Everybody else stands where the formation would be, moved: robot_7 alone has to catch up.
    let away = |place: [f64; 2]| [place[0] + 0.5, place[1] - 0.25];
    let spec = square.spec(|name, place| if name == "robot_7" { place } else { away(place) });
    let robots = Peer::start("robots.py", domain, &spec.to_string());
    let control = square.control();
    let nominal = control.formation().places.get(6);
    let near = |report: &serde_json::Value| {
        place(report, "robot_7").is_some_and(|at| distance(at, away(nominal)) < 1e-6)
    };
    let report =
        robots.until("robot_7 is among its neighbours", |report| near(report).then(|| report.clone()));
    // Column by column, five high: robot_7 is the second of the second column.
    let mut heard: Vec<String> =
        [1, 2, 3, 6, 7, 8, 11, 12, 13].iter().map(|number| format!("robot_{number}")).collect();
    heard.sort();
    assert_eq!(report["heard"], json!(heard));
    assert_eq!(report["sent_to"], json!(["robot_7"]));
    for (name, count) in received(&report) {
        assert_eq!(count > 0, name == "robot_7", "{name} was sent {count} targets");
    }
    // Its state speaks of it under a name of its own.
    let watch = Peer::start("watch.py", domain, "/robot_7/flockform");
    watch.until("its state", |line| {
        let known = state::who(state::of(line)?, |member| !member["position"]["x"].is_null());
        (known.len() == 9).then_some(())
    });
}
