//! Nodes that have left are in no graph: neither in that of Fast DDS, which takes no leave without a key hash, nor in that of
//! Cyclone DDS.

use std::process::Command;
use std::time::{Duration, Instant};

use super::fastdds::started;
use super::support::*;
use crate::signals::signal;
use crate::waits::within;

/// Longest time from the end of a process to its leave from a graph.
const GONE: Duration = Duration::from_secs(1);

#[test]
#[ignore = "needs g++ and Fast DDS (Debian's libfastrtps-dev)"]
fn a_node_that_ends_leaves_the_graph_of_fast_dds_within_a_second() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let domain = domain();
    let (_peer, lines) = started("fastdds_graph", &[domain.to_string()], folder.path());
    let next = |what: &str| {
        within(PATIENCE, what, || {
            lines.try_iter().find_map(|line| line.strip_prefix(what).map(|who| who.trim().to_owned()))
        })
    };
    next("listening");
    for command in ["node", "robots"] {
        let mut running = flockform(domain, &[command, "square"]);
        let found = next("found");
        assert_eq!(running.terminate(), Some(0), "{command}");
        let since = Instant::now();
        assert_eq!(next("left"), found, "{command}");
        let took = since.elapsed();
        println!("{command}: gone after {took:?}");
        assert!(took < GONE, "{command}: {took:?}");
    }
}

/// Participants of others that Cyclone DDS knows.
fn participants(line: &serde_json::Value) -> Option<usize> {
    Some(line["participants"].as_array()?.len())
}

#[test]
#[ignore = "needs the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn a_node_that_ends_leaves_the_graph_of_cyclone_within_a_second() {
    let domain = domain();
    let graph = Peer::start("graph.py", domain, "");
    graph.until("the graph", |line| participants(line).filter(|&count| count == 0));
    for command in ["node", "robots"] {
        let mut running = flockform(domain, &[command, "square"]);
        graph.until(command, |line| participants(line).filter(|&count| count == 1));
        assert_eq!(running.terminate(), Some(0), "{command}");
        let since = Instant::now();
        graph.until("the leave", |line| participants(line).filter(|&count| count == 0));
        let took = since.elapsed();
        println!("{command}: gone after {took:?}");
        assert!(took < GONE, "{command}: {took:?}");
    }
}

#[test]
#[ignore = "needs g++ and Fast DDS (Debian's libfastrtps-dev)"]
fn the_signals_of_a_launcher_are_one_and_the_node_takes_its_leave() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let domain = domain();
    let (_peer, lines) = started("fastdds_graph", &[domain.to_string()], folder.path());
    let next = |what: &str| {
        within(PATIENCE, what, || {
            lines.try_iter().find_map(|line| line.strip_prefix(what).map(|who| who.trim().to_owned()))
        })
    };
    next("listening");
    for command in ["node", "robots"] {
        let mut running = flockform(domain, &[command, "square"]);
        let found = next("found");
        let supervisor = running.0.id();
        // As `ros2 launch` below `timeout` does: the group and each process in it.
        for process in workers(supervisor).into_iter().chain([supervisor, supervisor]) {
            signal("INT", process);
        }
        std::thread::sleep(Duration::from_millis(50));
        workers(supervisor).into_iter().for_each(|worker| _ = crate::signals::is_sent("INT", worker));
        let code = within(PATIENCE, "the end", || running.0.try_wait().expect("a child")).code();
        let since = Instant::now();
        assert_eq!(code, Some(0), "{command}");
        assert_eq!(next("left"), found, "{command}");
        let took = since.elapsed();
        assert!(took < GONE, "{command}: {took:?}");
    }
}

/// Processes that another has started.
fn workers(of: u32) -> Vec<u32> {
    let listed = Command::new("pgrep").args(["-P", &of.to_string()]).output().expect("pgrep runs");
    String::from_utf8_lossy(&listed.stdout).split_whitespace().filter_map(|one| one.parse().ok()).collect()
}
