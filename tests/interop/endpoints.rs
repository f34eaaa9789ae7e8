//! The endpoints that a fleet has on the network: few, and none that the swarm file does not ask for.

use serde_json::Value as Json;

use super::support::*;

/// Poses and targets of all robots in one message each.
const ARRAYS: [&str; 2] = ["node.pose_type=\"pose-array\"", "node.target_type=\"pose-array\""];

/// The topics of the writers or readers, without those of this participant's own pair, whose name is another each time.
fn topics(line: &Json, of: &str) -> Vec<String> {
    let all = line[of].as_array().expect("a graph");
    let names = all.iter().map(|name| name.as_str().expect("a name").to_owned());
    names.filter(|name| !name.starts_with("flockform_loop")).collect()
}

fn sorted(names: &[&str]) -> Vec<String> {
    let mut names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
    names.sort();
    names
}

/// Waits until the process has these endpoints and, a second later, no others.
fn has(graph: &Peer, writers: &[&str], readers: &[&str]) {
    let expected = [sorted(writers), sorted(readers)];
    let found = |line: &Json| ["writers", "readers"].map(|of| topics(line, of));
    let mut last = graph.until("all endpoints", |line| {
        let [written, read] = found(line);
        (written.len() >= expected[0].len() && read.len() >= expected[1].len()).then(|| found(line))
    });
    graph.during(std::time::Duration::from_secs(1), |line| last = found(line));
    assert_eq!(last, expected);
}

#[test]
#[ignore = "needs the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn a_fleet_in_arrays_has_two_endpoints_of_data_and_services_that_were_asked_for() {
    let square = Square::new(&[
        &PATIENT,
        &ARRAYS,
        &["node.services=[]", "node.commands=\"none\"", "node.markers=false"],
    ]);
    let domain = domain();
    let graph = Peer::start("graph.py", domain, "");
    let mut robots = square.start(domain, "robots", &[]);
    let writers = ["ros_discovery_info", "rt/poses", "rt/rosout", "rt/tf"];
    has(&graph, &writers, &["ros_discovery_info", "rt/diagnostics", "rt/target_poses"]);
    assert_eq!(robots.terminate(), Some(0));
    graph.until("the leave", |line| topics(line, "writers").is_empty().then_some(()));
    let _node = square.start(domain, "node", &[]);
    let replies = ["emergency_stop", "resume", "set_formation"].map(|one| format!("rr/flockform/{one}Reply"));
    let requests = replies.each_ref().map(|one| one.replacen("rr", "rq", 1).replace("Reply", "Request"));
    let mut writers =
        vec!["ros_discovery_info", "rt/target_poses", "rt/flockform/state", "rt/diagnostics", "rt/rosout"];
    writers.extend(replies.iter().map(String::as_str));
    let mut readers = vec!["ros_discovery_info", "rt/poses"];
    readers.extend(requests.iter().map(String::as_str));
    has(&graph, &writers, &readers);
}

#[test]
#[ignore = "needs the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn robots_of_a_peer_fly_by_one_array_of_targets() {
    let (square, domain) = (Square::new(&[&PATIENT, &SHORT, &ARRAYS]), domain());
    let _node = square.start(domain, "node", &[]);
    let mut spec = square.spec(|_, place| place);
    spec["pose_type"] = "pose-array".into();
    spec["pose_topic"] = "/poses".into();
    spec["target_topic"] = "/target_poses".into();
    let robots = Peer::start("robots.py", domain, &spec.to_string());
    let control = square.control();
    let formation = control.formation();
    let map = formation.affine(formation.programs_end()).expect("a manoeuvre");
    let led = |m: usize| map.apply(formation.places.get(m));
    let report = robots.until("everybody is where it was led", |report| {
        (apart(report, &formation.names, led) < 1e-9).then(|| report.clone())
    });
    assert_eq!(report["not_finite"], 0);
}
