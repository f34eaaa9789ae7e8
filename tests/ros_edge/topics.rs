//! Publishers, subscriptions and the clock.

use flockform::messages::Message;
use flockform::messages::builtin_interfaces::Time;
use flockform::messages::rosgraph_msgs;
use flockform::ros::edge::Quality;
use flockform::ros::edge::clock::Clock;
use serde::{Deserialize, Serialize};

use super::support::*;

#[test]
fn poses_go_in_and_targets_go_out() {
    let peers = peers();
    let node = peers.ours.node("/", "swarm").expect("a node");
    let robot = peers.theirs.node("/robot_1", "driver").expect("a node");
    let poses_in = node.subscription::<PoseStamped>("/robot_1/pose", Quality::BEST_EFFORT).expect("in");
    let targets_out = node.publisher("/robot_1/target_pose", Quality::reliable(10)).expect("out");
    let poses_out = robot.publisher("/robot_1/pose", Quality::BEST_EFFORT).expect("out");
    let targets_in =
        robot.subscription::<PoseStamped>("/robot_1/target_pose", Quality::reliable(10)).expect("in");
    meet(&poses_out, &poses_in);
    meet(&targets_out, &targets_in);

    assert_eq!(poses_in.take(), None, "nothing was sent");
    poses_out.publish(&pose(1.5)).expect("sent");
    let (came, stamps) = until("a pose", || poses_in.take());
    assert_eq!(came, pose(1.5));
    let sent = stamps.sent.expect("stamped");
    assert!((0.0..10.0).contains(&(stamps.received - sent)), "{stamps:?}");

    for x in [1.0, 2.0, 3.0] {
        targets_out.publish(&pose(x)).expect("sent");
    }
    for x in [1.0, 2.0, 3.0] {
        assert_eq!(until("a target", || targets_in.take()).0, pose(x));
    }
    // The newest alone, once all have come.
    for x in [4.0, 5.0] {
        poses_out.publish(&pose(x)).expect("sent");
    }
    // Time for both to come, so that the older one is there to be passed over.
    std::thread::sleep(std::time::Duration::from_millis(300));
    until("the last pose", || poses_in.take_last().filter(|(pose, _)| pose.position[0] == 5.0));
    assert_eq!(poses_in.take(), None);
}

/// Goes by the name of a pose and is none.
#[derive(Serialize, Deserialize)]
struct Lie([u8; 3]);

impl Message for Lie {
    const PACKAGE: &str = PoseStamped::PACKAGE;
    const NAME: &str = PoseStamped::NAME;
}

#[test]
fn payloads_that_lie_are_counted_and_skipped() {
    let peers = peers();
    let node = peers.ours.node("/", "listener").expect("a node");
    let liar = peers.theirs.node("/", "liar").expect("a node");
    let come = node.subscription::<PoseStamped>("/lies", Quality::reliable(10)).expect("in");
    let lies = liar.publisher("/lies", Quality::reliable(10)).expect("out");
    let truths = liar.publisher("/lies", Quality::reliable(10)).expect("out");
    until("a match", || (come.matched() == 2 && lies.matched() == 1 && truths.matched() == 1).then_some(()));
    lies.publish(&Lie([1, 2, 3])).expect("sent");
    until("a refusal", || {
        assert_eq!(come.take(), None);
        (come.refused() == 1).then_some(())
    });
    truths.publish(&pose(1.0)).expect("sent");
    assert_eq!(until("the truth", || come.take()).0, pose(1.0));
}

#[test]
fn who_comes_late_gets_what_was_kept() {
    let peers = peers();
    let node = peers.ours.node("/", "early").expect("a node");
    let kept = node.publisher("/kept", Quality::transient_local(1)).expect("out");
    kept.publish(&pose(9.0)).expect("sent");
    let late = peers.theirs.node("/", "late").expect("a node");
    let come = late.subscription::<PoseStamped>("/kept", Quality::transient_local(1)).expect("in");
    assert_eq!(until("what was kept", || come.take()).0, pose(9.0));
}

#[test]
fn simulated_time_comes_from_the_clock_topic() {
    let peers = peers();
    let node = peers.ours.node("/", "simulated").expect("a node");
    let simulator = peers.theirs.node("/", "simulator").expect("a node");
    let mut clock = Clock::simulated(&node).expect("a subscription");
    let time = simulator.publisher::<rosgraph_msgs::Clock>("/clock", Quality::BEST_EFFORT).expect("out");
    assert_eq!(clock.now(), None);
    // The foreign node hears `/clock` as another type and must not match.
    until("a match", || (time.matched() >= 1).then_some(()));
    let mut tell = |seconds: f64| {
        let mut jump = None;
        until("simulated time", || {
            let clock_message = rosgraph_msgs::Clock { clock: Time::from_seconds(seconds) };
            time.publish(&clock_message).expect("sent");
            jump = jump.or(clock.poll());
            (clock.now() == Some(seconds)).then_some(())
        });
        jump
    };
    assert_eq!(tell(10.0), None);
    assert_eq!(tell(10.5), None);
    assert_eq!(tell(2.5), Some(8.0));
}
