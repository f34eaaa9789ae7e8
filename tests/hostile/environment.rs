//! What the environment and the ROS arguments ask for is done, or refused with a remedy.

use super::support::*;

#[test]
fn what_cannot_be_honoured_ends_with_code_2_and_a_remedy() {
    let cases = [
        (Some(("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF")), &[][..], "--transport shm"),
        (Some(("ROS_STATIC_PEERS", "10.0.0.7")), &[], "unset it"),
        (None, &["--ros-args", "-e", "/talker"], "leave it out"),
        (None, &["--ros-args", "--log-config-file", "log.yaml"], "leave it out"),
        (None, &["--ros-args", "--enable-rosout-logs"], "leave it out"),
    ];
    for subcommand in ["node", "robots"] {
        for (variable, words, remedy) in cases {
            let mut command = command(domain(), &[&[subcommand, "square"], words].concat());
            let ended = output(command.envs(variable));
            let said = String::from_utf8_lossy(&ended.stderr);
            assert_eq!(ended.status.code(), Some(2), "{variable:?} {words:?}: {said}");
            assert!(said.contains("help: ") && said.contains(remedy), "{said}");
        }
    }
}

#[test]
fn the_enclave_that_every_node_is_in_is_no_reason_to_refuse() {
    let mut running =
        Running::start(&mut command(domain(), &["-v", "node", "square", "--ros-args", "-e", "/"]));
    let lines = running.lines();
    until("the node", || lines.try_iter().find(|line| line.contains("25 robots at 20.0 Hz")));
    assert_eq!(running.terminate(), Some(0));
}
