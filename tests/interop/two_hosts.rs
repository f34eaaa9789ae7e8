//! Two hosts: network namespaces of the test, joined by a cable (veth), with nothing else on it.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use super::support::*;

/// Process of the other host, for the test that runs inside.
const OTHER: &str = "FLOCKFORM_OTHER_HOST";
const INNER: &str = "two_hosts::node_and_robots_on_two_hosts_inside";

/// Makes the hosts and ends with the test's own exit code.
const SCRIPT: &str = "unshare --net sleep 240 & other=$! \
     && until [ -e /proc/$other/ns/net ] && ! [ /proc/$other/ns/net -ef /proc/self/ns/net ]; do sleep 0.05; done \
     && ip link set lo up && ip link add cable type veth peer name cable2 netns $other \
     && ip addr add 10.17.0.1/24 dev cable && ip link set cable up && ip route add default dev cable \
     && nsenter --target $other --net sh -c 'ip link set lo up && ip addr add 10.17.0.2/24 dev cable2 \
          && ip link set cable2 up && ip route add default dev cable2' \
     && FLOCKFORM_OTHER_HOST=$other \"$0\" --ignored --exact --nocapture \"$1\"; code=$?; kill $other; exit $code";

#[test]
#[ignore = "needs unshare(1), nsenter(1) and leave to use them, and the cyclonedds package of PyPI"]
fn node_and_robots_on_two_hosts_fly_and_see_each_other_leave() {
    let here = std::env::current_exe().expect("a path");
    let inside = Command::new("unshare")
        .args(["--map-root-user", "--net", "sh", "-c", SCRIPT])
        .arg(here)
        .arg(INNER)
        .output()
        .expect("unshare starts");
    let said = String::from_utf8_lossy(&inside.stdout);
    let wrong = String::from_utf8_lossy(&inside.stderr);
    let is_flown = said.contains("1 passed") && said.contains("gone after");
    assert!(inside.status.success() && is_flown, "{said}\n{wrong}");
}

/// A command on the other host.
fn there(other: &str, command: &Command) -> Command {
    let mut entered = Command::new("nsenter");
    entered.args(["--target", other, "--net"]).arg(command.get_program()).args(command.get_args());
    entered.envs(command.get_envs().filter_map(|(name, value)| Some((name, value?))));
    entered.stdin(Stdio::piped()).stdout(Stdio::piped());
    entered
}

/// A peer on the other host.
fn peer(other: &str, script: &'static str, domain: u16, argument: &str) -> Peer {
    let device = "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name=\"cable2\"/></Interfaces></General>\
         </Domain></CycloneDDS>";
    let mut command = python(script, &[&domain.to_string(), argument]);
    command.env("CYCLONEDDS_URI", device);
    Peer::of(script, there(other, &command))
}

#[test]
#[ignore = "is run by the test above, between its hosts"]
fn node_and_robots_on_two_hosts_inside() {
    let Ok(other) = std::env::var(OTHER) else { return };
    let (square, domain) = (Square::new(&[&PATIENT, &SHORT]), domain());
    let graph = peer(&other, "graph.py", domain, "");
    let count = |line: &serde_json::Value| line["participants"].as_array().map(Vec::len);
    let robots = peer(&other, "robots.py", domain, &square.spec(|_, place| place).to_string());
    graph.until("the robots", |line| (count(line)? == 1).then_some(()));
    let mut node = square.start_anywhere(domain, "node");
    graph.until("the node", |line| (count(line)? == 2).then_some(()));
    let control = square.control();
    let formation = control.formation();
    let map = formation.affine(formation.programs_end()).expect("a manoeuvre");
    let led = |m: usize| map.apply(formation.places.get(m));
    let report = robots.until("everybody is where it was led", |report| {
        (apart(report, &formation.names, led) < 1e-9).then(|| report.clone())
    });
    println!("targets by robot: {:?}", received(&report));
    assert_eq!(report["not_finite"], 0);
    assert_eq!(node.terminate(), Some(0));
    let since = Instant::now();
    graph.until("the leave", |line| (count(line)? == 1).then_some(()));
    let took = since.elapsed();
    println!("gone after {took:?}");
    assert!(took < Duration::from_secs(1), "{took:?}");
}

#[test]
#[ignore = "needs the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn two_fleets_in_two_namespaces_fly_beside_each_other() {
    let domain = domain();
    let ways = [("left", "[2.0, 0.5]"), ("right", "[-1.5, 1.0]")];
    let fleets = ways.map(|(namespace, way)| {
        let legs = format!("manoeuvres[0].legs=[{{ seconds = 1.0, translate = {way} }}]");
        let square = Square::new(&[&PATIENT, &[&legs, "limits.speed=2.0"]]);
        let remap = format!("__ns:=/{namespace}");
        let node = square.start(domain, "node", &["--ros-args", "-r", &remap]);
        let control = square.control();
        let names: Vec<String> =
            control.formation().names.iter().map(|name| format!("{namespace}/{name}")).collect();
        let mut spec = square.spec(|_, place| place);
        let places = names.iter().zip(control.formation().places.iter());
        let robots: serde_json::Map<String, serde_json::Value> =
            places.map(|(name, place)| (name.clone(), serde_json::json!(place))).collect();
        spec["robots"] = robots.into();
        let robots = Peer::start("robots.py", domain, &spec.to_string());
        (node, control, names, robots)
    });
    for (_node, control, names, robots) in &fleets {
        let formation = control.formation();
        let map = formation.affine(formation.programs_end()).expect("a manoeuvre");
        let led = |m: usize| map.apply(formation.places.get(m));
        robots.until("each fleet is where its own node led it", |report| {
            (apart(report, names, led) < 1e-9).then_some(())
        });
    }
}
