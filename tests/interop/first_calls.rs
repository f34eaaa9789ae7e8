//! The first calls of clients on Fast DDS, which come before the middleware knows their writers.

use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration;

use super::fastdds::{called, started};
use super::support::*;

const CALLS: usize = 300;

#[test]
#[ignore = "needs g++ and Fast DDS (Debian's libfastrtps-dev)"]
fn no_first_call_waits_for_a_heartbeat() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let domain = domain();
    let _node = flockform(domain, &["node", "square"]);
    let arguments = [domain.to_string(), CALLS.to_string()];
    let (_client, lines) = started("fastdds_client", &arguments, folder.path());
    let mut took: Vec<f64> = Vec::new();
    while took.len() < CALLS {
        match lines.recv_timeout(Duration::from_secs(40)) {
            Ok(line) => took.push(called(&line).0),
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {
                panic!("the client fell silent after {} calls", took.len())
            }
        }
    }
    took.sort_by(f64::total_cmp);
    println!(
        "half of {CALLS} first calls within {:.1} ms, all within {:.1} ms",
        took[CALLS / 2],
        took[CALLS - 1]
    );
    let late = took.iter().filter(|took| **took > 2000.0).count();
    assert_eq!(late, 0, "of {CALLS}; the last after {} ms", took[CALLS - 1]);
}
