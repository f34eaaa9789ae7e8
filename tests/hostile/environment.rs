//! What the environment and the ROS arguments ask for is done, or refused with a remedy.

use super::support::*;

#[test]
fn what_cannot_be_honoured_ends_with_code_2_and_a_remedy() {
    let cases = [
        (&[("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF")][..], &[][..], "--transport shm"),
        (&[("ROS_STATIC_PEERS", "10.0.0.7")], &[], "unset it"),
        (&[("ROS_DISCOVERY_SERVER", "10.0.0.7:11811")], &[], "unset it"),
        (&[("RMW_IMPLEMENTATION", "rmw_zenoh_cpp")], &[], "rmw_fastrtps_cpp"),
        (&[("ROS_SECURITY_ENABLE", "true"), ("ROS_SECURITY_STRATEGY", "Enforce")], &[], "help: "),
        (&[], &["--ros-args", "-e", "talker"], "name it as in"),
        (&[], &["--ros-args", "--log-config-file", "log.yaml"], "leave it out"),
        (&[], &["--ros-args", "--enable-external-lib-logs"], "leave it out"),
    ];
    for subcommand in ["node", "robots"] {
        for (variables, words, remedy) in cases {
            let mut command = command(domain(), &[&[subcommand, "square"], words].concat());
            let ended = output(command.envs(variables.iter().copied()));
            let said = String::from_utf8_lossy(&ended.stderr);
            assert_eq!(ended.status.code(), Some(2), "{variables:?} {words:?}: {said}");
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

#[test]
fn an_enclave_without_security_is_no_reason_to_refuse_and_a_warning() {
    let mut running =
        Running::start(&mut command(domain(), &["node", "square", "--ros-args", "-e", "/talker"]));
    let lines = running.lines();
    let warning = until("a warning", || lines.try_iter().find(|line| line.contains("in the clear")));
    assert!(warning.contains("WARN") && warning.contains("--enclave /talker"), "{warning}");
    assert_eq!(running.terminate(), Some(0));
}

#[test]
fn a_profile_of_another_middleware_is_no_reason_to_refuse_and_a_warning() {
    for subcommand in ["node", "robots"] {
        let mut command = command(domain(), &[subcommand, "square"]);
        command.env("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp").env("CYCLONEDDS_URI", "file:///profile.xml");
        let mut running = Running::start(&mut command);
        let lines = running.lines();
        let warning = until("a warning", || lines.try_iter().find(|line| line.contains("CYCLONEDDS_URI")));
        assert!(warning.contains("WARN") && warning.contains("no effect"), "{warning}");
        assert_eq!(running.terminate(), Some(0));
    }
}
