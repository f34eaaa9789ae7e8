//! Who may command: not even the command line loosens the limits of the swarm file.

use super::support::*;

fn refused(arguments: &[&str], says: &[&str]) {
    let ended = output(&mut command(domain(), &[&["node", "square"], arguments].concat()));
    let said = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(2), "{arguments:?}: {said}");
    says.iter().for_each(|part| assert!(said.contains(part), "{arguments:?}: {said}"));
}

#[test]
fn limits_are_not_switched_off_from_the_command_line() {
    for value in ["0", "0.0", "1.5", "-1"] {
        refused(&["--ros-args", "-p", &format!("speed_limit:={value}")], &["speed_limit"]);
    }
    refused(
        &["--ros-args", "-p", "clearance:=0.0"],
        &["clearance = 0.0 is not within 0.3 to 1000.0", "limits.clearance"],
    );
    refused(
        &["--set", "limits.acceleration=2.0", "--ros-args", "-p", "acceleration_limit:=0"],
        &["acceleration_limit", "the swarm file sets one"],
    );
    // Targets are made for robots that brake as the file says.
    let brakes =
        ["--set", "flight.model={ kind = \"double-integrator\" }", "--set", "limits.acceleration=1.0"];
    refused(
        &[&brakes[..], &["--ros-args", "-p", "acceleration_limit:=0.9"]].concat(),
        &["acceleration_limit", "change it in the swarm file"],
    );
}

#[test]
fn a_swarm_that_takes_nobody_s_word_waits_for_nobody_s() {
    let none = ["--set", "node.commands=none"];
    let external = ["--set", "leaders[0].program={ kind = \"external\" }"];
    refused(
        &[none, external].concat(),
        &["node.commands", "\"none\" forbids commands to `robot_1`", "help: "],
    );
    let waits = ["--ros-args", "-p", "autostart:=false"];
    refused(&[&none[..], &waits].concat(), &["node.commands", "lets no peer make the node active", "help: "]);
    refused(&["--set", "node.commands=some"], &["node.commands", "stop-only"]);
}
