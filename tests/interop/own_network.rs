//! The same in a network of its own: nothing but loopback, with multicast, and nobody else on it.

use std::process::Command;

const INNER: &str = "flight::robots_of_a_peer_fly_the_manoeuvre_that_the_node_leads";

#[test]
#[ignore = "needs unshare(1) and leave to use it, and the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn robots_of_a_peer_fly_in_a_network_namespace_of_their_own() {
    let script = "ip link set lo up multicast on && ip route add 239.0.0.0/8 dev lo \
         && exec \"$0\" --ignored --exact --nocapture \"$1\"";
    let here = std::env::current_exe().expect("a path");
    let inside = Command::new("unshare")
        .args(["--map-root-user", "--net", "sh", "-c", script])
        .arg(here)
        .arg(INNER)
        .output()
        .expect("unshare starts");
    let said = String::from_utf8_lossy(&inside.stdout);
    let wrong = String::from_utf8_lossy(&inside.stderr);
    assert!(inside.status.success() && said.contains("1 passed"), "{said}\n{wrong}");
}
