//! Nodes that have left are in no graph: Fast DDS, which takes no leave without a key hash.

use std::time::{Duration, Instant};

use super::fastdds::started;
use super::support::*;
use crate::waits::within;

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
        assert!(took < Duration::from_secs(1), "{command}: {took:?}");
    }
}
