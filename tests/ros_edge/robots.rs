//! The nodes that the simulated robots are to others.

use std::time::Duration;

use flockform::messages::rcl_interfaces::{GetParameters, ListParameters, ListParametersRequest, Names};
use flockform::ros::edge::Node;
use flockform::ros::edge::parameters::Value;
use flockform::ros::robots::{Layout, RobotNodes};
use ros2_client::ServiceMapping;

use super::formation::{PATIENT, arguments, square};
use super::support::*;

#[test]
fn robots_are_one_node_or_a_node_each() {
    let peers = peers();
    // A node learns which others bear its name: one for each that could be there.
    let probes = [("/", "robots"), ("/robot_1", "robot"), ("/robot_25", "robot")];
    let probes: Vec<Node> =
        probes.map(|(namespace, name)| peers.theirs.node(namespace, name).expect("a node")).into();
    for (layout, announced) in [(Layout::OneNode, [1, 0, 0]), (Layout::NodePerRobot, [0, 1, 1])] {
        let mut robots = RobotNodes::open(&square(&PATIENT), &arguments(&[]), layout).expect("robots");
        let words = robots.reached_at();
        assert!(
            words.contains("poses to /robot_1/pose") && words.contains("targets from /robot_1/"),
            "{words}"
        );
        let what = format!("the nodes of {layout:?}");
        until(&what, || {
            robots.tick();
            std::thread::sleep(Duration::from_millis(5));
            let found: Vec<usize> = probes.iter().map(Node::twins).collect();
            (found == announced).then_some(())
        });
    }
}

/// Or `ros2 param list` waits five seconds for them.
#[test]
fn the_node_of_all_robots_answers_for_its_parameters() {
    let mut peers = peers();
    let arguments = arguments(&["-p", "publish_clock:=true"]);
    let mut robots = RobotNodes::open(&square(&PATIENT), &arguments, Layout::OneNode).expect("robots");
    let mut tick = || {
        robots.tick();
        std::thread::sleep(Duration::from_millis(5));
    };
    let mapping = ServiceMapping::Enhanced;
    let list = client::<ListParameters>(&mut peers, mapping, "/robots/list_parameters");
    let listed = call::<ListParameters>(&list, &ListParametersRequest::default(), &mut tick);
    assert_eq!(listed.names, ["publish_clock"]);
    let get = client::<GetParameters>(&mut peers, mapping, "/robots/get_parameters");
    let got = call::<GetParameters>(&get, &Names { names: listed.names }, &mut tick);
    assert_eq!(got.values, [Value::Bool(true).to_wire()]);
}
