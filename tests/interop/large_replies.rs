//! Replies larger than a packet, to a client on Fast DDS, which takes no fragments of them.

use std::time::Duration;

use flockform::messages::rcl_interfaces::Names;
use flockform::messages::wire::encode;

use super::fastdds::{called, started};
use super::support::*;

/// Parameters whose descriptions are 1.4 kB.
const NAMES: [&str; 12] = [
    "rate",
    "state_rate",
    "speed_limit",
    "acceleration_limit",
    "clearance",
    "damping",
    "sweeps",
    "autostart",
    "use_sim_time",
    "pose_topic",
    "target_topic",
    "leader_topic",
];

/// A request for the descriptions of these, in hexadecimal.
fn request(names: &[&str]) -> String {
    let mut bytes = vec![0, 1, 0, 0];
    let names = names.iter().map(|&name| name.to_owned()).collect();
    let mut body = Vec::new();
    encode(&Names { names }, &mut body).expect("plain");
    bytes.append(&mut body);
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[test]
#[ignore = "needs g++, Fast DDS (Debian's libfastrtps-dev), and a network device with ordinary packets"]
fn a_client_on_fast_dds_gets_large_replies_and_those_after_them() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let domain = domain();
    let _node = flockform(domain, &["node", "square"]);
    let service = ["flockform/describe_parameters", "rcl_interfaces::srv::dds_::DescribeParameters"];
    let requests = [request(&NAMES[..1]), request(&[NAMES; 4].concat()), request(&NAMES[..1])];
    let mut arguments = vec![domain.to_string()];
    arguments.extend(service.map(str::to_owned));
    arguments.extend(requests);
    let (_client, lines) = started("fastdds_client", &arguments, folder.path());
    let next = || called(&lines.recv_timeout(Duration::from_secs(40)).expect("a reply, or none in 8 s"));
    let [small, large, after] = [(); 3].map(|()| next());
    println!("{small:?} {large:?} {after:?}");
    assert!(small.0 < 2000.0, "{small:?}");
    assert!(large.1 > 5000, "no large reply: {large:?}");
    assert!(large.0 < 2000.0 && after.0 < 2000.0, "{large:?}, then {after:?}");
    assert_eq!(after.1, small.1);
}
