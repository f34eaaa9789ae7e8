//! The nodes that the simulated robots are to others.

use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use flockform::flock::vectors::distance;
use flockform::messages::geometry_msgs::{Pose, PoseArray, PoseStamped};
use flockform::messages::rcl_interfaces::{
    GetLoggerLevels, GetParameters, ListParameters, ListParametersRequest, Names,
};
use flockform::messages::type_description_interfaces::{GetTypeDescription, GetTypeDescriptionRequest};
use flockform::ros::arguments::Severity;
use flockform::ros::edge::loggers::LogLevel;
use flockform::ros::edge::parameters::Value;
use flockform::ros::edge::{Node, Quality};
use flockform::ros::robots::{Layout, RobotNodes};
use ros2_client::ServiceMapping;

use super::formation::{PATIENT, Swarming, arguments, square};
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

/// Of robots that fly by their model poses of other times would be no poses of such robots.
#[test]
fn poses_bear_the_time_at_which_robots_are_there_however_late_the_computer_is() {
    let peers = peers();
    let watch = peers.theirs.node("/", "stopwatch").expect("a node");
    let poses = watch.subscription::<PoseStamped>("/robot_1/pose", Quality::BEST_EFFORT).expect("hears");
    let file = square(&["control.period=0.02"]);
    let mut robots = RobotNodes::open(&file, &arguments(&[]), Layout::OneNode).expect("robots");
    let mut stamps: Vec<f64> = Vec::new();
    let begun = Instant::now();
    robots.run_while(&AtomicBool::new(false), &mut |robots| {
        stamps.extend(std::iter::from_fn(|| poses.take()).map(|(pose, _)| pose.header.stamp.seconds()));
        // In some periods it begins late.
        std::thread::sleep(Duration::from_millis(15 + 9 * (robots.fleet().period() % 3)));
        stamps.len() < 60 && begun.elapsed() < PATIENCE
    });
    let off = |pair: &[f64]| {
        let periods = (pair[1] - pair[0]) / 0.02;
        (periods - periods.round()).abs()
    };
    let late = stamps.windows(2).filter(|pair| off(pair) > 0.05).count();
    assert!(stamps.len() >= 60 && late <= 6, "{late} of {}: {stamps:?}", stamps.len());
}

/// As it does with a topic for each robot: the one named drops out, and no other.
#[test]
fn an_array_of_poses_has_the_faults_of_each_robot_alone() {
    let _peers = peers();
    let faults = "flight.faults=[{ robot = \"robot_2\", at = 0.0, what = { kind = \"silent\" } }, \
                  { robot = \"robot_3\", at = 0.0, what = { kind = \"not-a-number\" } }, \
                  { robot = \"robot_25\", at = 0.0, what = { kind = \"wrong-frame\" } }]";
    let mut swarm =
        Swarming::open(&square(&[&PATIENT[..], &["node.pose_type=\"pose-array\"", faults]].concat()), &[]);
    let of = |swarm: &Swarming, m: usize| {
        let counts = swarm.node.control().watch().counts(m);
        [counts.accepted, counts.rejected()]
    };
    swarm.fly_until("both arrays are heard", |swarm| of(swarm, 0)[0] > 5 && of(swarm, 24)[1] > 5);
    assert_eq!(of(&swarm, 1), [0, 0], "a silent robot is not there");
    for m in [2, 24] {
        assert!(of(&swarm, m)[0] == 0 && of(&swarm, m)[1] > 5, "{m}: {:?}", of(&swarm, m));
    }
    for m in (0..24).filter(|m| ![1, 2].contains(m)) {
        assert!(of(&swarm, m)[0] > 5 && of(&swarm, m)[1] == 0, "{m}: {:?}", of(&swarm, m));
    }
}

#[test]
fn an_array_of_another_number_of_targets_moves_no_robot() {
    let peers = peers();
    let sender = peers.theirs.node("/", "sender").expect("a node");
    let targets = sender.publisher::<PoseArray>("/all/targets", Quality::reliable(1)).expect("out");
    let file = square(&["node.target_type=\"pose-array\"", "node.target_topic=\"/all/targets\""]);
    let mut robots = RobotNodes::open(&file, &arguments(&[]), Layout::OneNode).expect("robots");
    let begun: Vec<[f64; 2]> = robots.fleet().places().iter().collect();
    // As seen when it has been sent for a while, long enough for it to come.
    let mut send = |count: usize| {
        for _ in 0..40 {
            let poses =
                (0..count).map(|m| Pose::planar([begun[m % 25][0] + 1.0, begun[m % 25][1]], 0.0)).collect();
            targets.publish(&PoseArray { poses, ..PoseArray::default() }).expect("sent");
            std::thread::sleep(Duration::from_millis(5));
            robots.tick();
        }
        let places = robots.fleet().places();
        places.iter().zip(&begun).map(|(now, then)| distance(now, *then)).fold(0.0, f64::max)
    };
    for count in [0, 24, 26] {
        assert_eq!(send(count), 0.0, "{count} targets of 25 robots");
    }
    until("each goes to its own", || ((send(25) - 1.0).abs() < 0.05).then_some(()));
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

#[test]
fn the_node_of_all_robots_has_the_services_that_the_swarm_file_asks_for() {
    let mut peers = peers();
    let asked_for = ["node.services=[\"type-description\", \"logger-levels\"]"];
    let swarm = square(&[&PATIENT[..], &asked_for].concat());
    let mut robots = RobotNodes::open(&swarm, &arguments(&[]), Layout::OneNode).expect("robots");
    let (get, set) = (Box::new(|| Severity::Warn), Box::new(|_| Err("as it is".to_owned())));
    robots.share_log(Some(LogLevel { get, set }), None).expect("services");
    let mut tick = || {
        robots.tick();
        std::thread::sleep(Duration::from_millis(5));
    };
    let mapping = ServiceMapping::Enhanced;
    let get = client::<GetLoggerLevels>(&mut peers, mapping, "/robots/get_logger_levels");
    let levels = call::<GetLoggerLevels>(&get, &Names { names: vec!["robots".into()] }, &mut tick).levels;
    assert_eq!(levels[0].level, 30);
    let ask = client::<GetTypeDescription>(&mut peers, mapping, "/robots/get_type_description");
    let type_name = "geometry_msgs/msg/PoseStamped".to_owned();
    let asked = GetTypeDescriptionRequest { type_name, ..Default::default() };
    let answer = call::<GetTypeDescription>(&ask, &asked, &mut tick);
    assert!(answer.successful, "{}", answer.failure_reason);
}
