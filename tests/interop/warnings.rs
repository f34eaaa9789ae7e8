//! Warnings of a node in its log: of poses that are dropped, a line at the first of each cause and robot.

use std::io::Read;
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::json;

use super::support::*;

#[test]
#[ignore = "needs the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn poses_in_a_wrong_frame_are_one_line_for_each_robot() {
    let domain = domain();
    let mut command = Command::new(env!("CARGO_BIN_EXE_flockform"));
    command.args(["node", "square"]).env("ROS_DOMAIN_ID", domain.to_string());
    command.env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST").stdin(Stdio::null()).stderr(Stdio::piped());
    let mut node = Running(command.spawn().expect("the binary starts"));
    let mut robots = Square::new(&[]).robots(domain);
    robots.until("everybody is sent targets", |report| {
        received(report).values().all(|&count| count > 0).then_some(())
    });
    robots.send(json!({"robot_3": "frame", "robot_8": "frame", "robot_9": "past"}));
    // Some eighty poses of each, and no ten seconds.
    robots.during(Duration::from_secs(4), |_| ());
    assert_eq!(node.terminate(), Some(0));
    let mut text = String::new();
    let mut log = node.0.stderr.take().expect("piped");
    log.read_to_string(&mut text).expect("text");
    let lines = |robot: &str, words: &str| {
        let about = format!("{robot}: ");
        let is_one =
            |line: &&str| line.starts_with("[WARN]") && line.contains(&about) && line.contains(words);
        text.lines().filter(is_one).count()
    };
    assert_eq!([lines("robot_3", "frame"), lines("robot_8", "frame")], [1, 1], "{text}");
    assert_eq!(lines("robot_9", "old"), 1, "{text}");
    assert_eq!(lines("robot_4", "") + lines("robot_9", "frame"), 0, "{text}");
}
