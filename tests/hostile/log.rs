//! Text from the network in the log: short, on its line, and not again and again.

use std::io::Write;
use std::time::{Duration, Instant};

use flockform::messages::geometry_msgs::{Pose, PoseStamped};
use flockform::messages::std_msgs::Header;
use flockform::ros::edge::Quality;

use super::support::*;

/// Bytes that a pipe holds \[1\].
const PIPE: usize = 65_536;
/// A second is promised; a machine with other work takes longer.
const LEAVING: Duration = Duration::from_secs(3);

#[test]
fn a_frame_id_forges_no_line_and_fills_no_disk() {
    let domain = domain();
    let external = ["node", "square", "--set", "leaders[0].program={ kind = \"external\" }"];
    let mut node = Running::start(&mut command(domain, &external));
    let lines = node.lines();
    let edge = edge(domain);
    let stranger = edge.node("/", "stranger").expect("a node");
    let topic =
        stranger.publisher::<PoseStamped>("/robot_1/leader_pose", Quality::reliable(1)).expect("says");
    until("the node listens", || (topic.matched() > 0).then_some(()));
    let forged = format!("map\nERROR flockform: all is lost\r\u{1b}[2J{}", "x".repeat(100_000));
    let header = Header { frame_id: forged, ..Header::default() };
    let message = PoseStamped { header, pose: Pose::planar([1.0, 1.0], 0.0) };
    let since = Instant::now();
    while since.elapsed() < Duration::from_secs(3) {
        // Whether it is sent now or later does not matter.
        let _ = topic.publish(&message);
        std::thread::sleep(Duration::from_millis(10));
    }
    assert_eq!(node.terminate(), Some(0));
    let lines: Vec<String> = lines.iter().collect();
    let told: Vec<&String> = lines.iter().filter(|line| line.contains("all is lost")).collect();
    assert_eq!(told.len(), 1, "{lines:#?}");
    assert!(told[0].contains("frame `map\\nERROR flockform: all is lost\\r\\u{1b}[2Jxxx"), "{}", told[0]);
    let length: usize = lines.iter().map(String::len).sum();
    assert!(length < 5_000, "{length} bytes");
}

#[test]
fn a_node_without_poses_says_so_once_and_a_wrong_frame_is_named() {
    let domain = domain();
    let mut node = Running::start(&mut command(domain, &["node", "square"]));
    let lines = node.lines();
    let mut all = Vec::new();
    let mut line = |words: &str| {
        until(words, || {
            all.extend(lines.try_iter());
            all.iter().find(|line| line.contains(words)).cloned()
        })
    };
    let silent = line("no pose has come for 5 s");
    assert!(silent.starts_with("[WARN]") && silent.contains("/robot_1/pose"), "{silent}");
    let edge = edge(domain);
    let stranger = edge.node("/", "stranger").expect("a node");
    let topic = stranger.publisher::<PoseStamped>("/robot_1/pose", Quality::reliable(1)).expect("says");
    until("the node listens", || (topic.matched() > 0).then_some(()));
    let header = Header { frame_id: "odom".into(), ..Header::default() };
    topic.publish(&PoseStamped { header, pose: Pose::planar([0.0, 0.0], 0.0) }).expect("sent");
    let wrong = line("robot_1: a pose is in the frame `odom`, not in `");
    assert!(wrong.contains("node.frame_id"), "{wrong}");
    assert_eq!(node.terminate(), Some(0));
    all.extend(lines.iter());
    assert_eq!(all.iter().filter(|line| line.contains("no pose has come")).count(), 1, "{all:#?}");
}

#[test]
fn a_node_logs_as_ros_2_nodes_do() {
    let renamed = ["--ros-args", "-r", "__node:=keeper", "-r", "__ns:=/fleet"];
    let start = |words: &[&str], format: Option<&str>| {
        let mut command = command(domain(), &[&["node", "square"], &renamed[..], words].concat());
        command.env_remove("RUST_LOG").env_remove("RCUTILS_CONSOLE_OUTPUT_FORMAT");
        Running::start(command.envs(format.map(|format| ("RCUTILS_CONSOLE_OUTPUT_FORMAT", format))))
    };
    let first = |words: &[&str], format: Option<&str>| {
        let mut node = start(words, format);
        let lines = node.lines();
        // There may be a warning before, of a loopback device without multicast.
        let line = until("a line", || lines.try_iter().find(|line| line.contains("25 robots at 20.0 Hz")));
        assert_eq!(node.terminate(), Some(0));
        line
    };
    let line = first(&[], None);
    let (head, text) = line.split_once("]: ").expect("a head and a text");
    let (severity, rest) = head.split_once("] [").expect("a severity");
    let (time, logger) = rest.split_once("] [").expect("a time");
    assert_eq!((severity, logger), ("[INFO", "fleet.keeper"));
    let digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    assert!(time.split_once('.').is_some_and(|(s, ns)| digits(s) && digits(ns) && ns.len() == 9), "{line}");
    assert!(text.starts_with("`square`: 25 robots"), "{line}");
    let line = first(&[], Some("{name}|{severity}|{message}|{nothing}"));
    assert!(line.starts_with("fleet.keeper|INFO|") && line.ends_with("|{nothing}"), "{line}");
    // Quieter by name, as the node is called now.
    let mut quiet = start(&["--log-level", "fleet.keeper:=error"], None);
    let lines = quiet.lines();
    std::thread::sleep(Duration::from_secs(2));
    assert_eq!(quiet.terminate(), Some(0));
    assert_eq!(lines.iter().collect::<Vec<_>>(), Vec::<String>::new());
}

#[test]
fn programs_whose_log_nothing_reads_fly_on_and_end_when_asked() {
    let domain = domain();
    // Full from the beginning: not a line of theirs finds place.
    let (_reader, mut pipe) = std::io::pipe().expect("a pipe");
    pipe.write_all(&[b'.'; PIPE]).expect("as much as a pipe holds");
    let start = |subcommand: &str| {
        let mut command = command(domain, &["-vv", subcommand, "square"]);
        command.env("RUST_LOG", "trace").stderr(pipe.try_clone().expect("another end"));
        Running::start(&mut command)
    };
    let (robots, node) = (start("robots"), start("node"));
    let edge = edge(domain);
    let listener = edge.node("/", "listener").expect("a node");
    let targets = listener.subscription::<PoseStamped>("/robot_1/target_pose", Quality::reliable(1));
    let targets = targets.expect("may subscribe");
    let mut count = 0;
    until("five seconds of targets", || {
        count += std::iter::from_fn(|| targets.take()).take(100).count();
        std::thread::sleep(Duration::from_millis(5));
        (count > 100).then_some(())
    });
    for mut running in [node, robots] {
        let since = Instant::now();
        assert_eq!(running.terminate(), Some(0));
        println!("ended after {:?}", since.elapsed());
        assert!(since.elapsed() < LEAVING, "{:?}", since.elapsed());
    }
    for subcommand in ["robots", "node"] {
        let mut command = command(domain, &["-vv", subcommand, "square", "--transport", "shm"]);
        command.env("FLOCKFORM_SHM_DOMAIN", format!("log{}", std::process::id()));
        let mut running = Running::start(command.stderr(pipe.try_clone().expect("another end")));
        std::thread::sleep(Duration::from_secs(2));
        let since = Instant::now();
        assert_eq!(running.terminate(), Some(0));
        assert!(since.elapsed() < LEAVING, "{:?}", since.elapsed());
    }
}

#[test]
fn a_node_says_where_it_can_be_reached() {
    let domain = domain();
    for (subcommand, expected) in [
        (
            "node",
            &["/fleet/flockform on ROS domain ", "/fleet/robot_1/pose", "/fleet/robot_1/target_pose"][..],
        ),
        ("robots", &["/fleet/robots on ROS domain ", "/fleet/robot_1/target_pose"]),
    ] {
        let words = [subcommand, "square", "--ros-args", "-r", "__ns:=/fleet"];
        let mut command = command(domain, &words);
        command.env_remove("RUST_LOG");
        let mut running = Running::start(&mut command);
        let lines = running.lines();
        let mut said = String::new();
        until("where it is reached", || {
            said.extend(lines.try_iter());
            expected.iter().all(|one| said.contains(one)).then_some(())
        });
        assert!(said.contains(&format!("ROS domain {domain}")), "{said}");
        assert_eq!(running.terminate(), Some(0));
    }
}
