//! The edge alone: discovery, topics, services, parameters and lifecycle against one peer.

use std::io::Read;
use std::process::Child;
use std::time::{Duration, Instant};

use flockform::messages::Message;
use flockform::messages::builtin_interfaces::Time;
use flockform::messages::std_srvs;
use flockform::ros::edge::lifecycle::Lifecycle;
use flockform::ros::edge::parameters::{Declaration, Parameters, Store, Value};
use flockform::ros::edge::{Edge, Node, Options, Quality};
use serde::{Deserialize, Serialize};
use serde_json::{Value as Json, json};

use super::support::{domain, python};

fn node(domain: u16) -> Node {
    let options = Options { domain, loopback_only: true };
    Edge::open(options).expect("sockets").node("/", "swarm").expect("a node")
}

fn peer(scenario: &str, domain: u16) -> Child {
    python("peer.py", &[scenario, &domain.to_string()]).spawn().expect("python starts")
}

/// Runs the peer through a scenario while `tick` serves it; what it found, line by line.
fn findings(scenario: &str, domain: u16, mut tick: impl FnMut()) -> Vec<Json> {
    let mut peer = peer(scenario, domain);
    let since = Instant::now();
    let status = loop {
        tick();
        if let Some(status) = peer.try_wait().expect("a child") {
            break status;
        }
        if since.elapsed() > Duration::from_secs(60) {
            peer.kill().expect("a child");
            peer.wait().expect("a child");
            panic!("{scenario}: the peer did not end within 60 s");
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    let mut lines = String::new();
    peer.stdout.take().expect("piped").read_to_string(&mut lines).expect("text");
    assert!(status.success(), "{scenario}: {status}, having found\n{lines}");
    lines.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect()
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct PoseStamped {
    stamp: Time,
    frame_id: String,
    position: [f64; 3],
    orientation: [f64; 4],
}

impl Message for PoseStamped {
    const PACKAGE: &str = "geometry_msgs";
    const NAME: &str = "PoseStamped";
}

#[test]
#[ignore = "needs the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn a_peer_sees_each_node_and_what_it_owns() {
    let domain = domain();
    let swarm = node(domain);
    let robot = swarm.another_node("/robot_1", "driver").expect("a node");
    let _out = robot.publisher::<PoseStamped>("/robot_1/pose", Quality::BEST_EFFORT).expect("out");
    let _service = swarm.service::<std_srvs::Trigger>("/swarm/stop").expect("a service");
    let expected = [
        json!({"node": "/robot_1 driver", "readers": 0, "writers": 2}),
        json!({"node": "/ swarm", "readers": 1, "writers": 2}),
    ];
    assert_eq!(findings("graph", domain, || {}), expected);
}

#[test]
#[ignore = "needs the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn poses_of_a_peer_come_in_and_targets_go_out_to_it() {
    let domain = domain();
    let swarm = node(domain);
    let poses = swarm.subscription::<PoseStamped>("/robot_1/pose", Quality::BEST_EFFORT).expect("in");
    let targets = swarm.publisher("/robot_1/target_pose", Quality::reliable(10)).expect("out");
    // Killed and started again: the second peer is served like the first.
    for _ in 0..2 {
        let mut silent = peer("late", domain);
        std::thread::sleep(Duration::from_millis(500));
        silent.kill().expect("a child");
        silent.wait().expect("a child");
        let found = findings("poses", domain, || {
            while let Some((mut pose, stamps)) = poses.take() {
                assert!(stamps.sent.is_some());
                pose.position[0] *= 2.0;
                targets.publish(&pose).expect("sent");
            }
        });
        let expected = json!({
            "frame": "map",
            "stamp": [7, 8],
            "position": [3.0, 2.5, 3.5],
            "orientation": [0.0, 0.0, 0.6, 0.8],
        });
        assert_eq!(found, [expected]);
        assert_eq!(poses.refused(), 0);
    }
}

#[test]
#[ignore = "needs the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn a_peer_that_comes_late_gets_what_was_kept() {
    let domain = domain();
    let swarm = node(domain);
    let kept = swarm.publisher("/kept", Quality::transient_local(1)).expect("out");
    let pose = PoseStamped {
        stamp: Time::default(),
        frame_id: "map".into(),
        position: [4.5, 0.0, 0.0],
        orientation: [0.0, 0.0, 0.0, 1.0],
    };
    kept.publish(&pose).expect("sent");
    assert_eq!(findings("late", domain, || {}), [json!({"x": 4.5})]);
}

#[test]
#[ignore = "needs the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn requests_with_cyclones_header_are_answered_each_to_its_client() {
    let domain = domain();
    let swarm = node(domain);
    let stop = swarm.service::<std_srvs::Trigger>("/swarm/stop").expect("a service");
    let mut served = 0;
    let found = findings("trigger", domain, || {
        stop.serve(|_| {
            served += 1;
            std_srvs::Outcome { success: served % 2 == 1, message: format!("call {served}") }
        });
    });
    let mut expected = Vec::new();
    for (round, guid) in (1..=3).flat_map(|round| [(round, 3), (round, 4)]) {
        let call = expected.len() + 1;
        let message = format!("call {call}");
        expected.push(json!({"guid": guid, "seq": round, "success": call % 2 == 1, "message": message}));
    }
    assert_eq!(found, expected);
    assert_eq!((served, stop.refused()), (6, 0));
}

#[test]
#[ignore = "needs the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn a_peer_gets_and_sets_parameters_within_their_bounds() {
    let domain = domain();
    let swarm = node(domain);
    let mut store = Store::default();
    store.declare(Declaration::new("rate", 50.0).range(1.0..=500.0), None).expect("declared once");
    let mut parameters = Parameters::open(&swarm, store, true).expect("services");
    let mut changes = Vec::new();
    let found = findings("parameters", domain, || changes.extend(parameters.poll(0.0, None)));
    assert_eq!(
        found[..3],
        [json!({"names": ["rate"]}), json!({"rate": 50.0}), json!({"successful": true, "reason": ""}),]
    );
    assert_eq!(found[3]["successful"], json!(false));
    assert!(
        found[3]["reason"].as_str().is_some_and(|reason| reason.contains("1.0 to 500.0")),
        "{:?}",
        found[3]
    );
    assert_eq!(found[4], json!({"rate": 120.0}));
    assert_eq!(changes.len(), 1);
    assert_eq!(changes[0].value, Value::Double(120.0));
}

#[test]
#[ignore = "needs the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn a_peer_drives_the_lifecycle() {
    let domain = domain();
    let swarm = node(domain);
    let mut lifecycle = Lifecycle::open(&swarm, [true; 2]).expect("services");
    let found = findings("lifecycle", domain, || lifecycle.poll(0.0, &|_| true, &mut |_| true));
    let expected = [
        json!({"state": "unconfigured"}),
        json!({"success": false, "state": "unconfigured"}),
        json!({"success": true, "state": "inactive"}),
        json!({"success": true, "state": "active"}),
    ];
    assert_eq!(found, expected);
    assert!(lifecycle.is_active());
}
