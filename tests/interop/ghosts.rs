//! Nodes that have left are in no graph: Fast DDS, which takes no leave without a key hash.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use super::support::*;
use crate::waits::within;

/// A participant of Fast DDS, compiled here, and what it prints.
fn graph(folder: &std::path::Path, domain: u16) -> (Running, Receiver<String>) {
    let program = folder.join("fastdds_graph");
    let source = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/interop/fastdds_graph.cpp");
    let compiled = Command::new("g++")
        .args(["-std=c++17", "-o"])
        .arg(&program)
        .args([source, "-lfastrtps", "-lfastcdr"])
        .status()
        .expect("g++ is there");
    assert!(compiled.success(), "the peer is compiled with Debian's libfastrtps-dev");
    let mut child = Command::new(program)
        .arg(domain.to_string())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("it starts");
    let output = BufReader::new(child.stdout.take().expect("piped"));
    let (say, lines) = channel();
    std::thread::spawn(move || output.lines().map_while(Result::ok).try_for_each(|line| say.send(line)));
    (Running(child), lines)
}

#[test]
#[ignore = "needs g++ and Fast DDS (Debian's libfastrtps-dev)"]
fn a_node_that_ends_leaves_the_graph_of_fast_dds_within_a_second() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let domain = domain();
    let (_peer, lines) = graph(folder.path(), domain);
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
        assert!(took < Duration::from_secs(1), "{command}: {took:?}");
    }
}
