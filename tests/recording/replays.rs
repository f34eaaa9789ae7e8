//! A recorded flight flies again as it flew.

use std::process::Stdio;
use std::time::{Duration, Instant};

use flockform::record::replay::replay_file;
use flockform::record::{Reader, RecordError};

use crate::program::*;

fn record(swarm: &[&str], folder: &std::path::Path) {
    let arguments = [&["swarm"], swarm, &["-q", "--out", "o", "--record", "flight.mcap"]].concat();
    says(0, &arguments, folder);
}

#[test]
fn a_recorded_flight_replays_to_the_bit_whatever_its_robots_suffer() {
    let faults = "flight.faults=[{robot=\"robot_7\",what={kind=\"dead\"},at=2.0},{robot=\"robot_9\",what={kind=\"frozen\"},at=1.0}]";
    let suffering =
        ["square", "--set", "flight.loss=0.3", "--set", "flight.noise=0.01", "--set", "flight.delay=2"];
    let driven = ["square", "--set", "node.pose_type=odometry"];
    let broken = ["square", "--set", faults];
    let ranges = "ranges={ reach = 3.5, noise = 0.02, tolerance = 0.2 }";
    let measured = ["square", "--set", faults, "--set", ranges, "--set", "flight.delay=1"];
    let commands = "flight.commands=[{after=10,what={kind=\"move-obstacle\",obstacle=0,by=[0.0,0.3]}},{after=20,what={kind=\"channel\",noise=0.02,delay=1,loss=0.1}},{after=30,what={kind=\"lead\",robot=\"robot_1\",to=[0.5,0.5]}}]";
    let commanded = ["gap", "--set", commands];
    let short = ["--set", "flight.duration=5.0", "--set", "flight.bounds={}"];
    for swarm in [&suffering[..], &driven, &broken, &measured, &commanded, &["faulty-robot"]] {
        let folder = temporary();
        record(&[swarm, &short].concat(), folder.path());
        let report = replay_file(&folder.path().join("flight.mcap"), None, &[], 0.0).expect("readable");
        assert!(report.holds(), "{swarm:?}: {:?}", report.robots);
        assert_eq!(report.largest(), 0.0);
        assert!(report.ticks >= 100 && report.poses > 1000, "{swarm:?}: {} {}", report.ticks, report.poses);
        assert!(report.robots.iter().all(|robot| robot.recorded > 0), "{swarm:?}: {:?}", report.robots);
        assert_eq!(report.damage, None);
    }
}

#[test]
fn a_flight_whose_robots_are_never_heard_replays_too() {
    for network in ["flight.loss=1.0", "flight.delay=60"] {
        let folder = temporary();
        let short = ["--set", "flight.duration=5.0", "--set", "flight.bounds={}"];
        record(&[&["square", "--set", network], &short[..]].concat(), folder.path());
        let report = replay_file(&folder.path().join("flight.mcap"), None, &[], 0.0).expect("readable");
        assert!(report.holds() && report.ticks >= 100, "{network}: {report:?}");
        assert!(report.robots.iter().all(|robot| robot.recorded == 0), "{network}: {:?}", report.robots);
        let elsewhere = ["--set", "node.pose_topic=elsewhere/{name}", "--set", "node.target_topic=to/{name}"];
        let said = says(2, &[&["replay", "flight.mcap"], &elsewhere[..]].concat(), folder.path());
        assert!(said.contains("its topics are not those"), "{network}: {said}");
    }
}

#[test]
fn a_changed_rule_is_told_robot_by_robot() {
    let folder = temporary();
    record(&["square", "--set", "flight.duration=5.0", "--set", "flight.bounds={}"], folder.path());
    let said = says(0, &["replay", "flight.mcap", "--tolerance", "0"], folder.path());
    assert!(said.contains("largest difference 0e0 m, within"), "{said}");
    let slower = ["replay", "flight.mcap", "--set", "limits.speed=0.1"];
    let said = says(1, &slower, folder.path());
    assert!(said.contains("NOT within") && said.contains("robot_13"), "{said}");
    let said = says(1, &[&slower[..], &["--json"]].concat(), folder.path());
    let report = json(&said);
    let robots = report["robots"].as_array().expect("robots");
    let changed = robots.iter().filter(|robot| robot["differ"].as_u64() > Some(0)).count();
    assert!(changed > 0 && robots.iter().all(|robot| robot["only_recorded"] == 0), "{said}");
    // A wide enough tolerance forgives it.
    says(0, &[&slower[..], &["--tolerance", "100"]].concat(), folder.path());
}

#[test]
fn a_recording_that_breaks_off_is_replayed_as_far_as_it_goes() {
    let folder = temporary();
    record(&["square", "--set", "flight.duration=5.0", "--set", "flight.bounds={}"], folder.path());
    let path = folder.path().join("flight.mcap");
    let bytes = std::fs::read(&path).expect("written");
    std::fs::write(&path, &bytes[..bytes.len() / 2]).expect("cut");
    let report = replay_file(&path, None, &[], 0.0).expect("readable");
    assert!(report.damage.is_some() && report.holds() && report.ticks > 10, "{report:?}");
    let said = says(1, &["replay", "flight.mcap"], folder.path());
    assert!(said.contains("breaks off") && said.contains("is not replayed"), "{said}");
    // Before the swarm file is whole, and before the first message is.
    let of_first_chunk = {
        let mut bytes = bytes.clone();
        let at = bytes.windows(4).position(|four| four == b"zstd").expect("compressed") + 4 + 8 + 100;
        bytes[at] ^= 0xff;
        bytes
    };
    for (bytes, words) in [(&bytes[..300], "does not say which swarm"), (&of_first_chunk[..], "no poses")] {
        std::fs::write(&path, bytes).expect("damaged");
        let said = says(2, &["replay", "flight.mcap"], folder.path());
        let (damage, blamed) =
            (said.find("breaks off").expect("the damage"), said.find(words).expect("words"));
        assert!(damage < blamed, "{said}");
    }
    // Behind the last message nothing is lost.
    let end = bytes.len() - mcap::MAGIC.len() - 40;
    std::fs::write(&path, &bytes[..end]).expect("cut");
    assert!(says(0, &["replay", "flight.mcap"], folder.path()).contains("within"));
}

#[test]
fn what_cannot_be_replayed_is_refused_by_name() {
    let folder = temporary();
    std::fs::write(folder.path().join("thesis.mcap"), "years of work").expect("written");
    let said = says(2, &["replay", "thesis.mcap"], folder.path());
    assert!(said.contains("thesis.mcap is no MCAP file") && said.contains("help:"), "{said}");
    let said = says(2, &["replay", "nowhere.mcap"], folder.path());
    assert!(said.contains("nowhere.mcap"), "{said}");
    says(0, &["run", "tension", "--steps", "5", "-q", "--out", "o", "--record", "run.mcap"], folder.path());
    let said = says(2, &["replay", "run.mcap"], folder.path());
    assert!(said.contains("does not say which swarm flew") && said.contains("--swarm"), "{said}");
    let said = says(2, &["replay", "run.mcap", "--swarm", "square"], folder.path());
    assert!(said.contains("has no poses of this swarm's robots"), "{said}");
    let again = ["run", "tension", "--steps", "5", "-q", "--out", "p", "--record", "run.mcap"];
    let said = says(2, &again, folder.path());
    assert!(said.contains("run.mcap exists"), "{said}");
    assert!(!folder.path().join("p").exists());
    let error = Reader::open(&folder.path().join("thesis.mcap")).err().expect("no MCAP");
    assert!(matches!(error, RecordError::NoMcap { .. }));
}

#[test]
fn force_replaces_recordings_and_nothing_else() {
    let folder = temporary();
    let short = ["--set", "flight.duration=0.5", "--set", "flight.bounds={}", "-q", "--no-report"];
    let fly = |code: i32, out: &str, more: &[&str]| {
        let all = [&["swarm", "square", "--out", out, "--record", "flight.mcap"][..], &short, more].concat();
        says(code, &all, folder.path())
    };
    let file = folder.path().join("flight.mcap");
    std::fs::write(&file, "years of work").expect("writable");
    let said = fly(2, "a", &["--force"]);
    assert!(said.contains("is no MCAP file") && said.contains("help:"), "{said}");
    assert_eq!(std::fs::read_to_string(&file).expect("there"), "years of work");
    assert!(!folder.path().join("a").exists(), "nothing was flown");
    std::fs::remove_file(&file).expect("there");
    #[cfg(unix)]
    {
        // Neither through a link in the place of the file, nor in that of what is not finished yet.
        let victim = folder.path().join("thesis.mcap");
        std::fs::write(&victim, [&mcap_magic()[..], b"mine"].concat()).expect("writable");
        std::os::unix::fs::symlink(&victim, &file).expect("linked");
        fly(2, "b", &["--force"]);
        std::fs::remove_file(&file).expect("there");
        std::os::unix::fs::symlink(&victim, folder.path().join("flight.mcap.part")).expect("linked");
        fly(0, "c", &[]);
        assert!(std::fs::read(&victim).expect("there").ends_with(b"mine"));
    }
    let first = std::fs::read(&file).expect("recorded");
    // Not without force.
    fly(2, "d", &[]);
    assert_eq!(std::fs::read(&file).expect("there"), first);
    fly(0, "d", &["--force"]);
}

/// What an MCAP file begins with.
fn mcap_magic() -> [u8; 8] {
    *b"\x89MCAP0\r\n"
}

/// Sends a child the signal that Ctrl-C would.
#[cfg(unix)]
fn interrupt(child: &mut std::process::Child) {
    signal("INT", child.id());
    assert!(child.wait().expect("ends").success());
}

#[cfg(unix)]
#[test]
fn a_live_node_s_recording_replays_to_the_bit_with_the_parameters_it_was_given() {
    let folder = temporary();
    let domain = (101 + std::process::id() % 101).to_string();
    let start = |arguments: &[&str]| {
        let mut command = command(arguments, folder.path());
        command.env("ROS_DOMAIN_ID", &domain);
        command.env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST").stdout(Stdio::null()).stderr(Stdio::null());
        command.spawn().expect("the program starts")
    };
    let mut robots = start(&["robots", "square"]);
    let given = ["--ros-args", "-p", "speed_limit:=0.4", "-p", "rate:=30.0"];
    let mut node = start(&[&["node", "square", "--record", "live.mcap"][..], &given].concat());
    // Several chunks on the disk: poses have come, targets have gone.
    let part = folder.path().join("live.mcap.part");
    let patience = Instant::now();
    while std::fs::metadata(&part).map_or(0, |part| part.len()) < 100_000 {
        assert!(patience.elapsed() < Duration::from_secs(120), "nothing is recorded");
        std::thread::sleep(Duration::from_millis(50));
    }
    interrupt(&mut node);
    interrupt(&mut robots);
    let replayed = |set: &[String]| {
        replay_file(&folder.path().join("live.mcap"), None, set, 0.0).expect("readable, and closed")
    };
    let report = replayed(&[]);
    assert_eq!(report.damage, None);
    assert!(report.holds() && report.ticks > 10, "{report:?}");
    assert!(report.robots.iter().all(|robot| robot.recorded > 0), "{report:?}");
    // What is changed today is not undone by what was given then.
    assert!(!replayed(&["limits.speed=0.1".to_owned()]).holds());
}
